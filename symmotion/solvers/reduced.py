"""The times at which bounds press found together with the motion, by Newton's method."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np
from scipy import sparse

from symmotion.program import Evaluator, Program
from symmotion.program.everywhere import Everywhere
from symmotion.program.program import Structure
from symmotion.solvers.contacts import APART, FIRST, SECOND, Contacts, sides_of, span_lengths, stopped, together
from symmotion.systems import HessianTriangle, largest, reach, solved

# The share of the largest multiplier below which a bound does not press.
IDLE = 1e-7
# The multiplier of a contact that begins: of it the sign alone matters.
BEGIN = 1e-300
# Steps at most: as long as they converge, four or five serve.
MOST = 15
# Steps of times as shares of the span, and of unknowns in own units, after which the next one would be nothing.
SMALL = 3e-4
# The share of a step that is too little.
LEAST = 0.05


@dataclass(frozen=True, eq=False)
class Settled:
    """A stationary point x (unknowns,) of a program whose bounds press where they are at their maxima.

    multipliers: by constraint, of those that are not meant for all times.
    """

    x: np.ndarray
    multipliers: Mapping[str, np.ndarray]
    contacts: Contacts


@dataclass(frozen=True, eq=False)
class _Local:
    """What is known of K contacts at a point.

    off: (K,) by how much they miss their limits; rows, slopes: (K, unknowns) ∂c/∂x and ∂²c/∂x∂t; rate, bend: (K,)
    ∂c/∂t and ∂²c/∂t²; free: (K,) whether the time moves: not at an end or a kink; hessian: of Σ λ c. Of times as
    shares of their spans.
    """

    off: np.ndarray
    rows: sparse.csr_array
    slopes: sparse.csr_array
    rate: np.ndarray
    bend: np.ndarray
    free: np.ndarray
    hessian: sparse.csr_array


class Reduced:
    """A program with bounds that hold everywhere as one whose bounds are held at their own maxima.

    Solves ∇f + Σ λ_k ∇c(x, t_k) + … = 0, c(x, t_k) = limit, ∂c/∂t(x, t_k) = 0 for x, λ and the times t together by
    Newton's method, derivatives by t from differences. A time at an end, or at a kink, stays as long as the excess
    falls on both sides. Source: Hettich and Kortanek 1993 (local reduction).
    """

    def __init__(self, program: Program, bounds: Mapping[str, Everywhere]):
        rest = tuple(c for c in program.constraints if c.name not in bounds)
        self.program, self.bounds = program, bounds
        self.rest = replace(program, constraints=rest, structure=Structure())
        self.evaluator = Evaluator(self.rest)
        self.breaks = {name: bound.breaks() for name, bound in bounds.items()}

    @np.errstate(all="ignore")  # what is not finite ends it
    def settled(self, x: np.ndarray, multipliers: Mapping[str, np.ndarray], contacts: Contacts) -> Settled | None:
        """From a point with multipliers by constraint on; None where the steps do not converge."""
        rest, worst = self.rest, np.inf
        y = np.concatenate([np.empty(0), *(multipliers[c.name].ravel() for c in rest.constraints)])
        pressing = (rest.lower == rest.upper) | (np.abs(y) > IDLE * largest(y))
        y = np.where(pressing, y, 0.0)
        limits = np.where(pressing, np.where(y > 0, rest.upper, rest.lower), 0.0)
        for _ in range(MOST):
            if not len(contacts.times):
                return None
            found = self._step(x, y, pressing, limits, contacts)
            if found is None:
                return None
            dx, dy, dloads, share = found
            spans = self._spans(contacts)
            length = together(contacts, share * spans)
            x, y = x + length * dx, y + length * dy
            times = stopped(self.breaks, contacts, length * share * spans)
            size = max(largest(dx / rest.unit), largest(share))
            if length < LEAST or not np.isfinite(size) or size > 10 * worst:
                return None
            before, contacts = contacts, replace(contacts, times=times, loads=contacts.loads + length * dloads)
            if length == 1.0 and size <= SMALL:
                return Settled(x, rest.split(y), contacts)
            worst = min(worst, size)
            # What no longer presses is let go.
            contacts = contacts.of(contacts.loads * before.loads > 0)
        return None

    def beginning(self, x: np.ndarray, name: str, times: np.ndarray) -> Contacts:
        """Contacts at times (N,) at which a bound is exceeded, next to no load yet on what exceeds it most."""
        constraint = self.program.constraint(name)
        assert constraint.times is not None  # of a bound that is meant for all times
        there = self.bounds[name].at(np.repeat(times[:, None], constraint.times.shape[1], axis=1), constraint)
        program = replace(self.program, terms=(), constraints=(there,), structure=Structure())
        values = Evaluator(program).values(x).reshape(there.lower.shape)
        over, under = (values - there.upper) / _size(there.upper), (there.lower - values) / _size(there.lower)
        components = np.argmax(np.maximum(over, under), axis=1)
        rows = np.arange(len(times))
        loads = np.where(over[rows, components] > under[rows, components], BEGIN, -BEGIN)
        return Contacts(np.full(len(times), name), times, components, loads)

    def _step(
        self,
        x: np.ndarray,
        y: np.ndarray,
        pressing: np.ndarray,
        limits: np.ndarray,
        contacts: Contacts,
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray] | None:
        """Steps of unknowns, of both kinds of multipliers, and of times as shares of their spans."""
        rest, evaluator, n = self.rest, self.evaluator, len(x)
        triangle, local = HessianTriangle.of(rest), self._local(x, contacts)
        if (local.free & (np.sign(contacts.loads) * local.bend >= 0)).any():
            return None
        gradient, flat = evaluator.second_order(x, triangle.pattern, y)
        held, free = np.flatnonzero(pressing), np.flatnonzero(local.free)
        rows = sparse.vstack([evaluator.jacobian(x)[held], local.rows], format="csr")
        loads = np.concatenate([y[held], contacts.loads])
        off = np.concatenate([(evaluator.values(x) - limits)[held], local.off])
        moved = sparse.csr_array(
            (local.rate[free], (len(held) + free, np.arange(len(free)))), shape=(len(loads), len(free))
        )
        slopes = local.slopes[free]
        matrix = sparse.block_array(
            [
                [triangle.full(flat, n) + local.hessian, rows.T, slopes.T * contacts.loads[free]],
                [rows, None, moved],
                [slopes, None, sparse.diags_array(local.bend[free])],
            ],
            format="csc",
        )
        # Rows and columns of order one: unknowns in own units, conditions by what they reach.
        reaches = reach(rows, rest.unit)
        scale = np.concatenate([rest.unit, 1 / reaches, np.ones(len(free))])
        left = np.concatenate([rest.unit, 1 / reaches, 1 / np.abs(local.bend[free])])
        residual = np.concatenate([gradient + rows.T @ loads, off, local.rate[free]])
        scaled = sparse.csc_array(sparse.diags_array(left) @ matrix @ sparse.diags_array(scale))
        try:
            step = scale * solved(scaled, -left * residual)
        except RuntimeError:
            return None
        if not np.isfinite(step).all():
            return None
        dy, share = np.zeros_like(y), np.zeros(len(contacts.times))
        dy[held], share[free] = step[n : n + len(held)], step[n + len(loads) :]
        return step[:n], dy, step[n + len(held) : n + len(loads)], share

    def _local(self, x: np.ndarray, contacts: Contacts) -> _Local:
        parts = [self._of_bound(name, x, contacts.of(contacts.bounds == name)) for name in np.unique(contacts.bounds)]
        joined = {what: np.concatenate([getattr(p, what) for p in parts]) for what in ("off", "rate", "bend", "free")}
        rows, slopes = (sparse.vstack([getattr(p, w) for p in parts], format="csr") for w in ("rows", "slopes"))
        hessian = parts[0].hessian
        for part in parts[1:]:
            hessian = hessian + part.hessian
        return _Local(rows=rows, slopes=slopes, hessian=hessian, **joined)

    def _of_bound(self, name: str, x: np.ndarray, contacts: Contacts) -> _Local:
        """The contacts of one bound, by its values and rows at times about them."""
        bound, breaks, constraint = self.bounds[name], self.breaks[name], self.program.constraint(name)
        assert constraint.times is not None  # of a bound that is meant for all times
        spans, count, slots = self._spans(contacts), len(contacts.times), constraint.times.shape[1]
        about = contacts.times[:, None] + APART * spans[:, None] * np.arange(-2, 3)
        about = np.clip(about, breaks[0], breaks[-1])
        there = bound.at(np.repeat(about.reshape(-1, 1), slots, axis=1), constraint)
        program = replace(self.program, terms=(), constraints=(there,), structure=Structure())
        evaluator = Evaluator(program)
        places = np.arange(5 * count).reshape(count, 5) * there.lower.shape[1] + contacts.components[:, None]
        values, rows = evaluator.values(x)[places], evaluator.jacobian(x)[places.ravel()]
        signs = np.sign(contacts.loads)
        side, free = sides_of(contacts.times, spans, breaks, signs[:, None] * values)
        first = FIRST[side] / APART
        differences = sparse.csr_array(
            (first.ravel(), (np.repeat(np.arange(count), 5), np.arange(5 * count))), shape=(count, 5 * count)
        )
        multipliers = np.zeros(program.conditions)
        multipliers[places[:, 2]] = contacts.loads
        hessian = sparse.csr_array((len(x), len(x)))
        if not there.block.kernel.linear:
            triangle = HessianTriangle.of(program)
            hessian = triangle.full(evaluator.second_order(x, triangle.pattern, multipliers)[1], len(x))
        limits = np.where(signs > 0, program.upper[places[:, 2]], program.lower[places[:, 2]])
        return _Local(
            off=values[:, 2] - limits,
            rows=rows[2::5],
            slopes=sparse.csr_array(differences @ rows),
            rate=(first * values).sum(axis=1),
            bend=(SECOND[side] * values).sum(axis=1) / APART**2,
            free=free,
            hessian=hessian,
        )

    def span(self, name: str) -> Callable[[float], float]:
        """Of a bound, the length of the span that a time lies in, of the shorter one at a break."""
        return lambda time: float(span_lengths(self.breaks[name], np.array([time]))[0])

    def _spans(self, contacts: Contacts) -> np.ndarray:
        """(K,) the lengths of the spans that the times lie in, of the shorter one at a break."""
        spans = np.empty(len(contacts.times))
        for name in np.unique(contacts.bounds):
            here = contacts.bounds == name
            spans[here] = span_lengths(self.breaks[name], contacts.times[here])
        return spans


def _size(limits: np.ndarray) -> np.ndarray:
    return np.where(np.isfinite(limits) & (limits != 0), np.abs(limits), 1.0)
