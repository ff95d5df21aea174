"""Motions made of less: a curve that carries a body, a part of a motion."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from symmotion.bodies.places import dimension_of
from symmotion.brief import in_a_line
from symmotion.motions import Affine
from symmotion.motions.motion import Moving
from symmotion.views.parallel import TO_Z


@dataclass(frozen=True, eq=False)
class Clipped:
    """A motion between two times of its own."""

    motion: Moving
    domain: tuple[float, float]

    @property
    def dimension(self) -> int:
        return dimension_of(self.motion)

    def __call__(self, t: ArrayLike, nu: int = 0, /) -> Affine:
        return self.motion(t, nu)


@dataclass(frozen=True, eq=False)
class Upright:
    """A motion in space whose y is upright, turned so that z is."""

    motion: Moving

    @property
    def domain(self) -> tuple[float, float]:
        return self.motion.domain

    @property
    def dimension(self) -> int:
        return 3

    def __call__(self, t: ArrayLike, nu: int = 0, /) -> Affine:
        return upright(self.motion(t, nu))


def upright(position: Affine) -> Affine:
    """Positions in space, or derivatives of them, turned so that z is upright where y was."""
    return Affine(TO_Z @ position.linear, position.translation @ TO_Z.T)


@dataclass(frozen=True, eq=False)
class Travelling:
    """The motion that carries a body along a curve, a function of t and nu, without turning it.

    >>> curve = sm.curves.bezier([[0.0, 0.0], [2.0, 1.0]])
    >>> sm.report.Travelling(curve, curve.domain)(0.5).translation
    array([1. , 0.5])
    """

    curve: Callable[[ArrayLike, int], np.ndarray]
    domain: tuple[float, float]

    __repr__ = in_a_line

    @property
    def dimension(self) -> int:
        """Of the space that the curve is in, d."""
        return dimension_of(self)

    def __call__(self, t: ArrayLike, nu: int = 0, /) -> Affine:
        place = np.asarray(self.curve(t, nu))
        d = place.shape[-1]
        return Affine(np.broadcast_to(np.eye(d) if nu == 0 else np.zeros((d, d)), (*place.shape, d)), place)
