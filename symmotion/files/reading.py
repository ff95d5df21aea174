"""Keyframes and motions out of files: the doors, which find the format in the table."""

from collections.abc import Iterable
from typing import Any

from numpy.typing import ArrayLike

from symmotion import checks
from symmotion.bodies.places import placed
from symmotion.errors import InputError
from symmotion.files.columns import Told
from symmotion.files.formats import FilePath, Format, read_file
from symmotion.files.posed import PosedSkeleton
from symmotion.files.recording import Recording, thinned
from symmotion.files.table import FORMATS
from symmotion.motions import Keyframes, Motion
from symmotion.motions.two_parameter import TwoParameterMotion


def read_keyframes(
    path: FilePath,
    format: str | None = None,
    times: ArrayLike | None = None,
    delimiter: str | None = None,
    node: str | int | None = None,
    animation: str | int | None = None,
    *,
    columns: Told | str | None = None,
    angles: str | None = None,
    lost: str | None = None,
    repeated: str | None = None,
    norms: float | None = None,
    every: int | None = None,
    rate: float | None = None,
    offsets: str | None = None,
    frames: str | None = None,
    encoding: str | None = None,
    steps: str | None = None,
    formats: Iterable[Format] = FORMATS,
) -> Keyframes:
    """Keyframes from a file of at most 512 MB, in the format that its ending names unless one is given; .gz too.

    csv, tum, kitti, txt: a line, or a comment above the numbers, may name the columns, in any order
    and case, with units in brackets (s, ms, µs, ns; m, cm, mm, km; rad, deg):
        time `t`, `time`, `timestamp`, `stamp` or `sec` and `nsec`, or none;
        translation `x y z`, `tx ty tz`, `v1 v2 v3`, `p_x …`, `pose.position.x …`; in 2D without the third, or none;
        linear part `qx qy qz qw`, `orientation.x …`, `roll pitch yaw` (about fixed x, y, z in that order),
        `rotvec_x …`, `theta` (2D, rad), `a11 a12 a21 a22`, `a11 a12 … a33`, or 3 × 4 and 4 × 4 with the translation.
    Without names: tum, 8 numbers `t tx ty tz qx qy qz qw`, or 9 with the number of the row in front;
    kitti, 12 or 16, the matrix [A v] row by row, or 13 or 17 with a time in front. Whole stamps since 1970 in ms, µs
    or ns become seconds. A column that is not understood is left out where all of a pose is there, else refused.
    json: an object with `linear` (M, d, d) and optionally `times` (M,) and `translation` (M, d).
    transforms: a nerfstudio transforms.json; colmap: its images.txt; log: of Open3D; optitrack: CSV of Motive.
    rot: a tectonic plate by finite rotations, node: the plate, 801, or with the fixed one, "801/000"; times are ages.
    bvh: a joint of a skeleton, rigid in the world, frame by frame; see `read_bvh`.
    glb, gltf: an animated node in the scene; see `read_gltf_keyframes`.
    usda, usd, usdc, usdz: a prim in the scene, or joint, at its time samples; see `read_usd_keyframes`.

    columns: by role, the columns of a table, by name or number: {"time": "stamp", "translation": ["a", "b", "c"],
        "quaternion": [x, y, z, w]}, or "rotvec", "angle", "matrix", or a sequence of Euler angles as "ZYX" (capital:
        about the body's axes); None where no column has the role. angles: "rad" or "deg" where no unit says so.
    delimiter: the character between columns, found when left out; decimal commas are read.
    lost: "drop" leaves out rows that are not finite or have a zero quaternion. repeated: "drop" or "merge" those whose
    times repeat or crowd. norms: how far norms of quaternions, scalar-last in files, may be from 1; 1e-3 when left out.
    every, rate: every n-th keyframe, or those nearest to so many per unit of time. What was chosen, left out and
    repaired, and where gaps are, is in the notes of `symmotion.files.read_recording`.

    node: the joint's, body's, node's or prim's name or index; when left out the root, or the node that
    moves and that all others which move hang from. animation: of glb and gltf, name or index;
    when left out the first that moves the node. steps: of glb and gltf, whether STEP keys "hold", or "keys" are
    read alone. offsets, frames, encoding: of bvh, see `read_bvh`.

    times: (M,), in place of the file's; 0, 1, 2, … where neither are given.

    formats: the table; with one of your own `(*symmotion.files.FORMATS, mine)`.

    path: of the file; format: by name, as `symmotion.files.FORMATS` has them.

    Raises InputError that names the file and the line, or JSON entry, at fault, and for an option
    that the format does not have.

    >>> sm.write_keyframes(sm.examples.random_keyframes(4, 40, seed=1), "walk.tum")
    >>> sm.read_keyframes("walk.tum")
    Keyframes(4 in 3D, times 0 to 3)
    """
    _require_path(path, "read_keyframes", Keyframes, "these are keyframes")
    given = {"times": times, "delimiter": delimiter, "node": node, "animation": animation, "columns": columns}
    given |= {"angles": angles, "lost": lost, "repeated": repeated, "norms": norms}
    given |= {"offsets": offsets, "frames": frames, "encoding": encoding, "steps": steps}
    return read_recording(path, format, every=every, rate=rate, formats=formats, **given).keyframes


