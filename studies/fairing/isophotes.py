"""How isophotes break at knots: a surface of class Cʳ has isophotes of class Cʳ⁻¹."""

from itertools import pairwise

import numpy as np

from studies.fairing.fairing_nets import AFTER, BEFORE, rms
from symmotion.fairing import fair
from symmotion.motions import TwoParameterMotion
from symmotion.report import Column, Figure, Table, to_figure
from symmotion.views import new_figure


def isophote_breaks(net: TwoParameterMotion) -> list[tuple]:
    """The largest break of direction and of curvature of isophotes across the knot lines u = const."""
    quadratic = TwoParameterMotion.from_displacements(net.control_displacements, degree=2)
    faired = fair(net, "least-squares", weight=1e-4).motion
    return [
        (name, *breaks_of(motion))
        for name, motion in (
            ("degree 2, C¹", quadratic),
            ("degree 3, C²", net),
            ("degree 3, faired", faired),
        )
    ]


def breaks_of(motion: TwoParameterMotion) -> tuple[float, float]:
    """RMS break of the angle in degrees, and median break of the curvature over its median size."""
    lines = motion.u.breakpoints[2:-2]
    v = np.linspace(*motion.v.domain, 40)[3:-3]
    h = 1e-7
    one, other = (isophotes(motion, lines[:, None] + s * h, v, s) for s in (-1, 1))
    angle = np.rad2deg(np.abs(np.angle(np.exp(2j * (one[0] - other[0]))) / 2))
    size = (np.abs(one[1]) + np.abs(other[1])) / 2
    # Medians: where the isophotes shrink to a point their curvature is without bound.
    return rms(angle), float(np.median(np.abs(one[1] - other[1])) / np.median(size))


def isophotes(
    motion: TwoParameterMotion, u: np.ndarray, v: np.ndarray, toward: int = 1
) -> tuple[np.ndarray, np.ndarray]:
    """Angle and curvature, in the parameters, of the curves N · light = c, by differences to one side of u."""
    light, step = np.array([0.4, 0.3, 0.86]), 1e-3
    offsets = np.arange(3)

    def cosine(a: np.ndarray, b: np.ndarray) -> np.ndarray:
        x, y = motion.rodrigues(a, b, (1, 0)), motion.rodrigues(a, b, (0, 1))
        normal = np.cross(x, y)
        return normal @ light / np.linalg.norm(normal, axis=-1)

    f = np.stack([[cosine(u + toward * step * i, v + step * (j - 1)) for j in offsets] for i in offsets])
    # One-sided in u, central in v.
    fu = toward * (-1.5 * f[0, 1] + 2 * f[1, 1] - 0.5 * f[2, 1]) / step
    fuu = (f[0, 1] - 2 * f[1, 1] + f[2, 1]) / step**2
    fv, fvv = (f[0, 2] - f[0, 0]) / (2 * step), (f[0, 2] - 2 * f[0, 1] + f[0, 0]) / step**2
    slopes = [(f[i, 2] - f[i, 0]) / (2 * step) for i in offsets]
    fuv = toward * (-1.5 * slopes[0] + 2 * slopes[1] - 0.5 * slopes[2]) / step
    bend = (fuu * fv**2 - 2 * fuv * fu * fv + fvv * fu**2) / (fu**2 + fv**2) ** 1.5
    return np.arctan2(-fu, fv), bend


def break_table(rows: list[tuple]) -> Table:
    columns = (Column("surface"), Column("break of direction, RMS", "°"), Column("break of curvature, relative"))
    caption = "Isophotes of the rotations as Rodrigues vectors, across the knot lines u = const, in the parameters."
    return Table("isophotes at knots", columns, tuple(rows), caption)


def break_figure(net: TwoParameterMotion) -> Figure:
    faired = fair(net, "least-squares", weight=1e-4).motion
    v = float(np.mean(net.v.domain))
    with new_figure(7.0, 3.0) as figure:
        axes = figure.subplots()
        for motion, name, colour in ((net, "before", BEFORE), (faired, "after", AFTER)):
            edges = motion.u.breakpoints
            for a, b in pairwise(edges):
                inside = np.linspace(a + 1e-6, b - 5e-3, 25)
                bend = isophotes(motion, inside[:, None], np.array([v]))[1][:, 0]
                axes.plot(inside, bend, color=colour, linewidth=1.0)
            axes.plot([], [], color=colour, label=name)
        axes.set_ylim(-3, 3)
        axes.set_xlabel("u, a knot at every tick")
        axes.set_xticks(net.u.breakpoints)
        axes.set_ylabel("curvature of the isophote")
        figure.legend(loc="outside upper left", ncols=2)
        return to_figure(
            figure,
            "isophote-curvature",
            "The curvature of the isophotes along the middle line v = const, in the parameters: of a C² surface "
            "isophotes are C¹, and their curvature breaks at the knots; after fairing it hardly does.",
        )
