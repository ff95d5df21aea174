"""KKS figures 8 and 9: a rigid motion by cubic B-splines, and the surface that a section sweeps along it."""

from typing import Any

import numpy as np
from matplotlib.collections import PolyCollection

from symmotion.motions.keyframes import Keyframes
from symmotion.motions.pose import PoseMotion
from symmotion.motions.quaternion import QuaternionMotion
from symmotion.motions.quaternion_algebra import exp
from symmotion.report import Column, Study, StudyOptions, StudyResult, Table
from symmotion.report.figures import COLOURS, new_figure, to_figure
from symmotion.report.players import player
from symmotion.report.spheres import draw_outlines, view_from
from symmotion.splines import BSplineBasis, Spline

VIEW = view_from([1.5, -2.5, 1.8])
PLACES = np.array([[0, 0, 0], [3, 3, 0.5], [6, 3, 2.0], [9, 0, 3.0], [12, -2, 1.5], [15, 0, 0]], dtype=float)
TURNS = np.deg2rad([[0, 0, 0], [0, 0, 40], [30, 20, 60], [80, 0, 10], [120, -30, -40], [180, 0, -10]])


def star(count: int = 5, points: int = 60) -> np.ndarray:
    """(points, 3) a rounded star in the plane x = 0."""
    s = np.linspace(0, 2 * np.pi, points, endpoint=False)
    r = 0.9 * (1 + 0.28 * np.cos(count * s))
    return np.column_stack([np.zeros(points), r * np.cos(s), r * np.sin(s)])


def run(options: StudyOptions) -> StudyResult:
    basis = BSplineBasis.clamped(np.arange(4.0), 3)
    motion = PoseMotion(QuaternionMotion(basis, exp(TURNS / 2)), Spline(basis, PLACES))
    options.progress("surface")
    section = star()
    t = np.linspace(*motion.domain, 181 if options.full else 91)
    surface = motion.trajectory(section, t)
    # The map (s, t) folds over where the section's points would move backwards through its plane.
    normal = motion(t).linear[:, :, 0]
    forward = np.einsum("tpk,tk->tp", motion.trajectory(section, t, 1), normal)
    knots, h = basis.breakpoints[1:-1], 1e-9
    rows: list[tuple[Any, ...]] = []
    for nu, name, unit in ((0, "position", "1"), (1, "velocity", "1/s"), (2, "acceleration", "1/s²")):
        jump = np.abs(motion.trajectory(section, knots + h, nu) - motion.trajectory(section, knots - h, nu)).max()
        rows.append((name, unit, float(np.abs(motion.trajectory(section, t, nu)).max()), float(jump)))
    table = Table(
        "continuity of the swept surface",
        (Column("along the motion"), Column("unit"), Column("largest"), Column("largest jump at a knot")),
        tuple(rows),
    )
    with new_figure(7.0, 5.0) as figure:
        above, below = figure.subplots(2, 1)
        for s in np.linspace(*motion.domain, 13):
            draw_outlines(above, lambda p, s=s: motion.trajectory(p, s), [section], (COLOURS[0],), view=VIEW)
        path = motion(t).translation @ VIEW
        above.plot(path[:, 0], path[:, 1], color="#000000", linewidth=0.8)
        _draw_surface(below, surface)
        picture = to_figure(
            figure,
            "sweep",
            "A section along a cubic B-spline motion with six controls (KKS figure 8), and its sweep (figure 9).",
        )
    share = 100 * float(np.mean(forward > 0))
    conclusion = (
        f"The sweep of a closed section along one cubic B-spline motion with six controls is C² along the "
        f"motion: the largest "
        f"jump of the acceleration at a knot is {rows[2][3]:.1g}, of {rows[2][2]:.3g}. The section moves "
        f"forward through its own "
        f"plane at {share:.4g} % of its points, so the surface "
        + (
            "does not fold."
            if share == 100
            else "folds over where it does not: the turns are too sharp for its width there."
        )
    )
    places = np.linspace(*motion.domain, 13)
    moving = player(
        "section",
        {"cubic B-spline motion": motion},
        [section],
        "The section along its motion, and where it is at 13 times.",
        Keyframes(places, *motion(places)),
        picture=picture,
        unit="s",
        direction=VIEW[:, 2],
    )
    return StudyResult((table,), (picture,), (), conclusion, players=(moving,))


def _draw_surface(axes, surface: np.ndarray) -> None:
    """A surface of quadrilaterals (T, P, 3), closed in P, back to front, shaded by its normals."""
    seen = surface @ VIEW
    around = np.roll(seen, -1, axis=1)
    quads = np.stack([seen[:-1], around[:-1], around[1:], seen[1:]], axis=2).reshape(-1, 4, 3)
    normal = np.cross(quads[:, 2] - quads[:, 0], quads[:, 3] - quads[:, 1])
    size = np.linalg.norm(normal, axis=1)
    light = np.abs(normal @ [0.35, 0.55, 0.75]) / np.where(size > 0, size, 1.0)
    order = np.argsort(quads[:, :, 2].mean(axis=1))
    base = np.array([0.0, 0.447, 0.698])
    shade = base * (0.35 + 0.65 * light[:, None]) + 0.25 * light[:, None] ** 4
    colours = np.clip(shade, 0, 1)[order]
    axes.add_collection(
        PolyCollection(list(quads[order, :, :2]), facecolors=colours, edgecolors=colours, linewidths=0.3)
    )
    axes.set_aspect("equal")
    axes.autoscale_view()
    axes.grid(False)
    axes.set_axis_off()


STUDY = Study(
    "sweep",
    "Does a section along a B-spline motion sweep a smooth surface?",
    "KKS 6.2, figures 8 and 9",
    run,
    order=23,
)
