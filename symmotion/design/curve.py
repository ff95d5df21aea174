"""Motion curves of least ∫ ‖x⁽ᵏ⁾‖² under conditions at given times, as programs."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from time import perf_counter
from typing import Any

import casadi as ca
import numpy as np

from symmotion.design.affine import represent
from symmotion.design.curve_conditions import CurveCondition
from symmotion.errors import InputError
from symmotion.kernels import Kernel
from symmotion.program import Block, Constraint, Program
from symmotion.program.state import made_of
from symmotion.splines import BSplineBasis, Spline, gauss

UNKNOWN = "controls"
SMALL = 600  # conditions up to which a dense factorisation looks for redundant ones


def curve_program(
    conditions: Sequence[CurveCondition],
    *,
    order: int = 2,
    degree: int | None = None,
    refine: int = 0,
    knots=None,
    breaks=(),
    domain: tuple[float, float] | None = None,
) -> Program:
    """The curve of least ∫ ‖x⁽ᵏ⁾‖² dt under conditions at given times, as a program.

    conditions: made by `CurveCondition.at`, `.between`, `.norm_below`, `.closed`, `.linked`; each
    keeps its multipliers under its name, in the shape of its values. order: k = 1, 2 or 3.
    breaks: (B,) times where the curve is only continuous and the integral is taken piece by piece.
    domain: of the curve, the interval of the conditions' times when left out.

    degree: 2k − 1 when left out, or the least in which the conditions' derivatives are continuous.
    Knots lie at the conditions' times, 1 + o copies for the highest order o < k asked for there:
    that space holds the minimiser among all functions (a natural spline), for bounds and
    tolerances too, since only the times count. Conditions of order k and more have no such
    minimiser: there the optimum depends on the knots. refine: knots more in every interval;
    or `knots`, all inner knots with their copies, instead.

    Raises InputError for conditions that repeat or depend on one another, or that leave part of
    the curve undetermined.
    """
    began = perf_counter()
    conditions = tuple(conditions)
    if not conditions or not all(isinstance(c, CurveCondition) for c in conditions):
        raise InputError("conditions: a sequence of one CurveCondition or more is needed")
    names = [c.name for c in conditions]
    for name in names:
        if names.count(name) > 1:
            raise InputError(f"conditions of the same name, {name!r}: give each a name of its own")
    if isinstance(order, bool) or order not in (1, 2, 3):
        raise InputError(f"order {order!r}: 1, 2 or 3 is needed")
    if isinstance(refine, bool) or int(refine) != refine or refine < 0:
        raise InputError(f"refine {refine!r}: a whole number of knots per interval, 0 or more, is needed")
    highest = max(int(c.orders.max()) for c in conditions)
    if degree is None:
        degree = max(2 * order - 1, highest + 1 if highest >= order else 0)
    if isinstance(degree, bool) or int(degree) != degree or degree < max(order, highest):
        raise InputError(
            f"degree {degree!r}: a whole number, {max(order, highest)} or more, is needed for the derivatives asked for"
        )
    degree, refine = int(degree), int(refine)
    span = _domain(conditions, domain)
    torn = np.unique(np.asarray(breaks, dtype=float))
    outside = ~((torn > span[0]) & (torn < span[1]))
    if outside.any():
        raise InputError(f"break {torn[outside][0]:g} is not inside the domain ({span[0]:g}, {span[1]:g})")
    inner = np.asarray(knots, dtype=float) if knots is not None else _knots(conditions, order, degree, span, torn)
    if knots is None and refine:
        borders = np.unique(np.concatenate([span, inner]))
        share = np.arange(1, refine + 1) / (refine + 1)
        inner = np.sort(np.concatenate([inner, (borders[:-1, None] + np.diff(borders)[:, None] * share).ravel()]))
    end = np.full(degree + 1, 1.0)
    design = CurveDesign(
        conditions, order, BSplineBasis(np.concatenate([span[0] * end, inner, span[1] * end]), degree), torn
    )
    return replace(design.program(), build_seconds=perf_counter() - began)


def _domain(conditions: Sequence[CurveCondition], domain: tuple[float, float] | None) -> tuple[float, float]:
    first, last = min(c.times.min() for c in conditions), max(c.times.max() for c in conditions)
    a, b = (first, last) if domain is None else (float(domain[0]), float(domain[1]))
    if not (np.isfinite([a, b]).all() and a < b):
        raise InputError(f"domain from {a:g} to {b:g}: conditions at two times or more, or a longer domain, are needed")
    for c in conditions:
        if c.times.min() < a or c.times.max() > b:
            worst = c.times.min() if c.times.min() < a else c.times.max()
            raise InputError(f"{c.name}: time {worst:g} is outside the domain [{a:g}, {b:g}]")
    return float(a), float(b)


def _knots(conditions, order: int, degree: int, span: tuple[float, float], breaks: np.ndarray) -> np.ndarray:
    """The inner knots at the conditions' times, with the copies that their orders call for."""
    orders: dict[float, set[int]] = {float(t): set() for t in breaks}
    for c in conditions:
        for t, o in zip(c.times.ravel().tolist(), c.orders.ravel().tolist(), strict=True):
            orders.setdefault(t, set()).add(o)
    knots = []
    for t in sorted(set(orders) - set(span)):
        low, high = ([o for o in orders[t] if (o < order) == below] for below in (True, False))
        # The minimiser's derivative of order 2k − 1 − o may jump; an order that is asked for must not.
        copies = degree - 2 * order + 2 + max(low) if low else 1
        copies = min(copies, degree - max(high)) if high else copies
        knots += [t] * (degree if t in breaks else max(copies, 1))
    return np.array(knots)


