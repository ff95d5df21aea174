"""Redundant and conflicting equalities, found before solving."""

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import splu

from symmotion.errors import InputError
from symmotion.program import Evaluator, Program
from symmotion.systems import largest

# The share of a combination of conditions below which one has no part in it.
SHARE = 1e-9


def require_independent(program: Program) -> None:
    """Raise InputError that names the first equality which the ones before it already settle, or contradict."""
    evaluator, x = Evaluator(program), program.x0
    jacobian, gap = evaluator.jacobian(x), evaluator.values(x) - program.lower
    equal = np.flatnonzero(program.lower == program.upper)
    if _full_rank(jacobian[equal]):
        return
    dense, first = jacobian.toarray(), 0
    for c in program.constraints:
        settled = []  # the components that follow from what comes before, by how far they are from agreeing, and how
        for k in range(c.size if c.is_equality else 0):
            row = first + k
            before = equal[equal < row]
            weights, *_ = np.linalg.lstsq(dense[before].T, dense[row])
            if np.abs(dense[row] - weights @ dense[before]).max() <= 1e-9 * np.abs(dense[row]).max(initial=0.0):
                settled.append((abs(gap[row] - weights @ gap[before]), k, before, weights))
        if settled:
            off, k, before, weights = max(settled, key=lambda entry: entry[0])
            word = "contradicts" if off > 1e-8 * max(1.0, np.abs(gap).max()) else "repeats"
            share = np.zeros(program.conditions)
            share[before] = np.abs(weights) * np.abs(dense[before]).max(axis=1, initial=0.0)
            share[first + k] = np.abs(dense[first + k]).max()
            among = ", ".join(
                name for name, part in program.split(share).items() if largest(part) > SHARE * share.max()
            )
            raise InputError(
                f"constraint {c.name!r} (component {k % c.lower.shape[1]} at place {k // c.lower.shape[1]}) {word} "
                f"conditions among {among}: leave one out or insert more knots"
            )
        first += c.size


def _full_rank(jacobian: sparse.csr_array) -> bool:
    """Whether the rows are independent, to 1e-10 of the largest pivot of J Jᵀ."""
    if not jacobian.shape[0]:
        return True
    try:
        pivots = np.abs(splu(sparse.csc_array(jacobian @ jacobian.T)).U.diagonal())
    except RuntimeError:
        return False
    return bool(pivots.min() > 1e-10 * pivots.max())
