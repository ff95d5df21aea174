"""Affine motions through keyframes, as programs."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from time import perf_counter

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike

from symmotion import checks
from symmotion.brief import in_a_line
from symmotion.constraints import EndRates, MotionConstraint, Periodic, Setting
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
    require_times,
    require_volume,
)
from symmotion.design.rigid_start import other_way, rigid_spline, turns_between
from symmotion.design.spans import knots_between, refined_times, spline_degree
from symmotion.design.terms import as_objective, kernel_of, parts_of, terms_of
from symmotion.energies import Energy, Rigidity
from symmotion.errors import InputError
from symmotion.jets.linear import LinearSpace, affine_space
from symmotion.jets.space import UNKNOWN
from symmotion.kernels import Kernel
from symmotion.motions import Affine, AffineMotion, Keyframes
from symmotion.program import Block, Constraint, Multipliers, Program, Quadrature, Targets
from symmotion.program.state import made_of
from symmotion.renamed import renamed
from symmotion.splines import BSplineBasis, Spline, amid, closest, cubic_interpolant, from_origin, unified
from symmotion.splines.interpolation import ENDS, require_schoenberg_whitney

RIGIDITY = Rigidity()


@renamed(keyframes="keys")
def affine_program(
    keys: Keyframes,
    *,
    objective: Energy | None = None,
    constraints: Sequence[MotionConstraint] = (),
    degree: int = 3,
    refine: int = 1,
    knots: ArrayLike | None = None,
    ends: str = "natural",
    end_rates: Affine | None = None,
) -> "Program[AffineDesign]":
    """The least distorted (or otherwise best) affine spline motion through keyframes, as a program.

    Minimise `objective` over the control matrices A_j, and the control points v_j where the
    objective sees them, subject to A(t_i) = A*_i, v(t_i) = v*_i with one multiplier per scalar
    condition (HJK 4) and to the constraints. Where the objective does not see the translation, that
    keeps its interpolating spline.

    keys: `Keyframes`, a millionth of the median step apart or more; `program.notes` names those closer than a
    thousandth, and those of opposite orientations.
    objective: an energy or weighted sum of energies, Rigidity() when left out.
    constraints: conditions on the jet (`Jet`), each with multipliers under its name.
    degree: at least 1. refine: knots inserted in every segment, equally spaced, beside the
    simple knots at the keyframe times; or `knots`, the inner knots in increasing order, instead.
    ends: what holds at the ends, and shapes the C² cubic interpolant that is the start: "natural" and
    "not-a-knot" (nothing), "clamped" with `end_rates` (linear (2, d, d), translation (2, d)), which are
    kept, or "periodic", the closed motion.

    Raises InputError for what cannot be: more conditions in a span than controls, an end
    condition that needs more keyframes, an objective of another dimension, conditions that
    repeat or contradict each other.

    >>> program = sm.affine_program(sm.examples.planar_keyframes(), objective=sm.Rigidity(2))
    >>> program.unknowns, program.conditions
    (36, 16)
    >>> round(sm.ExactNewton().solve(program).require().objective, 3)
    891.215
    """
    began = perf_counter()
    keys = apart_keyframes(keys)
    energy, asked = as_objective(objective, RIGIDITY), as_constraints(constraints)
    degree, refine = spline_degree(degree), knots_between(refine)
    origin, since = from_origin(keys.times)
    inner = refined_times(since, refine)[1:-1] if knots is None else placed_knots(knots, keys.times) - origin
    basis = _clamped(since[0], inner, since[-1], degree, origin)
    rates = rates_at_ends(ends, end_rates, keys.dimension, ENDS)
    slopes = None if rates is None else np.concatenate([rates.linear.reshape(2, -1), rates.translation], axis=1)
    start = represent(basis, cubic_interpolant(keys.times, keys.coordinates, ends, slopes), keys.times)
    at_ends = {"clamped": (EndRates(rates),), "periodic": (Periodic(),)}.get(ends, ())
    program = AffineDesign(keys, energy, start, (*at_ends, *asked)).program()
    return replace(program, build_seconds=perf_counter() - began)


def placed_knots(knots: ArrayLike, times: np.ndarray) -> np.ndarray:
    """(K,) inner knots, those that are a keyframe's time up to rounding put there."""
    return unified(checks.array(knots, ("K",), "knots"), times)


