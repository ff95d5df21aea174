"""Input files, opened: regular ones only, of bounded size."""

import codecs
import gzip
import os
import stat
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from io import BytesIO, TextIOWrapper
from typing import IO, TextIO

from symmotion import checks
from symmotion.errors import InputError

FilePath = str | os.PathLike[str]
PACKED = b"\x1f\x8b"  # what gzip files begin with
WIDE = codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE  # what UTF-16 begins with, as spreadsheets write it
LARGEST = 512 * 2**20


@contextmanager
def readable_bytes(path: FilePath) -> Iterator[IO[bytes]]:
    """A handle for reading bytes, unpacked; what is wrong with the file as such becomes an InputError."""
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
        with open(path, "rb") as found:
            packed = found.read(2) == PACKED
            found.seek(0)
            yield BytesIO(_unpacked(path, found)) if packed else found
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}; check its name and permissions") from error
    except UnicodeError as error:
        raise _no_text(path, "utf-8-sig", error) from error


@contextmanager
def readable(path: FilePath, encoding: str = "utf-8-sig", remedy: str = "") -> Iterator[TextIO]:
    """A handle for reading text of an encoding, as `readable_bytes`.

    remedy: what else may be done about text of another encoding.
    """
    with readable_bytes(path) as source:
        try:
            wide = encoding == "utf-8-sig" and source.read(2) in WIDE
            source.seek(0)
            handle = TextIOWrapper(source, encoding="utf-16" if wide else encoding)
            yield handle
            handle.detach()
        except UnicodeError as error:
            raise _no_text(path, encoding, error, remedy) from error


def _no_text(path: FilePath, encoding: str, error: UnicodeError, remedy: str = "") -> InputError:
    name = "UTF-8" if encoding == "utf-8-sig" else encoding
    reason = error.reason if isinstance(error, UnicodeDecodeError) else error
    return InputError(f"{path}: is not {name} text ({reason}); save it as UTF-8{remedy}")


def _unpacked(path: FilePath, found: IO[bytes]) -> bytes:
    """What a gzip file holds; InputError where it is too much or broken."""
    try:
        data = gzip.GzipFile(fileobj=found).read(LARGEST + 1)
    except (EOFError, zlib.error, gzip.BadGzipFile) as error:
        raise InputError(f"{path}: is no whole gzip file ({error})") from error
    if len(data) > LARGEST:
        raise InputError(f"{path}: would be more than {LARGEST >> 20} MB unpacked: that is the most that is read")
    return data
