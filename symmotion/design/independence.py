"""Redundant and conflicting equalities, found before solving."""

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import splu

from symmotion.errors import InputError
from symmotion.program import Evaluator, Program


def require_independent(program: Program) -> None:
    """Raise InputError that names the first equality which the ones before it already settle, or contradict."""
    evaluator, x = Evaluator(program), program.x0
    jacobian, gap = evaluator.jacobian(x), evaluator.values(x) - program.lower
    equal = np.flatnonzero(program.lower == program.upper)
    if _full_rank(jacobian[equal]):
        return
    dense, first = jacobian.toarray(), 0
    for number, c in enumerate(program.constraints):
        settled = []  # the components that follow from what comes before, with how far they are from agreeing
        for k in range(c.size if c.is_equality else 0):
            row = first + k
            before = equal[equal < row]
            weights, *_ = np.linalg.lstsq(dense[before].T, dense[row])
            if np.abs(dense[row] - weights @ dense[before]).max() <= 1e-9 * np.abs(dense[row]).max(initial=0.0):
                settled.append((abs(gap[row] - weights @ gap[before]), k))
        if settled:
            off, k = max(settled)
            word = "contradicts" if off > 1e-8 * max(1.0, np.abs(gap).max()) else "repeats"
            earlier = ", ".join(o.name for o in program.constraints[: number + 1])
            raise InputError(
                f"constraint {c.name!r} (component {k % c.lower.shape[1]} at place {k // c.lower.shape[1]}) {word} "
                f"conditions among {earlier}: leave one out or insert more knots"
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
