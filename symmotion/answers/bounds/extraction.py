"""Minimisers read from moments: eigenvalues of multiplication by the unknowns."""

import numpy as np
import scipy.linalg as la

from symmotion.answers.bounds.relaxation import Moments, Relaxed

# Eigenvalues of a moment matrix, relative to the largest, and pivots, that count as zero.
ZERO = 1e-3


def rank(places: Moments, relaxed: Relaxed) -> int:
    """The largest rank of the cliques' moment matrices, up to what the solver leaves: the number of minimisers."""
    found = 1
    for blocks in places.places:
        values = np.linalg.eigvalsh(relaxed.moments[blocks[0]])
        found = max(found, int((values > ZERO * values[-1]).sum()))
    return found


def points(places: Moments, relaxed: Relaxed, rank: int) -> list[np.ndarray]:
    """Candidates (free,) for minimisers: the atoms of the measure that the moments belong to, and its mean.

    With r atoms, monomials w of degree one or less are chosen of which the moments E[w w'] are regular; the eigenvalues
    of E[w w']⁻¹ E[w w' u_i] are the atoms' u_i. Source: Henrion and Lasserre 2005.
    """
    free = places.chart.free
    moments = relaxed.moments
    mean = moments[places.number(_factors(np.arange(free) + 1))]
    if rank == 1:
        return [mean]
    return [*_atoms(places, moments, rank), *_apart(places, moments, mean)]


def _factors(*numbers: np.ndarray) -> np.ndarray:
    """(…, 4) the factors of products of these, broadcast."""
    shape = np.broadcast_shapes(*(n.shape for n in numbers))
    given = [np.broadcast_to(n, shape) for n in numbers]
    return np.stack([*given, *(np.zeros(shape, dtype=int) for _ in range(4 - len(given)))], axis=-1)


def _atoms(places: Moments, moments: np.ndarray, rank: int) -> list[np.ndarray]:
    free = places.chart.free
    if rank > free:
        return []
    every = np.arange(free + 1)
    second = places.number(_factors(every[:, None], every))
    if (second < 0).any():
        return []
    order = la.qr(moments[second], pivoting=True, mode="r")[1]
    chosen = np.sort(order[:rank])
    gram = moments[second[np.ix_(chosen, chosen)]]
    third = places.number(_factors(chosen[:, None, None], chosen[:, None], every[1:]))
    if (third < 0).any():
        return []
    # One combination tells atoms apart; its eigenvectors serve all unknowns.
    lot = np.random.default_rng(0).normal(size=free)
    products = np.linalg.solve(gram, moments[third].transpose(2, 0, 1))
    _, vectors = la.schur(np.einsum("i,iab->ab", lot, products))
    return [np.array([q @ p @ q for p in products]) for q in vectors.T]


def _apart(places: Moments, moments: np.ndarray, mean: np.ndarray) -> list[np.ndarray]:
    """The mean, and the points one deviation from it along the direction in which the measure is widest."""
    every = np.arange(len(mean)) + 1
    second = places.number(_factors(every[:, None], every))
    covariance = np.where(second >= 0, moments[second], np.outer(mean, mean)) - np.outer(mean, mean)
    values, vectors = np.linalg.eigh(covariance)
    way = np.sqrt(max(values[-1], 0.0)) * vectors[:, -1]
    return [mean + way, mean - way, mean]
