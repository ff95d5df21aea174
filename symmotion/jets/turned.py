"""Quaternion curves on pieces: polynomials through a few of their values, with a bound of what these leave out.

On a span q(t) = q_0 Π exp(ω_l B̃_l(t)) is an entire function of t. Where t = x + iy runs along an ellipse about a
piece, with the ends of the piece as foci and the sum ρ of the half axes (in half pieces), a factor turns vectors by a
matrix of norm at most exp(2 |ω_l| |Im B̃_l|), and norms add: |Ω| is at most the sum of the 2 |ω_l| |B̃′_l| with the norms
of the factors behind, |Ω̇| accordingly. A polynomial of degree m through Chebyshev points then is off by at most
4 M ρ⁻ᵐ/(ρ − 1) on the piece, M the bound on the ellipse, whatever ρ > 1: the best of several counts.

Source: KKS (7); Trefethen 2013, theorems 8.1 and 8.2 (interpolation of analytic functions).
"""

from collections.abc import Sequence
from functools import lru_cache

import numpy as np

from symmotion.motions.quaternions import QuaternionMotion
from symmotion.splines.cumulative import cumulative
from symmotion.splines.pieces import EPS, Poly, choose

DEGREE = 10
ELLIPSES = 2.0 ** np.arange(0.5, 7.0, 0.5)
# What sines, products and sums of a chain of factors may be off by, in roundings of its size.
SLOPPY = 64
# Bounds are computed with rounding themselves.
INFLATED = 1 + 1e-9


def turned_pieces(
    curve: QuaternionMotion, left: np.ndarray, right: np.ndarray, needed: Sequence[int]
) -> dict[int, Poly]:
    """The entries needed of q, Ω, Ω̇ (0 … 9) of the curve's jet on pieces from left to right (S,), each in a span."""
    origin, curve = curve.basis.origin, curve.relative
    left, right = np.clip([left - origin, right - origin], *curve.domain)
    order = 0 if max(needed) < 4 else 1 if max(needed) < 7 else 2
    shares = _nodes(DEGREE)
    times = _times(left, right, shares)
    jet = curve.jet(times, order)
    values = np.concatenate([v for v in jet if v is not None], axis=2)
    series, conversion = _transform(DEGREE), _to_bernstein(DEGREE)
    reach = np.abs(conversion).max(axis=0)
    most, error = _bounds(curve, left, right)
    late = EPS * np.maximum(np.abs(left), np.abs(right)) / (0.5 * (right - left))
    found = {}
    for i in needed:
        kind = 0 if i < 4 else 1 if i < 7 else 2
        chebyshev = series @ values[..., i]
        rounding = SLOPPY * EPS * most[kind][0] + late * most[kind][1]
        # Values off by the rounding make coefficients off by it, times what the conversion makes of each.
        total = error[kind] + rounding * (1 + 2 * reach.sum()) + (DEGREE + 4) * EPS * (reach @ np.abs(chebyshev))
        found[i] = Poly.of(conversion @ chebyshev, total * INFLATED)
    return found


def _times(left: np.ndarray, right: np.ndarray, shares: np.ndarray) -> np.ndarray:
    """(K, S) times at shares (K,) of pieces, from −1 to 1."""
    return 0.5 * (left + right) + 0.5 * (right - left) * shares[:, None]


def _bounds(
    curve: QuaternionMotion, left: np.ndarray, right: np.ndarray
) -> tuple[list[tuple[np.ndarray, np.ndarray]], list[np.ndarray]]:
    """Of q, Ω and Ω̇: bounds (S,) of the norm and of the slope by the share on each piece; and the remainders (S,)."""
    p, n = curve.degree, curve.basis.n
    times = _times(left, right, _nodes(p))
    span, weights = cumulative(curve.basis, times.ravel(), 2)
    base = span.reshape(times.shape)[0] - p
    angles = [curve.table[1][3][(base + i + 1) % n] for i in range(p)]
    series = _transform(p)
    # (order, factor) → (p + 1, S) the absolute Chebyshev coefficients, and as much more as their rounding is.
    sizes = [[np.abs(series @ w.reshape(times.shape)) for w in of_order] for of_order in weights]
    sizes = [[a + 8 * (p + 1) * EPS * a.max(axis=0) for a in of_order] for of_order in sizes]
    flat = _on_ellipse(sizes, angles, 1.0)
    slopes = [np.full_like(left, np.inf) for _ in range(3)]
    errors = [np.full_like(left, np.inf) for _ in range(3)]
    for rho in ELLIPSES.tolist():
        distance = 0.5 * (rho + 1 / rho) - 1
        for k, most in enumerate(_on_ellipse(sizes, angles, rho)):
            errors[k] = np.minimum(errors[k], most * (4 * rho**-DEGREE / (rho - 1)))
            slopes[k] = np.minimum(slopes[k], most / distance)
    return list(zip(flat, slopes, strict=True)), errors


def _on_ellipse(sizes: list[list[np.ndarray]], angles: list[np.ndarray], rho: float) -> list[np.ndarray]:
    """Bounds (S,) of |q|, |Ω| and |Ω̇| on the ellipses of a sum of half axes about the pieces."""
    powers = rho ** np.arange(len(sizes[0][0]))
    whole, imaginary = 0.5 * (powers + 1 / powers), 0.5 * (powers - 1 / powers)
    with np.errstate(over="ignore", invalid="ignore"):
        grown, rate, acceleration = np.zeros_like(angles[0]), np.zeros_like(angles[0]), np.zeros_like(angles[0])
        for angle, value, first, second in zip(angles, *sizes, strict=True):
            away = angle * (imaginary @ value)
            turn, added, bent = np.exp(2 * away), 2 * angle * (whole @ first), 2 * angle * (whole @ second)
            moved = turn * rate
            acceleration = turn * acceleration + moved * added + bent
            rate, grown = moved + added, grown + away
        bounds = [np.exp(grown), rate, acceleration]
    return [np.where(np.isnan(b), np.inf, b) for b in bounds]


@lru_cache(maxsize=32)
def _nodes(m: int) -> np.ndarray:
    """(m + 1,) the Chebyshev points of the first kind."""
    return np.cos(np.pi * (np.arange(m + 1) + 0.5) / (m + 1))


@lru_cache(maxsize=32)
def _transform(m: int) -> np.ndarray:
    """(m + 1, m + 1) Chebyshev coefficients from the values at the points."""
    k, j = np.indices((m + 1, m + 1))
    return np.where(k == 0, 1.0, 2.0) / (m + 1) * np.cos(np.pi * k * (j + 0.5) / (m + 1))


@lru_cache(maxsize=32)
def _to_bernstein(m: int) -> np.ndarray:
    """(m + 1, m + 1) Bernstein coefficients of degree m from Chebyshev coefficients.

    T_n has the coefficients (−1)ⁿ⁻ʲ C(2n, 2j)/C(n, j), which are then raised to degree m.
    """
    columns = []
    for n in range(m + 1):
        j = np.arange(n + 1)
        scaled = (-1.0) ** (n - j) * choose(2 * n, 2 * j)
        columns.append(np.convolve(scaled, choose(m - n, np.arange(m - n + 1))) / choose(m, np.arange(m + 1)))
    return np.stack(columns, axis=1)
