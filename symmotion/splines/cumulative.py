"""Cumulative B-splines B̃_i = Σ_{j ≥ i} B_j, the weights of increments instead of controls (KKS 4.2, 5.3)."""

from dataclasses import replace
from functools import cached_property
from itertools import pairwise

import numpy as np

from symmotion.brief import between
from symmotion.checks import floats, numbers, whole
from symmotion.errors import InputError
from symmotion.splines.basis import BSplineBasis
from symmotion.splines.spline import Spline
from symmotion.values import read_only, value

# What controls of functions that sum to one may miss it by, and what counts as zero or one among their sums.
ONE, ROUNDING = 1e-9, 1e-13


def cumulative(basis: BSplineBasis, t: np.ndarray, order: int = 0) -> tuple[np.ndarray, list[list[np.ndarray]]]:
    """Where the cumulative functions change at t (N,), and their derivatives 0 … order there.

    Returns the spans k (N,) and, per derivative, the p arrays (N,) of B̃_{k−p+1} … B̃_k; those
    before them are 1, those behind 0. B̃_i′ = p/(t_{i+p} − t_i) B_{i,p−1}: one pass of Cox–de Boor
    through the lower degrees yields all of them.

    >>> basis = sm.splines.BSplineBasis.clamped([0.0, 1.0], 1)
    >>> span, (values,) = sm.splines.cumulative(basis, np.array([0.25]))
    >>> values
    [array([0.25])]
    """
    p, knots = basis.degree, basis.knots
    span, t = basis.spans(t), t - basis.origin
    at = {j: knots[span + j] for j in range(1 - p, p + 1)}
    below = [t - at[j] for j in range(1 - p, 1)][::-1]  # t − t_{k−j}
    above = [at[j] - t for j in range(1, p + 1)]
    inverse = {}  # per degree q: 1/(t_{k+1+r} − t_{k+1+r−q}), r = 0 … q − 1
    levels = [[np.ones_like(t)]]
    for q in range(1, p + 1):
        lower, saved = levels[-1], None
        inverse[q] = [1.0 / (above[r] + below[q - 1 - r]) for r in range(q)]
        higher = []
        for r in range(q):
            share = lower[r] * inverse[q][r]
            left = above[r] * share
            higher.append(left if saved is None else saved + left)
            saved = below[q - 1 - r] * share
        higher.append(saved)
        levels.append(higher)
    sums = [levels[p][p]]
    for i in range(p - 1, 0, -1):
        sums.insert(0, levels[p][i] + sums[0])
    result = [sums]
    for nu in range(1, order + 1):
        result.append(_derivative(levels, inverse, p, nu) if nu <= p else [np.zeros_like(t)] * p)
    return span, result


def _derivative(levels: list, inverse: dict, p: int, nu: int) -> list[np.ndarray]:
    """The nu-th derivatives of the p cumulative functions: differences of the B-splines of degree p − nu."""
    values = levels[p - nu]
    for q in range(p - nu + 1, p):
        slopes = [q * v * i for v, i in zip(values, inverse[q], strict=True)]
        inner = [a - b for a, b in pairwise(slopes)]
        values = [-slopes[0], *inner, slopes[-1]]
    return [p * v * i for v, i in zip(values, inverse[p], strict=True)]


