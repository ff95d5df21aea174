"""What every curve can do."""

import os
from typing import Protocol

import numpy as np

from symmotion.splines import Spline


class Curve(Protocol):
    """What all curves have in common.

    >>> curve: sm.curves.Curve = sm.curves.bezier([[0.0, 0.0], [1.0, 2.0]])
    >>> curve.domain, curve(0.5), curve(0.5, nu=1)
    ((0.0, 1.0), array([0.5, 1. ]), array([1., 2.]))
    """

    @property
    def domain(self) -> tuple[float, float]:
        """First and last parameter."""
        ...

    @property
    def breakpoints(self) -> np.ndarray:
        """(N,) the parameters between which the curve is smooth, both ends among them, ascending."""
        ...

    def __call__(self, t, nu: int = 0, extrapolate: bool = False) -> np.ndarray: ...

    def to_bspline(self) -> Spline:
        """The curve as a spline, exact where it is piecewise polynomial, else within its tolerance."""
        ...

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write a file that `sm.load` reads."""
        ...
