"""Orientation motions through keyframes, least torque first of all, as programs on control quaternions."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from time import perf_counter
from typing import TYPE_CHECKING

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike

from symmotion import checks
from symmotion.brief import in_a_line, instants
from symmotion.constraints import EndAccelerations, EndRates, MotionConstraint, Setting
from symmotion.design.control_nodes import TURN, ControlSpace
from symmotion.design.control_start import carried, motion_of, unknowns_of
from symmotion.design.integrals import integrand
from symmotion.design.quadratures import nodes_at, term_quadratures
from symmotion.design.question import as_constraints, assembled, keyframe_notes, require_start, require_times
from symmotion.design.spans import LONG, graded_times, knots_between, spline_degree
from symmotion.design.terms import as_objective, closed_expression, expression_of, parts_of
from symmotion.energies import Energy, Torque
from symmotion.errors import InputError, SolveError
from symmotion.jets import RigidJet, rotation
from symmotion.jets.space import UNKNOWN, block_of
from symmotion.motions import Keyframes, PoseMotion
from symmotion.motions.crowding import require_apart
from symmotion.motions.quaternions import OrientationKeys, QuaternionMotion
from symmotion.motions.quaternions.algebra import Signs, conjugate, to_rotation
from symmotion.motions.quaternions.interpolation import DIRECT, ENDS, interpolate_keys
from symmotion.program import Block, Constraint, Multipliers, Program, Quadrature
from symmotion.program.state import made_of
from symmotion.renamed import renamed
from symmotion.splines import BSplineBasis, from_origin
from symmotion.splines.instants import distinct

if TYPE_CHECKING:
    from symmotion.motions.rotations import Rotations

TORQUE = Torque()
# Turns between neighbours, in rad, beyond which a program starts from slerps where an interval is long beside another.
FAR = np.radians(90)
# Gauss nodes on a span up to which it is one element, whose function the C compiler takes in its stride.
MOST_WHOLE = 8

RENAMED = {
    "inertia": "objective=Torque(inertia)",
    "torque_weight": "objective=weight * Torque(inertia) + …",
    "knots_per_interval": "refine, the knots inserted in every interval, one less",
    "end_accelerations": "constraints=[EndAccelerations(…)]",
    "limits": "constraints=[RateBound(…), AccelerationBound(…), TorqueBound(…)]",
    "tolerances": "constraints=[Tolerance(turn=…)]",
    "nodes": "objective=Torque(inertia, gauss_nodes=…)",
}


@renamed(**RENAMED)
def orientation_program(
    keys: ArrayLike | Keyframes,
    quaternions: "Rotations | None" = None,
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
) -> "Program[OrientationDesign]":
    """The orientation motion of least torque, or otherwise best, through keyframes: KKS 6.1 leave it open.

    Minimise `objective` over the control quaternions q_j of a B-spline quaternion curve and the increments ω_j between
    them, subject to |q_j|² = 1, q_{j−1} exp(ω_j) = q_j, 2 log(q_i⁻¹ q(t_i)) = 0 and the constraints. The multipliers
    of "keyframes" (M, 3) tell what turning one costs: the optimum changes by −λ_i · ε with q_i → q_i exp(ε/2).

    keys: rigid `Keyframes` in space, whose rotations are taken; or times (M,) increasing, beside
        quaternions: (M, 4), scalar first unless `scalar_first` says else, or a SciPy `Rotation`. As far apart as in
            `affine_program`.
    objective: an energy or weighted sum of energies of the jet (`RigidJet`), Torque() when left out.
    constraints: conditions on the jet, each with multipliers under its name.
    degree: at least 2. refine: knots inserted in every keyframe interval, equally spaced, beside the simple knots
        at the keyframe times; more where an interval is over four times as long as a neighbour, closer towards that
        one. Or `knots`, the inner knots in increasing order, instead.
    ends: "natural" (nothing: no torque there at the optimum), "clamped" with `end_rates` (2, 3), body
        rates in rad per unit of time, which are kept, or "periodic", the closed motion.
    turns, signs: extra turns and the reading of signs, as in `interpolate_quaternions`.
    norms: how far lengths of quaternions may be from 1; 1e-6 when left out.

    Starts from the interpolating curve, or from the slerps where that overshoots: where it is not found at once, or
    neighbours turn by more than 90° and an interval is four times as long as another. Raises InputError for what cannot
    be.

    >>> keys = sm.examples.random_keyframes(4, 60, seed=1)
    >>> program = sm.orientation_program(keys, objective=sm.Torque((1.0, 2.0, 2.5)))
    >>> sm.ExactNewton().solve(program).require().inertia
    'positive'
    """
    began = perf_counter()
    asked = as_constraints(constraints)
    energy = as_objective(objective, TORQUE)
    given = OrientationKeys.of(keys, quaternions, turns, signs, scalar_first=scalar_first, norms=norms)
    require_apart(given.times)
    design = OrientationDesign.of(given, energy, asked, degree, refine, knots, ends, end_rates)
    return replace(design.program(), build_seconds=perf_counter() - began)


@dataclass(frozen=True, eq=False)
class OrientationDesign:
    """The question of an orientation program: keyframes, objective, constraints, ends, and the curve to start from.

    keys, end_rates, nodes: as in the program; space: its controls. Raises InputError for too few keyframes or
    knots, and a start of another kind.

    >>> program = sm.orientation_program(sm.examples.random_keyframes(3, 40, seed=1))
    >>> program.design.ends
    'natural'
    """

    keys: OrientationKeys
    objective: Energy
    constraints: tuple[MotionConstraint, ...]
    ends: str
    end_rates: np.ndarray | None
    start: QuaternionMotion
    space: ControlSpace
    # By term, Gauss nodes per span where they are not those that the start needs.
    nodes: Mapping[str, int] = field(default_factory=dict)

    __repr__ = in_a_line

    @staticmethod
    def of(
        keys: OrientationKeys,
        objective: Energy,
        constraints: Sequence[MotionConstraint],
        degree: int,
        refine: int,
        knots: ArrayLike | None,
        ends: str,
        end_rates: ArrayLike | None,
        pose: bool = False,
    ) -> "OrientationDesign":
        """The checked question, with its start: the interpolating curve carried into the space."""
        checks.choice(ends, ENDS, "end condition")
        if ends == "periodic" and len(keys) < 4:
            raise InputError(f"{len(keys)} keyframes are too few for periodic ends: at least 4 are needed")
        basis = control_basis(keys.times, degree, refine, knots, ends)
        rates = None if end_rates is None else checks.array(end_rates, (2, 3), "end_rates")
        held = [] if rates is None else [EndRates(rates)]
        start, space = carried(first_curve(keys, ends, rates), basis, pose)
        design = OrientationDesign(keys, objective, (*held, *constraints), ends, rates, start, space)
        design.require_room()
        return design

    __getstate__ = made_of

    @property
    def notes(self) -> tuple[str, ...]:
        """What is said before solving: keyframes that crowd."""
        return keyframe_notes(self.keys.times)

    @cached_property
    def setting(self) -> Setting:
        """What constraints may know of this program: its keyframes as rotations and quaternions."""
        keys = self.keys
        linear = to_rotation(keys.quaternions).as_matrix()
        moves = self.space.pose
        return Setting((self.space,), keys.times, linear, None, keys.quaternions, moves=moves)

    def program(self) -> "Program[OrientationDesign]":
        """The program of this question."""
        controls = {UNKNOWN: unknowns_of(self.start)}
        given = self.given()
        terms, unit = self.terms(self.start), {UNKNOWN: TURN}
        return assembled(controls, terms, given, self.constraints, self.setting, self, directions=unit)

    def terms(self, start: QuaternionMotion | PoseMotion) -> tuple[Block, ...]:
        """The objective's terms, their nodes enough for the motion that the program starts from."""
        found = []
        for name, weight, energy in parts_of(self.objective):
            nodes = self.nodes.get(name) or energy.nodes(self.space.basis.degree)
            if name not in self.nodes and not energy.stated:
                nodes = integrand(start, energy).nodes(nodes)
            found.append(rigid_term(self.space, name, weight, energy, nodes))
        return tuple(found)

    @cached_property
    def held(self) -> np.ndarray:
        """(N,) the keyframes whose turn is a condition: not those with a tolerance, nor the last of a closed motion."""
        return self.not_freed(self.setting, 0)

    def not_freed(self, setting: Setting, part: int) -> np.ndarray:
        """(N,) the keyframes whose turn (part 0) or place (1) no constraint frees; of a closed motion not the last."""
        freed = set[int]().union(*(c.freed(setting)[part] for c in self.constraints))
        return np.array(sorted(set(range(len(self.keys) - (self.ends == "periodic"))) - freed), dtype=int)

    def given(self) -> list[Constraint]:
        """Unit norms and increments, and the keyframes' turns where they are kept."""
        which = self.held
        if not which.size:
            return self.space.given()
        inverse = conjugate(self.keys.quaternions[which])
        jet, other = self.space.jet(), rotation.symbols()
        missed = 2 * rotation.log(rotation.product(other, jet.quaternion))
        times = self.keys.times[which, None]
        block = block_of("keyframes", missed, [self.space], times, data=other, numbers=inverse)
        return [*self.space.given(), Constraint.equality(block)]

    def require_room(self) -> None:
        """InputError where there are more conditions than controls."""
        ends = sum(2 for c in self.constraints if isinstance(c, EndRates | EndAccelerations))
        conditions = len(self.keys) - (self.ends == "periodic") + ends
        if conditions > self.space.n:
            raise InputError(
                f"{conditions} conditions for {self.space.n} control quaternions: more knots per interval or a higher "
                "degree is needed"
            )

    def motion(self, unknowns: Mapping[str, np.ndarray]) -> QuaternionMotion:
        """The curve of the program's unknowns, its controls normalised."""
        return motion_of(self.space, unknowns[UNKNOWN])

    def unknowns(self, motion: QuaternionMotion) -> dict[str, np.ndarray]:
        """The unknowns closest to a curve: its own controls where the space is the same."""
        require_start(motion, QuaternionMotion, 3)
        basis = self.space.basis
        motion = motion.about(basis.origin)
        if motion.degree != basis.degree or not motion.basis.same_knots(basis):
            motion = carried(motion, basis)[0]
        return {UNKNOWN: unknowns_of(motion)}

    def multipliers(self, multipliers: Mapping[str, np.ndarray]) -> Multipliers:
        """Multipliers by constraint; those of "keyframes" (M, 3), zero where a keyframe has a tolerance."""
        shaped = np.zeros((len(self.keys), 3))
        if "keyframes" in multipliers:
            shaped[self.held] = multipliers["keyframes"]
        return {**multipliers, "keyframes": shaped}

    def quadratures(self, program: Program, x: np.ndarray) -> dict[str, Quadrature]:
        """By term, how well its nodes integrate at x (unknowns,)."""
        return term_quadratures(program, x, self.objective, self.motion(program.unpack(x)), self.keys.times)

    def refined(self, program: "Program[OrientationDesign]", x: np.ndarray) -> "Program[OrientationDesign] | None":
        """The program with the nodes that ten digits need at x (unknowns,); None where it has them, or can have."""
        nodes = nodes_at(program, x, self.objective, self.motion(program.unpack(x)))
        if not nodes:
            return None
        return replace(self, nodes={**self.nodes, **nodes}).program().with_parameters(**program.parameters)

    def with_keyframes(
        self, program: "Program[OrientationDesign]", keyframes: "Keyframes | tuple[ArrayLike, Rotations] | Rotations"
    ) -> "Program[OrientationDesign]":
        """The program for other orientations at the same times, each way between them on the branch it had.

        keyframes: rigid `Keyframes`, a tuple of times and quaternions, or the quaternions (M, 4) alone.
        """
        began = perf_counter()
        quaternions = keyframes
        if isinstance(keyframes, Keyframes):
            keyframes = keyframes.times, keyframes.rotations()
        if isinstance(keyframes, tuple) and len(keyframes) == 2:
            times, quaternions = keyframes
            require_times(times, self.keys.times)
        design = self.turned(quaternions)  # pyright: ignore[reportArgumentType] what is none is refused there
        fresh = design.program()
        return replace(fresh, structure=program.structure, build_seconds=perf_counter() - began)

    def turned(self, quaternions: "Rotations") -> "OrientationDesign":
        """The question for other quaternions."""
        keys = self.keys.turned(quaternions)
        first = first_curve(keys, self.ends, self.end_rates)
        start, space = carried(first, self.space.basis, self.space.pose)
        return replace(self, keys=keys, start=start, space=space)


