"""The body that a written motion carries: a mesh of triangles, the user's or a letter F made by the project."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from symmotion.errors import InputError
from symmotion.motions import Affine, PoseMotion
from symmotion.motions.motion import Motion
from symmotion.motions.quaternions import QuaternionMotion
from symmotion.splines import Spline

# A letter that shows which way it is turned, and whether it is reflected: outline, and the rectangles it is made of.
LETTER = np.array([(0, 0), (25, 0), (25, 40), (55, 40), (55, 60), (25, 60), (25, 75), (70, 75), (70, 100), (0, 100)])
BARS = np.array([[(0, 0), (25, 100)], [(25, 75), (70, 100)], [(25, 40), (55, 60)]])
MIDDLE, DEPTH = np.array([35.0, 50.0]), 20.0
FRONT, BACK, SIDE = ((0.0, 0.17, 0.45), (0.67, 0.11, 0.0), (0.01, 0.38, 0.19))  # linear RGB
SAMPLES = 257


@dataclass(frozen=True, eq=False)
class Body:
    """A mesh; vertices: (V, 3); triangles: (F, 3) their corners; colours: (V, 3) linear RGB from 0 to 1."""

    vertices: np.ndarray
    triangles: np.ndarray
    colours: np.ndarray

    def outermost(self) -> np.ndarray:
        """(26,) indices of vertices, the furthest in the directions to faces, edges and corners of a cube."""
        grid = np.stack(np.meshgrid(*[[-1, 0, 1]] * 3), axis=-1).reshape(-1, 3)
        directions = grid[np.any(grid != 0, axis=1)]
        return np.argmax((self.vertices - self.vertices.mean(axis=0)) @ directions.T, axis=0)


def placed(motion: Motion | QuaternionMotion) -> Motion:
    """The motion as it is, an orientation alone as the motion that turns about the origin; InputError for no motion."""
    if isinstance(motion, QuaternionMotion):
        return PoseMotion(motion, Spline(motion.basis, np.zeros((motion.basis.n, 3))))
    domain: Any = getattr(motion, "domain", ())
    if not callable(motion) or np.shape(domain) != (2,) or not isinstance(motion(domain[0]), Affine):
        raise InputError(f"a {type(motion).__name__} is no motion over one time, with linear part and translation")
    return motion


def body_of(body: Any, motion: Motion) -> Body:
    """The body given, or a letter F a fifth as large as what the motion's origin crosses, where it is None.

    body: an object with `.vertices` (V, d) and `.faces` (F, 3 or 4) or `.triangles` (F, 3), or a
    pair of such arrays; planar vertices get z = 0. Raises InputError for other shapes, numbers
    that are not finite, and corners that do not exist.
    """
    if body is None:
        return letter(motion)
    if isinstance(body, Body):
        return body
    if isinstance(body, tuple) and len(body) == 2:
        vertices, faces = body
    else:
        vertices, faces = getattr(body, "vertices", None), getattr(body, "faces", getattr(body, "triangles", None))
    if vertices is None or faces is None:
        raise InputError(
            f"a body of type {type(body).__name__}: vertices (V, d) with triangles (F, 3), or an object with "
            ".vertices and .faces or .triangles, is needed"
        )
    vertices, faces = np.asarray(vertices, dtype=float), np.asarray(faces)
    if vertices.ndim != 2 or vertices.shape[1] not in (2, 3) or not np.isfinite(vertices).all():
        raise InputError(f"body vertices of shape {vertices.shape}: finite, shape (V, 2) or (V, 3), are needed")
    if faces.ndim != 2 or faces.shape[1] not in (3, 4) or not len(faces) or faces.dtype.kind not in "iu":
        raise InputError(f"body triangles of shape {faces.shape}: whole numbers, shape (F, 3), F ≥ 1, are needed")
    wrong = ((faces < 0) | (faces >= len(vertices))).any(axis=1)
    if wrong.any():
        raise InputError(f"triangle {int(np.argmax(wrong))} of the body has a corner that is none of its vertices")
    if faces.shape[1] == 4:
        faces = faces[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3)
    vertices = np.pad(vertices, ((0, 0), (0, 3 - vertices.shape[1])))
    return Body(vertices, faces.astype(np.int64), np.tile(FRONT, (len(vertices), 1)))


def dimension_of(motion: Motion) -> int:
    """2 or 3; asked of the motion's positions, since not all kinds of motion say it."""
    return int(np.shape(motion(motion.domain[0]).translation)[-1])


