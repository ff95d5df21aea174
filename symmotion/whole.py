"""Output files that appear whole or not at all."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from shutil import rmtree
from tempfile import mkdtemp
from time import time
from typing import IO

from symmotion.errors import InputError

# Directories in which files are made; what a kill leaves of them is known by it, and by the lock that nobody holds.
PREFIX = ".symmotion-"
FORGOTTEN = 86400.0  # seconds after which they are left behind where there are no locks
TAKEN = -1  # no descriptor


@contextmanager
def whole_file(path: str | os.PathLike[str], binary: bool = False) -> Iterator[IO]:
    """A handle for writing UTF-8 text, or bytes, whose content appears at `path` when the block ends without error.

    Until then, and after an error, a file that was there stays as it was. Raises InputError
    that names the path and the reason where it cannot be written.
    """
    target = Path(os.path.realpath(path))  # through a link to its file, which would else be replaced by ours
    try:
        require_place(path)
        with workshop(target.parent) as directory:
            part = directory / "part"
            with part.open("wb") if binary else part.open("w", encoding="utf-8", newline="\n") as handle:
                yield handle
                synced(handle)
            part.replace(target)
    except OSError as error:
        raise InputError(f"{path}: cannot be written: {error}") from error


@contextmanager
def whole_files(path: str | os.PathLike[str]) -> Iterator[Path]:
    """A path of the same name elsewhere: what is written there, and beside it, is moved to `path` without error only.

    For who writes to a path. Raises InputError where nothing can be written at `path`.
    """
    require_place(path)
    target = Path(os.path.realpath(path))
    with workshop(target.parent) as directory:
        yield directory / Path(path).name
        for part in directory.iterdir():
            with part.open("r+b") as handle:
                synced(handle)
            part.replace(target if part.name == Path(path).name else target.parent / part.name)


@contextmanager
def workshop(place: Path) -> Iterator[Path]:
    """A new directory in `place`, to make files in that are moved out of it; what is left in it is removed.

    On the file system of `place` renaming is atomic, and unlike tempfile's own files those made
    here get the user's usual permissions. The directory is locked while it is in use: those whose makers were
    killed are not, and are removed first.
    """
    _tidy(place)
    while True:
        directory = Path(mkdtemp(prefix=PREFIX, dir=place))
        held = _hold(directory)
        # Between making and locking it another process may have tidied it away.
        if held is None or (held != TAKEN and directory.exists()):
            break
    try:
        yield directory
    finally:
        rmtree(directory, ignore_errors=True)
        _release(held)


def synced(handle: IO) -> None:
    """Have what was written to a file on its disk, so that its name never leads to less than the whole of it."""
    handle.flush()
    os.fsync(handle.fileno())


def _tidy(place: Path) -> None:
    """Remove what killed processes have left in a directory of directories to work in."""
    with os.scandir(place) as entries:
        left = [Path(e.path) for e in entries if e.name.startswith(PREFIX) and e.is_dir(follow_symlinks=False)]
    for directory in left:
        held = _hold(directory)
        if (held is not None and held != TAKEN) or (held is None and _forgotten(directory)):
            rmtree(directory, ignore_errors=True)
        _release(held)


def _hold(directory: Path) -> int | None:
    """A descriptor by which a directory is locked, TAKEN where another has it, None where there are no locks."""
    try:
        import fcntl
    except ImportError:  # Windows
        return None
    try:
        descriptor = os.open(directory, os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW)
    except FileNotFoundError:  # tidied away
        return TAKEN
    except OSError:
        return None
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError as error:
        os.close(descriptor)
        return TAKEN if isinstance(error, BlockingIOError) else None
    return descriptor


def _release(held: int | None) -> None:
    if held is not None and held != TAKEN:
        os.close(held)


def _forgotten(directory: Path) -> bool:
    try:
        return time() - directory.stat().st_mtime > FORGOTTEN
    except OSError:
        return False


def require_place(path: str | os.PathLike[str]) -> None:
    """Raise InputError where something other than a writable file, or nothing, is in the way."""
    target = Path(os.path.realpath(path))
    if not target.parent.is_dir():
        reason = f"there is no directory {target.parent}; create it first"
    elif target.is_dir():
        reason = "it is a directory; name a file in it"
    elif target.exists() and not target.is_file():
        reason = "it is a device or a pipe; name a file"
    elif target.exists() and not os.access(target, os.W_OK):
        reason = "the file there is read-only; allow writing or choose another name"
    else:
        return
    raise InputError(f"{path}: cannot be written: {reason}")
