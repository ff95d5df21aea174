"""Bounds on speeds, places and torques: how sure and how fast are the two solvers, and what does a bound cost?"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from statistics import median
from time import process_time

import casadi as ca
import numpy as np

import symmotion as sm
from studies.shares import share
from studies.solving.bounded_problems import KINDS, POINTS, problem
from studies.solving.bounded_speed import (
    METHODS,
    OBJECTIVE,
    SAME,
    Pair,
    certified,
    fixed,
    slow_at,
    solvers,
    speeds,
    turning,
)
from studies.solving.contest import tables
from symmotion.report import Column, Figure, Run, Study, StudyOptions, StudyResult, Table, to_figure
from symmotion.views import COLOURS, new_figure

QUICK, FULL = 11, 330  # problems, of all kinds alike
SIZES, LONG = (20, 100), (20, 100, 400, 1000)  # keyframes of the comparison of speeds
TURNS = (20, 100)  # orientations of the long form
EDITS, MANY = 12, 200  # neighbouring programs that are solved from a solution
SAMPLED = (5, 10, 20)  # times in every span


def run(options: StudyOptions) -> StudyResult:
    pairs = []
    for seed in range(FULL if options.full else QUICK):
        task = problem(seed)
        options.progress(task.name)
        pairs.append(Pair.of(task.name, task.kind, task.program))
    sped = []
    for count in LONG if options.full else SIZES:
        options.progress(f"a speed bound on {count} keyframes")
        sped.append(Pair.warm(str(count), "speed", fixed(count)))
    for count in TURNS if options.full else ():
        for kind in ("rate", "torque"):
            options.progress(f"a {kind} bound on {count} orientations")
            sped.append(Pair.warm(str(count), kind, turning(count, kind == "torque")))
    options.progress("neighbouring programs")
    edits = edited(MANY if options.full else EDITS)
    options.progress("between the samples")
    sampled = between_samples()
    runs = [replace(Run.of(p.name, s), log=()) for p in pairs for s in p.solutions]
    runs += [Run.of(f"{p.kind} bound, {p.name} keyframes", s) for p in sped for s in p.solutions]
    shown = (_by_kind(pairs), speeds(sped), _edits(edits), _between(sampled), _prices(sampled[-1].solution))
    figures, told = (_speed_figure(sampled), _floor_figure()), _told(pairs, sped, edits, sampled)
    good = [share(sum(certified(p.solutions[k]) for p in pairs), len(pairs)) for k in range(len(METHODS))]
    held, everywhere = (100 * s.excess.value for s in (sampled[1], sampled[-1]))
    answer = (
        f"With bounds {METHODS[0]} certifies {good[0]}, {METHODS[1]} {good[1]} problems from one start; a speed bound "
        f"held at samples is exceeded between them by {held:.2g} %, held everywhere by {everywhere:.1g} %."
    )
    return StudyResult(shown, figures, tuple(runs), *told, answer=answer)


@dataclass(frozen=True, eq=False)
class Edits:
    """Neighbours of solved programs: iterations (edits,) from the solution and from the program's own start.

    changed: whether other bounds press than before; same: whether both starts end at the same minimum.
    """

    warm: np.ndarray
    cold: np.ndarray
    ipopt: np.ndarray
    changed: np.ndarray
    same: np.ndarray


def edited(count: int) -> Edits:
    """A keyframe of a program with a speed bound at fixed times moved and turned, again and again from one solution."""
    newton, ipopt = solvers()
    program = fixed(10)
    base, theirs = newton.solve(program), ipopt.solve(program)
    keys, rng, rows = program.design.keyframes, np.random.default_rng(1), []
    pressed = base.multipliers["speed"] > 1e-7
    for _ in range(count):
        i, size = int(rng.integers(1, len(keys) - 1)), float(10 ** rng.uniform(-2.5, -1))
        turned = keys.linear[i] @ (np.eye(3) + np.cross(np.eye(3), size * rng.normal(size=3)))
        moved = keys.moved(i, turned, keys.translation[i] + size * rng.normal(size=3))
        other = program.with_keyframes(moved)
        warm, cold, again = newton.solve(other, start=base), newton.solve(other), ipopt.solve(other, start=theirs)
        if not certified(cold):
            continue
        changed = bool(((warm.multipliers["speed"] > 1e-7) != pressed).any())
        same = certified(warm) and abs(warm.objective - cold.objective) <= SAME * abs(cold.objective)
        rows.append((warm.iterations, cold.iterations, again.iterations, changed, same))
    columns = np.array(rows, dtype=float).T
    return Edits(columns[0], columns[1], columns[2], columns[3].astype(bool), columns[4].astype(bool))


@dataclass(frozen=True, eq=False)
class Held:
    """A bound held in one way: where, the solution, its times, rounds, and CPU seconds."""

    where: str
    solution: sm.Solution
    times: int
    rounds: int
    seconds: float

    @property
    def excess(self) -> sm.program.Excess:
        bound = sm.SpeedBound(POINTS, LIMIT)
        return sm.excess(self.solution.motion, bound)


KEYS = sm.examples.random_keyframes(8, 60, 1)
LIMIT = 4.9
SLOWER = sm.affine_program(KEYS, objective=OBJECTIVE)


def between_samples() -> list[Held]:
    """A speed bound left out, held at samples, and everywhere."""
    solver, found = sm.ExactNewton(), []
    free = solver.solve(SLOWER)
    found.append(Held("not at all", free, 0, 1, 0.0))
    breaks = SLOWER.design.basis.breakpoints
    for density in SAMPLED:
        inside = (np.arange(density) + 0.5) / density
        times = (breaks[:-1, None] + np.diff(breaks)[:, None] * inside).ravel()
        program = sm.affine_program(KEYS, objective=OBJECTIVE, constraints=[slow_at(times, LIMIT)])
        began = process_time()
        solution = solver.solve(program)
        found.append(Held(f"at {density} times in every span", solution, len(times), 1, process_time() - began))
    program = sm.affine_program(KEYS, objective=OBJECTIVE, constraints=[sm.SpeedBound(POINTS, LIMIT)])
    began = process_time()
    solution = solver.solve(program)
    seconds = process_time() - began
    rounds = len(solution.exchange.rounds) if solution.exchange else 1
    times = solution.program.constraint("speed").block.count
    return [*found, Held("everywhere, by exchange", solution, times, rounds, seconds)]


def _by_kind(pairs: Sequence[Pair]) -> Table:
    rows = []
    for kind in (*KINDS, "all"):
        chosen = [p for p in pairs if kind in (p.kind, "all")]
        if not chosen:
            continue
        for k, method in enumerate(METHODS):
            found = [p.solutions[k] for p in chosen]
            best = [
                certified(s) and s.objective <= p.best + SAME * abs(p.best) for p, s in zip(chosen, found, strict=True)
            ]
            rows.append(
                (
                    kind,
                    method,
                    len(chosen),
                    sum(map(certified, found)),
                    sum(best),
                    sum(s.status == "infeasible" or "cannot hold" in s.message for s in found),
                    sum(s.status == "solved" and not certified(s) for s in found),
                    median(s.iterations for s in found),
                    1e3 * median(p.seconds[k] for p in chosen),
                )
            )
    columns = (
        Column("bounded"),
        Column("method"),
        Column("problems"),
        Column("certified"),
        Column("best known"),
        Column("conflict named"),
        Column("solved, not certified"),
        Column("iterations, median"),
        Column("CPU, median", "ms"),
    )
    caption = (
        "Both solvers once, from the program's own start, with bounds that hold everywhere. Certified: solved, and "
        "nowhere beyond a bound by more than 1e-6 of it. The time has the "
        "kernels' derivation in it where a solve is the first of its kind."
    )
    return Table("problems", columns, tuple(rows), caption)


def _edits(edits: Edits) -> Table:
    rows = []
    for name, values in (
        ("newton, from the solution", edits.warm),
        ("newton, from the program's start", edits.cold),
        ("ipopt, from its solution", edits.ipopt),
    ):
        rows.append((name, len(values), float(np.median(values)), float(np.quantile(values, 0.9)), int(values.max())))
    columns = (
        Column("start"),
        Column("edits"),
        Column("iterations, median"),
        Column("90 %"),
        Column("most"),
    )
    caption = (
        f"One of ten keyframes moved and turned by up to a tenth; in {100 * edits.changed.mean():.0f} % of the edits "
        f"other bounds press than before, in {100 * edits.same.mean():.0f} % both starts end at the same minimum."
    )
    return Table("edits", columns, tuple(rows), caption)


def _between(sampled: Sequence[Held]) -> Table:
    rows = []
    for h in sampled:
        pressing = 0
        if h.times:
            pressing = int((np.abs(h.solution.multipliers["speed"]) > 1e-7).any(axis=-1).sum())
        excess = h.excess
        rows.append((h.where, h.times, pressing, 100 * excess.value, excess.kind, h.solution.objective, h.rounds))
    columns = (
        Column("held"),
        Column("times"),
        Column("of them press"),
        Column("excess anywhere", "%"),
        Column("proof"),
        Column("objective"),
        Column("solves"),
    )
    caption = "What a speed bound leaves between the times at which it is held, and what holding it everywhere costs."
    return Table("between samples", columns, tuple(rows), caption)


def _prices(solution: sm.Solution) -> Table:
    """What a bound costs, where it presses."""
    held = solution.program.constraint("speed")
    assert held.times is not None
    rows = [
        (float(t), f"({', '.join(f'{c:g}' for c in POINTS[k])})", float(price), -2 * LIMIT * float(price))
        for t, prices in zip(held.times[:, 0], np.asarray(solution.multipliers["speed"]), strict=True)
        for k, price in enumerate(prices)
        if price > 1e-7
    ]
    columns = (Column("time"), Column("body point"), Column("multiplier of ‖ṗ‖² ≤ v²"), Column("∂ objective / ∂ v"))
    caption = "Where the bound that holds everywhere presses, and what a little more speed there would save."
    return Table("prices", columns, tuple(rows), caption)


def _speed_figure(sampled: Sequence[Held]) -> Figure:
    """The fastest body point over time, with its bound."""
    with new_figure(7.0, 3.2) as figure:
        axes = figure.subplots()
        shown = (sampled[0], sampled[1], sampled[-1])
        for h, colour, line in zip(shown, COLOURS, ("--", "-", "-"), strict=False):
            a, b = h.solution.motion.domain
            t = np.linspace(a, b, 1500)
            speed = np.linalg.norm(h.solution.motion.trajectory(POINTS, t, 1), axis=-1).max(axis=-1)
            axes.plot(t, speed, color=colour, linestyle=line, linewidth=1.1, label=f"held {h.where}")
        held = sampled[-1].solution.program.constraint("speed").times
        assert held is not None
        axes.plot(held[:, 0], np.full(len(held), LIMIT), "o", color=COLOURS[2], markersize=4, label="where it presses")
        axes.axhline(LIMIT, color=COLOURS[5], linewidth=0.9, linestyle=":")
        axes.set(xlabel="time", ylabel="fastest body point [length/time]")
        figure.legend(loc="outside upper left", ncols=2)
        return to_figure(figure, "speed", "The speed of the fastest of four body points; dotted: its bound.")


def _floor_figure() -> Figure:
    """Body points over a floor, with and without the condition, through keyframes between which they would dip."""
    keys = sm.examples.random_keyframes(8, 60, 8)
    lowest = float((keys.linear @ POINTS.T + keys.translation[:, :, None])[:, 2].min())
    floor = sm.JetConstraint(
        lambda jet: ca.vertcat(*(jet.place(p)[2] for p in POINTS)), lower=lowest, upper=np.inf, name="floor"
    )
    free, above = (
        sm.ExactNewton().solve(sm.affine_program(keys, objective=OBJECTIVE, constraints=held)) for held in ([], [floor])
    )
    with new_figure(7.0, 3.2) as figure:
        axes = figure.subplots()
        for solution, colour, line, name in (
            (free, COLOURS[0], "--", "without the floor"),
            (above, COLOURS[2], "-", "with it"),
        ):
            t = np.linspace(*solution.motion.domain, 800)
            heights = solution.motion.trajectory(POINTS, t)[..., 2].min(axis=-1)
            axes.plot(t, heights, color=colour, linestyle=line, label=f"lowest body point, {name}")
        axes.axhspan(axes.get_ylim()[0], lowest, color=COLOURS[5], alpha=0.25, linewidth=0)
        axes.set(xlabel="time", ylabel="height [length]")
        axes.margins(x=0, y=0)
        figure.legend(loc="outside upper left", ncols=2)
        caption = "The lowest of four body points over time; the floor, shaded, is as high as the lowest keyframe."
        return to_figure(figure, "floor", caption)


def _told(
    pairs: Sequence[Pair], sped: Sequence[Pair], edits: Edits, sampled: Sequence[Held]
) -> tuple[str, tuple[str, ...]]:
    """The conclusion, and notes about this run."""
    counts = []
    for k, method in enumerate(METHODS):
        good = sum(certified(p.solutions[k]) for p in pairs)
        counts.append(f"{method} certifies {share(good, len(pairs))}")
    named = sum(p.solutions[0].status == "infeasible" for p in pairs)
    ratios = {
        kind: ", ".join(f"{p.seconds[1] / p.seconds[0]:.1f} at {p.name}" for p in sped if p.kind == kind)
        for kind in ("speed", "rate", "torque")
    }
    first, last = sampled[1], sampled[-1]
    text = (
        f"From one start each, with 95 % intervals, {'; '.join(counts)}; of {named} the exact Newton method says which "
        "conditions cannot hold together. With the same compiled kernels IPOPT takes "
        f"{ratios.pop('speed')} keyframes times its CPU time where a speed is bounded"
        f"{''.join(f', {told} where a {kind}' for kind, told in ratios.items() if told)}.\n\n"
        f"From the solution a neighbouring program takes {np.median(edits.warm):g} iterations in the median, "
        f"{np.median(edits.cold):g} from its own start, IPOPT from its solution {np.median(edits.ipopt):g}.\n\n"
        f"A speed bound held {first.where} is exceeded between them by {100 * first.excess.value:.2g} %; held "
        f"everywhere by {100 * last.excess.value:.1g} %, at {last.times} times, after {last.rounds} solves."
    )
    full = len(pairs) == FULL
    note = f"The quick form: {len(pairs)} problems and {len(edits.warm)} edits; the long one has {FULL} and {MANY}."
    return text, tables.LIMITS if full else (note, *tables.LIMITS)


STUDY = Study(
    "inequalities",
    "What do bounds cost, and how surely and fast are they kept?",
    "Wächter, Biegler 2006; Hettich, Kortanek 1993",
    run,
    order=7,
)
