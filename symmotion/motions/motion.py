"""What every motion can do, spline or not."""

from typing import Protocol

import numpy as np

from symmotion.motions.affine import Affine


class Motion(Protocol):
    """A motion x ↦ v(t) + A(t) x that is called as `AffineMotion` is."""

    @property
    def dimension(self) -> int: ...

    @property
    def domain(self) -> tuple[float, float]: ...

    def __call__(self, t, nu: int = 0) -> Affine:
        """The nu-th derivative at times t: linear t.shape + (d, d), translation t.shape + (d,)."""
        ...

    def trajectory(self, points, t, nu: int = 0) -> np.ndarray:
        """The nu-th derivative of the paths of body points (P, d) at times t: shape t.shape + (P, d)."""
        ...
