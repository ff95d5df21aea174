"""Keyframes and motions into files: the doors, which find the format in the table."""

from collections.abc import Iterable

from numpy.typing import ArrayLike

from symmotion.bodies import Shape
from symmotion.bodies.mesh import Mesh
from symmotion.bodies.places import Oriented, placed
from symmotion.bodies.shapes import Up
from symmotion.files.formats import FilePath, Format, require_order, write_file
from symmotion.files.table import FORMATS
from symmotion.files.written import WrittenMotion
from symmotion.motions import Keyframes
from symmotion.motions.motion import Motion
from symmotion.motions.two_parameter import TwoParameterMotion


def write_keyframes(
    keyframes: Keyframes, path: FilePath, format: str | None = None, *, formats: Iterable[Format] = FORMATS
) -> None:
    """Write a file that `read_keyframes` reads, in the format that its ending names unless one is given.

    csv: columns t, a11 …, v1 …; json: the object of arrays; kitti: 3D, and times 0, 1, 2, …
    only, since it has none; tum: rotations only; bvh: rotations at equal steps of time. Numbers come back
    exactly, from tum and bvh the rotations up to rounding. The file appears whole or not at all.

    formats: the table; with one of your own `(*symmotion.files.FORMATS, mine)`.

    Raises InputError for keyframes that the format cannot hold and a path that cannot be written.

    >>> sm.write_keyframes(sm.examples.planar_keyframes(), "keys.json")
    >>> len(sm.read_keyframes("keys.json"))
    4
    """
    require_order(keyframes, path, "write_keyframes", "keyframes", Keyframes)
    write_file(keyframes, path, formats, "keyframes", format=format)


def write_motion(
    motion: Motion | Oriented,
    path: FilePath,
    times: ArrayLike | None = None,
    rate: float | None = None,
    orthonormalise: bool = False,
    *,
    body: Shape | FilePath | None = None,
    seconds: float | None = None,
    tolerance: float | None = None,
    fps: float | None = None,
    up: Up | None = None,
    formats: Iterable[Format] = FORMATS,
) -> WrittenMotion | None:
    """Write a motion exactly (.json, for `read_motion`), sampled (.csv, .tum, .bvh), as a scene or as a film.

    In all but json an orientation alone turns about the origin. A scene, .glb or .usda (.usd, .usdc, .usdz), has a
    letter F in motion, or the body given: `write_gltf` and `write_usd` say how; what they say of the file's error is
    returned. A film, .gif or .mp4, is as `write_animation` has it.

    times: (N,) increasing, N ≥ 2, of the samples; or rate: samples per unit of time from the
    start of the domain on; 200 samples from end to end when both are left out.
    orthonormalise: in .tum and .bvh write the closest rotation of each sample, rigid or not.
    body, seconds, tolerance: of scenes, as in `write_gltf`; body, seconds, fps, up: of films, as in
    `write_animation`; body: the name of an .obj file too.
    formats: as in `write_keyframes`.

    Raises InputError that names the time of a sample that is singular or reflected or, unless
    `orthonormalise`, further than 1e-6 from rigid (.tum, .bvh), for options that the format does not
    have, and for a path that cannot be written.

    >>> motion = sm.interpolants.component_cubic(sm.examples.planar_keyframes())
    >>> sm.write_motion(motion, "samples.csv", rate=100)
    >>> len(sm.read_keyframes("samples.csv"))
    101
    """
    require_order(motion, path, "write_motion", "a motion")
    placed(motion)
    given = {
        "times": times,
        "rate": rate,
        "orthonormalise": orthonormalise,
        "body": body,
        "seconds": seconds,
        "tolerance": tolerance,
        "fps": fps,
        "up": up,
    }
    return write_file(motion, path, formats, "motion", "scene", "film", options=given)


def write_mesh(mesh: Mesh, path: FilePath, *, formats: Iterable[Format] = FORMATS) -> None:
    """Write a mesh as the ending of `path` says, triangles anticlockwise as seen from outside.

    obj: text, numbers that come back exactly; ply: binary, little endian, double precision;
    stl: binary, single precision, a normal per triangle and no shared vertices, as the format
    has it. The file appears whole or not at all. formats: as in `write_keyframes`.

    Raises InputError for another ending, for a mesh whose coordinates single precision would
    move by more than 1e-4 of its size (stl), and for a path that cannot be written.

    >>> from symmotion.bodies import Mesh
    >>> corner = Mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
    >>> sm.files.write_mesh(corner, "corner.stl")
    """
    require_order(mesh, path, "write_mesh", "a mesh", Mesh)
    write_file(mesh, path, formats, "mesh")


def write_two_parameter(motion: TwoParameterMotion, path: FilePath, *, formats: Iterable[Format] = FORMATS) -> None:
    """Write a two-parameter motion exactly, for `read_two_parameter`: .json or .npz.

    Entries: degree (2,), knots_u, knots_v, real (n, m, 4) and for a spatial motion dual
    (n, m, 4), scalar-first. The file appears whole or not at all. formats: as in `write_keyframes`.

    path: of the file, whose ending is its format.

    Raises InputError for an ending that has no format.

    >>> sm.files.write_two_parameter(sm.motions.smooth_net(6), "net.npz")
    """
    require_order(motion, path, "write_two_parameter", "a two-parameter motion", TwoParameterMotion)
    write_file(motion, path, formats, "net")
