"""Kernel functions compiled by the machine's C compiler, kept in a cache on disk."""

import ctypes
import hashlib
import os
import platform
import shlex
import shutil
import stat
import subprocess
import warnings
from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path

import casadi as ca

from symmotion.errors import plain
from symmotion.forking import ForkedLock
from symmotion.kernels import hessians, kernel, source
from symmotion.whole import synced, workshop

# No contraction to fused multiply-adds and no fast-math: the same bits as the interpreter's.
FLAGS = ("-O2", "-std=gnu11", "-march=native", "-ffp-contract=off", "-fno-math-errno", "-Wno-psabi", "-fPIC", "-shared")
PATIENCE = 120  # seconds; the largest kernels take some
LARGEST = 20_000  # instructions: compilers take more than proportionally long, minutes for 100,000
CHECKSUM = 32  # bytes of SHA-256 behind the library
_BUILDING = ForkedLock()


class MachineFunction:
    """A kernel function as machine code, over any number of nodes; safe to call from several threads.

    path: of the library, as the linker takes it; inputs: the size of each input at a node, zero where it is not
    read; outputs: of each output.
    """

    def __init__(self, path: str):
        library = ctypes.CDLL(path)
        self._call = library.kernel
        self._call.argtypes = (ctypes.c_long, ctypes.c_void_p, ctypes.c_void_p)
        self._call.restype = None
        sizes = ctypes.cast(library.sizes, ctypes.POINTER(ctypes.c_long))
        count = sizes[0]
        self.inputs = tuple(sizes[1 : count + 1])
        self.outputs = tuple(sizes[count + 2 : count + 2 + sizes[count + 1]])

    def __call__(self, count: int, inputs: Sequence[int | None], outputs: Sequence[int]) -> None:
        """Evaluate `count` nodes; inputs, outputs: where their doubles begin, None for what is not read."""
        pointers = ctypes.c_void_p * len(inputs), ctypes.c_void_p * len(outputs)
        self._call(count, pointers[0](*inputs), pointers[1](*outputs))


def load(code: str, kind: str, channels: int, squares: bool, build: bool) -> MachineFunction | None:
    """The machine code of `kernel.derive(code, kind, channels, squares)`, or None where it has to be interpreted.

    build: whether to compile what the cache lacks. The cache, `$SYMMOTION_CACHE` or else
    `symmotion` in the user's cache directory, may be deleted at any time, and may be shared by
    processes. Only what is whole, and could be written by nobody else, is run: other files of that name are made
    anew. `$CC` names a compiler. Functions of more than `LARGEST` instructions stay interpreted.
    Where a compiler is wanted and missing, or fails, a warning says so once.
    """
    key = code, kind, channels, squares
    try:
        return _opened(*key)
    except Unusable:
        pass
    except OSError:
        if not build:
            return None
    with _BUILDING:
        try:
            return _opened(*key)
        except OSError:
            return _built(*key)


def cache_directory() -> Path:
    """Where compiled kernels are kept."""
    own = os.environ.get("SYMMOTION_CACHE")
    try:
        found = Path(own) if own else Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "symmotion"
    except RuntimeError as error:  # of users without an entry in the password file, as in containers
        raise OSError("there is no home directory; name a cache in $SYMMOTION_CACHE") from error
    # The linker would look for a bare name elsewhere.
    return found.absolute()


@lru_cache(maxsize=512)
def _opened(code: str, kind: str, channels: int, squares: bool) -> MachineFunction:
    """From the cache; OSError where it is not there, Unusable where it is no good. Errors are not remembered."""
    return _linked(_path(code, kind, channels, squares))


@lru_cache(maxsize=512)
def _built(code: str, kind: str, channels: int, squares: bool) -> MachineFunction | None:
    """Compiled now; a failure is remembered, so that it is neither tried nor said again."""
    command = _compiler()
    function = kernel.derive(code, kind, channels, squares)
    text = source.c_source(function) if function.n_instructions() <= LARGEST else None
    if text is None:
        return None
    if not command:
        return _stay_interpreted("no C compiler was found: install gcc or clang, or name one in $CC")
    try:
        path = _path(code, kind, channels, squares)
        path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        _require_own(path.parent.stat())
        with workshop(path.parent) as directory:
            c, library = directory / "kernel.c", directory / "kernel.so"
            c.write_text(text)
            failure = _failure([*command, *FLAGS, str(c), "-o", str(library), "-lm"])
            if failure:
                return _stay_interpreted(f"{shlex.join(command)} failed: {failure}")
            machine, part = library.read_bytes(), directory / "part"
            # Whatever the umask: nobody else may write to it. Linkers do not look at what follows a library.
            with open(os.open(part, os.O_WRONLY | os.O_CREAT | getattr(os, "O_BINARY", 0), 0o600), "wb") as handle:
                handle.write(machine + hashlib.sha256(machine).digest())
                synced(handle)
            part.replace(path)
        return _linked(path)
    except OSError as error:
        return _stay_interpreted(f"the cache cannot be used: {error}")


