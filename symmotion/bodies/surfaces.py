"""Bodies of quadrilaterals to draw along motions: grids of points, of our own or from Bézier patches."""

import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from symmotion import checks
from symmotion.bodies.body import Body, joined
from symmotion.errors import InputError


def grid_mesh(points: np.ndarray) -> Body:
    """The body of the quadrilaterals of a grid of points (U, V, 3).

    Raises InputError for points of another shape, or that are not finite.

    >>> x, y = np.meshgrid(np.arange(3.0), np.arange(4.0), indexing="ij")
    >>> len(sm.bodies.grid_mesh(np.stack([x, y, 0 * x], axis=-1)).faces)
    6
    """
    u, v = points.shape[:2]
    index = np.arange(u * v).reshape(u, v)
    corners = [index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]]
    return Body(points.reshape(-1, 3), tuple(map(tuple, np.stack(corners, axis=-1).reshape(-1, 4).tolist())))


def ellipsoid_mesh(semi_axes: Sequence[float]) -> Body:
    """An ellipsoid about the origin, 12 faces round and 8 from pole to pole.

    semi_axes: three, positive, along x, y and z.

    Raises InputError for what is no three finite numbers.

    >>> sm.bodies.ellipsoid_mesh([1.0, 0.7, 0.5]).dimension
    3
    """
    sizes = checks.array(semi_axes, (3,), "semi-axes")
    round_, up = np.linspace(0, 2 * np.pi, 13)[:, None], np.linspace(-np.pi / 2, np.pi / 2, 9)
    sphere = [np.cos(round_) * np.cos(up), np.sin(round_) * np.cos(up), 0 * round_ + np.sin(up)]
    return grid_mesh(np.stack(sphere, axis=-1) * sizes)


def jug(segments: int = 12) -> Body:
    """A jug made by the project: a surface of revolution about z with a spout along x and a handle opposite.

    segments: faces round the axis, 3 or more.

    Raises InputError for fewer.

    >>> sm.bodies.jug().dimension
    3
    """
    angle = np.linspace(0, 2 * np.pi, checks.whole(segments, 3, "segments", " of faces round the axis") + 1)
    profile = np.array([(0.0, 0.0), (1.2, 0.0), (1.9, 0.8), (1.6, 1.8), (0.9, 2.3), (1.0, 2.6)])
    ring = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    body = np.concatenate(
        [profile[:, None, :1] * ring, np.broadcast_to(profile[:, None, 1:], (len(profile), len(angle), 1))], axis=2
    )
    spout = _tube([(1.5, 0.9), (2.4, 1.4), (2.9, 2.3)], [0.45, 0.28, 0.18])
    handle = _tube([(-1.4, 1.9), (-2.5, 2.0), (-2.5, 0.9), (-1.7, 0.7)], [0.16] * 4)
    return joined([grid_mesh(p) for p in (body, spout, handle)])


def _tube(path: list[tuple[float, float]], radii: list[float]) -> np.ndarray:
    """(len(path), 7, 3) a tube about a path in the plane of x and z."""
    x, z = np.array(path).T
    tangent = np.gradient(np.column_stack([x, z]), axis=0)
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    a = np.linspace(0, 2 * np.pi, 7)
    r = np.array(radii)[:, None]
    across, side = r * np.cos(a), r * np.sin(a)
    return np.stack([x[:, None] - tangent[:, 1:] * across, side, z[:, None] + tangent[:, :1] * across], axis=-1)


# How the patches of each part of the Utah teapot are reflected into the whole: across x, y, both.
REFLECTIONS = {"handle": ((1, 1), (1, -1)), "spout": ((1, 1), (1, -1))}
FOURFOLD = ((1, 1), (-1, 1), (1, -1), (-1, -1))


def read_teapot(path: Path, pieces: int = 3) -> Body:
    """The Utah teapot from a JSON file of bicubic Bézier patches, `pieces` quadrilaterals along each side of a patch.

    Entries: points (P, 3), patches (B, 16) of indices into them, order (B,) the parts' names.

    path: of the file.

    Raises InputError for a file that holds something else.

    >>> import json
    >>> from pathlib import Path
    >>> patch = [[i, j, 0.0] for i in range(4) for j in range(4)]
    >>> document = {"points": patch, "patches": [list(range(16))], "order": ["body"]}
    >>> Path("patch.json").write_text(json.dumps(document)) > 0
    True
    >>> len(sm.bodies.read_teapot(Path("patch.json")).faces)
    36
    """
    try:
        document = json.loads(path.read_text(encoding="utf-8"))
        points = np.array(document["points"], dtype=float)
        patches = np.array(document["patches"], dtype=int).reshape(-1, 4, 4)
        order = list(document["order"])
        controls = points[patches]
    except (OSError, ValueError, KeyError, IndexError) as error:
        raise InputError(f"{path}: is no file of Bézier patches ({error})") from None
    t = np.linspace(0, 1, pieces + 1)
    bernstein = np.stack([(1 - t) ** 3, 3 * t * (1 - t) ** 2, 3 * t**2 * (1 - t), t**3], axis=1)
    meshes = []
    for part, patch in zip(order, controls, strict=True):
        surface = np.einsum("ui,ijc,vj->uvc", bernstein, patch, bernstein)
        for x, y in REFLECTIONS.get(part, FOURFOLD):
            meshes.append(grid_mesh(surface * [x, y, 1.0]))
    return joined(meshes)
