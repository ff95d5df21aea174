"""Affine motions through keyframes, as programs."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from time import perf_counter
from typing import Any

import casadi as ca
import numpy as np
from scipy import sparse

from symmotion.energies import HIGHEST_ORDER, Energy, Jet, Rigidity
from symmotion.errors import InputError
from symmotion.motions import Affine, AffineMotion, Keyframes
from symmotion.program import Block, BlockEvaluator, Constraint, Kernel, Program
from symmotion.splines import BSplineBasis, Spline, closest, cubic_interpolant, gauss
from symmotion.splines.interpolation import require_schoenberg_whitney

UNKNOWN = "controls"
RIGIDITY = Rigidity()


def affine_program(
    keyframes: Keyframes,
    *,
    degree: int = 3,
    refine: int = 1,
    objective: Energy = RIGIDITY,
    constraints: Sequence[Any] = (),
    ends: str = "natural",
    end_rates: Affine | None = None,
    knots=None,
) -> Program:
    """The least distorted (or otherwise best) affine spline motion through keyframes, as a program.

    Minimise `objective` over the control matrices A_j, and the control points v_j where the
    objective sees them, subject to A(t_i) = A*_i, v(t_i) = v*_i with one multiplier per scalar
    condition (HJK 4). Where the objective does not see the translation, that keeps its
    interpolating spline.

    degree: at least 1. refine: knots inserted in every segment, equally spaced, beside the
    simple knots at the keyframe times; or `knots`, the inner knots in increasing order, instead.
    objective: an energy or weighted sum of energies, Rigidity() when left out.
    ends: of the C² cubic interpolant that is the start: "natural", "not-a-knot", "clamped" with
    `end_rates` (linear (2, d, d), translation (2, d)) or "periodic".

    Raises InputError for what cannot be: more conditions in a span than controls, an end
    condition that needs more keyframes, an objective of another dimension.
    """
    began = perf_counter()
    if not isinstance(objective, Energy):
        raise InputError(f"objective {objective!r} is no energy")
    if constraints:
        raise InputError("constraints beside the keyframes are not supported yet")
    if isinstance(degree, bool) or int(degree) != degree or degree < 1:
        raise InputError(f"degree {degree!r}: a whole number, 1 or more, is needed")
    if isinstance(refine, bool) or int(refine) != refine or refine < 0:
        raise InputError(f"refine {refine!r}: a whole number of knots per segment, 0 or more, is needed")
    inner = refined_times(keyframes.times, int(refine))[1:-1] if knots is None else np.asarray(knots, dtype=float)
    basis = _clamped(keyframes.times[0], inner, keyframes.times[-1], int(degree))
    values = np.concatenate([keyframes.linear.reshape(len(keyframes), -1), keyframes.translation], axis=1)
    slopes = None if end_rates is None else np.concatenate([end_rates[0].reshape(2, -1), end_rates[1]], axis=1)
    start = represent(basis, cubic_interpolant(keyframes.times, values, ends, slopes), keyframes.times)
    program = AffineDesign(keyframes, objective, start).program()
    return replace(program, build_seconds=perf_counter() - began)


def _clamped(a: float, inner: np.ndarray, b: float, degree: int) -> BSplineBasis:
    """The clamped basis over [a, b] with these inner knots, copies counting."""
    return BSplineBasis(np.concatenate([np.full(degree + 1, a), inner, np.full(degree + 1, b)]), degree)


def refined_times(times: np.ndarray, refine: int) -> np.ndarray:
    """The times with `refine` more, equally spaced, in every segment."""
    share = np.arange(refine + 1) / (refine + 1)
    return np.append((times[:-1, None] + np.diff(times)[:, None] * share).ravel(), times[-1])


def represent(basis: BSplineBasis, spline: Spline, times: np.ndarray) -> Spline:
    """`spline` over `basis`: exactly where knot insertion leads there, else its closest interpolant at `times`."""
    require_schoenberg_whitney(basis, times)
    spline = spline.clamped()
    if basis.degree == spline.degree and np.isin(spline.basis.knots, basis.knots).all():
        old, old_copies = np.unique(spline.basis.knots, return_counts=True)
        new, new_copies = np.unique(basis.knots, return_counts=True)
        extra = new_copies.copy()
        extra[np.searchsorted(new, old)] -= old_copies
        if (extra >= 0).all():
            return spline.refined(np.repeat(new, extra))
    return closest(basis, spline, times)


@dataclass(frozen=True, eq=False)
class AffineDesign:
    """The question of an affine program: keyframes, objective, and the spline space with its start.

    start: controls (n, d² + d), translation included whether the objective sees it or not.
    """

    keyframes: Keyframes
    objective: Energy
    start: Spline

    @property
    def basis(self) -> BSplineBasis:
        return self.start.basis

    @cached_property
    def _terms(self) -> list[tuple[float, Energy, "JetKernel"]]:
        return [(w, e, JetKernel.of(e, self.keyframes.dimension)) for w, e in self.objective.parts if w > 0]

    @cached_property
    def channels(self) -> int:
        """Coordinates per control in the program: d², or d² + d where the objective sees the translation."""
        return max(kernel.kernel.channels for _, _, kernel in self._terms)

    def program(self) -> Program:
        """The program of this question."""
        start = {UNKNOWN: np.ascontiguousarray(self.start.control_points[:, : self.channels])}
        terms, names = [], set()
        for weight, energy, kernel in self._terms:
            name, k = energy.name, 2
            while name in names:
                name, k = f"{energy.name} ({k})", k + 1
            names.add(name)
            terms.append(kernel.block(name, self.basis, energy.nodes(self.basis.degree), weight))
        return Program(start, tuple(terms), (self._interpolation(),), self)

    def _interpolation(self) -> Constraint:
        z, target = ca.SX.sym("z", self.channels), ca.SX.sym("target", self.channels)
        kernel = Kernel(z, target, z - target, self.channels)
        times = self.keyframes.times
        operator = self.basis.matrix(times)
        operator.eliminate_zeros()
        block = Block(
            "keyframes", kernel, UNKNOWN, slice(0, self.channels), operator, 1, np.ones(len(times)), self._targets
        )
        return Constraint.equality(block)

    @property
    def _targets(self) -> np.ndarray:
        keys = self.keyframes
        return np.concatenate([keys.linear.reshape(len(keys), -1), keys.translation], axis=1)[:, : self.channels]

    def motion(self, unknowns: Mapping[str, np.ndarray]) -> AffineMotion:
        """The motion of the program's unknowns."""
        controls = self.start.control_points.copy()
        controls[:, : self.channels] = unknowns[UNKNOWN]
        return AffineMotion.from_spline(Spline(self.basis, controls), self.keyframes.dimension)

    def unknowns(self, motion: AffineMotion) -> dict[str, np.ndarray]:
        """The unknowns that represent a motion, exactly where the space holds it."""
        return {UNKNOWN: represent(self.basis, motion.spline, self.keyframes.times).control_points[:, : self.channels]}

    def multipliers(self, multipliers: Mapping[str, np.ndarray]) -> dict[str, Any]:
        """Multipliers by constraint, the keyframes' in the keyframes' shape.

        ∂f*/∂A*_i = −linear[i] and ∂f*/∂v*_i = −translation[i], which is zero where the
        objective does not see the translation.
        """
        m, d = len(self.keyframes), self.keyframes.dimension
        shaped = np.zeros((m, d * d + d))
        shaped[:, : self.channels] = multipliers["keyframes"]
        keyframes = Affine(shaped[:, : d * d].reshape(m, d, d), shaped[:, d * d :])
        return {**multipliers, "keyframes": keyframes}

    def with_keyframes(self, program: Program, keyframes: Keyframes) -> Program:
        """The program for other keyframes; structure and kernels are kept where the times are the same."""
        if keyframes.dimension != self.keyframes.dimension:
            raise InputError(f"keyframes in {keyframes.dimension}D for a program in {self.keyframes.dimension}D")
        if not np.array_equal(keyframes.times, self.keyframes.times):
            raise InputError("with_keyframes keeps the times; make a new program for other times")
        # The old start plus the spline through the changes: smooth, and exact at the new keyframes.
        began = perf_counter()
        change = np.concatenate(
            [
                (keyframes.linear - self.keyframes.linear).reshape(len(keyframes), -1),
                keyframes.translation - self.keyframes.translation,
            ],
            axis=1,
        )
        shift = represent(self.basis, cubic_interpolant(keyframes.times, change), keyframes.times)
        start = Spline(self.basis, self.start.control_points + shift.control_points)
        design = replace(self, keyframes=keyframes, start=start)
        controls = {UNKNOWN: np.ascontiguousarray(start.control_points[:, : self.channels])}
        return program.with_data(
            "keyframes", design._targets, start=controls, design=design, build_seconds=perf_counter() - began
        )

    def stages(self, by: str) -> Iterator[Program]:
        """Smaller programs that lead to this one by steps, coarsest first (HJK 4.4, 5.1).

        by: "degree", from 1 up to the full one, with the same knots; or "knots", the inserted knots in
        three steps: every fourth, every second, all.
        """
        times, basis = self.keyframes.times, self.basis
        if by == "degree":
            for degree in range(1, basis.degree):
                yield self._restricted(BSplineBasis.clamped(basis.breakpoints, degree))
        elif by == "knots":
            inner = basis.knots[basis.degree + 1 : -basis.degree - 1]
            inserted = inner[~np.isin(inner, times)]
            for stride in (4, 2):
                kept = np.sort(np.concatenate([inner[np.isin(inner, times)], inserted[stride - 1 :: stride]]))
                if len(kept) < len(inner):
                    yield self._restricted(_clamped(times[0], kept, times[-1], basis.degree))
        else:
            raise InputError(f"stages by {by!r} are unknown; there are degree, knots")

    def _restricted(self, basis: BSplineBasis) -> Program:
        return replace(self, start=represent(basis, self.start, self.keyframes.times)).program()


