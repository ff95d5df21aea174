import casadi as ca
import numpy as np
import pytest

import symmotion as sm
from symmotion.splines.symbolic import local_basis


@pytest.mark.parametrize("symbols", [ca.SX, ca.MX])
@pytest.mark.parametrize("degree", [0, 1, 2, 3, 5])
def test_the_recursion_of_symbols_is_that_of_numbers(degree, symbols):
    knots = np.cumsum(np.random.default_rng(degree).uniform(0.1, 1.0, 2 * degree + 8))
    basis = sm.splines.BSplineBasis(knots, degree)
    k, t = symbols.sym("k", 2 * degree), symbols.sym("t")
    for nu in range(degree + 2):
        out = ca.vertcat(*local_basis(ca.vertsplit(k) if degree else [], degree, t, nu))
        values = ca.Function("values", [k, t], [out])
        for j in range(degree, basis.n):
            time = knots[j] + 0.3 * (knots[j + 1] - knots[j])
            found = np.asarray(values(knots[j + 1 - degree : j + 1 + degree], time)).ravel()
            expected = basis.local(time, nu)[1][0]
            np.testing.assert_allclose(found, expected, rtol=1e-13, atol=1e-13 * max(1, np.abs(expected).max()))
