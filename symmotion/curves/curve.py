"""What every curve can do."""

import os
from typing import Protocol

import numpy as np

from symmotion.splines import Spline


class Curve(Protocol):
    """What all curves have in common."""

    @property
    def domain(self) -> tuple[float, float]: ...

    @property
    def breakpoints(self) -> np.ndarray: ...

    def __call__(self, t, nu: int = 0, extrapolate: bool = False) -> np.ndarray: ...

    def to_bspline(self) -> Spline: ...

    def save(self, path: str | os.PathLike[str]) -> None: ...
