"""Polygons cut into triangles."""

from collections.abc import Sequence

import numpy as np


def triangulated(vertices: np.ndarray, faces: Sequence[Sequence[int]]) -> np.ndarray:
    """(T, 3) the corners of triangles that make up polygons, in their order; P − 2 for one of P corners.

    A convex polygon becomes a fan about its first corner; another loses ears one after the other,
    corners whose triangle holds none of the rest (G. H. Meisters 1975), which there are as long as
    it does not cross itself. vertices: (V, 2) or (V, 3); in space a polygon is seen along the axis
    that its normal is closest to.
    """
    cut = [np.asarray(face)[triangle] for face in faces for triangle in _cut(vertices[list(face)])]
    return np.array(cut, dtype=np.int64).reshape(-1, 3)


def _cut(points: np.ndarray) -> list[list[int]]:
    """The triangles of one polygon (P, d), by its own corners."""
    count = len(points)
    if count <= 3:
        return [[0, 1, 2]][: count - 2]
    flat = _anticlockwise(points)
    if all(_turn(flat[k - 2], flat[k - 1], flat[k]) >= 0 for k in range(count)):
        return [[0, k, k + 1] for k in range(1, count - 1)]
    left, triangles = list(range(count)), []
    while len(left) > 3:
        k = next((k for k in range(len(left)) if _is_ear(flat[left], k)), 0)
        triangles.append([left[k - 1], left[k], left[(k + 1) % len(left)]])
        del left[k]
    return [*triangles, left]


def _anticlockwise(points: np.ndarray) -> np.ndarray:
    """(P, 2) a polygon in the plane, mirrored where that makes it go round anticlockwise."""
    if points.shape[1] == 3:
        legs = points - points[0]
        normal = np.cross(legs, np.roll(legs, -1, axis=0)).sum(axis=0)
        points = np.delete(points, np.argmax(np.abs(normal)), axis=1)
    x, y = (points - points[0]).T
    area = x @ np.roll(y, -1) - y @ np.roll(x, -1)
    return points if area >= 0 else points * [-1.0, 1.0]


def _turn(a: np.ndarray, b: np.ndarray, c: np.ndarray) -> float:
    """Twice the area of the triangle abc, positive where it goes round anticlockwise."""
    return float((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]))


def _is_ear(flat: np.ndarray, k: int) -> bool:
    """Whether the triangle at corner k can be cut off; one without area can."""
    a, b, c = flat[k - 1], flat[k], flat[(k + 1) % len(flat)]
    turn = _turn(a, b, c)
    if turn <= 0:
        return turn == 0
    # What lies on a corner, as where an outline names its first point again, is in nobody's way.
    rest = [p for p in flat if not any(np.array_equal(p, q) for q in (a, b, c))]
    return not any(min(_turn(a, b, p), _turn(b, c, p), _turn(c, a, p)) >= 0 for p in rest)
