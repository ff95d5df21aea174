"""Knots of fits: at equal numbers of samples, and where there are nearly as many controls as samples, at these."""

from itertools import pairwise

import numpy as np
import pytest
from scipy.interpolate import make_interp_spline

import symmotion as sm
from symmotion.design.fit_space import fit_basis


@pytest.mark.parametrize("degree", [1, 2, 3, 4, 5])
def test_as_many_controls_as_samples_are_the_knots_of_scipy(degree):
    t = np.cumsum(np.random.default_rng(3).uniform(0.5, 1.5, 30))
    basis = fit_basis(t, np.arange(30), degree, 30, None)
    np.testing.assert_allclose(basis.origin + basis.knots, make_interp_spline(t, t, degree).t, rtol=1e-12)


@pytest.mark.parametrize("share", [1.0, 0.99, 0.97, 0.9, 0.8])
@pytest.mark.parametrize("degree", [2, 3, 5])
def test_nearly_as_many_controls_as_samples_are_determined(degree, share):
    """Knots at equal numbers of samples led to condition numbers of 1e16 for share 1, and 1e10 for 0.99."""
    t = 0.01 * np.arange(300)
    basis = fit_basis(t, np.arange(300), degree, round(share * 300), None)
    assert np.linalg.cond(basis(t)) < 50


def test_a_fit_of_as_many_controls_as_samples_passes_through_these():
    samples = sm.examples.recorded_tour(301, noise=5.0)
    fit = sm.ExactNewton().solve(sm.fit_program(samples, controls=301)).require()
    expected = make_interp_spline(samples.times, samples.coordinates, 3)
    between = np.linspace(*fit.motion.domain, 1000)
    found = fit.motion(between)
    np.testing.assert_allclose(found.translation, expected(between)[:, 9:], atol=1e-8)
    np.testing.assert_allclose(found.linear.reshape(-1, 9), expected(between)[:, :9], atol=1e-8)


def test_fewer_controls_have_equal_numbers_of_samples_between_knots():
    t = np.arange(101.0) ** 1.2
    basis = fit_basis(t, np.arange(101), 3, 23, None)
    counts = [((t >= a) & (t < b)).sum() for a, b in pairwise(basis.breakpoints)]
    assert counts[:-1] == [5] * 19
