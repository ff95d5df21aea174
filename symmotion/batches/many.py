"""Many programs: solved in this process, in others or on a cluster, in order, and a failure is a value among them."""

from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Executor
from contextlib import ExitStack
from dataclasses import dataclass
from numbers import Real
from pathlib import Path
from time import perf_counter
from typing import TypeAlias

from symmotion.batches.fingerprint import fingerprint
from symmotion.batches.kin import Kin
from symmotion.batches.results_file import ResultsFile
from symmotion.batches.workers import Crew, Failed, Job, answer
from symmotion.checks import file_path, told, whole
from symmotion.errors import InputError
from symmotion.program import Program
from symmotion.solvers.newton import ExactNewton
from symmotion.solvers.solution import Solution, Status
from symmotion.solvers.solver import Solver, require_solver

NEWTON = ExactNewton()
# A program, alone or beside its start.
Asked: TypeAlias = Program | tuple[Program, object]
# Answers that may wait for an earlier one before no more programs are taken.
WAITING = 4096
MOST_PROCESSES = 4096


@dataclass(frozen=True)
class Tally:
    """How far a batch is: programs answered, of them found in the results file, and failed; wall-clock seconds.

    >>> program = sm.affine_program(sm.examples.quarter_turn())
    >>> solutions = sm.solve_many([program], progress=lambda tally: print(tally.done, tally.failed))
    1 0
    """

    done: int
    found: int
    failed: int
    seconds: float

    def __repr__(self) -> str:
        rate = (self.done - self.found) / self.seconds if self.seconds else 0.0
        return f"{self.done} programs, {self.found} found, {self.failed} failed, {rate:.3g} solved a second"


def solve_many(
    programs: Iterable[Asked],
    solver: Solver = NEWTON,
    executor: Executor | int | None = None,
    *,
    results: str | Path | None = None,
    retry: bool = False,
    progress: Callable[[Tally], None] | None = None,
    chunk: int | None = None,
    ahead: int = 64,
) -> list[Solution | Failed]:
    """Solve programs one by one or by the workers of an executor: solutions in the programs' order.

    The same numbers, bit for bit, whatever the executor and the number of its workers, on machines
    and BLAS settings that are alike. Programs that differ in their data only share what is derived from their
    structure, as those of `with_keyframes` do.

    programs: or pairs of a program and its start, as `solver.solve` takes it; may be a generator, which
        is read only as far as work is handed out.
    solver: of this library, or any object with `solve(program, start)` and a repr that tells its options.
    executor: None for this process; a number of processes of our own; or a
        `concurrent.futures` executor: threads, processes, `distributed.Client.get_executor()`.
        Threads share the programs, all others get them as pickles.
    results: a file to which every solution is appended, also one that did not solve. Programs found in it are not
        solved again, so that a batch goes on where it was killed; see `ResultsFile`. What a callback or the
        time limit has interrupted is not put into it.
    retry: solve those programs again that the file has an answer to, but no solution; the new answer counts.
    progress: called with a `Tally` after every program, in this process; `print` will do.
    chunk: programs in one task; when left out, as many as take a quarter of a second.
    ahead: tasks handed out at a time: on a cluster, two or more for each thread of a worker.

    A program whose solver raises, or that kills its worker twice, becomes a `Failed` in its
    place. Where a worker process was killed and with it the executor, its work goes on in processes of our own.
    Raises InputError for what is no program, and for a results file that cannot be used.

    >>> keys = sm.examples.planar_keyframes()
    >>> program = sm.affine_program(keys)
    >>> programs = [program.with_keyframes(keys.moved(1, linear=size * keys.linear[1])) for size in (0.9, 1.0, 1.1)]
    >>> [solution.certified for solution in sm.solve_many(programs)]
    [True, True, True]
    """
    answers = solve_each(
        programs, solver, executor, results=results, retry=retry, progress=progress, chunk=chunk, ahead=ahead
    )
    return list(answers)


