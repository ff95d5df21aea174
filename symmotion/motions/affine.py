"""Affine spline motions: x ↦ v(t) + A(t) x with control matrices and control points (HJK (2)–(5))."""

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from symmotion.errors import InputError
from symmotion.motions.pictures import as_html, plot_positions
from symmotion.splines import BSplineBasis, Spline


class Affine(NamedTuple):
    """Linear parts (…, d, d) and translations (…, d): of positions, of their rates, or of multipliers."""

    linear: np.ndarray
    translation: np.ndarray


@dataclass(frozen=True, eq=False)
class AffineMotion:
    """The motion x ↦ Σ N_j(t) (v_j + A_j x).

    basis: the B-splines N_j; linear: (n, d, d) control matrices A_j; translation: (n, d)
    control points v_j, zero when left out.
    """

    basis: BSplineBasis
    linear: np.ndarray
    # None only on the way in: zero is put in its place.
    translation: np.ndarray = None  # pyright: ignore[reportAssignmentType]

    def __post_init__(self):
        linear = np.asarray(self.linear, dtype=float)
        n = self.basis.n
        if linear.ndim != 3 or linear.shape[1] != linear.shape[2] or len(linear) != n:
            raise InputError(f"control matrices of shape {linear.shape}: ({n}, d, d) is needed for this basis")
        d = linear.shape[1]
        translation = np.zeros((n, d)) if self.translation is None else np.asarray(self.translation, dtype=float)
        if translation.shape != (n, d):
            raise InputError(f"control points of shape {translation.shape}: ({n}, {d}) is needed")
        object.__setattr__(self, "linear", linear)
        object.__setattr__(self, "translation", translation)

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
        return self.linear.shape[-1]

    @property
    def degree(self) -> int:
        return self.basis.degree

    @property
    def domain(self) -> tuple[float, float]:
        return self.basis.domain

    def __repr__(self) -> str:
        a, b = self.domain
        return f"AffineMotion({self.dimension}D, degree {self.degree}, {self.basis.n} controls, times {a:g} to {b:g})"

    def __call__(self, t, nu: int = 0, extrapolate: bool = False) -> Affine:
        """The nu-th derivative at times t: linear t.shape + (d, d), translation t.shape + (d,).

        Raises InputError outside the domain unless `extrapolate`.
        """
        values, d = self.spline(t, nu, extrapolate), self.dimension
        return Affine(values[..., : d * d].reshape(*values.shape[:-1], d, d), values[..., d * d :])

    def trajectory(self, points, t, nu: int = 0) -> np.ndarray:
        """The nu-th derivative of the paths of body points (P, d) at times t: shape t.shape + (P, d)."""
        points = np.atleast_2d(np.asarray(points, dtype=float))
        if points.shape[-1] != self.dimension:
            raise InputError(f"body points of shape {points.shape}: (P, {self.dimension}) is needed")
        linear, translation = self(t, nu)
        return translation[..., None, :] + points @ np.swapaxes(linear, -1, -2)

    def gram(self, t) -> np.ndarray:
        """G = AᵀA at times t: t.shape + (d, d), the inner products of the moving unit vectors."""
        linear = self(t).linear
        return np.swapaxes(linear, -1, -2) @ linear

    def refined(self, new_knots) -> "AffineMotion":
        """The same motion with knots inserted."""
        return AffineMotion.from_spline(self.spline.refined(new_knots), self.dimension)

    def elevated(self, times: int = 1) -> "AffineMotion":
        """The same motion with the degree raised."""
        return AffineMotion.from_spline(self.spline.elevated(times), self.dimension)

    plot = plot_positions
    _repr_html_ = as_html
