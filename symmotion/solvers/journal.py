"""What a solver writes down as it goes: the rows of its log and its seconds; and what ends it before it is done."""

from collections.abc import Callable
from math import inf
from time import perf_counter
from typing import TypeAlias, TypeVar, TypeVarTuple

from symmotion.program import Program
from symmotion.solvers.solution import Iteration, Seconds, Status

# Called with every row of the log; returning True stops the solver.
Callback: TypeAlias = Callable[[Iteration], bool | None]
# What went wrong, and what to say of it.
Failure: TypeAlias = tuple[Status, str]

T = TypeVar("T")
Arguments = TypeVarTuple("Arguments")


class Journal:
    """The log of one solve and its clocks, which run from when it is made.

    max_iterations: steps before `ending` tells to stop; time_limit: wall-clock seconds before it does;
    callback: called with every row, and where it returns True `ending` tells so too; spent: seconds of the limit that
    solves before it took.
    log: the rows so far; linear: seconds that `timed` has measured.
    """

    def __init__(
        self,
        max_iterations: int,
        time_limit: float | None = None,
        callback: Callback | None = None,
        spent: float = 0.0,
    ):
        self.log: list[Iteration] = []
        self.linear = 0.0
        self._most, self._limit, self._callback, self._spent = max_iterations, time_limit, callback, spent
        self._began = self._since = perf_counter()
        self._compile = self._solve = 0.0
        self._stopped = False

    @property
    def watched(self) -> bool:
        """Whether there is a callback."""
        return self._callback is not None

    @property
    def elapsed(self) -> float:
        """Seconds since the solve began."""
        return perf_counter() - self._began

    @property
    def left(self) -> float:
        """Seconds before the time limit, infinite where there is none."""
        return inf if self._limit is None else self._limit - self._spent - self.elapsed

    def compiled(self) -> None:
        """What came before counts as compilation, what comes after as solving."""
        now = perf_counter()
        self._compile, self._since = self._compile + now - self._since, now

    def solved(self) -> None:
        """What came since `compiled` counts as solving; another stage may be compiled next."""
        now = perf_counter()
        self._solve, self._since = self._solve + now - self._since, now

    @property
    def stopped(self) -> bool:
        """Whether the callback or the clock tells to stop."""
        return self._stopped or self.left <= 0

    def add(self, row: Iteration) -> None:
        """Another row of the log, with its step where one is taken from there."""
        self.log.append(row)
        if self._callback is not None and self._callback(row):
            self._stopped = True

    def ending(self) -> Failure | None:
        """Why no more step is to be taken: the callback, the time or the number of steps; None to go on."""
        if self._stopped:
            return Status.STOPPED, "the callback returned True"
        if self.left <= 0:
            return Status.TIME_LIMIT, f"{self._limit:g} seconds"
        if len(self.log) >= self._most:
            return Status.ITERATION_LIMIT, f"{self._most} iterations"
        return None

    def timed(self, function: Callable[[*Arguments], T], *arguments: *Arguments) -> T:
        """What a function of linear algebra returns, its seconds noted."""
        began = perf_counter()
        result = function(*arguments)
        self.linear += perf_counter() - began
        return result

    def seconds(self, program: Program, evaluate: float | None = None) -> Seconds:
        """The seconds so far; evaluate: those of an `Evaluator` since `compiled`."""
        return Seconds(program.build_seconds, self._compile, self._solve, evaluate, self.linear)
