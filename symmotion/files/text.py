"""Keyframes in text tables: tum, kitti and csv, there and back."""

import csv
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from symmotion.errors import InputError
from symmotion.files.columns import Told, choose, parsed
from symmotion.files.formats import FilePath
from symmotion.files.poses import Telling, positions_of
from symmotion.files.positions import Repeated
from symmotion.files.recording import Recording
from symmotion.files.tables import Columns, Table, advice, table_of
from symmotion.motions import Keyframes, as_rotations
from symmotion.opening import readable
from symmotion.whole import whole_file

QUATERNION = ("qx", "qy", "qz", "qw")
MATRICES = {d: tuple(f"a{i}{j}" for i in range(1, d + 1) for j in range(1, d + 1)) for d in (2, 3)}
TUM = ("t", "tx", "ty", "tz", *QUATERNION)
KITTI = tuple(f"a{i}{j}" for i in range(1, 4) for j in range(1, 5))
WHOLE = (*KITTI, "a41", "a42", "a43", "a44")
# What rows without names are, by how many columns there are.
WIDTHS = {8: TUM, 12: KITTI, 16: WHOLE, 9: ("index", *TUM), 13: ("t", *KITTI), 17: ("t", *WHOLE)}


def read_tum(
    path: FilePath,
    *,
    times: ArrayLike | None = None,
    delimiter: str | None = None,
    columns: Told | str | None = None,
    angles: str | None = None,
    lost: str | None = None,
    repeated: Repeated | None = None,
    norms: float | None = None,
) -> Recording:
    """Keyframes of lines `t tx ty tz qx qy qz qw`, or of columns that a line names."""
    return _read(path, (TUM, WIDTHS[9]), times, delimiter, repeated, Telling(columns, angles, lost, norms))


def read_kitti(
    path: FilePath,
    *,
    times: ArrayLike | None = None,
    delimiter: str | None = None,
    columns: Told | str | None = None,
    angles: str | None = None,
    lost: str | None = None,
    repeated: Repeated | None = None,
    norms: float | None = None,
) -> Recording:
    """Keyframes of lines of 12 or 16 numbers, the matrix [A v] row by row, behind a time or not."""
    shapes = tuple(WIDTHS[n] for n in (12, 16, 13, 17))
    return _read(path, shapes, times, delimiter, repeated, Telling(columns, angles, lost, norms))


def read_txt(
    path: FilePath,
    *,
    times: ArrayLike | None = None,
    delimiter: str | None = None,
    columns: Told | str | None = None,
    angles: str | None = None,
    lost: str | None = None,
    repeated: Repeated | None = None,
    norms: float | None = None,
) -> Recording:
    """Keyframes of columns that a line names, or of tum or kitti, told apart by the number of columns."""
    return _read(path, None, times, delimiter, repeated, Telling(columns, angles, lost, norms))


def read_csv(
    path: FilePath,
    *,
    times: ArrayLike | None = None,
    delimiter: str | None = None,
    columns: Told | str | None = None,
    angles: str | None = None,
    lost: str | None = None,
    repeated: Repeated | None = None,
    norms: float | None = None,
) -> Recording:
    """Keyframes of columns that a line names, or of as many as tum or kitti have."""
    return _read(path, None, times, delimiter, repeated, Telling(columns, angles, lost, norms), quoted=True)


def write_tum(keyframes: Keyframes, path: FilePath) -> None:
    """Write rigid 3D keyframes, numbers exactly, rotations up to rounding."""
    try:
        quaternions = as_rotations(keyframes.linear).as_quat()
    except InputError as error:
        raise InputError(f"{path}: tum holds rigid 3D keyframes: {error}; write csv or json") from None
    _write(path, [("#", *TUM)], np.column_stack([keyframes.times, keyframes.translation, quaternions]), " ")


def write_kitti(keyframes: Keyframes, path: FilePath) -> None:
    """Write 3D keyframes at the times 0, 1, 2, …, exactly."""
    m = len(keyframes)
    if keyframes.dimension != 3:
        raise InputError(f"{path}: kitti holds 3D keyframes; write csv or json")
    if (keyframes.times != np.arange(m)).any():
        raise InputError(f"{path}: kitti has no times, and these are not 0, 1, 2, …; write csv or json")
    _write(path, [], np.concatenate([keyframes.linear, keyframes.translation[:, :, None]], axis=2).reshape(m, 12), " ")


def write_csv(keyframes: Keyframes, path: FilePath) -> None:
    """Write keyframes exactly, in columns t, a11 …, v1 …."""
    m, d = len(keyframes), keyframes.dimension
    header = ("t", *MATRICES[d], *("v1", "v2", "v3")[:d])
    _write(
        path, [header], np.column_stack([keyframes.times, keyframes.linear.reshape(m, -1), keyframes.translation]), ","
    )


def _read(
    path: FilePath,
    shapes: Sequence[Columns] | None,
    times: ArrayLike | None,
    delimiter: str | None,
    repeated: Repeated | None,
    telling: Telling,
    quoted: bool = False,
) -> Recording:
    told = parsed(telling.columns) if isinstance(telling.columns, str) else telling.columns
    with readable(path) as handle:
        table = table_of(path, handle, delimiter, quoted)
        header = _header(path, table, shapes, told, quoted)
        chosen = choose(path, header, told)
        return positions_of(path, table, header, chosen, telling).recording(path, times, repeated)


def _header(path: FilePath, table: Table, shapes: Sequence[Columns] | None, told: Told | None, quoted: bool) -> Columns:
    """The names of the columns: those that the table has, else those that go with so many."""
    width = len(table.first)
    known = {len(shape): shape for shape in shapes or WIDTHS.values()}
    if table.header is not None:
        if not table.commented or width not in known:
            return table.header
        try:  # a comment above rows of a known shape counts where it names a pose
            choose(path, table.header, told)
            return table.header
        except InputError:
            return known[width]
    if width in known:
        if width == 9 and not _counted(table.first[0]):
            raise InputError(
                f"{path}, line {table.line}: 9 columns, not 8, of which the first is no number of a row: name them, or "
                "say which with columns={…}"
            )
        return known[width]
    if told:
        return [str(i) for i in range(width)]
    if shapes:
        if width == 0:
            raise InputError(f"{path}: holds no keyframes")
        raise InputError(f"{path}, line {table.line}: {width} columns, not {len(shapes[0])}{advice(table.first)}")
    if quoted and width == 0:
        return []  # which `choose` refuses, naming what it takes
    raise InputError(
        f"{path}, line {table.line}: {width} columns; 8 make it tum and 12 kitti, else give the format, or names with "
        f"columns={{…}}{advice(table.first)}"
    )


def _counted(word: str) -> bool:
    return word.strip().isascii() and word.strip().isdecimal()


def _write(path: FilePath, header: Sequence[Columns], values: np.ndarray, delimiter: str) -> None:
    with whole_file(path) as handle:
        writer = csv.writer(handle, delimiter=delimiter, lineterminator="\n")
        writer.writerows([*header, *values.tolist()])
