"""Affine positions: pairs of a linear part and a translation, that move points, follow each other and have inverses."""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from symmotion.checks import floats, numbers
from symmotion.errors import InputError
from symmotion.values import content, same

# How far the last row of a homogeneous matrix may be from (0, …, 0, 1).
LAST_ROW = 1e-9


class Affine(NamedTuple):
    """Linear parts (…, d, d) and translations (…, d): of positions, of their rates, or of multipliers.

    A position is x ↦ v + A x: called with body points it says where they are, `a @ b` is b followed
    by a, and `matrix` is the homogeneous form. It unpacks as (linear, translation).

    Raises InputError for shapes that do not go together.

    >>> linear, translation = sm.Affine(np.eye(2), np.zeros(2))
    >>> linear.shape, translation.shape
    ((2, 2), (2,))
    """

    linear: np.ndarray
    translation: np.ndarray

    @staticmethod
    def of(value: "Affine | ArrayLike") -> "Affine":
        """The position of homogeneous matrices (…, d + 1, d + 1), d = 2 or 3, or of a SciPy `RigidTransform`.

        Raises InputError for other shapes and where a last row is not (0, …, 0, 1).
        """
        if isinstance(value, Affine):
            return value
        as_matrix = getattr(value, "as_matrix", None)
        matrix = numbers(value if as_matrix is None else as_matrix(), "homogeneous matrices")
        d = matrix.shape[-1] - 1 if matrix.ndim >= 2 else 0
        if d not in (2, 3) or matrix.shape[-2] != d + 1:
            raise InputError(f"homogeneous matrices of shape {matrix.shape}: (…, 3, 3) or (…, 4, 4) is needed")
        if not (np.abs(matrix[..., d, :] - np.eye(d + 1)[d]) <= LAST_ROW).all():
            raise InputError(f"homogeneous matrices: the last row must be {', '.join(['0'] * d)}, 1")
        return Affine(matrix[..., :d, :d].copy(), matrix[..., :d, d].copy())

    @property
    def matrix(self) -> np.ndarray:
        """(…, d + 1, d + 1) the homogeneous matrices ((A, v), (0, 1)) of positions."""
        return homogeneous(self, 1.0)

    def __call__(self, points: ArrayLike) -> np.ndarray:
        """Where body points are: (…, P, d) for points (P, d), (…, d) for one point (d,)."""
        linear, translation = self._arrays()
        given, d = numbers(points, "body points"), translation.shape[-1]
        if given.ndim not in (1, 2) or given.shape[-1] != d:
            raise InputError(f"body points of shape {given.shape}: ({d},) or (P, {d}) is needed")
        if given.ndim == 1:
            return translation + linear @ given
        return translation[..., None, :] + given @ np.swapaxes(linear, -1, -2)

    def __matmul__(self, other: "Affine") -> "Affine":
        """The position `other` followed by this one, x ↦ v + A (w + B x); leading axes broadcast."""
        if not isinstance(other, Affine):
            raise InputError("@ takes two positions: to move points, call the position with them")
        (linear, translation), (inner, place) = self._arrays(), other._arrays()
        return Affine(linear @ inner, translation + np.einsum("...ij,...j->...i", linear, place))

    def inverse(self) -> "Affine":
        """The inverse positions y ↦ A⁻¹ (y − v); InputError where a linear part is singular."""
        linear, translation = self._arrays()
        try:
            back = np.linalg.inv(linear)
        except np.linalg.LinAlgError:
            raise InputError("a position with a singular linear part has no inverse") from None
        return Affine(back, -np.einsum("...ij,...j->...i", back, translation))

    def _arrays(self) -> tuple[np.ndarray, np.ndarray]:
        """The two, arrays also where a list was given."""
        return floats(self.linear, "linear parts"), floats(self.translation, "translations")

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Affine) and same(self._arrays(), other._arrays())

    def __ne__(self, other: object) -> bool:
        return not self == other

    def __hash__(self) -> int:
        return hash(content(self._arrays()))

    def __repr__(self) -> str:
        linear, translation = self._arrays()
        if linear.ndim == 2 and translation.ndim == 1:
            return f"Affine(linear {in_line(linear)}, translation {in_line(translation)})"
        return f"Affine(linear {linear.shape}, translation {translation.shape})"


def homogeneous(position: Affine, last: float) -> np.ndarray:
    """(…, d + 1, d + 1) the matrices ((A, v), (0, last)): last 1 of positions, 0 of their derivatives."""
    linear, translation = position._arrays()
    d = translation.shape[-1]
    matrix = np.zeros((*translation.shape[:-1], d + 1, d + 1))
    matrix[..., :d, :d], matrix[..., :d, d], matrix[..., d, d] = linear, translation, last
    return matrix


def in_line(array: np.ndarray) -> str:
    """A small array in one line."""
    return " ".join(np.array2string(array, precision=4, suppress_small=True, separator=" ").split())
