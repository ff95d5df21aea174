"""Functions on pieces of a line as polynomials in Bernstein form, with bounds of what they leave out and round off.

Source: Farouki 2012 (the Bernstein form); a sum and a product of polynomials are sums and products of coefficients
with binomials, of which all are convex combinations, so that rounding does not grow.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike

from symmotion.splines.basis import BSplineBasis
from symmotion.splines.spline import Spline

EPS = float(np.finfo(float).eps)


def choose(n: ArrayLike, k: ArrayLike) -> np.ndarray:
    """C(n, k), broadcast."""
    from scipy.special import comb  # here, as SciPy's other large parts: it is not needed by `import symmotion`

    return np.asarray(comb(n, k))


@lru_cache(maxsize=256)
def binomials(n: int) -> np.ndarray:
    """(n + 1, 1) the binomials of degree n."""
    return choose(n, np.arange(n + 1))[:, None]


@dataclass(frozen=True, eq=False)
class Poly:
    """A function on S pieces, on each to within an error a polynomial Σ c_i C(n, i) (1 − s)ⁿ⁻ⁱ sⁱ, 0 ≤ s ≤ 1.

    scaled: (n + 1, S) the c_i C(n, i); size, error: (S,) bounds of |c_i| and of how far the function is away.
    One that is the same on all pieces has S = 1. +, −, × keep all of it, rounding included.
    """

    scaled: np.ndarray
    size: np.ndarray
    error: np.ndarray

    @staticmethod
    def of(coefficients: np.ndarray, error: np.ndarray) -> "Poly":
        """From the c_i (n + 1, S) themselves."""
        size = np.abs(coefficients).max(axis=0)
        return Poly(coefficients * binomials(len(coefficients) - 1), size, error + EPS * size)

    @staticmethod
    def constant(value: float) -> "Poly":
        return Poly(np.array([[value]]), np.array([abs(value)]), np.zeros(1))

    @property
    def degree(self) -> int:
        return len(self.scaled) - 1

    def raised(self, degree: int) -> np.ndarray:
        """(degree + 1, S) the c_i of the same polynomial, of a degree not below its own."""
        return self._elevated(degree) / binomials(degree)

    def _elevated(self, degree: int) -> np.ndarray:
        more = degree - self.degree
        return _convolved(binomials(more), self.scaled) if more else self.scaled

    def __add__(self, other: "Poly") -> "Poly":
        degree = max(self.degree, other.degree)
        size = self.size + other.size
        error = self.error + other.error + (degree + 4) * EPS * size
        total = self._elevated(degree) + other._elevated(degree)
        # What cancels, such as a place far away and the centre of a sphere there, must not cost its products digits.
        return Poly(total, np.minimum(size, np.abs(total / binomials(degree)).max(axis=0) * (1 + 4 * EPS)), error)

    def __neg__(self) -> "Poly":
        return Poly(-self.scaled, self.size, self.error)

    def __sub__(self, other: "Poly") -> "Poly":
        return self + (-other)

    def __mul__(self, other: "Poly") -> "Poly":
        size = self.size * other.size
        rounding = (self.degree + other.degree + 4) * EPS * size
        error = self.size * other.error + other.size * self.error + self.error * other.error + rounding
        return Poly(_convolved(self.scaled, other.scaled), size, error)


def _convolved(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """(n + m + 1, S) the convolution of (n + 1, S) and (m + 1, S) along the first axis."""
    if len(a) > len(b):
        a, b = b, a
    if len(a) == 1:
        return a * b
    total = np.zeros((len(a) + len(b) - 1, max(a.shape[1], b.shape[1])))
    for i, row in enumerate(a):
        total[i : i + len(b)] += row * b
    return total


def spline_pieces(spline: Spline, left: np.ndarray, right: np.ndarray, orders: int) -> list[tuple[np.ndarray, ...]]:
    """A spline with controls (n, C) and its derivatives on pieces from `left` to `right` (S,), each inside a span.

    Returns for each order 0 … orders − 1 the coefficients (degree + 1, C, S) and bounds (C, S) of their errors. What is
    far from zero does not cost the derivatives their digits: they are those of the differences to a control nearby.
    """
    span = spline.basis.spans(0.5 * (left + right))
    # From the origin on, which costs no digits of the knots; ends that miss the domain's by rounding are the domain's.
    left, right = np.clip([left - spline.basis.origin, right - spline.basis.origin], *spline.relative.domain)
    basis, p = spline.basis, spline.degree
    controls = spline.control_points.T
    first = controls[:, (span - p) % basis.n]
    local = [controls[:, (span - p + j) % basis.n] - first for j in range(p + 1)]
    size = np.max(np.abs(local), axis=0)
    here, error = (
        np.stack([_blossom(basis, local, span, left, right, i) for i in range(p + 1)]),
        6 * (p + 1) * EPS * size,
    )
    found, width = [(here + first, error + EPS * (np.abs(first) + size))], right - left
    for order in range(1, orders):
        n = p - order + 1
        if n <= 0:
            found.append((np.zeros((1, *size.shape)), np.zeros_like(size)))
            continue
        here = np.diff(here, axis=0) * (n / width)
        error = 2 * error * n / width + 4 * EPS * np.max(np.abs(here), axis=0)
        found.append((here, error))
    return found


def _blossom(
    basis: BSplineBasis, local: list[np.ndarray], span: np.ndarray, left: np.ndarray, right: np.ndarray, i: int
) -> np.ndarray:
    """(C, S) the blossom at `left` p − i times and `right` i times, which is the i-th coefficient: de Boor."""
    p, points = basis.degree, local
    for r in range(p):
        at = left if r < p - i else right
        shares = []
        for j in range(p - r):
            low, high = basis.knots[span + r + 1 - p + j], basis.knots[span + 1 + j]
            shares.append((at - low) / (high - low))
        points = [points[j] + share * (points[j + 1] - points[j]) for j, share in enumerate(shares)]
    return points[0]


def halves(coefficients: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The coefficients (n + 1, S) on the first and the second half of every piece: de Casteljau."""
    n = len(coefficients) - 1
    matrix = halving(n)
    return matrix @ coefficients, matrix[::-1, ::-1] @ coefficients


@lru_cache(maxsize=128)
def halving(n: int) -> np.ndarray:
    """(n + 1, n + 1) what makes the coefficients on the first half: C(i, j) / 2ⁱ."""
    i, j = np.indices((n + 1, n + 1))
    return choose(i, j) / 2.0**i
