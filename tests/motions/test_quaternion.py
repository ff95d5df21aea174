"""Quaternion algebra, quaternion curves and their rates, baselines, poses."""

from functools import partial
from typing import Literal

import numpy as np
import pytest
import splines.quaternion as recursive
from scipy.spatial.transform import Rotation, RotationSpline, Slerp
from turns import AXIS, units

import symmotion as sm
from symmotion.motions.interpolants.slerps import shoemake_bezier, shoemake_interpolant, slerp, slerp_curve, squad
from symmotion.motions.pose import PoseMotion
from symmotion.motions.quaternions import algebra as qa
from symmotion.motions.quaternions.curve import QuaternionMotion, from_rotations
from symmotion.motions.quaternions.interpolation import interpolate_quaternions
from symmotion.splines.cumulative import cumulative

BASES = {
    "Bézier 5": sm.splines.BSplineBasis.clamped([0.0, 2.0], 5),
    "cubic, uniform": sm.splines.BSplineBasis(np.arange(12.0), 3),
    "cubic, clamped": sm.splines.BSplineBasis.clamped([0.0, 0.3, 1.0, 2.5, 2.6, 4.0], 3),
    "quadratic": sm.splines.BSplineBasis.clamped([0.0, 0.5, 1.5, 2.0], 2),
    "quintic": sm.splines.BSplineBasis.clamped([0.0, 0.5, 1.5, 2.0], 5),
    "closed": sm.splines.BSplineBasis.closed([0.0, 1.0, 1.7, 2.5, 4.0, 5.0], 3),
}


def inside(basis, count=101):
    """Times off the knots, with room for differences."""
    rng = np.random.default_rng(1)
    breaks = basis.breakpoints
    span = rng.integers(0, len(breaks) - 1, count)
    return breaks[span] + np.diff(breaks)[span] * rng.uniform(0.05, 0.95, count)


def test_product_exp_and_rotate_agree_with_scipy():
    p, q, v = units(20, 1), units(20, 2), np.random.default_rng(3).normal(size=(20, 3))
    a, b = qa.to_rotation(p), qa.to_rotation(q)
    np.testing.assert_allclose(qa.to_rotation(qa.product(p, q)).as_matrix(), (a * b).as_matrix(), atol=1e-14)
    np.testing.assert_allclose(qa.rotate(p, v), a.apply(v), atol=1e-14)
    np.testing.assert_allclose(
        qa.to_rotation(qa.exp(v)).as_matrix(), Rotation.from_rotvec(2 * v).as_matrix(), atol=1e-14
    )
    np.testing.assert_allclose(
        qa.from_rotation(a) * np.sign(p[:, :1]) * np.sign(qa.from_rotation(a)[:, :1]), p, atol=1e-14
    )
    assert qa.to_rotation(p.reshape(4, 5, 4)).as_quat().shape == (20, 4)


@pytest.mark.parametrize("size", [0.0, 1e-300, 1e-12, 1e-5, 0.3, 2.0, 3.1])
def test_log_inverts_exp_at_every_size(size):
    v = size * AXIS
    np.testing.assert_allclose(qa.log(qa.exp(v)), v, rtol=1e-13, atol=0)
    assert np.linalg.norm(qa.log([-1.0, 0.0, 0.0, 0.0])) == pytest.approx(np.pi)


@pytest.mark.parametrize("size", [0.0, 1e-4, 1e-2, 1.3])
def test_right_jacobian_against_differences(size):
    v, h = size * np.array([0.6, -0.64, 0.48]), 1e-6
    back = qa.conjugate(qa.exp(v))
    columns = [
        (qa.log(qa.product(back, qa.exp(v + e))) - qa.log(qa.product(back, qa.exp(v - e)))) / (2 * h)
        for e in h * np.eye(3)
    ]
    np.testing.assert_allclose(qa.right_jacobian(v), np.transpose(columns), atol=1e-9)


