"""Where bounds that hold everywhere press: times and multipliers, found together with the motion by Newton's method."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import splu

from symmotion.program import Evaluator, Program
from symmotion.program.everywhere import Everywhere
from symmotion.program.program import Structure
from symmotion.systems import HessianTriangle, largest, reach

# The share of the largest multiplier below which a bound does not press.
IDLE = 1e-7
# The multiplier of a contact that begins: of it the sign alone matters.
BEGIN = 1e-300
# Steps at most: as long as they converge, four or five serve.
MOST = 15
# Between the times of which differences are taken, as a share of the span.
APART = 1e-4
# A time that close to the end of a span, as a share of it, is there.
THERE = 1e-7
# Steps of times as shares of the span, and of unknowns in own units, after which the next one would be nothing.
SMALL = 3e-4
# The share of the way to the next contact that a time goes at most, and of a step what is too little.
NEIGHBOUR, LEAST = 0.4, 0.05
# Of values at the times −2, −1, 0, 1, 2 apart the first and second derivatives: from the left, about, from the right.
FIRST = np.array([[0.5, -2, 1.5, 0, 0], [0, -0.5, 0, 0.5, 0], [0, 0, -1.5, 2, -0.5]])
SECOND = np.array([[1.0, -2, 1, 0, 0], [0, 1, -2, 1, 0], [0, 0, 1, -2, 1]])


@dataclass(frozen=True, eq=False)
class Contacts:
    """Times (K,) at which components (K,) of bounds (K,), by name, press, with multipliers (K,)."""

    bounds: np.ndarray
    times: np.ndarray
    components: np.ndarray
    loads: np.ndarray

    @staticmethod
    def joined(parts: Sequence[tuple[str, float, int, float]]) -> "Contacts":
        """Of bounds, times, components and multipliers one by one."""
        columns = [np.array(c) for c in zip(*sorted(parts), strict=True)] or [np.empty(0, dtype=int)] * 4
        return Contacts(*columns)

    def with_more(self, others: Sequence["Contacts"]) -> "Contacts":
        """With others, bound by bound."""
        every = [(c.bounds, c.times, c.components, c.loads) for c in (self, *others) if len(c.times)]
        columns = [np.concatenate(column) for column in zip(*every, strict=True)]
        order = np.argsort(columns[0], kind="stable")
        return Contacts(*(column[order] for column in columns))

    def of(self, which: np.ndarray) -> "Contacts":
        """Some of them."""
        return Contacts(self.bounds[which], self.times[which], self.components[which], self.loads[which])

    def held(self, name: str, slots: int, width: int) -> tuple[np.ndarray, np.ndarray]:
        """The different times (N, slots) at which a bound presses, and the multipliers (N, width) there."""
        here = self.of(self.bounds == name)
        times, place = np.unique(here.times, return_inverse=True)
        loads = np.zeros((len(times), width))
        np.add.at(loads, (place, here.components), here.loads)
        return np.repeat(times[:, None], slots, axis=1), loads


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
            length = self._length(contacts, share * spans)
            x, y = x + length * dx, y + length * dy
            times = self._stopped(contacts, length * share * spans)
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
        values = Evaluator(program, self.evaluator.kernels).values(x).reshape(there.lower.shape)
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
            step = scale * splu(scaled).solve(-left * residual)
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
        evaluator = Evaluator(program, self.evaluator.kernels)
        places = np.arange(5 * count).reshape(count, 5) * there.lower.shape[1] + contacts.components[:, None]
        values, rows = evaluator.values(x)[places], evaluator.jacobian(x)[places.ravel()]
        signs = np.sign(contacts.loads)
        side, free = self._sides(contacts.times, spans, breaks, signs[:, None] * values)
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

    @staticmethod
    def _sides(
        times: np.ndarray, spans: np.ndarray, breaks: np.ndarray, excess: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """(K,) from where differences are taken, a row of FIRST, and whether the time may move.

        excess: (K, 5) at the times apart, up to a constant.
        """
        near = breaks[np.argmin(np.abs(breaks - times[:, None]), axis=1)]
        away = (near - times) / spans
        side = np.where(np.abs(away) >= 2 * APART, 1, np.where(away > 0, 0, 2))
        at = np.abs(away) <= THERE
        before, after = (excess @ FIRST[0] > 0) & (near > breaks[0]), (excess @ FIRST[2] < 0) & (near < breaks[-1])
        rises_left, rises_right = (near > breaks[0]) & ~before, (near < breaks[-1]) & ~after
        side = np.where(at, np.where(rises_right, 2, 0), side)
        return side, ~at | rises_left | rises_right

    def span(self, name: str) -> Callable[[float], float]:
        """Of a bound, the length of the span that a time lies in, of the shorter one at a break."""
        return lambda time: float(_lengths(self.breaks[name], np.array([time]))[0])

    def _spans(self, contacts: Contacts) -> np.ndarray:
        """(K,) the lengths of the spans that the times lie in, of the shorter one at a break."""
        spans = np.empty(len(contacts.times))
        for name in np.unique(contacts.bounds):
            here = contacts.bounds == name
            spans[here] = _lengths(self.breaks[name], contacts.times[here])
        return spans

    @staticmethod
    def _length(contacts: Contacts, moves: np.ndarray) -> float:
        """What of a step keeps the contacts of a component apart."""
        length = 1.0
        for name, component in {*zip(contacts.bounds.tolist(), contacts.components.tolist(), strict=True)}:
            here = (contacts.bounds == name) & (contacts.components == component)
            order = np.argsort(contacts.times[here])
            gaps, closing = np.diff(contacts.times[here][order]), -np.diff(moves[here][order])
            tight = closing > 2 * NEIGHBOUR * gaps
            if tight.any():
                length = min(length, float((2 * NEIGHBOUR * gaps[tight] / closing[tight]).min()))
        return length

    def _stopped(self, contacts: Contacts, moves: np.ndarray) -> np.ndarray:
        """(K,) the times moved, no further than to the next break."""
        times = contacts.times + moves
        for name in np.unique(contacts.bounds):
            breaks = self.breaks[name]
            for k in np.flatnonzero(contacts.bounds == name):
                low, high = sorted((contacts.times[k], times[k]))
                slack = THERE * float(np.diff(breaks).min())
                crossed = breaks[(breaks > low + slack) & (breaks < high - slack)]
                if len(crossed):
                    times[k] = crossed[0] if moves[k] > 0 else crossed[-1]
            here = contacts.bounds == name
            times[here] = np.clip(times[here], breaks[0], breaks[-1])
        return times


def _size(limits: np.ndarray) -> np.ndarray:
    return np.where(np.isfinite(limits) & (limits != 0), np.abs(limits), 1.0)


def _lengths(breaks: np.ndarray, times: np.ndarray) -> np.ndarray:
    """(K,) the lengths of the spans in which times (K,) lie, of the shorter one at a break."""
    lengths = np.diff(breaks)
    sides = [np.clip(np.searchsorted(breaks, times, side) - 1, 0, len(lengths) - 1) for side in ("left", "right")]
    return np.minimum(lengths[sides[0]], lengths[sides[1]])
