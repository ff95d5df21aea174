"""Many small programs: how many motions a second, by which way of solving them, and what it costs in memory."""

import pickle
import tempfile
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import astuple, dataclass
from functools import partial
from hashlib import blake2b
from multiprocessing import current_process
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np

import symmotion as sm
from studies.solving.small_motions import MAKERS, growth, memory_over, moved_programs, new_programs
from symmotion.batches import own_processes, solve_each, solve_many
from symmotion.report import Column, Figure, Run, Study, StudyOptions, StudyResult, Table, to_figure
from symmotion.views import COLOURS, new_figure

WORKERS = 2
SHOWN = 5  # runs in the report, of programs that are all alike
CHUNK = 64


@dataclass(frozen=True, eq=False)
class Way:
    """One way of solving a batch, and whether its numbers are those of the loop.

    marks: a digest of every solution; parts: (6,) means of `Seconds` and of the iterations.
    """

    name: str
    programs: str
    seconds: float
    count: int
    marks: tuple[bytes, ...]
    same: bool
    certified: int
    parts: np.ndarray

    @property
    def rate(self) -> float:
        return self.count / self.seconds


def by_loop(programs: Iterable[sm.program.Program]) -> Iterator[sm.Solution]:
    return (sm.ExactNewton().solve(program) for program in programs)


def run(options: StudyOptions) -> StudyResult:
    count = 10_000 if options.full else 40
    ways, notes = _ways(count, options)
    options.progress("sizes")
    first = list(by_loop(moved_programs(SHOWN)))
    sizes = _sizes(first)
    options.progress("memory")
    memory = memory_over(count)
    figures = [_rates_figure(ways)]
    if memory:
        figures.append(_memory_figure(memory))
    else:
        notes.append("The memory of a process is read from /proc/self/statm, which this system does not have.")
    moved = next(w for w in ways if w.name == "loop" and w.programs == "moved")
    tables = (_ways_table(ways), _parts_table(moved.parts), _sizes_table(sizes), _memory_table(memory))
    runs = tuple(Run.of(f"moved program {k}", s) for k, s in enumerate(first))
    best, text = max(ways, key=lambda w: w.rate), _conclusion(ways, moved, sizes, memory)
    grows = f", and memory grows by {max(0.0, *map(growth, memory.values())):.0f} bytes a solve" if memory else ""
    answer = (
        f"A loop solves {ways[0].rate:.0f} programs of four keyframes a second, {moved.rate:.0f} where keyframes are "
        f"moved, the fastest way, {best.name}, {best.rate:.0f}{grows}."
    )
    return StudyResult(tables, tuple(figures), runs, text, tuple(notes), answer=answer)


def _ways(count: int, options: StudyOptions) -> tuple[list[Way], list[str]]:
    """All ways, the loop over new programs first, and notes on what could not be measured."""
    ways: list[Way] = []
    measure = partial(_measure, ways, count, options)
    for kind, make in MAKERS.items():
        list(by_loop(make(2)))  # the kernels' derivatives are made at the first use, once for all ways
        measure("loop", kind, by_loop)
        measure("solve_many", kind, solve_each)
        with ThreadPoolExecutor(WORKERS) as threads:
            measure(f"{WORKERS} threads", kind, partial(solve_each, executor=threads))
    if current_process().daemon:
        return ways, ["Worker processes are left out: a worker of a cluster may have none of its own."]
    with own_processes(WORKERS) as processes:
        solve_many(new_programs(8 * WORKERS), executor=processes, chunk=1)
        for kind in MAKERS:
            measure(f"{WORKERS} processes", kind, partial(solve_each, executor=processes))
    return ways, []


def _measure(
    ways: list[Way],
    count: int,
    options: StudyOptions,
    name: str,
    kind: str,
    solve: Callable[[Iterable[sm.program.Program]], Iterable[Any]],
) -> None:
    """Append a way, compared with the first one of the same programs; no solution is kept."""
    options.progress(f"{name}, {kind} programs")
    marks, certified, parts = [], 0, []
    began = perf_counter()
    for answer in solve(MAKERS[kind](count)):
        if isinstance(answer, sm.Solution):
            certified += answer.status is sm.solvers.Status.SOLVED and answer.inertia == "positive"
            marks.append(_mark(answer))
            parts.append((*astuple(answer.seconds), answer.iterations))
    seconds = perf_counter() - began
    wanted = next((w.marks for w in ways if w.programs == kind), marks)
    ways.append(
        Way(
            name,
            kind,
            seconds,
            count,
            tuple(marks),
            len(marks) == count and marks == list(wanted),
            certified,
            np.mean(parts, axis=0),
        )
    )


def _mark(solution: sm.Solution) -> bytes:
    """The digest of all numbers of a solution, times aside."""
    numbers = solution.x.tobytes(), solution.multiplier_vector.tobytes(), repr(solution.certificate).encode()
    return blake2b(b"".join(numbers), digest_size=16).digest()


def _sizes(few: list[sm.Solution]) -> dict[str, float]:
    """Bytes per program: pickles of one and of a task's worth, and a line of the results file."""
    sizes = {}
    for kind, make in MAKERS.items():
        for number in (1, CHUNK):
            pickled = pickle.dumps(list(make(number)), protocol=5)
            sizes[f"pickle, {kind}, {number} to a task"] = len(pickled) / number
    with tempfile.TemporaryDirectory() as directory:
        path = Path(directory) / "results"
        solve_many([s.program for s in few], results=path)
        sizes["line of the results file"] = path.stat().st_size / len(few)
    return sizes


