"""Solutions, comparisons and fairing results, by one call."""

from collections.abc import Sequence
from typing import Literal

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator

from symmotion import checks
from symmotion.answers import Band, fit_covariance
from symmotion.bodies.shapes import UPRIGHT, Up
from symmotion.errors import InputError
from symmotion.fairing import FairingResult
from symmotion.motions import AffineMotion, PoseMotion, TwoParameterMotion
from symmotion.solvers import Comparison, Solution
from symmotion.splines import Spline
from symmotion.views.canvas import MOST_MARKERS, legend_above, on_axes, require_axes, require_kind, thinned, told
from symmotion.views.convergence import draw_convergence
from symmotion.views.fairing_figures import draw_fairness
from symmotion.views.motion_plots import plot_curve
from symmotion.views.solutions import keyframe_multipliers, keyframes_of, motion_or_none
from symmotion.views.style import COLOURS, INK, STYLES

SolutionKind = Literal["motion", "convergence", "multipliers", "band"]
FairingKind = Literal["history", "knots"]
# Local measures below this share of the largest are rounding: the last steps made them zero.
FLOOR = 1e-6


def plot_solution(
    solution: Solution, axes: Axes | None = None, *, kind: SolutionKind | None = None, up: Up = "z"
) -> Axes:
    """A solution's motion, convergence or multipliers; returns the axes.

    kind: "motion", as its own `plot` draws it, with the keyframes; "convergence", stationarity
    over the iterations, and what counts as zero; "multipliers", ‖λᵢ‖ over the keyframes, else
    over the rows of every constraint; "band", of a fit, how well it is known (`plot_band`). When
    left out, the motion where it has a picture, else the convergence. up: the axis of a body's space that is upright.
    """
    require_axes(axes)
    checks.choice(up, UPRIGHT, "up")
    motion = motion_or_none(solution)
    if kind is None:
        kind = "convergence" if motion is None else "motion"
    require_kind(kind, ("motion", "convergence", "multipliers", "band"))
    if kind == "band":
        return plot_band(fit_covariance(solution).band(), axes)
    if kind == "multipliers":
        return _plot_multipliers(solution, axes)
    if kind == "convergence":
        return _plot_convergence((solution,), axes)
    if motion is None:
        raise InputError(
            f"the solution ({solution.status}) has no motion with a picture: kind='convergence' shows what happened"
        )
    if isinstance(motion, Spline):
        return plot_curve(motion, axes)
    if isinstance(motion, AffineMotion | PoseMotion):
        return motion.plot(axes, keyframes=keyframes_of(solution), up=up)
    return motion.plot(axes)


def plot_band(band: Band, axes: Axes | None = None) -> Axes:
    """The origin's coordinates over time, two standard deviations wide, and two of the turn; returns the axes.

    The turn is read on the right, in degrees.
    """
    require_axes(axes)
    places, (times, name) = band.positions.translation, told(band.times)
    deviations = np.sqrt(np.diagonal(band.places, axis1=1, axis2=2))
    with on_axes(axes) as target:
        for k in range(places.shape[1]):
            low, high = places[:, k] - 2 * deviations[:, k], places[:, k] + 2 * deviations[:, k]
            target.fill_between(times, low, high, color=COLOURS[k], alpha=0.3, linewidth=0)
            target.plot(times, places[:, k], STYLES[k], color=COLOURS[k], linewidth=1.0, label=f"${'xyz'[k]}$, ±2σ")
        target.set_xlabel(name)
        target.set_ylabel("place")
        target.plot([], [], ":", color=INK, linewidth=1.2, label="2σ of the turn")
        beside = target.twinx()
        beside.plot(times, np.rad2deg(2 * band.turn), ":", color=INK, linewidth=1.2)
        beside.set_ylim(bottom=0)
        beside.set_ylabel("turn [°]")
        legend_above(target)
    return target


def plot_comparison(comparison: Comparison, axes: Axes | None = None) -> Axes:
    """Stationarity over the iterations of every solver, and what counts as zero; returns the axes.

    The figures are the solvers' own: IPOPT's are of the problem as it scales it.
    """
    return _plot_convergence(comparison.found, axes)


