"""Parallel views of space: from where it is seen and lit, and faces from back to front."""

from collections.abc import Sequence
from typing import Literal

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from numpy.typing import ArrayLike

from symmotion import checks
from symmotion.bodies.shapes import UPRIGHT, Up

# The light of all shaded pictures, from the left above the viewer: right, up, towards.
LIGHT = np.array([-0.35, 0.55, 0.75]) / np.linalg.norm([-0.35, 0.55, 0.75])
# That of isophotes stands still in space: they belong to a surface, whatever the view.
ISOPHOTES_LIGHT = (0.3, -0.5, 1.0)


def view_from(direction: ArrayLike) -> np.ndarray:
    """(3, 3) the columns right, up and towards the viewer of a parallel view from a direction, z upright.

    From straight above or below, x is to the right.

    >>> sm.views.view_from([0.0, -1.0, 0.0]).round(9) + 0.0
    array([[ 1.,  0.,  0.],
           [ 0.,  0., -1.],
           [ 0.,  1.,  0.]])
    """
    towards = np.asarray(direction, dtype=float) / np.linalg.norm(direction)
    right = np.cross([0.0, 0.0, 1.0], towards)
    size = np.linalg.norm(right)
    right = np.array([1.0, 0.0, 0.0]) if size < 1e-9 else right / size
    return np.column_stack([right, np.cross(towards, right), towards])


VIEW = view_from([2.0, -3.0, 1.6])  # of pictures of bodies in space
# Where bodies in players, and surfaces, are seen from.
DIRECTION = (1.0, -1.6, 1.3)
# What turns positions whose y is upright, as files of animators have them, so that z is.
TO_Z = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])


def upright_view(up: Up = "z") -> np.ndarray:
    """(3, 3) the view of pictures of bodies in space, `VIEW`, with an axis upright; InputError for another one."""
    return VIEW if checks.choice(up, UPRIGHT, "up") == "z" else TO_Z.T @ VIEW


def bare(axes: Axes) -> None:
    """Equal scales, and neither axes nor grid."""
    axes.set_aspect("equal")
    axes.autoscale_view()
    axes.grid(False)
    axes.set_axis_off()


def lit(faces: Sequence[np.ndarray] | np.ndarray) -> np.ndarray:
    """(F,) how lit faces are that a viewer sees, n · light from 0 to 1; 1 for one without area.

    faces: (P, 3) each, in the directions of a view. Both sides are alike: a motion may reflect a body.
    """
    light = np.ones(len(faces))
    sizes = np.array([len(face) for face in faces])
    for size in np.unique(sizes):
        which = np.flatnonzero(sizes == size)
        corners = np.stack([face for face in faces if len(face) == size])
        # About a corner of their own: far from the origin the products would be rounding.
        corners = corners - corners[:, :1]
        normals = np.cross(corners, np.roll(corners, -1, axis=1)).sum(axis=1)
        lengths = np.linalg.norm(normals, axis=1)
        normals *= np.where(normals[:, 2] < 0, -1.0, 1.0)[:, None]
        flat = lengths > 0
        light[which[flat]] = np.clip(normals[flat] @ LIGHT / lengths[flat], 0, 1)
    return light


def draw_faces(
    axes: Axes,
    faces: Sequence[np.ndarray] | np.ndarray,
    colours: np.ndarray,
    edges: ArrayLike | None = None,
    *,
    width: float = 0.5,
    joined: Literal["round"] | None = None,
    rasterized: bool = False,
    zorder: float = 1.0,
) -> None:
    """Faces (P, 3) in the directions of a view, what is far behind what is near.

    colours, edges: (F, 3) or (F, 4), the edges as the faces when left out, of a width in points, with corners joined.
    """
    if len({len(face) for face in faces}) == 1:
        faces = np.asarray(faces)  # an array is drawn several times as fast as a list
    depth = faces[:, :, 2].mean(axis=1) if isinstance(faces, np.ndarray) else [face[:, 2].mean() for face in faces]
    order = np.argsort(depth, kind="stable")
    outline = "face" if edges is None else np.asarray(edges)[order]
    shapes = faces[order, :, :2] if isinstance(faces, np.ndarray) else [faces[k][:, :2] for k in order]
    # Matplotlib's stubs know lists only.
    drawn = PolyCollection(
        shapes,  # pyright: ignore[reportArgumentType]
        facecolors=colours[order],
        edgecolors=outline,
        linewidths=width,
        zorder=zorder,
    )
    drawn.set_rasterized(rasterized)
    if joined is not None:
        drawn.set_joinstyle(joined)
    axes.add_collection(drawn)
