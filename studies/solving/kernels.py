"""What compiled kernels and a second thread gain, and what the compiler costs."""

from tempfile import TemporaryDirectory

import numpy as np

import symmotion as sm
from studies.solving.kernels_worker import LONGEST, OBJECTIVES, in_new_process, median_seconds
from symmotion.kernels import Kernels, available_processors
from symmotion.program import Evaluator
from symmotion.report import Cell, Column, Figure, Run, Study, StudyOptions, StudyResult, Table, to_figure
from symmotion.systems import system_of
from symmotion.views import COLOURS, new_figure

WAYS: tuple[tuple[Kernels, int], ...] = (("interpreted", 1), ("interpreted", 2), ("compiled", 1), ("compiled", 2))


def run(options: StudyOptions) -> StudyResult:
    kernels = _kernels(options)
    rows: list[tuple[Cell, ...]] = []
    runs: list[Run] = []
    same = True
    repeats, often = (9, 1000) if options.full else (3, 100)
    for count in (20, 100, 1000, 10_000, 100_000) if options.full else (20, 100, 1000):
        keys = sm.examples.random_keyframes(count, 40, seed=0)
        solutions = []
        for way in WAYS:
            options.progress(f"{count} keyframes, {_name(way)}")
            solver = sm.ExactNewton(kernels=way[0], threads=way[1])
            found = [solver.solve(sm.affine_program(keys)) for _ in range(repeats if count <= often else 1)]
            found.sort(key=lambda s: s.seconds.total)
            solutions.append(found[len(found) // 2])
            runs.append(Run.of(f"{count} keyframes, {_name(way)}", solutions[-1]))
        hessians = [_hessian_seconds(solutions[0], *way) for way in WAYS]
        totals = [s.seconds.total for s in solutions]
        rows += [
            (count, *way, 1e3 * h, hessians[0] / h, 1e3 * t, totals[0] / t)
            for way, h, t in zip(WAYS, hessians, totals, strict=True)
        ]
        same &= len({s.x.tobytes() + s.multiplier_vector.tobytes() for s in solutions}) == 1
    columns = (
        *(Column("keyframes"), Column("kernels"), Column("threads")),
        *(Column("gradient and Hessian", "ms"), Column("gain")),
        *(Column("build and solve", "ms"), Column("gain ")),
    )
    caption = (
        f"R, cubic, in space, one inserted knot per segment: medians of {repeats} up to {often:,} keyframes, one run "
        "beyond, and how many times faster than on one thread and interpreted."
    )
    table = Table("ways to evaluate", columns, tuple(rows), caption)
    notes = ()
    program = sm.affine_program(sm.examples.planar_keyframes())
    if not Evaluator(program, "compiled").terms[0].prepare("hessian").compiled:
        notes += (
            "No C compiler serves here: what is called compiled was interpreted too, and what is said of it is void.",
        )
    if available_processors() < 2:
        notes += ("One processor is available: a second thread cannot gain anything.",)
    text, last = _conclusion(rows, kernels, runs, same), {row[1:3]: row for row in rows if row[0] == rows[-1][0]}
    answer = (
        f"With {rows[-1][0]:,} keyframes compiled kernels build and solve {last['compiled', 1][6]:.2g} times as fast "
        f"as interpreted ones, {last['compiled', 2][6]:.2g} times with a second thread; the result is "
        f"{'the same in every bit' if same else 'NOT the same in every bit'}."
    )
    return StudyResult((table, kernels), (_figure(rows),), tuple(runs), text, notes, answer=answer)


def _name(way: tuple[Kernels, int]) -> str:
    return f"{way[0]}, {way[1]} thread{'s' if way[1] > 1 else ''}"


def _hessian_seconds(solution: sm.Solution, kernels: Kernels, threads: int) -> float:
    """One evaluation of gradient and reduced Hessian at the solution, as a step of the solver needs it."""
    program, x = solution.program, solution.x
    evaluator = Evaluator(program, kernels, threads)
    pattern = system_of(program, evaluator, x).pattern
    return median_seconds(lambda: evaluator.second_order(x, pattern))


def _kernels(options: StudyOptions) -> Table:
    """The Hessian kernel of every energy, a node at a time, and the first solve with an empty cache and a full one."""
    objectives = (*OBJECTIVES, LONGEST) if options.full else OBJECTIVES
    options.progress("the compiler")
    with TemporaryDirectory() as directory:
        first, later = (in_new_process(directory, len(objectives), nodes) for nodes in (False, True))
    rows = [
        (
            energy.name,
            int(instructions),
            *(1e9 * t for t in times),
            times[0] / times[1],
            times[0] / times[2],
            empty,
            full,
        )
        for energy, (empty,), (full, instructions, *times) in zip(objectives, first, later, strict=True)
    ]
    columns = (
        *(Column("objective"), Column("instructions")),
        *(Column("interpreted", "ns"), Column("by NumPy", "ns"), Column("compiled", "ns")),
        *(Column("gain by NumPy"), Column("gain compiled")),
        *(Column("first solve's preparation", "s"), Column("in a later process", "s")),
    )
    caption = (
        "Gradient and Hessian at one Gauss node, on one thread: interpreted by CasADi; the same instructions carried "
        "out by NumPy at many nodes at once, as where there is no compiler; compiled. Preparation: differentiating, "
        "compiling and loading the functions of the objective, with an empty cache and from it."
    )
    return Table("kernels", columns, tuple(rows), caption)


def _figure(rows: list[tuple[Cell, ...]]) -> Figure:
    with new_figure(6.0, 3.2) as figure:
        axes = figure.subplots()
        for way, style in zip(WAYS, (":o", "--o", ":s", "-s"), strict=True):
            mine = np.array([(row[0], row[5]) for row in rows if row[1:3] == way], dtype=float)
            axes.loglog(*mine.T, style, color=COLOURS[way[0] == "compiled"], label=_name(way), markersize=4)
        axes.set_xlabel("keyframes")
        axes.set_ylabel("build and solve [ms]")
        axes.legend()
        return to_figure(figure, "ways", "Build and solve, by the way that kernels are evaluated.")


def _conclusion(rows: list[tuple[Cell, ...]], kernels: Table, runs: list[Run], same: bool) -> str:
    count = rows[-1][0]
    last = {row[1:3]: row for row in rows if row[0] == count}
    both, alone = last["compiled", 2], last["compiled", 1]
    listed, gains = ([float(row[k] or 0) for row in kernels.rows] for k in (5, 6))
    return (
        f"A compiled Hessian kernel is {min(gains):.2g} to {max(gains):.2g} times as fast as an interpreted one, one "
        f"that NumPy carries out {min(listed):.2g} to {max(listed):.2g} times. With "
        f"{count:,} keyframes that makes the gradient and the Hessian {alone[4]:.2g} times as fast, with a second "
        f"thread {both[4]:.2g} times, and all of building and solving {alone[6]:.2g} and {both[6]:.2g} times. "
        f"Programs of a few hundred keyframes stay on one thread.\n\n"
        f"The compiler takes {max(float(row[7] or 0) - float(row[8] or 0) for row in kernels.rows):.2g} s at most for "
        f"the functions of an objective, once for a machine. Solutions and multipliers are "
        + ("the same in every bit, whatever the way. " if same else "NOT the same in every bit. ")
        + f"{sum(r.certified for r in runs)} of {len(runs)} runs are certified."
    )


STUDY = Study(
    "kernels",
    "What do compiled kernels and a second thread gain?",
    "",
    run,
    alone=True,
    order=5,
)