def plot_fairing(result: FairingResult, axes: Axes | None = None, *, kind: FairingKind = "history") -> Axes:
    """How a motion was made fair; returns the axes.

    kind: "history", G over the steps, the best net marked; "knots", the local measures that are
    left: L_kl over the net as a heat map, of a curve L_k before and after.
    """
    require_axes(axes)
    require_kind(kind, ("history", "knots"))
    if kind == "knots" and isinstance(result.motion, TwoParameterMotion):
        with on_axes(axes) as target:
            most = float(result.after.max()) or 1.0
            shades = draw_fairness(target, result.motion, result.after, (FLOOR * most, most))
            target.figure.colorbar(shades, ax=target, extend="min", label=r"$L_{kl}$ after fairing")
        return target
    with on_axes(axes) as target:
        target.set_yscale("log")
        if kind == "knots":
            knots = np.arange(1, len(result.after) + 1)
            target.plot(knots, _positive(result.before), "s--", color=COLOURS[1], markersize=3, label="before")
            target.plot(knots, _positive(result.after), "o-", color=COLOURS[0], markersize=3, label="after")
            if result.after.max() > 0:
                target.set_ylim(bottom=FLOOR * float(result.after.max()))
            target.set_xlabel("interior knot")
            target.set_ylabel("$L_k$")
        else:
            best = result.best_step
            few = len(result.history) <= MOST_MARKERS
            target.plot(_positive(result.history), ".-" if few else "-", color=COLOURS[0], linewidth=1.4)
            # The methods that solve for the net at once count iterations and have one G for each of few of them.
            best = min(best, len(result.history) - 1)
            label = f"best, G = {result.final:.3g} of {result.initial:.3g}"
            target.plot(best, result.history[best], "D", color=INK, markersize=5, label=label, clip_on=False)
            target.set_xlabel("step")
            target.set_ylabel("G")
        target.xaxis.set_major_locator(MaxNLocator(integer=True))
        legend_above(target)
    return target


def solver_names(solutions: Sequence[Solution]) -> list[str]:
    """Short names of the solutions' methods, numbered where one occurs twice, with the status of those not solved."""
    methods = [s.method for s in solutions]
    names = []
    for k, s in enumerate(solutions):
        name = f"{s.method} ({methods[: k + 1].count(s.method)})" if methods.count(s.method) > 1 else s.method
        names.append(name if s.status == "solved" else f"{name}: {s.status}")
    return names


def _plot_convergence(solutions: Sequence[Solution], axes: Axes | None) -> Axes:
    with on_axes(axes) as target:
        begun = len(target.lines)
        draw_convergence(target, solutions)
        methods = [s.method for s in solutions]
        for k, (line, name) in enumerate(zip(target.lines[begun:], solver_names(solutions), strict=True)):
            line.set(label=name, linewidth=1.4, markersize=4)
            # Of one method with other options: in its colour, but apart.
            line.set_linestyle(("-", "--", ":")[min(methods[:k].count(methods[k]), 2)])
        if not any(s.log for s in solutions):
            target.set_xticks([])
            target.set_yticks([])
            target.text(0.5, 0.5, "no iterations", transform=target.transAxes, ha="center", va="center")
        target.set_xlabel("iteration")
        target.set_ylabel("stationarity")
        legend_above(target)
    return target


def _plot_multipliers(solution: Solution, axes: Axes | None) -> Axes:
    sizes = keyframe_multipliers(solution)
    what = "keyframe" if sizes else "row of the constraint"
    if not sizes:
        raw = solution.program.split(solution.multiplier_vector)
        sizes = {name: np.linalg.norm(values, axis=1) for name, values in raw.items()}
    if not sizes:
        raise InputError("a program without constraints has no multipliers")
    if not all(np.isfinite(v).all() for v in sizes.values()):
        raise InputError(f"the multipliers are not finite ({solution.status}): kind='convergence' shows what happened")
    with on_axes(axes) as target:
        for k, (name, values) in enumerate(sizes.items()):
            colour, number = COLOURS[k % len(COLOURS)], np.arange(len(values))
            if len(values) <= MOST_MARKERS:
                # Side by side, so that none hides another.
                place = number + 0.16 * (k - (len(sizes) - 1) / 2)
                target.vlines(place, 0, values, color=colour, linewidth=1.2)
                target.plot(place, values, "os^vDx"[k % 6], color=colour, markersize=4, label=name)
            else:
                target.plot(*thinned(number, values), STYLES[k % 3], color=colour, linewidth=1.0, label=name)
        target.set_ylim(bottom=0)
        target.xaxis.set_major_locator(MaxNLocator(integer=True))
        target.set_xlabel(what)
        target.set_ylabel("size of multiplier ‖λ‖")
        legend_above(target)
    return target


def _positive(values: np.ndarray) -> np.ndarray:
    return np.where(values > 0, values, np.nan)
