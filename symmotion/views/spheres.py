"""Pictures of rotations: curves on a sphere seen from afar, and bodies, on axes that the caller brings."""

from collections.abc import Callable, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_rgba

from symmotion.bodies import Body, Shape
from symmotion.views.parallel import VIEW, bare, draw_faces
from symmotion.views.style import COLOURS, INK


def on_sphere(quaternions: np.ndarray) -> np.ndarray:
    """(N, 3) unit quaternions (N, 4) projected on the unit sphere: (w, x, y) at length one.

    >>> sm.views.on_sphere(np.array([[0.0, 0.0, 1.0, 0.0]]))
    array([[0., 0., 1.]])
    """
    shadow = quaternions[:, :3]
    return shadow / np.linalg.norm(shadow, axis=1, keepdims=True)


def draw_sphere(axes: Axes, view: np.ndarray = VIEW) -> None:
    """The unit sphere as its outline and a faint grid.

    axes: of Matplotlib; view: (3, 3), see `view_from`.

    >>> with sm.views.new_figure() as figure:
    ...     sm.views.draw_sphere(figure.add_subplot())
    """
    s = np.linspace(0, 2 * np.pi, 181)
    axes.plot(np.cos(s), np.sin(s), color=INK, linewidth=0.7)
    circles = [
        np.column_stack([np.cos(a) * np.cos(s), np.cos(a) * np.sin(s), np.full_like(s, np.sin(a))])
        for a in np.deg2rad([-60, -30, 0, 30, 60])
    ]
    circles += [
        np.column_stack([np.cos(a) * np.cos(s), np.sin(a) * np.cos(s), np.sin(s)])
        for a in np.deg2rad(np.arange(0, 180, 30))
    ]
    for circle in circles:
        draw_curve(axes, circle, INK, linewidth=0.4, alpha=0.22, hidden=0.0, view=view)
    bare(axes)


def draw_curve(
    axes: Axes,
    points: np.ndarray,
    colour: str,
    *,
    style: str = "-",
    linewidth: float = 1.6,
    alpha: float = 1.0,
    hidden: float = 0.3,
    label: str | None = None,
    view: np.ndarray = VIEW,
) -> None:
    """A curve (N, 3) on the sphere; what lies behind is fainter by the factor `hidden`.

    axes: of Matplotlib; points: (N, 3); colour, style, linewidth, alpha, label: of the line; view: see `view_from`.

    >>> t = np.linspace(0, 3, 50)
    >>> with sm.views.new_figure() as figure:
    ...     sm.views.draw_sphere_curve(figure.add_subplot(), np.column_stack([np.cos(t), np.sin(t), 0 * t]), "#0072b2")
    """
    seen = points @ view
    front = seen[:, 2] >= 0
    for side, strength in ((front, alpha), (~front, alpha * hidden)):
        if strength > 0:
            # A point more at both ends, so that no gap shows where the curve goes round.
            wide = side | np.roll(side, 1) & (np.arange(len(side)) > 0)
            path = np.where(wide[:, None], seen[:, :2], np.nan)
            axes.plot(path[:, 0], path[:, 1], style, color=colour, linewidth=linewidth, alpha=strength)
    if label is not None:
        axes.plot([], [], style, color=colour, linewidth=linewidth, label=label)


def draw_points(axes: Axes, points: np.ndarray, colour: str = INK, size: float = 4.0, view: np.ndarray = VIEW) -> None:
    """Dots (N, 3) on the sphere, hollow where they lie behind.

    axes: of Matplotlib; points: (N, 3); colour, size: of the dots; view: see `view_from`.

    >>> with sm.views.new_figure() as figure:
    ...     sm.views.draw_sphere_points(figure.add_subplot(), np.eye(3))
    """
    seen = points @ view
    for x, y, depth in seen:
        axes.plot(x, y, "o", color=colour, markersize=size, markerfacecolor=colour if depth >= 0 else "none")


def draw_outlines(
    axes: Axes,
    pose: Callable[[np.ndarray], np.ndarray],
    body: Shape,
    colours: Sequence[str] = COLOURS,
    alpha: float = 0.35,
    linewidth: float = 0.8,
    view: np.ndarray = VIEW,
) -> None:
    """A body, each face in a colour of its own, at one pose: from body points to the world's.

    axes: of Matplotlib; colours, alpha, linewidth: of the faces; view: see `view_from`.

    Raises InputError for a body that is none.

    >>> with sm.views.new_figure() as figure:
    ...     sm.views.draw_outlines(figure.add_subplot(), lambda points: points, sm.bodies.jug())
    """
    shape = Body.of(body, 3)
    faces = shape.polygons(pose(shape.vertices) @ view)
    shown = [colours[k % len(colours)] for k in range(len(faces))]
    inside = np.array([to_rgba(colour, alpha) for colour in shown])
    draw_faces(axes, faces, inside, [to_rgba(colour) for colour in shown], width=linewidth)
    bare(axes)
