"""The one body of pictures, films, players and scenes: polygons, whatever form they come in."""

from collections.abc import Iterable, Sequence
from functools import cached_property
from typing import Protocol, TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from symmotion import checks
from symmotion.bodies.shapes import FRONT, Up, letter
from symmotion.bodies.triangles import triangulated
from symmotion.errors import InputError
from symmotion.values import read_only, value


class Meshed(Protocol):
    """A mesh of another library, by its faces.

    >>> class Triangle:
    ...     vertices, faces = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]], [[0, 1, 2]]
    >>> sm.bodies.Body.of(Triangle()).dimension
    2
    """

    @property
    def vertices(self) -> ArrayLike:
        """(V, d) places, d = 2 or 3."""
        ...

    @property
    def faces(self) -> ArrayLike:
        """(F, corners) the numbers of each face's vertices."""
        ...


class Triangulated(Protocol):
    """A mesh by its triangles, such as `Mesh`.

    >>> class Triangle:
    ...     vertices, triangles = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]], [[0, 1, 2]]
    >>> sm.bodies.Body.of(Triangle()).dimension
    2
    """

    @property
    def vertices(self) -> ArrayLike:
        """(V, d) places, d = 2 or 3."""
        ...

    @property
    def triangles(self) -> ArrayLike:
        """(T, 3) the numbers of each triangle's vertices."""
        ...


@value
class Body:
    """A body that is moved: closed polygons in the plane or in space.

    vertices: (V, d), d = 2 or 3, finite; faces: for each polygon the numbers of its corners, two or
    more, in order round it; colours: (V, 3) of the vertices, linear RGB from 0 to 1, None where who
    draws chooses. Raises InputError that names the face at fault.

    >>> sm.bodies.Body([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]], ((0, 1, 2),))
    Body(2D, 3 vertices, 1 faces)
    """

    vertices: np.ndarray
    faces: tuple[tuple[int, ...], ...]
    colours: np.ndarray | None = None

    def __post_init__(self):
        vertices = checks.numbers(self.vertices, "body vertices")
        if vertices.ndim != 2 or vertices.shape[1] not in (2, 3) or not np.isfinite(vertices).all():
            raise InputError(f"body vertices of shape {vertices.shape}: finite, shape (V, 2) or (V, 3), are needed")
        object.__setattr__(self, "vertices", read_only(vertices))
        object.__setattr__(self, "faces", _checked(self.faces, len(vertices)))
        if self.colours is not None:
            colours = checks.array(self.colours, (len(vertices), 3), "body colours")
            object.__setattr__(self, "colours", read_only(colours))

    @staticmethod
    def of(shape: "Shape | None" = None, dimension: int | None = None, *, size: float = 1.0, up: Up = "z") -> "Body":
        """The body that is meant by a shape in any of its forms.

        shape: a `Body`; closed polygons (P, d), in a list, or one of them; a mesh, an object with
            `.vertices` (V, d) and `.faces` (F, k) or `.triangles` (F, 3), such as `Mesh`, or a tuple of
            these two arrays; None for a letter F.
        dimension: that the body must have, 2 or 3; its own when left out.
        size: the letter's height; up: the axis that the letter stands along in space.

        Raises InputError for other shapes, numbers that are not finite and corners that do not exist.
        """
        if shape is None:
            return Body(*letter(2 if dimension is None else dimension, size, up))
        body = shape if isinstance(shape, Body) else _of_mesh(shape)
        if body is None:
            return _of_outlines(shape, dimension)
        if dimension not in (None, body.dimension):
            raise InputError(f"a body in dimension {body.dimension}: dimension {dimension} is needed")
        return body

    @property
    def dimension(self) -> int:
        """2 or 3."""
        return self.vertices.shape[1]

    def __repr__(self) -> str:
        return f"Body({self.dimension}D, {len(self.vertices)} vertices, {len(self.faces)} faces)"

    @cached_property
    def triangles(self) -> np.ndarray:
        """(T, 3) the corners of triangles that make up the faces, in the order of the faces."""
        triangles = triangulated(self.vertices, self.faces)
        if not len(triangles):
            raise InputError("a body of lines alone has no triangles: a face of 3 corners or more is needed")
        return triangles

    def polygons(self, places: np.ndarray | None = None) -> list[np.ndarray]:
        """The faces (P, d) where the vertices are, or copy by copy where places (…, V, d) has them, of any d."""
        where = self.vertices if places is None else places
        copies = where.reshape(-1, *where.shape[-2:])
        if len({len(face) for face in self.faces}) == 1:
            return list(copies[:, self.faces].reshape(-1, len(self.faces[0]), copies.shape[-1]))
        return [copy[list(face)] for copy in copies for face in self.faces]

    @property
    def shown_colours(self) -> np.ndarray:
        """(V, 3) the colours, or where there are none the figures' blue."""
        return np.tile(FRONT, (len(self.vertices), 1)) if self.colours is None else self.colours

    def scaled(self, size: float) -> "Body":
        """The body centred at the origin, the longest side of its box made `size` long."""
        low, high = self.vertices.min(axis=0), self.vertices.max(axis=0)
        return Body((self.vertices - (low + high) / 2) * size / (high - low).max(), self.faces, self.colours)

    def in_space(self) -> "Body":
        """The body itself, a planar one in the plane z = 0."""
        if self.dimension == 3:
            return self
        return Body(np.pad(self.vertices, ((0, 0), (0, 1))), self.faces, self.colours)

    def outermost(self) -> np.ndarray:
        """(26,) indices of vertices, the furthest in the directions to faces, edges and corners of a cube."""
        grid = np.stack(np.meshgrid(*[[-1, 0, 1]] * 3), axis=-1).reshape(-1, 3)
        directions = grid[np.any(grid != 0, axis=1)]
        vertices = self.in_space().vertices
        return np.argmax((vertices - vertices.mean(axis=0)) @ directions.T, axis=0)


