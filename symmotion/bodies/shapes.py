"""Shapes to move: the letter that is shown where no body is given, outlines of the papers' figures, a wedge."""

from collections.abc import Sequence
from typing import Literal, TypeAlias, get_args

import numpy as np

Up: TypeAlias = Literal["y", "z"]
UPRIGHT: tuple[Up, ...] = get_args(Up)

# An F shows which way it is turned, and whether it is reflected.
OUTLINE = np.array([(0, 0), (25, 0), (25, 40), (55, 40), (55, 60), (25, 60), (25, 75), (70, 75), (70, 100), (0, 100)])
OUTLINE = (OUTLINE - [35.0, 50.0]) / 100
DEPTH = 0.2  # of its height
FRONT, BACK, SIDE = ((0.0, 0.17, 0.45), (0.67, 0.11, 0.0), (0.01, 0.38, 0.19))  # linear RGB


def letter(dimension: int, size: float, up: Up) -> tuple[np.ndarray, tuple[tuple[int, ...], ...], np.ndarray]:
    """A letter F about the origin, `size` high: vertices, faces and colours of a body.

    In space a slab that stands along the axis `up` and reads in the direction −z (of up "z": y):
    blue in front, orange behind, green round the edge, so that its faces share no vertices.
    """
    outline = size * OUTLINE
    if dimension == 2:
        return outline, (tuple(range(len(outline))),), np.tile(FRONT, (len(outline), 1))
    low, high = (np.column_stack([outline, np.full(len(outline), s * size * DEPTH / 2)]) for s in (-1, 1))
    sides = [np.stack([low[i - 1], low[i], high[i], high[i - 1]]) for i in range(len(outline))]
    polygons = [high, low[::-1], *sides]
    vertices = np.concatenate(polygons)
    if up == "z":
        vertices = np.column_stack([vertices[:, 0], -vertices[:, 2], vertices[:, 1]])
    ends = np.cumsum([len(p) for p in polygons])
    faces = tuple(tuple(range(end - len(p), end)) for p, end in zip(polygons, ends.tolist(), strict=True))
    colours = [FRONT] * len(high) + [BACK] * len(low) + [SIDE] * (4 * len(sides))
    return vertices, faces, np.array(colours)


def letter_k() -> list[np.ndarray]:
    """The outline of a letter K about the origin, as one closed polygon (12, 2): the body of HJK figures 1 and 2.

    >>> sm.bodies.letter_k()[0].shape
    (12, 2)
    """
    k = [(0, 0), (0.22, 0), (0.22, 0.36), (0.34, 0.49), (0.68, 0), (0.96, 0), (0.5, 0.65), (0.92, 1.1), (0.64, 1.1)]
    k += [(0.22, 0.64), (0.22, 1.1), (0, 1.1)]
    return [np.array(k) - [0.45, 0.55]]


def ellipse(centre: Sequence[float], axes: Sequence[float], angle: float = 0.0, points: int = 48) -> np.ndarray:
    """(points, 2) an ellipse as a polygon; angle in degrees.

    centre: (2,); axes: the two semi-axes, in the unit of length.

    >>> sm.bodies.ellipse([0.0, 0.0], [2.0, 1.0], points=4).round(6) + 0.0
    array([[ 2.,  0.],
           [ 0.,  1.],
           [-2.,  0.],
           [ 0., -1.]])
    """
    s = np.linspace(0, 2 * np.pi, points, endpoint=False)
    c, d = np.cos(np.deg2rad(angle)), np.sin(np.deg2rad(angle))
    return np.column_stack([axes[0] * np.cos(s), axes[1] * np.sin(s)]) @ np.array([[c, d], [-d, c]]) + centre


def eight_ellipses() -> list[np.ndarray]:
    """A flower of eight ellipses about the origin, polygons (48, 2): the body of HJK figure 3.

    >>> len(sm.bodies.eight_ellipses())
    8
    """
    turns = 45.0 * np.arange(8)
    return [
        ellipse([0.62 * np.cos(np.deg2rad(a)), 0.62 * np.sin(np.deg2rad(a))], [0.36, 0.15 + 0.05 * (k % 2)], a)
        for k, a in enumerate(turns)
    ]


def wedge(size: float = 1.0) -> list[np.ndarray]:
    """A long body with a nose and a flat belly, polygons (P, 3) of length `size`, so that its orientation is seen.

    >>> {polygon.shape[1] for polygon in sm.bodies.wedge(2.0)}
    {3}
    """
    back, nose = np.array([[-0.5, -0.3], [-0.5, 0.3]]), np.array([[0.5, 0.08], [0.5, -0.08]])
    plan = size * np.concatenate([back, nose])
    height = size * np.array([0.22, 0.22, 0.06, 0.06])
    low = np.column_stack([plan, np.full(4, -0.06 * size)])
    high = np.column_stack([plan, height])
    sides = [np.stack([low[i - 1], low[i], high[i], high[i - 1]]) for i in range(4)]
    return [low, high, *sides]
