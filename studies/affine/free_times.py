"""Keyframe times as unknowns: what do the best times save over uniform, chordal and centripetal ones?"""

from dataclasses import dataclass

import numpy as np

import symmotion as sm
from symmotion.bodies import eight_ellipses
from symmotion.design import free_times_program
from symmotion.motions import PARAMETRISATIONS
from symmotion.report import Column, Figure, Run, Study, StudyOptions, StudyResult, Table, player, to_figure
from symmotion.views import COLOURS, new_figure

SEED = 4


@dataclass(frozen=True, eq=False)
class Case:
    """Keyframes and objective, and for each start the times, the optimum for these and that for free times."""

    name: str
    energy: str
    starts: dict[str, np.ndarray]
    fixed: dict[str, sm.Solution]
    free: dict[str, sm.Solution]

    @property
    def best(self) -> sm.Solution:
        return min(self.free.values(), key=lambda s: s.objective)

    def times(self, solution: sm.Solution) -> np.ndarray:
        return solution.program.design.times(solution.x)

    def gain(self, method: str) -> float:
        """By what factor the optimum for the times of a method exceeds the one for the best times found."""
        return self.fixed[method].objective / self.best.objective


def keyframe_sets(full: bool) -> dict[str, sm.Keyframes]:
    """Positions whose steps differ much; their times are set by the study."""
    tour = sm.examples.recorded_tour(401, noise=0.0)
    sets = {
        "planar, 4": sm.examples.planar_keyframes(),
        "spatial, 4": sm.examples.spatial_keyframes(),
        "random, 8, 60° apart": sm.examples.random_keyframes(8, 60, SEED),
        "tour, 9, uneven": tour[[0, 10, 30, 90, 110, 220, 250, 370, 400]],
    }
    if full:
        sets |= {f"random, 20, {a}° apart": sm.examples.random_keyframes(20, a, SEED) for a in (40, 90)}
        sets["tour, 21"] = tour[::20]
    return {
        name: sm.Keyframes(np.linspace(0, 1, len(keys)), keys.linear, keys.translation) for name, keys in sets.items()
    }


def run(options: StudyOptions) -> StudyResult:
    cases, runs = [], []
    for name, keys in keyframe_sets(options.full).items():
        points = np.concatenate([np.eye(keys.dimension), -np.eye(keys.dimension)])
        for energy in (sm.Rigidity(), sm.TrajectoryEnergy(points)):
            options.progress(f"{name}, {energy.name}")
            cases.append(_solve(name, keys, energy, runs))
    rows = []
    for case in cases:
        for method in PARAMETRISATIONS:
            fixed, free = case.fixed[method], case.free[method]
            moved = np.abs(case.times(free) - case.starts[method]).max()
            rows.append(
                (case.name, case.energy, method, fixed.objective, free.objective, case.gain(method), 100 * moved)
            )
    table = Table(
        "optima for given and for free times",
        (
            Column("keyframes"),
            Column("objective"),
            Column("start"),
            Column("optimum, times given"),
            Column("optimum, times free"),
            Column("given over best"),
            Column("largest move", "% of T"),
        ),
        tuple(rows),
        "Cubic motions over one unit of time, one knot per segment; the motion is optimal in all rows. Free times by "
        "IPOPT from the times of that row; best: the least of the three. Largest move: of a keyframe's time.",
    )
    figures = (_times_figure(cases), _share_figure(cases))
    case = cases[0]
    moving = player(
        "motions",
        {"uniform times": case.fixed["uniform"].motion, "best times": case.best.motion},
        [ellipse[::3] for ellipse in eight_ellipses()],
        f"{case.name}: the motion of least {case.energy} for uniform times and for the best. Grey: the keyframes.",
        sm.examples.planar_keyframes(),
    )
    gains = {m: [c.gain(m) for c in cases if c.energy == "R"] for m in PARAMETRISATIONS}
    listed = ", ".join(f"{min(g):.3g}–{max(g):.3g} for {m}" for m, g in gains.items())
    answer = (
        f"The least distortion R at given times is that at the best times found times {listed} ones, over "
        f"{len(cases) // 2} sets of keyframes."
    )
    return StudyResult((table,), figures, tuple(runs), _conclusion(cases), players=(moving,), answer=answer)


def _solve(name: str, keys: sm.Keyframes, energy: sm.energies.Energy, runs: list[Run]) -> Case:
    starts, fixed, free = {}, {}, {}
    for method in PARAMETRISATIONS:
        timed = keys.with_times(method)
        given = sm.ExactNewton().solve(sm.affine_program(timed, objective=energy)).require()
        program = free_times_program(timed, objective=energy)
        # The motion that is best for the start's times is the best start there is.
        optimal = sm.Ipopt().solve(program, start=given.motion)
        if optimal.status != sm.solvers.Status.SOLVED:
            raise sm.SolveError(f"{name}, {energy.name}, free times from {method}: {optimal.message}")
        runs.append(Run.of(f"{name}, {energy.name}, {method} times", given))
        runs.append(Run.of(f"{name}, {energy.name}, free times from {method}", optimal))
        starts[method], fixed[method], free[method] = timed.times, given, optimal
    return Case(name, energy.name, starts, fixed, free)


