"""Dragging a keyframe: how long after every small move is the optimal motion there again?"""

from dataclasses import dataclass
from time import perf_counter
from typing import Any, Literal

import numpy as np
from scipy.spatial.transform import Rotation

import symmotion as sm
from studies.shares import ends, share, with_interval
from studies.solving.scaling_figure import plain_ticks
from studies.solving.scaling_limit import load_note
from symmotion.report import Column, Figure, Run, Study, StudyOptions, StudyResult, Table, to_figure
from symmotion.views import COLOURS, new_figure

WARM = 5  # steps before the clock counts: buffers and caches of the first solves

# The keyframe is led along a closed path: two loops of this size in units of length, and turns of these degrees.
REACH, SWING = 2.0, 25.0
# Rigidity alone leaves the translation to its spline; with three body points' paths beside it all is optimised.
PLAIN = sm.Rigidity()
WITH_PATHS = PLAIN + 1e-3 * sm.TrajectoryEnergy(np.eye(3))
# Keyframes, the milliseconds that a step may take in the median, steps of the quick form and of the long one.
SIZES = ((20, 5.0, 40, 500), (200, 30.0, 20, 500))
KINDS: tuple[tuple[sm.energies.Energy, Literal["interpreted", "compiled"]], ...] = (
    (PLAIN, "interpreted"),
    (PLAIN, "compiled"),
    (WITH_PATHS, "compiled"),
)


@dataclass(frozen=True, eq=False)
class Drag:
    """A keyframe dragged along its path.

    target: milliseconds that the median may take; seconds: (steps,) from the moved keyframes to the
    certified solution, edit and solve; solving: (steps,) of that the solve; iterations, certified:
    (steps,); start, last: the solutions before the first step and after the last.
    """

    name: str
    target: float
    seconds: np.ndarray
    solving: np.ndarray
    iterations: np.ndarray
    certified: np.ndarray
    last: sm.Solution
    start: sm.Solution

    @property
    def milliseconds(self) -> np.ndarray:
        return 1e3 * self.seconds


def path(steps: int) -> tuple[np.ndarray, np.ndarray]:
    """Offsets (steps, 3) and turns (steps, 3), rotation vectors in rad: smooth, and zero after the last step."""
    s = 2 * np.pi * np.arange(1, steps + 1) / steps
    loop = REACH * np.column_stack([np.sin(s), np.sin(2 * s), 0.5 * (1 - np.cos(s))])
    turn = np.deg2rad(SWING) * np.column_stack([np.sin(2 * s), np.sin(s), np.sin(3 * s)])
    return loop, turn


def drag(count: int, objective: sm.energies.Energy, solver: sm.ExactNewton, target: float, steps: int) -> Drag:
    """One keyframe in the middle of `count` led along the path, every solve from the solution before it."""
    keys = sm.examples.random_keyframes(count, 40, 0)
    program, k = sm.affine_program(keys, objective=objective), count // 2
    offsets, turns = path(steps)
    linear = (Rotation.from_matrix(np.array(keys.linear[k])) * Rotation.from_rotvec(turns)).as_matrix()
    start = solution = solver.solve(program)
    for _ in range(WARM):
        solver.solve(program.with_keyframes(keys), start=solution)
    times, solving, iterations, certified = [], [], [], []
    for offset, turned in zip(offsets, linear, strict=True):
        began = perf_counter()
        program = program.with_keyframes(keys.moved(k, turned, keys.translation[k] + offset))
        edited = perf_counter()
        solution = solver.solve(program, start=solution)
        ended = perf_counter()
        times.append(ended - began)
        solving.append(ended - edited)
        iterations.append(solution.iterations)
        certified.append(solution.certificate.holds(solver.tolerance) and solution.inertia == "positive")
    name = f"1 of {count}, {objective.name}, {solver.kernels}"
    columns = (np.array(times), np.array(solving), np.array(iterations), np.array(certified))
    return Drag(name, target, *columns, last=solution, start=start)


def run(options: StudyOptions) -> StudyResult:
    drags, load = [], load_note()
    for count, target, brief, long in SIZES:
        steps = long if options.full else brief
        for objective, kernels in KINDS:
            options.progress(f"one of {count} keyframes, {objective.name}, {kernels} kernels, {steps} steps")
            drags.append(drag(count, objective, sm.ExactNewton(kernels=kernels), target, steps))
    runs = tuple(Run.of(f"{d.name}: {which}", s) for d in drags for which, s in (("start", d.start), ("end", d.last)))
    tables, figures = (_table(drags), _back(drags)), (_figure(drags), _strip(drags))
    return StudyResult(tables, figures, runs, _conclusion(drags), (load,), answer=_answer(drags))


def _table(drags: list[Drag]) -> Table:
    rows = []
    for d in drags:
        ms = d.milliseconds
        rows.append(
            (
                d.name,
                len(ms),
                *np.percentile(ms, (50, 90, 99)),
                ms.max(),
                d.target,
                1e3 * float(np.median(d.seconds - d.solving)),
                float(np.median(d.iterations)),
                int(d.iterations.max()),
                *with_interval(int(np.sum(d.certified)), len(d.certified)),
            )
        )
    columns = (
        Column("dragged"),
        Column("steps"),
        Column("median", "ms"),
        Column("90 %", "ms"),
        Column("99 %", "ms"),
        Column("slowest", "ms"),
        Column("target", "ms"),
        Column("edit, median", "ms"),
        Column("iterations"),
        Column("most"),
        Column("certified", "%"),
        *ends("certified"),
    )
    caption = (
        "From the moved keyframe to the certified optimum: the edited program, the solve from the solution before, and "
        "its certificate; ExactNewton, kernels interpreted or compiled. The target is for the median; the edit is the "
        "part before the solve."
    )
    return Table("drag", columns, tuple(rows), caption)


