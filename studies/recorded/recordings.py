"""Recordings smoothed, and carried by few of their poses: how close to them, beside SciPy's splines?"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from statistics import median
from time import process_time
from typing import TypeVar

import numpy as np

import symmotion as sm
from studies.recorded import driven
from studies.recorded.recorded_motions import (
    ERRORS,
    Path,
    Recorded,
    apart,
    load,
    noisy,
    of_motion,
    smoothed,
    through,
)
from studies.shares import ratio, share
from symmotion.report import Column, Figure, Run, Study, StudyOptions, StudyResult, Table, to_figure
from symmotion.smoothing import own_objective, plan
from symmotion.views import COLOURS, new_figure

# σ of places in extents of the recording, and of turns in rad.
NOISES = {"small": (0.003, 0.005), "large": (0.02, 0.03)}
WORSE = 1.02  # what counts as worse than SciPy
MARKERS = "os^vD"
TICKS = (0.1, 0.2, 0.3, 0.5, 0.7, 1.0)
Value = TypeVar("Value")


@dataclass(frozen=True, eq=False)
class Smoothed:
    """One recording with noise of one size put on, by seed: errors (K, 5) as ERRORS names them, and σ found/put on.

    mine, told, scipy: smoothed with the noise estimated, with it given, and by SciPy; cpu: seconds of first and last.
    """

    name: str
    noise: str
    poses: int
    mine: np.ndarray
    told: np.ndarray
    scipy: np.ndarray
    sigmas: np.ndarray
    cpu: tuple[float, float]

    def beside(self, k: int) -> tuple[float, float, float]:
        """The error's geometric mean over SciPy's, with its interval."""
        return ratio(self.mine[:, k], self.scipy[:, k])


def smoothings(recording: Recorded, which: slice, noise: str, seeds: int) -> tuple[Smoothed, sm.Solution]:
    """Smoothings of some of the poses with noise put on, and the last of them."""
    clean, (place, turn) = recording.poses[which], NOISES[noise]
    truth, sizes = through(clean), (place * recording.extent, turn)
    errors: dict[str, list[np.ndarray]] = {"mine": [], "told": [], "scipy": []}
    sigmas, cpu, solution = [], np.zeros(2), None
    for seed in range(seeds):
        samples = noisy(clean, *sizes, seed)
        planned, spent = _timed(lambda samples=samples: plan(samples))
        solution, solved = _timed(planned.solve)
        baseline, theirs = _timed(lambda samples=samples: smoothed(samples))
        cpu += spent + solved, theirs
        sigmas.append(np.divide(planned.noise or np.nan, sizes))
        told = of_motion(sm.smooth(samples, noise=sizes).motion)
        for name, path in (("mine", of_motion(solution.motion)), ("told", told), ("scipy", baseline)):
            errors[name].append(apart(path, truth, clean.times))
    assert solution is not None  # there are seeds
    found = {name: np.array(values) for name, values in errors.items()}
    return Smoothed(
        recording.name, noise, len(clean), **found, sigmas=np.array(sigmas), cpu=(float(cpu[0]), float(cpu[1]))
    ), solution


@dataclass(frozen=True, eq=False)
class Carried:
    """A recording between every so many of its poses: errors (2,) of place and turn over SciPy's, by objective."""

    name: str
    every: int
    keyframes: int
    turn: float
    beside: dict[str, np.ndarray]


def carried(recording: Recorded, every: int) -> tuple[Carried, sm.Solution]:
    """Motions through every so many poses, and the one of the objective that suits them."""
    poses = recording.poses
    which = np.arange(0, len(poses), every)
    keys, during = poses[which], np.arange(which[-1] + 1)
    between = during[during % every > 0]
    truth = poses[between]

    def off(path: Path) -> np.ndarray:
        turns, places = path(truth.times)
        angle = (truth.rotations(1e-3).inv() * turns).magnitude()
        return np.sqrt([((places - truth.translation) ** 2).sum(axis=1).mean(), (angle**2).mean()])

    objectives = {"R": sm.Rigidity(), "own": own_objective(keys)[0]}
    solutions = {
        name: sm.ExactNewton().solve(sm.affine_program(keys, objective=energy)).require()
        for name, energy in objectives.items()
    }
    scipy = off(through(keys))
    beside = {name: off(of_motion(solution.motion)) / scipy for name, solution in solutions.items()}
    return Carried(recording.name, every, len(keys), float(scipy[1]), beside), solutions["own"]


