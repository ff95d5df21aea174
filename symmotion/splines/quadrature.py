"""Gauss–Legendre quadrature, span by span: of as many nodes as are asked for, or to a tolerance."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from symmotion.brief import in_a_line
from symmotion.checks import whole
from symmotion.splines.basis import BSplineBasis

EPS = float(np.finfo(float).eps)
NODES = 12  # of an interval that is halved until the halves agree with it
MOST_EVALUATIONS = 2**18
MOST_ROUNDS = 60
ROUNDINGS = 32  # of what sums of some ten numbers may be off by
SHIFT = 16  # roundings of an interval by which its nodes are moved to see what rounding does to the integrand
# An interval's halves against itself tell by how much it is off. What is left after a halving near a kink or a root is
# up to 2.5 times as much as that.
UNSEEN = 4.0
# What halves and whole differ by may be rounding where it is less than DOUBT times what one look at the nodes has
# shown: then it is looked at again, with room for what two looks differ by. Else noise would be halved without end.
DOUBT, ROOM = 100.0, 2.0


def gauss(basis: BSplineBasis, nodes: int) -> tuple[np.ndarray, np.ndarray]:
    """Gauss points and weights, (S, nodes) each, on the S spans of the basis.

    They are times; of `basis.relative` times from its origin on, which far from zero lose no digits.
    Exact for integrands that are polynomials of degree 2 nodes − 1 on every span.

    nodes: per span. Raises InputError where that is no whole number ≥ 1.

    >>> points, weights = sm.splines.gauss(sm.splines.BSplineBasis.clamped([0.0, 1.0, 3.0], 3), 2)
    >>> points.shape, weights.sum(axis=1)
    ((2, 2), array([1., 2.]))
    """
    points, weights = _legendre(whole(nodes, 1, "nodes", " of Gauss nodes"))
    ends = basis.breakpoints
    centre, half = 0.5 * (ends[1:] + ends[:-1]), 0.5 * np.diff(ends)
    return centre[:, None] + half[:, None] * points, half[:, None] * weights


@lru_cache(maxsize=64)
def _legendre(nodes: int) -> tuple[np.ndarray, np.ndarray]:
    # Eigenvalues and a step of Newton's: a tenth of the time in which a program is built.
    return np.polynomial.legendre.leggauss(nodes)


@dataclass(frozen=True, eq=False)
class Integral:
    """An integral to a tolerance, and how well it is known.

    parts: (S,) of each interval; error: of their sum, rounding included; rounding: that alone; size: ∫ |φ| dt;
    reached: whether the error is what was asked for, or as small as rounding lets it be; worst: the piece of an
    interval that is known least.

    >>> found = sm.splines.integrate(lambda t: t**2, np.array([0.0]), np.array([1.0]))
    >>> round(float(found.parts.sum()), 9), found.reached
    (0.333333333, True)
    """

    parts: np.ndarray
    error: float
    rounding: float
    size: float
    reached: bool
    worst: tuple[float, float]

    __repr__ = in_a_line

    @property
    def value(self) -> float:
        """The integral: the sum of its parts."""
        return float(self.parts.sum())

    @property
    def digits(self) -> int:
        """How many digits are right, relative to ∫ |φ| dt."""
        if not np.isfinite(self.error) or self.error >= self.size:
            return 0
        return 16 if self.error == 0 else min(16, int(-np.log10(self.error / self.size)))


def integrate(
    density: Callable[[np.ndarray], np.ndarray], start: np.ndarray, end: np.ndarray, tolerance: float = 1e-10
) -> Integral:
    """∫ φ dt over intervals (S,), halved where the halves differ from the whole, to tolerance · ∫ |φ| dt in all.

    density: φ at times (N,). What rounding hides counts as reached: the roundings of the sums, and by how much φ
    changes where the times change by theirs. Ends after a number of evaluations that the intervals bound; an
    integrand without an integral is not `reached`, and `worst` says where.

    start, end: (S,) the ends of the intervals.

    >>> found = sm.splines.integrate(lambda t: np.sqrt(t), np.array([0.0]), np.array([1.0]))
    >>> round(float(found.parts.sum()), 8)
    0.66666667
    """
    # Numbers that are none are looked for.
    with np.errstate(all="ignore"):
        return _halved(density, np.asarray(start, dtype=float), np.asarray(end, dtype=float), tolerance)


def _halved(
    density: Callable[[np.ndarray], np.ndarray], left: np.ndarray, end: np.ndarray, tolerance: float
) -> Integral:
    points, weights = np.polynomial.legendre.leggauss(NODES)
    shares, weights = 0.5 + 0.5 * points, 0.5 * weights

    def rule(left: np.ndarray, width: np.ndarray, shift: float = 0.0) -> np.ndarray:
        t = left[:, None] + width[:, None] * shares
        if shift:
            t = t + shift * np.maximum(SHIFT * EPS * width[:, None], np.spacing(np.abs(t)))
        return density(t.ravel()).reshape(t.shape) * width[:, None]

    def rounded(found: np.ndarray, left: np.ndarray, width: np.ndarray) -> np.ndarray:
        return (np.abs(rule(left, width, 1.0) - found) + ROUNDINGS * EPS * np.abs(found)) @ weights

    width = end - left
    owner, count = np.arange(len(left)), len(left)
    most, used = max(MOST_EVALUATIONS, 16 * NODES * count), 2 * NODES * count
    found = rule(left, width)
    value, noise = found @ weights, rounded(found, left, width)
    parts, error, size, rounding = np.zeros(count), 0.0, 0.0, 0.0
    worst, rounds = (float(left[0]), float(left[0] + width[0])), 0
    while True:
        half = 0.5 * width
        begins, halves = np.concatenate([left, left + half]), np.concatenate([half, half])
        found = rule(begins, halves)
        used, rounds = used + found.size, rounds + 1
        values, sizes = found @ weights, np.abs(found) @ weights
        both = values.reshape(2, -1).sum(axis=0)
        miss = UNSEEN * np.abs(value - both)
        k = int(np.argmax(np.where(np.isfinite(miss), miss, np.inf)))
        worst = float(left[k]), float(left[k] + width[k])
        if not np.isfinite(miss).all():
            np.add.at(parts, owner, both)
            return Integral(parts, np.inf, rounding + float(noise.sum()), np.inf, False, worst)
        total = size + float(sizes.sum())
        enough, noises = 0.1 * tolerance * total / max(8, len(miss)), 0.5 * np.tile(noise, 2)
        doubt = np.tile((miss > np.maximum(noise, enough)) & (miss <= DOUBT * noise), 2)
        if doubt.any():
            used += NODES * int(doubt.sum())
            noises[doubt] = np.maximum(noises[doubt], ROOM * rounded(found[doubt], begins[doubt], halves[doubt]))
            noise = noises.reshape(2, -1).sum(axis=0)
        fine = miss <= np.maximum(noise, enough)
        if error + miss.sum() <= tolerance * total:
            fine[:] = True
        tight = half <= 4 * np.spacing(np.abs(left) + width)
        spent = rounds == MOST_ROUNDS or used + 4 * NODES * int((~fine).sum()) > most
        ended = fine | tight | spent
        np.add.at(parts, owner[ended], both[ended])
        error, rounding = error + float(miss[ended].sum()), rounding + float(noise[ended].sum())
        size += float(sizes.reshape(2, -1).sum(axis=0)[ended].sum())
        if ended.all():
            reached = error <= tolerance * size + rounding
            return Integral(parts, error + rounding, rounding, size, bool(reached), worst)
        kept = np.concatenate([~ended, ~ended])
        left, width, value = begins[kept], halves[kept], values[kept]
        owner, noise = np.tile(owner, 2)[kept], noises[kept]
