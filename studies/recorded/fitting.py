"""A noisy recording fitted with few controls: how close to the truth, beside smoothing spline and moving average?"""

from collections.abc import Sequence

import numpy as np
from scipy.spatial.transform import Rotation

import symmotion as sm
from studies.recorded.recorded_pair import (
    Error,
    Pair,
    judge,
    judge_motion,
    load,
    moving_average,
    smoothing_spline,
    straight,
)
from symmotion.bodies import wedge
from symmotion.design import fit_program
from symmotion.report import Column, Figure, Run, Study, StudyOptions, StudyResult, Table, player, to_figure
from symmotion.views import COLOURS, new_figure

WEIGHTS = (None, 0.0, 1e-4, 1e-3, 1e-2)
WIDTHS = (5, 9, 15)
# Body points a hand's breadth from the camera: E then smooths its path more than its turning.
POINTS = 0.1 * np.concatenate([np.eye(3), -np.eye(3)])
OUTLIERS, SEED = 0.05, 1
HUBER = 1e-2  # m, about the noise of the estimate from pose to pose
ERRORS = (
    Column("position", "mm"),
    Column("orientation", "°"),
    Column("velocity", "mm/s"),
    Column("distortion, largest"),
)
CROSSED = 80  # controls up to which IPOPT solves the same programs


def smoothing(weight: float | None) -> sm.energies.Energy | None:
    """R + weight E; R alone for weight 0, and nothing for None."""
    if weight is None:
        return None
    return sm.Rigidity() + weight * sm.TrajectoryEnergy(POINTS) if weight else sm.Rigidity()


def run(options: StudyOptions) -> StudyResult:
    pair, runs = load(), []
    counts = (30, 40, 60, 80, 120, 160, 240, 320, 480) if options.full else (40, 80, 160, 320)
    fits: dict[tuple[int, float | None], Error] = {}
    for count in counts:
        options.progress(f"{count} controls")
        for weight in WEIGHTS:
            energy = smoothing(weight)
            case = f"{count} controls, {energy.name if energy else 'no energy'}"
            fits[count, weight] = judge_motion(pair, _solve(case, pair.estimate, runs, count, weight).motion)
    options.progress("baselines")
    baselines = _baselines(pair, pair.estimate)
    options.progress("outliers")
    spoilt, thrown = _spoilt(pair.estimate)
    robust, drawn = _with_outliers(pair, spoilt, runs)
    best = min(fits, key=lambda key: fits[key].position)
    tables = (
        Table(
            "error of the fits",
            (Column("controls"), Column("objective beside the data"), *ERRORS),
            tuple((count, _name(weight), *_cells(e)) for (count, weight), e in fits.items()),
            "Root mean squares against the truth after orthonormalisation (polar factor); velocity over 0.1 s; "
            "distortion: largest entry of |AᵀA − I| before it. E of six points 0.1 m from the camera.",
        ),
        Table(
            "beside",
            (Column("method"), *ERRORS),
            (
                *((name, *_cells(e)) for name, e in baselines.items()),
                (f"fit, {best[0]} controls, {_name(best[1])}", *_cells(fits[best])),
            ),
            "Entry by entry, then orthonormalised. The smoothing spline chooses its parameter by generalised "
            "cross-validation; of the fits, the one closest in position is shown, which takes the truth to know.",
        ),
        Table(
            "outliers",
            (Column("method"), *ERRORS),
            tuple((name, *_cells(e)) for name, e in robust.items()),
            f"{len(thrown)} of the {len(spoilt)} poses (seed {SEED}) thrown off by 0.2 m and 0.3 rad, standard "
            f"deviations per axis. Fits: 160 controls, {_name(1e-3)}.",
        ),
    )
    figures = (_error_figure(fits, baselines), _outlier_figure(pair, spoilt, drawn))
    caption = "The camera as a wedge in the first five seconds, fitted to samples with outliers."
    camera = player("camera", drawn, wedge(0.06), caption, unit="s", span=(0.0, 5.0))
    conclusion = _conclusion(fits, best, baselines, robust)
    raw, spline = (baselines[name].position for name in ("the estimate itself", "smoothing spline"))
    *_, plain, held = (e.position for e in robust.values())
    answer = (
        f"A fit of {best[0]} controls is off by {fits[best].position:.3g} mm, the samples by {raw:.3g}, their "
        f"smoothing spline by {spline:.3g}; with outliers a robust fit by {held:.3g}, a plain one by {plain:.3g}."
    )
    return StudyResult(tables, figures, tuple(runs), conclusion, (pair.note,), (camera,), answer)