def run(options: StudyOptions) -> StudyResult:
    recordings, source = load(options.full)
    seeds = 30 if options.full else 3
    runs, noise, between = [], [], []
    for recording in recordings:
        for size, which in ((size, recording.noisy) for size in NOISES):
            if which is None:
                continue
            options.progress(f"{recording.name}, {size} noise")
            found, solution = smoothings(recording, which, size, seeds)
            noise.append(found)
            runs.append(Run.of(f"{recording.name}, {size} noise", solution))
        for every in recording.spacings:
            options.progress(f"{recording.name}, every {every} poses")
            result, solution = carried(recording, every)
            between.append(result)
            runs.append(Run.of(f"{recording.name}, every {every} poses", solution))
    options.progress("a car")
    car, slip = driven.table(20 if options.full else 3)
    tables = (_smoothed_table(noise, seeds), _carried_table(between), car)
    answer, conclusion = _told(noise, between, seeds)
    conclusion += f"\n\nA car's places between keyframes are off by {slip:.2g} as much where side-slip costs."
    return StudyResult(tables, (_figure(noise),), tuple(runs), conclusion, (source,), answer=answer)


def _timed(work: Callable[[], Value]) -> tuple[Value, float]:
    began = process_time()
    return work(), process_time() - began


def _smoothed_table(noise: list[Smoothed], seeds: int) -> Table:
    columns = (
        Column("recording"),
        Column("noise"),
        Column("poses"),
        *(Column(f"{name} / SciPy") for name in ERRORS),
        Column("place, σ given / SciPy"),
        Column("turn, σ given / SciPy"),
        Column("σ of places, found / put on"),
        Column("σ of turns, found / put on"),
    )
    rows = []
    for s in noise:
        beside = (_said(*s.beside(k)) for k in range(len(ERRORS)))
        told = (_said(*ratio(s.told[:, k], s.scipy[:, k])) for k in range(2))
        found = (_said(*ratio(s.sigmas[:, k], np.ones(len(s.sigmas)))) for k in range(2))
        rows.append((s.name, s.noise, s.poses, *beside, *told, *found))
    sizes = "; ".join(f"{n}: σ = {100 * p:g} % of the extent and {t:g} rad" for n, (p, t) in NOISES.items())
    caption = (
        f"`sm.smooth` over SciPy's `make_smoothing_spline` (places; quaternions, normalised), both by generalised "
        f"cross-validation: root mean square errors at the poses, geometric means of {seeds} seeds with 95 % intervals "
        f"by the bootstrap. Noise about each axis, {sizes}. Truth: the recording, with the rates of SciPy's cubic and "
        "rotation spline through it."
    )
    return Table("noise put on", columns, tuple(rows), caption)


def _carried_table(between: list[Carried]) -> Table:
    columns = (
        Column("recording"),
        Column("every"),
        Column("keyframes"),
        Column("turn, SciPy", "°"),
        Column("turn, R alone / SciPy"),
        Column("turn, own / SciPy"),
        Column("place, R alone / SciPy"),
        Column("place, own / SciPy"),
    )
    rows = tuple(
        (
            c.name,
            c.every,
            c.keyframes,
            float(np.rad2deg(c.turn)),
            *(float(c.beside[name][k]) for k in (1, 0) for name in ("R", "own")),
        )
        for c in between
    )
    caption = (
        "Root mean square errors at the recorded poses between the keyframes, over those of `CubicSpline` and "
        "`RotationSpline`. Own: the objective of `symmotion design` and `sm.smooth` for rigid keyframes, "
        "`rigid_objective`; R does not see places, so that these keep their natural cubic spline."
    )
    return Table("between keyframes", columns, rows, caption)


