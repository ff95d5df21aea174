"""Keyframe times as unknowns: the best motion through keyframes over their inner times too, as programs."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from time import perf_counter
from typing import Any

import casadi as ca
import numpy as np
from scipy import sparse

from symmotion.design.affine import refined_times, represent
from symmotion.design.jets import UNKNOWN, JetKernel, jet_symbols, nodes_for
from symmotion.energies import Energy, Rigidity
from symmotion.errors import InputError
from symmotion.kernels import Kernel
from symmotion.motions import Affine, AffineMotion, Keyframes
from symmotion.program import Block, Constraint, Program
from symmotion.program.state import made_of
from symmotion.splines import BSplineBasis, Spline, cubic_interpolant
from symmotion.splines.symbolic import local_basis

RIGIDITY = Rigidity()
LEAST_SHARE = 0.02


def free_times_program(
    keyframes: Keyframes,
    *,
    degree: int = 3,
    refine: int = 1,
    objective: Energy = RIGIDITY,
    least_step: float | None = None,
) -> Program:
    """The best affine spline motion through keyframes whose inner times are unknowns too, as a program.

    Minimise `objective` over the controls and over t_2 < … < t_{M−1}, subject to A(t_i) = A*_i,
    v(t_i) = v*_i and t_{i+1} − t_i ≥ `least_step`. The first and the last time stay: R falls as
    1/T and R*, E as 1/T³ with the total time T, so that without it there is no minimum. The knots
    move with the times: simple ones at the keyframes, `refine` more at equal steps in every segment.

    keyframes: M ≥ 3, their times are the start. least_step: in the unit of time, a fiftieth of
    the mean step when left out. The order is an inequality and the keyframes are nonlinear
    conditions: Ipopt() takes the program. Its unknown "controls" (n, C + 1) holds each control and, in
    the last coordinate, the width of the knot interval [τ_{j+p}, τ_{j+p+1}] in units of the mean.

    Multipliers: "keyframes" as in `affine_program`; "total time", ∂f*/∂T = −λ, which is k f/T for
    an objective that falls as 1/Tᵏ where no step is at its least; "order" (M − 1,), one per step.
    `design.times(x)` and `design.keyframes_at(x)` read the times.
    """
    began = perf_counter()
    if not isinstance(objective, Energy):
        raise InputError(f"objective {objective!r} is no energy")
    for name, value, lowest in (("degree", degree, 1), ("refine", refine, 0)):
        if isinstance(value, bool) or int(value) != value or value < lowest:
            raise InputError(f"{name} {value!r}: a whole number, {lowest} or more, is needed")
    m, times = len(keyframes), keyframes.times
    if m < 3:
        raise InputError(f"{m} keyframes have no inner time: at least 3 are needed")
    mean = (times[-1] - times[0]) / (m - 1)
    least = LEAST_SHARE * mean if least_step is None else float(least_step)
    if not 0 < least < mean:
        raise InputError(f"least_step {least:g}: between 0 and the mean step, {mean:g}, is needed, both excluded")
    short = np.diff(times) <= least
    if short.any():
        i = int(np.argmax(short))
        raise InputError(
            f"keyframes {i} and {i + 1} start {times[i + 1] - times[i]:g} apart, which is not more than least_step "
            f"{least:g}: lower it or start from other times"
        )
    design = FreeTimesDesign(keyframes, objective, int(degree), int(refine), least)
    return replace(design.program(), build_seconds=perf_counter() - began)


@dataclass(frozen=True, eq=False)
class FreeTimesDesign:
    """The question of a program with free times: keyframes (whose times are the start), objective, spline space."""

    keyframes: Keyframes
    objective: Energy
    degree: int
    refine: int
    least_step: float

    __getstate__ = made_of

    @cached_property
    def _energies(self) -> list[tuple[float, Energy]]:
        return [(w, e) for w, e in self.objective.parts if w > 0]

    @cached_property
    def channels(self) -> int:
        """Coordinates per control, beside the knot width: d², or d² + d where the objective sees the translation."""
        return max(JetKernel.of(e, self.keyframes.dimension).kernel.channels for _, e in self._energies)

    @property
    def spans(self) -> int:
        return (len(self.keyframes) - 1) * (self.refine + 1)

    @property
    def n(self) -> int:
        """Controls."""
        return self.spans + self.degree

    @property
    def unit(self) -> float:
        """The mean width of a span, the unit of the unknown widths."""
        return float(self.keyframes.times[-1] - self.keyframes.times[0]) / self.spans

    def program(self) -> Program:
        """The program of this question."""
        motion = self._interpolant(self.keyframes)
        start = self.unknowns(motion)
        terms, taken = [], set()
        for k, (weight, energy) in enumerate(self._energies):
            name = energy.name if energy.name not in taken else f"{energy.name} ({k + 1})"
            taken.add(name)
            terms.append(self._integral(name, energy, nodes_for(energy, motion), weight))
        return Program(start, tuple(terms), (self._interpolation(), *self._steps()), self)

    def _integral(self, name: str, energy: Energy, nodes: int, weight: float) -> Block:
        """An energy over the spans. At the share ξ of a span of width w unit: φ(jet) · w unit, by Gauss nodes in ξ."""
        p, c = self.degree, self.channels
        z, share, unit = _local(p, c), ca.SX.sym("share"), ca.SX.sym("unit")
        jet, names = jet_symbols(self.keyframes.dimension)
        residuals = energy.residuals(jet)
        out = ca.SX(energy.integrand(jet)) if residuals is None else residuals
        if ca.depends_on(out, jet.t):
            raise InputError(f"{energy.name} depends on the time itself: its times cannot be unknowns")
        used = [s for s in ca.symvar(out) if s.name() in names]
        values = {o: _jet(z, p, o, share) / unit**o for o in {names[s.name()][0] for s in used}}
        width = _widths(z, p)[p - 1] * unit
        entries = [values[names[s.name()][0]][names[s.name()][1]] for s in used]
        out = ca.substitute(out, ca.vertcat(*used), ca.vertcat(*entries))
        out = out * (width if residuals is None else ca.sqrt(width))
        kernel = Kernel(ca.vec(z.T), ca.vertcat(share, unit), out, c + 1, squares=residuals is not None)
        points, weights = np.polynomial.legendre.leggauss(nodes)
        data = np.column_stack([np.tile(0.5 + 0.5 * points, self.spans), np.full(nodes * self.spans, self.unit)])
        operator = self._selection(np.repeat(np.arange(self.spans), nodes))
        weights = np.tile(0.5 * weight * weights, self.spans)
        return Block(name, kernel, UNKNOWN, slice(0, c + 1), operator, nodes, weights, data)

    def _interpolation(self) -> Constraint:
        """A keyframe is the begin of its span, the last one the end of the last span."""
        p, c, m = self.degree, self.channels, len(self.keyframes)
        z, share, target = _local(p, c), ca.SX.sym("share"), ca.SX.sym("target", c)
        out = _jet(z, p, 0, share) - target
        kernel = Kernel(ca.vec(z.T), ca.vertcat(share, target), out, c + 1)
        span = np.minimum(np.arange(m) * (self.refine + 1), self.spans - 1)
        data = np.column_stack([np.arange(m) == m - 1, self.keyframes.coordinates[:, :c]])
        block = Block(
            "keyframes", kernel, UNKNOWN, slice(0, c + 1), self._selection(span), 1, np.ones(m), data.astype(float)
        )
        return Constraint.equality(block)

    def _selection(self, span: np.ndarray) -> sparse.csr_array:
        """(N · 2p, n) picks what is read in each of the spans (N,): rows m − p + 1 … m + p, none before the first.

        Those before row m bring the knots to the left, the p + 1 others the controls and the rest of the knots.
        """
        rows = (span[:, None] + np.arange(1 - self.degree, self.degree + 1)).ravel()
        there = rows >= 0
        place = (np.flatnonzero(there), rows[there])
        return sparse.csr_array((np.ones(there.sum()), place), shape=(rows.size, self.n))

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
        return self._knots(np.reshape(x, (self.n, -1))[: self.spans, -1])[:: self.refine + 1]

    def keyframes_at(self, x: np.ndarray) -> Keyframes:
        """The keyframes with their times at unknowns x, for any program with fixed times."""
        return Keyframes(self.times(x), self.keyframes.linear, self.keyframes.translation)

    def _knots(self, widths: np.ndarray) -> np.ndarray:
        """(spans + 1,) the different knots; the ends exactly those given."""
        a, b = self.keyframes.times[[0, -1]]
        return np.concatenate([[a], a + self.unit * np.cumsum(widths)[:-1], [b]])

    def _interpolant(self, keyframes: Keyframes) -> AffineMotion:
        """The natural cubic through keyframes, in the space that belongs to their times."""
        basis = BSplineBasis.clamped(refined_times(keyframes.times, self.refine), self.degree)
        spline = cubic_interpolant(keyframes.times, keyframes.coordinates)
        return AffineMotion.from_spline(represent(basis, spline, keyframes.times), keyframes.dimension)

    def motion(self, unknowns: Mapping[str, np.ndarray]) -> AffineMotion:
        """The motion of the program's unknowns, over its knots; a translation not seen is the natural spline."""
        values = unknowns[UNKNOWN]
        controls = self._interpolant(self.keyframes_at(values)).spline.control_points.copy()
        controls[:, : self.channels] = values[:, :-1]
        basis = BSplineBasis.clamped(self._knots(values[: self.spans, -1]), self.degree)
        return AffineMotion.from_spline(Spline(basis, controls), self.keyframes.dimension)

    def unknowns(self, motion: AffineMotion) -> dict[str, np.ndarray]:
        """The unknowns that represent a motion: exactly where its space is one of these, else at the start's times."""
        ends = np.allclose(motion.domain, self.keyframes.times[[0, -1]])
        if not (ends and motion.degree == self.degree and len(motion.basis.breakpoints) == self.spans + 1):
            basis = BSplineBasis.clamped(refined_times(self.keyframes.times, self.refine), self.degree)
            spline = represent(basis, motion.spline, self.keyframes.times)
            motion = AffineMotion.from_spline(spline, motion.dimension)
        widths = np.append(np.diff(motion.basis.breakpoints) / self.unit, np.zeros(self.degree))
        return {UNKNOWN: np.column_stack([motion.spline.control_points[:, : self.channels], widths])}

    def multipliers(self, multipliers: Mapping[str, np.ndarray]) -> dict[str, Any]:
        """Multipliers by constraint: the keyframes' in their shape, those of times per unit of time."""
        m, d = len(self.keyframes), self.keyframes.dimension
        shaped = np.zeros((m, d * d + d))
        shaped[:, : self.channels] = multipliers["keyframes"]
        return {
            "keyframes": Affine(shaped[:, : d * d].reshape(m, d, d), shaped[:, d * d :]),
            "total time": float(multipliers["total time"][0, 0]) / self.unit,
            "order": multipliers["order"][:, 0] / self.unit,
            "knots": multipliers["knots"][:, 0] / self.unit,
        }

    def with_keyframes(self, program: Program, keyframes: Keyframes) -> Program:
        """The program for other keyframes over the same time, started from theirs; compiled kernels are kept."""
        if keyframes.dimension != self.keyframes.dimension or len(keyframes) != len(self.keyframes):
            raise InputError(f"{keyframes!r} for a program of {self.keyframes!r}")
        if not np.array_equal(keyframes.times[[0, -1]], self.keyframes.times[[0, -1]]):
            raise InputError("with_keyframes keeps the first and the last time; make a new program for others")
        return replace(self, keyframes=keyframes).program()

    def stages(self, by: str) -> Iterator[Program]:
        """Programs with free times have none: only interior-point solvers take them."""
        raise InputError(f"a program with free times has no stages by {by!r}")


def _local(p: int, channels: int) -> ca.SX:
    """(2p, channels + 1) symbols for the rows m − p + 1 … m + p that span m reads."""
    return ca.SX.sym("z", 2 * p, channels + 1)


def _widths(z: ca.SX, p: int) -> list[ca.SX]:
    """The 2p − 1 knot widths about a span, its own in the middle, at p − 1."""
    return [z[k, -1] for k in range(2 * p - 1)]


def _jet(z: ca.SX, p: int, order: int, share: ca.SX) -> ca.SX:
    """(channels,) a derivative at a share of the span, in units of the widths."""
    widths = _widths(z, p)
    knots = {0: ca.SX(0)}
    for k in range(1, p + 1):
        knots[k] = knots[k - 1] + widths[p - 2 + k]
        if k < p:
            knots[-k] = knots[1 - k] - widths[p - 1 - k]
    about = [knots[k] for k in range(1 - p, p + 1)]
    return z[p - 1 :, :-1].T @ ca.vertcat(*local_basis(about, p, share * widths[p - 1], order))
