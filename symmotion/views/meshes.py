"""Pictures of triangle meshes seen from afar, on axes that the caller brings."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb

from symmotion.bodies import Mesh
from symmotion.views.parallel import LIGHT, VIEW, bare, draw_faces
from symmotion.views.style import COLOURS, INK

RESOLUTION = 200  # dots per inch


def draw_mesh(
    axes: Axes, mesh: Mesh, colour: str = COLOURS[0], inside: str = COLOURS[1], view: np.ndarray = VIEW
) -> None:
    """A mesh from back to front, shaded by its normals; of an open one the inside has a colour of its own.

    A closed mesh shows its outside only. The triangles become an image inside the SVG, at a
    resolution that this sets for the whole figure: as shapes they would be megabytes.

    axes: of Matplotlib; colour, inside: of the two sides; view: (3, 3), see `view_from`.

    >>> triangles = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]
    >>> corner = sm.bodies.Mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], triangles)
    >>> with sm.views.new_figure() as figure:
    ...     sm.views.draw_mesh(figure.add_subplot(), corner)
    """
    corners = (mesh.vertices @ view)[mesh.triangles]
    flat = mesh.area_vectors @ view
    # Shaded by the mean of the vertices' normals: thin triangles have poor ones of their own.
    at_vertices = np.zeros_like(mesh.vertices)
    for k in range(3):
        np.add.at(at_vertices, mesh.triangles[:, k], flat)
    at_vertices /= np.maximum(np.linalg.norm(at_vertices, axis=1, keepdims=True), np.finfo(float).tiny)
    normals = at_vertices[mesh.triangles].mean(axis=1)
    drawn = (flat[:, 2] > 0) | (not mesh.closed)
    corners, normals, front = corners[drawn], normals[drawn], flat[drawn, 2:] > 0
    light = np.clip(np.where(front, normals, -normals) @ LIGHT, 0, 1)[:, None]
    base = np.where(front, to_rgb(colour), to_rgb(inside))
    shade = np.clip(base * (0.35 + 0.65 * light) + 0.3 * light**6, 0, 1)
    # Edges in the colour of the face: without them the page shines through between neighbours.
    draw_faces(axes, corners, shade, width=0.7, rasterized=True)
    canvas = axes.get_figure(root=True)
    if canvas is not None:
        canvas.set_dpi(RESOLUTION)
    bare(axes)


def draw_curve(
    axes: Axes,
    points: np.ndarray,
    colour: str = INK,
    *,
    closed: bool = False,
    linewidth: float = 1.0,
    alpha: float = 1.0,
    view: np.ndarray = VIEW,
) -> None:
    """A curve (N, 3) in space.

    axes: of Matplotlib; points: (N, 3); colour, linewidth, alpha: of the line; closed: back to its start; view: see
    `view_from`.

    >>> t = np.linspace(0, 6, 50)
    >>> with sm.views.new_figure() as figure:
    ...     sm.views.draw_curve(figure.add_subplot(), np.column_stack([np.cos(t), np.sin(t), t]))
    """
    seen = (np.vstack([points, points[:1]]) if closed else points) @ view
    axes.plot(seen[:, 0], seen[:, 1], color=colour, linewidth=linewidth, alpha=alpha)
    bare(axes)
