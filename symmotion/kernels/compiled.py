"""Kernel functions compiled by the machine's C compiler, kept in a cache on disk."""

import ctypes
import hashlib
import os
import platform
import shlex
import shutil
import signal
import subprocess
import warnings
from collections.abc import Sequence
from contextlib import suppress
from functools import lru_cache
from pathlib import Path
from time import monotonic

import casadi as ca
import numpy as np

from symmotion import interrupts
from symmotion.errors import plain
from symmotion.forking import LIBRARIES, ForkedLock
from symmotion.kernels import hessians, kernel, listing, source
from symmotion.kernels.cache import CHECKSUM, Unusable, cache_directory, keep, opened, place
from symmotion.kernels.listing import NODES, Listing, machine_source

# No contraction to fused multiply-adds and no fast-math: the same bits as the interpreter's.
FLAGS = ("-O2", "-std=gnu11", "-march=native", "-ffp-contract=off", "-fno-math-errno", "-Wno-psabi", "-fPIC", "-shared")
PATIENCE = 120  # seconds; the largest kernels take some
LOOK = 0.1  # seconds between two looks at whether a compiler is still wanted
LARGEST = 13_000  # instructions: compilers take more than proportionally long, 10 s for these; more are listed
LISTED = ".list"  # what files of lists are called
_BUILDING = ForkedLock(LOOK, interrupts.step)


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
        self._call(count, _pointers(inputs), _pointers(outputs))


class ListedFunction:
    """As `MachineFunction`, of a list of instructions and the library of the machine that carries it out."""

    def __init__(self, path: str, listing: Listing):
        self._listing, self._call = listing, ctypes.CDLL(path).run
        self._call.argtypes = (ctypes.c_long, *[ctypes.c_void_p] * 2, ctypes.c_long, *[ctypes.c_void_p] * 5)
        self._call.restype = None
        self.inputs, self.outputs = (tuple(sizes.tolist()) for sizes in (listing.inputs, listing.outputs))
        arrays = listing.code, listing.constants, listing.inputs, listing.outputs
        self._addresses = [a.ctypes.data for a in arrays]

    def __call__(self, count: int, inputs: Sequence[int | None], outputs: Sequence[int]) -> None:
        registers = np.empty((int(self._listing.registers[0]), NODES))
        addresses = *self._addresses, registers.ctypes.data
        self._call(count, _pointers(inputs), _pointers(outputs), len(self._listing.code), *addresses)


def _pointers(addresses: Sequence[int | None]) -> "ctypes.Array[ctypes.c_void_p]":
    return (ctypes.c_void_p * len(addresses))(*addresses)


Machine = MachineFunction | ListedFunction


