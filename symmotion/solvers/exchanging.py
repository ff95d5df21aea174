"""Bounds that hold everywhere: solved at few times, which move to where the bounds press, until nothing is exceeded."""

from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any, TypeAlias

import numpy as np

from symmotion import checks
from symmotion.program import DesignT, Excess, Program
from symmotion.program.everywhere import Everywhere
from symmotion.solvers.solution import Course, Round, Seconds, Solution, Status
from symmotion.solvers.solver import require_program, start_vector

# What solves a program at the times that it holds its bounds, from a start.
Solve: TypeAlias = Callable[[Program[DesignT], object], Solution[DesignT]]
Times: TypeAlias = Mapping[str, np.ndarray]
# Times (N, s) of a bound and multipliers (N, C) there.
Weighted: TypeAlias = tuple[np.ndarray, np.ndarray]

MOST_ROUNDS = 25
# Of the range of the excess along the start: maxima of it that far inside are held from the beginning.
NEAR = 0.2
# The share of the largest multiplier below which a bound does not press.
IDLE = 1e-7
# By the time that presses, of how much later the maximum is: to begin with, and what a secant may tell. Seen are −1.5
# to −30; too short a step costs less than one too long.
GIVES, SLOPES = -6.0, (-100.0, -0.5)
# Excess below which the times that press about a maximum are taken for one contact, which is looked for by a secant.
NARROW = 0.1
# By how much three rounds lower the excess where moving times converges.
FALLS = 0.5


@dataclass(frozen=True)
class Bracket:
    """Where a bound that presses at one time has its maximum at that time: between what was tried.

    The maximum gives way to what presses, and lies on the other side of where they meet. tried: the times so far, the
    last one last, and by how much the maximum was later each time.
    """

    tried: tuple[tuple[float, float], ...] = ()

    def with_point(self, time: float, away: float) -> "Bracket":
        """With another time, and how much later the maximum was."""
        return Bracket((*self.tried, (time, away)))

    @property
    def next(self) -> float:
        """The time to try next: by a secant, inside the bracket."""
        time, away = self.tried[-1]
        early = max((t for t, f in self.tried if f > 0), default=-np.inf)
        late = min((t for t, f in self.tried if f <= 0), default=np.inf)
        slope = GIVES
        if len(self.tried) > 1:
            before, f = self.tried[-2]
            slope = float(np.clip((away - f) / (time - before), *SLOPES)) if time != before else slope
        there = time - away / slope
        return there if early < there < late else 0.5 * (early + late)


# By the new time of a contact.
Moves: TypeAlias = Mapping[float, Bracket]


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
    current = program.with_times(_first(program, bounds, start))
    found, rounds, moving = solve(current, start), [], True
    moves: dict[str, Moves] = {name: {} for name in bounds}
    solutions = [found]
    while True:
        rounds.append(_round(found, bounds))
        if rounds[-1].worst <= tolerance or not _good(found) or len(rounds) >= most_rounds:
            break
        # Contacts that turn on each other are not found one by one: times stay from then on, which always converges.
        moving = moving and (len(rounds) < 4 or rounds[-1].worst <= FALLS * rounds[-4].worst)
        steps = {
            name: _next(found, name, bounds[name], maxima, tolerance, moves[name] if moving else None)
            for name, maxima in _peaks(found, bounds).items()
        }
        moves = {name: moved for name, (_, moved) in steps.items()}
        warm = _carried(found, {name: held for name, (held, _) in steps.items()})
        fresh = solve(warm.program, warm)
        if not _good(fresh) and fresh.status not in (Status.STOPPED, Status.TIME_LIMIT):
            fresh = solve(warm.program, None)
        found = fresh
        solutions.append(found)
    if rounds[-1].worst <= tolerance and _good(found):
        merged = _merged(found, bounds)
        if merged is not None:
            last = solve(merged.program, merged)
            again = _round(last, bounds)
            if _good(last) and again.worst <= tolerance:
                found = last
                solutions.append(last)
                rounds.append(again)
    return _told(found, solutions, Course(tolerance, tuple(rounds)))


def _good(solution: Solution) -> bool:
    return solution.status in (Status.SOLVED, Status.SADDLE)


def _round(solution: Solution, bounds: Mapping[str, Everywhere]) -> Round:
    excess = solution.certificate.excess
    times = {name: solution.program.constraint(name).block.count for name in bounds}
    infinite = Excess(np.inf, np.nan)
    return Round(times, {n: excess.get(n, infinite) for n in bounds}, solution.objective, solution.iterations)


def _values(program: Program, name: str) -> dict[str, np.ndarray]:
    return program.constraint(name).parameter_values


def _first(program: Program, bounds: Mapping[str, Everywhere], start: object) -> Times:
    """Where bounds are held to begin with: where they were in a start that was exchanged, or near its maxima."""
    if isinstance(start, Solution) and start.exchange is not None:
        before = {c.name: c.times for c in start.program.constraints if c.times is not None}
        if before.keys() >= bounds.keys():
            return {name: before[name] for name in bounds}
    motion = program.design.motion(program.unpack(start_vector(program, start)))
    times = {}
    for name, bound in bounds.items():
        where, heights = bound.peaks(motion, _values(program, name))
        top = float(heights.max())
        near = heights >= min(top, 0.0) - NEAR * (top - float(heights.min()))
        times[name] = where[near]
    return times


