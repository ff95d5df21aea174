"""Solving by the workers of an executor: chunks of programs out, answers back, and what becomes of them on the way."""

import os
import pickle
from collections import deque
from collections.abc import Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Executor, Future, ThreadPoolExecutor, wait
from dataclasses import dataclass, replace
from threading import Thread
from time import perf_counter
from typing import TypeAlias

from symmotion.batches.kin import Kin
from symmotion.errors import InputError, plain
from symmotion.kernels.mapped import available_processors
from symmotion.program import Program
from symmotion.solvers.solution import Solution
from symmotion.solvers.solver import Solver

TASK = 0.25  # seconds that a task should take: long against handing it out, short against the batch
MOST = 64  # programs in a task


@dataclass(frozen=True)
class Failed:
    """A program without a solution, in its place among solutions: its index, the name of the error and what it said.

    >>> class Broken:
    ...     tolerance = 1e-8
    ...
    ...     def solve(self, program, start=None):
    ...         raise sm.SolveError("it broke")
    >>> sm.solve_many([sm.affine_program(sm.examples.quarter_turn())], Broken())[0].message
    'it broke'
    """

    index: int
    error: str
    message: str

    @staticmethod
    def of(index: int, error: BaseException) -> "Failed":
        """What became of the program at this index of a batch, by the error that it raised."""
        return Failed(index, type(error).__name__, plain(error))

    def __repr__(self) -> str:
        return f"Failed(program {self.index}: {self.error}: {self.message})"


# What a task is answered with: of each of its jobs, and the seconds that took.
Answers: TypeAlias = tuple[list[Solution | Failed], float]


@dataclass(frozen=True, eq=False)
class Job:
    """A program of a batch, its place there, and its start."""

    index: int
    program: Program
    start: object = None


def answer(solver: Solver, job: Job, kin: Kin) -> Solution | Failed:
    """The solution of a job, or what was raised instead."""
    try:
        # A start that is a solution of the same program is told by the structure that they share.
        program = kin.adopt(job.program) if job.start is None else job.program
        solution = solver.solve(program, job.start)
        if not isinstance(solution, Solution):
            raise TypeError(f"the solver returned {solution!r:.80} instead of a Solution")
        return _with_program(solution, job.program)
    except Exception as error:
        return Failed.of(job.index, error)


def _answer_all(solver: Solver, jobs: Sequence[Job]) -> Answers:
    """The answers to several jobs, without their programs, and the seconds that took."""
    began, kin = perf_counter(), Kin()
    answers = [_with_program(answer(solver, job, kin), None) for job in jobs]
    return answers, perf_counter() - began


def _answer_pickled(pickled: bytes) -> Answers:
    return _answer_all(*pickle.loads(pickled))


def _with_program(answered: Solution | Failed, program: Program | None) -> Solution | Failed:
    return replace(answered, program=program) if isinstance(answered, Solution) else answered


def own_processes(count: int) -> Executor:
    """An executor of spawned processes that has proved to work; InputError where they do not start.

    count: how many, 1 or more.

    >>> with sm.batches.own_processes(1) as executor:
    ...     executor.submit(abs, -2).result()
    2
    """
    # Here, because they take 10 ms to import.
    from concurrent.futures import ProcessPoolExecutor
    from multiprocessing import current_process, get_context

    if current_process().daemon:
        raise InputError("a daemonic process, such as a Dask worker under a nanny, may not start others: use threads")
    # Spawned, because CasADi and BLAS threads do not survive a fork.
    pool = ProcessPoolExecutor(count, mp_context=get_context("spawn"), initializer=_end_with_parent)
    try:
        pool.submit(os.getpid).result()
    except BrokenExecutor as error:
        raise InputError(
            "the worker processes do not start: put what the script does under if __name__ == '__main__'"
        ) from error
    return pool


def _end_with_parent() -> None:
    """End this process with the one that started it, which may be killed without a word."""

    from multiprocessing import parent_process

    # The queue's other end is open in the workers too: without this they would wait for work for ever.
    def watch() -> None:
        parent = parent_process()
        if parent is not None:
            parent.join()
            os._exit(1)

    Thread(target=watch, daemon=True).start()


