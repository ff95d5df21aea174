"""Symmetric matrices of blocks as the numbers that they are made of, each once.

A matrix of rows × rows blocks H_ab, channels × channels each, with H_ba = H_abᵀ, is packed as the upper triangles, row
by row, of the symmetric parts S_ab = H_ab + H_abᵀ (H_aa where a = b) for a ≤ b, and then as what is above the diagonals
of the skew parts A_ab = H_ab − H_abᵀ for a < b. Sums Bᵀ H B of them with numbers B take half the operations that the
blocks would.
"""

from dataclasses import dataclass
from functools import lru_cache

import casadi as ca
import numpy as np

from symmotion.brief import in_a_line


@dataclass(frozen=True, eq=False)
class Packing:
    """Where the parts of a packed matrix lie.

    pairs: (2, S) the rows a ≤ b of the symmetric parts; crossed: (A,) which of these have a skew part, a < b.
    upper, above: (2, …) the channels i ≤ j of an entry of a symmetric part, and i < j of one of a skew part.
    """

    pairs: np.ndarray
    crossed: np.ndarray
    upper: np.ndarray
    above: np.ndarray

    __repr__ = in_a_line

    @staticmethod
    @lru_cache(maxsize=64)
    def of(rows: int, channels: int) -> "Packing":
        pairs = np.stack(np.triu_indices(rows))
        upper, above = (np.stack(np.triu_indices(channels, k)) for k in (0, 1))
        return Packing(pairs, np.flatnonzero(pairs[0] != pairs[1]), upper, above)

    @property
    def symmetric(self) -> tuple[int, int]:
        """How many symmetric parts there are, and the entries of each."""
        return self.pairs.shape[1], self.upper.shape[1]

    @property
    def skew(self) -> tuple[int, int]:
        """How many skew parts there are, and the entries of each."""
        return len(self.crossed), self.above.shape[1]

    @property
    def split(self) -> int:
        """Where the skew parts begin."""
        parts, entries = self.symmetric
        return parts * entries


def packed(hessian: ca.SX, channels: int) -> ca.SX:
    """A matrix (rows · channels)², of which only the upper triangle is read, as one packed column."""
    size = hessian.shape[0]
    p = Packing.of(size // channels, channels)
    entries = ca.vec(ca.densify(hessian))
    first, second = p.pairs * channels
    i, j = p.upper
    straight = (first[:, None] + i) + size * (second[:, None] + j)
    mirrored = (first[:, None] + j) + size * (second[:, None] + i)
    # On the diagonal the one is the other, and the block is its own symmetric part.
    crossed = np.broadcast_to((first != second)[:, None], straight.shape).ravel()
    symmetric = entries[straight.ravel().tolist()]
    symmetric += ca.DM(crossed.astype(float)) * entries[np.where(crossed, mirrored.ravel(), straight.ravel()).tolist()]
    first, second = p.pairs[:, p.crossed] * channels
    i, j = p.above
    straight = ((first[:, None] + i) + size * (second[:, None] + j)).ravel().tolist()
    mirrored = ((first[:, None] + j) + size * (second[:, None] + i)).ravel().tolist()
    return ca.vertcat(symmetric, entries[straight] - entries[mirrored] if straight else ca.SX(0, 1))


def unpacked(values: np.ndarray, rows: int, channels: int) -> np.ndarray:
    """(N, rows, rows, channels, channels) the blocks H_ab of packed matrices (N, …)."""
    p = Packing.of(rows, channels)
    (i, j), (k, m) = p.upper, p.above
    found = np.empty((len(values), rows, rows, channels, channels))
    symmetric = values[:, : p.split].reshape(len(values), *p.symmetric)
    skew = values[:, p.split :].reshape(len(values), *p.skew)
    block = np.empty((len(values), channels, channels))
    for s, (a, b) in enumerate(p.pairs.T):
        block[:, i, j] = block[:, j, i] = symmetric[:, s]
        if a != b:
            part = skew[:, np.searchsorted(p.crossed, s)]
            block[:, k, m] += part
            block[:, m, k] -= part
            block *= 0.5
        found[:, a, b], found[:, b, a] = block, block.swapaxes(1, 2)
    return found
