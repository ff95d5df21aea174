"""A gallery of motion curves: control polygons, tangents, and what each family's parameters do to path and speed."""

from collections.abc import Callable, Sequence
from itertools import pairwise

import casadi as ca
import numpy as np
from matplotlib.axes import Axes
from scipy.interpolate import BSpline, CubicSpline

import symmotion as sm
from studies.curves.curve_players import dot_player
from symmotion.curves import (
    Curve,
    RationalQuadratic,
    Retimed,
    SymbolicSpline,
    arc_length,
    basis_matrix,
    bezier,
    blending_functions,
    catmull_rom,
    constant_speed,
    de_casteljau,
    hermite_spline,
    kochanek_bartels,
    polynomial_segment,
    slow_in_out,
    smooth_step,
    speed,
)
from symmotion.report import Column, Figure, Player, Study, StudyOptions, StudyResult, Table, Travelling, to_figure
from symmotion.splines import gauss
from symmotion.views import COLOURS, new_figure

INK = COLOURS[5]
POLYGON = np.array([[0.0, 0.0], [0.6, 1.8], [2.4, 2.0], [3.0, 0.2]])
# Unequal steps, so that the ways to choose times differ.
KEYS = np.array([[0.0, 0.0], [0.9, 1.4], [1.4, 1.3], [3.0, 0.0], [4.2, 1.2]])
RING = np.array([[0.0, 0.0], [1.5, 1.2], [3.4, 0.6], [2.6, -1.0], [1.0, -0.9], [0.0, 0.0]])


def run(options: StudyOptions) -> StudyResult:
    figures = []
    for draw in (_bezier, _conics, _constraints, _hermite, _catmull_rom, _tcb, _smooth, _bsplines, _timing):
        options.progress(draw.__name__.strip("_"))
        figures.append(draw())
    options.progress("agreement")
    agreement, worst = _agreement(options.full)
    families, smoothest = _families()
    circle = RationalQuadratic(np.array([[1, 0], [1, 1], [0, 1]]), np.sqrt(0.5))
    radius = np.linalg.norm(circle(np.linspace(0, 1, 1001)), axis=-1)
    cubic = bezier(POLYGON)
    even = constant_speed(cubic)
    passed = np.linspace(*even.domain, 12)[1:-1]
    error = max(abs(arc_length(cubic, 0.0, float(even.warp(s))) - s) for s in passed) / even.domain[1]
    conclusion = (
        f"All families agree with SciPy, or with another construction of the same curve, to {worst:.1g} of their "
        f"size. Weight √½ on a right angle gives a quarter circle, to {np.abs(radius - 1).max():.1g} of its radius.\n\n"
        f"Of the curves through the same keys and times, the {smoothest[0]} one costs the least ∫ ‖x''‖², "
        f"{smoothest[1]:.4g}, as it must; the price of a slope that is chosen locally is the difference to that.\n\n"
        f"The cubic Bézier curve's speed varies by a factor {_variation(cubic):.3g} along its path. Reparametrised by "
        f"arc length, it has passed the length it should at every time tried, to {error:.1g} of the whole."
    )
    dear = [row[1] for row in families.rows if row[0] != smoothest[0] and isinstance(row[1], float)]
    answer = (
        f"Of {len(families.rows)} curves through the same keys at the same times the {smoothest[0]} one bends least; "
        f"∫ ‖x''‖² of the others is {min(dear) / smoothest[1]:.3g} to {max(dear) / smoothest[1]:.3g} times as large."
    )
    return StudyResult((families, agreement), tuple(figures), (), conclusion, players=_players(), answer=answer)


def _players() -> tuple[Player, ...]:
    """A point on one path in four ways, and on three paths through the same keys."""
    passed = {label: Travelling(curve, curve.domain) for label, curve in _timed()}
    through = {
        f"{name} times": Travelling(catmull_rom(key_times(e) / key_times(e)[-1], KEYS), (0.0, 1.0))
        for name, e in (("uniform", 0.0), ("centripetal", 0.5), ("chordal", 1.0))
    }
    keys = np.linspace(0, 1, len(KEYS)), KEYS
    return (
        dot_player("one-path", passed, 0.09, "One path, passed in four ways in the same time."),
        dot_player(
            "three-times", through, 0.09, "Catmull–Rom splines through the same keys, grey, in unit time.", keys
        ),
    )


