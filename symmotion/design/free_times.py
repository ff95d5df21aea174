"""Keyframe times as unknowns: the best motion through keyframes over their inner times too, as programs."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from time import perf_counter

import casadi as ca
import numpy as np
from scipy import sparse

from symmotion import checks
from symmotion.brief import in_a_line
from symmotion.constraints import EndRates, MotionConstraint, Setting
from symmotion.design.affine import RIGIDITY, represent
from symmotion.design.moving_space import MovingSpace, local_derivative, local_symbols
from symmotion.design.quadratures import nodes_at, term_quadratures
from symmotion.design.question import (
    Groups,
    apart_keyframes,
    as_constraints,
    assembled,
    by_keyframe,
    keyframe_groups,
    keyframe_notes,
    keyframe_targets,
    motion_notes,
    other_keyframes,
    rates_at_ends,
    require_start,
    require_volume,
)
from symmotion.design.spans import knots_between, refined_times, spline_degree
from symmotion.design.terms import as_objective, closed_expression, expression_of, kernel_of, nodes_for, parts_of
from symmotion.energies import Energy
from symmotion.errors import InputError
from symmotion.jets import Jet
from symmotion.jets.linear import affine_space
from symmotion.jets.space import UNKNOWN
from symmotion.kernels import Kernel
from symmotion.motions import Affine, AffineMotion, Keyframes
from symmotion.motions.crowding import require_apart
from symmotion.program import Block, Constraint, Multipliers, Program, Quadrature, Targets
from symmotion.program.state import made_of
from symmotion.renamed import renamed
from symmotion.splines import BSplineBasis, Spline, amid, cubic_interpolant, from_origin, same_times
from symmotion.splines.instants import rounding

LEAST_SHARE = 0.02


@renamed(keyframes="keys")
def free_times_program(
    keys: Keyframes,
    *,
    objective: Energy | None = None,
    constraints: Sequence[MotionConstraint] = (),
    degree: int = 3,
    refine: int = 1,
    knots: None = None,
    ends: str = "natural",
    end_rates: Affine | None = None,
    least_step: float | None = None,
) -> "Program[FreeTimesDesign]":
    """The best affine spline motion through keyframes whose inner times are unknowns too, as a program.

    Minimise `objective` over the controls and over t_2 < … < t_{M−1}, subject to A(t_i) = A*_i,
    v(t_i) = v*_i, t_{i+1} − t_i ≥ `least_step` and the constraints. The first and the last time stay: R falls as
    1/T and R*, E as 1/T³ with the total time T, so that without it there is no minimum. The knots
    move with the times: simple ones at the keyframes, `refine` more at equal steps in every segment.

    keys: `Keyframes`, M ≥ 3, their times are the start, as far apart as in `affine_program`.
    objective: Rigidity() when left out. constraints: conditions on the jet (`Jet`); a time in one is a place between
    keyframes, told by the times of the start, and moves with them.
    ends: what holds at the ends: "natural" (nothing) or "clamped" with `end_rates`. knots: none can be given, for they
    move. least_step: in the unit of time, a fiftieth of the mean step when left out.

    The order is an inequality and the keyframes are nonlinear conditions. The unknown "controls" (n, C + 1) holds each
    control and, in the last coordinate, the width of the knot interval [τ_{j+p}, τ_{j+p+1}] in units of the mean.

    Multipliers: "keyframes" as in `affine_program`; "total time", ∂f*/∂T = −λ, which is k f/T for
    an objective that falls as 1/Tᵏ where no step is at its least; "order" (M − 1,), one per step.
    `design.times(x)` and `design.keyframes_at(x)` read the times.

    degree: at least 1. Raises InputError for what cannot be, as `affine_program`, and for fewer than three
    keyframes.

    >>> keys = sm.examples.planar_keyframes()
    >>> fixed = sm.ExactNewton().solve(sm.affine_program(keys)).require()
    >>> free = sm.ExactNewton().solve(sm.free_times_program(keys)).require()
    >>> free.objective < fixed.objective
    True
    """
    began = perf_counter()
    keyframes, asked = apart_keyframes(keys), as_constraints(constraints)
    energy = as_objective(objective, RIGIDITY)
    degree, refine = spline_degree(degree), knots_between(refine)
    if knots is not None:
        raise InputError("knots: they move with the keyframes' times; refine says how many there are")
    rates = rates_at_ends(ends, end_rates, keyframes.dimension, ("natural", "clamped"))
    m, times = len(keyframes), keyframes.times
    if m < 3:
        raise InputError(f"{m} keyframes have no inner time: at least 3 are needed")
    mean = (times[-1] - times[0]) / (m - 1)
    least = LEAST_SHARE * mean if least_step is None else checks.positive(least_step, "least_step")
    slack = rounding(times)
    if not 0 < least < mean - slack:
        raise InputError(f"least_step {least:g}: between 0 and the mean step, {mean:g}, is needed, both excluded")
    short = np.diff(times) <= least + slack
    if short.any():
        i = int(np.argmax(short))
        raise InputError(
            f"keyframes {i} and {i + 1} start {times[i + 1] - times[i]:g} apart, which is not more than least_step "
            f"{least:g}: lower it or start from other times"
        )
    held = () if rates is None else (EndRates(rates),)
    design = FreeTimesDesign(keyframes, energy, degree, refine, least, (*held, *asked))
    return replace(design.program(), build_seconds=perf_counter() - began)


@dataclass(frozen=True, eq=False)
class FreeTimesDesign:
    """The question of a program with free times: keyframes (whose times are the start), objective, spline space.

    degree, refine, least_step, constraints, nodes: as in the program. Raises InputError for other numbers of
    keyframes, or another first or last time.

    >>> program = sm.free_times_program(sm.examples.planar_keyframes())
    >>> program.design.times(program.x0).round(3)
    array([0.   , 0.335, 0.666, 1.   ])
    """

    keyframes: Keyframes
    objective: Energy
    degree: int
    refine: int
    least_step: float
    constraints: tuple[MotionConstraint, ...] = ()
    # By term, Gauss nodes per span where they are not those that the start needs.
    nodes: Mapping[str, int] = field(default_factory=dict)

    __repr__ = in_a_line

    __getstate__ = made_of

    @cached_property
    def channels(self) -> int:
        """Coordinates per control, beside the knot width: d², or d² + d where the objective sees the translation."""
        d = self.keyframes.dimension
        whole = affine_space(BSplineBasis.clamped(self.keyframes.times, self.degree), d, d * d + d)
        return max(kernel_of(e, w, whole).channels for _, w, e in parts_of(self.objective))

    @cached_property
    def space(self) -> MovingSpace:
        """The map from controls (n, channels) and knot widths to the jet of the motion at a node."""
        origin, since = from_origin(self.keyframes.times)
        ends = refined_times(since, self.refine)
        return MovingSpace(self.degree, self.channels, self.keyframes.dimension, ends, self.unit, origin, self.shift)

    @cached_property
    def shift(self) -> np.ndarray | None:
        """(channels,) what the program subtracts from every control: a point amid keyframes far from zero, or None."""
        whole = np.concatenate([np.zeros(self.keyframes.dimension**2), amid(self.keyframes.translation)])
        return whole[: self.channels] if whole[: self.channels].any() else None

    @property
    def _shift(self) -> np.ndarray:
        return np.zeros(self.channels) if self.shift is None else self.shift

    @property
    def notes(self) -> tuple[str, ...]:
        """What is said before solving: keyframes that crowd, orientations (signs of det A) that are opposite."""
        return keyframe_notes(self.keyframes.times, self.keyframes.linear)

    def told(self, motion: AffineMotion) -> tuple[str, ...]:
        """What is said of a motion found: that it squeezes the body between rigid keyframes, where it does."""
        keys, times = self.keyframes, motion.breakpoints[:: self.refine + 1]
        return motion_notes(Keyframes(times, keys.linear, keys.translation), motion)

    @property
    def setting(self) -> Setting:
        """What constraints may know of this program: its keyframes, at the times given."""
        keys, d = self.keyframes, self.keyframes.dimension
        return Setting((self.space,), keys.times, keys.linear, keys.translation, moves=self.channels > d * d)

    @property
    def spans(self) -> int:
        """How many spans the motion has: `refine` + 1 between each two keyframes."""
        return (len(self.keyframes) - 1) * (self.refine + 1)

    @property
    def n(self) -> int:
        """Controls."""
        return self.spans + self.degree

    @property
    def unit(self) -> float:
        """The mean width of a span, the unit of the unknown widths."""
        return float(self.keyframes.times[-1] - self.keyframes.times[0]) / self.spans

    def program(self) -> "Program[FreeTimesDesign]":
        """The program of this question."""
        require_volume(self.objective, self.keyframes)
        motion = self._interpolant(from_origin(self.keyframes.times)[1])
        d = self.keyframes.dimension
        still = affine_space(motion.basis, d, d * d + d)
        terms = []
        for name, weight, energy in parts_of(self.objective):
            known = self.nodes.get(name)
            nodes = known or nodes_for(energy, weight, still, motion.spline.control_points)
            _, squares = closed_expression(energy, weight, self.space.symbols())

            def expression(jet: Jet, e: Energy = energy, w: float = weight) -> ca.SX:
                return expression_of(e, w, jet)[0]

            terms.append(self.space.integral(name, expression, squares, nodes, weight))
        given = [*self._interpolation(), *self._steps()]
        lengths = {UNKNOWN: slice(self.keyframes.dimension**2, self.channels)}
        shifts = {UNKNOWN: np.append(self._shift, 0.0)}
        return assembled(self.unknowns(motion), terms, given, self.constraints, self.setting, self, lengths, shifts)

    @cached_property
    def _given(self) -> Groups:
        return keyframe_groups(self.constraints, self.setting, self.channels, self.keyframes.dimension)

    def _interpolation(self) -> list[Constraint]:
        """A keyframe is the begin of its span, the last one the end of the last span."""
        p, c, m = self.degree, self.channels, len(self.keyframes)
        found = []
        for name, which, part in self._given:
            z, share, target = local_symbols(p, c), ca.SX.sym("share"), ca.SX.sym("target", part.stop - part.start)
            out = local_derivative(z, p, 0, share)[part] - target
            kernel = Kernel(ca.vec(z.T), ca.vertcat(share, target), out, c + 1)
            span = np.minimum(which * (self.refine + 1), self.spans - 1)
            data = np.column_stack([which == m - 1, self._targets[which, part]]).astype(float)
            operator, every = self.space.selection(span), slice(0, c + 1)
            block = Block(name, kernel, UNKNOWN, every, operator, 1, np.ones(len(which)), data)
            found.append(Constraint.equality(block))
        return found

    @property
    def _targets(self) -> np.ndarray:
        targets = self.keyframes.coordinates.copy()
        targets[:, : self.channels] -= self._shift
        return targets

    def _steps(self) -> list[Constraint]:
        """The linear conditions on the widths: equal in a segment, none beyond the end, the total, the order."""
        s, r, m = self.spans, self.refine + 1, len(self.keyframes)
        first = np.repeat(np.arange(0, s, r), r - 1)
        later = np.setdiff1d(np.arange(s), np.arange(0, s, r))
        beyond = np.arange(s, self.n)
        units = sparse.eye_array(self.n, format="csr")
        tied = sparse.csr_array(sparse.vstack([units[later] - units[first], units[beyond]]))
        segments = sparse.csr_array((np.ones(s), (np.repeat(np.arange(m - 1), r), np.arange(s))), shape=(m - 1, self.n))
        total = sparse.csr_array(segments.sum(axis=0)[None, :])
        order = self._on_widths("order", segments, np.zeros(m - 1))
        least = np.full((m - 1, 1), self.least_step / self.unit)
        return [
            Constraint.equality(self._on_widths("knots", tied, np.zeros(tied.shape[0]))),
            Constraint.equality(self._on_widths("total time", total, np.array([float(s)]))),
            Constraint(order, least, np.full((m - 1, 1), np.inf)),
        ]

    def _on_widths(self, name: str, operator: sparse.csr_array, target: np.ndarray) -> Block:
        z, data = ca.SX.sym("z"), ca.SX.sym("target")
        channel = slice(self.channels, self.channels + 1)
        return Block(
            name, Kernel(z, data, z - data, 1), UNKNOWN, channel, operator, 1, np.ones(len(target)), target[:, None]
        )

    def times(self, x: np.ndarray) -> np.ndarray:
        """(M,) the keyframe times at unknowns x."""
        return self.space.origin + self._since(x)

    def _since(self, x: np.ndarray) -> np.ndarray:
        """(M,) the keyframe times at unknowns x, from the origin on."""
        return self._knots(np.reshape(x, (self.n, -1))[: self.spans, -1])[:: self.refine + 1]

    def keyframes_at(self, x: np.ndarray) -> Keyframes:
        """The keyframes with their times at unknowns x, for any program with fixed times."""
        return Keyframes(self.times(x), self.keyframes.linear, self.keyframes.translation)

    def _knots(self, widths: np.ndarray) -> np.ndarray:
        """(spans + 1,) the different knots, from the origin on; the ends exactly those given."""
        a, b = from_origin(self.keyframes.times)[1][[0, -1]]
        return np.concatenate([[a], a + self.unit * np.cumsum(widths)[:-1], [b]])

    def _basis(self, breaks: np.ndarray) -> BSplineBasis:
        """The basis over breakpoints that count from the origin on."""
        return replace(BSplineBasis.clamped(breaks, self.degree), origin=self.space.origin)

    def _interpolant(self, since: np.ndarray) -> AffineMotion:
        """The natural cubic through the keyframes at times from the origin on, in the space that belongs to them."""
        basis = self._basis(refined_times(since, self.refine))
        spline = cubic_interpolant(since, self.keyframes.coordinates)
        controls = represent(basis.relative, spline, since).control_points
        return AffineMotion.from_spline(Spline(basis, controls), self.keyframes.dimension)

    def motion(self, unknowns: Mapping[str, np.ndarray]) -> AffineMotion:
        """The motion of the program's unknowns, over its knots; a translation not seen is the natural spline."""
        values = unknowns[UNKNOWN]
        controls = self._interpolant(self._since(values)).spline.control_points.copy()
        controls[:, : self.channels] = values[:, :-1] + self._shift
        basis = self._basis(self._knots(values[: self.spans, -1]))
        return AffineMotion.from_spline(Spline(basis, controls), self.keyframes.dimension)

    def unknowns(self, motion: AffineMotion) -> dict[str, np.ndarray]:
        """The unknowns that represent a motion: exactly where its space is one of these, else at the start's times."""
        require_start(motion, AffineMotion, self.keyframes.dimension)
        ends = same_times(motion.domain, self.keyframes.times[[0, -1]])
        if not (ends and motion.degree == self.degree and len(motion.basis.breakpoints) == self.spans + 1):
            basis = self._basis(self.space.ends)
            spline = represent(basis, motion.spline, self.keyframes.times)
            motion = AffineMotion.from_spline(spline, motion.dimension)
        widths = np.append(np.diff(motion.basis.relative.breakpoints) / self.unit, np.zeros(self.degree))
        return {UNKNOWN: np.column_stack([motion.spline.control_points[:, : self.channels] - self._shift, widths])}

    def multipliers(self, multipliers: Mapping[str, np.ndarray]) -> Multipliers:
        """Multipliers by constraint: the keyframes' in their shape, those of times per unit of time."""
        return {
            **by_keyframe(multipliers, self._given, self.keyframes),
            "total time": float(multipliers["total time"][0, 0]) / self.unit,
            "order": multipliers["order"][:, 0] / self.unit,
            "knots": multipliers["knots"][:, 0] / self.unit,
        }

    def targets(self, program: Program) -> dict[str, Targets]:
        """Where the keyframes are in the program's data."""
        return keyframe_targets(program, self._given, self.constraints, self.setting)

    def quadratures(self, program: Program, x: np.ndarray) -> dict[str, Quadrature]:
        """By term, how well its nodes integrate at x (unknowns,)."""
        return term_quadratures(program, x, self.objective, self.motion(program.unpack(x)), self.times(x))

    def refined(self, program: "Program[FreeTimesDesign]", x: np.ndarray) -> "Program[FreeTimesDesign] | None":
        """The program with the nodes that ten digits need at x (unknowns,); None where it has them, or can have."""
        nodes = nodes_at(program, x, self.objective, self.motion(program.unpack(x)))
        if not nodes:
            return None
        return replace(self, nodes={**self.nodes, **nodes}).program().with_parameters(**program.parameters)

    def with_keyframes(self, program: "Program[FreeTimesDesign]", keyframes: Keyframes) -> "Program[FreeTimesDesign]":
        """The program for other keyframes over the same time, started from theirs; compiled kernels are kept."""
        keyframes = other_keyframes(keyframes, self.keyframes)
        if len(keyframes) != len(self.keyframes):
            raise InputError(f"{keyframes!r} for a program of {self.keyframes!r}")
        if not same_times(keyframes.times[[0, -1]], self.keyframes.times[[0, -1]]):
            raise InputError("with_keyframes keeps the first and the last time; make a new program for others")
        require_apart(keyframes.times)
        return replace(self, keyframes=keyframes).program()
