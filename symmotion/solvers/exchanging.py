"""Bounds that hold everywhere: solved at few times, which move to where the bounds press, until nothing is exceeded."""

from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any, TypeAlias

import numpy as np

from symmotion import checks
from symmotion.program import DesignT, Excess, Program
from symmotion.program.everywhere import Everywhere
from symmotion.solvers.contacts import Contacts, Reduced, Settled
from symmotion.solvers.solution import Course, Round, Seconds, Solution, Status
from symmotion.solvers.solver import require_program, start_vector

# What solves a program at the times that it holds its bounds, from a start.
Solve: TypeAlias = Callable[[Program[DesignT], object], Solution[DesignT]]
Times: TypeAlias = Mapping[str, np.ndarray]

MOST_ROUNDS = 25
# Of the range of the excess along the start: maxima of it that far inside are held from the beginning.
NEAR = 0.2
# The share of the largest multiplier below which a bound does not press.
IDLE = 1e-7
# Times as close as that, as a share of their span, are one; times that press are a contact, which idle ones are beside.
CLOSE, BESIDE = 1e-3, 0.05
# Rounds after which times that do not press are let go, and promises that are not kept after which none is taken.
RESTED, BROKEN = 2, 3
# How often contacts that turn up on the way are settled with the others, before there is a solve.
SETTLED = 4


def bounds_everywhere(program: Program) -> dict[str, Everywhere]:
    """By name, the bounds of a program that are meant for all times."""
    found = ((c.name, c.everywhere, c.is_equality) for c in program.constraints)
    return {name: everywhere for name, everywhere, equal in found if everywhere is not None and not equal}


def exchange(
    program: Program[DesignT],
    solve: Solve[DesignT],
    start: object = None,
    *,
    tolerance: float = 1e-7,
    most_rounds: int = MOST_ROUNDS,
) -> Solution[DesignT]:
    """A solution whose bounds hold everywhere: what `solve` finds where there is nothing to exchange.

    Solves with the bounds held at few times, the maxima of their excess along the start; looks for all local maxima of
    the excess along the solution; holds the bounds there too, or there in place of nearby, as long as that halves the
    excess; drops times that do not press; and solves again from the solution, with its multipliers, until
    the excess is at most the tolerance anywhere, relative to the limit, by a bound where it has one (`Excess.kind`).

    solve: of a program and a start (None, a Solution of that program, …), a Solution; it holds the bounds at the times
        of the program alone. A solution that is none ends the exchange.
    Returns the last one, with the logs and seconds of all, `exchange` and, in `program`, the times at the end, to
    which its multipliers belong. Where the excess stays above the tolerance the message says so.
    Source: Hettich and Kortanek 1993 (exchange for semi-infinite programs).
    """
    bounds = bounds_everywhere(require_program(program))
    if not bounds:
        return solve(program, start)
    checks.not_negative(tolerance, "tolerance")
    found, rounds = solve(program.with_times(_known(bounds, start)), start), []
    if found.status in (Status.STALLED, Status.ITERATION_LIMIT, Status.FAILED):
        # Fewer times leave it more ways.
        found = solve(program.with_times(_near(program, bounds, start)), start)
    course = _Course(Reduced(program, bounds), bounds, tolerance)
    solutions = [found]
    while True:
        rounds.append(_round(found, bounds))
        if not _good(found) or len(rounds) >= most_rounds:
            break
        met = rounds[-1].worst <= tolerance
        warm = course.last(found) if met else course.next(found)
        if warm is None:
            break
        fresh = solve(warm.program, warm)
        if met:
            again = _round(fresh, bounds)
            if _good(fresh) and again.worst <= tolerance:
                found = fresh
                solutions.append(fresh)
                rounds.append(again)
            break
        for other in (warm.program, _joined(warm.program, program, bounds)):
            if _good(fresh) or fresh.interrupted:
                break
            solutions.append(fresh)
            fresh = solve(other, None)
        found = fresh
        solutions.append(found)
    return _told(found, solutions, Course(tolerance, tuple(rounds)))


