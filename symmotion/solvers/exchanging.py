"""Bounds that hold everywhere: solved at some times, which move to where they press, until nothing is exceeded."""

from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import TypeAlias

import numpy as np

from symmotion import checks
from symmotion.program import DesignT, Excess, Program
from symmotion.program.everywhere import Everywhere
from symmotion.program.program import require_program
from symmotion.solvers.held_times import HeldTimes
from symmotion.solvers.reduced import Reduced
from symmotion.solvers.solution import Course, Round, Seconds, Solution, Status
from symmotion.solvers.solver import start_vector
from symmotion.systems import conflict, conflicting

# What solves a program at the times that it holds its bounds, from a start.
Solve: TypeAlias = Callable[[Program[DesignT], object], Solution[DesignT]]
Times: TypeAlias = Mapping[str, np.ndarray]

MOST_ROUNDS = 25
# Of the range of the excess along the start: maxima of it that far inside are held from the beginning.
NEAR = 0.2


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

    Solves with the bounds held at the program's times, or at those of a start that was exchanged; from there on moves
    the times that press to where the excess has its maxima, together with the motion and the multipliers, by Newton's
    method (`Reduced`), adds the maxima that are exceeded there, drops the other times; and solves again from that
    point. Where that does not converge, the maxima are added to the times. Ends where the excess is at most the
    tolerance anywhere, relative to the limit, by a bound where it has one (`Excess.kind`), with one time for each
    contact.

    solve: of a program and a start (None, a Solution of that program, …), a Solution; it holds the bounds at the times
        of the program alone. A solution that is none ends the exchange.
    Returns the last one, with the logs and seconds of all, `exchange` and, in `program`, the times at the end, to
    which its multipliers belong. Where the excess stays above the tolerance it is STALLED, and the message says where.
    Source: Hettich and Kortanek 1993 (exchange and local reduction for semi-infinite programs).

    most_rounds: after which it ends. Raises InputError for a tolerance that is negative.

    >>> from symmotion.solvers import exchange
    >>> keys = sm.examples.random_keyframes(4, 60, seed=1)
    >>> program = sm.orientation_program(keys, constraints=[sm.RateBound(1.2)], refine=2)
    >>> exchange(program, sm.ExactNewton().solve).certified
    True
    """
    bounds = bounds_everywhere(require_program(program))
    if not bounds:
        return solve(program, start)
    checks.not_negative(tolerance, "tolerance")
    solutions = [solve(program.with_times(_known(bounds, start)), start)]
    if solutions[0].status in (Status.STALLED, Status.ITERATION_LIMIT, Status.FAILED):
        # Fewer times leave it more ways.
        solutions.append(solve(program.with_times(_near(program, bounds, start)), start))
    found, rounds, course = solutions[-1], [], HeldTimes(Reduced(program, bounds), bounds, tolerance)
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
    return _told(_conflicting(found, bounds), solutions, Course(tolerance, tuple(rounds)))


def _conflicting(found: Solution[DesignT], bounds: Mapping[str, Everywhere]) -> Solution[DesignT]:
    """What ends without a solution: infeasible where bounds conflict with what is said at breaks, such as keyframes.

    Times that follow the maxima of the excess come ever closer to such a place, and the motion ever wilder.
    """
    program = found.program
    if _good(found) or found.interrupted or found.status is Status.INFEASIBLE:
        return found
    slots = {name: len(np.asarray(program.constraint(name).times)[0]) for name in bounds}
    breaks = {name: np.repeat(bound.breaks()[:, None], slots[name], axis=1) for name, bound in bounds.items()}
    whole = _joined(program, program.with_times(breaks), bounds)
    names = conflicting(whole, found.x)
    return replace(found, status=Status.INFEASIBLE, message=conflict(whole, names)) if names else found


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
        where, heights = bound.peaks(motion, program.constraint(name).parameter_values)
        top = float(heights.max())
        near = heights >= min(top, 0.0) - NEAR * (top - float(heights.min()))
        times[name] = where[near]
    return times


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
        solution = replace(solution, status=Status.STALLED)
        message = f"{message}; {left}" if message else left
    counts = sum((Counter(s.evaluations) for s in every), Counter())
    return replace(solution, log=log, seconds=seconds, exchange=course, message=message, evaluations=dict(counts))


def _total(every: list[Solution[DesignT]], part: str) -> float | None:
    known = [value for value in (getattr(s.seconds, part) for s in every) if value is not None]
    return sum(known) if known else None