def _ways_table(ways: list[Way]) -> Table:
    columns = (
        Column("way"),
        Column("programs"),
        Column("time", "s"),
        Column("motions per second", "1/s"),
        Column("ratio"),
        Column("certified"),
        Column("same bits"),
    )
    rows = tuple((w.name, w.programs, w.seconds, w.rate, w.rate / ways[0].rate, w.certified, w.same) for w in ways)
    caption = (
        f"{ways[0].count:,} motions each. Ratio: to the loop over new programs. Same bits: minimisers, multipliers and "
        "certificates are those of the loop over the same programs. Processes are started beforehand."
    )
    return Table("throughput", columns, rows, caption)


def _parts_table(parts: np.ndarray) -> Table:
    labels = (
        "with_keyframes",
        "setting up the solver",
        "solving",
        "of that: kernels, gathering and scattering",
        "of that: factorisations and solutions",
    )
    rows = tuple((label, 1e3 * part) for label, part in zip(labels, parts, strict=False))
    caption = "Of one motion in the loop over moved programs. The certificate comes on top."
    return Table("where the time of a small problem goes", (Column("part"), Column("mean time", "ms")), rows, caption)


def _sizes_table(sizes: dict[str, float]) -> Table:
    rows = tuple((name, size / 1e3) for name, size in sizes.items())
    return Table("bytes per program", (Column("what"), Column("size", "kB")), rows)


def _memory_table(memory: dict[str, list[tuple[int, float]]]) -> Table:
    columns = (Column("programs"), Column("solves"), Column("at the end", "MB"), Column("growth per solve", "bytes"))
    rows = tuple((kind, rows[-1][0], rows[-1][1], growth(rows)) for kind, rows in memory.items())
    return Table("resident memory", columns, rows, "Growth after the first tenth of the solves.")


def _rates_figure(ways: list[Way]) -> Figure:
    with new_figure(7.0, 2.8) as figure:
        axes = figure.subplots()
        names = list(dict.fromkeys(w.name for w in ways))
        for k, kind in enumerate(MAKERS):
            chosen = [w for w in ways if w.programs == kind]
            places = [names.index(w.name) + 0.38 * (k - 0.5) for w in chosen]
            bars = axes.barh(places, [w.rate for w in chosen], 0.36, color=COLOURS[k], label=f"{kind} programs")
            axes.bar_label(bars, fmt="%.0f", padding=3, fontsize=8)
        axes.set_yticks(range(len(names)), names)
        axes.invert_yaxis()
        axes.grid(False, axis="y")
        axes.set_xlabel("motions per second")
        figure.legend(loc="outside upper left", ncols=2)
        caption = (
            f"Throughput for {ways[0].count:,} programs of four keyframes: each made from scratch (new), or one whose "
            "keyframes are moved. Higher is better."
        )
        return to_figure(figure, "throughput", caption)


def _memory_figure(memory: dict[str, list[tuple[int, float]]]) -> Figure:
    with new_figure(7.0, 2.6) as figure:
        axes = figure.subplots()
        for k, (kind, rows) in enumerate(memory.items()):
            axes.plot(
                *np.transpose(rows), color=COLOURS[k], marker="os"[k], markersize=(8, 4)[k], label=f"{kind} programs"
            )
        axes.set_ylim(0, 1.15 * max(size for rows in memory.values() for _, size in rows))
        axes.set_xlabel("solves")
        axes.set_ylabel("resident memory [MB]")
        axes.legend(loc="lower right")
        return to_figure(figure, "memory", "Memory of a fresh process over solves whose solutions are not kept.")


def _conclusion(
    ways: list[Way], moved: Way, sizes: dict[str, float], memory: dict[str, list[tuple[int, float]]]
) -> str:
    loop, many, best = ways[0], ways[1], max(ways, key=lambda w: w.rate)
    build, compiled, solve, evaluate, linear, iterations = moved.parts
    rest = 1 / moved.rate - (build + compiled + solve)
    same = all(w.same for w in ways)
    alone, shared = sizes["pickle, moved, 1 to a task"], sizes[f"pickle, moved, {CHUNK} to a task"]
    text = (
        f"A loop makes and solves {loop.rate:.0f} programs of four keyframes a second, and {moved.rate:.0f} where one "
        f"program's keyframes are moved instead, which keeps what is derived from its structure. solve_many does so "
        f"for new programs of equal structure too, and solves {many.rate:.0f} of them a second. The fastest way here, "
        f"{best.name} on {best.programs} programs, solves {best.rate:.0f} a second. "
        + ("Every way gives the same numbers, bit for bit. " if same else "The numbers are not the same in all ways. ")
        + f"A solve takes {iterations:.1f} iterations on average and {1e3 * solve:.2g} ms, of which evaluating kernels "
        f"takes {100 * evaluate / solve:.0f} % and factorising {100 * linear / solve:.0f} %; moving the keyframes "
        f"takes {1e3 * build:.2g} ms, the certificate and the rest {1e3 * rest:.2g} ms.\n\n"
        f"A program that travels alone is {alone / 1e3:.1f} kB, one of {CHUNK} that share a structure "
        f"{shared / 1e3:.1f} kB."
    )
    if memory:
        worst = max(map(growth, memory.values()))
        text += (
            f" Over {loop.count:,} solves each of new and of moved programs the memory grows by at most "
            f"{max(worst, 0.0):.0f} bytes a solve after the first tenth."
        )
    return text


STUDY = Study(
    "many_motions",
    "How many small motions a second, by loop, threads and processes, and does memory grow?",
    "",
    run,
    alone=True,
    order=70,
)