@dataclass(frozen=True, eq=False)
class CurveDesign:
    """The question of a curve program: conditions, order of the derivative that is to be small, spline space.

    breaks: (B,) times where the curve is only continuous.
    """

    conditions: tuple[CurveCondition, ...]
    order: int
    basis: BSplineBasis
    breaks: np.ndarray

    __getstate__ = made_of

    @cached_property
    def shape(self) -> tuple[int, ...]:
        """The shape of the curve's values."""
        return max((c.value_shape for c in self.conditions), key=len)

    @property
    def channels(self) -> int:
        return int(np.prod(self.shape))

    def program(self) -> Program:
        """The program of this question."""
        built = tuple(self._constraint(c) for c in self.conditions if len(self._kept[c.name]))
        self._require_independent()
        self._require_determined()
        return Program(
            {UNKNOWN: self._start()},
            (self._energy(),),
            built,
            self,
        )

    def _energy(self) -> Block:
        """∫ ‖x⁽ᵏ⁾‖² by Gauss nodes, exactly: the integrand has degree 2 (p − k) on a span."""
        nodes = self.basis.degree - self.order + 1
        points, weights = gauss(self.basis, nodes)
        z = ca.SX.sym("z", self.channels)
        kernel = Kernel(z, ca.SX.sym("none", 0), z, self.channels, squares=True)
        count = points.size
        operator = self.basis.matrix(points.ravel(), self.order)
        whole = slice(0, self.channels)
        name = f"∫ ‖x{self.order * chr(39)}‖²"
        return Block(name, kernel, UNKNOWN, whole, operator, nodes, weights.ravel(), np.empty((count, 0)))

    def _constraint(self, c: CurveCondition) -> Constraint:
        z, target = ca.SX.sym("z", self.channels), ca.SX.sym("target", self.channels)
        out = ca.sumsqr(z) if c.norm else z - target
        kernel = Kernel(z, target, out, self.channels)
        kept = self._kept[c.name]
        rows, data = c.rows(self.basis)[kept], c.spread(c.target, self.shape)[kept]
        block = Block(c.name, kernel, UNKNOWN, slice(0, self.channels), rows, 1, np.ones(len(kept)), data)
        shape = () if c.norm else self.shape
        return Constraint(block, c.spread(c.lower, shape)[kept], c.spread(c.upper, shape)[kept])

    @cached_property
    def _kept(self) -> dict[str, np.ndarray]:
        """The rows of each condition that are left to the solver.

        A bound at a time where an equality fixes the same derivative decides nothing, and would make
        the Jacobian rank-deficient: it is checked, left out, and its multiplier is zero.
        """
        fixed = {}
        for c in self.conditions:
            if c.is_equality and not c.norm and c.times.shape[1] == 1:
                for key, value in zip(c.samples, c.spread(c.target, self.shape), strict=True):
                    fixed.setdefault(key, (c.name, value))
        kept = {}
        for c in self.conditions:
            kept[c.name] = np.arange(c.count)
            if c.is_equality or c.times.shape[1] > 1:
                continue
            decided = [(i, *fixed[key]) for i, key in enumerate(c.samples) if key in fixed]
            shape = () if c.norm else self.shape
            target, lower, upper = c.spread(c.target, self.shape), c.spread(c.lower, shape), c.spread(c.upper, shape)
            for i, name, value in decided:
                g = np.array([value @ value]) if c.norm else value - target[i]
                low, high = lower[i], upper[i]
                slack = 1e-12 * max(1.0, np.abs(g).max())
                if (g < low - slack).any() or (g > high + slack).any():
                    raise InputError(f"{c.name} at time {c.times[i, 0]:g} contradicts {name} there")
            kept[c.name] = np.setdiff1d(kept[c.name], [i for i, *_ in decided])
        return kept

    def _start(self) -> np.ndarray:
        """Controls on the broken line through the values asked for, or zero."""
        given = [c for c in self.conditions if c.times.shape[1] == 1 and not c.orders.any() and not c.norm]
        given = [c for c in given if np.isfinite(c.lower).all() and np.isfinite(c.upper).all()]
        if not given:
            return np.zeros((self.basis.n, self.channels))
        times = np.concatenate([c.times[:, 0] for c in given])
        values = np.concatenate(
            [
                c.spread(c.target, self.shape) + (c.spread(c.lower, self.shape) + c.spread(c.upper, self.shape)) / 2
                for c in given
            ]
        )
        along = np.argsort(times, kind="stable")
        return np.column_stack([np.interp(self.basis.greville, times[along], v[along]) for v in values.T])

    def _require_independent(self) -> None:
        """Raise InputError that names the first equality that repeats others or contradicts them."""
        from scipy.linalg import qr

        equalities = [c for c in self.conditions if c.is_equality]
        labels = [(c, i) for c in equalities for i in range(c.count)]
        if not labels or len(labels) > SMALL:
            return
        rows = np.concatenate([c.rows(self.basis).toarray() for c in equalities])
        scale = np.abs(rows).max(axis=1, keepdims=True)
        triangle = np.asarray(qr((rows / np.where(scale > 0, scale, 1.0)).T, mode="r")[0])
        rank = min(triangle.shape)
        pivots = np.concatenate([np.abs(np.diag(triangle)), np.zeros(len(labels) - rank)])
        if (pivots <= 1e-11).any():
            c, i = labels[int(np.argmax(pivots <= 1e-11))]
            raise InputError(
                f"{c.name}, row {i} (time {c.times[i, -1]:g}), follows from the conditions before it or contradicts "
                "them: leave it out, or insert knots"
            )

    def _require_determined(self) -> None:
        """Raise InputError where a curve that costs nothing is free under the conditions."""
        # ∫ ‖x⁽ᵏ⁾‖² does not see polynomials of degree k − 1, one for each piece between breaks, joined continuously.
        a, b = self.basis.domain
        k = self.order
        knots = np.concatenate([np.full(k, a), np.repeat(self.breaks, k - 1), np.full(k, b)])
        unseen = BSplineBasis(knots, k - 1)
        rows = np.concatenate([c.rows(unseen).toarray() for c in self.conditions])
        rank = np.linalg.matrix_rank(rows / np.maximum(np.abs(rows).max(axis=1, keepdims=True), 1e-300))
        if rank < unseen.n:
            kind = ("constants", "straight lines", "parabolas")[k - 1]
            pieces = " between the breaks" if len(self.breaks) else ""
            raise InputError(
                f"the conditions leave the curve undetermined: {kind}{pieces} cost nothing and have {unseen.n} degrees "
                f"of freedom per coordinate, of which the conditions fix {rank}; add conditions"
            )

    def motion(self, unknowns: Mapping[str, np.ndarray]) -> Spline:
        """The curve of the program's unknowns."""
        return Spline(self.basis, unknowns[UNKNOWN].reshape(-1, *self.shape).copy())

    def unknowns(self, motion: Any) -> dict[str, np.ndarray]:
        """The unknowns that represent a curve, exactly where the space holds it."""
        spline = motion.to_bspline().clamped()
        if spline.domain != self.basis.domain or spline.control_points.shape[1:] != self.shape:
            raise InputError(
                f"a curve over {spline.domain} with values of shape {spline.control_points.shape[1:]}: "
                f"{self.basis.domain} and {self.shape} are needed"
            )
        spline = spline.elevated(max(0, self.basis.degree - spline.degree))
        return {UNKNOWN: represent(self.basis, spline, self.basis.greville).control_points.reshape(self.basis.n, -1)}

    def multipliers(self, multipliers: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
        """Multipliers by condition, (N, …) in the shape of the curve's values, (N,) for a norm.

        ∂f*/∂target_i = −λ_i; at a bound ∂f*/∂bound_i = −λ_i too, of a norm per unit of its square.
        """
        shaped = {}
        for c in self.conditions:
            whole = np.zeros((c.count, 1 if c.norm else self.channels))
            if c.name in multipliers:
                whole[self._kept[c.name]] = multipliers[c.name]
            shaped[c.name] = whole.reshape(c.count, *(() if c.norm else self.shape))
        return shaped
