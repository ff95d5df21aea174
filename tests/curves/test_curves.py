from math import comb
from typing import Any, cast

import casadi as ca
import numpy as np
import pytest
import splines
from scipy.interpolate import BSpline, CubicHermiteSpline, CubicSpline

import symmotion as sm
from symmotion.curves import (
    ArcParameter,
    RationalQuadratic,
    Retimed,
    SymbolicSpline,
    arc_length,
    basis_matrix,
    bernstein,
    bezier,
    blending_functions,
    catmull_rom,
    constant_speed,
    constraint_matrix,
    de_casteljau,
    hermite_spline,
    kochanek_bartels,
    polynomial_segment,
    slow_in_out,
    smooth_step,
    speed,
)

RNG = np.random.default_rng(0)
TIMES = np.cumsum(RNG.uniform(0.3, 1.0, 7))
VALUES = RNG.normal(size=(7, 2))
CLOSED = np.concatenate([VALUES[:-1], VALUES[:1]])
EXAMPLE = [(0.0, 0), (0.5, 0), (0.5, 1), (1.0, 0)]


def inside(curve, count=101):
    a, b = curve.domain
    return np.linspace(a, b, count)


def differences(curve, t, nu, step=1e-5):
    return (curve(t + step, nu) - curve(t - step, nu)) / (2 * step)


@pytest.mark.parametrize("degree", range(1, 9))
def test_bezier_is_bernstein_and_de_casteljau(degree):
    points, u = RNG.normal(size=(degree + 1, 3)), np.linspace(0, 1, 21)
    curve = bezier(points)
    formula = np.stack([comb(degree, k) * (1 - u) ** (degree - k) * u**k for k in range(degree + 1)], axis=1)
    np.testing.assert_allclose(bernstein(degree, u), formula, atol=1e-14)
    np.testing.assert_allclose(curve(u), formula @ points, atol=1e-13)
    for v in (0.0, 0.3, 1.0, 1.2):
        levels = de_casteljau(points, v)
        assert [len(level) for level in levels] == list(range(degree + 1, 0, -1))
        np.testing.assert_allclose(levels[-1][0], curve(v, extrapolate=True), atol=1e-11)
    left = bezier([level[0] for level in de_casteljau(points, 0.3)])
    np.testing.assert_allclose(left(u), curve(0.3 * u), atol=1e-13)


@pytest.mark.parametrize("nu", range(5))
def test_derivatives_of_a_bezier_curve_are_bezier_curves_of_differences(nu):
    points = RNG.normal(size=(5, 2))
    curve = bezier(points, (1.0, 3.0))
    lower = curve.derivative(nu)
    assert lower.degree == 4 - nu
    scale = np.prod(np.arange(5 - nu, 5)) / 2.0**nu
    np.testing.assert_allclose(lower.control_points, scale * np.diff(points, nu, axis=0), atol=1e-12)
    np.testing.assert_allclose(lower(inside(curve)), curve(inside(curve), nu), atol=1e-12)


def test_derivative_of_any_spline():
    broken = kochanek_bartels(TIMES, VALUES, continuity=0.5)
    periodic = sm.splines.cubic_interpolant(TIMES, CLOSED, "periodic")
    for curve in (broken, periodic, catmull_rom(TIMES, VALUES)):
        for nu in range(4):
            # Not at the right end, where the periodic spline takes its value from the left one.
            t = inside(curve)[:-1]
            np.testing.assert_allclose(curve.derivative(nu)(t), curve(t, nu), atol=1e-10)
    assert not bezier(VALUES[:2]).derivative(3).control_points.any()
    with pytest.raises(sm.InputError, match="derivative order -1"):
        broken.derivative(-1)