@pytest.mark.parametrize("basis", BASES.values(), ids=BASES)
def test_cumulative_functions_are_sums_of_b_splines(basis):
    t = inside(basis)
    span, derivatives = cumulative(basis, t, 3)
    np.testing.assert_array_equal(span, basis.spans(t))
    for nu, values in enumerate(derivatives):
        _, plain = basis.local(t, nu)
        expected = np.cumsum(plain[:, ::-1], axis=1)[:, ::-1][:, 1:]
        np.testing.assert_allclose(np.stack(values, axis=1), expected, atol=1e-11 * max(1, np.abs(expected).max()))


@pytest.mark.parametrize("basis", BASES.values(), ids=BASES)
def test_rates_against_differences_and_the_product_formula(basis):
    motion, t, h = QuaternionMotion(basis, units(basis.n, 5)), inside(basis), 1e-4
    np.testing.assert_allclose(np.linalg.norm(motion(t), axis=1), 1.0, atol=1e-14)
    # 2 q⁻¹ q̇ by a difference of sixth order: exact to 1e-8 of its size.
    weights = np.array([-1, 9, -45, 0, 45, -9, 1]) / 60

    def slope(function):
        return sum(w * function(t + k * h) for w, k in zip(weights, range(-3, 4), strict=True)) / h

    frames: tuple[Literal["body", "world"], ...] = ("body", "world")
    for frame in frames:
        jet = motion.jet(t, 3, frame)
        dq = slope(motion)
        body = qa.product(qa.conjugate(motion(t)), dq) if frame == "body" else qa.product(dq, qa.conjugate(motion(t)))
        assert np.abs(2 * body[:, 1:] - jet.rate).max() < 1e-8 * np.abs(jet.rate).max()
        acceleration = slope(partial(motion.rate, frame=frame))
        assert np.abs(acceleration - jet.acceleration).max() < 1e-8 * np.abs(jet.acceleration).max()
        jerk = slope(partial(motion.acceleration, frame=frame))
        assert np.abs(jerk - jet.jerk).max() < 1e-8 * np.abs(jet.jerk).max()
    for nu in (1, 2, 3):
        expected = slope(lambda s, n=nu: motion(s, n - 1))
        assert np.abs(expected - motion(t, nu)).max() < 1e-8 * np.abs(expected).max()


def test_shapes_and_large_arrays_in_chunks():
    motion = QuaternionMotion(BASES["cubic, clamped"], units(8))
    t = np.linspace(0, 4, 10000).reshape(100, 100)
    assert motion(t).shape == (100, 100, 4)
    assert motion.rate(t).shape == (100, 100, 3)
    assert motion(1.0).shape == (4,)
    np.testing.assert_array_equal(motion(t)[47, 3], motion(t[47, 3]))
    assert motion.rotation(t[0]).as_quat().shape == (100, 4)
    assert repr(motion) == "QuaternionMotion(degree 3, 8 control quaternions, times 0 to 4)"


def test_a_control_quaternion_moves_the_curve_on_its_own_spans_only():
    basis = sm.splines.BSplineBasis.clamped(np.arange(11.0), 3)
    motion = QuaternionMotion(basis, units(basis.n, 2, angle=0.7))
    j, t = 6, np.linspace(0, 10, 1001)
    moved = motion.with_control(j, qa.product(motion.control_points[j], qa.exp(0.2 * AXIS)))
    change = np.linalg.norm(moved(t) - motion(t), axis=1)
    support = (t > basis.knots[j]) & (t < basis.knots[j + 4])
    assert change[~support].max() < 1e-14
    assert change[support].min() > 0


@pytest.mark.parametrize("degree", [2, 3, 4, 5])
def test_continuity_at_simple_knots(degree):
    basis = sm.splines.BSplineBasis.clamped([0.0, 0.4, 1.0, 2.0, 2.2], degree)
    motion = QuaternionMotion(basis, units(basis.n, 4, angle=1.0))
    knots, h = basis.breakpoints[1:-1], 1e-9
    for order in range(1, 4):
        jump = np.abs(motion.jet(knots + h, order)[order] - motion.jet(knots - h, order)[order]).max()
        scale = np.abs(motion.jet(knots, order)[order]).max()
        assert jump < 1e-5 * scale if order <= degree - 1 else jump > 1e-2 * scale


