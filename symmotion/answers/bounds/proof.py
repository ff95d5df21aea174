"""What a solution of the relaxation proves: a lower bound that holds in spite of the solver's rounding."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.linalg as la
from scipy import sparse

from symmotion.answers.bounds.quartic import Chart
from symmotion.answers.bounds.relaxation import Moments, Relaxed
from symmotion.design.affine import AffineDesign
from symmotion.design.terms import parts_of
from symmotion.energies import Rigidity
from symmotion.program import Evaluator, Program
from symmotion.solvers import Solution
from symmotion.systems import system_of

EPS = float(np.finfo(float).eps)
SHIFTS = 50  # multiples of the identity that are tried, each twice the one before


@dataclass(frozen=True)
class Proof:
    """f ≥ value on all points that meet the conditions and have f ≤ f*, hence everywhere where value ≤ f*.

    shift: η of the identity that was added to the Gram matrices to make them positive semidefinite; reach: what bounds
    the sum of the squares of the monomials that it weighs, on f ≤ f*; None where nothing is known of them.
    valid: whether the value is proved, up to the rounding of the polynomial's coefficients, or numerical.
    """

    value: float
    shift: float
    reach: float | None
    valid: bool


def proved(
    program: Program, places: Moments, forms: Sequence[np.ndarray], relaxed: Relaxed, minimisers: Sequence[Solution]
) -> Proof:
    """The bound from the Gram matrices S of a relaxation about the lowest solution known, first of those that tie.

    They are changed so that Σ vᵀSv and f have the same coefficients but the constant one, f₀. With v₀ = 1 and
    S = [[s, bᵀ], [b, C]], vᵀ(S + η I)v ≥ s − bᵀ(C + ηI)⁻¹b, so that f ≥ f₀ − Σ bᵀ(C + ηI)⁻¹b − η Σ |v|² without the
    first entry, the sums over cliques. About the minimiser b is nearly zero; η is zero where C is safely positive
    definite, and of the order of rounding where several tie, see `_faced`.
    """
    wanted, best = places.coefficients(forms), minimisers[0].objective
    reach = monomial_reach(program, places.chart, best)
    found = [_shifted(places, wanted, relaxed.grams, reach)]
    if len(minimisers) > 1:
        found.append(_shifted(places, wanted, _faced(places, wanted, relaxed.grams, minimisers), reach))
    return max(found, key=lambda p: (p.valid, p.value))


def _shifted(places: Moments, wanted: np.ndarray, grams: Sequence[np.ndarray], reach: float | None) -> Proof:
    """The best bound of `proved` over η of growing size."""
    off = (wanted - places.summed(zip(places.every, grams, strict=True))) / places.uses
    # The constant coefficient is what the bound is about.
    off[0] = 0.0
    firsts = np.cumsum([0, *(len(blocks) for blocks in places.places)])[:-1]
    parts = [(gram + off[place], k in firsts) for k, (gram, place) in enumerate(zip(grams, places.every, strict=True))]
    scale = max(float(np.abs(g).max()) for g in grams)
    found = []
    for shift in (0.0, *(EPS * scale * 2.0**k for k in range(SHIFTS))):
        fall = _fall(parts, shift)
        if fall is not None:
            lost = shift * (reach or 0.0) * len(places.places)
            found.append(Proof(float(wanted[0] - fall - lost), shift, reach, shift == 0 or reach is not None))
            if shift == 0 or reach is None:
                break
    return max(found, key=lambda p: p.value, default=Proof(-np.inf, np.inf, reach, False))


def _faced(
    places: Moments, wanted: np.ndarray, grams: Sequence[np.ndarray], minimisers: Sequence[Solution]
) -> list[np.ndarray]:
    """Gram matrices that vanish on the monomials v(u) of all minimisers, whose coefficients are those of f.

    S = N Σ Nᵀ with the columns of N orthogonal to these v(u), Σ what the solver found plus the least change that
    matches all coefficients but the constant one.
    """
    points = [np.r_[1.0, places.chart.free_of(_sharpened(s))] for s in minimisers]
    blocks = [v for clique in places.chart.cliques for v in clique.blocks]
    bases = [la.null_space(np.stack([u[v].prod(axis=1) for u in points])) for v in blocks]
    faces = [n.T @ gram @ n for n, gram in zip(bases, grams, strict=True)]
    columns = []
    for n, place in zip(bases, places.every, strict=True):
        i, j = np.triu_indices(n.shape[1])
        summing = sparse.csr_array(
            (np.ones(place.size), (place.ravel(), np.arange(place.size))), (places.count, place.size)
        )
        # The products of columns i and j, symmetric: √2 makes the least change that of the matrix.
        pairs = (n[:, None, i] * n[None, :, j]).reshape(place.size, -1) * np.where(i == j, 1.0, np.sqrt(2.0))
        columns.append(summing @ pairs)
    missing = wanted - places.summed((p, n @ f @ n.T) for p, n, f in zip(places.every, bases, faces, strict=True))
    matrix = np.concatenate(columns, axis=1)[1:]
    for _ in range(2):  # the second time for what rounding leaves
        change, *_ = np.linalg.lstsq(matrix, missing[1:], rcond=1e-12)
        k = 0
        for index, n in enumerate(bases):
            i, j = np.triu_indices(n.shape[1])
            part = np.zeros((n.shape[1],) * 2)
            part[i, j] = change[k : k + len(i)] / np.where(i == j, 1.0, np.sqrt(2.0))
            faces[index] = faces[index] + part + np.triu(part, 1).T
            k += len(i)
        missing = wanted - places.summed((p, n @ f @ n.T) for p, n, f in zip(places.every, bases, faces, strict=True))
    return [n @ f @ n.T for n, f in zip(bases, faces, strict=True)]


def _sharpened(solution: Solution) -> np.ndarray:
    """(unknowns,) a minimum after two more Newton steps: what is left of a gradient is rounding."""
    x, evaluator = solution.x, Evaluator(solution.program)
    system = system_of(solution.program, evaluator, x)
    for _ in range(2):
        gradient, hessian = evaluator.second_order(x, system.pattern)
        factor = system.factorise(hessian)
        if factor is None:
            return solution.x
        x = x + system.step(factor, gradient)
    return x


def _fall(parts: Sequence[tuple[np.ndarray, bool]], shift: float) -> float | None:
    """Σ bᵀ(C + ηI)⁻¹b of Gram matrices, those marked with a first entry; None where one is not safely positive."""
    total = 0.0
    for gram, first in parts:
        inner = gram[1:, 1:] if first else gram
        size = len(inner)
        if not size:
            continue
        # Where Cholesky's method ends on a matrix less this, the matrix is positive definite: Rump 2006.
        safe = (size + 2) * EPS / 2 * float(np.abs(np.diag(inner)).sum() + shift * size)
        identity = np.eye(size)
        if la.lapack.dpotrf(inner + (shift - safe) * identity)[1] != 0:
            return None
        if first:
            b = gram[1:, 0]
            total += float(b @ la.solve(inner + (shift - safe) * identity, b, assume_a="pos"))
    return total


def monomial_reach(program: Program, chart: Chart, best: float) -> float | None:
    """A bound on Σ v_k² over the monomials of degree one and two on {f ≤ best}: β + β² with |u|² ≤ β.

    Rigidity bounds g = |A qᵢ|² between keyframes a time h apart: |g − its chord|² ≤ h/4 ∫ġ² and ≤ h³/48 ∫g̈². So
    |A(t)|² ≤ ρ² for all t; controls are bounded by A at the knot averages, and the free unknowns by controls. None of
    programs without a rigidity of unit test vectors, or with translations among their unknowns.
    """
    design = program.design
    if not isinstance(design, AffineDesign) or design.channels > design.keyframes.dimension**2:
        return None
    keys, basis = design.keyframes, design.basis
    found = [(w, e) for _, w, e in parts_of(design.objective) if isinstance(e, Rigidity) and e.test_vectors is None]
    squares = all(block.kernel.squares for block in program.terms)
    if not found or not squares or best < 0:
        return None
    weight, energy = found[0]
    shares = np.ones(keys.dimension) if energy.weights is None else np.diag(energy.weights)
    if not (shares > 0).all():
        return None
    h = float(np.diff(keys.times).max())
    chord = (keys.linear**2).sum(axis=1).max(axis=0)  # of every column, at the keyframes
    bend = np.sqrt((h / 4 if energy.order == 1 else h**3 / 48) * best / (weight * shares))
    rho = float(np.sum(chord + bend))
    collocation = basis.matrix(basis.greville).toarray()
    size = np.sqrt(basis.n * rho) / np.linalg.svd(collocation, compute_uv=False)[-1]
    least = np.linalg.svd(chart.basis.toarray(), compute_uv=False)[-1]
    beta = ((size + np.linalg.norm(chart.centre)) / least) ** 2
    return float(beta + beta**2)