class Unusable(OSError):
    """A file of the cache that is not run: damaged, or not surely ours."""


def _linked(path: Path) -> MachineFunction:
    """The machine code in a file of the cache that is whole and could be written by nobody else, see `load`."""
    _require_own(path.parent.stat())
    try:
        descriptor = os.open(path, os.O_RDONLY | getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_BINARY", 0))
    except FileNotFoundError:
        raise
    except OSError as error:  # a link, say
        raise Unusable(str(error)) from error
    try:
        _require_whole(descriptor)
    except OSError as error:
        os.close(descriptor)
        raise Unusable(str(error)) from error
    # What has been looked at is linked, whatever its name stands for by now. The descriptor stays open: linkers tell
    # libraries apart by their names, and the number must not come to stand for another.
    opened = f"/proc/self/fd/{descriptor}"
    return MachineFunction(opened if os.path.exists(opened) else str(path))


def _require_whole(descriptor: int) -> None:
    """Raise OSError unless an open file is ours alone, and holds a library and its checksum."""
    status = os.fstat(descriptor)
    _require_own(status)
    if not stat.S_ISREG(status.st_mode):
        raise OSError("this is no file")
    with open(descriptor, "rb", closefd=False) as handle:
        machine = handle.read()
    if len(machine) <= CHECKSUM or hashlib.sha256(machine[:-CHECKSUM]).digest() != machine[-CHECKSUM:]:
        raise OSError("the file is damaged")


def _failure(call: Sequence[str]) -> str:
    """Run the compiler; what went wrong in a line, empty where nothing did."""
    try:
        done = subprocess.run(
            call,
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            errors="replace",
            timeout=PATIENCE,
            check=False,
        )
    except subprocess.TimeoutExpired:
        return f"it has not ended after {PATIENCE} s"
    return next(iter(done.stderr.strip().splitlines()), f"exit status {done.returncode}") if done.returncode else ""


@lru_cache(maxsize=512)
def _path(code: str, kind: str, channels: int, squares: bool) -> Path:
    parts = (code, kind, str(channels), str(squares), *_toolchain())
    return cache_directory() / (hashlib.sha256("\0".join(parts).encode()).hexdigest()[:32] + ".so")


@lru_cache(maxsize=1)
def _compiler() -> tuple[str, ...]:
    """The compiler's command, empty where there is none."""
    try:
        named = shlex.split(os.environ.get("CC", ""))
    except ValueError:  # a quote without end
        return ()
    found = shutil.which(named[0]) if named else next(filter(None, map(shutil.which, ("cc", "gcc", "clang"))), None)
    return (found, *named[1:]) if found else ()


@lru_cache(maxsize=1)
def _toolchain() -> tuple[str, ...]:
    """What machine code depends on beside the kernel: how C is made from it, compiler, flags and processor."""
    makers = (Path(m.__file__ or "").read_text(encoding="utf-8") for m in (kernel, hessians, source))
    compiler = [*_compiler(), *FLAGS]
    if _compiler():
        # Which compiler it is, without the milliseconds of asking it.
        status = os.stat(_compiler()[0])
        compiler += [os.path.realpath(_compiler()[0]), str(status.st_size), str(status.st_mtime_ns)]
    return (*makers, ca.CasadiMeta.version(), *compiler, platform.machine(), _processor())


def _processor() -> str:
    """What tells processors apart between which -march=native differs: a cache may be shared over a network."""
    try:
        with open("/proc/cpuinfo", encoding="utf-8") as handle:
            return next((line for line in handle if line.startswith(("flags", "Features"))), "")
    except OSError:
        return platform.processor()


def _require_own(status: os.stat_result) -> None:
    """Raise OSError where others could have put code into a file or directory."""
    if hasattr(os, "getuid") and (status.st_uid != os.getuid() or status.st_mode & 0o022):
        raise OSError("others may write there; choose another by $SYMMOTION_CACHE")


def _stay_interpreted(reason: str) -> None:
    _say_once(plain(f"kernels are interpreted, which is several times slower: {reason}"))


@lru_cache(maxsize=64)
def _say_once(message: str) -> None:
    warnings.warn(message, RuntimeWarning, stacklevel=2)
