"""Archives of arrays (.npz), of which nothing is unpacked before it is known how large it is."""

import math
import zipfile
from typing import IO

import numpy as np

from symmotion.errors import InputError
from symmotion.files.formats import FilePath
from symmotion.opening import LARGEST, readable_bytes

MOST_MEMBERS = 1000
ENDING = ".npy"
KINDS = "fiuU"  # of what is read: numbers, and the text of a mark
HEADERS = {(1, 0): np.lib.format.read_array_header_1_0, (2, 0): np.lib.format.read_array_header_2_0}


def read_arrays(path: FilePath) -> dict[str, np.ndarray]:
    """The arrays of an .npz file by name: at most 512 MB of them, as they are and as doubles.

    Raises InputError that names the file and the member at fault.
    """
    with readable_bytes(path) as handle:
        try:
            with zipfile.ZipFile(handle) as archive:
                members = archive.infolist()
                _require_sizes(path, members)
                return {m.filename.removesuffix(ENDING): _array(path, archive, m) for m in members}
        except InputError:
            raise
        # Whatever is wrong with streams, headers, methods and passwords: zipfile and the decoders raise of everything.
        except Exception as error:
            raise InputError(f"{path}: is no NPZ file of arrays of numbers ({error})") from None


def _require_sizes(path: FilePath, members: list[zipfile.ZipInfo]) -> None:
    """Raise InputError where there are too many members or bytes, two of a name, or one that is no array."""
    if len(members) > MOST_MEMBERS:
        raise InputError(f"{path}: has {len(members)} members: {MOST_MEMBERS} at most are read")
    names = [m.filename for m in members]
    for m in members:
        if not m.filename.endswith(ENDING) or m.is_dir():
            raise InputError(f"{path}: member {m.filename!r:.60} is no array, NAME{ENDING}")
        if names.count(m.filename) > 1:
            raise InputError(f"{path}: has two members {m.filename!r:.60}")
        if m.flag_bits & 0x1:
            raise InputError(f"{path}: member {m.filename!r:.60} is encrypted: save it without a password")
    size = sum(m.file_size for m in members)
    if size > LARGEST:
        raise InputError(f"{path}: would be {size / 2**20:.0f} MB unpacked: {LARGEST >> 20} MB at most are read")


def _array(path: FilePath, archive: zipfile.ZipFile, member: zipfile.ZipInfo) -> np.ndarray:
    """The array of a member whose header says as many bytes as there are."""
    where = f"{path}, {member.filename.removesuffix(ENDING)!r:.60}"
    with archive.open(member) as stream:
        shape, by_columns, kind, begin = _header(where, stream)
        count = math.prod(shape)
        if count * kind.itemsize != member.file_size - begin:
            raise InputError(
                f"{where}: its header claims {count * kind.itemsize} bytes where there are {member.file_size - begin}"
            )
        if 8 * count > LARGEST:
            raise InputError(f"{where}: {count} numbers are more than {LARGEST >> 20} MB of doubles")
        data = stream.read()  # to the end, where its checksum is looked at
    array = np.frombuffer(data, dtype=kind)
    return array.reshape(shape, order="F" if by_columns else "C")


def _header(where: str, stream: IO[bytes]) -> tuple[tuple[int, ...], bool, np.dtype, int]:
    """Shape, order, type and where the numbers begin."""
    try:
        version = np.lib.format.read_magic(stream)
        shape, by_columns, kind = HEADERS[version](stream)
    # NumPy evaluates it as a literal of Python, with all that can be wrong in one.
    except Exception as error:
        raise InputError(f"{where}: its header is not that of an array ({error})") from None
    if kind.kind not in KINDS or not all(isinstance(n, int) and n >= 0 for n in shape):
        raise InputError(f"{where}: an array of numbers is needed, not of {kind}")
    return shape, by_columns, kind, stream.tell()
