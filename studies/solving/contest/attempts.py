"""One solver on one problem from one start, again and again: what a comparison is made of."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from time import process_time
from typing import Any

import numpy as np

import symmotion as sm
from symmotion.program import Program

SAME = 1e-6  # relative difference up to which two values are the same minimum
SPREAD = 0.3  # of random starts about a program's own, in its own units
PATIENCE = 20.0  # seconds of one solve


@dataclass(frozen=True)
class Task:
    """A problem: name, family, the seed of its random starts, and the best value known, ∞ where none is."""

    name: str
    family: str
    seed: int
    make: Callable[[], Program] = field(repr=False)
    best: float = np.inf


@dataclass(frozen=True)
class Contender:
    """A solver and how it is called. Any: solvers of all kinds, whose options are theirs."""

    name: str
    solver: Any


@dataclass(frozen=True)
class Budget:
    """Starts of every contender on a problem: so many at least, and on until some CPU seconds are used, or `most`."""

    starts: int = 1
    seconds: float = 0.0
    most: int = 1


@dataclass(frozen=True)
class Attempt:
    """A solve.

    certified: whether symmotion's certificate holds at the point to the solver's tolerance, with a positive definite
    Hessian; claimed: whether the solver says so of itself; seconds: of CPU, without building the program and deriving
    its functions; evaluations: of the program's functions and derivatives, each for all nodes, hessians: of that these.
    """

    problem: str
    family: str
    method: str
    start: int
    certified: bool
    claimed: bool
    objective: float
    seconds: float
    evaluations: int
    hessians: int
    iterations: int


@dataclass(frozen=True, eq=False)
class Contest:
    """All attempts, and the best value known of every problem: the least certified one."""

    attempts: tuple[Attempt, ...]
    best: Mapping[str, float]
    solutions: tuple[tuple[str, str, sm.Solution], ...] = ()

    @property
    def methods(self) -> list[str]:
        return list(dict.fromkeys(a.method for a in self.attempts))

    @property
    def problems(self) -> list[str]:
        return list(dict.fromkeys(a.problem for a in self.attempts))

    @property
    def families(self) -> list[str]:
        return list(dict.fromkeys(a.family for a in self.attempts))

    def of(self, method: str, starts: int = 1, family: str | None = None) -> dict[str, list[Attempt]]:
        """By problem, the first attempts of a method from as many starts."""
        found: dict[str, list[Attempt]] = {}
        for a in self.attempts:
            if a.method == method and a.start < starts and family in (None, a.family):
                found.setdefault(a.problem, []).append(a)
        return found

    def reached(self, attempt: Attempt) -> bool:
        """Whether it is certified and as low as the best value known."""
        return attempt.certified and alike(attempt.objective, self.best[attempt.problem])


def alike(value: float, least: float) -> bool:
    """Whether a value is as low as the least one, to SAME."""
    return value <= least + SAME * abs(least) + 1e-12


def start_of(program: Program, seed: int, number: int) -> np.ndarray | None:
    """A start, the same for all: the program's own (None) is the first, noise about it the others."""
    if number == 0:
        return None
    noise = np.random.default_rng([seed, number]).normal(size=program.unknowns)
    return program.x0 + SPREAD * program.unit * noise


def contend(
    tasks: Iterable[Task],
    contenders: Sequence[Contender],
    budget: Budget,
    progress: Callable[[str], None] = lambda _: None,
    keep: bool = False,
) -> Contest:
    """Every contender on every task; those that do not take a problem have no attempts on it.

    keep: whether the solutions from the programs' own starts are kept.
    """
    attempts: list[Attempt] = []
    best, kept = {}, []
    for task in tasks:
        progress(task.name)
        program = task.make()
        for contender in contenders:
            if not _takes(contender.solver, program):
                continue
            spent, number = 0.0, 0
            while number < budget.starts or (spent < budget.seconds and number < budget.most):
                attempt, solution = _attempt(task, program, contender, number)
                attempts.append(attempt)
                spent, number = spent + attempt.seconds, number + 1
                if keep and number == 1:
                    kept.append((task.name, contender.name, solution))
        values = [a.objective for a in attempts if a.problem == task.name and a.certified]
        best[task.name] = min([task.best, *values])
    return Contest(tuple(attempts), best, tuple(kept))


def _takes(solver: Any, program: Program) -> bool:
    """Whether a solver takes a program. One step of it: functions are derived before anything is timed."""
    try:
        replace(solver, max_iterations=1).solve(program)
    except sm.InputError:
        return False
    return True


def _attempt(task: Task, program: Program, contender: Contender, number: int) -> tuple[Attempt, sm.Solution]:
    start = start_of(program, task.seed, number)
    began = process_time()
    solution = contender.solver.solve(program, start)
    seconds = process_time() - began
    c, counts = solution.certificate, solution.evaluations
    certified = c.holds(solution.tolerance) and c.inertia == "positive"
    attempt = Attempt(
        task.name,
        task.family,
        contender.name,
        number,
        certified,
        solution.claimed,
        solution.objective,
        seconds,
        sum(counts.values()),
        counts.get("hessian", 0),
        solution.iterations,
    )
    return attempt, solution
