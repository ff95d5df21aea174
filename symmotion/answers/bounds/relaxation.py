"""Lasserre's relaxation of order two: a semidefinite program in the moments of measures on the minimisers."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy import sparse

from symmotion.answers.bounds.quartic import Chart
from symmotion.errors import InputError, SolveError

TOLERANCE = 1e-10


@dataclass(frozen=True, eq=False)
class Moments:
    """The monomials of degree four or less that are products of two of a block, numbered; 1 has the number 0.

    keys: (count,) increasing, of their factors, see `key`. places: by clique and block, (N, N) the numbers of the
    products v_i v_j.
    """

    chart: Chart
    keys: np.ndarray
    places: tuple[tuple[np.ndarray, ...], ...]

    @staticmethod
    def of(chart: Chart) -> "Moments":
        keys = [[key(_products(v), chart.free) for v in clique.blocks] for clique in chart.cliques]
        every = np.unique(np.concatenate([k.ravel() for blocks in keys for k in blocks]))
        return Moments(chart, every, tuple(tuple(np.searchsorted(every, k) for k in blocks) for blocks in keys))

    @property
    def count(self) -> int:
        return len(self.keys)

    @property
    def every(self) -> list[np.ndarray]:
        """The places of all blocks, clique by clique."""
        return [place for blocks in self.places for place in blocks]

    def number(self, factors: np.ndarray) -> np.ndarray:
        """(…,) the numbers of monomials of factors (…, 4), −1 of those that are not among them."""
        wanted = key(factors, self.chart.free)
        found = np.minimum(np.searchsorted(self.keys, wanted), self.count - 1)
        return np.where(self.keys[found] == wanted, found, -1)

    def coefficients(self, forms: Iterable[np.ndarray]) -> np.ndarray:
        """(count,) the coefficients of the polynomial Σ v(u)ᵀ G v(u) over the cliques' first blocks."""
        return self.summed(zip((blocks[0] for blocks in self.places), forms, strict=True))

    def summed(self, parts: Iterable[tuple[np.ndarray, np.ndarray]]) -> np.ndarray:
        """(count,) the coefficients of the polynomial Σ vᵀ G v over blocks; parts: their places, and G."""
        total = np.zeros(self.count)
        for place, form in parts:
            total += np.bincount(place.ravel(), form.ravel(), self.count)
        return total

    @cached_property
    def uses(self) -> np.ndarray:
        """(count,) how often each monomial is a product v_i v_j."""
        return self.summed((p, np.ones(p.shape)) for p in self.every)


def key(factors: np.ndarray, free: int) -> np.ndarray:
    """(…,) a number for a monomial of factors (…, 4), numbered from one, 0 for none, in any order."""
    return np.sort(factors, axis=-1) @ (free + 1) ** np.arange(4)[::-1]


def _products(v: np.ndarray) -> np.ndarray:
    """(N, N, 4) the factors of the products of monomials (N, 2)."""
    shape = (len(v), len(v), 2)
    return np.concatenate([np.broadcast_to(v[:, None], shape), np.broadcast_to(v, shape)], axis=2)


@dataclass(frozen=True, eq=False)
class Relaxed:
    """What the relaxation gives. moments: (count,).

    grams: by block, S (N, N) of f − γ ≈ Σ v(u)ᵀ S v(u), positive semidefinite up to the tolerance. status: Clarabel's.
    """

    moments: np.ndarray
    grams: tuple[np.ndarray, ...]
    status: str


def relaxed(places: Moments, forms: Sequence[np.ndarray], time_limit: float) -> Relaxed:
    """min Σ f_α m_α over moments m, m_0 = 1, of which every clique's matrix M(m) is positive semidefinite.

    Source: Lasserre 2001; by cliques, Waki, Kim, Kojima and Muramatsu 2006. Solved by Clarabel. SolveError where that
    ends without a solution.
    """
    clarabel = _clarabel()
    f = places.coefficients(forms)
    scale = float(np.abs(f).max()) or 1.0
    rows, numbers, weights, cones = [], [], [], []
    first = 0
    for place in places.every:
        n = len(place)
        # The upper triangle column by column, as Clarabel stores it.
        j, i = np.tril_indices(n)
        rows.append(first + np.arange(len(i)))
        numbers.append(place[i, j])
        weights.append(np.where(i == j, 1.0, np.sqrt(2.0)))
        cones.append(clarabel.PSDTriangleConeT(n))
        first += len(i)
    row, number, weight = map(np.concatenate, (rows, numbers, weights))
    matrix = sparse.csc_array((weight, (row, number)), shape=(first, places.count))
    constant = matrix[:, [0]].toarray().ravel()
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    settings.max_threads = 1
    settings.direct_solve_method = "faer"
    settings.time_limit = time_limit
    settings.tol_gap_abs = settings.tol_gap_rel = settings.tol_feas = TOLERANCE
    count = places.count - 1
    solver = clarabel.DefaultSolver(
        sparse.csc_matrix((count, count)), f[1:] / scale, sparse.csc_matrix(-matrix[:, 1:]), constant, cones, settings
    )
    answer = solver.solve()
    status = str(answer.status)
    if not (np.isfinite(answer.x).all() and np.isfinite(answer.z).all()):
        raise SolveError(f"the relaxation was not solved: Clarabel says {status}")
    moments = np.r_[1.0, answer.x]
    grams, k = [], 0
    dual = np.asarray(answer.z) * scale
    for place in places.every:
        n = len(place)
        j, i = np.tril_indices(n)
        size = len(i)
        gram = np.zeros((n, n))
        gram[i, j] = dual[k : k + size] / np.where(i == j, 1.0, np.sqrt(2.0))
        grams.append(gram + np.triu(gram, 1).T)
        k += size
    return Relaxed(moments, tuple(grams), status)


def _clarabel():
    try:
        import clarabel  # here: an extra, and few programs want it
    except ImportError as error:
        raise InputError('global bounds need Clarabel: pip install "symmotion[global]"') from error
    return clarabel