def _variation(curve: Curve) -> float:
    paces = speed(curve, np.linspace(*curve.domain, 2001))
    return float(paces.max() / paces.min())


def _path(axes: Axes, curve: Curve, colour: str = COLOURS[0], label: str | None = None, style: str = "-") -> None:
    axes.plot(*curve(np.linspace(*curve.domain, 401)).T, style, color=colour, label=label)


def _polygon(axes: Axes, points: np.ndarray) -> None:
    axes.plot(*np.asarray(points).T, "o-", color=INK, linewidth=0.8, markersize=3.5, alpha=0.6)


def _keys(axes: Axes, points: np.ndarray) -> None:
    axes.plot(*np.asarray(points).T, "o", color=INK, markersize=3.5)


def _tangents(axes: Axes, curve: Curve, times: np.ndarray, colour: str, scale: float = 0.25) -> None:
    """Tangents at times, as far as the curve would go in `scale` units of time; both sides where they differ."""
    inside = 1e-9 * (curve.domain[1] - curve.domain[0])
    for t in times:
        here = curve(t)
        for side, moment in ((-1, max(t - inside, curve.domain[0])), (1, min(t + inside, curve.domain[1]))):
            there = here + side * scale * curve(moment, 1)
            axes.plot([here[0], there[0]], [here[1], there[1]], color=colour, linewidth=0.9, alpha=0.7)


def _speeds(axes: Axes, curve: Curve, colour: str = COLOURS[0], style: str = "-") -> None:
    # Piece by piece, so that a jump is drawn as one.
    edge = 1e-9 * (curve.domain[1] - curve.domain[0])
    breaks = curve.breakpoints
    for a, b in pairwise(breaks):
        t = np.linspace(a + edge, b - edge, 121)
        axes.plot(t, speed(curve, t), style, color=colour)


def _side_by_side(
    name: str, caption: str, curves: Sequence[tuple[str, Curve]], under: Callable[[Axes], None], legend: int = 4
) -> Figure:
    """Paths at the left over what `under` draws, their speeds at the right."""
    with new_figure(7.0, 2.9) as figure:
        path, graph = figure.subplots(1, 2, width_ratios=(1.25, 1))
        under(path)
        for (label, curve), colour in zip(curves, COLOURS, strict=False):
            _path(path, curve, colour, label)
            _speeds(graph, curve, colour)
        _as_plane(path)
        graph.set_xlabel("time")
        graph.set_ylabel("speed")
        graph.set_ylim(0, None)
        figure.legend(*path.get_legend_handles_labels(), loc="outside upper left", ncols=legend)
        return to_figure(figure, name, caption)


def _as_plane(axes: Axes) -> None:
    axes.set_aspect("equal", adjustable="datalim")
    axes.set_xlabel("x")
    axes.set_ylabel("y")


def _bezier() -> Figure:
    u = 0.4
    with new_figure(7.0, 2.9) as figure:
        path, graph = figure.subplots(1, 2, width_ratios=(1.25, 1))
        curve = bezier(POLYGON)
        levels = de_casteljau(POLYGON, u)
        _polygon(path, POLYGON)
        for level, colour in zip(levels[1:-1], (COLOURS[1], COLOURS[2]), strict=True):
            path.plot(*level.T, "o-", color=colour, linewidth=1.0, markersize=3.5)
        _path(path, curve, label="cubic")
        path.plot(*levels[-1].T, "o", color=COLOURS[0])
        moved = POLYGON.copy()
        moved[2] += [0.4, 1.0]
        changed = bezier(moved)
        _path(path, changed, COLOURS[3], "one control point moved")
        path.plot(*moved[1:].T, "o--", color=INK, linewidth=0.8, markersize=3.5, alpha=0.35)
        _speeds(graph, curve)
        _speeds(graph, changed, COLOURS[3])
        graph.axvline(u, color=INK, linewidth=0.8, linestyle=":")
        graph.set_xlabel("u")
        graph.set_ylabel("speed")
        graph.set_ylim(0, None)
        _as_plane(path)
        figure.legend(*path.get_legend_handles_labels(), loc="outside upper left", ncols=2)
        caption = f"Cubic Bézier curves with their control polygons, and de Casteljau's construction at u = {u:g}."
        return to_figure(figure, "bezier", caption)