class _Course:
    """What an exchange remembers: of which times it is said that they do not press, and whether it has to be wary."""

    def __init__(self, reduced: Reduced, bounds: Mapping[str, Everywhere], tolerance: float):
        self.reduced, self.bounds, self.tolerance = reduced, bounds, tolerance
        self.rested: dict[tuple[str, float], int] = {}
        self.dropped: list[tuple[str, float]] = []
        self.promised, self.broken = False, 0
        self.keeps = self.begun = False

    def last(self, found: Solution[DesignT]) -> Solution[DesignT] | None:
        """A start with one time for each contact, None where that is so already."""
        pressing = {name: _pressing(found, name) for name in self.bounds}
        if not any(p.any() for p in pressing.values()) or (self.promised and all(p.all() for p in pressing.values())):
            return None
        contacts = self._contacts(found)
        fewer = any(len(np.unique(contacts.times[contacts.bounds == n])) < len(p) for n, p in pressing.items())
        if not fewer:
            return None
        settled = self._settled(found, found.x, found.program.split(found.multiplier_vector), contacts)
        x, contacts = (settled.x, settled.contacts) if settled else (found.x, contacts)
        return self._carried(found, x, contacts, {name: np.empty(0) for name in self.bounds})

    def next(self, found: Solution[DesignT]) -> Solution[DesignT]:
        """A start at the times for the next solve."""
        broken, self.promised = self.promised, False
        self.broken += broken
        contacts = self._contacts(found)
        x, settled = found.x, False
        more, above = self._more(found, x)
        if self.broken < BROKEN:
            parts = found.program.split(found.multiplier_vector)
            fresh = contacts
            for _ in range(SETTLED):
                trial = self._settled(found, x, parts, fresh)
                if trial is None:
                    break
                x, parts, contacts, settled = trial.x, parts | dict(trial.multipliers), trial.contacts, True
                more, above = self._more(found, x)
                if not any(len(a) for a in above.values()):
                    break
                fresh = contacts.with_more(
                    [self.reduced.beginning(x, name, times) for name, times in above.items() if len(times)]
                )
        for name in self.bounds:
            excess = found.certificate.excess[name]
            if not len(above[name]) and excess.value > self.tolerance and (broken or not settled):
                # Narrower than the samples: the bound knows where.
                more[name] = np.append(more[name], excess.time)
        if settled and not any(len(m) for m in more.values()):
            self.promised = True
            return self._carried(found, x, contacts, more)
        began, self.begun = self.begun, True
        for name in self.bounds if began else ():
            more[name] = np.concatenate([more[name], self._idle(found, name, contacts, more[name], not settled)])
        return self._carried(found, x, contacts, more)

    def _idle(self, found: Solution, name: str, contacts: Contacts, fresh: np.ndarray, adding: bool) -> np.ndarray:
        """The times of a bound that do not press and stay all the same for a while."""
        times, pressing = _times(found, name), _pressing(found, name)
        span = self.reduced.span(name)
        if not self.keeps:
            near = [t for n, t in self.dropped if n == name and len(fresh) and np.abs(fresh - t).min() < 0.5 * span(t)]
            self.keeps = bool(near)
        before, self.rested = self.rested, {k: v for k, v in self.rested.items() if k[0] != name}
        kept, taken = [], np.concatenate([contacts.times[contacts.bounds == name], fresh])
        for time in times[~pressing].tolist():
            if len(taken) and np.abs(taken - time).min() < (CLOSE if adding else BESIDE) * span(time):
                continue
            rounds = before.get((name, time), 0) + 1
            if rounds >= RESTED and not self.keeps:
                self.dropped.append((name, time))
                continue
            self.rested[name, time] = rounds
            kept.append(time)
        return np.array(kept)

    def _contacts(self, found: Solution) -> Contacts:
        """The contacts of a solution: of times that press on one maximum, what they are together."""
        parts: list[tuple[str, float, int, float]] = []
        for name, bound in self.bounds.items():
            loads, times = found.program.split(found.multiplier_vector)[name], _times(found, name)
            heavy = np.abs(loads) > IDLE * max(float(np.abs(loads).max()), 1e-300)
            span = self.reduced.span(name)
            for component in np.flatnonzero(heavy.any(axis=0)).tolist():
                rows = np.flatnonzero(heavy[:, component])
                rows = rows[np.argsort(times[rows])]
                joined = _bridged(found, name, bound, times[rows])
                groups = [rows[:1].tolist()]
                for last, row, over in zip(rows, rows[1:], joined, strict=False):
                    same = loads[row, component] * loads[last, component] > 0
                    if same and (over or times[row] - times[last] < CLOSE * span(times[row])):
                        groups[-1].append(row)
                    else:
                        groups.append([row])
                for group in groups:
                    weights = loads[group, component]
                    time = times[group[0]] if len(group) == 1 else float(weights @ times[group] / weights.sum())
                    parts.append((name, float(time), component, float(weights.sum())))
        return Contacts.joined(parts)

    def _more(self, found: Solution, x: np.ndarray) -> tuple[dict[str, np.ndarray], dict[str, np.ndarray]]:
        """By bound, the times of the maxima at a point that are near the limit, and those that are above it."""
        motion: Any = found.motion if x is found.x else found.program.design.motion(found.program.unpack(x))
        near, above = {}, {}
        for name, bound in self.bounds.items():
            peaks, heights = bound.peaks(motion, _values(found.program, name))
            beyond = heights > self.tolerance
            # What is as far below the limit as others are above may exceed it next.
            near[name] = peaks[heights > -heights.max(), 0] if beyond.any() else np.empty(0)
            above[name] = peaks[beyond, 0]
        return near, above

    def _settled(
        self, found: Solution, x: np.ndarray, multipliers: Mapping[str, np.ndarray], contacts: Contacts
    ) -> Settled | None:
        program = found.program
        if any(np.ptp(np.asarray(program.constraint(name).times), axis=1).any() for name in self.bounds):
            return None
        return self.reduced.settled(x, multipliers, contacts)

    def _carried(
        self, found: Solution[DesignT], x: np.ndarray, contacts: Contacts, more: Mapping[str, np.ndarray]
    ) -> Solution[DesignT]:
        """A start at other times: a point, with the multipliers of contacts in place of its own, and more times."""
        parts, held = found.program.split(found.multiplier_vector), {}
        for name in self.bounds:
            constraint = found.program.constraint(name)
            assert constraint.times is not None  # of a bound that is meant for all times
            slots = constraint.times.shape[1]
            times, loads = contacts.held(name, slots, constraint.lower.shape[1])
            extra = np.setdiff1d(more[name], times[:, 0])
            if not len(times) and not len(extra):
                extra = constraint.times[:1, 0]
            times = np.concatenate([times, np.repeat(extra[:, None], slots, axis=1)])
            loads = np.concatenate([loads, np.zeros((len(extra), loads.shape[1]))])
            order = np.argsort(times[:, 0], kind="stable")
            held[name], parts[name] = times[order], loads[order]
        program = found.program.with_times(held)
        whole = np.concatenate([parts[c.name].ravel() for c in program.constraints])
        return replace(found, program=program, x=x, multiplier_vector=whole)


