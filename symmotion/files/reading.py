"""Keyframes and motions out of files."""

from collections.abc import Callable, Sequence
from typing import NamedTuple, TextIO

import numpy as np
from numpy.typing import ArrayLike

from symmotion.errors import InputError
from symmotion.files import formats
from symmotion.files.bvh import read_bvh
from symmotion.files.documents import read_list, read_object, require_entries
from symmotion.files.formats import FilePath
from symmotion.files.gltf_keyframes import read_gltf_keyframes
from symmotion.files.opening import readable
from symmotion.files.tables import Columns, Rows, choose_columns, csv_rows, plain_rows, read_numbers
from symmotion.motions import AffineMotion, Keyframes
from symmotion.splines import BSplineBasis

NORM_TOLERANCE = 1e-3


class _Positions(NamedTuple):
    """What a file says: A (M, d, d), v (M, d), times (M,) if it has them, and what messages call each one's place."""

    linear: np.ndarray
    translation: np.ndarray
    times: np.ndarray | None
    place: Callable[[int], str]


def read_keyframes(
    path: FilePath,
    format: str | None = None,
    times: ArrayLike | None = None,
    delimiter: str | None = None,
    node: str | int | None = None,
) -> Keyframes:
    """Keyframes from a file of at most 512 MB, in the format that its ending names unless one is given.

    tum: lines `t tx ty tz qx qy qz qw`; kitti: lines of 12 numbers, the 3 × 4 matrices [A v]
    row by row; txt: tum or kitti, by the number of columns; in all three `#` begins a comment.
    csv: the first line names the columns, in any order and case:
        time `t`, `time` or `timestamp`, or none;
        translation `x y z`, `tx ty tz` or `v1 v2 v3`, in 2D without the third, or none for 0;
        linear part `qx qy qz qw`, `theta` (2D, rad), `a11 a12 a21 a22` or `a11 a12 … a33`;
        columns of other names are ignored.
    json: an object with `linear` (M, d, d) and optionally `times` (M,) and `translation` (M, d).
    bvh: a joint of a skeleton, rigid in the world, frame by frame; see `read_bvh`.
    glb, gltf: an animated node in the scene; see `read_gltf_keyframes`.

    node: the joint's or the node's name or index; when left out the root, or the node that
    moves and that all others which move hang from.

    Quaternions are scalar-last in files, with norm 1 within 1e-3. times: (M,), in place of the
    file's; 0, 1, 2, … where neither are given. delimiter: the character between columns; when
    left out, whitespace, and in csv the comma, semicolon or tab that the first line has most of.

    Raises InputError that names the file and the line, or JSON entry, at fault.
    """
    chosen = formats.format_of(path, format, (*formats.FORMATS, "txt", *formats.ANIMATIONS))
    if chosen in formats.ANIMATIONS:
        return _read_animation(path, chosen, times, node)
    if node is not None:
        raise InputError(f"{path}: has no nodes, but one sequence of keyframes: leave node {node!r} out")
    if delimiter is not None and len(delimiter) != 1:
        raise InputError(f"delimiter {delimiter!r}: one character is needed")
    with readable(path) as handle:
        if chosen == "json":
            positions = _read_json(path, handle)
        elif chosen == "csv":
            rows = csv_rows(path, handle, delimiter)
            _, header = next(rows, (1, []))
            positions = _read_table(path, [name.strip().lower() for name in header], rows)
        else:
            columns = _plain_columns(path, handle, chosen, delimiter)
            positions = _read_table(path, columns, plain_rows(handle, delimiter))
    if times is None:
        times = np.arange(len(positions.linear)) if positions.times is None else positions.times
        _require_increasing(path, np.asarray(times), positions.place)
    try:
        return Keyframes(np.asarray(times), positions.linear, positions.translation)
    except InputError as error:
        raise InputError(f"{path}: {error}") from None


def read_motion(path: FilePath) -> AffineMotion:
    """The motion that `write_motion` wrote to a .json file; InputError names the file and the entry at fault."""
    with readable(path) as handle:
        document = read_object(path, handle)
    for name, needed in formats.MOTION.items():
        if document.get(name) != needed:
            raise InputError(f"{path}: {name} is {document.get(name)!r:.40}: {needed!r} is needed for a motion")
    require_entries(path, document, (*formats.MOTION, *formats.MOTION_ENTRIES))
    if not isinstance(document["periodic"], bool):
        raise InputError(f"{path}, periodic: true or false is needed")
    degree = document["degree"]
    if not isinstance(degree, float) or not degree.is_integer():
        raise InputError(f"{path}, degree: a whole number is needed")
    knots, linear, translation = (read_list(path, document, name) for name in ("knots", "linear", "translation"))
    try:
        return AffineMotion(BSplineBasis(knots, int(degree), document["periodic"]), linear, translation)
    except InputError as error:
        raise InputError(f"{path}: {error}") from None