def _solve(
    case: str, samples: sm.Keyframes, runs: list[Run], count: int, weight: float | None, huber: float | None = None
) -> sm.Solution:
    program = fit_program(samples, controls=count, objective=smoothing(weight), huber=huber)
    solvers = [sm.ExactNewton(), sm.Ipopt()] if count <= CROSSED or huber else [sm.ExactNewton()]
    comparison = sm.compare(program, solvers)
    runs += [Run.of(case, s) for s in comparison.solutions]
    if comparison.best is None:
        raise sm.SolveError(f"no solver solved {case}")
    return comparison.best


def _baselines(pair: Pair, samples: sm.Keyframes) -> dict[str, Error]:
    found = {"the estimate itself": judge(pair, *straight(pair, samples))}
    for width in WIDTHS:
        found[f"moving average of {width}"] = judge(pair, *moving_average(pair, samples, width))
    return found | {"smoothing spline": judge(pair, *smoothing_spline(pair, samples))}


def _spoilt(samples: sm.Keyframes) -> tuple[sm.Keyframes, np.ndarray]:
    """The samples with some thrown off, and the numbers of those."""
    rng = np.random.default_rng(SEED)
    thrown = rng.choice(len(samples), round(OUTLIERS * len(samples)), replace=False)
    linear, translation = samples.linear.copy(), samples.translation.copy()
    translation[thrown] += 0.2 * rng.normal(size=(len(thrown), 3))
    linear[thrown] @= Rotation.from_rotvec(0.3 * rng.normal(size=(len(thrown), 3))).as_matrix()
    return sm.Keyframes(samples.times, linear, translation), thrown


def _with_outliers(pair: Pair, spoilt: sm.Keyframes, runs: list[Run]) -> tuple[dict[str, Error], dict]:
    motions = {
        "plain fit": _solve("outliers, plain", spoilt, runs, 160, 1e-3).motion,
        "robust fit": _solve("outliers, Huber", spoilt, runs, 160, 1e-3, HUBER).motion,
    }
    errors = _baselines(pair, spoilt)
    for name, motion in motions.items():
        errors[f"{name}, Huber δ = {1e3 * HUBER:g} mm" if name == "robust fit" else name] = judge_motion(pair, motion)
    return errors, motions


def _name(weight: float | None) -> str:
    energy = smoothing(weight)
    return energy.name if energy else "none"


def _cells(e: Error) -> tuple[float, float, float, float]:
    return e.position, e.orientation, e.velocity, e.distortion


def _conclusion(fits: dict, best: tuple, baselines: dict[str, Error], robust: dict[str, Error]) -> str:
    raw, spline = baselines["the estimate itself"], baselines["smoothing spline"]
    chosen = fits[best]
    turned = min(fits, key=lambda key: fits[key].orientation)
    average = min((e for n, e in baselines.items() if n.startswith("moving")), key=lambda e: e.position)
    hit = list(robust.values())
    plain, held, hit_spline = hit[-2], hit[-1], robust["smoothing spline"]
    return (
        f"The estimate is off by {raw.position:.3g} mm and {raw.velocity:.3g} mm/s. With {best[0]} controls and "
        f"{_name(best[1])} the fit is off by {chosen.position:.3g} mm and {chosen.velocity:.3g} mm/s; the smoothing "
        f"spline by {spline.position:.3g} mm and {spline.velocity:.3g} mm/s, the best of the moving averages by "
        f"{average.position:.3g} mm and {average.velocity:.3g} mm/s. What the estimate gets wrong slowly, no smoothing "
        f"mends: the gain is {100 * (1 - chosen.position / raw.position):.3g} % in position, "
        f"{100 * (1 - chosen.velocity / raw.velocity):.3g} % in velocity.\n\n"
        f"In orientation the best fit ({turned[0]} controls, {_name(turned[1])}) is off by "
        f"{fits[turned].orientation:.3g}°, the estimate by {raw.orientation:.3g}°, the smoothing spline by "
        f"{spline.orientation:.3g}°. The largest distortion of {best[0]} controls is "
        f"{fits[best[0], None].distortion:.2g} without and {fits[best[0], 0.0].distortion:.2g} with R beside the "
        "data.\n\n"
        f"With outliers the plain fit is off by {plain.position:.3g} mm and {plain.orientation:.3g}°, the robust one "
        f"by {held.position:.3g} mm and {held.orientation:.3g}°, the smoothing spline by "
        f"{hit_spline.position:.3g} mm and {hit_spline.orientation:.3g}°."
    )


