"""KKS 6.1: how much torque do quaternion curves need, and how little would do?"""

from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.spatial.transform import RotationSpline

import symmotion as sm
from studies.quaternions.constructions import chain
from studies.quaternions.uneven_torque import uneven_torque
from studies.shares import spread
from symmotion.bodies import wedge
from symmotion.motions.interpolants import shoemake_bezier, shoemake_interpolant, squad
from symmotion.motions.quaternions import QuaternionMotion, interpolate_quaternions, to_rotation
from symmotion.report import Column, Figure, Player, Run, Study, StudyOptions, StudyResult, Table, player, to_figure
from symmotion.views import COLOURS, new_figure

INERTIA = np.array([1.0, 2.0, 2.5])
ANGLES = (10, 30, 60, 90, 120, 150, 210, 270, 330)
KNOTS = (1, 2, 4, 8)


def run(options: StudyOptions) -> StudyResult:
    seeds = range(200 if options.full else 40)
    options.progress("Bézier curves")
    bezier = _bezier(seeds)
    options.progress("curves through keyframes")
    interpolants, runs, ratios = _interpolants(range(10 if options.full else 3))
    options.progress("knots and inertia")
    knots, more = _knots()
    options.progress("a rate bound")
    bounded, figure, moving, last = _bounded()
    uneven, surely = uneven_torque(options)
    polygons: list[tuple[Any, ...]] = list(bezier.rows)
    first, short = polygons[0], next(r for r in polygons if r[0] == 150)
    inside = [r[0] for r in polygons if r[1] is not None and abs(r[1] - 1) <= 0.05]
    jumping = [f"{r[5]:.3g} % at {r[0]}°" for r in polygons if r[5] > 0]
    less = [f"{r[4]:.3g} % at {r[0]}°" for r in polygons if r[0] > 180 and r[4] is not None]
    gains: dict[Any, tuple[Any, ...]] = {r[0]: r for r in interpolants.rows}
    falls: list[tuple[Any, ...]] = [r for r in knots.rows if r[0] == "asymmetric"]
    conclusion = (
        "KKS 6.1 say that their cubic curves need about the torque of Shoemake's, within 5 %, for small angles "
        "between "
        f"control quaternions, and much less for large ones. Measured over {len(seeds)} random control polygons "
        f"per angle: "
        f"at {first[0]}° the median ratio of ∫‖Ω̇‖² is {first[1]:.4g}, and it stays within 5 % of one up to "
        f"{max(inside, default=0)}°. Up to {short[0]}° it grows to {short[1]:.4g}, and the cumulative curve "
        f"needs less in "
        f"{short[4]:.3g} % of the polygons: the gain does not show while neighbours are less than half a turn apart. "
        f"Where they are further apart the cumulative curve needs less in {', '.join(less) or 'no case'}: the "
        f"claim holds for "
        f"ways near a whole turn. "
        + (
            f"Shoemake's curve jumps in {', '.join(jumping)} of the polygons."
            if jumping
            else "Neither curve ever jumps."
        )
        + "\n\n"
        f"Through keyframes 90° apart, relative to the optimum with 8 knots per interval, the C² quaternion "
        f"spline needs "
        f"{gains[90][1]:.4g} times the energy, Shoemake's curve {gains[90][2]:.4g}, squad {gains[90][3]:.4g} "
        f"and SciPy's "
        f"RotationSpline {gains[90][4]:.4g} (medians).\n\n"
        f"With moments of inertia 1, 2, 2.5 the optimum falls from {falls[0][2]:.6g} with one knot per interval to "
        f"{falls[-1][2]:.6g} with eight; the C² spline needs {falls[-1][4]:.4g} times as much. {bounded}\n\n{surely}"
    )
    c2, shoemakes, squads, _ = (spread(found, 4) for found in zip(*ratios[90], strict=True))
    answer = (
        f"Through keyframes 90° apart the C² quaternion spline needs {c2} times the least torque energy, Shoemake's "
        f"curve {shoemakes}, squad {squads}, over {len(ratios[90])} random sets."
    )
    tables, runs = (bezier, interpolants, knots, uneven), (*runs, *more, *last)
    return StudyResult(tables, (figure,), runs, conclusion, players=(moving,), answer=answer)