def test_rational_quadratics_are_conics():
    corner, u = np.array([[1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]), np.linspace(0, 1, 101)
    circle = RationalQuadratic(corner, np.sqrt(0.5))
    np.testing.assert_allclose(np.linalg.norm(circle(u), axis=1), 1.0, atol=1e-15)
    assert arc_length(circle) == pytest.approx(np.pi / 2, rel=1e-13)
    for weight, kind in ((0.2, "ellipse"), (1.0, "parabola"), (3.0, "hyperbola")):
        arc = RationalQuadratic(corner, weight)
        assert arc.kind == kind
        # The discriminant of the conic through six points of the arc tells its kind.
        x, y = arc(np.linspace(0, 1, 6)).T
        _, _, vectors = np.linalg.svd(np.column_stack([x * x, x * y, y * y, x, y, np.ones(6)]))
        a, b, c = vectors[-1][:3]
        discriminant = (b * b - 4 * a * c) / (a * a + b * b + c * c)
        assert {"ellipse": discriminant < -1e-9, "parabola": abs(discriminant) < 1e-9}.get(kind, discriminant > 1e-9)
        homogeneous = arc.homogeneous(u)
        np.testing.assert_allclose(homogeneous[:, :2] / homogeneous[:, 2:], arc(u), atol=1e-15)
    parabola = RationalQuadratic(corner, 1.0)
    np.testing.assert_allclose(parabola.to_bspline()(u), parabola(u), atol=1e-15)


@pytest.mark.parametrize("nu", range(5))
def test_derivatives_of_rational_quadratics(nu):
    arc = RationalQuadratic(RNG.normal(size=(3, 2)), 2.5, (1.0, 4.0))
    t = inside(arc)[5:-5]
    scale = np.abs(arc(t, nu + 1)).max()
    np.testing.assert_allclose(arc(t, nu + 1), differences(arc, t, nu), atol=1e-7 * scale)


def test_worked_example_of_the_notes_but_for_its_misprint():
    # The notes print 5 for the 4 in row 3; with it the blending function of x(½) would not be 1 there.
    expected = [[-4, 0, -4, 4], [8, -4, 6, -4], [-5, 4, -2, 1], [1, 0, 0, 0]]
    matrix = basis_matrix(EXAMPLE)
    np.testing.assert_allclose(matrix, expected, atol=1e-13)
    np.testing.assert_allclose(matrix @ constraint_matrix(EXAMPLE), np.eye(4), atol=1e-13)
    u = np.linspace(0, 1, 21)
    blends = blending_functions(EXAMPLE)
    np.testing.assert_allclose(blends(u)[:, 1], -4 * u**2 + 4 * u, atol=1e-13)
    conditions = [blends(t, order) for t, order in EXAMPLE]
    np.testing.assert_allclose(conditions, np.eye(4), atol=1e-12)


def test_hermite_basis_matrix():
    matrix = basis_matrix([(0, 0), (1, 0), (0, 1), (1, 1)])
    np.testing.assert_allclose(matrix, [[2, -2, 1, 1], [-3, 3, -2, -1], [0, 0, 1, 0], [1, 0, 0, 0]], atol=1e-13)


def test_polynomial_segments_meet_their_constraints():
    conditions = [(0.2, 0), (0.2, 2), (1.5, 1), (2.0, 0), (-1.0, 3), (0.7, 0)]
    values = RNG.normal(size=(6, 2, 2))
    curve = polynomial_segment(conditions, values, (0.0, 3.0))
    assert curve.domain == (0.0, 3.0)
    assert curve.degree == 5
    for (t, order), value in zip(conditions, values, strict=True):
        np.testing.assert_allclose(curve(t, order, extrapolate=True), value, atol=1e-9)


def test_polynomial_segments_of_symbols():
    values = ca.SX.sym("values", 4, 2)
    curve = polynomial_segment(EXAMPLE, values)
    numbers, u = RNG.normal(size=(4, 2)), np.linspace(0, 1, 11)
    function = ca.Function("segment", [values], [curve(u), ca.jacobian(curve(0.3), values[:, 0])])
    result, slope = (np.asarray(r) for r in function(numbers))
    np.testing.assert_allclose(result, polynomial_segment(EXAMPLE, numbers)(u), atol=1e-13)
    np.testing.assert_allclose(slope[0], blending_functions(EXAMPLE)(0.3), atol=1e-13)


def test_singular_constraint_lists_show_what_they_do_not_see():
    with pytest.raises(sm.InputError, match=r"x\(0\), x'\(0.5\), x\(1\) are singular.*t − t\^2.*degree 2"):
        polynomial_segment([(0, 0), (0.5, 1), (1, 0)], [0, 1, 2])
    with pytest.raises(sm.InputError, match="singular: all of them are zero for the polynomial 1,"):
        basis_matrix([(0, 1), (1, 1)])
    with pytest.raises(sm.InputError, match=r"constraints 3: pairs \(parameter, derivative order\) are needed"):
        basis_matrix(cast(Any, 3))
    with pytest.raises(sm.InputError, match=r"constraint 1, \(0, 0\), repeats constraint 0"):
        basis_matrix([(0, 0), (0, 0)])
    with pytest.raises(sm.InputError, match="constraint 1, 3: a pair"):
        basis_matrix([(0, 0), 3])  # pyright: ignore[reportArgumentType]
    with pytest.raises(sm.InputError, match=r"constraint 0.*order 0, 1, 2"):
        basis_matrix([(0, -1), (1, 0)])
    with pytest.raises(sm.InputError, match="one row each"):
        polynomial_segment(EXAMPLE, [0.0, 1.0])
    with pytest.raises(sm.InputError, match="must be finite"):
        polynomial_segment(EXAMPLE, [0.0, 1.0, np.nan, 0.0])
    with pytest.raises(sm.InputError, match="at least 2"):
        polynomial_segment([(0, 0)], [0.0])


def test_hermite_splines_agree_with_scipy_and_with_the_basis_of_the_notes():
    slopes = RNG.normal(size=VALUES.shape)
    curve = hermite_spline(TIMES, VALUES, slopes)
    t = inside(curve)
    for nu in range(4):
        np.testing.assert_allclose(curve(t, nu), CubicHermiteSpline(TIMES, VALUES, slopes)(t, nu), atol=1e-9)
    # The notes print −2u³ − 3u² for the second function, which would not be 1 at u = 1.
    u, h = np.linspace(0, 1, 11)[:, None], TIMES[1] - TIMES[0]
    basis = (2 * u**3 - 3 * u**2 + 1, -2 * u**3 + 3 * u**2, h * (u**3 - 2 * u**2 + u), h * (u**3 - u**2))
    given = (VALUES[0], VALUES[1], slopes[0], slopes[1])
    expected = sum(b * g for b, g in zip(basis, given, strict=True))
    np.testing.assert_allclose(curve(TIMES[0] + h * u[:, 0]), expected, atol=1e-13)


@pytest.mark.parametrize("periodic", [False, True])
def test_broken_tangents_have_a_slope_on_each_side(periodic):
    left, values = RNG.normal(size=VALUES.shape), CLOSED if periodic else VALUES
    right = left.copy()
    right[[2, 4]] = RNG.normal(size=(2, 2))
    left[-1], right[-1] = left[0], right[0]
    if periodic:
        right[[0, -1]] = RNG.normal(size=2)
    curve = hermite_spline(TIMES, values, left, right, periodic=periodic)
    np.testing.assert_allclose(curve(TIMES), values, atol=1e-13)
    np.testing.assert_allclose(curve(TIMES[:-1], 1), right[:-1], atol=1e-12)
    np.testing.assert_allclose(curve(np.nextafter(TIMES[1:], 0), 1), left[1:], atol=1e-11)
    package = splines.CubicHermite(values, np.stack([right[:-1], left[1:]], axis=1).reshape(-1, 2), list(TIMES))
    t = inside(curve)
    np.testing.assert_allclose(curve(t), package.evaluate(t), atol=1e-13)
    np.testing.assert_allclose(curve.clamped()(t), curve(t), atol=1e-13)
    if periodic:
        period = TIMES[-1] - TIMES[0]
        np.testing.assert_allclose(curve(t[1:-1] + period, extrapolate=True), curve(t[1:-1]), atol=1e-12)


@pytest.mark.parametrize("ends", ["natural", "clamped", "periodic"])
def test_catmull_rom_and_kochanek_bartels_agree_with_the_splines_package(ends):
    values = CLOSED if ends == "periodic" else VALUES
    slopes = RNG.normal(size=(2, 2)) if ends == "clamped" else None
    tcb = RNG.uniform(-1, 1, size=(7, 3))
    if ends == "periodic":
        tcb[-1], points, conditions, theirs = tcb[0], values[:-1], "closed", tcb[:-1]
    else:
        tcb[[0, -1]] = 0
        points, conditions, theirs = values, ends if slopes is None else tuple(slopes.tolist()), tcb[1:-1]
    t = np.linspace(TIMES[0], TIMES[-1], 101)
    package = splines.CatmullRom(points, list(TIMES), endconditions=conditions)
    np.testing.assert_allclose(catmull_rom(TIMES, values, ends, slopes)(t), package.evaluate(t), atol=1e-13)
    package = splines.KochanekBartels(points, list(TIMES), tcb=theirs, endconditions=conditions)
    ours = kochanek_bartels(TIMES, values, *tcb.T, ends=ends, end_slopes=slopes)
    np.testing.assert_allclose(ours(t), package.evaluate(t), atol=1e-13)


def test_catmull_rom_slopes_are_those_of_the_specification():
    curve = catmull_rom(TIMES, VALUES)
    h, chords = np.diff(TIMES), np.diff(VALUES, axis=0) / np.diff(TIMES)[:, None]
    share = (h[:-1] / (h[:-1] + h[1:]))[:, None]
    np.testing.assert_allclose(curve(TIMES[1:-1], 1), share * chords[1:] + (1 - share) * chords[:-1], atol=1e-12)
    (t0, t1, t2), (y0, y1, y2) = TIMES[:3], VALUES[:3]
    start = (t2 - t0) / (t2 - t1) * (y1 - y0) / (t1 - t0) - (t1 - t0) / (t2 - t1) * (y2 - y0) / (t2 - t0)
    np.testing.assert_allclose(curve(TIMES[0], 1), start, atol=1e-12)
    mirrored = catmull_rom(-TIMES[::-1], VALUES[::-1])
    np.testing.assert_allclose(mirrored(-TIMES[-1], 1), -curve(TIMES[-1], 1), atol=1e-12)
    parabola = 1 - 2 * TIMES + 0.5 * TIMES**2
    t = inside(curve)
    # The notes print differences of quotients instead of products: parabolas would not come out.
    np.testing.assert_allclose(catmull_rom(TIMES, parabola)(t), 1 - 2 * t + 0.5 * t**2, atol=1e-12)


def test_bias_of_the_notes_is_ours_with_the_sign_turned():
    times, values = np.arange(4.0), VALUES[:4]
    b = 0.4
    curve = kochanek_bartels(times, values, bias=[0, b, 0, 0])
    incoming, outgoing = np.diff(values, axis=0)[:2]
    np.testing.assert_allclose(curve(1.0, 1), ((1 + b) * incoming + (1 - b) * outgoing) / 2, atol=1e-13)
    notes = kochanek_bartels(times, values, bias=[0, -b, 0, 0])(1.0, 1)
    np.testing.assert_allclose(notes, ((1 - b) * incoming + (1 + b) * outgoing) / 2, atol=1e-13)


def test_tension_and_continuity_of_the_notes():
    times, values = np.arange(4.0), VALUES[:4]
    incoming, outgoing = np.diff(values, axis=0)[:2]
    tense = kochanek_bartels(times, values, tension=0.3)
    np.testing.assert_allclose(tense(1.0, 1), 0.7 * (values[2] - values[0]) / 2, atol=1e-13)
    np.testing.assert_allclose(tense(0.0, 1), 0.7 * catmull_rom(times, values)(0.0, 1), atol=1e-13)
    c = 0.6
    torn = kochanek_bartels(times, values, continuity=c)
    before, after = torn(np.nextafter(1.0, 0), 1), torn(1.0, 1)
    np.testing.assert_allclose(before, ((1 - c) * incoming + (1 + c) * outgoing) / 2, atol=1e-12)
    np.testing.assert_allclose(after, ((1 + c) * incoming + (1 - c) * outgoing) / 2, atol=1e-12)


def test_two_keys_give_a_line_and_scalars_stay_scalars():
    line = catmull_rom([0.0, 2.0], [1.0, 5.0], "natural")
    np.testing.assert_allclose(line(inside(line)), 1 + 2 * inside(line), atol=1e-14)
    assert line(0.5).shape == ()
    assert speed(line, np.zeros((2, 3))).shape == (2, 3)


BAD_KEYS = {
    "repeat": (lambda: catmull_rom([0, 1, 1, 2], np.zeros(4)), "the time of key 2, 1, repeats that of key 1"),
    "decrease": (lambda: hermite_spline([0, 2, 1], np.zeros(3), np.zeros(3)), "comes before"),
    "few": (lambda: catmull_rom([0, 1], np.zeros(2)), "2 keys: at least 3 are needed for second-order ends"),
    "one": (lambda: hermite_spline([0], [0], [0]), "1 key: at least 2"),
    "values": (lambda: catmull_rom([0, 1, 2], np.zeros(4)), r"values of shape \(4,\) for 3 times"),
    "nan": (lambda: catmull_rom([0, 1, 2], [0, np.nan, 1]), "the value of key 1 is not finite"),
    "slopes": (lambda: hermite_spline([0, 1], [0, 1], [0]), r"slopes of shape \(1,\)"),
    "slope": (lambda: hermite_spline([0, 1], [0, 1], [0, np.inf]), "slopes: number 1 is not finite"),
    "ends": (lambda: catmull_rom([0, 1, 2], np.zeros(3), "free"), "'free' is unknown; there are second-order"),
    "clamped": (lambda: catmull_rom([0, 1, 2], np.zeros(3), "clamped"), "clamped ends need them"),
    "closed": (lambda: catmull_rom([0, 1, 2], [0, 1, 2], "periodic"), "last key's value equal to the first"),
    "turns": (lambda: hermite_spline([0, 1, 2], [0, 1, 0], [0, 0, 1], periodic=True), "last of the slopes equal"),
    "tension": (lambda: kochanek_bartels([0, 1, 2], np.zeros(3), tension=1.5), "at key 0 .*turn back at the key"),
    "continuity": (lambda: kochanek_bartels([0, 1, 2], np.zeros(3), continuity=[0, -2, 0]), "-2 at key 1 .*one neigh"),
    "bias": (lambda: kochanek_bartels([0, 1, 2], np.zeros(3), bias=[0, np.nan, 0]), "bias nan at key 1 .*incoming"),
    "end": (lambda: kochanek_bartels([0, 1, 2], np.zeros(3), bias=[0, 0, 0.5]), "0.5 at key 2, an end.*give 0"),
    "shape": (lambda: kochanek_bartels([0, 1, 2], np.zeros(3), bias=[0, 0]), "one for each of the 3 keys"),
    "circle": (
        lambda: kochanek_bartels([0, 1, 2, 3], [0, 1, 1, 0], bias=[0.5, 0, 0, 0], ends="periodic"),
        "the last key is the first one",
    ),
}


@pytest.mark.parametrize(("make", "message"), BAD_KEYS.values(), ids=BAD_KEYS)
def test_bad_keys(make, message):
    with pytest.raises(sm.InputError, match=message):
        make()


def test_bad_points_weights_and_domains():
    with pytest.raises(sm.InputError, match="at least 2 control points"):
        bezier([[0, 0]])
    with pytest.raises(sm.InputError, match="control point 1 is not finite"):
        bezier([[0, 0], [np.nan, 0]])
    with pytest.raises(sm.InputError, match="one row per point"):
        bezier([])
    with pytest.raises(sm.InputError, match="the first before the second"):
        bezier([0, 1], (1.0, 1.0))
    with pytest.raises(sm.InputError, match="one finite number"):
        de_casteljau([0, 1], np.inf)
    with pytest.raises(sm.InputError, match="3 control points, not 2"):
        RationalQuadratic(np.zeros((2, 2)), 1.0)
    with pytest.raises(sm.InputError, match=r"weight -1.0: must be above −1"):
        RationalQuadratic(np.zeros((3, 2)), -1.0)
    arc = RationalQuadratic(np.zeros((3, 2)), 2.0)
    with pytest.raises(sm.InputError, match=r"a hyperbola is no polynomial spline: take .homogeneous"):
        arc.to_bspline()
    with pytest.raises(sm.InputError, match="derivative order -1"):
        arc(0.5, -1)
    for curve in (arc, bezier([0, 1]), constant_speed(bezier([0, 1]))):
        with pytest.raises(sm.InputError, match=r"1.5 is outside the domain \[0, 1\]"):
            curve(1.5)


INNER = {"simple": [0.2, 0.5, 0.6], "double": [0.5, 0.5, 0.6], "broken": [0.5, 0.5, 0.5, 0.8], "none": []}


def with_ends(inner, degree, clamped):
    """A knot vector over [0, 1] with these inner knots, at most `degree` copies of each."""
    kept = [k for i, k in enumerate(inner) if inner[:i].count(k) < degree]
    steps = np.arange(degree + 1) * (0.0 if clamped else 0.1)
    return np.concatenate([-steps[::-1], kept, 1 + steps])


@pytest.mark.parametrize("clamped", [True, False])
@pytest.mark.parametrize("inner", INNER.values(), ids=INNER)
@pytest.mark.parametrize("degree", [1, 2, 3, 5])
def test_symbolic_b_splines_agree_with_scipy(inner, degree, clamped):
    knots = with_ends(inner, degree, clamped)
    controls = RNG.normal(size=(len(knots) - degree - 1, 2))
    k, c, t = ca.SX.sym("k", len(knots)), ca.SX.sym("c", *controls.shape), ca.SX.sym("t", 25)
    curve = SymbolicSpline(k, c, degree)
    times = np.linspace(knots[degree], knots[-degree - 1], 25)
    for nu in range(degree + 2):
        value = np.asarray(ca.Function("value", [t, k, c], [curve(t, nu)])(times, knots, controls))
        expected = sm.splines.Spline(sm.splines.BSplineBasis(knots, degree), controls)(times, nu)
        np.testing.assert_allclose(value, expected, atol=1e-9 * max(1, np.abs(expected).max()))
        if nu <= degree:
            np.testing.assert_allclose(expected, BSpline(knots, controls, degree)(times, nu), atol=1e-9)


def test_symbolic_b_splines_are_differentiable_in_knots_and_controls():
    knots, controls = np.array([0, 0, 0, 0, 0.3, 0.7, 1, 1, 1, 1]), RNG.normal(size=(6, 1))
    k, c = ca.SX.sym("k", 10), ca.SX.sym("c", 6)
    times = np.array([0.1, 0.45, 0.8])
    curve = SymbolicSpline(k, c, 3)(times)
    by_knots, by_controls = ca.Function("slopes", [k, c], [ca.jacobian(curve, k), ca.jacobian(curve, c)])(
        knots, controls
    )
    np.testing.assert_allclose(by_controls, sm.splines.BSplineBasis(knots, 3)(times), atol=1e-14)
    assert np.isfinite(np.asarray(by_knots)).all()
    for j in (4, 5):
        step = 1e-6 * np.eye(10)[j]
        there, back = (sm.splines.Spline(sm.splines.BSplineBasis(knots + s, 3), controls)(times) for s in (step, -step))
        np.testing.assert_allclose(np.asarray(by_knots)[:, [j]], (there - back) / 2e-6, atol=1e-8)


def test_symbolic_b_splines_beyond_their_domain_and_as_numbers():
    knots, controls = np.array([0, 0, 0, 0, 0.4, 1, 1, 1, 1]), RNG.normal(size=(5, 2))
    numeric = sm.splines.Spline(sm.splines.BSplineBasis(knots, 3), controls)
    curve = SymbolicSpline(knots, controls, 3)
    t = ca.MX.sym("t")
    assert np.isnan(np.asarray(ca.Function("value", [t], [curve(t)])(1.2))).all()
    beyond = np.asarray(ca.Function("value", [t], [curve(t, 1, extrapolate=True)])(1.2)).ravel()
    np.testing.assert_allclose(beyond, numeric(1.2, 1, extrapolate=True), atol=1e-12)
    assert curve.domain == (0.0, 1.0)
    np.testing.assert_allclose(curve.to_bspline()(0.3), numeric(0.3), atol=1e-15)
    with pytest.raises(sm.InputError, match=r"1.2 is outside"):
        curve(1.2)
    with pytest.raises(sm.InputError, match="the symbols a have no values yet"):
        SymbolicSpline(knots, ca.SX.sym("a") * ca.DM(controls), 3).to_bspline()
    with pytest.raises(sm.InputError, match="5 are needed"):
        SymbolicSpline(ca.SX.sym("k", 9), controls[:4], 3)
    with pytest.raises(sm.InputError, match="knots decrease"):
        SymbolicSpline([0, 0, 1, 0.5, 2, 2], np.zeros((3, 1)), 2)
    with pytest.raises(sm.InputError, match="too few for degree 3"):
        SymbolicSpline(ca.SX.sym("k", 6), ca.SX.sym("c", 2), 3)(0.5)


CURVES = {
    "Bézier": bezier(RNG.normal(size=(5, 3)), (1.0, 2.5)),
    "conic": RationalQuadratic(np.array([[0.0, 0], [2, 3], [4, 0]]), 2.0),
    "Catmull–Rom": catmull_rom(TIMES, VALUES),
    "broken": kochanek_bartels(TIMES, VALUES, continuity=-0.7, tension=0.3),
    "periodic": sm.splines.cubic_interpolant(TIMES, CLOSED, "periodic"),
}


@pytest.mark.parametrize("curve", CURVES.values(), ids=CURVES)
def test_arc_length_and_constant_speed(curve):
    polyline = curve(np.union1d(inside(curve, 20001), curve.breakpoints))
    length = arc_length(curve)
    assert length == pytest.approx(np.linalg.norm(np.diff(polyline, axis=0), axis=1).sum(), rel=1e-7)
    a, b = curve.domain
    assert arc_length(curve, a, 0.3 * a + 0.7 * b) + arc_length(curve, 0.3 * a + 0.7 * b) == pytest.approx(length)
    even = constant_speed(curve)
    assert even.domain == pytest.approx((0, length), rel=1e-14)
    for s in (0.0, 0.2 * length, 0.77 * length, length):
        assert arc_length(curve, a, float(even.warp(s))) == pytest.approx(s, abs=1e-12 * length)
    t = inside(even)
    np.testing.assert_allclose(speed(even, t), 1.0, atol=1e-12)
    np.testing.assert_allclose(speed(constant_speed(curve, (2.0, 4.0)), [2.0, 3.3]), length / 2, rtol=1e-12)
    with pytest.raises(sm.InputError, match="no polynomial spline"):
        even.to_bspline()


@pytest.mark.parametrize("nu", range(4))
def test_derivatives_of_retimed_curves(nu):
    curve = bezier([[0, 0, 0], [1, 2, 0], [3, 1, 1], [4, 0, 0.5]])
    length = arc_length(curve)
    for timed in (constant_speed(curve), Retimed(constant_speed(curve), slow_in_out(0.3, 0.2, (0, 3), (0, length)))):
        a, b = timed.domain
        t = a + (b - a) * np.array([0.15, 0.4, 0.52, 0.65, 0.9])
        expected = differences(timed, t, nu)
        np.testing.assert_allclose(timed(t, nu + 1), expected, atol=1e-6 * max(1, np.abs(expected).max()))


def test_a_curve_that_stops_keeps_its_path():
    stops = bezier([[0, 0], [0, 0], [1, 1], [2, 0], [2, 0]])
    even = constant_speed(stops)
    s = inside(even, 9)
    np.testing.assert_allclose([arc_length(stops, 0, float(even.warp(v))) for v in s], s, atol=1e-12)
    np.testing.assert_allclose(even([0.0, even.domain[1]], 1), np.array([[1, 1], [1, -1]]) / np.sqrt(2), rtol=1e-14)
    np.testing.assert_allclose(speed(even, s[1:-1]), 1.0, atol=1e-10)


def test_retimed_splines_are_splines():
    curve, warp = catmull_rom(TIMES, VALUES), slow_in_out(0.2, 0.4, (0.0, 5.0), (TIMES[0], TIMES[-1]))
    timed = Retimed(curve, warp)
    spline = timed.to_bspline()
    assert spline.degree == 6
    t = inside(timed)[1:-1]
    np.testing.assert_allclose(timed(t), curve(warp(t)), atol=1e-13)
    for nu in range(3):
        np.testing.assert_allclose(spline(t, nu), timed(t, nu), atol=1e-9)
    # Slow at both ends, and the path unchanged: its length stays.
    assert np.abs(timed([0.0, 5.0], 1)).max() < 1e-12
    assert arc_length(timed) == pytest.approx(arc_length(curve), rel=1e-12)


@pytest.mark.parametrize(("slow_in", "slow_out"), [(0, 0), (0.3, 0.2), (0.5, 0.5), (1, 0), (0, 1), (0.4, 0)])
def test_slow_in_out_is_parabola_line_parabola(slow_in, slow_out):
    warp = slow_in_out(slow_in, slow_out, (1.0, 3.0), (-1.0, 4.0))
    np.testing.assert_allclose(warp([1.0, 3.0]), [-1, 4], atol=1e-13)
    cruise = 5 / (2 * (1 - (slow_in + slow_out) / 2))
    u = np.linspace(0, 1, 41)
    pace = np.minimum(1, np.minimum(u / slow_in if slow_in else 1, (1 - u) / slow_out if slow_out else 1))
    np.testing.assert_allclose(warp(1 + 2 * u, 1), cruise * pace, atol=1e-12)


@pytest.mark.parametrize("order", range(4))
def test_smooth_step_is_flat_at_both_ends(order):
    warp = smooth_step(order, (0.0, 2.0))
    np.testing.assert_allclose(warp([0.0, 1.0, 2.0]), [0, 0.5, 1], atol=1e-14)
    for nu in range(1, order + 1):
        assert np.abs(warp([0.0, 2.0], nu)).max() < 1e-12
    assert abs(warp(0.0, order + 1)) > 0.1


def test_bad_timing():
    curve = bezier([[0, 0], [1, 1]])
    with pytest.raises(sm.InputError, match="no length"):
        constant_speed(bezier([[1, 1], [1, 1]]))
    with pytest.raises(sm.InputError, match=r"arc length from 0.5 to 0.2"):
        arc_length(curve, 0.5, 0.2)
    with pytest.raises(sm.InputError, match="shares ≥ 0 with a sum of at most 1"):
        slow_in_out(0.7, 0.5)
    with pytest.raises(sm.InputError, match="the two values"):
        slow_in_out(values=(0.0, np.nan))
    with pytest.raises(sm.InputError, match=r"order 1.5"):
        smooth_step(1.5)  # pyright: ignore[reportArgumentType]
    with pytest.raises(sm.InputError, match="from 0 to 2, which is not in the curve's domain"):
        Retimed(curve, bezier([0.0, 2.0]))
    with pytest.raises(sm.InputError, match="curve of scalars"):
        Retimed(curve, curve)
    with pytest.raises(sm.InputError, match="derivative order -1"):
        Retimed(curve, smooth_step())(0.5, -1)
    with pytest.raises(sm.InputError, match="first before the second"):
        ArcParameter(curve, (1.0, 0.0))


def test_c2_cubics_close_or_rest_as_scipy_says():
    t = np.linspace(TIMES[0], TIMES[-1], 101)
    natural = hermite_spline(TIMES, VALUES, sm.splines.cubic_interpolant(TIMES, VALUES)(TIMES, 1))
    np.testing.assert_allclose(natural(t), CubicSpline(TIMES, VALUES, bc_type="natural")(t), atol=1e-12)
    # Equal steps: `splines` 0.3.3 takes the second step for the first in its start condition.
    even = np.arange(7.0)
    t = np.linspace(0, 6, 101)
    package = splines.Natural(VALUES, list(even)).evaluate(t)
    np.testing.assert_allclose(sm.splines.cubic_interpolant(even, VALUES)(t), package, atol=1e-13)