# Keyframes up to which what an edit does to the start is kept, by control and keyframe.
MOST_CARRIED = 500


def _clamped(a: float, inner: np.ndarray, b: float, degree: int, origin: float) -> BSplineBasis:
    """The clamped basis over [a, b] with these inner knots, copies counting, all from an origin on."""
    knots = np.concatenate([np.full(degree + 1, a), inner, np.full(degree + 1, b)])
    return BSplineBasis(knots, degree, origin=origin)


def represent(basis: BSplineBasis, spline: Spline, times: np.ndarray) -> Spline:
    """`spline` over `basis`: exactly where knot insertion leads there, else its closest interpolant at `times`."""
    require_schoenberg_whitney(basis, times)
    spline = spline.clamped().about(basis.origin)
    placed = unified(spline.basis.knots, basis.knots, basis.origin)
    if not np.array_equal(placed, spline.basis.knots):
        spline = Spline(replace(spline.basis, knots=placed), spline.control_points)
    if basis.degree == spline.degree and np.isin(spline.basis.knots, basis.knots).all():
        old, old_copies = np.unique(spline.basis.knots, return_counts=True)
        new, new_copies = np.unique(basis.knots, return_counts=True)
        extra = new_copies.copy()
        extra[np.searchsorted(new, old)] -= old_copies
        if (extra >= 0).all():
            refined = spline.relative.refined(np.repeat(new, extra))
            return Spline(basis, refined.control_points)
    return closest(basis, spline, times)


