import numpy as np
import pytest
from scipy.interpolate import BSpline, CubicSpline

import symmotion as sm
from symmotion.splines import closest, gauss

RNG = np.random.default_rng(0)


def clamped(degree, count=7):
    return sm.splines.BSplineBasis.clamped(np.cumsum(RNG.uniform(0.1, 1.0, count)), degree)


def inside(basis, count=200):
    a, b = basis.domain
    return np.linspace(a, b, count)


@pytest.mark.parametrize("degree", range(8))
def test_basis_is_a_partition_of_unity_with_local_support(degree):
    basis = clamped(degree)
    t = inside(basis)
    assert np.abs(basis(t).sum(axis=1) - 1).max() < 1e-14
    assert (basis(t) >= 0).all()
    indices, values = basis.local(t)
    assert values.shape == (len(t), degree + 1)
    np.testing.assert_array_equal(np.take_along_axis(basis(t), indices, axis=1), values)


@pytest.mark.parametrize("degree", range(6))
@pytest.mark.parametrize("nu", range(5))
def test_derivatives_agree_with_scipy(degree, nu):
    basis = clamped(degree)
    t = inside(basis)[1:-1]
    expected = BSpline(basis.knots, np.eye(basis.n), degree)(t, nu) if nu <= degree else 0 * basis(t)
    np.testing.assert_allclose(basis(t, nu), expected, atol=1e-11 * max(1, np.abs(expected).max()))


@pytest.mark.parametrize("degree", [1, 2, 3, 5])
def test_periodic_basis_closes_with_its_derivatives(degree):
    basis = sm.splines.BSplineBasis.closed(np.cumsum(RNG.uniform(0.2, 1.0, 9)), degree)
    assert basis.n == 8
    a, b = basis.domain
    for nu in range(degree):
        np.testing.assert_allclose(basis([a], nu), basis([b], nu), atol=1e-9 * np.abs(basis([a], nu)).max())
    assert np.abs(basis(inside(basis)).sum(axis=1) - 1).max() < 1e-13


def test_greville_points_reproduce_the_identity():
    basis = clamped(4)
    np.testing.assert_allclose(basis(inside(basis)) @ basis.greville, inside(basis), atol=1e-13)


@pytest.mark.parametrize("nodes", range(1, 8))
def test_gauss_is_exact_to_degree_2m_minus_1_and_no_further(nodes):
    basis = clamped(3)
    points, weights = gauss(basis, nodes)
    a, b = basis.domain
    middle = (a + b) / 2
    exact = ((b - middle) ** (2 * nodes) - (a - middle) ** (2 * nodes)) / (2 * nodes)
    assert np.sum(weights * (points - middle) ** (2 * nodes - 1)) == pytest.approx(exact, abs=1e-12 * (b - a))
    single = sm.splines.BSplineBasis.clamped([0, 1], 1)
    points, weights = gauss(single, nodes)
    assert abs(np.sum(weights * points ** (2 * nodes)) - 1 / (2 * nodes + 1)) > 1e-12


@pytest.mark.parametrize("ends", ["natural", "not-a-knot", "clamped", "periodic"])
def test_cubic_interpolant_agrees_with_scipy(ends):
    times = np.cumsum(RNG.uniform(0.2, 1.0, 8))
    values = RNG.normal(size=(8, 2, 2))
    slopes = RNG.normal(size=(2, 2, 2)) if ends == "clamped" else None
    if ends == "periodic":
        values[-1] = values[0]
    spline = sm.splines.cubic_interpolant(times, values, ends, slopes)
    conditions = ((1, slopes[0]), (1, slopes[1])) if slopes is not None else ends
    t = np.linspace(times[0], times[-1], 101)
    np.testing.assert_allclose(spline(t), CubicSpline(times, values, bc_type=conditions)(t), atol=1e-12)
    np.testing.assert_allclose(spline.clamped()(t), spline(t), atol=1e-13)


@pytest.mark.parametrize("degree", [1, 2, 3, 4, 6])
def test_insertion_and_elevation_keep_the_function(degree):
    basis = clamped(degree)
    spline = sm.splines.Spline(basis, RNG.normal(size=(basis.n, 3)))
    t = inside(basis)[1:-1]
    middles = (basis.breakpoints[1:] + basis.breakpoints[:-1]) / 2
    for same in (
        spline.refined(middles),
        spline.refined(np.repeat(middles[:2], 2)),
        spline.elevated(),
        spline.refined(middles).elevated(2),
    ):
        assert same.basis.n > basis.n
        assert np.abs(same(t) - spline(t)).max() < 1e-12
        for nu in range(1, degree):
            np.testing.assert_allclose(same(t, nu), spline(t, nu), atol=1e-9 * np.abs(spline(t, nu)).max())


def test_least_squares_agrees_with_the_normal_equations():
    basis = sm.splines.BSplineBasis.clamped(np.linspace(0, 1, 5), 3)
    times, values = np.linspace(0, 1, 30), RNG.normal(size=(30, 2))
    spline = sm.splines.least_squares(basis, times, values)
    residual = basis(times).T @ (spline(times) - values)
    assert np.abs(residual).max() < 1e-12
    exact = np.linspace(0, 1, basis.n)
    np.testing.assert_allclose(
        sm.splines.least_squares(basis, exact, values[: basis.n])(exact), values[: basis.n], atol=1e-12
    )