def _back(drags: list[Drag]) -> Table:
    """After the closed path the keyframes are those of the start: is the motion?"""
    rows = []
    for d in drags:
        apart = float(np.abs(d.last.x - d.start.x).max() / np.abs(d.start.x).max())
        rows.append((d.name, d.start.objective, d.last.objective, apart))
    columns = (
        Column("dragged"),
        Column("objective at the start"),
        Column("objective after the path"),
        Column("largest difference of controls, relative"),
    )
    caption = "The path ends where it began; a difference means that dragging led to another local minimum."
    return Table("back at the start", columns, tuple(rows), caption)


def _styles(drags: list[Drag]) -> list[dict[str, Any]]:
    return [
        {"color": colour, "linestyle": "--" if "interpreted" in d.name else "-", "label": d.name}
        for d, colour in zip(drags, COLOURS, strict=True)
    ]


def _figure(drags: list[Drag]) -> Figure:
    """Empirical distribution functions."""
    with new_figure(7.0, 3.4) as figure:
        axes = figure.subplots()
        for d, style in zip(drags, _styles(drags), strict=True):
            axes.ecdf(d.milliseconds, **style)
        for target in sorted({d.target for d in drags}):
            axes.axvline(target, color=COLOURS[5], linewidth=0.9, linestyle=":")
            axes.annotate(
                f"target {target:g} ms",
                (target, 1.0),
                xycoords=("data", "axes fraction"),
                xytext=(0, 2),
                textcoords="offset points",
                ha="center",
                fontsize=8,
            )
        axes.axhline(0.5, color=COLOURS[5], linewidth=0.5, alpha=0.5)
        axes.set(xscale="log", xlabel="from the moved keyframe to the solution [ms]", ylabel="share of steps")
        plain_ticks(axes.xaxis)
        figure.legend(loc="outside upper left", ncols=2)
        caption = "Distribution of the time per step; the targets are for the median, where the thin line is crossed."
        return to_figure(figure, "distribution", caption)


def _strip(drags: list[Drag]) -> Figure:
    """Time and iterations along the path."""
    with new_figure(7.0, 4.2) as figure:
        time, steps = figure.subplots(2, 1, sharex=True, height_ratios=(2, 1))
        for d, style in zip(drags, _styles(drags), strict=True):
            along = np.arange(1, len(d.seconds) + 1) / len(d.seconds)
            time.plot(along, d.milliseconds, linewidth=0.9, **style)
            if "interpreted" not in d.name:  # the same, bit by bit
                steps.step(along, d.iterations, linewidth=0.9, where="mid", **style)
        time.set(yscale="log", ylabel="time [ms]")
        plain_ticks(time.yaxis)
        steps.set(ylabel="iterations", xlabel="share of the path")
        steps.set_ylim(bottom=0)
        figure.legend(*time.get_legend_handles_labels(), loc="outside upper left", ncols=2)
        return to_figure(figure, "path", "Time and iterations of each step along the closed path of the keyframe.")


def _answer(drags: list[Drag]) -> str:
    """The fastest way by number of keyframes; all steps together."""
    fastest: dict[int, Drag] = {}
    for (count, *_), drag in zip((size for size in SIZES for _ in KINDS), drags, strict=True):
        fastest[count] = min(fastest.get(count, drag), drag, key=lambda d: float(np.median(d.milliseconds)))
    told = ", ".join(
        f"{np.median(d.milliseconds):.3g} ms (99 % in {np.percentile(d.milliseconds, 99):.3g}) with {count} keyframes"
        for count, d in fastest.items()
    )
    steps = sum(len(d.certified) for d in drags)
    return f"A step of the drag takes {told}; {share(sum(int(d.certified.sum()) for d in drags), steps)} are certified."


def _conclusion(drags: list[Drag]) -> str:
    lines, missed = [], []
    for d in drags:
        middle = float(np.median(d.milliseconds))
        lines.append(f"{d.name} {middle:.3g} ms ({np.percentile(d.milliseconds, 99):.3g})")
        if middle > d.target:
            missed.append(f"{d.name} ({d.target:g} ms)")
    steps, certified = sum(len(d.certified) for d in drags), sum(int(d.certified.sum()) for d in drags)
    apart = [d.name for d in drags if np.abs(d.last.x - d.start.x).max() > 1e-6 * np.abs(d.start.x).max()]
    back = (
        f"After the closed path the motion is another one for {'; '.join(apart)}: dragging follows one minimum."
        if apart
        else "After the closed path every motion is the one of the start."
    )
    return (
        f"Median time per step, and in brackets that of 99 % of the steps: {'; '.join(lines)}. Beyond its target: "
        f"{'; '.join(missed) or 'none'}. Certified are {certified:,} of {steps:,} steps.\n\n{back}"
    )


STUDY = Study(
    "interactive",
    "Does the optimal motion follow while a keyframe is dragged?",
    "HJK 4, as a tool at which somebody moves keyframes by hand",
    run,
    alone=True,
    order=7,
)
