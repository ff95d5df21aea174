"""Bounds that hold everywhere: solved at few times, which move to where the bounds press, until nothing is exceeded."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any, TypeAlias

import numpy as np

from symmotion import checks
from symmotion.program import DesignT, Excess, Program
from symmotion.program.everywhere import Everywhere
from symmotion.solvers.solution import Course, Round, Seconds, Solution, Status
from symmotion.solvers.solver import start_vector

# What solves a program at the times that it holds its bounds, from a start.
Solve: TypeAlias = Callable[[Program[DesignT], object], Solution[DesignT]]
Times: TypeAlias = Mapping[str, np.ndarray]

MOST_ROUNDS = 15
# Of the range of the excess along the start: maxima of it that far inside are held from the beginning.
NEAR = 0.2
# The share of the largest multiplier below which a bound does not press.
IDLE = 1e-7
# By how much a round lowers the excess where moving times to the maxima converges.
FALLS = 0.5


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
    bounds = bounds_everywhere(program)
    if not bounds:
        return solve(program, start)
    checks.not_negative(tolerance, "tolerance")
    current = program.with_times(_first(program, bounds, start))
    found, rounds, moving = solve(current, start), [], True
    solutions = [found]
    while True:
        rounds.append(_round(found, bounds))
        if rounds[-1].worst <= tolerance or not _good(found) or len(rounds) >= most_rounds:
            break
        moving = moving and (len(rounds) < 3 or rounds[-1].worst <= FALLS * rounds[-2].worst)
        peaks = _peaks(found, bounds)
        times = {name: _next(found, name, *peaks[name], tolerance, moving) for name in bounds}
        warm = _carried(found, times)
        fresh = solve(warm.program, warm)
        if not _good(fresh) and fresh.status not in (Status.STOPPED, Status.TIME_LIMIT):
            fresh = solve(warm.program, None)
        found = fresh
        solutions.append(found)
    if rounds[-1].worst <= tolerance and _good(found):
        merged = _merged(found, bounds, tolerance)
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
        before = {c.name: c.times for c in start.program.constraints}
        if all(before.get(name) is not None for name in bounds):
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
    solution: Solution, name: str, peaks: np.ndarray, heights: np.ndarray, tolerance: float, moving: bool
) -> np.ndarray:
    """The times of a bound for the next solve."""
    held = solution.program.constraint(name).times
    assert held is not None  # of a bound that is meant for all times
    higher = heights > tolerance
    worst = solution.certificate.excess[name]
    kept = held[_pressing(solution, name)]
    added = peaks[higher]
    if not higher.any() and worst.value > tolerance:
        # Narrower than the samples: the bound knows where.
        added = np.full((1, held.shape[1]), worst.time)
    if moving and len(kept) and len(peaks):
        nearest = np.argmin(np.abs(kept[:, :1] - peaks[:, 0]), axis=1)
        kept = kept[~higher[nearest]]
    times = np.unique(np.concatenate([kept, added]), axis=0)
    return times if len(times) else held[:1]


def _carried(solution: Solution[DesignT], times: Times, weights: Mapping[str, np.ndarray] | None = None):
    """A start at other times: the solution, with the multipliers of times that stay."""
    program = solution.program.with_times(times)
    old, parts = solution.program.split(solution.multiplier_vector), []
    for c, before in zip(program.constraints, solution.program.constraints, strict=True):
        if c.name not in times or c.times is None or before.times is None:
            parts.append(old[c.name].ravel())
            continue
        if weights is not None and c.name in weights:
            parts.append(weights[c.name].ravel())
            continue
        same = (c.times[:, None] == before.times[None]).all(axis=2)
        parts.append((same.astype(float) @ old[c.name]).ravel())
    return replace(solution, program=program, multiplier_vector=np.concatenate(parts))


def _merged(solution: Solution[DesignT], bounds: Mapping[str, Everywhere], tolerance: float):
    """A start with one time for each contact, None where that is so already."""
    times, weights, fewer = {}, {}, False
    for name, (peaks, _) in _peaks(solution, bounds).items():
        held, pressing = solution.program.constraint(name).times, _pressing(solution, name)
        multipliers = solution.program.split(solution.multiplier_vector)[name]
        if held is None or not len(peaks) or not pressing.any():
            times[name], weights[name] = held, multipliers
            continue
        nearest = np.argmin(np.abs(held[pressing][:, :1] - peaks[:, 0]), axis=1)
        contacts, place = np.unique(nearest, return_inverse=True)
        times[name], weights[name] = peaks[contacts], np.zeros((len(contacts), multipliers.shape[1]))
        np.add.at(weights[name], place, multipliers[pressing])
        fewer = fewer or len(contacts) < len(held)
    return _carried(solution, times, weights) if fewer else None


def _told(solution: Solution[DesignT], every: list[Solution[DesignT]], course: Course) -> Solution[DesignT]:
    """The solution with what all solves took."""
    seconds = Seconds(
        solution.program.build_seconds,
        *(_total(every, part) for part in ("compile", "solve", "evaluate", "linear")),
    )
    log, message = tuple(row for s in every for row in s.log), solution.message
    if not course.holds:
        worst = max(course.after.items(), key=lambda item: item[1].value)
        left = f"{worst[0]} is exceeded by {worst[1].value:.2g} ({worst[1].kind}) between its times"
        message = f"{message}; {left}" if message else left
    return replace(solution, log=log, seconds=seconds, exchange=course, message=message)


def _total(every: list[Solution[DesignT]], part: str) -> float | None:
    known = [value for value in (getattr(s.seconds, part) for s in every) if value is not None]
    return sum(known) if known else None