class Crew:
    """The workers of an executor, and the jobs that they have; see `solve_many`."""

    def __init__(self, solver: Solver, executor: Executor | int, chunk: int | None, ahead: int):
        self._solver, self._chunk, self._ahead = solver, chunk, ahead
        self._size = 1 if chunk is None else chunk
        self._count = executor if isinstance(executor, int) else available_processors()
        self._executor: Executor = own_processes(executor) if isinstance(executor, int) else executor
        self._own = self._executor if isinstance(executor, int) else None
        self._gathered: list[Job] = []
        self._tasks: dict[Future[Answers], list[Job]] = {}
        self._refused: list[tuple[Job, Solution | Failed]] = []
        self._suspects: deque[Job] = deque()

    def __enter__(self) -> "Crew":
        return self

    def __exit__(self, *_: object) -> None:
        for task in self._tasks:
            task.cancel()
        if self._own is not None:
            self._own.shutdown(cancel_futures=True)

    @property
    def idle(self) -> bool:
        """Whether there is room for another task."""
        return len(self._tasks) < self._ahead

    @property
    def busy(self) -> bool:
        return bool(self._tasks or self._refused or self._suspects)

    def add(self, job: Job) -> None:
        """Take a job, and hand out a task once there are enough for one."""
        self._gathered.append(job)
        if len(self._gathered) >= self._size:
            self.hand_out()

    def hand_out(self) -> None:
        """Hand out what has been gathered."""
        jobs, self._gathered = self._gathered, []
        if jobs:
            self._submit(jobs)

    def collect(self) -> Iterator[tuple[Job, Solution | Failed]]:
        """Wait for a task, and give the answers that there are."""
        if self._tasks and not (self._suspects or self._refused):
            finished, _ = wait(self._tasks, return_when=FIRST_COMPLETED)
            for task in finished:
                if task in self._tasks:
                    yield from self._answers(task)
        while self._suspects:
            job = self._suspects.popleft()
            yield job, self._alone(job)
        while self._refused:
            yield self._refused.pop()

    def _answers(self, task: Future[Answers]) -> Iterator[tuple[Job, Solution | Failed]]:
        jobs = self._tasks.pop(task)
        try:
            answers, seconds = task.result()
        except BrokenExecutor:
            self._suspects.extend(jobs)
            self._replace()
        except Exception as error:
            self._blame(jobs, error)
        else:
            if self._chunk is None and seconds > 0:
                self._size = min(MOST, max(1, round(TASK * len(jobs) / seconds)))
            for job, answered in zip(jobs, answers, strict=True):
                yield job, _with_program(answered, job.program)

    def _submit(self, jobs: list[Job]) -> None:
        try:
            if isinstance(self._executor, ThreadPoolExecutor):
                task = self._executor.submit(_answer_all, self._solver, jobs)
            else:
                task = self._executor.submit(_answer_pickled, self._pickled(jobs))
        except BrokenExecutor:
            self._replace()
            self._submit(jobs)
        except InputError as error:
            self._blame(jobs, error)
        except RuntimeError as error:
            raise InputError(f"{self._executor!r} takes no work: {error}") from error
        else:
            self._tasks[task] = jobs

    def _pickled(self, jobs: list[Job]) -> bytes:
        try:
            return pickle.dumps((self._solver, jobs), protocol=5)
        except Exception as error:  # whatever a class of the user's raises, or pickle for it
            raise InputError(f"cannot be sent to another process ({error}): use threads, or executor=None") from error

    def _blame(self, jobs: list[Job], error: Exception) -> None:
        """What a task of several jobs failed for may be the fault of one: each is tried by itself."""
        if len(jobs) > 1:
            for job in jobs:
                self._submit([job])
        else:
            self._refused.append((jobs[0], Failed.of(jobs[0].index, error)))

    def _replace(self) -> None:
        """Go on with processes of our own; what the broken ones had is suspect."""
        for task, jobs in list(self._tasks.items()):
            if isinstance(task.exception(), BrokenExecutor):
                self._suspects.extend(jobs)
                del self._tasks[task]
        if self._own is not None:
            self._own.shutdown()
        self._executor = self._own = own_processes(self._count)

    def _alone(self, job: Job) -> Solution | Failed:
        """The answer of a process that has nothing else to do: one of the suspects may kill it."""
        try:
            answers, _ = self._executor.submit(_answer_pickled, self._pickled([job])).result()
        except BrokenExecutor:
            self._replace()
            return Failed(job.index, "BrokenProcessPool", "its worker process was killed, twice")
        except Exception as error:
            return Failed.of(job.index, error)
        return _with_program(answers[0], job.program)
