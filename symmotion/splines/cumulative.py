"""Cumulative B-splines B̃_i = Σ_{j ≥ i} B_j, the weights of increments instead of controls (KKS 4.2, 5.3)."""

from itertools import pairwise

import numpy as np

from symmotion.splines.basis import BSplineBasis


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
