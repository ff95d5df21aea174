"""Keyframes in text tables: tum, kitti and csv, there and back."""

import csv
from collections.abc import Sequence
from itertools import chain

import numpy as np
from numpy.typing import ArrayLike

from symmotion.errors import InputError
from symmotion.files.formats import FilePath
from symmotion.files.positions import Positions
from symmotion.files.tables import Columns, Rows, choose_columns, csv_rows, plain_rows, read_numbers
from symmotion.motions import Keyframes, as_rotations
from symmotion.opening import readable
from symmotion.whole import whole_file

NORM_TOLERANCE = 1e-3

TIMES = (("t",), ("time",), ("timestamp",))
TRANSLATIONS = (("x", "y", "z"), ("tx", "ty", "tz"), ("v1", "v2", "v3"))
QUATERNION = ("qx", "qy", "qz", "qw")
ANGLE = ("theta",)
MATRICES = {d: tuple(f"a{i}{j}" for i in range(1, d + 1) for j in range(1, d + 1)) for d in (2, 3)}

TUM = ("t", "tx", "ty", "tz", *QUATERNION)
KITTI = ("a11", "a12", "a13", "v1", "a21", "a22", "a23", "v2", "a31", "a32", "a33", "v3")


def read_tum(path: FilePath, *, times: ArrayLike | None = None, delimiter: str | None = None) -> Keyframes:
    """Keyframes of lines `t tx ty tz qx qy qz qw`."""
    return _read_plain(path, TUM, times, delimiter)


def read_kitti(path: FilePath, *, times: ArrayLike | None = None, delimiter: str | None = None) -> Keyframes:
    """Keyframes of lines of 12 numbers, the 3 × 4 matrices [A v] row by row."""
    return _read_plain(path, KITTI, times, delimiter)


def read_txt(path: FilePath, *, times: ArrayLike | None = None, delimiter: str | None = None) -> Keyframes:
    """Keyframes of tum or kitti, told apart by the number of columns."""
    return _read_plain(path, None, times, delimiter)


def read_csv(path: FilePath, *, times: ArrayLike | None = None, delimiter: str | None = None) -> Keyframes:
    """Keyframes of columns that the first line names."""
    with readable(path) as handle:
        rows = csv_rows(path, handle, delimiter)
        _, header = next(rows, (1, []))
        return _positions(path, [name.strip().lower() for name in header], rows).keyframes(path, times)


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
    header = ("t", *MATRICES[d], *TRANSLATIONS[-1][:d])
    _write(
        path, [header], np.column_stack([keyframes.times, keyframes.linear.reshape(m, -1), keyframes.translation]), ","
    )


def _read_plain(path: FilePath, columns: Columns | None, times: ArrayLike | None, delimiter: str | None) -> Keyframes:
    with readable(path) as handle:
        rows = plain_rows(handle, delimiter)
        if columns is None:
            line, first = next(rows, (1, []))
            columns = {len(c): c for c in (TUM, KITTI)}.get(len(first))
            if columns is None:
                raise InputError(
                    f"{path}, line {line}: {len(first)} columns; 8 make it tum and 12 kitti, else give the format"
                )
            rows = chain([(line, first)], rows)
        return _positions(path, columns, rows).keyframes(path, times)


def _positions(path: FilePath, names: Columns, rows: Rows) -> Positions:
    linear = choose_columns(path, names, "linear part", [QUATERNION, ANGLE, *MATRICES.values()])
    d = 2 if linear in (ANGLE, MATRICES[2]) else 3
    translation = choose_columns(path, names, "translation", [*(g[:d] for g in TRANSLATIONS), ()], TRANSLATIONS)
    time = choose_columns(path, names, "time", [*TIMES, ()])

    columns = [names.index(name) for name in (*time, *translation, *linear)]
    numbers, lines = read_numbers(path, rows, columns, len(names))
    t, v, a = np.split(numbers, np.cumsum([len(time), len(translation)]), axis=1)
    if linear == QUATERNION:
        a = _matrices(path, a, lines)
    elif linear == ANGLE:
        a = np.hstack([np.cos(a), -np.sin(a), np.sin(a), np.cos(a)])
    v = v if translation else np.zeros((len(v), d))
    return Positions(a.reshape(-1, d, d), v, t[:, 0] if time else None, lambda i: f"line {lines[i]}")


def _matrices(path: FilePath, quaternions: np.ndarray, lines: Sequence[int]) -> np.ndarray:
    """(M, 3, 3) rotations of scalar-last quaternions (M, 4), normalised; InputError where a norm is far from 1."""
    norms = np.linalg.norm(quaternions, axis=1)
    wrong = np.abs(norms - 1) > NORM_TOLERANCE
    if wrong.any():
        i = int(np.argmax(wrong))
        raise InputError(f"{path}, line {lines[i]}: a quaternion of norm {norms[i]:.6g}: unit quaternions are needed")
    from scipy.spatial.transform import Rotation  # here: see as_rotations

    return Rotation.from_quat(quaternions).as_matrix()


def _write(path: FilePath, header: Sequence[Columns], values: np.ndarray, delimiter: str) -> None:
    with whole_file(path) as handle:
        writer = csv.writer(handle, delimiter=delimiter, lineterminator="\n")
        writer.writerows([*header, *values.tolist()])