def letter_size(motion: Motion) -> float:
    """A fifth of the diagonal of what the motion's origin crosses, in units of the body; 1 where it stands."""
    a, b = motion.domain
    linear, places = motion(np.linspace(a, b, SAMPLES))
    diagonal = float(np.linalg.norm(np.ptp(places, axis=0)))
    scale = float(np.sqrt(np.mean(linear**2) * dimension_of(motion)))
    return diagonal / (5 * scale) if diagonal > 0 and scale > 0 else 1.0


def letter(motion: Motion) -> Body:
    """The letter F about the origin, in 3D a solid: blue in front (+z), orange behind, green round the edge."""
    size = letter_size(motion) / 100
    bars = np.array([[(x0, y0), (x1, y0), (x1, y1), (x0, y1)] for (x0, y0), (x1, y1) in BARS])
    quads = [(_raised(bars, DEPTH if dimension_of(motion) == 3 else 0.0), FRONT)]
    if dimension_of(motion) == 3:
        quads.append((_raised(bars[:, ::-1], -DEPTH), BACK))
        ends = np.stack([LETTER, np.roll(LETTER, -1, axis=0)], axis=1)
        low, high = _raised(ends, -DEPTH), _raised(ends, DEPTH)
        quads.append((np.concatenate([low, high[:, ::-1]], axis=1), SIDE))
    vertices = np.concatenate([q.reshape(-1, 3) for q, _ in quads]) * size
    colours = np.concatenate([np.tile(c, (4 * len(q), 1)) for q, c in quads])
    corners = np.arange(len(vertices)).reshape(-1, 4)
    return Body(vertices, corners[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3), colours)


def letter_outline(motion: Motion) -> np.ndarray:
    """(10, 2) the outline of the letter F about the origin, as large as in `letter`."""
    return (LETTER - MIDDLE) * letter_size(motion) / 100


def _raised(polygons: np.ndarray, height: float) -> np.ndarray:
    """Polygons (…, 2) about the letter's middle, at a height."""
    return np.concatenate([polygons - MIDDLE, np.full((*polygons.shape[:-1], 1), height / 2)], axis=-1)


def in_space(linear: np.ndarray, translation: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Linear parts (…, d, d) and translations (…, d) as (…, 3, 3) and (…, 3): planar ones in the plane z = 0."""
    if linear.shape[-1] == 3:
        return linear, translation
    wide = np.zeros((*linear.shape[:-2], 3, 3))
    wide[..., :2, :2], wide[..., 2, 2] = linear, 1.0
    return wide, np.concatenate([translation, np.zeros((*translation.shape[:-1], 1))], axis=-1)


def carried(motion: Motion, points: np.ndarray, t: np.ndarray) -> np.ndarray:
    """(N, P, 3) body points (P, 3) at times t (N,), of planar motions too."""
    linear, translation = in_space(*motion(t))
    return translation[:, None] + points @ np.swapaxes(linear, -1, -2)


def extent(motion: Motion, points: np.ndarray) -> float:
    """The diagonal of the box about all places (N, P, 3) that body points (P, 3) come to: what errors are relative to.

    Raises InputError that names a time where the motion is not finite.
    """
    t = np.linspace(*motion.domain, SAMPLES)
    with np.errstate(invalid="ignore"):
        places = carried(motion, points, t)
    finite = np.isfinite(places).all(axis=(1, 2))
    if not finite.all():
        raise InputError(f"the motion is not finite at time {t[np.argmin(finite)]:g}")
    size = float(np.linalg.norm(np.ptp(places.reshape(-1, 3), axis=0)))
    if size == 0:
        raise InputError("the body is one point that stands still: there is no motion to write")
    return size
