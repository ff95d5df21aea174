"""Every way of fairing at the same displacement: how fair, and how far from the truth."""

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import gaussian_filter

from studies.fairing.fairing_nets import fairness, rms, turn_error
from symmotion.fairing import Method, fair
from symmotion.motions import TwoParameterMotion
from symmotion.report import Column, Figure, Table, to_figure
from symmotion.views import COLOURS, new_figure

SIGMA = 0.01  # of every entry of a quaternion
LOCAL: tuple[Method, ...] = ("greedy", "orthogonal")
KNOTS = ("uniform", "centripetal", "chordal")


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
        if knots == "uniform":
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


def middling(values) -> tuple[float, float, float]:
    """Median, least and largest."""
    return float(np.median(values)), float(np.min(values)), float(np.max(values))


def pareto_table(points: list[Point]) -> Table:
    """G over that of least squares, by knots and method."""
    rows = []
    for knots in KNOTS:
        for method in dict.fromkeys(p.method for p in points if p.knots == knots):
            mine = [p for p in points if p.method == method and p.knots == knots]
            base = {(p.seed, k): p for k, p in levels(points, "least squares", knots)}
            ratios = [
                p.fairness / base[p.seed, k].fairness for k, p in levels(points, method, knots) if (p.seed, k) in base
            ]
            ratio = middling(ratios) if method != "bounded, 2σ" else (None, None, None)
            rows.append((knots, method, len(mine), *ratio, middling([p.error for p in mine])[0]))
    columns = (
        Column("knots"),
        Column("method"),
        Column("nets × levels"),
        Column("G over that of least squares, median"),
        Column("least", end=True),
        Column("largest", end=True),
        Column("error, RMS, median", "°"),
    )
    caption = (
        "Every method at the RMS displacement that least squares have for some weights w (local steps: the last net "
        f"within it); σ = {SIGMA} in every entry, ring and all; bounded: at its own displacement."
    )
    return Table("fairness against displacement", columns, tuple(rows), caption)


def levels(points: list[Point], method: str, knots: str):
    """(level, point) in the order in which they were made, level 0, 1, 2 of each net."""
    seen: dict[int, int] = {}
    for p in points:
        if p.method == method and p.knots == knots:
            level = seen.get(p.seed, 0)
            seen[p.seed] = level + 1
            yield level, p


def pareto_figure(points: list[Point]) -> Figure:
    """G against displacement."""
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
