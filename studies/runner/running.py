"""Running studies, one by one, in several processes or on a cluster, with progress on stderr."""

# Not in __main__: a spawned worker finds functions by their module, and does not import a package's __main__.

import traceback
from collections.abc import Mapping, Sequence
from concurrent.futures import Future, ProcessPoolExecutor, wait
from contextlib import ExitStack
from dataclasses import replace
from functools import partial
from multiprocessing import get_context
from queue import Queue
from time import perf_counter

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TaskID, TextColumn, TimeElapsedColumn

import symmotion as sm
from studies.runner.cluster import cluster
from symmotion.report import Study, StudyOptions, StudyRecord


def run_study(study: Study, options: StudyOptions) -> StudyRecord:
    """The record of one study; an exception in it becomes the record's error."""
    began = perf_counter()
    result, error, trace = None, "", ""
    try:
        result = study.run(options)
    except Exception as exception:
        error = _one_line(exception)
        # Bad input is the user's to mend: where in the code it was noticed does not help.
        trace = "" if isinstance(exception, sm.InputError) else traceback.format_exc()
    seconds = perf_counter() - began
    return StudyRecord(study.name, study.question, study.source, seconds, result, error, trace, study.subject)


def run_all(
    chosen: Sequence[Study], options: StudyOptions, jobs: int, scheduler: str | None = None
) -> list[StudyRecord]:
    """The records of studies in their order, with progress on stderr.

    Run one by one, or in `jobs` processes, or on the Dask cluster whose scheduler has this address. In processes those
    that are to be alone come last, one by one.
    """
    columns = (BarColumn(20), MofNCompleteColumn(), TimeElapsedColumn(), TextColumn("{task.description}", markup=False))
    with ExitStack() as stack:
        # Before the bars: where no cluster answers, nothing has begun.
        executor = None if scheduler is None else stack.enter_context(cluster(scheduler))
        bars = stack.enter_context(Progress(*columns, console=Console(stderr=True)))
        display = _Display(bars, len(chosen))
        if executor is not None:
            return _collect(chosen, {executor.submit(run_study, s, options): s for s in chosen}, display)
        jobs = min(jobs, len(chosen))
        if jobs > 1:
            return _run_parallel(chosen, options, jobs, display)
        records = []
        for study in chosen:
            report = partial(display.step, study.name)
            report("started")
            records.append(run_study(study, replace(options, progress=report)))
            display.finish(records[-1])
        return records


def in_turn(chosen: Sequence[Study]) -> list[list[Study]]:
    """Studies that run at the same time, in the order in which they begin, then each that is to be alone."""
    together = sorted((study for study in chosen if not study.alone), key=lambda study: -study.effort)
    return [together, *([study] for study in chosen if study.alone)]


def _run_parallel(chosen: Sequence[Study], options: StudyOptions, jobs: int, display: "_Display") -> list[StudyRecord]:
    # Spawned, because CasADi and BLAS threads do not survive a fork.
    context = get_context("spawn")
    with context.Manager() as manager, ProcessPoolExecutor(jobs, mp_context=context) as pool:
        steps = manager.Queue()
        records: dict[str, StudyRecord] = {}
        try:
            for group in in_turn(chosen):
                studies_of = {pool.submit(_run_reporting, study, options, steps): study for study in group}
                records |= {record.name: record for record in _collect(group, studies_of, display, steps)}
            return [records[study.name] for study in chosen]
        except BaseException:  # an interrupt: those that have not begun shall not
            pool.shutdown(wait=False, cancel_futures=True)
            raise


def _collect(
    chosen: Sequence[Study],
    studies_of: Mapping[Future[StudyRecord], Study],
    display: "_Display",
    steps: "Queue[tuple[str, str]] | None" = None,
) -> list[StudyRecord]:
    """The records of the studies that were handed out, in the order chosen; steps: what their processes report."""
    records, began, pending = {}, perf_counter(), set(studies_of)
    while pending:
        finished, pending = wait(pending, timeout=0.2)
        while steps is not None and not steps.empty():
            display.step(*steps.get())
        for future in finished:
            record = _record(future, studies_of[future], perf_counter() - began)
            records[record.name] = record
            display.finish(record)
    return [records[study.name] for study in chosen]


def _run_reporting(study: Study, options: StudyOptions, steps: Queue) -> StudyRecord:
    def report(step: str) -> None:
        steps.put((study.name, step))

    report("started")
    return run_study(study, replace(options, progress=report))


def _record(future: Future, study: Study, seconds: float) -> StudyRecord:
    """What a worker returned, or a failure where the worker itself broke down."""
    exception = future.exception()
    if exception is None:
        return future.result()
    error = _one_line(exception)
    return StudyRecord(study.name, study.question, study.source, seconds, None, error, subject=study.subject)


def _one_line(exception: BaseException) -> str:
    return " ".join(f"{type(exception).__name__}: {exception}".split())


class _Display:
    """Progress: studies done of all, and a line for each that is running with its current step."""

    def __init__(self, bars: Progress, count: int):
        self._bars = bars
        self._total = bars.add_task("studies", total=count)
        self._running: dict[str, TaskID] = {}

    def step(self, name: str, step: str) -> None:
        if name not in self._running:
            self._running[name] = self._bars.add_task(name, total=None)
        self._bars.update(self._running[name], description=f"{name}: {step}")

    def finish(self, record: StudyRecord) -> None:
        if record.name in self._running:
            self._bars.remove_task(self._running.pop(record.name))
        self._bars.advance(self._total)
        # Also what a log file shows of the progress, where there is no terminal for bars.
        self._bars.console.print(f"{record.name}: {record.status}, {record.seconds:.1f} s", highlight=False)
