"""What conditions cost a faired net: keyframes, borders, and how far the controls go, by every method and many nets."""

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import gaussian_filter

import symmotion as sm
from studies.fairing.fairing_nets import fairness, rippled, rms, turn_error
from studies.fairing.isophotes import break_figure, break_table, isophote_breaks
from studies.shares import spread
from symmotion.fairing import FairingResult, Method, fair, fairing_path, fairing_program
from symmotion.motions import DualQuaternions, TwoParameterMotion, noisy_net, smooth_net
from symmotion.report import Column, Figure, Run, Study, StudyOptions, StudyResult, Table, to_figure
from symmotion.views import COLOURS, new_figure

SIGMA = 0.01  # of every entry of a quaternion
LOCAL: tuple[Method, ...] = ("greedy", "orthogonal")
KNOTS = ("uniform", "centripetal", "chordal")
BORDERS = ("free", "G0", "G1", "G2", "ring")


def run(options: StudyOptions) -> StudyResult:
    n, seeds = (15, 20) if options.full else (9, 8)
    smooth = rippled(smooth_net(n), 2.0)
    nets = [noisy_net(smooth, SIGMA, seed=seed, ring=True) for seed in range(seeds)]
    options.progress("Pareto")
    points = pareto([(nets[k], smooth, "uniform") for k in range(seeds)], options.full)
    for knots in KNOTS[1:]:
        spaced = [TwoParameterMotion.from_displacements(net.control_displacements, knots, knots) for net in nets]
        points += pareto([(net, smooth, knots) for net in spaced[: seeds if options.full else 2]], options.full)
    options.progress("keyframes and borders")
    keyframes = [keyframe_costs(net, smooth, seed) for seed, net in enumerate(nets)]
    borders = [[fair(net, noise=SIGMA, borders=b).final for b in BORDERS] for net in nets]
    options.progress("how much")
    amounts = [how_much(net, smooth) for net in nets]
    options.progress("programs")
    program = fairing_program(nets[0], weight=1.0, keyframes=near(smooth, 4, 0))
    runs = [Run.of("least squares with 4 keyframes", s.solve(program)) for s in (sm.ExactNewton(), sm.Ipopt())]
    breaks = isophote_breaks(nets[0])
    tables = (
        _pareto_table(points),
        _keyframe_table(keyframes),
        _border_table(borders),
        _amount_table(amounts),
        break_table(breaks),
    )
    figures = (_pareto_figure(points), _path_figure(nets[0]), break_figure(nets[0]))
    text, answer = _conclusion(points, keyframes, borders, amounts, breaks), _answer(points, keyframes)
    return StudyResult(tables, figures, tuple(runs), text, answer=answer)


def near(motion: TwoParameterMotion, count: int, seed: int) -> list:
    """Displacements of the motion at random parameters inside."""
    rng, ((a, b), (c, d)) = np.random.default_rng(seed), motion.domain
    at = [(float(rng.uniform(a + 1, b - 1)), float(rng.uniform(c + 1, d - 1))) for _ in range(count)]
    return [(place, motion(*place)) for place in at]


@dataclass(frozen=True)
class Point:
    """One fairing: how it was done, over which knots, G and RMS displacement, error against the truth in degrees."""

    method: str
    knots: str
    seed: int
    fairness: float
    displacement: float
    error: float

    @staticmethod
    def of(method: str, knots: str, seed: int, motion, net, smooth) -> "Point":
        return Point(
            method,
            knots,
            seed,
            fairness(motion),
            rms(np.linalg.norm(motion.real - net.real, axis=-1)),
            rms(turn_error(motion, smooth)),
        )


def pareto(nets: list, full: bool) -> list[Point]:
    """All methods at the displacements that least squares make for a few weights."""
    found = []
    for seed, (net, smooth, knots) in enumerate(nets):
        for weight in (0.1, 1.0, 10.0) if full else (3.0,):
            least = fair(net, "least-squares", weight=weight)
            found.append(Point.of("least squares", knots, seed, least.motion, net, smooth))
            goal = found[-1].displacement
            for method in LOCAL:
                found.append(Point.of(method, knots, seed, at_displacement(net, method, goal), net, smooth))
            if knots == "uniform":
                found.append(Point.of("Gaussian", knots, seed, gaussian_net(net, goal), net, smooth))
        if knots == "uniform" and (full or seed < 1):
            bounded = fair(net, "bounded", tolerance=2 * SIGMA)
            found.append(Point.of("bounded, 2σ", knots, seed, bounded.motion, net, smooth))
    return found


