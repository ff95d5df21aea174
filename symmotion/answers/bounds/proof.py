"""What a solution of the relaxation proves: a lower bound that holds in spite of the solver's rounding."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.linalg as la

from symmotion.answers.bounds.quartic import Chart
from symmotion.answers.bounds.relaxation import Moments, Relaxed
from symmotion.design.affine import AffineDesign
from symmotion.design.terms import parts_of
from symmotion.energies import Rigidity
from symmotion.program import Program

EPS = float(np.finfo(float).eps)
SLOPPY = 8  # roundings of a matrix of order one that a factorisation may be off by, for each of its rows
SHIFTS = 40  # multiples of the identity that are tried, each ten times the one before


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


def proved(program: Program, places: Moments, forms: Sequence[np.ndarray], relaxed: Relaxed, best: float) -> Proof:
    """The bound from the Gram matrices S of a relaxation about a point where f is as low as is known, f* = best.

    They are changed so that Σ vᵀSv and f have the same coefficients but the constant one, f₀. With v₀ = 1 and
    S = [[s, bᵀ], [b, C]], vᵀ(S + η I)v ≥ s − bᵀ(C + ηI)⁻¹b, so that f ≥ f₀ − Σ bᵀ(C + ηI)⁻¹b − η Σ |v|² without the
    first entry, the sums over cliques. About the minimiser b is nearly zero; η is zero where C is safely positive
    definite.
    """
    wanted = places.coefficients(forms)
    off = (wanted - places.summed(zip(places.every, relaxed.grams, strict=True))) / places.uses
    grams = [gram + off[place] for place, gram in zip(places.every, relaxed.grams, strict=True)]
    firsts = {id(blocks[0]) for blocks in places.places}
    parts = [(g, id(place) in firsts) for g, place in zip(grams, places.every, strict=True)]
    reach = monomial_reach(program, places.chart, best)
    scale = max(float(np.abs(g).max()) for g in grams)
    shifts = [0.0, *(EPS * scale * 10.0 ** (k / 2) for k in range(SHIFTS))]
    found = []
    for shift in shifts:
        fall = _fall(parts, shift)
        if fall is None:
            continue
        lost = 0.0 if shift == 0 else shift * (reach or 0.0) * len(places.places)
        found.append(Proof(float(wanted[0] - fall - lost), shift, reach, shift == 0 or reach is not None))
        if shift == 0 or reach is None:
            break
    return max(found, key=lambda p: p.value) if found else Proof(-np.inf, np.inf, reach, False)


def _fall(parts: Sequence[tuple[np.ndarray, bool]], shift: float) -> float | None:
    """Σ bᵀ(C + ηI)⁻¹b of Gram matrices, those marked with a first entry; None where one is not safely positive."""
    total = 0.0
    for gram, first in parts:
        inner = gram[1:, 1:] if first else gram
        size = len(inner)
        if not size:
            continue
        safe = SLOPPY * size * EPS * float(np.abs(inner).max())
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
