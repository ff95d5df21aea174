"""What a solution of the relaxation proves: a lower bound that holds in spite of the solver's rounding."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy.linalg as la
from scipy.sparse.linalg import LinearOperator, lsqr

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
STEPS = 1000  # of the least change of a face


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


NOTHING = Proof(-np.inf, np.inf, None, False)


def proved(
    program: Program, places: Moments, forms: Sequence[np.ndarray], relaxed: Relaxed, minimisers: Sequence[Solution]
) -> Proof:
    """The bound from the Gram matrices S of a relaxation about the lowest solution known, first of those that tie.

    They are changed so that Σ vᵀSv and f have the same coefficients but the constant one, f₀. With v₀ = 1 and
    S = [[s, bᵀ], [b, C]], vᵀ(S + η I)v ≥ s − bᵀ(C + ηI)⁻¹b, so that f ≥ f₀ − Σ bᵀ(C + ηI)⁻¹b − η Σ |v|² without the
    first entry, the sums over cliques. About the minimiser b is made zero but for the gradient (`_moved`); η is zero
    where C is safely positive definite. Where several tie, which leaves C singular, see `_faced`.
    """
    wanted, best = places.coefficients(forms), minimisers[0].objective
    reach = monomial_reach(program, places.chart, best)
    found = [_shifted(places, wanted, relaxed.grams, reach)]
    if len(minimisers) > 1:
        found.append(_faced(places, wanted, relaxed.grams, minimisers, reach))
    proof = max(found, key=lambda p: (p.valid, p.value))
    return replace(proof, value=min(proof.value, best))


def _moved(places: Moments, grams: Sequence[np.ndarray]) -> list[np.ndarray]:
    """The same polynomial by Gram matrices of which b is zero at the products u_i u_j, which C has at u_i, u_j, too."""
    found, firsts = list(grams), np.cumsum([0, *(len(blocks) for blocks in places.places)])[:-1]
    for first, clique in zip(firsts, places.chart.cliques, strict=True):
        gram, products = np.array(grams[first]), slice(1 + len(clique.unknowns), None)
        i, j = 1 + np.searchsorted(clique.unknowns, clique.blocks[0][products] - 1).T
        np.add.at(gram, (np.r_[i, j], np.r_[j, i]), np.tile(gram[0, products], 2))
        gram[0, products] = gram[products, 0] = 0.0
        found[first] = gram
    return found


def _shifted(places: Moments, wanted: np.ndarray, grams: Sequence[np.ndarray], reach: float | None) -> Proof:
    """The best bound of `proved` over η of growing size."""
    off = (wanted - places.summed(zip(places.every, grams, strict=True))) / places.uses
    # The constant coefficient is what the bound is about.
    off[0] = 0.0
    firsts = np.cumsum([0, *(len(blocks) for blocks in places.places)])[:-1]
    matched = _moved(places, [gram + off[place] for gram, place in zip(grams, places.every, strict=True)])
    parts = [(gram, k in firsts) for k, gram in enumerate(matched)]
    scale = max(float(np.abs(g).max()) for g in grams)
    found = []
    for shift in (0.0, *(EPS * scale * 2.0**k for k in range(SHIFTS))):
        fall = _fall(parts, shift)
        if fall is not None:
            lost = shift * (reach or 0.0) * len(places.places)
            found.append(Proof(float(wanted[0] - fall - lost), shift, reach, shift == 0 or reach is not None))
            if shift == 0 or reach is None:
                break
    return max(found, key=lambda p: p.value, default=NOTHING)


def _faced(
    places: Moments,
    wanted: np.ndarray,
    grams: Sequence[np.ndarray],
    minimisers: Sequence[Solution],
    reach: float | None,
) -> Proof:
    """The bound of Gram matrices that vanish on the monomials v(u) of all minimisers.

    S = N Σ Nᵀ with the columns of N orthogonal to these v(u), Σ what the solver found plus the least change that
    matches all coefficients but the constant one. What rounding leaves of the match is a matrix E: f ≥ f₀ − |E| |v|².
    """
    points = [np.r_[1.0, places.chart.free_of(_sharpened(s))] for s in minimisers]
    blocks = [v for clique in places.chart.cliques for v in clique.blocks]
    bases = [la.null_space(np.stack([u[v].prod(axis=1) for u in points])) for v in blocks]
    faces = [n.T @ gram @ n for n, gram in zip(bases, grams, strict=True)]
    for _ in range(2):  # the second time for what rounding leaves
        missing = (wanted - _coefficients(places, bases, faces)).astype(float)
        faces = [face + change for face, change in zip(faces, _least(places, bases, missing), strict=True)]
    missing = (wanted - _coefficients(places, bases, faces)).astype(float)
    # The monomial 1 is one of the v(u), so that Σ has next to nothing to say of the constant coefficient.
    value, missing[0] = float(missing[0]), 0.0
    rest = float(np.sqrt(np.sum((missing / places.uses) ** 2 * places.uses)))
    positive = all(_positive(f, 0.0) is not None for f in faces)
    lost = rest * (1.0 + (reach or 0.0)) * len(places.places)
    return Proof(value - lost, rest, reach, positive and reach is not None) if positive else NOTHING


def _coefficients(places: Moments, bases: Sequence[np.ndarray], faces: Sequence[np.ndarray]) -> np.ndarray:
    """(count,) those of Σ vᵀ N Σ Nᵀ v, in longer numbers."""
    total = np.zeros(places.count, dtype=np.longdouble)
    for place, n, face in zip(places.every, bases, faces, strict=True):
        n = n.astype(np.longdouble)
        np.add.at(total, place.ravel(), (n @ face.astype(np.longdouble) @ n.T).ravel())
    return total


def _least(places: Moments, bases: Sequence[np.ndarray], wanted: np.ndarray) -> list[np.ndarray]:
    """By block, the least Δ of which Σ vᵀ N Δ Nᵀ v has the coefficients wanted (count,) but the constant one."""
    # Without the bases the matrix times its transpose is the diagonal of the uses: few steps are enough.
    scale = 1 / np.sqrt(places.uses[1:])
    ends = np.cumsum([n.shape[1] ** 2 for n in bases])

    def split(flat: np.ndarray) -> list[np.ndarray]:
        return [f.reshape(n.shape[1], -1) for f, n in zip(np.split(flat, ends[:-1]), bases, strict=True)]

    def along(flat: np.ndarray) -> np.ndarray:
        grams = (n @ face @ n.T for n, face in zip(bases, split(flat), strict=True))
        return scale * places.summed(zip(places.every, grams, strict=True))[1:]

    def back(values: np.ndarray) -> np.ndarray:
        moments = np.r_[0.0, scale * values]
        return np.concatenate([(n.T @ moments[p] @ n).ravel() for n, p in zip(bases, places.every, strict=True)])

    operator = LinearOperator((len(scale), int(ends[-1])), matvec=along, rmatvec=back, dtype=float)
    return split(lsqr(operator, scale * wanted[1:], atol=EPS, btol=EPS, iter_lim=STEPS)[0])


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
        factor = _positive(gram[1:, 1:] if first else gram, shift)
        if factor is None:
            return None
        if first:
            half = la.solve_triangular(factor, gram[1:, 0], lower=True)
            total += float(half @ half)
    return total


def _positive(matrix: np.ndarray, shift: float) -> np.ndarray | None:
    """The lower factor of a matrix plus η I less what makes sure that it is positive definite; None where it is not.

    Where Cholesky's method ends on a matrix less (n + 2) u tr, u the unit of rounding, the matrix is: Rump 2006.
    """
    n = len(matrix)
    safe = (n + 2) * EPS / 2 * float(np.abs(np.diag(matrix)).sum() + shift * n)
    factor, stopped = la.lapack.dpotrf(matrix + (shift - safe) * np.eye(n), lower=1)
    return factor if stopped == 0 else None


def monomial_reach(program: Program, chart: Chart, best: float) -> float | None:
    """A bound on Σ v_k² over the monomials of degree one and two on {f ≤ best}: β + β² with |u|² ≤ β.

    Rigidity bounds g = |A qᵢ|² between keyframes a time h apart: |g − its chord|² ≤ h/4 ∫ġ² and ≤ h³/48 ∫g̈². So
    |A(t)|² ≤ ρ² for all t; controls are bounded by A at the knot averages, and the free unknowns by controls. None of
    programs without a rigidity of unit test vectors, with translations among their unknowns, or with other conditions.
    """
    design = program.design
    # Other conditions may free keyframes, between which the chords would not be known.
    if not isinstance(design, AffineDesign) or design.constraints or design.channels > design.keyframes.dimension**2:
        return None
    keys, basis = design.keyframes, design.basis
    found = [(w, e) for _, w, e in parts_of(design.objective) if isinstance(e, Rigidity) and e.test_vectors is None]
    squares = all(block.kernel.squares for block in program.terms)
    if not found or not squares or best < 0:
        return None
    weight, energy = found[0]
    inner = basis.knots[basis.degree + 1 : -basis.degree - 1]
    if np.unique(inner, return_counts=True)[1].max(initial=0) > basis.degree + 1 - energy.order:
        return None  # what jumps is not in the integral
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
