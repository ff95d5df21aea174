"""Gram matrices, their factors and natural ends, against SciPy and dense algebra."""

from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.interpolate import BSpline, CubicSpline

from symmotion.splines import BSplineBasis
from symmotion.splines.penalised import banded, cholesky, derivative, gram, log_det, natural, solved

TIMES = 100.0 + np.array([0.0, 0.3, 1.1, 1.2, 2.5, 3.0, 3.4, 4.0, 5.5])


@pytest.mark.parametrize("order", [0, 2, 3])
def test_grams_are_the_integrals_of_products(order):
    basis = BSplineBasis.clamped(TIMES, 5)
    found = gram(basis, order).toarray()
    functions, since = [BSpline(basis.knots, c, 5) for c in np.eye(basis.n)], TIMES - basis.origin
    for i, j in [(0, 0), (0, 3), (4, 6), (basis.n - 1, basis.n - 2), (0, basis.n - 1)]:
        first, second = functions[i], functions[j]
        parts = [quad(lambda t, f=first, g=second: f(t, order) * g(t, order), *ends)[0] for ends in pairwise(since)]
        assert found[i, j] == pytest.approx(sum(parts), rel=1e-10, abs=1e-12)


def test_factors_are_those_of_dense_algebra():
    matrix = gram(BSplineBasis.clamped(TIMES, 3))
    factor, right = cholesky(banded(matrix, 3)), np.random.default_rng(1).normal(size=(matrix.shape[0], 2))
    np.testing.assert_allclose(solved(factor, right), np.linalg.solve(matrix.toarray(), right), rtol=1e-10)
    assert log_det(factor) == pytest.approx(np.linalg.slogdet(matrix.toarray())[1], rel=1e-12)
    with pytest.raises(np.linalg.LinAlgError):
        cholesky(banded(-matrix, 3))


def test_derivatives_of_controls_are_those_of_splines():
    basis = BSplineBasis.clamped(TIMES, 5)
    operator, lower = derivative(basis, 2)
    t = np.linspace(*basis.domain, 50)
    np.testing.assert_allclose(lower(t) @ operator, basis(t, 2), atol=1e-9)


def test_natural_ends_are_those_of_the_natural_cubic_spline():
    basis, values = BSplineBasis.clamped(TIMES, 3), np.sin(3 * TIMES)
    whole = natural(basis, 2)
    assert whole.shape == (basis.n, len(TIMES)) and whole.nnz == len(TIMES) + 4
    free = np.linalg.solve(basis(TIMES) @ whole, values)
    t = np.linspace(*basis.domain, 60)
    np.testing.assert_allclose(basis(t) @ whole @ free, CubicSpline(TIMES, values, bc_type="natural")(t), atol=1e-10)


def test_natural_ends_of_quintics_lose_third_and_fourth_derivatives():
    basis = BSplineBasis.clamped(TIMES, 5)
    whole = natural(basis, 3)
    assert whole.shape == (basis.n, len(TIMES)) and np.linalg.matrix_rank(whole.toarray()) == len(TIMES)
    for end in basis.domain:
        for order in (3, 4):
            rates = basis(end, order)
            assert np.abs(rates @ whole).max() < 1e-10 * np.abs(rates).max()