def read_recording(
    path: FilePath,
    format: str | None = None,
    *,
    every: int | None = None,
    rate: float | None = None,
    formats: Iterable[Format] = FORMATS,
    **options: object,
) -> Recording:
    """Keyframes as `read_keyframes` reads them, with notes: what was chosen, left out, repaired, and where gaps are.

    options: and every, rate, format, formats: as for `read_keyframes`.

    path: of the file.

    Raises InputError as `read_keyframes` does.

    >>> sm.write_keyframes(sm.examples.random_keyframes(4, 40, seed=1), "walk.tum")
    >>> recording = sm.files.read_recording("walk.tum", every=2)
    >>> len(recording.keyframes)
    3
    """
    _require_path(path, "read_recording", Keyframes, "these are keyframes")
    found = read_file(path, Recording, formats, "keyframes", format=format, options=options)
    return thinned(found, every, rate)


def read_skeleton(
    path: FilePath,
    format: str | None = None,
    *,
    animation: str | int | None = None,
    offsets: str | None = None,
    frames: str | None = None,
    encoding: str | None = None,
    steps: str | None = None,
    formats: Iterable[Format] = FORMATS,
) -> PosedSkeleton:
    """All joints of a skeleton as they move, with keyframes of each and of the whole.

    bvh: of all frames, see `read_bvh`, offsets, frames, encoding too; glb, gltf: the joints of skins and the nodes that
    an animation moves, with those below, at all its keys; usda, usd, usdc, usdz: the prims that move, with those below.

    animation: of glb and gltf, name or index; the first that moves anything when left out. steps, format, formats: as
    in `read_keyframes`. Raises InputError that names the file and the line or entry at fault.

    path: of the file.

    >>> sm.files.write_bvh({"left": (keys := sm.examples.random_keyframes(4, 40, seed=1)), "right": keys}, "two.bvh")
    >>> sm.files.read_skeleton("two.bvh").names
    ('Bodies', 'left', 'left end', 'right', 'right end')
    """
    _require_path(path, "read_skeleton", PosedSkeleton, "this is a skeleton")
    given = {"animation": animation, "offsets": offsets, "frames": frames, "encoding": encoding, "steps": steps}
    return read_file(path, PosedSkeleton, formats, "skeleton", format=format, options=given)


# Any: what a motion is made of depends on the file.
def read_motion(path: FilePath, *, formats: Iterable[Format] = FORMATS) -> Motion[Any]:
    """The motion of whatever kind that `write_motion` or `save` wrote to a .json file, exactly.

    formats: as in `read_keyframes`. Raises InputError that names the file and the entry at fault.

    path: of the file.

    >>> motion = sm.interpolants.component_cubic(sm.examples.planar_keyframes())
    >>> sm.write_motion(motion, "motion.json")
    >>> sm.files.read_motion("motion.json") == motion
    True
    """
    if callable(path):
        raise InputError("read_motion takes a path; this is a motion already")
    checks.file_path(path, "the path given to read_motion,")
    # Any: what the file holds.
    found: Any = read_file(path, object, formats, "motion")
    try:
        placed(found)
    except InputError as error:
        raise InputError(f"{path}: {error}") from None
    return found


def read_two_parameter(path: FilePath, *, formats: Iterable[Format] = FORMATS) -> TwoParameterMotion:
    """A two-parameter motion from a .json or .npz file of at most 512 MB: one written by us, or a net of displacements.

    A net has the entries axis (n, m, 3), angle (n, m) in rad and optionally translation
    (n, m, 3), knots_u (n + 4,) and knots_v (m + 4,), uniform of distance 1 when left out: the
    control data of PCG table 1. Its quaternions are put in one hemisphere; those of a motion are
    taken as they are. formats: as in `read_keyframes`.

    path: of the file.

    Raises InputError that names the file and the entry at fault.

    >>> net = sm.motions.smooth_net(6)
    >>> sm.files.write_two_parameter(net, "net.json")
    >>> sm.files.read_two_parameter("net.json") == net
    True
    """
    _require_path(path, "read_two_parameter", TwoParameterMotion, "this is a two-parameter motion")
    return read_file(path, TwoParameterMotion, formats, "net")


def _require_path(path: FilePath, door: str, kind: type, already: str) -> None:
    if isinstance(path, kind):
        raise InputError(f"{door} takes a path; {already} already")
    checks.file_path(path, f"the path given to {door},")