def measure(motion: AffineMotion, energy: Energy) -> float:
    """The value of an energy for a motion."""
    controls = motion.spline.control_points
    total = 0.0
    for weight, part in energy.parts:
        kernel = JetKernel.of(part, motion.dimension)
        block = kernel.block(part.name, motion.basis, part.nodes(motion.degree), weight)
        total += BlockEvaluator(block).value(block.rows(controls))
    return total


@dataclass(frozen=True, eq=False)
class JetKernel:
    """An energy's integrand as a kernel of the jet's entries that it uses.

    orders: the derivative orders that are the kernel's rows.
    """

    kernel: Kernel
    orders: tuple[int, ...]

    @staticmethod
    @lru_cache(maxsize=64)
    def of(energy: Energy, d: int) -> "JetKernel":
        """The kernel of an energy in dimension d."""
        jet, names = _jet(d)
        residuals = energy.residuals(jet)
        out = ca.SX(energy.integrand(jet)) if residuals is None else residuals
        used = [names[s.name()] for s in ca.symvar(out) if s.name() in names]
        if not used:
            raise InputError(f"the integrand of {energy.name} does not depend on the motion")
        orders = tuple(sorted({order for order, _ in used}))
        channels = d * d + d if max(channel for _, channel in used) >= d * d else d * d
        z = [ca.vertcat(ca.vec(jet.linear[o].T), jet.translation[o])[:channels] for o in orders]
        kernel = Kernel(ca.vertcat(*z), jet.t, out, channels, squares=residuals is not None)
        return JetKernel(kernel, orders)

    def block(self, name: str, basis: BSplineBasis, nodes: int, weight: float) -> Block:
        """The energy's integral over the spans of a basis, by `nodes` Gauss nodes each."""
        points, weights = gauss(basis, nodes)
        t = points.ravel()
        local = [basis.local(t, order) for order in self.orders]
        rows = len(self.orders)
        columns = np.stack([indices for indices, _ in local], axis=1)
        values = np.stack([v for _, v in local], axis=1)
        pointers = np.arange(t.size * rows + 1) * columns.shape[2]
        operator = sparse.csr_array((values.ravel(), columns.ravel(), pointers), shape=(t.size * rows, basis.n))
        channels = slice(0, self.kernel.channels)
        return Block(name, self.kernel, UNKNOWN, channels, operator, nodes, weight * weights.ravel(), t[:, None])


@lru_cache(maxsize=4)
def _jet(d: int) -> tuple[Jet, dict[str, tuple[int, int]]]:
    """The symbols of a jet, and for the name of each its derivative order and channel."""
    linear, translation, names = [], [], {}
    for order in range(HIGHEST_ORDER + 1):
        entries = [ca.SX.sym(f"jet_{order}_{channel}") for channel in range(d * d + d)]
        names |= {s.name(): (order, channel) for channel, s in enumerate(entries)}
        linear.append(ca.reshape(ca.vertcat(*entries[: d * d]), d, d).T)
        translation.append(ca.vertcat(*entries[d * d :]))
    return Jet(tuple(linear), tuple(translation), ca.SX.sym("t")), names