def test_about_one_axis_the_curve_is_the_scalar_spline():
    basis = BASES["cubic, clamped"]
    heights = np.random.default_rng(0).uniform(-1, 1, basis.n).cumsum()
    motion = QuaternionMotion(basis, qa.exp(heights[:, None] / 2 * AXIS))
    spline, t = sm.splines.Spline(basis, heights), np.linspace(0, 4, 333)
    for nu, rate in ((1, motion.rate), (2, motion.acceleration), (3, motion.jerk)):
        np.testing.assert_allclose(rate(t), spline(t, nu)[:, None] * AXIS, atol=1e-10)
        np.testing.assert_allclose(rate(t, frame="world"), spline(t, nu)[:, None] * AXIS, atol=1e-10)


def test_bezier_interpolates_its_ends_and_starts_along_its_first_edge():
    q = units(5, 7, angle=1.2)
    motion = QuaternionMotion.bezier(q)
    np.testing.assert_allclose(motion([0.0, 1.0]), motion.control_points[[0, -1]], atol=1e-15)
    np.testing.assert_allclose(motion.rate(0.0), 4 * 2 * qa.log(qa.product(qa.conjugate(q[0]), q[1])), atol=1e-13)
    line = QuaternionMotion.bezier(q[:2])
    np.testing.assert_allclose(line(0.3), slerp(q[0], q[1], 0.3), atol=1e-15)


@pytest.mark.parametrize("turns", [0, 1, -2, 3])
@pytest.mark.parametrize("frame", ["body", "world"])
def test_hermite_has_its_ends_and_rates_with_any_number_of_turns(turns, frame):
    a, b = units(2, 3)
    rates = np.array([[1.0, -2.0, 0.5], [0.3, 4.0, 12.0]])
    motion = QuaternionMotion.hermite(a, b, *rates, turns=turns, span=(2.0, 3.5), frame=frame)
    ends = motion.jet([2.0, 3.5], 1, frame)
    np.testing.assert_allclose(ends.rate, rates, atol=1e-12)
    np.testing.assert_allclose(np.abs(np.sum(ends.quaternion * [a, b], axis=1)), 1.0, atol=1e-14)
    flips = np.sign(ends.quaternion[1] @ QuaternionMotion.hermite(a, b, *rates, span=(2.0, 3.5), frame=frame)(3.5))
    assert flips == (-1) ** turns


def test_scipy_agrees_on_slerp_and_on_rates():
    q = units(6, 8, angle=0.9)
    t = np.array([0.0, 0.5, 1.5, 2.0, 3.0, 4.0])
    reference = RotationSpline(t, qa.to_rotation(q))
    x = np.linspace(0, 4, 57)
    # The same rotations through a curve of ours, as a check of frames and units: SciPy's rates are in the body frame.
    dense = np.linspace(0, 4, 401)
    ours = interpolate_quaternions(dense, reference(dense), "clamped", reference(dense[[0, -1]], 1))
    assert np.abs(ours.rate(x) - reference(x, 1)).max() < 1e-5
    assert (ours.rotation(x).inv() * reference(x)).magnitude().max() < 1e-7
    turn = (qa.to_rotation(slerp_curve(t, q)(x)).inv() * Slerp(t, qa.to_rotation(q))(x)).magnitude()
    assert turn.max() < 1e-7


@pytest.mark.parametrize("make", [squad, shoemake_interpolant])
def test_baselines_interpolate_with_continuous_rate(make):
    t, q = np.arange(7.0), units(7, 9, angle=1.1)
    curve = make(t, q)
    np.testing.assert_allclose(np.abs(np.sum(curve(t) * q, axis=1)), 1.0, atol=1e-14)
    before, after = curve.jet(t[1:-1] - 1e-9), curve.jet(t[1:-1])
    np.testing.assert_allclose(before.rate, after.rate, atol=1e-6)
    assert np.abs(before.acceleration - after.acceleration).max() > 1e-2  # "no C²", KKS 6.1
    x, h = np.linspace(0.1, 5.9, 50) + 1e-3, 1e-5
    for nu in (1, 2):
        expected = (curve(x + h, nu - 1) - curve(x - h, nu - 1)) / (2 * h)
        np.testing.assert_allclose(curve(x, nu), expected, atol=1e-7)
    world = curve.jet(x, 2, "world")
    np.testing.assert_allclose(world.rate, qa.rotate(curve(x), curve.jet(x).rate), atol=1e-13)


