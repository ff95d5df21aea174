"""What the lecture notes say of motion curves: matrices, forms, hulls, crossings, continuity. The guide shows them."""

import numpy as np
import pytest
from scipy.spatial import ConvexHull

import symmotion as sm

TO_HERMITE = np.array([[1, 0, 0, 0], [0, 0, 0, 1], [-3, 3, 0, 0], [0, 0, -3, 3]])
T = np.linspace(0, 1, 201)


def polygon(seed: int, degree: int = 3) -> np.ndarray:
    return np.random.default_rng(seed).normal(size=(degree + 1, 2))


def test_the_matrix_from_bezier_to_hermite_gives_the_bernstein_polynomials():
    hermite = sm.curves.basis_matrix([(0, 0), (1, 0), (0, 1), (1, 1)])
    bernstein = [[-1, 3, -3, 1], [3, -6, 3, 0], [-3, 3, 0, 0], [1, 0, 0, 0]]
    np.testing.assert_allclose(hermite @ TO_HERMITE, bernstein, atol=1e-13)
    controls = polygon(0)
    ends, slopes = (TO_HERMITE @ controls).reshape(2, 2, 2)
    np.testing.assert_allclose(
        sm.curves.hermite_spline([0, 1], ends, slopes)(T), sm.curves.bezier(controls)(T), atol=1e-14
    )


@pytest.mark.parametrize("s", [0.0, 0.3, 0.5, 1.0])
def test_the_cardinal_parameter_is_half_of_one_minus_the_tension(s):
    times, values = np.arange(5.0), polygon(1, 4)
    cardinal = sm.curves.kochanek_bartels(times, values, tension=1 - 2 * s)
    np.testing.assert_allclose(cardinal(times[1:-1], nu=1), s * (values[2:] - values[:-2]), atol=1e-14)


def test_a_parabola_is_the_same_explicitly_implicitly_and_as_a_curve():
    curve = sm.curves.bezier([[0.0, 0.0], [1.0, 2.0], [2.0, 0.0]])
    x, y = curve(T).T
    np.testing.assert_allclose(y, x * (2 - x), atol=1e-15)
    gradient = np.stack([2 * x - 2, np.ones_like(x)], axis=1)  # of f(x, y) = y − x (2 − x)
    np.testing.assert_allclose(np.sum(gradient * curve(T, nu=1), axis=1), 0, atol=1e-14)


@pytest.mark.parametrize(("weight", "kind"), [(0.5, -1), (1.0, 0), (2.0, 1)])
def test_the_weight_of_a_conic_tells_ellipse_parabola_and_hyperbola(weight, kind):
    """The sign of B² − 4AC of the implicit form A x² + B xy + C y² + D x + E y + F = 0 through points of the arc."""
    x, y = sm.curves.RationalQuadratic(np.array([[0.0, 0.0], [1.0, 2.0], [2.0, 0.0]]), weight)(T).T
    rows = np.stack([x * x, x * y, y * y, x, y, np.ones_like(x)], axis=1)
    a, b, c, *_ = np.linalg.svd(rows)[2][-1]
    discriminant = b * b - 4 * a * c
    assert np.sign(np.round(discriminant, 9)) == kind


@pytest.mark.parametrize("seed", range(5))
def test_a_bezier_curve_lies_in_the_convex_hull_of_its_controls(seed):
    controls = polygon(seed, 4)
    hull = ConvexHull(controls).equations
    assert (sm.curves.bezier(controls)(T) @ hull[:, :2].T + hull[:, 2]).max() <= 1e-12


@pytest.mark.parametrize("seed", range(5))
def test_a_line_cuts_a_bezier_curve_no_oftener_than_its_polygon(seed):
    rng = np.random.default_rng(100 + seed)
    controls = polygon(seed, 5)
    curve = sm.curves.bezier(controls)(np.linspace(0, 1, 2001))
    cuts = []
    for _ in range(200):
        normal, offset = rng.normal(size=2), 0.5 * rng.normal()
        sides = [np.sign(points @ normal - offset) for points in (curve, controls)]
        cuts.append([np.count_nonzero(np.diff(side)) for side in sides])
    of_curve, of_polygon = np.transpose(cuts)
    assert (of_curve <= of_polygon).all() and of_curve.max() > 0


def gaps(left, right) -> tuple[float, float, float, float]:
    """By how much two pieces that meet fail C¹, G¹, C² and G²."""
    d, dd, e, ee = left(1.0, nu=1), left(1.0, nu=2), right(0.0, nu=1), right(0.0, nu=2)
    beta = np.linalg.norm(e) / np.linalg.norm(d)
    rest = ee - beta**2 * dd
    across = abs(d[0] * rest[1] - d[1] * rest[0]) / np.linalg.norm(d)
    return (
        float(np.linalg.norm(e - d)),
        float(np.linalg.norm(e - beta * d)),
        float(np.linalg.norm(ee - dd)),
        float(across),
    )


def test_a_curve_run_at_another_speed_is_geometrically_continuous_and_no_more():
    curve = sm.curves.bezier(polygon(3))
    first = sm.curves.Retimed(curve, sm.curves.bezier([0.0, 0.3]))
    second = sm.curves.Retimed(curve, sm.curves.bezier([0.3, 0.4, 1.0]))
    c1, g1, c2, g2 = gaps(first, second)
    assert c1 > 0.1 and c2 > 0.1
    assert g1 < 1e-14 and g2 < 1e-13


def test_equal_tangents_alone_are_not_g2():
    left = sm.curves.bezier([[0, 0], [0, 1], [1, 2], [2, 2]])
    right = sm.curves.bezier([[2, 2], [3, 2], [4.5, 0], [5, 0]])
    c1, g1, _, g2 = gaps(left, right)
    assert c1 < 1e-14 and g1 < 1e-14 and g2 > 1
