"""Affine spline motions: x ↦ v(t) + A(t) x with control matrices and control points (HJK (2)–(5))."""

from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from symmotion.brief import between
from symmotion.checks import numbers
from symmotion.errors import InputError
from symmotion.motions.motion import matrix, trajectory
from symmotion.motions.position import Affine
from symmotion.pictures import as_html, plot_positions
from symmotion.saving import save
from symmotion.splines import BSplineBasis, Spline
from symmotion.values import read_only, value


@value
class AffineMotion:
    """The motion x ↦ Σ N_j(t) (v_j + A_j x).

    basis: the B-splines N_j; linear: (n, d, d) control matrices A_j; translation: (n, d)
    control points v_j, zero when left out.

    Raises InputError for controls of other shapes, and times outside of its domain.

    >>> basis = sm.splines.BSplineBasis.clamped([0.0, 1.0], 1)
    >>> motion = sm.AffineMotion(basis, [np.eye(2), 2 * np.eye(2)])
    >>> motion(0.5).linear
    array([[1.5, 0. ],
           [0. , 1.5]])
    """

    basis: BSplineBasis
    linear: np.ndarray
    # None only on the way in: zero is put in its place.
    translation: np.ndarray = None  # pyright: ignore[reportAssignmentType]

    if TYPE_CHECKING:
        # Whatever is like an array goes in; the fields are arrays.
        def __init__(self, basis: BSplineBasis, linear: ArrayLike, translation: ArrayLike | None = None) -> None: ...

    def __post_init__(self):
        linear = numbers(self.linear, "control matrices")
        n = self.basis.n
        if linear.ndim != 3 or linear.shape[1] != linear.shape[2] or len(linear) != n:
            raise InputError(f"control matrices of shape {linear.shape}: ({n}, d, d) is needed for this basis")
        d = linear.shape[1]
        translation = np.zeros((n, d)) if self.translation is None else numbers(self.translation, "control points")
        if translation.shape != (n, d):
            raise InputError(f"control points of shape {translation.shape}: ({n}, {d}) is needed")
        object.__setattr__(self, "linear", read_only(linear))
        object.__setattr__(self, "translation", read_only(translation))

    @staticmethod
    def from_spline(spline: Spline, dimension: int) -> "AffineMotion":
        """The motion whose controls (n, d² + d) hold each matrix row by row, then the point."""
        c, d = spline.control_points, dimension
        return AffineMotion(spline.basis, c[:, : d * d].reshape(-1, d, d), c[:, d * d :])

    @cached_property
    def spline(self) -> Spline:
        """All coordinates as one spline with controls (n, d² + d): each matrix row by row, then the point."""
        return Spline(self.basis, np.concatenate([self.linear.reshape(len(self.linear), -1), self.translation], axis=1))

    @property
    def dimension(self) -> int:
        """Of the space that the body is in, d = 2 or 3."""
        return self.linear.shape[-1]

    @property
    def degree(self) -> int:
        """The degree of the spline in time."""
        return self.basis.degree

    @property
    def domain(self) -> tuple[float, float]:
        """First and last time."""
        return self.basis.domain

    @property
    def breakpoints(self) -> np.ndarray:
        """(K,) the borders of the polynomial pieces, ends of the domain included."""
        return self.basis.breakpoints

    def __repr__(self) -> str:
        a, b = self.domain
        return f"AffineMotion({self.dimension}D, degree {self.degree}, {self.basis.n} controls, times {between(a, b)})"

    def __call__(self, t: ArrayLike, nu: int = 0, extrapolate: bool = False) -> Affine:
        """The nu-th derivative at times t: linear t.shape + (d, d), translation t.shape + (d,).

        Raises InputError outside the domain unless `extrapolate`.
        """
        values, d = self.spline(t, nu, extrapolate), self.dimension
        return Affine(values[..., : d * d].reshape(*values.shape[:-1], d, d), values[..., d * d :])

    def gram(self, t: ArrayLike) -> np.ndarray:
        """G = AᵀA at times t: t.shape + (d, d), the inner products of the moving unit vectors."""
        linear = self(t).linear
        return np.swapaxes(linear, -1, -2) @ linear

    def refined(self, new_knots: ArrayLike) -> "AffineMotion":
        """The same motion with knots inserted."""
        return AffineMotion.from_spline(self.spline.refined(new_knots), self.dimension)

    def elevated(self, times: int = 1) -> "AffineMotion":
        """The same motion with the degree raised."""
        return AffineMotion.from_spline(self.spline.elevated(times), self.dimension)

    matrix = matrix
    trajectory = trajectory
    save = save
    plot = plot_positions
    _repr_html_ = as_html