def _error_figure(fits: dict[tuple[int, float | None], Error], baselines: dict[str, Error]) -> Figure:
    counts = list(dict.fromkeys(count for count, _ in fits))
    parts: Sequence[tuple[str, str]] = (("position", "mm"), ("orientation", "°"), ("velocity", "mm/s"))
    with new_figure(7.0, 3.2) as figure:
        for axes, (part, unit) in zip(figure.subplots(1, len(parts)), parts, strict=True):
            for weight, colour, marker in zip(WEIGHTS, COLOURS, "osv^D", strict=False):
                values = [getattr(fits[count, weight], part) for count in counts]
                # The first two differ in distortion only: the one is drawn under the other.
                wide = {"linewidth": 4.0, "alpha": 0.4} if weight is None else {}
                axes.loglog(counts, values, color=colour, marker=marker, label=_name(weight), **wide)
            for name, style in (
                ("the estimate itself", ":"),
                ("moving average of 5", "-."),
                ("smoothing spline", "--"),
            ):
                axes.axhline(
                    getattr(baselines[name], part), color="#000000", linestyle=style, linewidth=1.0, label=name
                )
            axes.set_title(f"{part} [{unit}]")
            shown = counts[:: max(1, len(counts) // 4)]
            axes.set_xticks(shown, [str(c) for c in shown], fontsize="small")
            axes.minorticks_off()
            low, high = axes.get_ylim()
            ticks = [
                t for t in np.outer(10.0 ** np.arange(-2, 4), [1, 1.2, 1.5, 2, 3, 5, 7]).ravel() if low <= t <= high
            ]
            axes.set_yticks(ticks, [f"{t:g}" for t in ticks])
        figure.supxlabel("controls", fontsize="medium")
        figure.legend(*figure.axes[0].get_legend_handles_labels(), loc="outside upper left", ncols=4)
        return to_figure(
            figure,
            "errors",
            "Root mean square error against the truth over the number of controls, by what is minimised beside the "
            "data; black lines: the baselines.",
        )


def _outlier_figure(pair: Pair, spoilt: sm.Keyframes, motions: dict[str, sm.AffineMotion]) -> Figure:
    with new_figure(7.0, 3.0) as figure:
        axes = figure.subplots()
        axes.plot(spoilt.times, spoilt.translation[:, 0], ".", color="#000000", alpha=0.35, label="samples")
        axes.plot(
            pair.truth.times, pair.truth.translation[:, 0], color=COLOURS[2], linewidth=3, alpha=0.6, label="truth"
        )
        for (name, motion), colour in zip(motions.items(), (COLOURS[1], COLOURS[0]), strict=True):
            t = np.linspace(*motion.domain, 1500)
            axes.plot(t, motion(t).translation[:, 0], color=colour, linewidth=1.2, label=name)
        shown = pair.truth.times <= 8.0
        low, high = pair.truth.translation[shown, 0].min(), pair.truth.translation[shown, 0].max()
        axes.set_xlim(0.0, 8.0)
        axes.set_ylim(low - 0.15 * (high - low) - 0.02, high + 0.15 * (high - low) + 0.02)
        axes.set_xlabel("time [s]")
        axes.set_ylabel("x [m]")
        figure.legend(loc="outside upper left", ncols=4)
        return to_figure(
            figure,
            "outliers",
            "One coordinate of the camera over the first eight seconds, with outliers among the samples (some lie "
            "outside the frame).",
        )


STUDY = Study(
    "fitting",
    "How well does a motion of few controls follow a noisy recording, and what do R and E add?",
    "HJK 2.3 (motion fitting), on a recorded pair of estimate and ground truth",
    run,
    order=12,
)
