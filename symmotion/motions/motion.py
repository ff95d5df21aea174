"""What every motion can do, spline or not."""

import os
from typing import TYPE_CHECKING, Protocol, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from symmotion.checks import numbers
from symmotion.motions.position import Affine, homogeneous

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Value = TypeVar("Value", covariant=True)


class Moving(Protocol):
    """What functions of this library ask of a motion x ↦ v(t) + A(t) x, of one that you write yourself too.

    >>> class Steady:
    ...     domain, dimension = (0.0, 1.0), 2
    ...
    ...     def __call__(self, t, nu=0):
    ...         t = np.asarray(t, dtype=float)
    ...         linear = np.broadcast_to(np.eye(2) * (nu == 0), (*t.shape, 2, 2))
    ...         return sm.Affine(linear, np.stack([t if nu == 0 else 0 * t + (nu == 1), 0 * t], axis=-1))
    >>> sm.motions.orthonormalise(Steady(), [0.0, 1.0]).deviation
    0.0
    """

    @property
    def dimension(self) -> int:
        """Of the space that the body is in, d = 2 or 3."""
        ...

    @property
    def domain(self) -> tuple[float, float]:
        """First and last time."""
        ...

    def __call__(self, t: ArrayLike, nu: int = 0, /) -> Affine:
        """The nu-th derivative at times t: linear t.shape + (d, d), translation t.shape + (d,)."""
        ...


class Motion(Protocol[Value]):
    """What the motions of this library have in common.

    Called, it says what it is made of: Motion[Affine] positions, as `AffineMotion` does,
    Motion[np.ndarray] unit quaternions. `matrix` and `trajectory` are alike for all; an
    orientation alone turns about the origin.

    >>> motion: sm.motions.Motion = sm.interpolants.component_cubic(sm.examples.planar_keyframes())
    >>> motion.dimension, motion.domain, motion.matrix(0.0).shape
    (2, (0.0, 1.0), (3, 3))
    """

    @property
    def dimension(self) -> int:
        """2 or 3."""
        ...

    @property
    def domain(self) -> tuple[float, float]:
        """The times at which it begins and ends."""
        ...

    @property
    def breakpoints(self) -> np.ndarray:
        """(B,) increasing, from end to end: the times between which it is smooth."""
        ...

    def __call__(self, t: ArrayLike, nu: int = 0) -> Value:
        """The nu-th derivative at times t, of any shape; InputError outside the domain."""
        ...

    def matrix(self, t: ArrayLike, nu: int = 0) -> np.ndarray:
        """The nu-th derivative of the homogeneous matrix ((A, v), (0, 1)) at times t: t.shape + (d + 1, d + 1)."""
        ...

    def trajectory(self, points: ArrayLike, t: ArrayLike, nu: int = 0) -> np.ndarray:
        """The nu-th derivative of the paths of body points (P, d) at times t: shape t.shape + (P, d).

        A single point (d,) is P = 1, for every class: t.shape + (1, d).
        """
        ...

    def plot(self, axes: "Axes | None" = None) -> "Axes":
        """Its picture; returns the axes."""
        ...

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write it as JSON, exactly, for `load`."""
        ...


def matrix(self: Moving, t: ArrayLike, nu: int = 0) -> np.ndarray:
    """The nu-th derivative of the homogeneous matrix ((A, v), (0, 1)) at times t: t.shape + (d + 1, d + 1)."""
    return homogeneous(self(t, nu), float(nu == 0))


def trajectory(self: Moving, points: ArrayLike, t: ArrayLike, nu: int = 0) -> np.ndarray:
    """The nu-th derivative of the paths of body points (P, d), P = 1 for a point (d,), at times t: t.shape + (P, d)."""
    return self(t, nu)(as_points(points))


def as_points(points: ArrayLike) -> np.ndarray:
    """Body points (P, d), of which a single one (d,) is one."""
    return np.atleast_2d(numbers(points, "body points"))