def _joined(held: Program[DesignT], other: Program, bounds: Mapping[str, Everywhere]) -> Program[DesignT]:
    """A program with the bounds held at the times of another one, too."""
    both = {n: [np.asarray(p.constraint(n).times) for p in (held, other)] for n in bounds}
    return held.with_times({n: np.unique(np.concatenate(times), axis=0) for n, times in both.items()})


def _good(solution: Solution) -> bool:
    return solution.status in (Status.SOLVED, Status.SADDLE)


def _round(solution: Solution, bounds: Mapping[str, Everywhere]) -> Round:
    excess = solution.certificate.excess
    times = {name: solution.program.constraint(name).block.count for name in bounds}
    infinite = Excess(np.inf, np.nan)
    return Round(times, {n: excess.get(n, infinite) for n in bounds}, solution.objective, solution.iterations)


def _values(program: Program, name: str) -> dict[str, np.ndarray]:
    return program.constraint(name).parameter_values


def _known(bounds: Mapping[str, Everywhere], start: object) -> Times:
    """Where bounds were held in a start that was exchanged."""
    if isinstance(start, Solution) and start.exchange is not None:
        before = {c.name: c.times for c in start.program.constraints if c.times is not None}
        if before.keys() >= bounds.keys():
            return {name: before[name] for name in bounds}
    return {}


def _near(program: Program, bounds: Mapping[str, Everywhere], start: object) -> Times:
    """The maxima of the excess along the start that are near the limit, or near the largest."""
    motion = program.design.motion(program.unpack(start_vector(program, start)))
    times = {}
    for name, bound in bounds.items():
        where, heights = bound.peaks(motion, _values(program, name))
        top = float(heights.max())
        near = heights >= min(top, 0.0) - NEAR * (top - float(heights.min()))
        times[name] = where[near]
    return times


def _slots(solution: Solution, name: str) -> int:
    """How many times a bound couples."""
    times = solution.program.constraint(name).times
    assert times is not None  # of a bound that is meant for all times
    return times.shape[1]


def _times(solution: Solution, name: str) -> np.ndarray:
    """(N,) the times at which a bound is held."""
    times = solution.program.constraint(name).times
    assert times is not None  # of a bound that is meant for all times
    return times[:, 0]


def _pressing(solution: Solution, name: str) -> np.ndarray:
    """(N,) which times of a bound press."""
    sizes = np.abs(solution.program.split(solution.multiplier_vector)[name]).max(axis=1)
    return sizes > IDLE * max(float(sizes.max()), 1e-300)


def _bridged(solution: Solution, name: str, bound: Everywhere, times: np.ndarray) -> np.ndarray:
    """(N − 1,) whether a bound is exceeded all the way from one of times (N,) to the next."""
    if len(times) < 2:
        return np.empty(0, dtype=bool)
    between = times[:-1, None] + np.diff(times)[:, None] * np.arange(1, 8) / 8
    slots = np.repeat(between.reshape(-1, 1), _slots(solution, name), axis=1)
    excess = bound.excesses(solution.motion, _values(solution.program, name), slots)
    return (excess.reshape(between.shape) > 0).all(axis=1)


def _told(solution: Solution[DesignT], every: list[Solution[DesignT]], course: Course) -> Solution[DesignT]:
    """The solution with what all solves took."""
    seconds = Seconds(
        solution.program.build_seconds,
        *(_total(every, part) for part in ("compile", "solve", "evaluate", "linear")),
    )
    log, message = tuple(row for s in every for row in s.log), solution.message
    if not course.holds and _good(solution):
        worst = max(course.after.items(), key=lambda item: item[1].value)
        left = f"{worst[0]} is exceeded by {worst[1].value:.2g} ({worst[1].kind}) between its times"
        message = f"{message}; {left}" if message else left
    counts = sum((Counter(s.evaluations) for s in every), Counter())
    return replace(solution, log=log, seconds=seconds, exchange=course, message=message, evaluations=dict(counts))


def _total(every: list[Solution[DesignT]], part: str) -> float | None:
    known = [value for value in (getattr(s.seconds, part) for s in every) if value is not None]
    return sum(known) if known else None
