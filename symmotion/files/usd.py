"""Motions as USD: matrices at time samples, linear between them."""

import json
from collections.abc import Iterable, Mapping
from pathlib import Path

import numpy as np

from symmotion.bodies import Body, Shape
from symmotion.bodies.places import Oriented, carried, extent, fitting_body, in_space, placed
from symmotion.files import keys as key
from symmotion.files.formats import FilePath, format_of, require_order
from symmotion.files.usd_library import library, write_binary
from symmotion.files.written import TOLERANCE, WrittenMotion, seconds_per_unit
from symmotion.motions import AffineMotion, PoseMotion
from symmotion.motions.motion import Moving
from symmotion.whole import whole_file

FRAMES_PER_SECOND = 24
ASCII = "usda"
ENDINGS = (ASCII, "usd", "usdc", "usdz")


def write_usd(
    motion: Moving | Oriented,
    path: FilePath,
    body: Shape | None = None,
    *,
    seconds: float | None = None,
    tolerance: float = TOLERANCE,
) -> WrittenMotion:
    """Write a motion as USD with a transform's matrix time samples, and say how far the file is from it.

    .usda is ASCII; .usd and .usdc, binary, and .usdz, a package, take Pixar's library, `symmotion[usd]`.

    The prim /Motion has one `xformOp:transform`, whose samples are transposed: USD's vectors are
    rows. Between samples USD interpolates the sixteen numbers linearly, which is the motion where
    it is a spline of degree 1; else intervals are halved from the motion's breakpoints on until
    the body's outermost vertices are where they belong to the tolerance. Numbers have double precision.

    body, tolerance: as in `write_gltf`. seconds: the duration in the file, whose time codes, 24 a
    second, begin at 0; a unit of the motion's time is a second when left out. Axes are the
    motion's own with y upwards, planar motions in the plane z = 0. Error, route and start are
    also in the file, in customLayerData.

    Raises InputError for motions that would need more than 100,000 samples, one that jumps
    (naming when), bodies and options of other kinds, and a path that cannot be written.

    >>> motion = sm.interpolants.component_cubic(sm.examples.spatial_keyframes())
    >>> sm.files.write_usd(motion, "motion.usda", tolerance=1e-3).route
    'matrix samples'
    """
    require_order(motion, path, "write_usd", "a motion")
    if format_of(path, None, ENDINGS) != ASCII:
        library(path)  # here and not after the work
    motion = placed(motion)
    rate = seconds_per_unit(motion, seconds, tolerance)
    mesh = fitting_body(body, motion, up="y").in_space()
    probes = mesh.vertices[mesh.outermost()]
    size = extent(motion, probes)
    exact = isinstance(motion, AffineMotion) and motion.degree <= 1
    times = key.breakpoints(motion)
    if isinstance(motion, AffineMotion | PoseMotion):
        key.require_continuous(motion.spline if isinstance(motion, AffineMotion) else motion.translation)

    def deviations(times: np.ndarray) -> np.ndarray:
        t = key.between(times)
        places = carried(motion, probes, times)
        share = key.INSIDE[None, :, None, None]
        linear = places[:-1, None] * (1 - share) + places[1:, None] * share
        return np.linalg.norm(linear.reshape(-1, *places.shape[1:]) - carried(motion, probes, t), axis=2).max(axis=1)

    if not exact:
        times = key.halved_until(times, deviations, tolerance * size)
    error = float(key.largest(times, deviations).max())
    written = WrittenMotion(Path(path), "matrix samples", len(times), exact, error, size)
    codes = (times - motion.domain[0]) * rate * FRAMES_PER_SECOND
    lines = (f"{line}\n" for line in _lines(motion, times, codes, mesh, written, rate))
    if format_of(path, None, ENDINGS) != ASCII:
        write_binary("".join(lines), path)
        return written
    with whole_file(path) as handle:
        handle.writelines(lines)
    return written


def check_usd(path: FilePath, **_: object) -> None:
    """Raise InputError where the library that a file takes is not installed."""
    if format_of(path, None, ENDINGS) != ASCII:
        library(path)


def _lines(
    motion: Moving, times: np.ndarray, codes: np.ndarray, body: Body, written: WrittenMotion, rate: float
) -> Iterable[str]:
    yield from _head(written.notes(motion.domain[0], rate), float(codes[-1]))
    yield 'def Xform "Motion"'
    yield "{"
    yield from _samples(motion, times, codes)
    yield from _mesh(body)
    yield "}"


def _head(notes: Mapping[str, object], last: float) -> Iterable[str]:
    """What is true of the whole file."""
    yield "#usda 1.0"
    yield "("
    yield "    customLayerData = {"
    for name, value in notes.items():
        kind = {bool: "bool", int: "int", float: "double", str: "string"}[type(value)]
        yield f"        {kind} {name} = {json.dumps(value)}"
    yield "    }"
    yield '    defaultPrim = "Motion"'
    yield f"    endTimeCode = {last!r}"
    yield f"    framesPerSecond = {FRAMES_PER_SECOND}"
    yield "    metersPerUnit = 1"
    yield "    startTimeCode = 0"
    yield f"    timeCodesPerSecond = {FRAMES_PER_SECOND}"
    yield '    upAxis = "Y"'
    yield ")"


def _samples(motion: Moving, times: np.ndarray, codes: np.ndarray) -> Iterable[str]:
    """The matrices of times (K,), transposed, at codes (K,)."""
    linear, translation = in_space(*motion(times))
    matrices = np.zeros((len(times), 4, 4))
    matrices[:, :3, :3], matrices[:, 3, :3], matrices[:, 3, 3] = np.swapaxes(linear, 1, 2), translation, 1.0
    yield "    matrix4d xformOp:transform.timeSamples = {"
    for code, matrix in zip(codes.tolist(), matrices.tolist(), strict=True):
        yield f"        {code!r}: {_tuple(map(_tuple, matrix))},"
    yield "    }"
    yield '    uniform token[] xformOpOrder = ["xformOp:transform"]'


def _mesh(body: Body) -> Iterable[str]:
    low, high = body.vertices.min(axis=0), body.vertices.max(axis=0)
    yield '    def Mesh "Body"'
    yield "    {"
    yield "        uniform bool doubleSided = 1"
    yield f"        float3[] extent = [{_tuple(low.tolist())}, {_tuple(high.tolist())}]"
    yield f"        int[] faceVertexCounts = [{', '.join(['3'] * len(body.triangles))}]"
    yield f"        int[] faceVertexIndices = [{', '.join(map(str, body.triangles.ravel().tolist()))}]"
    yield f"        point3f[] points = [{', '.join(map(_tuple, body.vertices.tolist()))}]"
    yield f"        color3f[] primvars:displayColor = [{', '.join(map(_tuple, body.shown_colours.tolist()))}] ("
    yield '            interpolation = "vertex"'
    yield "        )"
    yield '        uniform token subdivisionScheme = "none"'
    yield "    }"


def _tuple(items: Iterable[object]) -> str:
    return f"({', '.join(x if isinstance(x, str) else repr(x) for x in items)})"