def _figure(noise: list[Smoothed]) -> Figure:
    sizes = list(NOISES)
    with new_figure(7.0, 3.6) as figure:
        panels = figure.subplots(1, len(sizes), sharey=True, sharex=True, squeeze=False)[0]
        for axes, size in zip(panels, sizes, strict=True):
            rows = [s for s in noise if s.noise == size]
            for i, s in enumerate(rows):
                for k, name in enumerate(ERRORS):
                    middle, low, high = s.beside(k)
                    y = i + 0.15 * (k - 2)
                    axes.plot([low, high], [y, y], color=COLOURS[k], linewidth=1.2)
                    axes.plot(middle, y, MARKERS[k], color=COLOURS[k], label=name if not i else None)
            axes.axvline(1.0, color=COLOURS[-1], linewidth=0.8)
            axes.set(xscale="log", xlabel="error over SciPy's", title=f"{size} noise")
            ticks = [tick for tick in TICKS if tick >= axes.get_xlim()[0]]
            axes.set_xticks(ticks, [f"{tick:g}" for tick in ticks])
            axes.set_xticks([], minor=True)
            axes.set_yticks(range(len(rows)), [s.name for s in rows])
        panels[0].invert_yaxis()
        handles, labels = panels[0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside upper left", ncols=len(ERRORS))
        caption = "Errors of smoothed recordings over those of SciPy's smoothing splines, with 95 % intervals."
        return to_figure(figure, "beside", caption)


def _told(noise: list[Smoothed], between: list[Carried], seeds: int) -> tuple[str, str]:
    """The answer and the conclusion."""
    means = [_overall(noise, k) for k in range(len(ERRORS))]
    place, turn = (_worst(noise, k) for k in range(2))
    found = np.concatenate([s.sigmas for s in noise])
    low, high = np.quantile(found, [0.05, 0.95])
    speed = sum(s.cpu[0] for s in noise) / sum(s.cpu[1] for s in noise)
    fair = {name: [bool((c.beside[name] <= WORSE).all()) for c in between] for name in ("R", "own")}
    turns, places = (median(c.beside["own"][k] for c in between) for k in (1, 0))
    plain = median(c.beside["R"][1] for c in between)
    worst = max(between, key=lambda c: max(c.beside["own"]))
    answer = (
        f"Smoothed, errors are {means[0][0]:.2f} (place), {means[1][0]:.2f} (turn), {means[4][0]:.2f} (acceleration) "
        f"of SciPy's; through keyframes {turns:.2f} (turn), {places:.2f} (place), in the median."
    )
    conclusion = (
        f"With noise put on, {len(noise)} cases of {seeds} seeds: "
        + ", ".join(f"{name} {_said(*mean)}" for name, mean in zip(ERRORS, means, strict=True))
        + f" times the error of SciPy's smoothing splines, in {speed:.2g} of their CPU time. The least favourable case "
        f"is {place} in place and {turn} in turn. σ is found to {low:.2f} to {high:.2f} of what was put on (nine in "
        "ten); it is known least where poses are so far apart that they hardly tell noise from motion.\n\n"
        f"Between keyframes the objective that suits rigid ones is off by {turns:.3g} of SciPy's error in turn "
        f"(R alone: {plain:.3g}) and {places:.3g} in place, medians of {len(between)}. No worse by more than 2 % in "
        f"both are {share(sum(fair['own']), len(between))}, with R alone {share(sum(fair['R']), len(between))}. "
        f"The least favourable is {worst.name} every {worst.every} poses, {worst.keyframes} keyframes: turn "
        f"{worst.beside['own'][1]:.3g}, place {worst.beside['own'][0]:.3g}. Where keyframes are few, what "
        "counts is how a spline ends: here as bending tells it, not-a-knot in SciPy."
    )
    return answer, conclusion


def _overall(noise: Iterable[Smoothed], k: int) -> tuple[float, float, float]:
    """The ratio over all cases: of each its mean, since its seeds share the recording."""
    return ratio([s.beside(k)[0] for s in noise], [1.0 for _ in noise])


def _worst(noise: Iterable[Smoothed], k: int) -> str:
    case = max(noise, key=lambda s: s.beside(k)[0])
    return f"{_said(*case.beside(k))} ({case.name}, {case.noise} noise)"


def _said(middle: float, low: float, high: float) -> str:
    return f"{middle:.3f} ({low:.3f}–{high:.3f})"


STUDY = Study(
    "recordings",
    "How close to a recording are motions that smooth it, or that pass through few of its poses, beside SciPy's?",
    "HJK 2.3 (keyframes, fitting), on recordings; Craven and Wahba 1979",
    run,
    order=19,
    effort=15.0,
)