def load(code: str, kind: str, channels: int, squares: bool, build: bool) -> Machine | None:
    """The machine code of `kernel.derive(code, kind, channels, squares)`, or None where it has to be interpreted.

    build: whether to compile what the cache lacks. The cache, `$SYMMOTION_CACHE` or else
    `symmotion` in the user's cache directory, may be deleted at any time, and may be shared by
    processes. Only what is whole, and could be written by nobody else, is run: other files of that name are made
    anew. `$CC` names a compiler. Functions of more than `LARGEST` instructions are listed, see `Listing`.
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
    # What a handler of signals raises may be an OSError, as TimeoutError is: it must not pass for one of the cache.
    with _BUILDING, interrupts.kept(), suppress(_Interrupted):
        try:
            return _opened(*key)
        except OSError:
            return _built(*key)


@lru_cache(maxsize=512)
def _opened(code: str, kind: str, channels: int, squares: bool) -> Machine:
    """From the cache; OSError where it is not there, Unusable where it is no good. Errors are not remembered."""
    path = _path(code, kind, channels, squares)
    try:
        return MachineFunction(_linked(path))
    except FileNotFoundError:
        descriptor = opened(path.with_suffix(LISTED))
    with open(descriptor, "rb") as handle:
        return ListedFunction(_machine(), Listing.from_bytes(handle.read()[:-CHECKSUM]))


@lru_cache(maxsize=512)
def _built(code: str, kind: str, channels: int, squares: bool) -> Machine | None:
    """Compiled or listed now; a failure is remembered, so that it is neither tried nor said again."""
    function = kernel.derive(code, kind, channels, squares)
    long = function.n_instructions() > LARGEST
    found = Listing.of(function) if long else source.c_source(function)
    if found is None:
        return None
    if not _compiler():
        return _stay_interpreted("no C compiler was found: install gcc or clang, or name one in $CC")
    try:
        path = _path(code, kind, channels, squares)
        if isinstance(found, str):
            _compile(found, path)
            return MachineFunction(_linked(path))
        try:
            machine = _machine()
        except OSError:
            _compile(machine_source(), _machine_path())
            machine = _machine()
        keep(found.to_bytes(), path.with_suffix(LISTED))
        return ListedFunction(machine, found)
    except CompilerError as error:
        return _stay_interpreted(str(error))
    except OSError as error:
        return _stay_interpreted(f"the cache cannot be used: {error}")


class CompilerError(Exception):
    """What went wrong with the compiler, in a line."""


def _compile(text: str, path: Path) -> None:
    """Keep the library of a C text in the cache."""
    with place(path) as directory:
        c, library, command = directory / "kernel.c", directory / "kernel.so", _compiler()
        c.write_text(text)
        failure = _failure([*command, *FLAGS, str(c), "-o", str(library), "-lm"], directory)
        if failure:
            raise CompilerError(f"{shlex.join(command)} failed: {failure}")
        content = library.read_bytes()
    keep(content, path)


def _linked(path: Path) -> str:
    """The name under which the linker finds a library of the cache that is whole and ours, see `load`."""
    descriptor = opened(path)
    # What has been looked at is linked, whatever its name stands for by now. The descriptor stays open: linkers tell
    # libraries apart by their names, and the number must not come to stand for another.
    name = f"/proc/self/fd/{descriptor}"
    return name if os.path.exists(name) else str(path)


class _Interrupted(BaseException):
    """A compiler was ended, since a handler of signals has raised what `interrupts.check` will."""


def _failure(call: Sequence[str], directory: Path) -> str:
    """Run the compiler; what went wrong in a line, empty where nothing did. directory: for files of its own."""
    end = monotonic() + PATIENCE
    with subprocess.Popen(
        call,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
        errors="replace",
        env={**os.environ, "TMPDIR": str(directory)},
        start_new_session=True,
    ) as running:
        try:
            while True:
                try:
                    said = running.communicate(timeout=LOOK)[1]
                    break
                except subprocess.TimeoutExpired:
                    LIBRARIES.pause()
                    if interrupts.pending():
                        raise _Interrupted from None
                    if monotonic() > end:
                        return f"it has not ended after {PATIENCE} s"
        finally:
            if running.returncode is None:
                _end(running)
    return next(iter(said.strip().splitlines()), f"exit status {running.returncode}") if running.returncode else ""


def _end(running: "subprocess.Popen[str]") -> None:
    """End a compiler and the programs that it has started, which would go on."""
    if hasattr(os, "killpg"):  # not on Windows
        with suppress(ProcessLookupError):
            os.killpg(running.pid, signal.SIGKILL)
    else:
        running.kill()


@lru_cache(maxsize=512)
def _path(code: str, kind: str, channels: int, squares: bool) -> Path:
    return cache_directory() / (_key(code, kind, str(channels), str(squares)) + ".so")


def _key(*parts: str) -> str:
    return hashlib.sha256("\0".join((*parts, *_toolchain())).encode()).hexdigest()[:32]


@lru_cache(maxsize=1)
def _machine() -> str:
    """The name under which the linker finds the machine that carries out lists; OSError where it is not there."""
    return _linked(_machine_path())


@lru_cache(maxsize=1)
def _machine_path() -> Path:
    """Where the machine is that carries out lists."""
    return cache_directory() / (_key(machine_source()) + ".so")


@lru_cache(maxsize=1)
def _compiler() -> tuple[str, ...]:
    """The compiler's command, empty where there is none."""
    try:
        named = shlex.split(os.environ.get("CC", ""))
    except ValueError:  # a quote without end
        return ()
    found = shutil.which(named[0]) if named else next(filter(None, map(shutil.which, ("cc", "gcc", "clang"))), None)
    return (found, *named[1:]) if found else ()


def has_compiler() -> bool:
    """Whether a C compiler was found."""
    return bool(_compiler())


@lru_cache(maxsize=1)
def _toolchain() -> tuple[str, ...]:
    """What machine code depends on beside the kernel: how C is made from it, compiler, flags and processor."""
    makers = (Path(m.__file__ or "").read_text(encoding="utf-8") for m in (kernel, hessians, source, listing))
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


def _stay_interpreted(reason: str) -> None:
    _say_once(plain(f"kernels are interpreted, which is several times slower: {reason}"))


@lru_cache(maxsize=64)
def _say_once(message: str) -> None:
    warnings.warn(message, RuntimeWarning, stacklevel=2)
