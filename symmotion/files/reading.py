"""Keyframes and motions out of files: the doors, which find the format in the table."""

from collections.abc import Iterable

from numpy.typing import ArrayLike

from symmotion import checks
from symmotion.errors import InputError
from symmotion.files.formats import FilePath, Format, read_file
from symmotion.files.table import FORMATS
from symmotion.motions import AffineMotion, Keyframes
from symmotion.motions.two_parameter import TwoParameterMotion


def read_keyframes(
    path: FilePath,
    format: str | None = None,
    times: ArrayLike | None = None,
    delimiter: str | None = None,
    node: str | int | None = None,
    animation: str | int | None = None,
    *,
    formats: Iterable[Format] = FORMATS,
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
    moves and that all others which move hang from. animation: of glb and gltf, name or index,
    the first when left out.

    Quaternions are scalar-last in files, with norm 1 within 1e-3. times: (M,), in place of the
    file's; 0, 1, 2, … where neither are given. delimiter: the character between columns; when
    left out, whitespace, and in csv the comma, semicolon or tab that the first line has most of.

    formats: the table; with one of your own `(*symmotion.files.FORMATS, mine)`.

    Raises InputError that names the file and the line, or JSON entry, at fault, and for an option
    that the format does not have.
    """
    _require_path(path, "read_keyframes", Keyframes, "these are keyframes")
    given = {"times": times, "delimiter": delimiter, "node": node, "animation": animation}
    return read_file(path, Keyframes, formats, "keyframes", format=format, options=given)


def read_motion(path: FilePath, *, formats: Iterable[Format] = FORMATS) -> AffineMotion:
    """The motion that `write_motion` wrote to a .json file; InputError names the file and the entry at fault.

    formats: as in `read_keyframes`.
    """
    _require_path(path, "read_motion", AffineMotion, "this is a motion")
    return read_file(path, AffineMotion, formats, "motion")


def read_two_parameter(path: FilePath, *, formats: Iterable[Format] = FORMATS) -> TwoParameterMotion:
    """A two-parameter motion from a .json or .npz file of at most 512 MB: one written by us, or a net of displacements.

    A net has the entries axis (n, m, 3), angle (n, m) in rad and optionally translation
    (n, m, 3), knots_u (n + 4,) and knots_v (m + 4,), uniform of distance 1 when left out: the
    control data of PCG table 1. Its quaternions are put in one hemisphere; those of a motion are
    taken as they are. formats: as in `read_keyframes`.

    Raises InputError that names the file and the entry at fault.
    """
    _require_path(path, "read_two_parameter", TwoParameterMotion, "this is a two-parameter motion")
    return read_file(path, TwoParameterMotion, formats, "net")


def _require_path(path: FilePath, door: str, kind: type, already: str) -> None:
    if isinstance(path, kind):
        raise InputError(f"{door} takes a path; {already} already")
    checks.file_path(path, f"the path given to {door},")
