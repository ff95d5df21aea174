"""What KKS say of other quaternion curves: smoothness lost by slerps and conversion, uneven speed; and uneven times."""

import numpy as np

from studies.quaternions.constructions import chain, forms, through
from studies.quaternions.uneven_curves import travels, uneven_times
from studies.shares import share, spread
from symmotion.motions.interpolants import monotone_curve, slerp_curve
from symmotion.motions.quaternions import exp, interpolate_quaternions
from symmotion.report import Column, Figure, Study, StudyOptions, StudyResult, Table, to_figure
from symmotion.views import (
    COLOURS,
    draw_sphere,
    draw_sphere_curve,
    draw_sphere_points,
    new_figure,
    on_sphere,
    view_from,
)

ANGLES = (30, 90, 150)
KEYS = 7
VIEW = view_from([1.0, 0.6, 0.7])
STYLES = ("-", "--", ":")
# Relative, of rates a rounding of the times before and after a knot.
ROUNDING = 1e-6


def run(options: StudyOptions) -> StudyResult:
    options.progress("continuity")
    continuity, lost = _continuity(range(200 if options.full else 5))
    options.progress("speed")
    speed, last, uneven = _speed(range(200 if options.full else 6))
    options.progress("uneven times")
    times, kept = uneven_times(100 if options.full else 4, (10.0, 100.0) if options.full else (100.0,))
    conclusion = (
        "KKS say that B-splines by recursive slerps are not C², nor Bézier curves that cubic B-spline curves are "
        f"converted to. Both hold. With neighbours {ANGLES[-1]}° apart the acceleration jumps at knots by {lost[0]} of "
        f"the largest where de Boor's algorithm runs on slerps, by {lost[1]} where its Bézier points make cumulative "
        "curves; of the cumulative B-spline curve it jumps by no more than rounding. Jumps of slerps grow as the "
        f"angle between neighbours to the power of {lost[2]:.3g}.\n\n"
        "KKS say that rational curves on the sphere, which are C², have less uniform speeds. Of the ratio of the "
        f"fastest to the slowest, the rational curve has the larger one beside the C² cumulative curve through the "
        f"same keyframes in {uneven}.\n\n"
        f"{kept} It cannot make one: about the axis from keyframe to keyframe it never turns back, as slerps do "
        "not. Cumulative curves over one basis interpolate and are monotone at once only where they stop at every "
        "keyframe, for each function then rises within its own interval."
    )
    answer = (
        f"By recursive slerps a B-spline's acceleration jumps at knots by {lost[0]} of its largest; rational curves "
        f"vary in speed by {last[0]}, the C² cumulative ones by {last[2]}."
    )
    figures = (_slerps(), _accelerations(), _speeds(), travels())
    return StudyResult((continuity, speed, times), figures, (), conclusion, answer=answer)


def _continuity(seeds: range) -> tuple[Table, tuple[str, str, float]]:
    rows, told = [], {}
    for degrees in ANGLES:
        jumps: dict[str, list[tuple[float, float]]] = {}
        for seed in seeds:
            for name, found in _jumps(chain(KEYS + 2, degrees, seed)).items():
                jumps.setdefault(name, []).append(found)
        for name, found in jumps.items():
            rates, accelerations = zip(*found, strict=True)
            rows.append((degrees, name, spread(rates), spread(accelerations)))
            told[degrees, name] = accelerations
    columns = (
        Column("neighbours apart", "°"),
        Column("curve"),
        Column("jump of the rate"),
        Column("jump of the acceleration"),
    )
    caption = (
        f"Uniform cubic B-splines with {KEYS + 2} control quaternions turned about random axes, {len(seeds)} sets: the "
        "largest jump at an inner knot over the largest value, median (least–most); 0 where it is rounding. Bézier "
        "points by thirds of slerps and their middles."
    )
    slerps, pieces = "de Boor with slerps", "converted to cumulative Bézier"
    growth = np.median(told[ANGLES[-1], slerps]) / np.median(told[ANGLES[0], slerps])
    power = float(np.log(growth) / np.log(ANGLES[-1] / ANGLES[0]))
    last = spread(told[ANGLES[-1], slerps]), spread(told[ANGLES[-1], pieces])
    return Table("continuity", columns, tuple(rows), caption), (*last, power)


def _jumps(q: np.ndarray) -> dict[str, tuple[float, float]]:
    """By curve the largest jump of rate and acceleration at a knot over the largest value; 0 where it is rounding."""
    knots, dense = np.arange(1.0, KEYS - 1), np.linspace(0, KEYS - 1, 101)[:-1]
    jumps = {}
    for name, (before, after) in forms(q).items():
        sizes = [np.linalg.norm(after(dense, order), axis=1).max() for order in (1, 2)]
        gaps = [np.linalg.norm(after(knots, order) - before(knots, order), axis=1).max() for order in (1, 2)]
        jumps[name] = tuple(float(g / s) if g > ROUNDING * s else 0.0 for g, s in zip(gaps, sizes, strict=True))
    return jumps


