"""Whether a symmetric matrix is positive definite, and a direction that shows it where it is not."""

from dataclasses import dataclass

import numpy as np
import scipy.linalg as la
from scipy import sparse
from scipy.sparse.linalg import splu, spsolve_triangular

from symmotion.brief import in_a_line
from symmotion.program.block import EPS


@dataclass(frozen=True, eq=False)
class Curvature:
    """What a symmetric matrix H is up to the rounding of its entries.

    inertia: "positive" definite; "indefinite", with a direction (size,) y where yᵀHy < 0; "flat", zero;
    "unknown", with an eigenvalue that rounding does not tell from zero.

    >>> from symmotion.program import Evaluator
    >>> program = sm.affine_program(sm.examples.planar_keyframes())
    >>> x, evaluator = sm.ExactNewton().solve(program).x, Evaluator(program)
    >>> system = sm.systems.system_of(program, evaluator, x)
    >>> system.curvature(evaluator.second_order(x, system.pattern)[1]).inertia
    'positive'
    """

    inertia: str
    direction: np.ndarray | None = None

    __repr__ = in_a_line


POSITIVE, FLAT, UNKNOWN = Curvature("positive"), Curvature("flat"), Curvature("unknown")


def scaling(diagonal: np.ndarray, largest: np.ndarray, least: float = 0.0) -> np.ndarray:
    """(size,) d so that d_i h_ij d_j are of order one, whatever the units; from the diagonal and the rows' largest.

    least: of the diagonal, relative to the row's largest, where both may be next to nothing: along conditions alone the
    matrix has to be positive.
    """
    top = float(np.abs(diagonal).max(initial=0.0)) or float(largest.max(initial=0.0)) or 1.0
    square = np.maximum(np.maximum(np.abs(diagonal), largest**2 / top), least * np.maximum(largest, least * top))
    return 1.0 / np.sqrt(np.where(square > 0, square, 1.0))


def banded_curvature(lower: np.ndarray) -> Curvature:
    """The curvature of a matrix given by its lower bands (band + 1, n), as LAPACK stores them.

    Where Cholesky's method stops at a pivot, the leading block, which is positive definite, gives a direction
    in which the curvature is that pivot. Shifted by the rounding, it tells whether that is real.
    """
    band, n = lower.shape[0] - 1, lower.shape[1]
    if not np.any(lower):
        return FLAT if n else POSITIVE
    # Of a matrix that may be positive definite no row has an entry larger than its diagonal allows.
    positive = bool((lower[0] > 0).all())
    d = 1.0 / np.sqrt(lower[0]) if positive else np.ones(n)
    scaled = _scaled(lower, d)
    if not positive or _size(scaled) > 1.0 + n * EPS:
        d = scaling(lower[0], _rows(lower))
        scaled = _scaled(lower, d)
    rounding = n * EPS * _size(scaled)
    if _cholesky(scaled, -rounding)[1] == 0:
        return POSITIVE
    factor, stopped = _cholesky(scaled, rounding)
    if stopped == 0:
        return UNKNOWN
    k = stopped - 1
    y = np.zeros(n)
    y[k] = 1.0
    if k:
        column = np.zeros(k)
        reach = min(band, k)
        column[k - reach :] = [scaled[j, k - j] for j in range(reach, 0, -1)]
        factor, _ = _cholesky(scaled[:, :k], rounding)
        y[:k] = -la.cho_solve_banded((factor, True), column)
    return Curvature("indefinite", d * y)


def _scaled(lower: np.ndarray, d: np.ndarray) -> np.ndarray:
    """The bands of d_i h_ij d_j, zero in the corner that no entry of the matrix lies in; by columns, as LAPACK's."""
    band, n = lower.shape[0] - 1, lower.shape[1]
    columns = np.lib.stride_tricks.sliding_window_view(np.concatenate([d, np.zeros(band)]), band + 1)
    scaled = lower.T * d[:, None]
    scaled *= columns
    for j in range(max(0, n - band), n):
        scaled[j, n - j :] = 0.0
    return scaled.T


def _rows(lower: np.ndarray) -> np.ndarray:
    """(n,) the largest entry of every row of the matrix."""
    n = lower.shape[1]
    rows = np.zeros(n)
    for k, diagonal in enumerate(np.abs(lower[:n])):
        rows[: n - k] = np.maximum(rows[: n - k], diagonal[: n - k])
        rows[k:] = np.maximum(rows[k:], diagonal[: n - k])
    return rows


def _size(array: np.ndarray) -> float:
    """The largest entry, without an array of absolute values beside a large one."""
    return max(float(array.max()), -float(array.min()))


def _cholesky(lower: np.ndarray, shift: float) -> tuple[np.ndarray, int]:
    """The banded factor of a matrix plus a multiple of the identity, and the pivot at which it stopped, else 0."""
    shifted = lower.copy(order="F")
    shifted[0] += shift
    return la.lapack.dpbtrf(shifted, lower=1, overwrite_ab=1)


def dense_curvature(matrix: np.ndarray, error: float = 0.0) -> Curvature:
    """The curvature of a dense symmetric matrix, by its least eigenvalue; error: what its entries may be off by."""
    n = len(matrix)
    if not n:
        return POSITIVE
    if np.abs(matrix).max() <= error:
        return FLAT
    d = scaling(np.diag(matrix), np.abs(matrix).max(axis=1))
    scaled = d[:, None] * matrix * d
    rounding = max(n * EPS * float(np.abs(scaled).max()), error)
    if la.lapack.dpotrf(scaled - rounding * np.eye(n))[1] == 0:
        return POSITIVE
    values, vectors = la.eigh(scaled, subset_by_index=[0, 0])
    return Curvature("indefinite", d * vectors[:, 0]) if values[0] < -rounding else UNKNOWN


def first_failing_pivot(matrix: sparse.csc_array) -> np.ndarray | None:
    """(n,) y with yᵀKy ≤ 0 of a sparse symmetric matrix K, None where all pivots are positive."""
    n = matrix.shape[0]
    options = {"SymmetricMode": True}
    try:
        lu = splu(matrix, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options=options)
    except RuntimeError:
        return None
    pivots = lu.U.diagonal()
    if (lu.perm_r != lu.perm_c).any() or (pivots > 0).all():
        return None
    k = int(np.argmax(pivots <= 0))
    unit = np.zeros(n)
    unit[k] = 1.0
    # L is unit lower triangular: Lᵀ y = e_k reads the leading block only, whose pivots are positive.
    y = spsolve_triangular(sparse.csr_array(lu.L.T), unit, lower=False)
    return y[lu.perm_c]
