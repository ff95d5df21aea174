"""Quaternion curves made of the same quaternions in different ways, as functions that tell their rates."""

from collections.abc import Callable
from typing import Any

import numpy as np

import symmotion as sm
from symmotion.motions.interpolants import rational_spline, shoemake_interpolant, slerp, slerp_bspline
from symmotion.motions.quaternions import QuaternionMotion, exp, interpolate_quaternions, product, to_rotation
from symmotion.splines import BSplineBasis

Rates = Callable[[np.ndarray, int], np.ndarray]  # body rates of an order 1 or 2 at times (N,): (N, 3)


def chain(count: int, degrees: float, seed: int) -> np.ndarray:
    """Quaternions whose neighbours are so far apart, about random axes."""
    rng = np.random.default_rng(seed)
    q = [np.array([1.0, 0.0, 0.0, 0.0])]
    for _ in range(count - 1):
        axis = rng.normal(size=3)
        q.append(product(q[-1], exp(np.deg2rad(degrees) / 2 * axis / np.linalg.norm(axis))))
    return np.array(q)


def forms(q: np.ndarray) -> dict[str, tuple[Rates, Rates]]:
    """Curves of the same uniform cubic B-spline polygon: their rates before and after times that may be knots."""
    basis = BSplineBasis(np.arange(-3.0, len(q) + 1), 3)
    pieces = _converted(q)

    def whole(curve: Any) -> tuple[Rates, Rates]:  # Any: whatever has a jet
        return (
            lambda t, order: curve.jet(np.nextafter(t, -np.inf), order)[order],
            lambda t, order: curve.jet(t, order)[order],
        )

    def piecewise(before: bool) -> Rates:
        def rates(t: np.ndarray, order: int) -> np.ndarray:
            place = np.clip(np.ceil(t) - 1 if before else np.floor(t), 0, len(pieces) - 1).astype(int)
            return np.stack([pieces[i].jet(s, order)[order] for i, s in zip(place, t, strict=True)])

        return rates

    return {
        "cumulative B-spline": whole(QuaternionMotion(basis, q)),
        "de Boor with slerps": whole(slerp_bspline(basis, q)),
        "converted to cumulative Bézier": (piecewise(True), piecewise(False)),
    }


def _converted(q: np.ndarray) -> list[QuaternionMotion]:
    """The spans of a uniform cubic B-spline as cumulative Bézier curves, converted by slerps."""
    third = np.array([1.0, 2.0]) / 3
    inner = slerp(q[:-1, None], q[1:, None], third[None])
    joints = slerp(inner[:-1, 1], inner[1:, 0], np.array(0.5))
    controls = [np.stack([joints[i], *inner[i + 1], joints[i + 1]]) for i in range(len(joints) - 1)]
    return [QuaternionMotion.bezier(c, span=(float(i), i + 1.0)) for i, c in enumerate(controls)]


def through(q: np.ndarray, t: np.ndarray) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Body rates and accelerations at times t of smooth curves through quaternions at times 0, 1, 2, …"""
    keys = np.arange(float(len(q)))
    rational = rational_spline(sm.Keyframes(keys, to_rotation(q).as_matrix(), np.zeros((len(q), 3))))
    back = np.swapaxes(rational(t).linear, 1, 2)
    # RᵀṘ = [Ω]×, and the skew part of RᵀR̈ is [Ω̇]×.
    first, second = (back @ rational(t, nu).linear for nu in (1, 2))
    shoemake, smooth = shoemake_interpolant(keys, q).jet(t), interpolate_quaternions(keys, q).jet(t)
    return {
        "rational spline": (_vector(first), _vector(second)),
        "Shoemake's Bézier": (shoemake.rate, shoemake.acceleration),
        "C² cumulative": (smooth.rate, smooth.acceleration),
    }


def _vector(m: np.ndarray) -> np.ndarray:
    """(N, 3) the vectors of the skew parts of matrices (N, 3, 3)."""
    return np.stack([m[:, 2, 1] - m[:, 1, 2], m[:, 0, 2] - m[:, 2, 0], m[:, 1, 0] - m[:, 0, 1]], axis=1) / 2