def first_curve(keys: OrientationKeys, ends: str, end_rates: np.ndarray | None) -> QuaternionMotion:
    """The curve through keyframes that a program starts from: the C² interpolant, or the slerps.

    The slerps where it is not found at once, and where neighbours are FAR apart and an interval is LONG beside another:
    there it turns further than anything of little torque does.
    """
    steps, turns = np.diff(keys.times), 2 * np.linalg.norm(keys.ways, axis=1)
    if steps.max() <= LONG * steps.min() or turns.max() <= FAR:
        try:
            return interpolate_keys(keys, ends, end_rates, max_iterations=DIRECT)
        except SolveError:
            pass
    if ends == "periodic":
        keys.require_closed()
    basis = (BSplineBasis.closed if ends == "periodic" else BSplineBasis.clamped)(keys.times, 1)
    return QuaternionMotion(basis, keys.quaternions[: basis.n], keys.ways)


def control_basis(times: np.ndarray, degree: int, refine: int, knots: ArrayLike | None, ends: str) -> BSplineBasis:
    """The basis of a quaternion curve over keyframe times (M,): knots there, and those of `graded_times` between."""
    degree, refine = spline_degree(degree, 2), knots_between(refine)
    origin, since = from_origin(times)
    breaks = graded_times(since, refine, ends == "periodic")
    if knots is not None:
        inner = distinct(checks.times(knots, "knots"), times)
        if inner[0] <= times[0] or inner[-1] >= times[-1]:
            raise InputError(f"knots: all lie inside the domain ({', '.join(instants(*times[[0, -1]]))})")
        breaks = np.concatenate([since[:1], inner - origin, since[-1:]])
    return replace((BSplineBasis.closed if ends == "periodic" else BSplineBasis.clamped)(breaks, degree), origin=origin)


def rigid_term(space: ControlSpace, name: str, weight: float, energy: Energy, nodes: int) -> Block:
    """An energy as a term over a quaternion curve or a pose, by Gauss nodes on every span."""
    _, squares = closed_expression(energy, weight, space.symbols())

    def expression(jet: RigidJet) -> ca.SX:
        return expression_of(energy, weight, jet)[0]

    whole = isinstance(energy, Torque) and energy.stated and nodes <= MOST_WHOLE
    return space.integral(name, expression, squares, nodes, weight, whole=whole)
