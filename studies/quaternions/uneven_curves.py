"""How far curves of many kinds turn through keyframes at uneven times, where C² ones overshoot by whole turns."""

from collections.abc import Callable
from typing import Any

import numpy as np

import symmotion as sm
from studies.quaternions.far_turns import asked, far_keys
from studies.shares import interval, share, spread
from symmotion.motions.interpolants import barry_goldman, monotone_curve, slerp_curve, squad
from symmotion.motions.quaternions import ProductMotion, angles_travelled, interpolate_quaternions
from symmotion.report import Column, Figure, Table, to_figure
from symmotion.splines import cubic_interpolant
from symmotion.views import COLOURS, new_figure

CURVES: dict[str, Callable[[np.ndarray, np.ndarray], Any]] = {  # Any: whatever has a jet
    "C² cumulative, Newton": interpolate_quaternions,
    "C² cardinal functions": lambda t, q: ProductMotion.over(cubic_interpolant(t, np.eye(len(t))), q),
    "Catmull–Rom, cumulative": lambda t, q: ProductMotion.over(sm.curves.catmull_rom(t, np.eye(len(t))), q),
    "cardinal, tension 1/2": lambda t, q: ProductMotion.over(
        sm.curves.kochanek_bartels(t, np.eye(len(t)), tension=0.5), q
    ),
    "Catmull–Rom, Barry and Goldman": barry_goldman,
    "squad": squad,
    "monotone, C¹": monotone_curve,
    "slerp": slerp_curve,
}
DRAWN = ("C² cumulative, Newton", "squad", "monotone, C¹")


def uneven_times(cases: int, ratios: tuple[float, ...]) -> tuple[Table, str]:
    """Every curve by ratio of intervals, and in sentences what the monotone one does at the largest."""
    rows, told = [], ""
    for ratio in ratios:
        for name, make in CURVES.items():
            within, over = 0, []
            for seed in range(cases):
                times, q, *_ = far_keys(6 * seed, ratio)
                try:
                    curve = make(times, q)
                except sm.SolveError:
                    continue
                far = angles_travelled(curve, times)
                within += bool((far - angles_travelled(slerp_curve(times, q)) < 2 * np.pi).all())
                over.append(far.sum() / asked(q, None))
            found = len(over)
            rows.append((ratio, name, found, cases, within, *interval(within, found), spread(over)))
            if name.startswith("monotone"):
                told = (
                    f"At intervals uneven by {ratio:g} the monotone curve turns {spread(over)} times as far as asked, "
                    f"and in {share(within, found)} cases nowhere by a whole turn more."
                )
    columns = (
        Column("intervals uneven by"),
        Column("curve"),
        Column("found"),
        Column("of"),
        Column("no whole turn more"),
        Column("share, at least", "%"),
        Column("at most", "%"),
        Column("travelled over asked"),
    )
    caption = (
        "Keyframes of the study quaternion_curves: 4 to 12, turned by up to 179° about random axes, natural ends. "
        "Shares with Wilson's 95 % interval; turns as median (least–most)."
    )
    return Table("uneven times", columns, tuple(rows), caption), told


def travels(seed: int = 6, ratio: float = 100.0) -> Figure:
    """How far curves have turned, over the number of the keyframe: intervals are of very different length."""
    times, q, *_ = far_keys(seed, ratio)
    between = 40
    t = np.unique(np.concatenate([times[-1:], np.linspace(times[:-1], times[1:], between, endpoint=False).ravel()]))
    place = np.interp(t, times, np.arange(len(times)))
    with new_figure(7.0, 3.2) as figure:
        axes = figure.subplots()
        for k, name in enumerate(DRAWN):
            far = np.append(0.0, np.cumsum(angles_travelled(CURVES[name](times, q), t)))
            axes.plot(place, far / (2 * np.pi), ("-", "--", ":")[k], color=COLOURS[k], label=name, linewidth=1.6)
        least = np.append(0.0, np.cumsum(angles_travelled(slerp_curve(times, q))))
        axes.plot(np.arange(len(times)), least / (2 * np.pi), "o", color="#000000", markersize=3.5, label="asked")
        axes.set(xlabel="keyframe", ylabel="turns travelled", xticks=np.arange(len(times)))
        figure.legend(loc="outside upper left", ncols=4)
        lengths = ", ".join(f"{h:.3g}" for h in np.diff(times))
        caption = f"How far three curves turn through the same keyframes. Intervals [s]: {lengths}."
        return to_figure(figure, "travels", caption)