@value
class CumulativeBasis:
    """Functions F_1 … F_n of time that change one after the other: the cumulative form of any basis (KKS 4.2).

    F_i = Σ_j c_ij N_j, where c_ij is 0 for j < first_i, then one of the `weights` after the other, then the last of
    them for good: what is before the changes and behind them takes no room, and no time.
    basis: the B-splines N_j, not periodic; first: (n,) indices of controls, which do not decrease; weights: (n, w).

    Raises InputError for a periodic basis, other shapes, and indices that decrease or are none.

    >>> over = sm.splines.CumulativeBasis.of(sm.curves.catmull_rom([0.0, 1.0, 2.0], np.eye(3)))
    >>> over([0.0, 0.5, 1.0, 2.0])
    array([[ 0.   ,  0.   ],
           [ 0.625, -0.125],
           [ 1.   ,  0.   ],
           [ 1.   ,  1.   ]])
    """

    basis: BSplineBasis
    first: np.ndarray
    weights: np.ndarray

    def __post_init__(self):
        weights, first = numbers(self.weights, "weights"), numbers(self.first, "first indices")
        if self.basis.periodic:
            raise InputError("a periodic basis has no functions that end at one; a clamped one is needed")
        if weights.ndim != 2 or not weights.shape[1] or first.shape != weights.shape[:1]:
            raise InputError(f"weights of shape {weights.shape} for first indices of shape {first.shape}: (n, w), (n,)")
        if (first != np.round(first)).any() or (np.diff(first) < 0).any() or not np.isfinite(weights).all():
            raise InputError("first indices must be whole numbers that do not decrease, and weights finite")
        object.__setattr__(self, "first", read_only(first.astype(int)))
        object.__setattr__(self, "weights", read_only(weights))

    def __repr__(self) -> str:
        a, b = self.basis.domain
        return f"CumulativeBasis(degree {self.basis.degree}, {self.n} functions, {between(a, b)})"

    @staticmethod
    def of(functions: "Spline | BSplineBasis") -> "CumulativeBasis":
        """The sums Σ_{j ≥ i} B_j, i = 1 … n, of functions B_0 … B_n that sum to one.

        functions: a spline with control points (N, n + 1), such as any interpolant of the rows of a unit matrix is,
        or B-splines themselves. Raises InputError where they do not sum to one.
        """
        if isinstance(functions, BSplineBasis):
            return CumulativeBasis(functions, np.arange(1, functions.n), np.ones((functions.n - 1, 1)))
        controls = functions.control_points
        if controls.ndim != 2 or controls.shape[1] < 2:
            raise InputError(f"control points of shape {controls.shape}: (N, n + 1), a column per function, is needed")
        off = np.abs(controls.sum(axis=1) - 1).max()
        if not off <= ONE:
            raise InputError(f"the functions do not sum to one, but miss it by up to {off:.2g}")
        sums = np.cumsum(controls[:, ::-1], axis=1)[:, -2::-1].T
        for level in (0.0, 1.0):
            sums = np.where(np.abs(sums - level) <= ROUNDING, level, sums)
        differs = sums[:, 1:] != sums[:, :-1]
        count = controls.shape[0]
        first = np.where(differs.any(axis=1), differs.argmax(axis=1) + 1, count)
        first = np.where(sums[:, 0] != 0, 0, first)
        last = np.where(differs.any(axis=1), count - 1 - differs[:, ::-1].argmax(axis=1), 0)
        first = np.minimum.accumulate(first[::-1])[::-1]
        place = first[:, None] + np.arange(max(1, int((last - first).max()) + 1))
        return CumulativeBasis(functions.basis, first, np.take_along_axis(sums, np.minimum(place, count - 1), axis=1))

    @property
    def n(self) -> int:
        """Number of functions, one fewer than of controls."""
        return len(self.first)

    @cached_property
    def relative(self) -> "CumulativeBasis":
        """The same functions with their origin in time at zero."""
        return replace(self, basis=self.basis.relative)

    @cached_property
    def _tables(self) -> tuple[np.ndarray, np.ndarray]:
        """Per span of the knots which function changes first (K,), and controls (K, m, degree + 1) of those from it."""
        p, w = self.basis.degree, self.weights.shape[1]
        spans = np.arange(len(self.basis.knots) - 1)
        # On span k the controls k − p … k act: constant where all of them lie before the weights, or behind.
        begin = np.searchsorted(self.first, spans - (w + p - 2), side="left")
        end = np.searchsorted(self.first, spans, side="right")
        inside = (spans >= p) & (spans < len(spans) - p) & (np.diff(self.basis.knots) > 0)
        most = max(1, int((end - begin)[inside].max()))
        function = np.minimum(begin[:, None] + np.arange(most), self.n - 1)[..., None]
        place = spans[:, None, None] + np.arange(-p, 1) - self.first[function]
        controls = np.where(place < 0, 0.0, self.weights[function, np.clip(place, 0, w - 1)])
        used = begin[:, None] + np.arange(most) < end[:, None]
        return begin, np.where(used[..., None], controls, 0.0)

    def local(self, t: np.ndarray, order: int = 0) -> tuple[np.ndarray, list[np.ndarray]]:
        """Which function changes first at times t (N,), and derivatives 0 … order, (N, m) each, of it and those behind.

        Functions before it have come to the last of their weights; of those behind the m, and of those that are not
        there, the values are 0.
        """
        begin, controls = self._tables
        span = self.basis.spans(t)
        there = controls[span]
        values = [np.einsum("na,nma->nm", self.basis.local(t, nu)[1], there) for nu in range(order + 1)]
        return begin[span], values

    def __call__(self, t, nu: int = 0) -> np.ndarray:
        """(N, n) the nu-th derivatives of all functions at times t (N,)."""
        t, nu = np.atleast_1d(floats(t, "times")), whole(nu, 0, "derivative order")
        begin, values = self.local(t, nu)
        ends = self.weights[:, -1] * (nu == 0)
        result = np.where(np.arange(self.n) < begin[:, None], ends, 0.0)
        place = begin[:, None] + np.arange(values[nu].shape[1])
        row, column = np.nonzero(place < self.n)
        result[row, place[row, column]] = values[nu][row, column]
        return result