def solve_each(
    programs: Iterable[Asked],
    solver: Solver = NEWTON,
    executor: Executor | int | None = None,
    *,
    results: str | Path | None = None,
    retry: bool = False,
    progress: Callable[[Tally], None] | None = None,
    chunk: int | None = None,
    ahead: int = 64,
) -> Iterator[Solution | Failed]:
    """The solutions of `solve_many`, each as soon as it and those before it are there, and none of them kept.

    Arguments, and InputError, as for `solve_many`.

    programs, solver, executor, results, retry, progress, chunk, ahead: as there.

    >>> program = sm.affine_program(sm.examples.quarter_turn())
    >>> [solution.certified for solution in sm.batches.solve_each([program])]
    [True]
    """
    if isinstance(programs, Program):
        raise InputError("one program where several are needed: solve_many([program]), or solver.solve(program)")
    if not isinstance(programs, Iterable):
        raise InputError(f"programs {programs!r}: an iterable of programs is needed")
    require_solver(solver)
    if results is not None:
        file_path(results, "results")
    if progress is not None and not callable(progress):
        raise InputError(f"progress {told(progress)}: a function of a Tally is needed")
    if results is not None and type(solver).__repr__ is object.__repr__:
        raise InputError(f"solver {solver!r}: with a results file its repr has to tell its options, write a __repr__")
    if isinstance(executor, Real):
        executor = whole(executor, 1, "executor", " of processes", most=MOST_PROCESSES)
    elif not (executor is None or callable(getattr(executor, "submit", None))):
        raise InputError(
            f"executor {executor!r}: None, a number of processes or a concurrent.futures executor is needed"
        )
    chunk = None if chunk is None else whole(chunk, 1, "chunk", " of programs")
    ahead = whole(ahead, 1, "ahead", " of tasks")
    if not isinstance(retry, bool) or (retry and results is None):
        raise InputError(f"retry {told(retry)}: True or False is needed, and with True a results file")
    return _solve(programs, solver, executor, results, retry, progress, chunk, ahead)


def _solve(
    programs: Iterable[Asked],
    solver: Solver,
    executor: Executor | int | None,
    results: str | Path | None,
    retry: bool,
    progress: Callable[[Tally], None] | None,
    chunk: int | None,
    ahead: int,
) -> Iterator[Solution | Failed]:
    with ExitStack() as stack:
        file = None if results is None else stack.enter_context(ResultsFile(results))
        batch = _Batch(solver, file, retry, progress)
        jobs = batch.jobs(programs)
        if executor is None:
            kin = Kin()
            for job in jobs:
                if job.index not in batch.answers:
                    batch.take(job, answer(solver, job, kin))
                yield from batch.in_order()
            return
        crew = stack.enter_context(Crew(solver, executor, chunk, ahead))
        exhausted = False
        while True:
            while not exhausted and crew.idle and len(batch.answers) < WAITING:
                job = next(jobs, None)
                exhausted = job is None
                if job is not None and job.index not in batch.answers:
                    crew.add(job)
            if exhausted or len(batch.answers) >= WAITING:
                crew.hand_out()  # also where all the others wait for what is gathered
            if crew.busy:
                for job, answered in crew.collect():
                    batch.take(job, answered)
            yield from batch.in_order()
            if exhausted and not crew.busy:
                return


class _Batch:
    """What a batch has answered so far, and keeps until it is its turn; the file and the tally with it."""

    def __init__(self, solver: Solver, file: ResultsFile | None, retry: bool, progress: Callable[[Tally], None] | None):
        self._solver, self._file, self._retry, self._progress = solver, file, retry, progress
        self._began = perf_counter()
        self._done = self._found = self._failed = self._next = 0
        self._names: dict[int, str] = {}
        self.answers: dict[int, Solution | Failed] = {}

    def jobs(self, programs: Iterable[Asked]) -> Iterator[Job]:
        """The programs as jobs; those that the file knows, or that cannot be, are answered at once."""
        for index, given in enumerate(programs):
            program, start = given if isinstance(given, tuple) and len(given) == 2 else (given, None)
            if not isinstance(program, Program):
                raise InputError(f"program {index} is {given!r}: a Program, or a pair of one and its start, is needed")
            job = Job(index, program, start)
            if self._file is not None:
                try:
                    name = fingerprint(program, self._solver, start)
                except InputError as error:  # of a start that does not fit
                    self.take(job, Failed.of(index, error))
                else:
                    found = self._file.find(name, program)
                    if found is None or (self._retry and found.status is not Status.SOLVED):
                        self._names[index] = name
                    else:
                        self._found += 1
                        self.take(job, found)
            yield job

    def take(self, job: Job, answered: Solution | Failed) -> None:
        """Note the answer to a job, in the file too."""
        name = self._names.pop(job.index, None)
        if isinstance(answered, Solution) and self._file is not None and name is not None:
            self._file.add(name, answered)
        self.answers[job.index] = answered
        self._done += 1
        self._failed += isinstance(answered, Failed)
        if self._progress is not None:
            self._progress(Tally(self._done, self._found, self._failed, perf_counter() - self._began))

    def in_order(self) -> Iterator[Solution | Failed]:
        """The answers whose turn it is, which are given up here."""
        while self._next in self.answers:
            self._next += 1
            yield self.answers.pop(self._next - 1)
