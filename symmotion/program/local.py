"""The dense view of what a block reads: by element its columns, and how its parts add up."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy import sparse

from symmotion.brief import in_a_line
from symmotion.kernels.packing import Packing

FAR = 4  # times the columns of a row that an element's lie apart before they are sorted


@dataclass(frozen=True, eq=False)
class LocalTables:
    """The dense view of an operator: the K columns that each element reads, and its coefficients there.

    columns: (E, K) increasing, of `width` there are; coefficients: (E, Q, rows, K), zero where an element reads fewer.
    weights: (E, Q) of the nodes. pairs: (2, P) the pairs a ≤ b of local columns, P = K (K + 1) / 2.
    blocks: (2, B) the different global column pairs; places: (E, P) which of them the pairs of an element are.
    """

    width: int
    columns: np.ndarray
    coefficients: np.ndarray
    weights: np.ndarray
    pairs: np.ndarray
    blocks: np.ndarray
    places: np.ndarray

    __repr__ = in_a_line

    @staticmethod
    def of(operator: sparse.csr_array, weights: np.ndarray, rows: int) -> "LocalTables":
        """The tables of an operator (E · Q · rows, width) for nodes of these weights (E, Q)."""
        elements, nodes = weights.shape
        columns, coefficients = _dense(operator, elements, nodes, rows)
        pairs = np.stack(np.triu_indices(columns.shape[1]))
        first, second = columns[:, pairs[0]], columns[:, pairs[1]]
        reach = int((second - first).max(initial=0)) + 1
        keys = first * reach + (second - first)
        if operator.shape[1] * reach <= FAR * keys.size:
            # Few numbers lie between, and need no sorting.
            known = np.zeros(operator.shape[1] * reach, dtype=bool)
            known[keys] = True
            places, keys = (np.cumsum(known) - 1)[keys], np.flatnonzero(known)
        else:
            keys, places = np.unique(keys, return_inverse=True)
        blocks = np.stack(np.divmod(keys, reach))
        blocks[1] += blocks[0]
        places = places.reshape(first.shape)
        return LocalTables(operator.shape[1], columns, coefficients, weights, pairs, blocks, places)

    @cached_property
    def parts(self) -> tuple[np.ndarray, np.ndarray]:
        """Weights (Q, S, P, E) and (Q, A, P, E) of the symmetric and the skew parts of the Hessians at the nodes.

        Their sums over nodes and parts are the symmetric and the skew part of the block of each pair of columns.
        """
        packing = Packing.of(self.coefficients.shape[2], 1)
        c = np.ascontiguousarray(self.coefficients.transpose(1, 2, 3, 0))
        (a, b), (u, v), w = packing.pairs, self.pairs, self.weights.T[:, None, None]
        one, other = (w * c[:, x][:, :, y] * c[:, z][:, :, t] for x, y, z, t in ((a, u, b, v), (b, u, a, v)))
        crossed = packing.crossed
        skew = np.where((u == v)[:, None], 0.0, 0.5 * (one[:, crossed] - other[:, crossed]))
        one[:, crossed] = 0.5 * (one[:, crossed] + other[:, crossed])
        return one, skew

    @cached_property
    def summing(self) -> sparse.csr_array:
        """(B, B + E · P) what adds the elements' blocks to those that are there, one after the other."""
        b, count = self.blocks.shape[1], self.places.size
        rows = np.concatenate([np.arange(b), self.places.ravel()])
        return sparse.csr_array((np.ones(b + count), (rows, np.arange(b + count))), shape=(b, b + count))

    @cached_property
    def collecting(self) -> sparse.csr_array:
        """(width, E · K) what sums the elements' gradients."""
        count = self.columns.size
        return sparse.csr_array((np.ones(count), (self.columns.ravel(), np.arange(count))), shape=(self.width, count))

    @cached_property
    def met(self) -> np.ndarray:
        """(E, P) `places`, below zero for pairs of a column with its own repetition, which weigh nothing."""
        u, v = self.pairs
        return np.where((self.columns[:, u] == self.columns[:, v]) & (u != v), -1, self.places)

    @property
    def own(self) -> np.ndarray:
        """(B,) whether the block of a pair lies on the diagonal."""
        return self.blocks[0] == self.blocks[1]


