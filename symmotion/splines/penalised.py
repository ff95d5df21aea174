"""What splines that smooth are made of: Gram matrices of derivatives, their banded factors and determinants."""

from typing import TypeAlias

import numpy as np
from scipy import sparse

from symmotion.splines.basis import BSplineBasis
from symmotion.splines.quadrature import gauss

Bands: TypeAlias = np.ndarray  # (width + 1, n), the upper bands of a symmetric matrix as LAPACK has them
Factor: TypeAlias = np.ndarray  # those of a Cholesky factor


def gram(basis: BSplineBasis, order: int = 0) -> sparse.csr_array:
    """(n, n) ∫ N_i^(order) N_j^(order) dt, exact; order: at most the degree.

    >>> from symmotion.splines.penalised import gram
    >>> round(float(gram(sm.splines.BSplineBasis.clamped([0.0, 1.0, 3.0], 3)).sum()), 12)
    3.0
    """
    points, weights = (part.ravel() for part in gauss(basis.relative, basis.degree - order + 1))
    values = basis.relative.matrix(points, order)
    return values.T @ sparse.diags_array(weights) @ values


def derivative(basis: BSplineBasis, order: int) -> tuple[sparse.csr_array, BSplineBasis]:
    """(n − order, n) what takes controls to those of the derivative of a clamped spline, and the basis of that.

    >>> from symmotion.splines.penalised import derivative
    >>> basis = sm.splines.BSplineBasis.clamped([0.0, 1.0, 3.0], 3)
    >>> operator, lower = derivative(basis, 1)
    >>> bool(np.allclose(lower(0.5) @ operator, basis(0.5, 1)))
    True
    """
    operator = sparse.eye_array(basis.n, format="csr")
    for _ in range(order):
        p, n, knots = basis.degree, basis.n, basis.knots
        slopes = p / (knots[p + 1 : p + n] - knots[1:n])
        operator = sparse.diags_array([-slopes, slopes], offsets=[0, 1], shape=(n - 1, n)) @ operator
        basis = BSplineBasis(knots[1:-1], p - 1, origin=basis.origin)
    return sparse.csr_array(operator), basis


def natural(basis: BSplineBasis, order: int) -> sparse.csr_array:
    """(n, n − 2 (order − 1)) what takes the controls of a natural spline to those over its clamped basis.

    Of degree 2 order − 1: derivatives from `order` to 2 order − 2 vanish at the ends, as those of the spline of least
    ∫ ‖x^(order)‖² do. With a knot at every sample there are then as many controls as samples, which the values at
    these determine. The controls next to the end ones are left out.

    >>> from symmotion.splines.penalised import natural
    >>> basis = sm.splines.BSplineBasis.clamped([0.0, 1.0, 3.0, 4.0], 3)
    >>> spline = natural(basis, 2) @ [1.0, 5.0, 2.0, 3.0]
    >>> bool(np.allclose(basis([0.0, 4.0], 2) @ spline, 0))
    True
    """
    n = basis.n
    kept = np.concatenate([[0], np.arange(order, n - order), [n - 1]])
    operator = sparse.lil_array((n, len(kept)))
    operator[kept, np.arange(len(kept))] = 1.0
    for end, near in zip(basis.domain, (np.arange(1, order), np.arange(n - order, n - 1)), strict=True):
        rates = np.concatenate([basis(end, nu) for nu in range(order, 2 * order - 1)])
        operator[near] = np.linalg.solve(rates[:, near], -rates[:, kept])
    operator = sparse.csr_array(operator)
    operator.eliminate_zeros()  # else products with it are full of them
    return operator


def banded(matrix: sparse.sparray, width: int) -> Bands:
    """The bands of a symmetric matrix (n, n) with `width` of them on either side: what sums up and is factorised fast.

    >>> from symmotion.splines.penalised import banded, gram
    >>> basis = sm.splines.BSplineBasis.clamped([0.0, 1.0, 3.0], 3)
    >>> banded(gram(basis), 3).shape
    (4, 5)
    """
    return np.array([np.concatenate([np.zeros(k), matrix.diagonal(k)]) for k in range(width, -1, -1)])


def cholesky(bands: Bands) -> Factor:
    """The Cholesky factor of a positive definite matrix.

    Raises np.linalg.LinAlgError where it is not, to rounding.

    >>> from symmotion.splines.penalised import banded, cholesky, gram
    >>> basis = sm.splines.BSplineBasis.clamped([0.0, 1.0, 3.0], 3)
    >>> cholesky(banded(gram(basis), 3)).shape
    (4, 5)
    """
    from scipy.linalg import cholesky_banded  # here: see Spline._scipy

    return cholesky_banded(bands, check_finite=False)


def solved(factor: Factor, right: np.ndarray) -> np.ndarray:
    """What times the matrix that was factorised is `right` (n, c).

    >>> from symmotion.splines.penalised import banded, cholesky, gram, solved
    >>> matrix = gram(sm.splines.BSplineBasis.clamped([0.0, 1.0, 3.0], 3))
    >>> bool(np.allclose(solved(cholesky(banded(matrix, 3)), matrix @ np.ones((5, 1))), 1))
    True
    """
    from scipy.linalg import cho_solve_banded  # here: see Spline._scipy

    return cho_solve_banded((factor, False), right, check_finite=False)


def log_det(factor: Factor) -> float:
    """The logarithm of the determinant of the matrix that was factorised.

    >>> from symmotion.splines.penalised import banded, cholesky, gram, log_det
    >>> matrix = gram(sm.splines.BSplineBasis.clamped([0.0, 1.0, 3.0], 3))
    >>> round(np.exp(log_det(cholesky(banded(matrix, 3)))) / np.linalg.det(matrix.toarray()), 9)
    1.0
    """
    return float(2 * np.log(factor[-1]).sum())