def _conics() -> Figure:
    corner = np.array([[1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    weights = (0.2, np.sqrt(0.5), 1.0, 2.5)
    curves = [RationalQuadratic(corner, w) for w in weights]
    return _side_by_side(
        "conics",
        "Rational quadratics over one control polygon: a weight below 1 gives an ellipse, √½ on this right angle the "
        "circle, 1 the parabola, above 1 a hyperbola, which is slow near the middle control point.",
        [(f"w = {c.weight:.3g}, {c.kind}", c) for c in curves],
        lambda axes: _polygon(axes, corner),
        2,
    )


def _constraints() -> Figure:
    conditions = [(0.0, 0), (0.5, 0), (0.5, 1), (1.0, 0)]
    u = np.linspace(0, 1, 401)
    with new_figure(7.0, 2.9) as figure:
        blends, graph = figure.subplots(1, 2)
        functions = blending_functions(conditions)(u)
        for k, label in enumerate(("$x(0)$", "$x(½)$", "$x'(½)$", "$x(1)$")):
            blends.plot(u, functions[:, k], color=COLOURS[k], label=label)
        blends.set_xlabel("u")
        blends.set_ylabel("blending function")
        blends.legend(fontsize=8)
        for slope, colour in zip((-3.0, 0.0, 3.0), COLOURS, strict=False):
            curve = polynomial_segment(conditions, [0.0, 1.0, slope, 0.5])
            graph.plot(u, curve(u), color=colour, label=f"slope {slope:g}".replace("-", "−"))
        graph.plot([0, 0.5, 1], [0.0, 1.0, 0.5], "o", color=INK)
        graph.set_xlabel("u")
        graph.set_ylabel("x")
        graph.legend(fontsize=8)
        entry = basis_matrix(conditions)[2, 1]
        return to_figure(
            figure,
            "constraints",
            "A cubic from its end points, its middle and the slope there: the four blending functions, and the segment "
            f"for three slopes. Row 3, column 2 of the basis matrix is {entry:g}; the notes print 5.",
        )


def _hermite() -> Figure:
    times, values = np.array([0.0, 1.0, 2.0]), np.array([[0.0, 0.0], [2.0, 1.2], [4.0, 0.0]])
    ends = np.array([[1.0, 2.0], [2.0, 0.0], [1.0, -2.0]])
    fall = ends * np.array([[1.0], [0.0], [1.0]]) + np.array([[0, 0], [1.5, -2.5], [0, 0]])
    rise = fall * [1, -1]
    curves = [
        ("slopes as given", hermite_spline(times, values, ends)),
        ("twice as long", hermite_spline(times, values, 2 * ends)),
        ("broken at the middle key", hermite_spline(times, values, fall, np.vstack([ends[:1], rise[1:2], ends[2:]]))),
    ]

    def under(axes: Axes) -> None:
        _keys(axes, values)
        for (_, curve), colour in zip(curves, COLOURS, strict=False):
            _tangents(axes, curve, times, colour, 0.2)

    caption = (
        "Hermite splines with their tangents. Longer tangents carry the curve further before it turns; a slope on each "
        "side of a key breaks the tangent, and the speed may jump."
    )
    return _side_by_side("hermite", caption, curves, under)


def key_times(exponent: float) -> np.ndarray:
    """Times of the gallery's keys over [0, 4], steps in proportion to their distance to the power `exponent`."""
    steps = np.linalg.norm(np.diff(KEYS, axis=0), axis=1) ** exponent
    return 4 * np.concatenate([[0.0], np.cumsum(steps) / steps.sum()])


def _catmull_rom() -> Figure:
    curves = [
        (name, catmull_rom(key_times(e), KEYS)) for name, e in (("uniform", 0.0), ("centripetal", 0.5), ("chordal", 1))
    ]

    def under(axes: Axes) -> None:
        _keys(axes, KEYS)
        for (_, curve), e, colour in zip(curves, (0.0, 0.5, 1.0), COLOURS, strict=False):
            _tangents(axes, curve, key_times(e), colour, 0.2)

    caption = (
        "Catmull–Rom splines through the same keys with three choices of times, and their tangents; the second-order "
        "ends follow the parabola through the last three keys. Unequal times keep the short segment from overshooting."
    )
    return _side_by_side("catmull-rom", caption, curves, under)


def _tcb() -> Figure:
    times = np.arange(5.0)
    one = np.array([0.0, 0.0, 1.0, 0.0, 0.0])
    zigzag = np.column_stack([times, [0.0, 0.2, 1.4, 0.2, 0.0]])
    with new_figure(7.0, 4.6) as figure:
        panels = figure.subplots(2, 3, sharey="row", sharex="row")
        for column, name in enumerate(("tension", "continuity", "bias")):
            path, graph = panels[:, column]
            for value, colour in ((-1.0, COLOURS[1]), (0.0, INK), (1.0, COLOURS[0])):
                curve = kochanek_bartels(times, zigzag, **{name: value * one})  # pyright: ignore[reportArgumentType]
                _path(path, curve, colour, f"{value:+g}".replace("-", "−") if value else "0")
                _speeds(graph, curve, colour)
                _tangents(path, curve, times[2:3], colour, 0.3)
            _keys(path, zigzag)
            path.set_title(f"{name} of the middle key")
            path.set_xlabel("x")
            graph.set_xlabel("time")
        panels[0, 0].set_ylabel("y")
        panels[1, 0].set_ylabel("speed")
        panels[1, 0].set_ylim(0, None)
        figure.legend(*panels[0, 0].get_legend_handles_labels(), loc="outside upper left", ncols=3)
        return to_figure(
            figure,
            "kochanek-bartels",
            "Kochanek–Bartels splines with −1, 0 and 1 for each parameter of the middle key. Positive bias follows the "
            "incoming chord and overshoots; the notes have the opposite sign.",
        )


def _smooth() -> Figure:
    times = np.linspace(0, 5, len(RING))
    curves = [
        ("natural", sm.splines.cubic_interpolant(times, RING)),
        ("clamped, at rest", sm.splines.cubic_interpolant(times, RING, "clamped", np.zeros((2, 2)))),
        ("periodic", sm.splines.cubic_interpolant(times, RING, "periodic")),
    ]
    with new_figure(7.0, 4.4) as figure:
        panels = figure.subplot_mosaic([["path", "speed"], ["path", "bend"]], width_ratios=(1.25, 1))
        path, graph, bend = panels["path"], panels["speed"], panels["bend"]
        for (label, curve), colour in zip(curves, COLOURS, strict=False):
            _path(path, curve, colour, label)
            _speeds(graph, curve, colour)
            t = np.linspace(*curve.domain, 401)
            bend.plot(t, np.linalg.norm(curve(t, 2), axis=1), color=colour)
        _keys(path, RING)
        _as_plane(path)
        for axes, label in ((graph, "speed"), (bend, "size of the acceleration")):
            axes.set_xlabel("time")
            axes.set_ylabel(label)
            axes.set_ylim(0, None)
        figure.legend(*path.get_legend_handles_labels(), loc="outside upper left", ncols=3)
        return to_figure(
            figure,
            "c2-cubics",
            "C² cubic splines through a closed ring of keys. Natural ends have no acceleration, clamped ones the speed "
            "asked for, periodic ones go on as they began.",
        )


def _bsplines() -> Figure:
    controls = np.array([[0, 0], [0.6, 1.6], [1.8, 1.8], [2.4, 0.2], [3.6, 0.4], [4.2, 1.6]], dtype=float)
    with new_figure(7.0, 5.0) as figure:
        (path, graph), (knots, sensitivity) = figure.subplots(2, 2)
        _polygon(path, controls)
        for degree, colour in zip((1, 2, 3, 5), COLOURS, strict=False):
            basis = sm.splines.BSplineBasis.clamped(np.linspace(0, 1, len(controls) - degree + 1), degree)
            curve = sm.splines.Spline(basis, controls)
            _path(path, curve, colour, f"order {degree + 1}")
            _speeds(graph, curve, colour)
        graph.set_xlabel("time")
        graph.set_ylabel("speed")
        graph.set_ylim(0, None)
        _polygon(knots, controls)
        for middle, colour in zip((0.15, 0.4, 0.65), (COLOURS[1], COLOURS[2], COLOURS[0]), strict=True):
            curve = sm.splines.Spline(
                sm.splines.BSplineBasis(np.array([0, 0, 0, 0, middle, 0.8, 1, 1, 1, 1]), 3), controls
            )
            _path(knots, curve, colour, f"{middle:g}")
        knots.legend(title="knot at", fontsize=8, title_fontsize=8, loc="lower left", ncols=3)
        symbol, t = ca.SX.sym("knot"), ca.SX.sym("t")
        symbolic = SymbolicSpline(ca.vertcat(0, 0, 0, 0, symbol, 0.8, 1, 1, 1, 1), controls, 3)
        slope = ca.Function("slope", [t, symbol], [ca.jacobian(symbolic(t), symbol).T])
        u = np.linspace(0, 1, 401)
        derivative = np.array(slope.map(len(u))(u[None], 0.4)).reshape(len(u), 2)
        for k, name in enumerate("xy"):
            sensitivity.plot(u, derivative[:, k], color=COLOURS[2], linestyle=("-", "--")[k], label=f"∂{name}/∂knot")
        sensitivity.set_xlabel("time")
        sensitivity.set_ylabel("derivative, knot at 0.4")
        sensitivity.legend(fontsize=8)
        for axes in (path, knots):
            _as_plane(axes)
        figure.legend(*path.get_legend_handles_labels(), loc="outside upper left", ncols=4)
        return to_figure(
            figure,
            "b-splines",
            "B-splines over one control polygon: by order (above), and cubic with one knot moved (below), with the "
            "derivative of the curve by that knot from the symbolic Cox–de Boor recursion.",
        )


def _timed() -> list[tuple[str, Curve]]:
    curve = bezier([[0, 0], [0.3, 2.2], [1.0, -0.6], [4.5, 1.2]])
    even = constant_speed(curve, (0.0, 1.0))
    return [
        ("as given", curve),
        ("constant speed", even),
        ("slow-in, slow-out", Retimed(even, slow_in_out(0.3, 0.3))),
        ("smooth step", Retimed(even, smooth_step(2))),
    ]


def _timing() -> Figure:
    curves = _timed()
    length = arc_length(curves[0][1])
    with new_figure(7.0, 3.6) as figure:
        path, graph = figure.subplots(1, 2, width_ratios=(1.25, 1))
        for k, ((label, timed), colour) in enumerate(zip(curves, COLOURS, strict=False)):
            below = np.array([0.0, -0.9 * k])
            path.plot(*(timed(np.linspace(0, 1, 201)) + below).T, color=colour, linewidth=0.8)
            path.plot(*(timed(np.linspace(0, 1, 21)) + below).T, "o", color=colour, markersize=3, label=label)
            graph.plot(*_pace(timed), color=colour)
        path.set_aspect("equal", adjustable="datalim")
        path.set_axis_off()
        graph.axhline(length, color=INK, linewidth=0.8, linestyle=":")
        graph.set_xlabel("time")
        graph.set_ylabel("speed")
        graph.set_ylim(0, None)
        figure.legend(*path.get_legend_handles_labels(), loc="outside upper left", ncols=4)
        return to_figure(
            figure,
            "timing",
            f"One path of length {length:.3g}, passed in four ways in unit time: positions at 21 equal steps of time, "
            "and speeds; dotted: the mean speed.",
        )


def _pace(curve: Curve) -> tuple[np.ndarray, np.ndarray]:
    t = np.linspace(0, 1, 401)
    return t, speed(curve, t)


def _families() -> tuple[Table, tuple[str, float]]:
    """The curves through the gallery's keys at centripetal times: cost, length, speed; and the one that costs least."""
    times = key_times(0.5)
    curves = {
        "natural": sm.splines.cubic_interpolant(times, KEYS),
        "not-a-knot": sm.splines.cubic_interpolant(times, KEYS, "not-a-knot"),
        "Catmull–Rom": catmull_rom(times, KEYS),
        "Catmull–Rom, natural ends": catmull_rom(times, KEYS, "natural"),
        "Kochanek–Bartels, tension 0.5": kochanek_bartels(times, KEYS, tension=0.5),
        "Kochanek–Bartels, continuity 0.5": kochanek_bartels(times, KEYS, continuity=0.5),
        "Kochanek–Bartels, bias 0.5": kochanek_bartels(times, KEYS, bias=0.5),
        "Hermite, slopes zero": hermite_spline(times, KEYS, np.zeros_like(KEYS)),
    }
    rows = []
    for name, curve in curves.items():
        points, weights = gauss(curve.basis, 2)
        bend = float(np.sum(weights.ravel() * np.sum(curve(points.ravel(), 2) ** 2, axis=1)))
        paces = speed(curve, np.linspace(*curve.domain, 2001))
        jumps = [_jump(curve, times[1:-1], nu) for nu in (1, 2)]
        rows.append((name, bend, arc_length(curve), float(paces.min()), float(paces.max()), *jumps))
    columns = ("curve", "∫ ‖x''‖²", "length", "least speed", "largest speed", "largest jump of x'", "of x''")
    table = Table(
        "the same keys, the same times",
        tuple(Column(c) for c in columns),
        tuple(rows),
        "The gallery's five keys at centripetal times over 4 units of time; jumps at the keys, 0 where below rounding.",
    )
    best = min(rows, key=lambda r: r[1])
    return table, (best[0], best[1])


def _jump(curve: sm.splines.Spline, times: np.ndarray, nu: int) -> float:
    """The largest jump of a derivative at times; 0 below rounding."""
    jumps = curve(times, nu) - curve(np.nextafter(times, -np.inf), nu)
    worst = float(np.linalg.norm(jumps, axis=1).max())
    return worst if worst > 1e-9 else 0.0


def _agreement(full: bool) -> tuple[Table, float]:
    """Each family beside SciPy or another construction, on random keys; and the largest difference."""
    rng = np.random.default_rng(6)
    rows = []
    for count in (5, 20, 100) if full else (5, 20):
        times, values = np.cumsum(rng.uniform(0.3, 1.0, count)), rng.normal(size=(count, 2))
        values[-1] = values[0]
        t = np.linspace(times[0], times[-1], 1001)
        size = np.abs(values).max()

        def row(name: str, curve: np.ndarray, other: np.ndarray, against: str, count=count, size=size) -> None:
            rows.append((name, count, against, float(np.abs(curve - other).max() / size)))

        for ends in ("natural", "not-a-knot", "periodic"):
            ours, theirs = sm.splines.cubic_interpolant(times, values, ends), CubicSpline(times, values, bc_type=ends)
            row(f"C² cubic, {ends}", ours(t), theirs(t), "SciPy CubicSpline")
        natural = sm.splines.cubic_interpolant(times, values)
        again = hermite_spline(times, values, natural(times, 1))
        row("Hermite, the natural spline's slopes", again(t), natural(t), "SciPy CubicSpline")
        parabola = np.polynomial.Polynomial([1.0, -2.0, 0.5])
        row("Catmull–Rom of a parabola", catmull_rom(times, parabola(times))(t), parabola(t), "the parabola")
        knots = np.concatenate([np.full(4, times[0]), times[1:-1], np.full(4, times[-1])])
        controls = rng.normal(size=(count + 2, 2))
        symbols = ca.SX.sym("knot", len(knots)), ca.SX.sym("control", *controls.shape)
        function = ca.Function("curve", list(symbols), [SymbolicSpline(*symbols, 3)(t[::10])])
        theirs = BSpline(knots, controls, 3)(t[::10])
        row("B-spline, symbolic Cox–de Boor", np.asarray(function(knots, controls)), theirs, "SciPy BSpline")
        points = rng.normal(size=(min(count, 12), 2))
        built = np.array([de_casteljau(points, u)[-1][0] for u in np.linspace(0, 1, 101)])
        row(f"Bézier, degree {len(points) - 1}", bezier(points)(np.linspace(0, 1, 101)), built, "de Casteljau")
    table = Table(
        "agreement",
        (Column("curve"), Column("keys"), Column("beside"), Column("largest difference, relative")),
        tuple(rows),
        "Over 1001 times (101 for the last two), relative to the largest value.",
    )
    return table, max(r[3] for r in rows)


STUDY = Study(
    "motion_curves",
    "Which motion curves are there, and what do their parameters do to path and speed?",
    "Lecture notes on motion curves",
    run,
    order=50,
)