def energy(curve: Callable[[np.ndarray], Any], times: np.ndarray, nodes: int = 24) -> float:
    """∫ ‖Ω̇‖² dt by Gauss nodes between consecutive times; curve: from times to angular accelerations."""
    x, w = np.polynomial.legendre.leggauss(nodes)
    half = np.diff(times) / 2
    t = (times[1:] + times[:-1])[:, None] / 2 + half[:, None] * x
    return float(half @ (np.sum(np.asarray(curve(t.ravel())).reshape(*t.shape, 3) ** 2, axis=2) @ w))


def _bezier(seeds: range) -> Table:
    rows: list[tuple[Any, ...]] = []
    span, dense = np.linspace(0, 1, 9), np.linspace(0, 1, 2001)
    for degrees in ANGLES:
        ratios, torn = [], 0
        for seed in seeds:
            q = chain(4, degrees, seed)
            ours, theirs = QuaternionMotion.bezier(q, signs="keep"), shoemake_bezier(q, signs="keep")
            # The shortest way between two intermediate curves that wind apart changes sides: the curve jumps.
            if np.linalg.norm(np.diff(theirs(dense), axis=0), axis=1).max() > 0.3:
                torn += 1
                continue
            ratios.append(energy(ours.acceleration, span) / energy(lambda t, c=theirs: c.jet(t).acceleration, span))
        low, middle, high = (float(v) for v in np.quantile(ratios, [0.25, 0.5, 0.75])) if ratios else (None,) * 3
        less = 100 * float(np.mean(np.array(ratios) < 1)) if ratios else None
        rows.append((degrees, middle, low, high, less, 100 * torn / len(seeds)))
    columns = (
        Column("between control quaternions", "°"),
        Column("ratio, median"),
        Column("lower quartile"),
        Column("upper quartile"),
        Column("ours less", "%"),
        Column("Shoemake's jumps", "%"),
    )
    caption = (
        "∫‖Ω̇‖² of the cumulative cubic Bézier curve over that of Shoemake's with the same random control "
        "quaternions, "
        "signs kept: beyond 180° both turn the long way. Where Shoemake's curve jumps its torque is infinite, "
        "and it is "
        "left out of the ratios."
    )
    return Table("cumulative against recursive", columns, tuple(rows), caption)


def _interpolants(seeds: range) -> tuple[Table, list[Run], dict[int, list[list[float]]]]:
    """The table, the runs, and by angle the ratios of every set of keyframes."""
    rows, runs, t = list[tuple[Any, ...]](), list[Run](), np.arange(8.0)
    found: dict[int, list[list[float]]] = {}
    for degrees in (15, 45, 90, 130):
        ratios = found.setdefault(degrees, [])
        for seed in seeds:
            q = chain(8, degrees, seed)
            spline = interpolate_quaternions(t, q)
            program = sm.orientation_program(t, q, refine=7)
            solution = sm.ExactNewton().solve(program)
            runs.append(Run.of(f"8 keyframes, {degrees}°, seed {seed}", solution))
            least = sm.measure(solution.motion, sm.Torque())
            shoemake, squads = shoemake_interpolant(t, q), squad(t, q)
            rotations = RotationSpline(t, to_rotation(q))
            ratios.append(
                [
                    sm.measure(spline, sm.Torque()) / least,
                    energy(lambda s, c=shoemake: c.jet(s).acceleration, t) / least,
                    energy(lambda s, c=squads: c.jet(s).acceleration, t) / least,
                    energy(lambda s, c=rotations: c(s, 2), t) / least,
                ]
            )
        rows.append((degrees, *(float(r) for r in np.median(ratios, axis=0))))
    columns = (
        Column("between keyframes", "°"),
        Column("C² quaternion spline"),
        Column("Shoemake's Bézier"),
        Column("squad"),
        Column("SciPy RotationSpline"),
    )
    caption = f"∫‖Ω̇‖² over the optimum with 8 knots per interval; medians of {len(seeds)} random sets of 8 keyframes."
    return Table("through keyframes", columns, tuple(rows), caption), runs, found