def _peaks(solution: Solution, bounds: Mapping[str, Everywhere]) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    motion: Any = solution.motion
    return {name: bound.peaks(motion, _values(solution.program, name)) for name, bound in bounds.items()}


def _pressing(solution: Solution, name: str) -> np.ndarray:
    """(N,) which times of a bound press."""
    sizes = np.abs(solution.program.split(solution.multiplier_vector)[name]).max(axis=1)
    return sizes > IDLE * max(float(sizes.max()), 1e-300)


def _next(
    solution: Solution,
    name: str,
    bound: Everywhere,
    maxima: tuple[np.ndarray, np.ndarray],
    tolerance: float,
    moves: Moves | None,
) -> tuple[Weighted, Moves]:
    """The times of a bound for the next solve with their multipliers to begin with, and how times were moved.

    moves: how they were moved before; None where times stay, and others are added.
    """
    held = solution.program.constraint(name).times
    assert held is not None  # of a bound that is meant for all times
    loads, pressing = solution.program.split(solution.multiplier_vector)[name], _pressing(solution, name)
    (peaks, heights), excess = maxima, solution.certificate.excess[name]
    times, loads = held[pressing], loads[pressing]
    kept, moved, open_ = [], {}, heights > tolerance
    owners = _owners(solution, name, bound, times, peaks, heights)
    for peak in np.unique(owners).tolist():
        few, weights = times[owners == peak], loads[owners == peak]
        if moves is None or not tolerance < heights[peak] < NARROW:
            kept += zip(few, weights, strict=True)
            continue
        open_[peak] = False
        # Another maximum beside the time gives way with it.
        open_ &= ~((np.abs(peaks[:, 0] - few[0, 0]) <= np.abs(peaks[peak, 0] - few[0, 0])) & (heights <= heights[peak]))
        if len(few) > 1:
            share = np.abs(weights).sum(axis=1)
            there, so_far = share @ few / share.sum(), Bracket()
        else:
            so_far = moves.get(float(few[0, 0]), Bracket()).with_point(
                float(few[0, 0]), float(peaks[peak, 0] - few[0, 0])
            )
            there = few[0] + (so_far.next - few[0, 0])
        moved[float(there[0])] = so_far
        kept.append((there, weights.sum(axis=0)))
    if not moved and not open_.any() and not excess.value <= tolerance:
        # Narrower than the samples: the bound knows where.
        kept.append((np.full(held.shape[1], excess.time), np.zeros(loads.shape[1])))
    kept += [(peaks[k], np.zeros(loads.shape[1])) for k in np.flatnonzero(open_)]
    if not kept:
        return (held[:1], np.zeros((1, loads.shape[1]))), {}
    whole, first = np.unique(np.stack([t for t, _ in kept]), axis=0, return_index=True)
    return (whole, np.stack([w for _, w in kept])[first]), moved


def _owners(
    solution: Solution, name: str, bound: Everywhere, times: np.ndarray, peaks: np.ndarray, heights: np.ndarray
) -> np.ndarray:
    """(N,) the maximum that each time (N, s) presses on: the higher of those beside it, as far as none is shut off.

    Where the excess falls below zero between a time and a maximum, they are no matter of each other.
    """
    if not len(times):
        return np.empty(0, dtype=int)
    right = np.clip(np.searchsorted(peaks[:, 0], times[:, 0]), 0, len(peaks) - 1)
    both = np.stack([np.maximum(right - 1, 0), right])
    share = np.arange(1, 8)[:, None, None, None] / 8
    between = times + share * (peaks[both] - times)
    values = _values(solution.program, name)
    excess = bound.excesses(solution.motion, values, between.reshape(-1, times.shape[1]))
    near = np.abs(peaks[both, 0] - times[:, 0])
    linked = (excess.reshape(between.shape[:3]) > 0).all(axis=0)
    worth = np.where(linked, heights[both], -np.inf)
    best, nearest = np.argmax(worth, axis=0), np.argmin(near, axis=0)
    chosen = np.where(linked.any(axis=0), best, nearest)
    return both[chosen, np.arange(len(times))]


def _carried(solution: Solution[DesignT], held: Mapping[str, Weighted]) -> Solution[DesignT]:
    """A start at other times: the solution, with their multipliers in place of its own."""
    program = solution.program.with_times({name: times for name, (times, _) in held.items()})
    parts = solution.program.split(solution.multiplier_vector) | {name: load for name, (_, load) in held.items()}
    whole = np.concatenate([parts[c.name].ravel() for c in program.constraints])
    return replace(solution, program=program, multiplier_vector=whole)


def _merged(solution: Solution[DesignT], bounds: Mapping[str, Everywhere]) -> Solution[DesignT] | None:
    """A start with one time for each contact, None where that is so already."""
    held, fewer = {}, False
    for name, (peaks, _) in _peaks(solution, bounds).items():
        times, pressing = solution.program.constraint(name).times, _pressing(solution, name)
        loads = solution.program.split(solution.multiplier_vector)[name]
        assert times is not None  # of a bound that is meant for all times
        held[name] = times, loads
        if len(peaks) and pressing.any():
            nearest = np.argmin(np.abs(times[pressing][:, :1] - peaks[:, 0]), axis=1)
            contacts, place = np.unique(nearest, return_inverse=True)
            load = np.zeros((len(contacts), loads.shape[1]))
            np.add.at(load, place, loads[pressing])
            held[name] = peaks[contacts], load
            fewer = fewer or len(contacts) < len(times)
    return _carried(solution, held) if fewer else None


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
