"""Lasserre's relaxation of order two: a semidefinite program in the moments of measures on the minimisers."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy import sparse

from symmotion.answers.bounds.quartic import Chart, require_small
from symmotion.answers.bounds.symmetry import halves
from symmotion.errors import InputError, SolveError

TOLERANCE = 1e-10
# What coefficients, relative to the largest, may differ by from those of their images to be rounding.
ROUNDING = 1e-12


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
    def factors(self) -> np.ndarray:
        """(count, 4) of every monomial, numbered from one, 0 for none."""
        return self.keys[:, None] // (self.chart.free + 1) ** np.arange(4)[::-1] % (self.chart.free + 1)

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
    chosen, halved = _symmetric(places, f)
    require_small(places.chart.cliques, max(part.shape[0] for parts in halved for part in parts))
    rows, cones = [], []
    for place, parts in zip(places.every, halved, strict=True):
        entries = (np.ones(place.size), (np.arange(place.size), place.ravel()))
        products = sparse.csr_array(entries, shape=(place.size, places.count)) @ chosen
        for part in parts:
            n = part.shape[0]
            # The upper triangle column by column, as Clarabel stores it.
            j, i = np.tril_indices(n)
            pairs = sparse.csr_array(sparse.kron(part, part, format="csr"))[i * n + j] @ products
            rows.append(np.where(i == j, 1.0, np.sqrt(2.0))[:, None] * pairs)
            cones.append(clarabel.PSDTriangleConeT(n))
    matrix = sparse.csc_array(sparse.vstack(rows))
    constant = matrix[:, [0]].toarray().ravel()
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    settings.max_threads = 1
    settings.direct_solve_method = "faer"
    settings.time_limit = time_limit
    settings.tol_gap_abs = settings.tol_gap_rel = settings.tol_feas = TOLERANCE
    count = chosen.shape[1] - 1
    cost = (chosen.T @ f)[1:] / scale
    solver = clarabel.DefaultSolver(
        sparse.csc_matrix((count, count)), cost, sparse.csc_matrix(-matrix[:, 1:]), constant, cones, settings
    )
    answer = solver.solve()
    status = str(answer.status)
    if not (np.isfinite(answer.x).all() and np.isfinite(answer.z).all()):
        raise SolveError(f"the relaxation was not solved: Clarabel says {status}")
    moments = chosen @ np.r_[1.0, answer.x]
    grams, k = [], 0
    dual = np.asarray(answer.z) * scale
    for place, parts in zip(places.every, halved, strict=True):
        whole = np.zeros(place.shape)
        for part in parts:
            n = part.shape[0]
            j, i = np.tril_indices(n)
            gram = np.zeros((n, n))
            gram[i, j] = dual[k : k + len(i)] / np.where(i == j, 1.0, np.sqrt(2.0))
            whole += part.T @ (part.T @ (gram + np.triu(gram, 1).T)).T
            k += len(i)
        grams.append(whole)
    return Relaxed(moments, tuple(grams), status)


def _symmetric(places: Moments, f: np.ndarray) -> tuple[sparse.csr_array, list[list[sparse.csr_array]]]:
    """(count, …) moments by independent ones, 1 being the first; and by block, what its matrix falls into.

    Of a polynomial with coefficients f (count,) that has the chart's symmetry, the least is among moments that have it.
    """
    symmetry, whole = places.chart.symmetry, [[sparse.eye_array(len(p), format="csr")] for p in places.every]
    alone = sparse.csr_array(sparse.eye_array(places.count))
    if symmetry is None:
        return alone, whole
    images, sign = symmetry.product(places.factors)
    image = places.number(images)
    if (image < 0).any() or np.abs(f - sign * f[image]).max() > ROUNDING * np.abs(f).max():
        return alone, whole
    halved = []
    for block in (b for clique in places.chart.cliques for b in clique.blocks):
        images, signs = symmetry.product(block)
        keys, wanted = (key(np.pad(v, ((0, 0), (0, 2))), places.chart.free) for v in (block, images))
        order = np.argsort(keys)
        there = order[np.minimum(np.searchsorted(keys[order], wanted), len(keys) - 1)]
        if (keys[there] != wanted).any():
            return alone, whole
        halved.append(halves(there, signs))
    kept = halves(image, sign)[0]
    # What stays as it is, not of length one but as large as its moments.
    return sparse.csr_array(kept.sign().T), halved


def _clarabel():
    try:
        import clarabel  # here: an extra, and few programs want it
    except ImportError as error:
        raise InputError('global bounds need Clarabel: pip install "symmotion[global]"') from error
    return clarabel
