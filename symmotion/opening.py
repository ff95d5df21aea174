"""Input files, opened: regular ones only, of bounded size."""

import os
import stat
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from symmotion import checks
from symmotion.errors import InputError

FilePath = str | os.PathLike[str]
LARGEST = 512 * 2**20


# Any: a handle of text or of bytes, as asked for.
@contextmanager
def readable(path: FilePath, binary: bool = False) -> Iterator[Any]:
    """A handle for reading UTF-8 text, or bytes; what is wrong with the file as such becomes an InputError."""
    checks.file_path(path)
    try:
        status = os.stat(path)
        if not stat.S_ISREG(status.st_mode):
            raise InputError(f"{path}: is a directory or a device; name a file")
        if status.st_size == 0:
            raise InputError(f"{path}: is empty")
        if status.st_size > LARGEST:
            raise InputError(
                f"{path}: has {status.st_size / 2**20:.0f} MB; split it into files of at most {LARGEST >> 20} MB"
            )
        with open(path, "rb") if binary else open(path, encoding="utf-8-sig") as handle:
            yield handle
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}; check its name and permissions") from error
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: is not UTF-8 text ({error.reason}); save it as UTF-8") from error