def _speed(seeds: range) -> tuple[Table, list[str], str]:
    dense = np.linspace(0, KEYS - 1, 601)
    rows, last, told = [], [], []
    for degrees in ANGLES:
        speeds: dict[str, list[tuple[float, float]]] = {}
        for seed in seeds:
            for name, (rate, acceleration) in through(chain(KEYS, degrees, seed), dense).items():
                size = np.linalg.norm(rate, axis=1)
                along = np.sum(rate * acceleration, axis=1) / size
                # Of what accelerates the body, the share that only changes its speed.
                tangential = float(np.sqrt(np.mean(along**2) / np.mean(np.sum(acceleration**2, axis=1))))
                speeds.setdefault(name, []).append((float(size.max() / size.min()), tangential))
        for name, found in speeds.items():
            ratios, tangential = zip(*found, strict=True)
            rows.append((degrees, name, spread(ratios), spread(tangential)))
        last = [spread([r for r, _ in found]) for found in speeds.values()]
        pairs = zip(speeds["rational spline"], speeds["C² cumulative"], strict=True)
        told.append(f"{share(sum(a > b for (a, _), (b, _) in pairs), len(seeds))} sets at {degrees}°")
    columns = (
        Column("neighbours apart", "°"),
        Column("curve"),
        Column("fastest over slowest"),
        Column("tangential share of the acceleration"),
    )
    caption = (
        f"Curves through {KEYS} keyframes turned about random axes at times one apart, {len(seeds)} sets; at 601 "
        "times, median (least–most). Tangential: the root mean square of d‖Ω‖/dt over that of ‖Ω̇‖."
    )
    return Table("speed", columns, tuple(rows), caption), last, ", ".join(told)


def _slerps() -> Figure:
    """KKS figure 1: the piecewise slerp, with the C² and the monotone curve through the same quaternions."""
    q = exp(np.array([[0, 0, 0], [0.5, 0.1, 0.1], [0.8, 0.6, 0.1], [0.6, 1.1, 0.3], [0.1, 1.2, 0.4]]))
    times = np.array([0.0, 1.0, 2.0, 3.0, 4.0])
    t = np.linspace(0, 4, 801)
    with new_figure(5.2, 4.6) as figure:
        axes = figure.subplots()
        draw_sphere(axes, VIEW)
        shown = {"piecewise slerp": slerp_curve(times, q), "C²": interpolate_quaternions(times, q)}
        shown["monotone"] = monotone_curve(times, q)
        for k, (name, curve) in enumerate(shown.items()):
            draw_sphere_curve(axes, on_sphere(curve(t)), COLOURS[k], style=STYLES[k], label=name, view=VIEW)
        draw_sphere_points(axes, on_sphere(q), COLOURS[0], size=4, view=VIEW)
        figure.legend(loc="outside upper left", ncols=3)
        caption = "Piecewise slerp (KKS figure 1) and smoother curves through the same quaternions, on the sphere."
        return to_figure(figure, "slerps", caption)


def _accelerations() -> Figure:
    """Left one component about the knot where curves made of Bézier pieces jump most; right all jumps by angle."""
    q, knots = chain(KEYS + 2, ANGLES[-1], 1), np.arange(1.0, KEYS - 1)
    shown = forms(q)
    before, after = shown["converted to cumulative Bézier"]
    jumps = after(knots, 2) - before(knots, 2)
    knot, component = np.unravel_index(np.abs(jumps).argmax(), jumps.shape)
    with new_figure(7.0, 3.2) as figure:
        left, right = figure.subplots(1, 2)
        for k, (name, (before, after)) in enumerate(shown.items()):
            style = {"linestyle": STYLES[k], "color": COLOURS[k], "linewidth": 1.6}
            for side, rates in ((-1, before), (1, after)):
                t = knots[knot] + side * np.linspace(0, 0.12, 60)
                left.plot(t, rates(t, 2)[:, component], **style, label=name if side > 0 else None)
        left.set(xlabel="t [s]", ylabel=f"{'xyz'[component]} of the angular acceleration [rad/s²]")
        angles = np.geomspace(10, 170, 5)
        by_angle = [_jumps(chain(KEYS + 2, angle, 1)) for angle in angles]
        for k, name in list(enumerate(shown))[1:]:
            size = [found[name][1] for found in by_angle]
            right.loglog(angles, size, STYLES[k], color=COLOURS[k], linewidth=1.6, marker="o", markersize=3)
        right.set(xlabel="neighbours apart [°]", ylabel="jump over largest acceleration")
        figure.legend(loc="outside upper left", ncols=3)
        caption = (
            f"Curves with the same control quaternions. Left: {ANGLES[-1]}° apart, about a knot, where the "
            "acceleration of those made of slerps and of Bézier pieces jumps. Right: the largest jump by angle; the "
            "cumulative B-spline curve has none."
        )
        return to_figure(figure, "accelerations", caption)


def _speeds() -> Figure:
    """The speeds of the curves of the table through one set of keyframes that are far apart."""
    t = np.linspace(0, KEYS - 1, 901)
    with new_figure(7.0, 3.0) as figure:
        axes = figure.subplots()
        for k, (name, (rate, _)) in enumerate(through(chain(KEYS, ANGLES[-1], 1), t).items()):
            axes.plot(t, np.linalg.norm(rate, axis=1), STYLES[k], color=COLOURS[k], label=name, linewidth=1.6)
        axes.set(xlabel="t [s]", ylabel="angular speed [rad/s]", ylim=(0, None))
        figure.legend(loc="outside upper left", ncols=3)
        caption = f"The speed of three curves through the same keyframes, {ANGLES[-1]}° apart at times one apart."
        return to_figure(figure, "speeds", caption)


STUDY = Study(
    "quaternion_constructions",
    "Do quaternion curves by slerps, by conversion and by rational splines lose what KKS say they lose?",
    "KKS 1, 3, 6.1, figure 1; Fritsch and Carlson 1980 for uneven times",
    run,
    order=27,
)