def _dense(operator: sparse.csr_array, e: int, q: int, r: int) -> tuple[np.ndarray, np.ndarray]:
    """The columns (E, K) of an operator that each element reads, and the coefficients (E, Q, rows, K) there."""
    pointers, columns = operator.indptr, operator.indices
    k = int(np.diff(pointers).max())
    if len(columns) == e * q * r * k > 0:
        rows = columns.reshape(e, q * r, k)
        if (rows == rows[:, :1]).all() and (np.diff(rows[:, 0]) > 0).all():
            # All rows of an element read the same columns, as those of plain splines do.
            return rows[:, 0].astype(np.int64), operator.data.reshape(e, q, r, k)
    # The row of every entry; `repeat` takes three times as long.
    row = np.cumsum(np.bincount(pointers[1:-1], minlength=len(columns) + 1)[: len(columns)], dtype=columns.dtype)
    owner = row // (q * r)
    begins = pointers[:: q * r]
    if (np.diff(begins) > 0).all():
        first, last = (f.reduceat(columns, begins[:-1]) for f in (np.minimum, np.maximum))
        reach = int((last - first).max()) + 1
    else:
        first = last = np.empty(0, dtype=np.int64)
        reach = 0
    found = rank = None
    if 0 < reach <= FAR * k:
        rank = columns - first[owner]
        read = np.zeros(e * reach, dtype=bool)
        read[owner * np.int64(reach) + rank] = True
        if np.array_equal(read.reshape(e, reach).sum(axis=1), last - first + 1):
            # Neighbours, as of splines: nothing to sort.
            found = np.minimum(first[:, None].astype(np.int64) + np.arange(reach), last[:, None])
    if found is None or rank is None:
        found, rank = _sorted(owner, columns, e, operator.shape[1])
    coefficients = np.zeros((e * q * r, found.shape[1]))
    place = row.astype(np.int64)
    place *= found.shape[1]
    place += rank
    coefficients.ravel()[place] = operator.data
    return found, coefficients.reshape(e, q, r, -1)


def _sorted(owner: np.ndarray, columns: np.ndarray, e: int, n: int) -> tuple[np.ndarray, np.ndarray]:
    """The columns (E, K) of n that each of e elements reads, and which of them every entry is in."""
    keys, position = np.unique(owner.astype(np.int64) * n + columns, return_inverse=True)
    key_owner, key_column = np.divmod(keys, n)
    first = np.searchsorted(key_owner, np.arange(e))
    rank = np.arange(len(keys)) - first[key_owner]
    k = int(rank.max()) + 1 if len(rank) else 0
    # Elements that read fewer columns repeat their last one with coefficient zero.
    last = np.r_[first[1:], len(keys)] - 1
    found = np.repeat(np.where(last >= first, np.append(key_column, 0)[last], 0)[:, None], k, axis=1)
    found[key_owner, rank] = key_column
    return found, rank[position]


@dataclass(frozen=True, eq=False)
class Targets:
    """Where the blocks (B, c, c) of a block's Hessian go in a flat array of `size` numbers: one triangle of the matrix.

    starts: (B, c) where the rows of a block begin, each of c numbers that follow each other, or with mirrored its
        columns; of blocks on the diagonal (own, (B,)) what is below it is not wanted. None where they do not follow.
    given: (B, c, c) the places themselves, `size` where an entry is not wanted; None where they are as said.
    """

    size: int
    own: np.ndarray
    starts: np.ndarray | None
    mirrored: bool = False
    given: np.ndarray | None = None

    __repr__ = in_a_line

    @staticmethod
    def of(places: np.ndarray, own: np.ndarray, size: int) -> "Targets":
        """Of places (B, c, c): by their columns, where these follow each other."""
        starts = np.ascontiguousarray(places[:, 0])
        found = Targets(size, own, starts, mirrored=True)
        return found if np.array_equal(found.places, places) else Targets(size, own, None, given=places)

    @cached_property
    def places(self) -> np.ndarray:
        """(B, c, c) where each entry goes, `size` where it is not wanted."""
        if self.starts is None:
            assert self.given is not None
            return self.given
        channel = np.arange(self.starts.shape[1])
        places = self.starts[:, :, None] + channel
        places = places.swapaxes(1, 2) if self.mirrored else places
        below = channel[:, None] > channel
        return np.where(self.own[:, None, None] & below, self.size, places)

    @cached_property
    def wanted(self) -> tuple[np.ndarray, np.ndarray]:
        """Which entries are wanted, of (B · c · c), and where they go."""
        flat = self.places.ravel()
        inside = np.flatnonzero(flat < self.size)
        return inside, flat[inside]
