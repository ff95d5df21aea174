"""KKS figures 8 and 9: a rigid motion by cubic B-splines, and the surface that a section sweeps along it."""

from typing import Any

import numpy as np

from symmotion.bodies import grid_mesh
from symmotion.motions import Keyframes, PoseMotion
from symmotion.motions.quaternions import QuaternionMotion, exp
from symmotion.report import Column, Study, StudyOptions, StudyResult, Table, player, to_figure
from symmotion.splines import BSplineBasis, Spline
from symmotion.views import COLOURS, draw_bodies, draw_outlines, new_figure, view_from

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
        round_ = grid_mesh(np.concatenate([surface, surface[:, :1]], axis=1))
        draw_bodies(below, np.eye(3), np.zeros(3), round_, VIEW[:, 2])
        figure.set_dpi(200)
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
    answer = (
        f"The swept surface's acceleration jumps by {rows[2][3]:.0e} at the knots, of {rows[2][2]:.3g}, and the "
        f"section moves forward at {share:.4g} % of its points, where the surface does not fold."
    )
    return StudyResult((table,), (picture,), (), conclusion, players=(moving,), answer=answer)


STUDY = Study(
    "sweep",
    "Does a section along a B-spline motion sweep a smooth surface?",
    "KKS 6.2, figures 8 and 9",
    run,
    order=23,
)
