"""Output files that appear whole or not at all."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import IO

from symmotion.errors import InputError


@contextmanager
def whole_file(path: str | os.PathLike[str], binary: bool = False) -> Iterator[IO]:
    """A handle for writing UTF-8 text, or bytes, whose content appears at `path` when the block ends without error.

    Until then, and after an error, a file that was there stays as it was. Raises InputError
    that names the path and the reason where it cannot be written.
    """
    target = Path(os.path.realpath(path))  # through a link to its file, which would else be replaced by ours
    try:
        require_place(path)
        # A directory beside the target is on its file system, where renaming is atomic, and unlike
        # tempfile's own files those made inside get the user's usual permissions.
        with TemporaryDirectory(prefix=".", dir=target.parent) as directory:
            part = Path(directory) / "part"
            with part.open("wb") if binary else part.open("w", encoding="utf-8", newline="\n") as handle:
                yield handle
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
    with TemporaryDirectory(prefix=".", dir=target.parent) as directory:
        yield Path(directory) / Path(path).name
        for part in Path(directory).iterdir():
            part.replace(target if part.name == Path(path).name else target.parent / part.name)


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
