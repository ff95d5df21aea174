"""Fast evaluation of quaternion curves: arrays of one component each, in chunks that stay in cache."""

from collections.abc import Callable, Iterable

import numpy as np

from symmotion.splines import BSplineBasis
from symmotion.splines.cumulative import cumulative

CHUNK = 4096
Parts = list[np.ndarray]  # the components of vectors or quaternions, (N,) each
# Where a curve has come to before the factors that turn, and of each of these axis and half angle, then the values of
# its function and of that one's derivatives.
Chain = tuple[Parts, Iterable[tuple[Parts, Parts]]]
Factors = Callable[[np.ndarray, int], Chain]  # at times (N,), up to an order


def evaluate(factors: Factors, t: np.ndarray, order: int, world: bool) -> tuple[np.ndarray, list[np.ndarray]]:
    """q (N, 4) and its angular rates 1 … order, (N, 3) each, at times t (N,)."""
    q = np.empty((len(t), 4))
    rates = [np.empty((len(t), 3)) for _ in range(order)]
    for first in range(0, len(t), CHUNK):
        part = slice(first, first + CHUNK)
        orientation, turning = _chained(*factors(t[part], order))
        if world:
            turning = _to_world(orientation, turning)
        for component, values in enumerate(orientation):
            q[part, component] = values
        for target, vector in zip(rates, turning, strict=True):
            for component, values in enumerate(vector):
                target[part, component] = values
    return q, rates


def bspline_factors(basis: BSplineBasis, table: tuple[np.ndarray, np.ndarray], t: np.ndarray, order: int) -> Chain:
    """The factors of a curve over B-splines.

    table: control quaternions (4, n); axis and half angle of the increment that leads to each (4, n).
    """
    p = basis.degree
    span, weights = cumulative(basis, t, order)
    base = span - p
    places = (base + i + 1 for i in range(p))
    if basis.periodic:
        places = (place % basis.n for place in places)
    controls, increments = table
    return [c[base] for c in controls], (
        ([row[place] for row in increments], [w[i] for w in weights]) for i, place in enumerate(places)
    )


def _chained(q: Parts, factors: Iterable[tuple[Parts, Parts]]) -> tuple[Parts, list[Parts]]:
    turning: list[Parts] = []
    for (ux, uy, uz, angle), weights in factors:
        phase = angle * weights[0]
        sine = np.sin(phase)
        e = [np.cos(phase), sine * ux, sine * uy, sine * uz]
        q = _product(q, e)
        if len(weights) > 1:
            # a = 2ω B̃′ and its derivatives: what this factor adds to the rate.
            twice = 2.0 * angle
            added = []
            for w in weights[1:]:
                size = twice * w
                added.append([size * ux, size * uy, size * uz])
            turning = _advance(turning, e, added) if turning else added
    return q, turning


def _advance(turning: list[Parts], e: Parts, added: list[Parts]) -> list[Parts]:
    """The rates after one more factor: Ω ← RᵀΩ + a, differentiated as often as asked (R that of the factor)."""
    moved = [_rotate_back(e, v) for v in turning]
    a = added[0]
    result = [_sum(moved[0], a)]
    if len(added) > 1:
        # u = RᵀΩ has the derivative RᵀΩ̇ + u × a.
        first = _sum(moved[1], _cross(moved[0], a))
        result.append(_sum(first, added[1]))
        if len(added) > 2:
            second = _sum(moved[2], _cross(_sum(moved[1], first), a))
            second = _sum(second, _cross(moved[0], added[1]))
            result.append(_sum(second, added[2]))
    return result


def _to_world(q: Parts, turning: list[Parts]) -> list[Parts]:
    inverse = [q[0], -q[1], -q[2], -q[3]]
    if len(turning) > 2:
        # d/dt (R Ω̇) = R (Ω̈ + Ω × Ω̇); the rate and acceleration need no such term, Ω × Ω = 0.
        turning = [*turning[:2], _sum(turning[2], _cross(turning[0], turning[1]))]
    return [_rotate_back(inverse, v) for v in turning]


def _product(p: Parts, q: Parts) -> Parts:
    pw, px, py, pz = p
    qw, qx, qy, qz = q
    return [
        pw * qw - px * qx - py * qy - pz * qz,
        pw * qx + px * qw + py * qz - pz * qy,
        pw * qy - px * qz + py * qw + pz * qx,
        pw * qz + px * qy - py * qx + pz * qw,
    ]


def _cross(u: Parts, v: Parts) -> Parts:
    return [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]]


def _sum(u: Parts, v: Parts) -> Parts:
    return [a + b for a, b in zip(u, v, strict=True)]


def _rotate_back(e: Parts, v: Parts) -> Parts:
    """e⁻¹ v e."""
    w, *x = e
    t = [2.0 * c for c in _cross(x, v)]
    s = _cross(x, t)
    return [a - w * b + c for a, b, c in zip(v, t, s, strict=True)]
