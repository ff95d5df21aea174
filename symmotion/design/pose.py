"""Pose motions through keyframes: orientation and position in one program."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from time import perf_counter
from typing import Any

import casadi as ca
import numpy as np

from symmotion.design.control_nodes import UNKNOWN, Node
from symmotion.design.control_start import motion_of
from symmotion.design.orientation import NO_LIMITS, Limits, OrientationDesign
from symmotion.energies import TrajectoryEnergy
from symmotion.errors import InputError
from symmotion.motions.keyframes import Keyframes
from symmotion.motions.pose import PoseMotion
from symmotion.motions.quaternions.algebra import Signs
from symmotion.motions.quaternions.keys import OrientationKeys
from symmotion.program import Block, Constraint, Program
from symmotion.splines import Spline, closest, cubic_interpolant


def pose_program(
    keys,
    quaternions=None,
    translation=None,
    *,
    objective: TrajectoryEnergy | None = None,
    torque_weight: float = 1.0,
    inertia=None,
    knots_per_interval: int = 2,
    ends: str = "natural",
    end_rates=None,
    turns=None,
    signs: Signs = "align",
    limits: Limits = NO_LIMITS,
    nodes: int = 6,
) -> Program:
    """The rigid motion of least torque and trajectory energy through poses, as one program.

    Minimise torque_weight ∫ ‖τ‖² dt + E, E = ∫ Σ m_i ‖d²/dt² (v + R p_i)‖² dt (HJK (12)), over
    control quaternions and control points, subject to unit norms and both halves of every keyframe.

    keys: rigid `Keyframes` in space; or times (M,), beside quaternions: (M, 4) scalar first, or a
        `Rotation`, and translation: (M, 3).
    objective: a TrajectoryEnergy of body points, of the origin alone when left out, which is
        ∫ ‖v̈‖² and leaves position and orientation apart. The rest is as in `orientation_program`.
    """
    began = perf_counter()
    given = keys
    keys = OrientationKeys.of(given, quaternions, turns, signs)
    if isinstance(given, Keyframes) and translation is None:
        translation = given.translation
    points = np.array(translation, dtype=float)
    if points.shape != (len(keys), 3) or not np.isfinite(points).all():
        raise InputError(f"translation of shape {points.shape}: finite, ({len(keys)}, 3) is needed")
    if not (np.isfinite(torque_weight) and torque_weight > 0):
        raise InputError(f"torque_weight {torque_weight!r}: a positive finite number is needed")
    energy = TrajectoryEnergy(np.zeros((1, 3))) if objective is None else objective
    if not isinstance(energy, TrajectoryEnergy) or energy.points.shape[1] != 3:
        raise InputError(f"objective {objective!r}: a TrajectoryEnergy of points in space is needed")
    turning = OrientationDesign.of(
        keys, inertia, knots_per_interval, 3, ends, end_rates, None, limits, None, nodes, channels=7
    )
    spline = cubic_interpolant(keys.times, points, "periodic" if ends == "periodic" else "natural")
    start = _refined(spline, turning, keys)
    program = PoseDesign(turning, points, energy, torque_weight, start).program()
    return replace(program, build_seconds=perf_counter() - began)


def _refined(spline: Spline, turning: OrientationDesign, keys: OrientationKeys) -> np.ndarray:
    """(n, 3) the control points of the spline over the basis of the orientation."""
    basis = turning.space.basis
    if not basis.periodic:
        return closest(basis, spline, keys.times).control_points
    # A periodic basis with the old knots among its own holds the spline: as many values as controls fix it.
    where = basis.greville
    a, b = spline.domain
    return np.linalg.solve(basis(a + (where - a) % (b - a)), spline(a + (where - a) % (b - a)))


@dataclass(frozen=True, eq=False)
class PoseDesign:
    """The question of a pose program; translation: (M, 3) of the keyframes; start: (n, 3) control points."""

    turning: OrientationDesign
    translation: np.ndarray
    energy: TrajectoryEnergy
    torque_weight: float
    start: np.ndarray

    def program(self) -> Program:
        """The program of this question."""
        controls = np.concatenate([self.turning.start.control_points, self.start], axis=1)
        terms = (self.turning.torque_term(self.torque_weight), self._paths())
        return Program({UNKNOWN: controls}, terms, (*self.turning.constraints(), self._places()), self)

    def _paths(self) -> Block:
        times, weights = self.turning.space.gauss(self.turning.nodes)
        points = self.energy.points
        masses = np.ones(len(points)) if self.energy.masses is None else self.energy.masses
        # Σ m ‖v̈ + R B p‖² with B = [Ω]×² + [Ω̇]×, whatever the number of points: the moments of the body
        # are m, Σ m p, Σ m p pᵀ = L Lᵀ about the centre of mass c, and ‖R x‖ = ‖x‖.
        mass = masses.sum()
        centre = masses @ points / mass
        spread = np.transpose(np.linalg.qr(np.sqrt(masses)[:, None] * (points - centre), mode="r"))

        def residuals(node: Node) -> ca.SX:
            spin = ca.skew(node.jet.rate)
            bend = spin @ spin + ca.skew(node.jet.acceleration)
            travel = node.translation(2)
            if centre.any():
                travel = travel + _rotated(node.quaternion, bend @ ca.DM(centre))
            whole = [np.sqrt(mass) * travel]
            if np.abs(spread).max() > 0:
                whole.append(ca.vec(bend @ ca.DM(spread)))
            return node.extra[0] * ca.vertcat(*whole)

        # A node to an element: with all nodes of a span in one, the kernel takes long to derive.
        return self.turning.space.block("E", times.reshape(-1, 1), residuals, np.sqrt(weights).reshape(-1, 1, 1), True)

    def _places(self) -> Constraint:
        held = self.turning.held
        times, wanted = self.turning.keys.times[held], self.translation[held]
        return self.turning.space.at("translation", times, lambda n: n.translation(0) - n.extra, wanted)

    def motion(self, unknowns: Mapping[str, np.ndarray]) -> PoseMotion:
        """The motion of the program's unknowns."""
        controls = unknowns[UNKNOWN]
        space = self.turning.space
        return PoseMotion(motion_of(space, controls[:, :4]), Spline(space.basis, controls[:, 4:].copy()))

    def unknowns(self, motion: PoseMotion) -> dict[str, np.ndarray]:
        """The unknowns of a motion over the same knots."""
        basis = self.turning.space.basis
        if not np.array_equal(motion.translation.basis.knots, basis.knots):
            raise InputError("a start for a pose program has the knots of the program")
        turning = self.turning.unknowns(motion.orientation)[UNKNOWN]
        return {UNKNOWN: np.concatenate([turning, motion.translation.control_points], axis=1)}

    def multipliers(self, multipliers: Mapping[str, np.ndarray]) -> dict[str, Any]:
        """Multipliers by constraint: "keyframes" (M, 3) of the turns, "translation" (M, 3) of the places."""
        placed = np.zeros_like(self.translation)
        placed[self.turning.held] = multipliers["translation"]
        return {**self.turning.multipliers(multipliers), "translation": placed}

    def with_keyframes(self, program: Program, keyframes: Any) -> Program:
        """Not for poses: InputError."""
        raise InputError("make a new pose_program for other keyframes")

    def stages(self, by: str) -> Iterable[Program]:
        """Pose programs have no stages: InputError."""
        raise InputError("stages are for affine motions")


def _rotated(q: ca.SX, v: ca.SX) -> ca.SX:
    twice = 2 * ca.cross(q[1:], v)
    return v + q[0] * twice + ca.cross(q[1:], twice)