def _conclusion(cases: list[Case]) -> str:
    parts = []
    for energy in dict.fromkeys(case.energy for case in cases):
        mine = [case for case in cases if case.energy == energy]
        means = {m: float(np.exp(np.mean([np.log(c.gain(m)) for c in mine]))) for m in PARAMETRISATIONS}
        worst = {m: max(c.gain(m) for c in mine) for m in PARAMETRISATIONS}
        closest = min(means, key=lambda m: means[m])
        agree = sum(max(s.objective for s in c.free.values()) <= (1 + 1e-6) * c.best.objective for c in mine)
        listed = ", ".join(f"{means[m]:.3g} for {m} times (at most {worst[m]:.3g})" for m in PARAMETRISATIONS)
        parts.append(
            f"{energy}: the optimum for given times exceeds that for the best ones by the factor {listed}, geometric "
            f"means over {len(mine)} sets of keyframes; {closest} times come closest. From all three starts the same "
            f"optimum is reached in {agree} of {len(mine)} sets."
        )
    saddles = [f"{c.name} ({c.energy}, from {m})" for c in cases for m, s in c.free.items() if s.inertia != "positive"]
    if saddles:
        parts.append(f"No strict minimum was certified for {'; '.join(saddles)}.")
    prices = []
    for case in cases:
        price = case.best.multipliers["total time"]
        prices.append(abs(price / ((1 if case.energy == "R" else 3) * case.best.objective) - 1))
    parts.append(
        "The multiplier of the total time T is what a little more time saves: R falls as 1/T and E as 1/T³, so it has "
        f"to be R/T and 3E/T; the largest relative difference found is {max(prices):.1g}."
    )
    return "\n\n".join(parts)


def _times_figure(cases: list[Case]) -> Figure:
    names = list(dict.fromkeys(case.name for case in cases))
    with new_figure(7.0, 0.6 + 1.35 * len(names)) as figure:
        panels = figure.subplots(len(names), 2, sharex=True, sharey=True, squeeze=False)
        for axes, case in zip(panels.flat, cases, strict=True):
            lines = {**{m: case.starts[m] for m in PARAMETRISATIONS}, "best": case.times(case.best)}
            stacked = np.array(list(lines.values()))
            axes.plot(stacked, np.arange(len(lines)), color="#000000", linewidth=0.6, alpha=0.5)
            for k, (times, colour) in enumerate(zip(stacked, (*COLOURS[1:4], COLOURS[0]), strict=True)):
                axes.plot(times, np.full(len(times), k), "o", color=colour)
            axes.set_yticks(range(len(lines)), list(lines))
            axes.set_title(f"{case.name}: {case.energy}", fontsize=9)
            axes.grid(False)
            axes.margins(y=0.12)
        for axes in panels[-1]:
            axes.set_xlabel("time, total 1")
        return to_figure(
            figure,
            "times",
            "Where the keyframes lie in time by the three parametrisations and at the optimum; thin lines join what is "
            "the same keyframe.",
        )


def _share_figure(cases: list[Case]) -> Figure:
    rigid = [case for case in cases if case.energy == "R"][:4]
    with new_figure(7.0, 2.2) as figure:
        panels = figure.subplots(1, 4, sharex=True, sharey=True)
        for axes, case in zip(panels, rigid, strict=True):
            for label, solution, colour in (
                ("uniform times", case.fixed["uniform"], COLOURS[1]),
                ("best times", case.best, COLOURS[0]),
            ):
                t = np.linspace(0, 1, 2001)
                axes.plot(t, _share(solution.motion, t), color=colour, linewidth=1.2, label=label)
            axes.set_title(case.name, fontsize=9)
            axes.set_xticks([0, 0.5, 1], ["0", "½", "1"])
        panels[0].set_ylabel("share of R so far")
        figure.supxlabel("time, total 1", fontsize="medium")
        figure.legend(*panels[0].get_legend_handles_labels(), loc="outside upper left", ncols=2)
        return to_figure(
            figure,
            "shares",
            "How R accrues along the optimal motions, as a share of its own total: the straighter the line, the more "
            "evenly it is spread.",
        )


def _share(motion: sm.AffineMotion, t: np.ndarray) -> np.ndarray:
    """(N,) ∫₀ᵗ Σ (d/dt q_i·q_j)² dt as a share of R, by the trapezoidal rule."""
    product = np.swapaxes(motion(t).linear, 1, 2) @ motion(t, 1).linear
    density = ((product + np.swapaxes(product, 1, 2)) ** 2).sum(axis=(1, 2))
    total = np.concatenate([[0.0], np.cumsum(0.5 * (density[1:] + density[:-1]) * np.diff(t))])
    return total / total[-1]


STUDY = Study(
    "free_times",
    "What do keyframe times that are optimised too save over uniform, chordal and centripetal ones?",
    "HJK 2.2 (choice of parameters), with the times as unknowns",
    run,
    order=15,
)
