"""Motions for the tests of sweeps."""

import numpy as np
from numpy.typing import ArrayLike

from symmotion.motions import AffineMotion
from symmotion.splines import BSplineBasis

LINE = BSplineBasis.clamped([0, 1], 1)
SKEW = np.array([[1.2, 0.3, 0.0], [0.0, 0.7, 0.2], [0.1, 0.0, 0.5]])
GOES = np.array([3.0, 1.0, -0.5])


def wild(seed: int, spread: float = 0.3, travel: float = 1.0) -> AffineMotion:
    rng = np.random.default_rng(seed)
    linear = np.eye(3) + spread * rng.normal(size=(5, 3, 3))
    return AffineMotion(BSplineBasis.clamped([0, 0.5, 1], 3), linear, travel * rng.normal(size=(5, 3)))


def sliding(linear, translation: ArrayLike = GOES, start=(0.0, 0.0, 0.0)) -> AffineMotion:
    return AffineMotion(LINE, np.array([linear, linear]), np.array([start, translation]))


def scaling(*sizes: float) -> AffineMotion:
    basis = BSplineBasis.clamped([0, 1], len(sizes) - 1)
    return AffineMotion(basis, np.array(sizes)[:, None, None] * np.eye(3))
