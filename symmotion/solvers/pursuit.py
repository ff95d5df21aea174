"""Descents from lower points that a run has met on its way, or where it failed, than the best minimum that is known."""

from collections.abc import Sequence
from dataclasses import dataclass, fields, is_dataclass, replace
from typing import NamedTuple

import numpy as np

from symmotion.program import Program
from symmotion.solvers.minima import margin
from symmotion.solvers.newton import ExactNewton
from symmotion.solvers.solution import Solution, Status
from symmotion.solvers.solver import Solver
from symmotion.systems import largest

# A run that is asked for the point of a row of its log again comes there where the objective is the same.
AGAIN = 1e-9


@dataclass(frozen=True, eq=False)
class Run:
    """A solver, and what it made of the program."""

    solver: Solver
    solution: Solution


class Point(NamedTuple):
    """A feasible point that a run has met: after so many steps, None where it ended."""

    objective: float
    run: int
    steps: int | None


class Pursuit(NamedTuple):
    """What came of lower points.

    descents: by ExactNewton, named for the runs that met where they began; left: method and objective of lower points
    from which no minimum was certified.
    """

    descents: tuple[Solution, ...]
    left: tuple[tuple[str, float], ...]


def pursue(program: Program, runs: Sequence[Run], start: object) -> Pursuit:
    """Descend from the lowest point that a run has met below all minima, until none is left; from each run once."""
    descents: list[Solution] = []
    left: list[tuple[str, float]] = []
    tried: set[int] = set()
    while (best := _lowest([*(r.solution for r in runs), *descents])) is not None:
        below = best.objective - margin(best)
        points = [p for k, run in enumerate(runs) if k not in tried for p in _met(k, run.solution, below, best)]
        if not points:
            return Pursuit(tuple(descents), tuple(p for p in left if p[1] < below))
        # Where it ended, of which the point is at hand, before the row of the log that is the same.
        point = min(points, key=lambda p: (p.objective, p.steps is not None))
        tried.add(point.run)
        run = runs[point.run]
        x = run.solution.x if point.steps is None else _place(program, run, point.steps, point.objective, start)
        found = None if x is None else ExactNewton(tolerance=run.solver.tolerance).solve(program, x)
        if found is not None:
            descents.append(replace(found, method=f"{found.method} from {run.solution.method}"))
        if found is None or not found.certified:
            left.append((run.solution.method, point.objective))
    return Pursuit((), ())


def _lowest(solutions: Sequence[Solution]) -> Solution | None:
    return min((s for s in solutions if s.status is Status.SOLVED), key=lambda s: s.objective, default=None)


def _met(number: int, s: Solution, below: float, best: Solution) -> list[Point]:
    """The lowest feasible points of a run: of its log, and its end."""
    found = []
    feasible = s.exchange is None or s.exchange.holds
    if feasible and s.certificate.missed <= s.tolerance and s.objective < below:
        found.append(Point(s.objective, number, None))
    if s.exchange is None:  # else its rows are of programs with fewer bounds
        enough = s.tolerance * (1.0 + largest(best.x))
        rows = [Point(r.objective, number, k) for k, r in enumerate(s.log) if r.violation <= enough]
        found += sorted((p for p in rows if p.objective < below), key=lambda p: p.objective)[:1]
    return found


def _place(program: Program, run: Run, steps: int, objective: float, start: object) -> np.ndarray | None:
    """(unknowns,) where a run was after so many steps, by running it that far; None where it does not come there."""
    # One of another class cannot be told to stop earlier, and tells no points.
    solver = run.solver
    if not is_dataclass(solver) or isinstance(solver, type) or all(f.name != "max_iterations" for f in fields(solver)):
        return None
    there = replace(solver, max_iterations=steps).solve(program, start)
    again = abs(there.objective - objective) <= AGAIN * abs(objective)
    return there.x if again and there.certificate.missed <= run.solver.tolerance else None
