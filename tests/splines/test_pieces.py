"""Polynomials on pieces: what is computed differs from what is exact by no more than it says."""

from fractions import Fraction
from math import comb

import numpy as np
import pytest

import symmotion as sm
from symmotion.splines.pieces import Poly, halves, spline_pieces

RNG = np.random.default_rng(1)


def exact(coefficients, s):
    """Σ c_i C(n, i) (1 − s)ⁿ⁻ⁱ sⁱ in rational numbers."""
    n = len(coefficients) - 1
    return sum(Fraction(c) * comb(n, i) * (1 - s) ** (n - i) * s**i for i, c in enumerate(coefficients))


def of_poly(poly, s):
    n = poly.degree
    return sum(Fraction(c) * (1 - s) ** (n - i) * s**i for i, c in enumerate(poly.scaled[:, 0].tolist()))


@pytest.mark.parametrize("away", [0.0, 1e6])
def test_sums_and_products_keep_their_rounding(away):
    a, b = RNG.standard_normal((4, 1)) + away, RNG.standard_normal((3, 1)) - away
    p, q = Poly.of(a, np.zeros(1)), Poly.of(b, np.zeros(1))
    for k in range(11):
        s = Fraction(k, 10)
        x, y = exact(a[:, 0].tolist(), s), exact(b[:, 0].tolist(), s)
        sums, products = ((p + q, x + y), (p - q, x - y)), ((p * q, x * y), (p * q * p + q, x * y * x + y))
        for found, true in (*sums, *products):
            assert abs(of_poly(found, s) - true) <= Fraction(float(found.error[0]))
        for found, size in (*((f, 5.0 + 2 * away) for f, _ in sums), *((f, float(f.size[0])) for f, _ in products)):
            assert float(found.error[0]) <= 1e-13 * size


def test_squares_of_what_cancels_are_off_by_its_rounding_alone():
    away = 5e6
    a = RNG.standard_normal((4, 1)) + away
    apart = Poly.of(a, np.zeros(1)) - Poly.constant(away)
    square = apart * apart
    for k in range(11):
        s = Fraction(k, 10)
        true = (exact(a[:, 0].tolist(), s) - Fraction(away)) ** 2
        assert abs(of_poly(square, s) - true) <= Fraction(float(square.error[0]))
    assert float(square.error[0]) < 1e-6  # (ε 5e6) · 3, not ε (5e6)²


def test_halves_are_the_same_polynomial():
    c = RNG.standard_normal((6, 3))
    first, second = halves(c)
    np.testing.assert_allclose(first[-1], second[0], atol=1e-14)
    np.testing.assert_allclose(first[[0]], c[[0]])
    middle = [float(exact(c[:, k].tolist(), Fraction(1, 4))) for k in range(3)]
    np.testing.assert_allclose([float(exact(first[:, k].tolist(), Fraction(1, 2))) for k in range(3)], middle)


@pytest.mark.parametrize("periodic", [False, True])
def test_a_spline_and_its_derivatives_on_parts_of_spans(periodic):
    breaks = np.array([0.0, 1.0, 1.5, 3.0, 4.0, 6.0])
    basis = (sm.splines.BSplineBasis.closed if periodic else sm.splines.BSplineBasis.clamped)(breaks, 4)
    spline = sm.splines.Spline(basis, RNG.standard_normal((basis.n, 2)) + 1e5)
    left, right = np.array([0.0, 1.1, 3.0, 4.5]), np.array([1.0, 1.2, 4.0, 6.0])
    for order, (coefficients, error) in enumerate(spline_pieces(spline, left, right, 6)):
        for share in (Fraction(0), Fraction(1, 3), Fraction(9, 10)):
            t = left + float(share) * (right - left)
            found = [[float(exact(coefficients[:, c, k].tolist(), share)) for c in range(2)] for k in range(4)]
            np.testing.assert_allclose(found, spline(t, order), rtol=1e-9, atol=1e-8)
        assert (error <= 4e-11 * 100.0**order).all()
