"""Motions as animated glTF 2.0: four translated joints for affine motions, a turning node for rigid ones."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from symmotion.bodies import Body, Shape
from symmotion.bodies.places import Oriented, carried, dimension_of, extent, fitting_body, in_space, placed
from symmotion.files import keys as key
from symmotion.files.formats import FilePath, format_of, require_order
from symmotion.files.gltf_document import DocumentBuilder
from symmotion.files.gltf_scenes import skinned_scene, turning_scene
from symmotion.files.keys import HermiteKeys
from symmotion.files.written import TOLERANCE, WrittenMotion, seconds_per_unit
from symmotion.motions import AffineMotion, PoseMotion
from symmotion.motions.interpolants import slerp
from symmotion.motions.motion import Moving
from symmotion.motions.quaternions import ProductMotion, QuaternionMotion
from symmotion.motions.quaternions.algebra import conjugate, product, rotate
from symmotion.splines import Spline
from symmotion.whole import whole_file

EXACT_DEGREE = 3


@dataclass(frozen=True, eq=False)
class Target:
    """Where a file puts things; path, body; centre: (3,) its origin, in the middle of the motion.

    start: the motion's time at 0 on its clock; rate: seconds per unit of time; size: of the motion
    with the body; tolerance: of sampled keys, absolute.
    """

    path: Path
    body: Body
    centre: np.ndarray
    start: float
    rate: float
    size: float
    tolerance: float

    @property
    def probes(self) -> np.ndarray:
        """(26, 3) the body's outermost vertices, at which errors are measured."""
        return self.body.vertices[self.body.outermost()]

    def stated(self, motion: Moving, times: np.ndarray, kind: str, exact: bool, places: Callable) -> WrittenMotion:
        """What is said of keys at times (K,); places: from times (N,) to where the file has the probes (N, P, 3)."""

        def deviations(times: np.ndarray) -> np.ndarray:
            t = key.between(times)
            return _distance(places(t), carried(motion, self.probes, t)).max(axis=1)

        error = float(key.largest(times, deviations).max())
        return WrittenMotion(self.path, kind, len(times), exact, error, self.size)


def write_gltf(
    motion: Moving | Oriented,
    path: FilePath,
    body: Shape | None = None,
    *,
    seconds: float | None = None,
    tolerance: float = TOLERANCE,
) -> WrittenMotion:
    """Write a motion as an animated .glb (glTF 2.0, binary) and say how far the file is from it.

    Affine motions move four joints, the corners pⱼ of a tetrahedron about the body, and each
    vertex x = Σ wⱼ pⱼ follows them with its barycentric coordinates wⱼ: affine maps keep those, so
    v(t) + A(t) x = Σ wⱼ (v(t) + A(t) pⱼ), and the skin is the motion. The joints' paths are
    splines like the motion, which up to degree 3 cubic Hermite keys at the breakpoints hold
    exactly, one-sided slopes where the motion is only continuous. Higher degrees and motions that
    are no splines get as many keys as the tolerance takes. Joints, unlike morph targets, need one
    weight per corner, four in all, which every viewer allows. Joints that only move do not turn
    normals: none are written, so that viewers shade the moved triangles.

    Rigid motions (`PoseMotion`, `QuaternionMotion`) move one node: its translation by Hermite
    keys, its rotation by linear keys (slerp) as fine as the tolerance takes.

    body: of any form that `Body.of` takes, its faces cut into triangles; a letter F when left out;
    planar motions move in the plane z = 0. Axes are the motion's own; viewers
    show y upwards. seconds: the duration in the file, whose clock begins at 0; a unit of the
    motion's time is a second when left out. tolerance: of sampled keys, relative to the size of
    the motion. glTF stores single precision; the static node `motion`, in double precision, has
    the middle of the motion, so that it is relative to its size and not to where it is. Error,
    route and start are also in the file, in asset.extras.

    Raises InputError for a motion that jumps (naming when), bodies and options of other kinds,
    keys too close for single precision, and a path that cannot be written.

    >>> motion = sm.interpolants.component_cubic(sm.examples.spatial_keyframes())
    >>> sm.files.write_gltf(motion, "motion.glb", seconds=2).keys
    4
    """
    require_order(motion, path, "write_gltf", "a motion")
    format_of(path, None, ("glb",))
    motion = placed(motion)
    rate = seconds_per_unit(motion, seconds, tolerance)
    mesh = fitting_body(body, motion, up="y").in_space()
    size = extent(motion, mesh.vertices[mesh.outermost()])
    t = np.linspace(*motion.domain, 65)
    places = carried(motion, np.zeros((1, 3)), t)[:, 0]
    centre = (places.min(axis=0) + places.max(axis=0)) / 2
    target = Target(Path(path), mesh, centre, motion.domain[0], rate, size, tolerance * size)
    document, written = _rigid(motion, target) if isinstance(motion, PoseMotion) else _skinned(motion, target)
    with whole_file(path, binary=True) as handle:
        handle.write(document.glb())
    return written