@dataclass(frozen=True, eq=False)
class AffineDesign:
    """The question of an affine program: keyframes, objective, and the spline space with its start.

    start: controls (n, d² + d), translation included whether the objective sees it or not.

    constraints: conditions, as handed over; nodes: by term, more Gauss nodes than it asks for. Raises InputError
    for a start and stages of another kind.

    >>> program = sm.affine_program(sm.examples.planar_keyframes())
    >>> program.design.motion(program.unpack(program.x0))
    AffineMotion(2D, degree 3, 9 controls, times 0 to 1)
    """

    keyframes: Keyframes
    objective: Energy
    start: Spline
    constraints: tuple[MotionConstraint, ...] = ()
    # By term, Gauss nodes per span where they are not those that the start needs.
    nodes: Mapping[str, int] = field(default_factory=dict)

    __repr__ = in_a_line

    __getstate__ = made_of

    @cached_property
    def origin(self) -> np.ndarray:
        """(d² + d,) what the program subtracts from every control: a point amid keyframes that are far from zero."""
        return np.concatenate([np.zeros(self.keyframes.dimension**2), amid(self.keyframes.translation)])

    @property
    def notes(self) -> tuple[str, ...]:
        """What is said before solving: keyframes that crowd, orientations (signs of det A) that are opposite."""
        return keyframe_notes(self.keyframes.times, self.keyframes.linear)

    def told(self, motion: AffineMotion) -> tuple[str, ...]:
        """What is said of a motion found: that it squeezes the body between rigid keyframes, where it does."""
        return motion_notes(self.keyframes, motion)

    @property
    def basis(self) -> BSplineBasis:
        """The B-spline basis of the unknown motion, over the times of the keyframes."""
        return self.start.basis

    @cached_property
    def channels(self) -> int:
        """Coordinates per control in the program: d², or d² + d where the objective sees the translation."""
        d = self.keyframes.dimension
        whole = affine_space(self.basis, d, d * d + d)
        return max(kernel_of(e, w, whole).channels for _, w, e in parts_of(self.objective))

    @cached_property
    def space(self) -> LinearSpace:
        """The linear map from controls (n, channels) to the jet of the motion at a time."""
        return affine_space(self.basis, self.keyframes.dimension, self.channels, self.origin)

    @property
    def setting(self) -> Setting:
        """What constraints may know of this program: its keyframes, and whether the translation is unknown."""
        keys, d = self.keyframes, self.keyframes.dimension
        return Setting((self.space,), keys.times, keys.linear, keys.translation, moves=self.channels > d * d)

    def program(self) -> "Program[AffineDesign]":
        """The program of this question."""
        require_volume(self.objective, self.keyframes)
        start = {UNKNOWN: self._unknowns(self.start)}
        terms = terms_of(self.objective, self.space, start[UNKNOWN], self.nodes)
        given = [self._interpolation(*group) for group in self._given]
        lengths = {UNKNOWN: slice(self.keyframes.dimension**2, None)}
        shifts = {UNKNOWN: self.origin[: self.channels]}
        return assembled(start, terms, given, self.constraints, self.setting, self, lengths, shifts)

    @cached_property
    def _given(self) -> Groups:
        return keyframe_groups(self.constraints, self.setting, self.channels, self.keyframes.dimension)

    def _interpolation(self, name: str, which: np.ndarray, part: slice) -> Constraint:
        size = part.stop - part.start
        z, target = ca.SX.sym("z", size), ca.SX.sym("target", size)
        operator = self.basis.matrix(self.keyframes.times[which])
        operator.eliminate_zeros()
        kernel = Kernel(z, target, z - target, size)
        data = self._targets[which, part]
        return Constraint.equality(Block(name, kernel, UNKNOWN, part, operator, 1, np.ones(len(which)), data))

    @property
    def _targets(self) -> np.ndarray:
        return self.keyframes.coordinates - self.origin

    def _unknowns(self, spline: Spline) -> np.ndarray:
        """(n, channels) the program's controls of a spline of its space."""
        return np.ascontiguousarray((spline.control_points - self.origin)[:, : self.channels])

    def motion(self, unknowns: Mapping[str, np.ndarray]) -> AffineMotion:
        """The motion of the program's unknowns."""
        controls = self.start.control_points.copy()
        controls[:, : self.channels] = unknowns[UNKNOWN] + self.origin[: self.channels]
        return AffineMotion.from_spline(Spline(self.basis, controls), self.keyframes.dimension)

    def unknowns(self, motion: AffineMotion) -> dict[str, np.ndarray]:
        """The unknowns that represent a motion, exactly where the space holds it."""
        require_start(motion, AffineMotion, self.keyframes.dimension)
        return {UNKNOWN: self._unknowns(represent(self.basis, motion.spline, self.keyframes.times))}

    @cached_property
    def turns(self) -> np.ndarray:
        """(M − 1,) the angles in rad between the keyframes' polar factors; none where some reflect others."""
        return turns_between(self.keyframes)

    def rigid(self, whole: np.ndarray | None = None) -> dict[str, np.ndarray]:
        """The unknowns of a motion that turns rigidly, see `rigid_spline`; whole: (M − 1,) turns added."""
        spline = rigid_spline(self.keyframes, whole)
        return {UNKNOWN: self._unknowns(represent(self.basis, spline, self.keyframes.times))}

    def turned(self, unknowns: Mapping[str, np.ndarray], segment: int) -> dict[str, np.ndarray]:
        """The unknowns of a motion that turns rigidly the other way round along a segment, elsewhere as these."""
        found, d = unknowns[UNKNOWN].copy(), self.keyframes.dimension
        begin, end = self.keyframes.times[segment : segment + 2] - self.basis.origin
        share = (self.basis.relative.greville - begin) / (end - begin)
        inside = np.flatnonzero((share > 0) & (share < 1))
        linear = other_way(self.keyframes.linear[segment : segment + 2], share[inside]).reshape(-1, d * d)
        # As much of it as the two ways are apart.
        weight = np.minimum(1.0, 2 * np.sin(np.pi * share[inside]))[:, None]
        found[inside, : d * d] += weight * (linear - found[inside, : d * d])
        return {UNKNOWN: found}

    def multipliers(self, multipliers: Mapping[str, np.ndarray]) -> Multipliers:
        """Multipliers by constraint, the keyframes' in the keyframes' shape.

        ∂f*/∂A*_i = −linear[i] and ∂f*/∂v*_i = −translation[i], which is zero where the
        objective does not see the translation.
        """
        return by_keyframe(multipliers, self._given, self.keyframes)

    def targets(self, program: Program) -> dict[str, Targets]:
        """Where the keyframes are in the program's data."""
        return keyframe_targets(program, self._given, self.constraints, self.setting)

    def quadratures(self, program: Program, x: np.ndarray) -> dict[str, Quadrature]:
        """By term, how well its nodes integrate at x (unknowns,)."""
        return term_quadratures(program, x, self.objective, self.motion(program.unpack(x)), self.keyframes.times)

    def refined(self, program: "Program[AffineDesign]", x: np.ndarray) -> "Program[AffineDesign] | None":
        """The program with the nodes that ten digits need at x (unknowns,); None where it has them, or can have."""
        nodes = nodes_at(program, x, self.objective, self.motion(program.unpack(x)))
        if not nodes:
            return None
        return replace(self, nodes={**self.nodes, **nodes}).program().with_parameters(**program.parameters)

    def quadrature_errors(self, motion: AffineMotion, program: Program) -> dict[str, float]:
        """By term, by how much its nodes miss the integral along a motion of the program; `quadratures` says more."""
        found = self.quadratures(program, program.pack(self.unknowns(motion)))
        return {name: q.error for name, q in found.items()}

    def with_keyframes(self, program: "Program[AffineDesign]", keyframes: Keyframes) -> "Program[AffineDesign]":
        """The program for other keyframes; structure and kernels are kept where the times are the same."""
        keyframes = other_keyframes(keyframes, self.keyframes)
        require_times(keyframes.times, self.keyframes.times)
        # The old start plus the spline through the changes: smooth, and exact at the new keyframes.
        began = perf_counter()
        change = keyframes.coordinates - self.keyframes.coordinates
        start = Spline(self.basis, self.start.control_points + self._shift(program, change))
        design = replace(self, keyframes=keyframes, start=start)
        controls = {UNKNOWN: design._unknowns(start)}
        if self.constraints:
            # Conditions may hold data of the keyframes, so they are made anew; the kernels are cached.
            return replace(design.program().sharing(program), build_seconds=perf_counter() - began)
        moved = program.with_data("keyframes", design._targets[:, : self.channels])
        return replace(moved, start=controls, design=design, build_seconds=perf_counter() - began)

    def _shift(self, program: Program, change: np.ndarray) -> np.ndarray:
        """(n, d² + d) the controls of the spline through changes (M, d² + d) of the keyframes."""
        times = self.keyframes.times
        if len(times) > MOST_CARRIED:
            return represent(self.basis, cubic_interpolant(times, change), times).control_points
        if "carried" not in program.structure:
            through = cubic_interpolant(times, np.eye(len(times)))
            program.structure["carried"] = represent(self.basis, through, times).control_points
        moved = np.flatnonzero(change.any(axis=1))
        return program.structure["carried"][:, moved] @ change[moved]

    def stages(self, by: str) -> "Iterator[Program[AffineDesign]]":
        """Smaller programs that lead to this one by steps, coarsest first (HJK 4.4, 5.1).

        by: "degree", from 1 up to the full one, with the same knots; or "knots", the inserted knots in
        three steps: every fourth, every second, all.
        """
        basis, origin = self.basis, self.basis.origin
        times = self.keyframes.times - origin
        if by == "degree":
            breaks = basis.relative.breakpoints
            for degree in range(1, basis.degree):
                yield self._restricted(_clamped(breaks[0], breaks[1:-1], breaks[-1], degree, origin))
        elif by == "knots":
            inner = basis.knots[basis.degree + 1 : -basis.degree - 1]
            inserted = inner[~np.isin(inner, times)]
            for stride in (4, 2):
                kept = np.sort(np.concatenate([inner[np.isin(inner, times)], inserted[stride - 1 :: stride]]))
                if len(kept) < len(inner):
                    yield self._restricted(_clamped(times[0], kept, times[-1], basis.degree, origin))
        else:
            raise InputError(f"stages by {by!r} are unknown; there are degree, knots")

    def _restricted(self, basis: BSplineBasis) -> "Program[AffineDesign]":
        return replace(self, start=represent(basis, self.start, self.keyframes.times)).program()
