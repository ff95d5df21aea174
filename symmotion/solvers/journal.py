"""What a solver writes down as it goes: the rows of its log and its seconds; and what ends it before it is done."""

import sys
from collections.abc import Callable
from math import inf
from multiprocessing import parent_process
from threading import current_thread, main_thread
from time import perf_counter
from typing import TypeAlias, TypeVar, TypeVarTuple

from symmotion import interrupts
from symmotion.program import Program
from symmotion.solvers.solution import Iteration, Seconds, Status

# Called with every row of the log; returning True stops the solver.
Callback: TypeAlias = Callable[[Iteration], bool | None]
# What went wrong, and what to say of it.
Failure: TypeAlias = tuple[Status, str]

# Seconds after which a solve tells how it goes, where somebody is likely to watch, and between two lines of it.
PATIENCE, PAUSE = 2.0, 0.5

T = TypeVar("T")
Arguments = TypeVarTuple("Arguments")


class Journal:
    """The log of one solve and its clocks, which run from when it is made.

    max_iterations: steps before `ending` tells to stop; time_limit: wall-clock seconds before it does;
    callback: called with every row, and where it returns True `ending` tells so too; spent: seconds of the limit that
    solves before it took.
    A solve of more than two seconds shows its last row on stderr, where that is a terminal, until it ends.
    log: the rows so far; linear: seconds that `timed` has measured.

    >>> from symmotion.solvers import Iteration, Journal
    >>> journal = Journal(100, callback=lambda row: row.objective < 1.0)
    >>> journal.add(Iteration(0.5, 1e-3, 0.0))
    >>> journal.stopped
    True
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
        # What a descent that leads to nothing of use ends with.
        self.vain: Failure | None = None
        # Of several solves at once only one could be seen.
        alone = current_thread() is main_thread() and parent_process() is None
        self._shown = alone and sys.stderr is not None and sys.stderr.isatty()
        self._next = PATIENCE

    def __repr__(self) -> str:
        return f"Journal({len(self.log)} rows)"

    @property
    def watched(self) -> bool:
        """Whether somebody wants the rows as they come."""
        return self._callback is not None or self._shown

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
        if self._next > PATIENCE:
            _show("")
            self._next = PATIENCE

    @property
    def stopped(self) -> bool:
        """Whether the callback or the clock tells to stop."""
        return self._stopped or self.left <= 0

    def add(self, row: Iteration) -> None:
        """Another row of the log, with its step where one is taken from there."""
        self.log.append(row)
        if self._shown and self.elapsed >= self._next:
            self._next = self.elapsed + PAUSE
            told = f"{self.elapsed:.1f} s, iteration {len(self.log)}: objective {row.objective:.6g}"
            _show(f"{told}, stationarity {row.stationarity:.1e}, violation {row.violation:.1e}")
        if self._callback is not None:
            with interrupts.raised():
                self._stopped = bool(self._callback(row)) or self._stopped

    def ending(self) -> Failure | None:
        """Why no more step is to be taken: the callback, the time or the number of steps; None to go on.

        Raises what a signal's handler raised meanwhile, such as KeyboardInterrupt.
        """
        interrupts.step()
        if self._stopped:
            return Status.STOPPED, "the callback returned True"
        if self.left <= 0:
            return Status.TIME_LIMIT, f"{self._limit:g} seconds"
        if len(self.log) >= self._most:
            return Status.ITERATION_LIMIT, f"{self._most} iterations"
        return self.vain

    def timed(self, function: Callable[[*Arguments], T], *arguments: *Arguments) -> T:
        """What a function of linear algebra returns, its seconds noted."""
        began = perf_counter()
        result = function(*arguments)
        self.linear += perf_counter() - began
        return result

    def seconds(self, program: Program, evaluate: float | None = None) -> Seconds:
        """The seconds so far; evaluate: those of an `Evaluator` since `compiled`."""
        return Seconds(program.build_seconds, self._compile, self._solve, evaluate, self.linear)


def _show(text: str) -> None:
    """Write over the terminal's last line."""
    sys.stderr.write(f"\r\x1b[2K{text}")
    sys.stderr.flush()
