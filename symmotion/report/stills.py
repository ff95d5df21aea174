"""The still picture of a player: a body at some times of its motions, side by side."""

from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.colors import to_rgb

from symmotion.bodies import Body
from symmotion.motions import Affine, Keyframes
from symmotion.motions.motion import Moving
from symmotion.report.figures import to_figure
from symmotion.report.values import Figure
from symmotion.views.fairing_figures import draw_bodies
from symmotion.views.parallel import bare, draw_faces, lit, view_from
from symmotion.views.style import COLOURS, INK, new_figure

COPIES = 13  # of the body in a still picture
FINE = 24  # faces of a body beyond which edges would hide them; in player.js too


def motion_colours(count: int) -> tuple[str, ...]:
    """A colour per motion; before and after are orange and blue in all figures."""
    return (COLOURS[1], COLOURS[0]) if count == 2 else tuple(COLOURS[k % 5] for k in range(count))


def still(
    name: str,
    motions: Mapping[str, Moving],
    body: Body,
    keyframes: Keyframes | None,
    eye: np.ndarray,
    centre: np.ndarray,
    caption: str,
) -> Figure:
    """A body at some times under each motion, at the keyframes in ink; set apart where it turns on the spot."""
    places = {label: motion(np.linspace(*motion.domain, COPIES)) for label, motion in motions.items()}
    corners = body.vertices
    view = _view(eye, len(centre))
    size = float(np.ptp(corners, axis=0).max())
    on_the_spot = all(np.ptp(p.translation, axis=0).max() < size / 4 for p in places.values())
    if on_the_spot:
        apart = 1.1 * size * np.arange(COPIES)[:, None] * view[:, 0]
        places = {label: Affine(p.linear, p.translation + apart) for label, p in places.items()}
    seen = np.concatenate([(p.translation[:, None] + corners @ np.swapaxes(p.linear, 1, 2)) for p in places.values()])
    width, height = np.ptp((seen @ view).reshape(-1, 2), axis=0)
    columns = min(len(motions), 1 if height < 0.45 * width else 2 if height < 0.9 * width else 3)
    rows = -(-len(motions) // columns)
    with new_figure(7.0, rows * (0.25 + min(6.8 / columns * height / width, 3.4))) as figure:
        figure.set_dpi(150)
        panels = figure.subplots(rows, columns, squeeze=False).ravel()
        for axes in panels[len(motions) :]:
            axes.remove()
        for axes, (label, place), colour in zip(panels, places.items(), motion_colours(len(motions)), strict=False):
            _draw(axes, place, body, eye, colour, 0.3)
            if not on_the_spot:
                linear, translation = motions[label](np.linspace(*motions[label].domain, 300))
                path = (translation + linear @ centre) @ view
                axes.plot(*path.T, color=INK, linewidth=0.8, alpha=0.6)
                if keyframes is not None:
                    _draw(axes, Affine(keyframes.linear, keyframes.translation), body, eye, INK, 0.35)
            bare(axes)
            if len(motions) > 1:
                axes.set_title(label, parse_math=False)
        return to_figure(figure, f"{name}-still", caption)


def _draw(axes: Axes, position: Affine, body: Body, eye: np.ndarray, colour: str, alpha: float) -> None:
    places = position(body.vertices)
    if body.dimension == 2:
        outlines = body.polygons(places)
        axes.add_collection(PolyCollection(outlines, facecolors=colour, edgecolors=colour, alpha=alpha, linewidths=0.7))
        return
    if len(body.faces) > FINE:
        draw_bodies(axes, *position, body, eye, _shadeable(colour))
        return
    faces = body.polygons(places @ view_from(eye))
    colours = 1 - (0.9 - 0.6 * lit(faces))[:, None] * (1 - np.array(to_rgb(_shadeable(colour))))
    draw_faces(axes, faces, colours, 0.7 * colours, joined="round")


def _shadeable(colour: str) -> str:
    """Ink cannot be shaded: grey is, and is seen on the light page and on the dark one."""
    return "#777777" if colour == INK else colour


def _view(eye: np.ndarray, dimension: int) -> np.ndarray:
    """(d, 2) columns right and up."""
    return np.eye(2) if dimension == 2 else view_from(eye)[:, :2]