def _read_animation(path: FilePath, format: str, times: ArrayLike | None, node: str | int | None) -> Keyframes:
    try:
        if format == "bvh":
            keyframes = read_bvh(path).keyframes(0 if node is None else node)
        else:
            keyframes = read_gltf_keyframes(path, node)
        return keyframes if times is None else Keyframes(np.asarray(times), keyframes.linear, keyframes.translation)
    except InputError as error:
        # A reader names the file itself, what has been read does not.
        raise error if str(error).startswith(str(path)) else InputError(f"{path}: {error}") from None


def _read_json(path: FilePath, handle: TextIO) -> _Positions:
    document = read_object(path, handle)
    require_entries(path, document, ["linear"], ["times", "translation"])
    linear = read_list(path, document, "linear")
    times = read_list(path, document, "times") if "times" in document else None
    translation = read_list(path, document, "translation") if "translation" in document else np.zeros(linear.shape[:-1])
    return _Positions(linear, translation, times, "times[{}]".format)


def _plain_columns(path: FilePath, handle: TextIO, format: str, delimiter: str | None) -> Columns:
    """The columns of a tum or kitti file, told apart by the first line where the format is txt."""
    if format != "txt":
        return formats.TUM if format == "tum" else formats.KITTI
    line, first = next(plain_rows(handle, delimiter), (1, []))
    handle.seek(0)
    for columns in (formats.TUM, formats.KITTI):
        if len(columns) == len(first):
            return columns
    raise InputError(f"{path}, line {line}: {len(first)} columns; 8 make it tum and 12 kitti, else give the format")


def _read_table(path: FilePath, names: Columns, rows: Rows) -> _Positions:
    linear = choose_columns(path, names, "linear part", [formats.QUATERNION, formats.ANGLE, *formats.MATRICES.values()])
    d = 2 if linear in (formats.ANGLE, formats.MATRICES[2]) else 3
    cut = [group[:d] for group in formats.TRANSLATIONS]
    translation = choose_columns(path, names, "translation", [*cut, ()], formats.TRANSLATIONS)
    time = choose_columns(path, names, "time", [*formats.TIMES, ()])

    columns = [names.index(name) for name in (*time, *translation, *linear)]
    numbers, lines = read_numbers(path, rows, columns, len(names))
    t, v, a = np.split(numbers, np.cumsum([len(time), len(translation)]), axis=1)
    if linear == formats.QUATERNION:
        a = _matrices(path, a, lines)
    elif linear == formats.ANGLE:
        a = np.hstack([np.cos(a), -np.sin(a), np.sin(a), np.cos(a)])
    v = v if translation else np.zeros((len(v), d))
    return _Positions(a.reshape(-1, d, d), v, t[:, 0] if time else None, lambda i: f"line {lines[i]}")


def _matrices(path: FilePath, quaternions: np.ndarray, lines: Sequence[int]) -> np.ndarray:
    """(M, 3, 3) rotations of scalar-last quaternions (M, 4), normalised; InputError where a norm is far from 1."""
    norms = np.linalg.norm(quaternions, axis=1)
    wrong = np.abs(norms - 1) > NORM_TOLERANCE
    if wrong.any():
        i = int(np.argmax(wrong))
        raise InputError(f"{path}, line {lines[i]}: a quaternion of norm {norms[i]:.6g}: unit quaternions are needed")
    from scipy.spatial.transform import Rotation  # here: see as_rotations

    return Rotation.from_quat(quaternions).as_matrix()


def _require_increasing(path: FilePath, times: np.ndarray, place: Callable[[int], str]) -> None:
    wrong = np.diff(times) <= 0
    if times.ndim == 1 and wrong.any():  # Keyframes refuses other shapes
        i = int(np.argmax(wrong))
        how = "repeats" if times[i + 1] == times[i] else "comes before"
        raise InputError(f"{path}, {place(i + 1)}: time {times[i + 1]} {how} that of {place(i)}: times must increase")