def package(q):
    """Quaternions of the package `splines`."""
    return [recursive.UnitQuaternion.from_unit_xyzw(np.roll(row, -1)) for row in q]


@pytest.mark.parametrize(
    ("make", "other"), [(squad, recursive.Squad), (sm.interpolants.barry_goldman, recursive.BarryGoldman)]
)
def test_squad_and_barry_goldman_at_uneven_times_are_those_of_another_package(make, other):
    q, t = qa.aligned(units(8, 9, angle=1.1)), np.array([0.0, 0.6, 1.3, 2.0, 3.5, 4.4, 6.0, 6.3])
    curve = make(t, q)
    # Theirs is closed: between the second keyframe and the last but one it has the same neighbours.
    theirs = other(package(q), np.append(t, 7.0))
    x = np.linspace(t[1], t[-2], 40)
    expected = np.array([[p.scalar, *p.vector] for p in (theirs.evaluate(s) for s in x)])
    np.testing.assert_allclose(np.abs(np.sum(curve(x) * expected, axis=1)), 1.0, atol=1e-12)
    before, behind = curve.jet(np.nextafter(t[1:-1], 0)), curve.jet(t[1:-1])
    np.testing.assert_allclose(before.rate, behind.rate, atol=1e-9)
    assert np.abs(before.acceleration - behind.acceleration).max() > 0.1


def test_barry_goldman_about_one_axis_is_the_catmull_rom_spline():
    heights, t = np.array([0.0, 1.1, 0.4, 2.0, 1.5]), np.array([0.0, 0.6, 1.3, 2.0, 3.5])
    curve, scalar = (
        sm.interpolants.barry_goldman(t, qa.exp(heights[:, None] / 2 * AXIS)),
        sm.curves.catmull_rom(t, heights),
    )
    x = np.linspace(t[1], t[-2], 60)
    np.testing.assert_allclose(curve.jet(x).rate, scalar(x, 1)[:, None] * AXIS, atol=1e-11)
    np.testing.assert_allclose(
        curve.jet(t[[0, -1]]).rate, (np.diff(heights) / np.diff(t))[[0, -1], None] * AXIS, atol=1e-11
    )


@pytest.mark.parametrize("name", ["quadratic", "cubic, clamped", "cubic, uniform", "quintic"])
def test_b_splines_by_slerps_lose_a_derivative(name):
    basis = BASES[name]
    heights = np.random.default_rng(1).uniform(-1, 1, basis.n)
    curve = sm.interpolants.slerp_bspline(basis, qa.exp(heights[:, None] / 2 * AXIS))
    t = inside(basis)
    scalar = sm.splines.Spline(basis, heights)
    np.testing.assert_allclose(curve.jet(t).rate, scalar(t, 1)[:, None] * AXIS, atol=1e-11)
    curve, inner = sm.interpolants.slerp_bspline(basis, units(basis.n, 2, angle=1.2)), basis.breakpoints[1:-1]
    before, behind = curve.jet(np.nextafter(inner, -np.inf)), curve.jet(inner)
    np.testing.assert_allclose(before.rate, behind.rate, atol=1e-9)
    jump = np.abs(before.acceleration - behind.acceleration).max()
    assert jump > 1e-3  # KKS 1: no C² by recursive slerps, where the cumulative curve has it from degree 3 on


def test_a_b_spline_by_slerps_of_one_span_is_shoemakes_bezier():
    q, t = units(4, 1, angle=1.0), np.linspace(2, 3, 21)
    basis = sm.splines.BSplineBasis.clamped([2.0, 3.0], 3)
    np.testing.assert_allclose(
        sm.interpolants.slerp_bspline(basis, q)(t), shoemake_bezier(q, [2.0, 3.0])(t), atol=1e-14
    )


