"""Pose motions through keyframes: orientation and position in one program."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from time import perf_counter
from typing import TYPE_CHECKING

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike

from symmotion import checks
from symmotion.brief import in_a_line
from symmotion.constraints import MotionConstraint, Setting
from symmotion.design.control_nodes import POINT, TURN
from symmotion.design.control_start import motion_of, unknowns_of
from symmotion.design.orientation import RENAMED, TORQUE, OrientationDesign
from symmotion.design.quadratures import nodes_at, term_quadratures
from symmotion.design.question import as_constraints, assembled, require_start, require_times
from symmotion.design.terms import as_objective, closed_expression, parts_of
from symmotion.energies import Energy, TrajectoryEnergy
from symmotion.errors import InputError
from symmotion.jets.space import UNKNOWN, block_of
from symmotion.motions import Keyframes, PoseMotion
from symmotion.motions.crowding import require_apart
from symmotion.motions.quaternions import OrientationKeys, QuaternionMotion
from symmotion.motions.quaternions.algebra import Signs
from symmotion.program import Constraint, Multipliers, Program, Quadrature
from symmotion.program.state import made_of
from symmotion.renamed import renamed
from symmotion.splines import Spline, amid, closest, cubic_interpolant

if TYPE_CHECKING:
    from symmotion.motions.rotations import Rotations

ORIGIN = TrajectoryEnergy(np.zeros((1, 3)))


@renamed(**RENAMED)
def pose_program(
    keys: ArrayLike | Keyframes,
    quaternions: "Rotations | None" = None,
    translation: ArrayLike | None = None,
    *,
    objective: Energy | None = None,
    constraints: Sequence[MotionConstraint] = (),
    degree: int = 3,
    refine: int = 1,
    knots: ArrayLike | None = None,
    ends: str = "natural",
    end_rates: ArrayLike | None = None,
    turns: ArrayLike | None = None,
    signs: Signs = "align",
    scalar_first: bool = True,
    norms: float | None = None,
) -> "Program[PoseDesign]":
    """The rigid motion of least torque and bending, or otherwise best, through poses, as one program.

    Minimise `objective` over control quaternions, the increments between them and control points, subject to unit
    norms, to where the increments lead, both halves of every keyframe, and the constraints.

    keys: rigid `Keyframes` in space; or times (M,), beside quaternions: (M, 4) scalar first, or a
        `Rotation`, and translation: (M, 3); or a `RigidTransform`, which has both.
    objective: an energy or weighted sum of energies of the jet (`RigidJet`); Torque() plus a TrajectoryEnergy of
        the origin when left out, which is ∫ ‖Ω̇‖² + ‖v̈‖² and leaves position and orientation apart. It has to see the
        translation. The rest is as in `orientation_program`; `end_rates` are those of the turn.

    degree, refine, knots, ends, turns, signs, scalar_first, norms: as there. Raises InputError for what cannot be, and
    SolveError where there is no curve to start from.

    >>> keys = sm.examples.random_keyframes(4, 60, seed=1)
    >>> solution = sm.ExactNewton().solve(sm.pose_program(keys)).require()
    >>> solution.motion
    PoseMotion(times 0 to 3)
    """
    began = perf_counter()
    asked = as_constraints(constraints)
    given = OrientationKeys.of(keys, quaternions, turns, signs, scalar_first=scalar_first, norms=norms)
    require_apart(given.times)
    if isinstance(keys, Keyframes) and translation is None:
        translation = keys.translation
    if translation is None:
        translation = getattr(quaternions, "translation", None)  # of a RigidTransform
    if translation is None:
        raise InputError("translation: (M, 3), the places of the keyframes, is needed beside times and rotations")
    points = checks.array(translation, (len(given), 3), "translation")
    energy = as_objective(objective, TORQUE + ORIGIN)
    turning = OrientationDesign.of(given, energy, asked, degree, refine, knots, ends, end_rates, pose=True)
    symbols = turning.space.symbols()
    whole = ca.vertcat(*(ca.vec(closed_expression(e, w, symbols)[0]) for _, w, e in parts_of(energy)))
    if not ca.depends_on(whole, ca.vertcat(*symbols.translation)):
        raise InputError(f"the objective {energy.name} does not see the translation: add a TrajectoryEnergy")
    start = _refined(_path(given, points, ends), turning, given)
    program = PoseDesign(_about(turning, points), points, start).program()
    return replace(program, build_seconds=perf_counter() - began)


def _about(turning: OrientationDesign, points: np.ndarray) -> OrientationDesign:
    """The question with control points that are unknown from a point amid these (M, 3) on."""
    return replace(turning, space=replace(turning.space, shift=amid(points), _slots={}))


def _path(keys: OrientationKeys, points: np.ndarray, ends: str) -> Spline:
    return cubic_interpolant(keys.times, points, "periodic" if ends == "periodic" else "natural")


def _refined(spline: Spline, turning: OrientationDesign, keys: OrientationKeys) -> np.ndarray:
    """(n, 3) the control points of the spline over the basis of the orientation."""
    basis = turning.space.basis
    if not basis.periodic:
        return closest(basis, spline, keys.times).control_points
    basis, spline = basis.relative, spline.about(basis.origin).relative
    # A periodic basis with the old knots among its own holds the spline: as many values as controls fix it.
    where = basis.greville
    a, b = spline.domain
    return np.linalg.solve(basis(a + (where - a) % (b - a)), spline(a + (where - a) % (b - a)))


@dataclass(frozen=True, eq=False)
class PoseDesign:
    """The question of a pose program; translation: (M, 3) of the keyframes; start: (n, 3) control points.

    turning: the question of its orientation. Raises InputError for a start of another kind.

    >>> program = sm.pose_program(sm.examples.random_keyframes(3, 40, seed=1))
    >>> program.design.translation.shape
    (3, 3)
    """

    turning: OrientationDesign
    translation: np.ndarray
    start: np.ndarray

    __repr__ = in_a_line

    __getstate__ = made_of

    @property
    def notes(self) -> tuple[str, ...]:
        """What is said before solving: keyframes that crowd."""
        return self.turning.notes

    @cached_property
    def setting(self) -> Setting:
        """What constraints may know of this program: its keyframes, rotations and translations."""
        return replace(self.turning.setting, translation=self.translation)

    def program(self) -> "Program[PoseDesign]":
        """The program of this question."""
        controls = np.concatenate([unknowns_of(self.turning.start), self.start - self.shift], axis=1)
        turning = self.turning
        given = [*turning.given(), *self._places()]
        start, lengths = {UNKNOWN: controls}, {UNKNOWN: POINT}
        shifts = {UNKNOWN: np.concatenate([np.zeros(POINT.start), self.shift])}
        terms = turning.terms(self.motion(start))
        asked, unit = turning.constraints, {UNKNOWN: TURN}
        return assembled(start, terms, given, asked, self.setting, self, lengths, shifts, unit)

    @property
    def shift(self) -> np.ndarray:
        """(3,) what the program subtracts from every control point: a point amid keyframes that are far from zero."""
        return self.turning.space.shift

    @cached_property
    def placed(self) -> np.ndarray:
        """(N,) the keyframes whose place is a condition."""
        return self.turning.not_freed(self.setting, 1)

    def _places(self) -> list[Constraint]:
        which, space = self.placed, self.turning.space
        if not which.size:
            return []
        wanted = ca.SX.sym("place", 3)
        # Of the places and of the unknowns the same is subtracted.
        near = space.unshifted
        out, times = near.jet().v - wanted, self.turning.keys.times[which, None]
        places = self.translation[which] - self.shift
        block = block_of("translation", out, [near], times, data=wanted, numbers=places)
        return [Constraint.equality(block)]

    def motion(self, unknowns: Mapping[str, np.ndarray]) -> PoseMotion:
        """The motion of the program's unknowns."""
        controls = unknowns[UNKNOWN]
        space = self.turning.space
        return PoseMotion(motion_of(space, controls), Spline(space.basis, controls[:, POINT] + self.shift))

    def unknowns(self, motion: PoseMotion) -> dict[str, np.ndarray]:
        """The unknowns of a motion over the same knots."""
        require_start(motion, PoseMotion, 3)
        basis = self.turning.space.basis
        if not motion.translation.basis.same_knots(basis):
            raise InputError("a start for a pose program has the knots of the program")
        turning = self.turning.unknowns(require_start(motion.orientation, QuaternionMotion, 3))[UNKNOWN]
        return {UNKNOWN: np.concatenate([turning, motion.translation.control_points - self.shift], axis=1)}

    def multipliers(self, multipliers: Mapping[str, np.ndarray]) -> Multipliers:
        """Multipliers by constraint: "keyframes" (M, 3) of the turns, "translation" (M, 3) of the places."""
        placed = np.zeros_like(self.translation)
        if "translation" in multipliers:
            placed[self.placed] = multipliers["translation"]
        return {**self.turning.multipliers(multipliers), "translation": placed}

    def quadratures(self, program: Program, x: np.ndarray) -> dict[str, Quadrature]:
        """By term, how well its nodes integrate at x (unknowns,)."""
        return term_quadratures(
            program, x, self.turning.objective, self.motion(program.unpack(x)), self.turning.keys.times
        )

    def refined(self, program: "Program[PoseDesign]", x: np.ndarray) -> "Program[PoseDesign] | None":
        """The program with the nodes that ten digits need at x (unknowns,); None where it has them, or can have."""
        nodes = nodes_at(program, x, self.turning.objective, self.motion(program.unpack(x)))
        if not nodes:
            return None
        turning = replace(self.turning, nodes={**self.turning.nodes, **nodes})
        return replace(self, turning=turning).program().with_parameters(**program.parameters)

    def with_keyframes(
        self, program: "Program[PoseDesign]", keyframes: "Keyframes | tuple[ArrayLike, Rotations, ArrayLike]"
    ) -> "Program[PoseDesign]":
        """The program for other rigid `Keyframes`, or a tuple (times, quaternions, translation), at the same times."""
        began = perf_counter()
        if isinstance(keyframes, Keyframes):
            keyframes = keyframes.times, keyframes.rotations(), keyframes.translation
        if not isinstance(keyframes, tuple) or len(keyframes) != 3:
            raise InputError("with_keyframes takes rigid Keyframes, or a tuple of times, quaternions and translation")
        times, quaternions, translation = keyframes
        require_times(times, self.turning.keys.times)
        turning = self.turning.turned(quaternions)
        points = checks.array(translation, self.translation.shape, "translation")
        start = _refined(_path(turning.keys, points, turning.ends), turning, turning.keys)
        fresh = PoseDesign(_about(turning, points), points, start).program()
        same = bool(self.shift.any()) == bool(amid(points).any())
        structure = program.structure if same else fresh.structure
        return replace(fresh, structure=structure, build_seconds=perf_counter() - began)