# What `Body.of` takes.
Shape: TypeAlias = Body | Meshed | Triangulated | ArrayLike | Sequence[ArrayLike]


def joined(bodies: Sequence[Body]) -> Body:
    """Several bodies as one, without their colours.

    bodies: one or more, of one dimension. Raises InputError for others.

    >>> one = sm.bodies.ellipsoid_mesh([1.0, 1.0, 1.0])
    >>> len(sm.bodies.joined([one, one]).faces) == 2 * len(one.faces)
    True
    """
    if len({b.dimension for b in bodies}) != 1:
        raise InputError(f"{len(bodies)} bodies: one or more, of one dimension, are needed")
    offsets = np.cumsum([0, *(len(b.vertices) for b in bodies[:-1])]).tolist()
    faces = tuple(tuple(o + i for i in face) for b, o in zip(bodies, offsets, strict=True) for face in b.faces)
    return Body(np.concatenate([b.vertices for b in bodies]), faces)


def _checked(faces: Iterable[ArrayLike], count: int) -> tuple[tuple[int, ...], ...]:
    """Faces as tuples; InputError unless they name two or more of so many vertices each."""
    given = [np.asarray(face) for face in faces]
    if not given:
        raise InputError("body: one face or more is needed")
    for i, face in enumerate(given):
        if face.ndim != 1 or len(face) < 2 or face.dtype.kind not in "iu":
            raise InputError(f"body, face {i}: two corners or more, whole numbers, are needed")
    corners = np.concatenate(given)
    wrong = (corners < 0) | (corners >= count)
    if wrong.any():
        face = np.repeat(np.arange(len(given)), [len(f) for f in given])[np.argmax(wrong)]
        raise InputError(f"face {face} of the body has a corner that is none of its vertices, 0 … {count - 1}")
    return tuple(tuple(face.tolist()) for face in given)


def _of_mesh(shape: object) -> Body | None:
    """The body of vertices with faces, None where a shape is no mesh."""
    if isinstance(shape, tuple) and len(shape) == 2:
        vertices, faces = shape
    else:
        vertices, faces = getattr(shape, "vertices", None), getattr(shape, "faces", getattr(shape, "triangles", None))
    if vertices is None or faces is None:
        return None
    try:
        whole = np.asarray(faces)
    except ValueError:  # of different lengths
        return Body(checks.floats(vertices, "body vertices"), tuple(map(tuple, faces)))
    if whole.ndim != 2 or whole.shape[1] < 3 or not len(whole) or whole.dtype.kind not in "iu":
        pair = "; outlines are given in a list" if isinstance(shape, tuple) else ""
        raise InputError(f"body faces of shape {whole.shape}: whole numbers (F, k), F ≥ 1, k ≥ 3, are needed{pair}")
    return Body(checks.floats(vertices, "body vertices"), tuple(map(tuple, whole.tolist())))


def _of_outlines(shape: object, dimension: int | None) -> Body:
    """The body of closed polygons, or of one of them."""
    outlines = _outlines(shape)
    if not outlines:
        raise InputError("body: one outline or more is needed")
    if dimension is None:
        dimension = outlines[0].shape[-1] if outlines[0].ndim and outlines[0].shape[-1] in (2, 3) else 2
    for i, outline in enumerate(outlines):
        if outline.ndim != 2 or outline.shape[1] != dimension or len(outline) < 2:
            raise InputError(f"body, outline {i}: shape {outline.shape}; (P, {dimension}), P ≥ 2, is needed")
        if not np.isfinite(outline).all():
            raise InputError(f"body, outline {i}: a point is not finite")
    ends = np.cumsum([len(outline) for outline in outlines])
    corners = np.split(np.arange(ends[-1]), ends[:-1])
    return Body(np.concatenate(outlines), tuple(tuple(face.tolist()) for face in corners))


def _outlines(shape: object) -> list[np.ndarray]:
    for part in shape if isinstance(shape, list | tuple) else [shape]:
        if isinstance(part, np.ndarray) and (np.ma.is_masked(part) or part.dtype.kind == "c"):
            checks.numbers(part, "body")
    try:
        whole = np.asarray(shape, dtype=float)
        return [whole] if whole.ndim == 2 else list(whole)
    except ValueError:
        # Polygons of different lengths, or none.
        polygons = shape if isinstance(shape, Iterable) else ()
    except TypeError:
        raise InputError(
            f"body: a {type(shape).__name__} is no outline; closed polygons (P, d), a mesh, an object with .vertices "
            "and .faces or .triangles, or a tuple of such arrays is needed"
        ) from None
    try:
        return [checks.floats(polygon, "body, an outline") for polygon in polygons]
    except (TypeError, ValueError):
        what = "a file is read first, by trimesh.load for example; " if isinstance(shape, str) else ""
        raise InputError(f"body: {what}outlines are arrays of numbers (P, d)") from None
