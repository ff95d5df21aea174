"""Files of the cache on disk: whole, signed by their checksum, and nobody else's."""

import hashlib
import os
import stat
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from symmotion.whole import synced, workshop

CHECKSUM = 32  # bytes of SHA-256 behind the content


def cache_directory() -> Path:
    """Where compiled kernels are kept."""
    own = os.environ.get("SYMMOTION_CACHE")
    try:
        found = Path(own) if own else Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "symmotion"
    except RuntimeError as error:  # of users without an entry in the password file, as in containers
        raise OSError("there is no home directory; name a cache in $SYMMOTION_CACHE") from error
    # The linker would look for a bare name elsewhere.
    return found.absolute()


class Unusable(OSError):
    """A file of the cache that is not run: damaged, or not surely ours."""


def keep(content: bytes, path: Path) -> None:
    """A file of the cache, whole or not at all, with its checksum. Linkers do not look at what follows a library."""
    with place(path) as directory:
        part = directory / "part"
        # Whatever the umask: nobody else may write to it.
        with open(os.open(part, os.O_WRONLY | os.O_CREAT | getattr(os, "O_BINARY", 0), 0o600), "wb") as handle:
            handle.write(content + hashlib.sha256(content).digest())
            synced(handle)
        part.replace(path)


@contextmanager
def place(path: Path) -> Iterator[Path]:
    """A directory in which a file of the cache is made."""
    path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
    _require_own(path.parent.stat())
    with workshop(path.parent) as directory:
        yield directory


def opened(path: Path) -> int:
    """The open descriptor of a file of the cache that is whole and could be written by nobody else."""
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
    os.lseek(descriptor, 0, os.SEEK_SET)
    return descriptor


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


def _require_own(status: os.stat_result) -> None:
    """Raise OSError where others could have put code into a file or directory."""
    if hasattr(os, "getuid") and (status.st_uid != os.getuid() or status.st_mode & 0o022):
        raise OSError("others may write there; choose another by $SYMMOTION_CACHE")