def test_shoemake_bezier_and_the_cumulative_one_agree_about_one_axis_and_differ_elsewhere():
    x = np.linspace(0, 1, 21)
    flat = qa.exp(np.array([0.0, 0.4, 0.9, 1.0])[:, None] * AXIS)
    np.testing.assert_allclose(shoemake_bezier(flat)(x), QuaternionMotion.bezier(flat)(x), atol=1e-14)
    bent = units(4, 1, angle=1.0)
    difference = np.abs(np.sum(shoemake_bezier(bent)(x) * QuaternionMotion.bezier(bent)(x), axis=1))
    assert difference[10] < 1 - 1e-4


def test_pose_is_an_orientation_and_a_translation():
    basis = BASES["cubic, clamped"]
    orientation = QuaternionMotion(basis, units(basis.n, 2, angle=0.8))
    pose = PoseMotion(orientation, sm.splines.Spline(basis, np.random.default_rng(0).normal(size=(basis.n, 3))))
    t, h, points = inside(basis), 1e-5, np.eye(3)
    np.testing.assert_allclose(pose(t).linear, orientation.rotation(t).as_matrix(), atol=1e-14)
    for nu in (1, 2):
        expected = (pose.trajectory(points, t + h, nu - 1) - pose.trajectory(points, t - h, nu - 1)) / (2 * h)
        found = pose.trajectory(points, t, nu)
        np.testing.assert_allclose(found, expected, atol=1e-6 * np.abs(found).max())
    with pytest.raises(sm.InputError, match="0 to 2"):
        pose(t, 3)
    with pytest.raises(sm.InputError, match="body points"):
        pose.trajectory([[1.0, 2.0]], t)
    with pytest.raises(sm.InputError, match="the same domain"):
        PoseMotion(orientation, sm.splines.Spline(sm.splines.BSplineBasis.clamped([0.0, 1.0], 3), np.zeros((4, 3))))
    with pytest.raises(sm.InputError, match=r"\(n, 3\) is needed"):
        PoseMotion(orientation, sm.splines.Spline(basis, np.zeros((basis.n, 2))))


ONE = np.array([1.0, 0.0, 0.0, 0.0])
HALF = np.array([0.0, 1.0, 0.0, 0.0])
LINE = sm.splines.BSplineBasis.clamped([0.0, 1.0], 1)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: qa.as_quaternions([ONE, 0 * ONE]), "quaternion 1 is zero"),
        (lambda: qa.as_quaternions([ONE, 1.1 * ONE]), r"quaternion 1 has length 1\.1, not 1 \(tolerance 1e-06\)"),
        (lambda: qa.as_quaternions([ONE, np.nan * ONE]), "quaternion 1 is not finite"),
        (lambda: qa.as_quaternions(np.eye(3)), "scalar first"),
        (lambda: qa.aligned(np.array([ONE, HALF])), 'half a turn apart.*signs="keep"'),
        (lambda: qa.aligned(np.array([ONE, -ONE]), "keep"), "antipodal"),
        (lambda: qa.aligned(np.array([ONE, -qa.exp(0.3 * AXIS)]), "check"), "mixed signs.*one orientation"),
        (lambda: qa.aligned(np.array([ONE, ONE]), "flip"), "'flip' is unknown; there are align, keep, check"),  # pyright: ignore
        (lambda: qa.increments_between(np.array([ONE, ONE]), [1]), "alike: extra turns between them need an axis"),
        (lambda: qa.increments_between(np.array([ONE, HALF]), [0.5]), "whole number per interval"),
        (lambda: QuaternionMotion.bezier([ONE]), "too few: at least 2"),
        (lambda: QuaternionMotion.bspline(BASES["quintic"], units(5)), "of degree 5 with 8 functions: 8 are needed"),
        (
            lambda: QuaternionMotion.bspline(BASES["closed"], units(5), turns=[1] * 4),
            r"whole number per interval, \(5,\)",
        ),
        (lambda: sm.interpolants.slerp_bspline(BASES["closed"], units(5)), "that is not periodic"),
        (lambda: sm.interpolants.slerp_bspline(BASES["quintic"], units(5)), "needed for this basis"),
        (lambda: QuaternionMotion(sm.splines.BSplineBasis.clamped([0, 1], 0), ONE[None]), "degree 1 or more"),
        (lambda: QuaternionMotion(BASES["closed"], units(4)), "5 are needed for this basis"),
        (lambda: QuaternionMotion(sm.splines.BSplineBasis.clamped([0, 1], 1), units(2), np.zeros((1, 3))), "off by"),
        (
            lambda: QuaternionMotion(sm.splines.BSplineBasis.clamped([0, 1], 1), units(2), np.zeros((2, 3))),
            r"\(1, 3\) is needed",
        ),
        (lambda: QuaternionMotion.hermite(ONE, HALF, [0, 0], [0, 0, 0]), "end rates"),
        (
            lambda: QuaternionMotion.bezier(units(3), span=(1, 0)),
            r"span \(1, 0\): two finite times, the first",
        ),
        (lambda: QuaternionMotion.bezier(units(3)).rate(0.5, "camera"), "'camera' is unknown"),  # pyright: ignore
        (lambda: QuaternionMotion.bezier(units(3))(1.5), "outside the domain"),
        (lambda: QuaternionMotion.bezier(units(3))(np.nan), "finite"),
        (lambda: QuaternionMotion.bezier(units(3))(0.5, 4), "0 to 3"),
        (lambda: QuaternionMotion.bezier(units(3)).with_control(3, ONE), "there are 3"),
        (lambda: squad([0, 1, 1], units(3)), "times must increase"),
        (lambda: squad([0, 1], units(3)), "2 times for 3 quaternions"),
        (lambda: squad([0, 1, 2], units(3))(3.0), "domain"),
        (lambda: squad([0, 1, 2], units(3)).jet(1.0, 3), "0 to 2"),
        (lambda: shoemake_bezier(units(4), [0, 1, 2]), r"\(2, n \+ 1, 4\) is needed"),
    ],
)
def test_bad_input_names_the_culprit(call, message):
    with pytest.raises(sm.InputError, match=message):
        call()