@pytest.mark.parametrize("degree", [2, 3, 4, 5])
def test_closest_spline_interpolates_and_is_the_best(degree):
    times = np.linspace(0, 1, 6)
    cubic = sm.splines.cubic_interpolant(times, RNG.normal(size=(6, 1)))
    basis = sm.splines.BSplineBasis.clamped(np.linspace(0, 1, 11), degree)
    near = closest(basis, cubic, times)
    np.testing.assert_allclose(near(times), cubic(times), atol=1e-12)
    points, weights = gauss(sm.splines.BSplineBasis.clamped(np.linspace(0, 1, 11), 1), 8)

    def distance(spline):
        return np.sum(weights * (spline(points, 2) - cubic(points, 2))[..., 0] ** 2)

    null = np.linalg.svd(basis(times))[2][len(times) :]
    for direction in null:
        for step in (-1e-3, 1e-3):
            other = sm.splines.Spline(basis, near.control_points + step * direction[:, None])
            assert distance(other) >= distance(near) - 1e-12
    if degree == 3:
        assert distance(near) < 1e-20


def test_splines_say_where_their_domain_ends():
    spline = sm.splines.cubic_interpolant([0, 1, 2], [0.0, 1.0, 0.0])
    with pytest.raises(sm.InputError, match=r"2\.5 is outside the domain \[0, 2\]"):
        spline([1.0, 2.5])
    assert np.isfinite(spline(2.5, extrapolate=True))
    with pytest.raises(sm.InputError, match="finite"):
        spline(np.nan)
    with pytest.raises(sm.InputError, match="order -1"):
        spline(0.5, nu=-1)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: sm.splines.BSplineBasis([0, 0, 1, 1], -1), "degree -1"),
        (lambda: sm.splines.BSplineBasis([0, 1], 3), "too few for degree 3"),
        (lambda: sm.splines.BSplineBasis([0, 0, 2, 1, 3, 3], 1), "decrease from 2 to 1 at knot 3"),
        (lambda: sm.splines.BSplineBasis([0, 0, 1, 1, 1, 2, 2], 1), "knot 1 has more than degree"),
        (lambda: sm.splines.BSplineBasis([0, 0, np.nan, 1], 1), "knot 2 is not finite"),
        (lambda: sm.splines.BSplineBasis.closed([0, 1, 2], 3), "more than 3 spans"),
        (lambda: sm.splines.BSplineBasis.clamped([0, 1], 3).with_knots(2.0), "outside the domain"),
        (lambda: sm.splines.BSplineBasis.closed(range(6), 3).elevated(), "clamped basis"),
        (
            lambda: gauss(sm.splines.BSplineBasis.clamped([0, 1], 1), 0),
            "nodes 0: a whole number of Gauss nodes, 1 or more",
        ),
        (lambda: sm.splines.Spline(sm.splines.BSplineBasis.clamped([0, 1], 1), np.zeros(3)), "first axis must be 2"),
        (lambda: sm.splines.cubic_interpolant([0, 1, 1], [1, 2, 3]), "keyframe 2, 1, repeats that of keyframe 1"),
        (lambda: sm.splines.cubic_interpolant([0, 2, 1], [1, 2, 3]), "keyframe 2, 1, comes before that of keyframe 1"),
        (lambda: sm.splines.cubic_interpolant([0, np.inf, 3], [1, 2, 3]), "time of keyframe 1 is inf"),
        (lambda: sm.splines.cubic_interpolant([0, 1, 2], [1, 2]), "3 times for 2 values"),
        (lambda: sm.splines.cubic_interpolant([0, 1, 2], [1, 2, 3], "free"), "'free' is unknown; there are natural"),
        (lambda: sm.splines.cubic_interpolant([0, 1, 2], [1, 2, 3], "not-a-knot"), "at least 4 are needed"),
        (lambda: sm.splines.cubic_interpolant([0, 1, 2], [1, 2, 3], "clamped"), "clamped ends need"),
        (lambda: sm.splines.cubic_interpolant([0, 1, 2], [1, 2, 3], "natural", [0, 0]), "clamped ends"),
        (lambda: sm.splines.cubic_interpolant(range(4), range(4), "periodic"), "last keyframe equal to the first"),
    ],
)
def test_bad_input_names_the_culprit(make, message):
    with pytest.raises(sm.InputError, match=message):
        make()


def test_schoenberg_whitney_names_the_keyframes_that_crowd():
    basis = sm.splines.BSplineBasis.clamped([0.0, 0.25, 0.5, 0.75, 1.0], 3)
    times = np.array([0.0, 0.8, 0.82, 0.84, 0.86, 0.9, 1.0])
    with pytest.raises(sm.InputError, match=r"keyframes 1 to 5 \(times 0.8 to 0.9\) are more conditions"):
        sm.splines.least_squares(basis, times, np.zeros(7))
    with pytest.raises(sm.InputError, match="cannot determine 7 controls"):
        sm.splines.least_squares(basis, times[:5], np.zeros(5))
    with pytest.raises(sm.InputError, match="control 0 has no keyframe"):
        sm.splines.least_squares(basis, np.linspace(0.5, 1, 20), np.zeros(20))
