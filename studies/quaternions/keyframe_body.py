"""KKS figure 10: a rigid body through six keyframes, by interpolation and by a program for least torque and bending."""

from typing import Any

import numpy as np

import symmotion as sm
from symmotion.design import pose_program
from symmotion.motions import PoseMotion
from symmotion.motions.quaternions import exp, interpolate_quaternions
from symmotion.report import Column, Run, Study, StudyOptions, StudyResult, Table, player, to_figure
from symmotion.views import COLOURS, draw_outlines, new_figure, view_from

VIEW = view_from([1.0, -2.6, 1.5])
TIMES = np.array([0.0, 1.0, 1.8, 3.2, 4.0, 5.0])
PLACES = np.array([[0, 0, 0], [3, 1, 1.5], [6, 1.5, 1.0], [9.5, 0, 2.5], [12, -1, 1.0], [15, 0, 0]], dtype=float)
QUATERNIONS = exp(np.deg2rad([[0, 0, 0], [30, 40, 20], [70, 60, 80], [10, 90, 150], [-40, 40, 120], [-60, 0, 60]]) / 2)
INERTIA = np.array([0.5, 2.0, 2.2])
# Corners of the body, as mass points of its paths.
CORNERS = np.array([[x, y, z] for x in (-1.2, 1.2) for y in (-0.6, 0.6) for z in (-0.35, 0.35)])


def run(options: StudyOptions) -> StudyResult:
    spline = PoseMotion(interpolate_quaternions(TIMES, QUATERNIONS), sm.splines.cubic_interpolant(TIMES, PLACES))
    runs: list[Run] = []
    rows: list[tuple[Any, ...]] = []
    energy = sm.TrajectoryEnergy(CORNERS, np.full(len(CORNERS), 1 / len(CORNERS)))
    knots = 4 if options.full else 2
    optima = {}
    for weight in (0.01, 1.0, 100.0):
        options.progress(f"torque × {weight:g}")
        program = pose_program(
            TIMES,
            QUATERNIONS,
            PLACES,
            objective=weight * sm.Torque(INERTIA) + energy,
            refine=knots - 1,
        )
        if weight == 0.01:
            start = program.design.motion(program.start)
            rows.append(("interpolating curve", None, *_measures(start, energy)))
        comparison = sm.compare(program, [sm.ExactNewton(), sm.Ipopt()])
        runs += [Run.of(f"torque × {weight:g}", s) for s in comparison.solutions]
        best = comparison.best
        if best is None:
            raise sm.SolveError(f"no solver solved torque × {weight:g}")
        optima[weight] = best
        rows.append(("least torque and bending", weight, *_measures(best.motion, energy)))
    table = Table(
        "torque and bending",
        (Column("motion"), Column("weight of the torque"), Column("∫‖τ‖²"), Column("E"), Column("largest torque")),
        tuple(rows),
        "E: ∫ mean ‖p̈‖² over the eight corners of the body.",
    )
    best = optima[1.0]
    pictured = best.motion
    with new_figure(7.0, 4.4) as figure:
        shown = {"interpolating curve": spline, "least torque and bending": pictured}
        for axes, name in zip(figure.subplots(2, 1), shown, strict=True):
            motion: PoseMotion = shown[name]
            axes.set_title(name)
            path = motion(np.linspace(TIMES[0], TIMES[-1], 300)).translation @ VIEW
            axes.plot(path[:, 0], path[:, 1], color="#000000", linewidth=0.8, alpha=0.6)
            for s in np.linspace(TIMES[0], TIMES[-1], 26):
                draw_outlines(
                    axes,
                    lambda p, m=motion, s=s: m.trajectory(p, s),
                    _wedge(),
                    (COLOURS[0],),
                    alpha=0.06,
                    linewidth=0.4,
                    view=VIEW,
                )
            for s in TIMES:
                draw_outlines(
                    axes, lambda p, m=motion, s=s: m.trajectory(p, s), _wedge(), (COLOURS[5],), alpha=0.18, view=VIEW
                )
        picture = to_figure(figure, "body", "A body through six keyframes, in ink (KKS figure 10).")
    keys = sm.Keyframes(TIMES, *spline(TIMES))
    caption = "A body through six keyframes, grey (KKS figure 10)."
    moving = player("body", shown, _wedge(), caption, keys, picture=picture, direction=VIEW[:, 2])
    prices = np.linalg.norm(best.multipliers["keyframes"], axis=1)
    dear = int(np.argmax(prices))
    conclusion = (
        f"At weight one the optimum lowers the torque energy from {rows[0][2]:.5g} to {rows[2][2]:.5g} and the "
        f"bending E from "
        f"{rows[0][3]:.5g} to {rows[2][3]:.5g}, through the same six keyframes. The orientation of keyframe "
        f"{dear + 1} is the "
        f"dearest: turning it by a degree about the right axis would save {np.deg2rad(prices[dear]):.3g} of "
        f"{best.objective:.5g} to first order. ExactNewton and IPOPT reach the same optimum in every case."
        if len({round(r.objective or 0.0, 5) for r in runs}) == len(optima)
        else "ExactNewton and IPOPT end at different optima: see the runs."
    )
    less = [100 * (1 - rows[2][k] / rows[0][k]) for k in (2, 3)]
    answer = (
        f"Through the same six keyframes, least torque and bending at equal weights take {less[0]:.2g} % off the "
        f"torque energy and {less[1]:.2g} % off the bending of the interpolating curve."
    )
    return StudyResult((table,), (picture,), tuple(runs), conclusion, players=(moving,), answer=answer)


def _measures(motion: PoseMotion, energy: sm.TrajectoryEnergy) -> tuple[float, float, float]:
    x, w = np.polynomial.legendre.leggauss(12)
    breaks = motion.orientation.basis.breakpoints
    half = np.diff(breaks)[:, None] / 2
    t = (breaks[1:] + breaks[:-1])[:, None] / 2 + half * x
    jet = motion.orientation.jet(t)
    torque = np.linalg.norm(jet.acceleration * INERTIA + np.cross(jet.rate, jet.rate * INERTIA), axis=-1)
    bend = np.mean(np.sum(motion.trajectory(energy.points, t, 2) ** 2, axis=-1), axis=-1)
    return float(np.sum(half * w * torque**2)), float(np.sum(half * w * bend)), float(torque.max())


def _wedge() -> list[np.ndarray]:
    """A wedge: a long body with a nose, so that its orientation can be read."""
    low = np.array([[-1.2, -0.6, -0.35], [1.2, -0.15, -0.1], [1.2, 0.15, -0.1], [-1.2, 0.6, -0.35]])
    high = low * [1, 1, -1]
    sides = [np.stack([low[i], low[(i + 1) % 4], high[(i + 1) % 4], high[i]]) for i in range(4)]
    return [low, high, *sides]


STUDY = Study(
    "keyframe_body",
    "Six poses of a body: what do least torque and least bending change between them?",
    "KKS 6.2, figure 10",
    run,
    order=24,
)