def _distance(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return np.linalg.norm(a - b, axis=-1)


def _skinned(motion: Moving, target: Target) -> tuple[DocumentBuilder, WrittenMotion]:
    corners, weights = _tetrahedron(target.body.vertices)
    keys, exact = _corner_keys(motion, corners, target)
    ticks = key.clock(keys.times, target.start, target.rate)
    stored = keys.stored(ticks)
    chosen = weights[target.body.outermost()]
    bind = key.single(corners)

    def places(t: np.ndarray) -> np.ndarray:
        # Linear blend skinning as the file has it: Σ wⱼ (x + pⱼ(t) − pⱼ).
        joints = stored((t - target.start) * target.rate)
        shift = np.einsum("pj,njc->npc", chosen, joints - bind)
        return target.centre + shift + key.single(target.probes)

    written = target.stated(motion, keys.times, "cubic Hermite keys of four joints", exact, places)
    notes = written.notes(target.start, target.rate)
    return skinned_scene(notes, target.body, target.centre, corners, weights, ticks, stored), written


def _corner_keys(motion: Moving, corners: np.ndarray, target: Target) -> tuple[HermiteKeys, bool]:
    """Hermite keys of the corners' paths, and whether they are exact."""
    if not isinstance(motion, AffineMotion):
        return _sampled_keys(motion, corners, target), False
    # A corner's path has the controls' positions of the corner as controls, since the B-splines sum to 1.
    linear, translation = in_space(motion.linear, motion.translation)
    controls = translation[:, None] + corners @ np.swapaxes(linear, -1, -2)
    return _spline_keys(Spline(motion.basis, controls - target.centre), target)


def _tetrahedron(vertices: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The corners (4, 3) of a tetrahedron about the body, and the vertices' barycentric coordinates (V, 4), rounded.

    Its legs, three times the sides of the body's box, leave from the box's lowest corner: all coordinates are ≥ 0.
    """
    low = vertices.min(axis=0)
    sides = vertices.max(axis=0) - low
    # A flat body needs height all the same; a single point any.
    sides = np.where(sides > 1e-6 * sides.max(), sides, sides.max() if sides.max() > 0 else 1.0)
    corners = np.concatenate([low[None], low + np.diag(3 * sides)])
    # Whole multiples of 2⁻²³, which single precision holds, add up to 1 without rounding: with a sum that is
    # only nearly 1 a body far from the origin would be off by that share of the way.
    legs = np.floor((vertices - low) / (3 * sides) * 2**23) / 2**23
    return corners, np.concatenate([1 - legs.sum(axis=1, keepdims=True), legs], axis=1)


def _spline_keys(spline: Spline, target: Target) -> tuple[HermiteKeys, bool]:
    """Hermite keys of a spline, and whether they are exact."""
    exact = spline.degree <= EXACT_DEGREE
    times = spline.breakpoints
    if not exact:

        def deviations(times: np.ndarray) -> np.ndarray:
            t = key.between(times)
            return _distance(key.spline_keys(spline, times)(t), spline(t)).reshape(len(t), -1).max(axis=1)

        times = key.halved_until(times, deviations, target.tolerance)
    return key.spline_keys(spline, times), exact


def _sampled_keys(motion: Moving, points: np.ndarray, target: Target) -> HermiteKeys:
    """Hermite keys of body points (P, 3) of any motion that has a derivative."""

    d = dimension_of(motion)

    def keys(times: np.ndarray) -> HermiteKeys:
        rates = motion(times, 1)
        slopes = rates.translation[:, None] + points[:, :d] @ np.swapaxes(rates.linear, -1, -2)
        slopes = np.pad(slopes, ((0, 0), (0, 0), (0, 3 - d)))
        return HermiteKeys(times, carried(motion, points, times) - target.centre, slopes, slopes)

    def deviations(times: np.ndarray) -> np.ndarray:
        t = key.between(times)
        return _distance(keys(times)(t), carried(motion, points, t) - target.centre).max(axis=1)

    return keys(key.halved_until(key.breakpoints(motion), deviations, target.tolerance))


def _rigid(motion: PoseMotion, target: Target) -> tuple[DocumentBuilder, WrittenMotion]:
    path = Spline(motion.translation.basis, motion.translation.control_points - target.centre)
    moves, _ = _spline_keys(path, target)
    times, q = _turning_keys(motion.orientation, target)
    ticks, moving = (key.clock(x, target.start, target.rate) for x in (times, moves.times))
    turns, stored = key.single(q), moves.stored(moving)

    def places(t: np.ndarray) -> np.ndarray:
        now = (t - target.start) * target.rate
        turned = _turned(ticks, turns / np.linalg.norm(turns, axis=1, keepdims=True), now)
        return target.centre + stored(now)[:, None] + rotate(turned[:, None], key.single(target.probes))

    # The keys of both, where errors are looked for; a turn that is none is held by two keys exactly.
    every = np.union1d(times, moves.times)
    written = target.stated(
        motion, every, "keys of a node, linear rotations and cubic Hermite translations", False, places
    )
    notes = written.notes(target.start, target.rate)
    return turning_scene(notes, target.body, target.centre, ticks, turns, moving, stored), written


def _turning_keys(orientation: QuaternionMotion | ProductMotion, target: Target) -> tuple[np.ndarray, np.ndarray]:
    """Times (K,) and quaternions (K, 4), neighbours on one side, between which slerps are fine enough."""
    radius = float(np.linalg.norm(target.body.vertices, axis=1).max())

    def quaternions(times: np.ndarray) -> np.ndarray:
        q = orientation(times)
        signs = np.where(np.sum(q[1:] * q[:-1], axis=1) < 0, -1.0, 1.0)
        return q * np.cumprod(np.concatenate([[1.0], signs]))[:, None]

    def deviations(times: np.ndarray) -> np.ndarray:
        t = key.between(times)
        miss = product(conjugate(_turned(times, quaternions(times), t)), orientation(t))
        # A chord of the circle that the furthest vertex would be off along.
        return 2 * radius * np.linalg.norm(miss[:, 1:], axis=1)

    times = key.halved_until(key.turning_points(orientation), deviations, target.tolerance)
    return times, quaternions(times)


def _turned(times: np.ndarray, quaternions: np.ndarray, t: np.ndarray) -> np.ndarray:
    """(N, 4) slerps at times t (N,) between quaternions (K, 4) at times (K,)."""
    k = np.clip(np.searchsorted(times, t, side="right") - 1, 0, len(times) - 2)
    return slerp(quaternions[k], quaternions[k + 1], (t - times[k]) / (times[k + 1] - times[k]))
