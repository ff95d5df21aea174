"""Rotations as CasADi expressions, smooth through zero with all derivatives, and the jet of a quaternion curve.

Scalar first. Where a formula is 0/0, a power series in the squared norm takes its place: `if_else` on
that square, with the other branch kept away from zero so that no derivative of it is NaN.
"""

from collections.abc import Callable, Sequence
from functools import lru_cache, wraps
from math import factorial

import casadi as ca

# Up to here the series, of 9 terms for cos and sin and 12 for the logarithm, are exact to rounding.
SMALL_SQUARE = 0.25
SMALL_VERSINE = 0.05


def symbols(name: str = "quaternion") -> ca.SX:
    """A quaternion (4, 1) of symbols."""
    return ca.SX.sym(name, 4)


def written_once(*sizes: int) -> Callable[[Callable[..., ca.SX]], Callable[..., ca.SX]]:
    """An expression of vectors of these sizes, written in symbols once: CasADi copies it faster than Python says it."""

    def of(expression: Callable[..., ca.SX]) -> Callable[..., ca.SX]:
        @lru_cache(maxsize=1)
        def function() -> ca.Function:
            symbols = [ca.SX.sym(f"v_{k}", size) for k, size in enumerate(sizes)]
            return ca.Function("expression", symbols, [expression(*symbols)])

        @wraps(expression)
        def copied(*vectors: ca.SX) -> ca.SX:
            return function().call(list(vectors))[0]

        return copied

    return of


@written_once(4, 4)
def product(p: ca.SX, q: ca.SX) -> ca.SX:
    """p q, quaternions (4, 1)."""
    return ca.vertcat(
        p[0] * q[0] - p[1] * q[1] - p[2] * q[2] - p[3] * q[3],
        p[0] * q[1] + p[1] * q[0] + p[2] * q[3] - p[3] * q[2],
        p[0] * q[2] - p[1] * q[3] + p[2] * q[0] + p[3] * q[1],
        p[0] * q[3] + p[1] * q[2] - p[2] * q[1] + p[3] * q[0],
    )


def conjugate(q: ca.SX) -> ca.SX:
    """(w, −x, −y, −z)."""
    return ca.vertcat(q[0], -q[1], -q[2], -q[3])


@written_once(3)
def exp(v: ca.SX) -> ca.SX:
    """exp(v) = (cos |v|, sin |v| v/|v|), v (3, 1)."""
    s = ca.sumsqr(v)
    small = s < SMALL_SQUARE
    near = ca.if_else(small, s, 0.0)
    angle = ca.sqrt(ca.if_else(small, 1.0, s))
    cosine = ca.if_else(small, _series([(-1) ** k / factorial(2 * k) for k in range(9)], near), ca.cos(angle))
    ratio = [(-1) ** k / factorial(2 * k + 1) for k in range(9)]
    sinc = ca.if_else(small, _series(ratio, near), ca.sin(angle) / angle)
    return ca.vertcat(cosine, sinc * v)


def log(q: ca.SX, turns: "ca.SX | float" = 0.0) -> ca.SX:
    """The v (3, 1) with exp(v) = q for a unit quaternion, |v| < π; with `turns`, 2π · turns longer.

    v = h(w) Im q with h = θ/sin θ, cos θ = w. As a function of w alone it is smooth at w = 1, is
    defined beyond (h is held from w = 1.5 on), and fixes the length of q: no gauge is left to drift along.
    """
    return _longer(q, turns) if isinstance(turns, ca.SX) else _principal(q)


@written_once(4)
def _principal(q: ca.SX) -> ca.SX:
    return _angle_by_sine(q)[0] * q[1:]


@written_once(4, 1)
def _longer(q: ca.SX, turns: ca.SX) -> ca.SX:
    ratio, sine = _angle_by_sine(q)
    return (ratio + ca.if_else(turns == 0.0, 0.0, 2 * ca.pi * turns / sine)) * q[1:]


def _angle_by_sine(q: ca.SX) -> tuple[ca.SX, ca.SX]:
    """θ/sin θ, cos θ = w, and sin θ, 1 where it is small."""
    y = 1.0 - q[0]
    small = y < SMALL_VERSINE
    safe = ca.if_else(small, 1.0, y)
    cosine = ca.fmax(1.0 - safe, -1.0 + 1e-12)
    sine = ca.sqrt((1.0 - cosine) * (1.0 + cosine))
    # θ/sin θ = Σ 4ᵏ (k!)²/(2k + 1)! (y/2)ᵏ.
    terms = [4.0**k * factorial(k) ** 2 / factorial(2 * k + 1) / 2.0**k for k in range(12)]
    ratio = ca.if_else(small, _series(terms, ca.fmax(ca.if_else(small, y, 0.0), -0.5)), ca.acos(cosine) / sine)
    return ratio, ca.if_else(small, 1.0, sine)


def _series(coefficients: Sequence[float], x: ca.SX) -> ca.SX:
    result = ca.SX(coefficients[-1])
    for c in reversed(coefficients[:-1]):
        result = c + x * result
    return result


@written_once(4, 3)
def rotate(q: ca.SX, v: ca.SX | ca.DM) -> ca.SX:
    """q v q⁻¹, a vector v (3, 1) turned by a unit quaternion."""
    twice = 2 * ca.cross(q[1:], v)
    return v + q[0] * twice + ca.cross(q[1:], twice)


def orientation(first: ca.SX, ways: Sequence[ca.SX], weights: ca.SX) -> ca.SX:
    """q_a Π exp(ω_l b_l), weights b (p,): KKS (7) on one span."""
    q = first
    for k, way in enumerate(ways):
        q = product(q, exp(weights[k] * way))
    return q


def rates(ways: Sequence[ca.SX], weights: ca.SX, first: ca.SX, second: ca.SX) -> tuple[ca.SX, ca.SX]:
    """Ω and Ω̇ (3, 1) of Π exp(ω_l b_l): Ω ← RᵀΩ + 2ω ḃ, Ω̇ ← RᵀΩ̇ + RᵀΩ × 2ω ḃ + 2ω b̈, factor by factor."""
    rate, acceleration = 2 * first[0] * ways[0], 2 * second[0] * ways[0]
    for k in range(1, len(ways)):
        back = conjugate(exp(weights[k] * ways[k]))
        added, moved = 2 * first[k] * ways[k], rotate(back, rate)
        acceleration = rotate(back, acceleration) + ca.cross(moved, added) + 2 * second[k] * ways[k]
        rate = moved + added
    return rate, acceleration