def test_mixed_signs_are_aligned_or_kept_as_asked():
    q = units(6, 3, angle=0.5)
    mixed = q * np.array([1, -1, 1, 1, -1, -1])[:, None]
    np.testing.assert_allclose(qa.aligned(mixed), q * np.sign(mixed[0] @ q[0]), atol=0)
    basis = sm.splines.BSplineBasis.clamped([0.0, 1.0, 2.0, 3.0], 3)
    short, long = (QuaternionMotion.bspline(basis, mixed, signs=s) for s in ("align", "keep"))
    assert np.linalg.norm(short.increments, axis=1).max() < np.pi / 2 < np.linalg.norm(long.increments, axis=1).max()
    np.testing.assert_allclose(
        from_rotations(qa.to_rotation(q)), q * np.sign(from_rotations(qa.to_rotation(q))[0] @ q[0])
    )


def test_the_scalar_part_may_come_last_wherever_quaternions_come_in():
    first = np.array([[1, 0, 0, 0], [0.8, 0.6, 0, 0], [0.6, 0, 0.8, 0], [0.28, 0.96, 0, 0]])
    last = np.roll(first, -1, axis=1)
    times, basis = np.arange(4.0), sm.splines.BSplineBasis.clamped([0.0, 1.0], 3)
    within, curve = sm.interpolants, sm.quaternions.QuaternionMotion
    for make in (
        lambda q, **order: curve.bezier(q, **order),
        lambda q, **order: curve.bspline(basis, q, **order),
        lambda q, **order: curve.hermite(q[0], q[1], np.zeros(3), np.ones(3), **order),
        lambda q, **order: curve.bezier(first).with_control(1, q[1], **order),
        lambda q, **order: within.shoemake_bezier(q, **order),
        lambda q, **order: within.shoemake_interpolant(times, q, **order),
        lambda q, **order: within.slerp_curve(times, q, **order),
        lambda q, **order: within.squad(times, q, **order),
        lambda q, **order: sm.quaternions.interpolate_quaternions(times, q, **order),
        lambda q, **order: sm.motions.DualQuaternions.from_parts(q, **order),
        lambda q, **order: sm.Keyframes.of(times, q, np.zeros((4, 3)), **order),
    ):
        assert make(last, scalar_first=False) == make(first) != make(last)