def at_displacement(net: TwoParameterMotion, method: Method, goal: float, most: int = 1024) -> TwoParameterMotion:
    """The net of at most so many local steps whose RMS displacement is the first to reach a goal, by bisection."""
    low, high = 0, most
    best = net
    while high - low > max(4, low // 50):
        steps = (low + high) // 2
        motion = fair(net, method, max_steps=steps, divergence=1e9).motion
        if rms(np.linalg.norm(motion.real - net.real, axis=-1)) < goal:
            low, best = steps, motion
        else:
            high = steps
    return best


def gaussian_net(net: TwoParameterMotion, goal: float) -> TwoParameterMotion:
    """Quaternions smoothed by a Gaussian over their neighbours, but for the ring, so wide that they go as far."""

    def smoothed(width: float) -> np.ndarray:
        real = gaussian_filter(net.real, (width, width, 0), mode="nearest")
        real[[0, -1]], real[:, [0, -1]] = net.real[[0, -1]], net.real[:, [0, -1]]
        return real

    low, high = 0.05, 4.0
    for _ in range(30):
        width = (low + high) / 2
        far = rms(np.linalg.norm(smoothed(width) - net.real, axis=-1))
        low, high = (width, high) if far < goal else (low, width)
    return net.with_controls(smoothed(low), None)


def keyframe_costs(net: TwoParameterMotion, smooth: TwoParameterMotion, seed: int) -> tuple[float, ...]:
    """G by least squares without keyframes, with 4 of the truth, with 4 turned by 2°, and with weights 1 beside."""
    keys = near(smooth, 4, seed)
    turn = DualQuaternions.from_axis_angle([0.0, 0, 1], np.deg2rad(2.0))
    turned = [(at, DualQuaternions.from_matrices(k.linear) @ turn) for at, k in keys]
    strict = [sm.fairing.NetKeyframe(at, k, weight=1.0) for at, k in turned]
    results: list[FairingResult] = [
        fair(net, "least-squares", weight=1.0),
        *(fair(net, "least-squares", weight=1.0, keyframes=k) for k in (keys, turned, strict)),
        fair(net, "orthogonal", max_steps=600, keyframes=turned),
    ]
    return tuple(r.final for r in results)


def how_much(net: TwoParameterMotion, smooth: TwoParameterMotion) -> tuple[float, ...]:
    """RMS error against the truth in degrees: as measured, at the corner, by the discrepancy, at the best weight."""
    path = fairing_path(net)
    weights = (path.corner(), fair(net, noise=SIGMA).weight or 1.0)
    errors = [rms(turn_error(fair(net, "least-squares", weight=w).motion, smooth)) for w in weights]
    tried = np.geomspace(1e-3, 1e3, 13)
    best = [rms(turn_error(fair(net, "least-squares", weight=float(w)).motion, smooth)) for w in tried]
    return rms(turn_error(net, smooth)), *errors, min(best), *weights, float(tried[int(np.argmin(best))])


def _spread(values) -> tuple[float, float, float]:
    return float(np.median(values)), float(np.min(values)), float(np.max(values))


def _pareto_table(points: list[Point]) -> Table:
    rows = []
    for knots in KNOTS:
        for method in dict.fromkeys(p.method for p in points if p.knots == knots):
            mine = [p for p in points if p.method == method and p.knots == knots]
            base = {(p.seed, k): p for k, p in _levels(points, "least squares", knots)}
            ratios = [
                p.fairness / base[p.seed, k].fairness for k, p in _levels(points, method, knots) if (p.seed, k) in base
            ]
            ratio = _spread(ratios) if method != "bounded, 2σ" else (None, None, None)
            rows.append((knots, method, len(mine), *ratio, _spread([p.error for p in mine])[0]))
    columns = (
        Column("knots"),
        Column("method"),
        Column("nets × levels"),
        Column("G over that of least squares, median"),
        Column("least"),
        Column("largest"),
        Column("error, RMS, median", "°"),
    )
    caption = (
        "Every method at the RMS displacement that least squares have for some weights w (local steps: the last net "
        f"within it); σ = {SIGMA} in every entry, ring and all; bounded: at its own displacement."
    )
    return Table("fairness against displacement", columns, tuple(rows), caption)


def _levels(points: list[Point], method: str, knots: str):
    """(level, point) in the order in which they were made, level 0, 1, 2 of each net."""
    seen: dict[int, int] = {}
    for p in points:
        if p.method == method and p.knots == knots:
            level = seen.get(p.seed, 0)
            seen[p.seed] = level + 1
            yield level, p


def _keyframe_table(rows: list[tuple[float, ...]]) -> Table:
    names = (
        "none",
        "4 of the truth",
        "4 turned by 2°",
        "the same with weight 1",
        "the same turned, orthogonal steps",
    )
    values = np.array(rows)
    table = tuple((name, *_spread(values[:, k]), *_spread(values[:, k] / values[:, 0])) for k, name in enumerate(names))
    columns = (
        Column("keyframes"),
        Column("G, median"),
        Column("least"),
        Column("largest"),
        Column("over that without, median"),
        Column("least ratio"),
        Column("largest ratio"),
    )
    return Table("keyframes", columns, table, f"Least squares with w = 1, {len(rows)} nets.")


def _border_table(rows: list[list[float]]) -> Table:
    values = np.array(rows)
    table = tuple((b, *_spread(values[:, k])) for k, b in enumerate(BORDERS))
    columns = (Column("border"), Column("G, median"), Column("least"), Column("largest"))
    return Table("borders", columns, table, f"All four sides, weight by the discrepancy, {len(rows)} nets.")


def _amount_table(rows: list[tuple[float, ...]]) -> Table:
    values = np.array(rows)
    names = ("as measured", "corner of the L-curve", "discrepancy", "best weight")
    weights = (None, 4, 5, 6)
    table = tuple(
        (name, *_spread(values[:, k]), None if w is None else float(np.median(values[:, w])))
        for k, (name, w) in enumerate(zip(names, weights, strict=True))
    )
    columns = (
        Column("weight by"),
        Column("error, RMS, median", "°"),
        Column("least", "°"),
        Column("largest", "°"),
        Column("weight, median"),
    )
    return Table("how much", columns, table, "Error of the control rotations against the true net, which has ripples.")


def _pareto_figure(points: list[Point]) -> Figure:
    with new_figure(7.0, 3.2) as figure:
        axes = figure.subplots()
        for k, method in enumerate(dict.fromkeys(p.method for p in points if p.knots == "uniform")):
            mine = [p for p in points if p.method == method and p.knots == "uniform"]
            x, y = [p.displacement for p in mine], [p.fairness for p in mine]
            axes.scatter(x, y, s=9, color=COLOURS[k % len(COLOURS)], marker="os^vD"[k % 5], label=method)
        axes.set_yscale("log")
        axes.set_xlabel("displacement, RMS")
        axes.set_ylabel("G")
        figure.legend(loc="outside upper left", ncols=5)
        return to_figure(figure, "pareto", "G against displacement, all seeds, uniform knots.")


def _path_figure(net: TwoParameterMotion) -> Figure:
    path = fairing_path(net)
    w = np.geomspace(path.weights[0], path.weights[-1], 300)[1:-1]
    g, d = path.at(w)
    with new_figure(7.0, 3.0) as figure:
        axes = figure.subplots()
        axes.loglog(d, g, color=COLOURS[0], label="all weights")
        axes.loglog(path.displacement, path.fairness, "o", color=COLOURS[0], markersize=3, label="solved")
        for weight, label, colour in (
            (path.corner(), "corner", COLOURS[1]),
            (path.discrepancy(SIGMA), "discrepancy", COLOURS[2]),
        ):
            axes.loglog(*(float(x) for x in reversed(path.at(weight))), "D", color=colour, label=label)
        axes.set_xlabel("Σ|d − d⁰|²")
        axes.set_ylabel("G")
        figure.legend(loc="outside upper left", ncols=4)
        return to_figure(figure, "path", "The L-curve of the first net, its corner, and where the noise says to stop.")


def _answer(points: list[Point], keyframes: list) -> str:
    base = {(p.seed, k): p.fairness for k, p in _levels(points, "least squares", "uniform")}
    greedy, gaussian = (
        spread(p.fairness / base[p.seed, k] for k, p in _levels(points, m, "uniform")) for m in ("greedy", "Gaussian")
    )
    dearer = spread(k[1] / k[0] for k in keyframes)
    return (
        f"At equal displacement greedy steps leave {greedy} times the G of least squares, Gaussian smoothing "
        f"{gaussian}; four keyframes multiply G by {dearer}, over {len(keyframes)} nets."
    )


def _conclusion(points: list[Point], keyframes: list, borders: list, amounts: list, breaks: list[tuple]) -> str:
    base = {(p.seed, k): p.fairness for k, p in _levels(points, "least squares", "uniform")}
    ratio = {
        m: _spread([p.fairness / base[p.seed, k] for k, p in _levels(points, m, "uniform")])
        for m in ("greedy", "orthogonal", "Gaussian")
    }
    k, b, a = np.array(keyframes), np.median(borders, axis=0), np.median(amounts, axis=0)
    shown = "; ".join(f"{m} {r[0]:.3g} times (from {r[1]:.3g} to {r[2]:.3g})" for m, r in ratio.items())
    return (
        f"At equal displacement the G of other methods over that of least squares, over {len(keyframes)} nets: {shown}."
        f"\n\nFour keyframes of the truth multiply G by {np.median(k[:, 1] / k[:, 0]):.3g}, four turned by 2° by "
        f"{np.median(k[:, 2] / k[:, 0]):.3g}, with weights {np.median(k[:, 3] / k[:, 0]):.3g}. By the discrepancy "
        f"G is {b[0]:.3g} with free borders, {b[1]:.3g} with G0, {b[2]:.3g} with G1, {b[3]:.3g} with G2.\n\n"
        f"The noise known, the discrepancy leaves an error of {a[2]:.3g}° of {a[0]:.3g}°; the best weight {a[3]:.3g}°, "
        f"the corner of the L-curve {a[1]:.3g}°.\n\nAcross knots isophotes of a C¹ surface break by "
        f"{breaks[0][1]:.3g}° (RMS), of a C² one by {breaks[1][1]:.2g}°; their curvature breaks by {breaks[1][2]:.2g} "
        f"of its size there, and by {breaks[2][2]:.2g} after fairing."
    )


STUDY = Study(
    "fairing_conditions",
    "What do keyframes, borders and bounds cost a faired net, and how much should it be faired?",
    "PCG and Hahmann's step with conditions",
    run,
    order=44,
)