def _knots() -> tuple[Table, list[Run]]:
    rows, runs, t, q = list[tuple[Any, ...]](), list[Run](), np.arange(8.0), chain(8, 70, 3)
    for name, inertia in (("unit", None), ("asymmetric", INERTIA)):
        spline = sm.measure(interpolate_quaternions(t, q), sm.Torque(inertia))
        for knots in KNOTS:
            program = sm.orientation_program(t, q, objective=sm.Torque(inertia), refine=knots - 1)
            comparison = sm.compare(program, [sm.ExactNewton(), sm.Ipopt()])
            runs += [Run.of(f"{name} inertia, {knots} knots per interval", s) for s in comparison.solutions]
            best = comparison.best
            if best is None:
                raise sm.SolveError(f"no solver solved {name} inertia, {knots} knots")
            value = sm.measure(best.motion, sm.Torque(inertia))
            rows.append((name, knots, value, best.iterations, spline / value))
    columns = (
        Column("inertia"),
        Column("knots per interval"),
        Column("∫‖τ‖² at the optimum"),
        Column("iterations"),
        Column("C² spline over optimum"),
    )
    return Table("optima by knots", columns, tuple(rows), "8 keyframes, neighbours 70° apart, moments 1, 2, 2.5."), runs


def _bounded() -> tuple[str, Figure, Player, list[Run]]:
    t, q = np.arange(8.0), chain(8, 70, 3)
    free = sm.ExactNewton().solve(sm.orientation_program(t, q, refine=3))
    x = np.linspace(0, 7, 1401)
    speeds = np.linalg.norm(free.motion.rate(x), axis=1)
    most = 0.93 * float(speeds.max())
    program = sm.orientation_program(t, q, refine=3, constraints=[sm.RateBound(most)])
    held = sm.Ipopt().solve(program)
    runs = [Run.of("free, 4 knots per interval", free), Run.of("rate bounded", held)]
    active = int(np.sum(held.multipliers["rate bound"] > 1e-6))
    slow = np.linalg.norm(held.motion.rate(x), axis=1)
    with new_figure(7.0, 2.8) as figure:
        axes = figure.subplots()
        axes.plot(x, speeds, color=COLOURS[1], label="least torque")
        axes.plot(x, slow, color=COLOURS[0], label="least torque, rate bounded")
        axes.axhline(most, color="#000000", linewidth=0.8, linestyle=":", label="bound")
        axes.set(xlabel="time [s]", ylabel="angular rate [rad/s]")
        figure.legend(loc="outside upper left", ncols=3)
        picture = to_figure(figure, "rate-bound", "The angular rate of the optimum, without and with a bound on it.")
    text = (
        f"A bound of {most:.4g} rad/s on the rate, 7 % below what the optimum wants, is active at {active} of "
        f"{held.multipliers['rate bound'].size} parameters, costs {100 * (held.objective / free.objective - 1):.3g} % "
        f"of energy, and is kept to {100 * (slow.max() / most - 1):.2g} % in between."
    )
    shown = {"least torque": free.motion, "rate bounded": held.motion}
    caption = "A body turned through eight orientations with least torque, without and with a bound on its rate."
    moving = player("turning", shown, wedge(), caption, unit="s", centre=(0.5, 0.0, 0.0))
    return text, picture, moving, runs


STUDY = Study(
    "torque",
    "How much torque do quaternion curves need, and how little would do?",
    "KKS 6.1, and the optimum that they leave open",
    run,
    order=21,
)
