"""Triangle meshes: what they enclose, and whether they enclose anything."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from symmotion.checks import numbers
from symmotion.errors import InputError
from symmotion.values import read_only


@dataclass(frozen=True, eq=False)
class Mesh:
    """A surface of triangles, anticlockwise as seen from outside.

    vertices: (V, 3), finite; triangles: (F, 3) three different vertices each, F ≥ 1. Raises
    InputError that names the vertex or the triangle at fault.

    >>> triangles = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]
    >>> corner = sm.bodies.Mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], triangles)
    >>> round(corner.volume, 6)
    0.166667
    """

    vertices: np.ndarray
    triangles: np.ndarray

    def __post_init__(self):
        vertices, triangles = numbers(self.vertices, "vertices"), np.array(self.triangles)
        if vertices.ndim != 2 or vertices.shape[1] != 3:
            raise InputError(f"vertices of shape {vertices.shape}: (V, 3) is needed")
        finite = np.isfinite(vertices).all(axis=1)
        if not finite.all():
            raise InputError(f"vertex {int(np.argmin(finite))} is not finite")
        if triangles.ndim != 2 or triangles.shape[1] != 3 or not len(triangles) or triangles.dtype.kind not in "iu":
            raise InputError(
                f"triangles of shape {triangles.shape}, {triangles.dtype}: whole numbers (F, 3), F ≥ 1, are needed"
            )
        wrong = ((triangles < 0) | (triangles >= len(vertices))).any(axis=1)
        if wrong.any():
            raise InputError(f"triangle {int(np.argmax(wrong))} names a vertex outside 0 … {len(vertices) - 1}")
        repeated = (triangles == np.roll(triangles, 1, axis=1)).any(axis=1)
        if repeated.any():
            raise InputError(f"triangle {int(np.argmax(repeated))} has a vertex twice")
        for name, value in (("vertices", vertices), ("triangles", triangles.astype(np.intp))):
            object.__setattr__(self, name, read_only(value))

    def __repr__(self) -> str:
        state = "closed" if self.closed else f"{len(self.boundary_edges)} boundary edges"
        return f"Mesh({len(self.vertices)} vertices, {len(self.triangles)} triangles, {state})"

    @cached_property
    def area_vectors(self) -> np.ndarray:
        """(F, 3) the normal of each triangle, as long as its area."""
        a, b, c = (self.vertices[self.triangles[:, k]] for k in range(3))
        return 0.5 * np.cross(b - a, c - a)

    @property
    def area(self) -> float:
        """The sum of the triangles' areas, in squared units of length."""
        return float(np.linalg.norm(self.area_vectors, axis=1).sum())

    @property
    def volume(self) -> float:
        """The enclosed volume Σ a · (b × c) / 6 over the triangles abc (divergence theorem).

        Positive where the triangles face outwards; what the surface goes round several times
        counts as often. Raises InputError for a mesh that is not closed.
        """
        if not self.closed:
            raise InputError(
                f"a mesh with {len(self.boundary_edges)} boundary edges has no volume: close it, with caps for example"
            )
        # About the middle: far from the origin the terms would be large and cancel.
        centre = self.vertices.mean(axis=0)
        corners = self.vertices[self.triangles[:, 0]] - centre
        return float(np.einsum("fk,fk->", corners, self.area_vectors) / 3)

    @cached_property
    def boundary_edges(self) -> np.ndarray:
        """(B, 2) the directed edges that are not met by exactly one triangle from the other side."""
        n = len(self.vertices)
        edges = np.concatenate([self.triangles[:, [i, (i + 1) % 3]] for i in range(3)])
        there, back = edges @ [n, 1], edges @ [1, n]
        keys, inverse, counts = np.unique(there, return_inverse=True, return_counts=True)
        place = np.minimum(np.searchsorted(keys, back), len(keys) - 1)
        opposite = np.where(keys[place] == back, counts[place], 0)
        return edges[(opposite != 1) | (counts[inverse] != 1)]

    @property
    def closed(self) -> bool:
        """Whether every edge belongs to exactly two triangles, which run along it in opposite directions."""
        return not len(self.boundary_edges)

    @property
    def euler_characteristic(self) -> int:
        """V − E + F of the vertices in use: 2 for a closed surface like a sphere, 0 for a torus."""
        n = len(self.vertices)
        edges = np.sort(np.concatenate([self.triangles[:, [i, (i + 1) % 3]] for i in range(3)]), axis=1) @ [n, 1]
        # Of whole numbers by the hundred thousand, NumPy's `unique` is ten times as slow as sorting.
        count = np.count_nonzero(np.diff(np.sort(edges), prepend=-1))
        return int(np.count_nonzero(np.bincount(self.triangles.ravel(), minlength=n)) - count + len(self.triangles))

    def flipped(self) -> "Mesh":
        """The mesh with its inside out."""
        return Mesh(self.vertices, self.triangles[:, ::-1])

    def outward(self) -> "Mesh":
        """The mesh turned so that its volume is positive; InputError where it is not closed."""
        return self if self.volume >= 0 else self.flipped()


def compact(vertices: np.ndarray, triangles: np.ndarray) -> Mesh:
    """The mesh of the vertices that triangles use, without the triangles that have a vertex twice."""
    kept = (triangles != np.roll(triangles, 1, axis=1)).all(axis=1)
    used, renumbered = np.unique(triangles[kept], return_inverse=True)
    return Mesh(vertices[used], renumbered.reshape(-1, 3))
