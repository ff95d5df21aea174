"""Products of turns over any basis: the cumulative form, beside B-spline curves, scalar curves, SciPy and `splines`."""

from itertools import pairwise
from typing import Any, cast

import numpy as np
import pytest
import splines
import splines.quaternion as recursive
from scipy.spatial.transform import Rotation
from turns import AXIS, units

import symmotion as sm
from symmotion.motions.quaternions import ProductMotion, QuaternionMotion
from symmotion.motions.quaternions import algebra as qa
from symmotion.splines import BSplineBasis, CumulativeBasis, Spline

TIMES = np.array([0.0, 0.6, 1.3, 2.0, 3.5, 4.4, 6.0])
TURNS = np.array([0, 1, 0, -2, 0, 3])
SHAPE: Any = {"tension": 0.3, "continuity": -0.4, "bias": 0.5}
EYE = np.eye(len(TIMES))
BASES = {
    "B-splines": BSplineBasis.clamped(np.linspace(0, 6, 5), 3),
    "Catmull–Rom": sm.curves.catmull_rom(TIMES, EYE),
    "cardinal": sm.curves.kochanek_bartels(TIMES, EYE, tension=0.5),
    "Kochanek–Bartels": sm.curves.kochanek_bartels(TIMES, EYE, **SHAPE),
    "C² cardinal functions": sm.splines.cubic_interpolant(TIMES, EYE),
    "Bernstein": BSplineBasis.clamped([0.0, 6.0], 6),
}


def inside(motion, count=7):
    return np.concatenate([a + (b - a) * np.linspace(0.1, 0.9, count) for a, b in pairwise(motion.breakpoints)])


@pytest.mark.parametrize("basis", [BASES["B-splines"], BASES["Bernstein"], BSplineBasis(np.arange(11.0), 3)])
def test_over_b_splines_it_is_the_quaternion_motion(basis):
    q, turns = units(7, 3, 1.1), TURNS
    motion = QuaternionMotion.bspline(basis, q, turns)
    for over in (basis, Spline(basis, EYE)):
        mine = ProductMotion.over(over, q, turns)
        t = inside(motion)
        for a, b in zip(mine.jet(t, 3), motion.jet(t, 3), strict=True):
            np.testing.assert_allclose(a, b, atol=1e-12 * np.abs(b).max())


@pytest.mark.parametrize("frame", ["body", "world"])
@pytest.mark.parametrize("name", BASES)
def test_it_is_a_product_of_scipys_rotations_with_the_derivatives_of_its_values(name, frame):
    q = units(7, 3, 1.1)
    motion = ProductMotion.over(BASES[name], q, TURNS, frame=frame)
    t, h = inside(motion), 1e-5
    keys = qa.to_rotation(q)
    functions = BASES[name](t) if isinstance(BASES[name], Spline) else np.asarray(BASES[name](t))
    sums = np.cumsum(functions[:, ::-1], axis=1)[:, ::-1]
    expected = Rotation.identity(len(t)) * keys[0]
    for i in range(1, 7):
        between = keys[i - 1].inv() * keys[i] if frame == "body" else keys[i] * keys[i - 1].inv()
        way = between.as_rotvec()
        way = way + 2 * np.pi * TURNS[i - 1] * way / np.linalg.norm(way)
        step = Rotation.from_rotvec(sums[:, i, None] * way)
        expected = expected * step if frame == "body" else step * expected
    assert (motion.rotation(t).inv() * expected).magnitude().max() < 1e-12
    for nu in (1, 2, 3):
        differences = (motion(t + h, nu - 1) - motion(t - h, nu - 1)) / (2 * h)
        np.testing.assert_allclose(motion(t, nu), differences, atol=1e-7 * np.abs(differences).max() * 10**nu)
    np.testing.assert_allclose(motion.rate(t, "world"), qa.rotate(motion(t), motion.rate(t)), atol=1e-12)
    for read in ("acceleration", "jerk"):
        before = {"acceleration": "rate", "jerk": "acceleration"}[read]
        low, high = (getattr(motion, before)(s, "world") for s in (t - h, t + h))
        found = getattr(motion, read)(t, "world")
        np.testing.assert_allclose(found, (high - low) / (2 * h), atol=1e-6 * np.abs(found).max())


def test_frames_differ_where_factors_overlap_and_agree_where_they_do_not():
    q, t = units(7, 3, 1.1), np.linspace(0, 6, 50)
    body, world = (ProductMotion.over(BASES["Catmull–Rom"], q, frame=f) for f in ("body", "world"))
    assert (body.rotation(t).inv() * world.rotation(t)).magnitude().max() > 0.05
    line = BSplineBasis.clamped(TIMES, 1)
    body, world = (ProductMotion.over(line, q, frame=f) for f in ("body", "world"))
    np.testing.assert_allclose(body(t), world(t), atol=1e-14)


@pytest.mark.parametrize("name", ["Catmull–Rom", "cardinal", "Kochanek–Bartels", "C² cardinal functions"])
def test_interpolating_bases_interpolate_with_whole_turns(name):
    q = units(7, 5, 2.5)
    motion = ProductMotion.over(BASES[name], q, TURNS)
    assert (motion.rotation(TIMES).inv() * qa.to_rotation(q)).magnitude().max() < 1e-12
    sides = np.sign(np.sum(motion(TIMES) * qa.aligned(q), axis=1))
    np.testing.assert_array_equal(sides, np.cumprod(np.append(1, (-1.0) ** TURNS)))


def test_about_one_axis_it_is_the_scalar_kochanek_bartels_spline():
    heights = np.array([0.0, 1.1, 0.4, 2.0, 1.5, 3.9, 4.5])
    motion = ProductMotion.over(BASES["Kochanek–Bartels"], qa.exp(heights[:, None] / 2 * AXIS))
    inner = np.linspace(TIMES[1], TIMES[-2], 200)
    scalar = splines.KochanekBartels(heights, TIMES, tcb=tuple(SHAPE.values()))
    expected = np.array([scalar.evaluate(t, 1) for t in inner])
    np.testing.assert_allclose(motion.rate(inner), expected[:, None] * AXIS, atol=1e-12)


def test_rates_at_keyframes_are_those_of_the_recursive_kochanek_bartels_curve():
    q = qa.aligned(units(7, 3, 1.1))
    motion = ProductMotion.over(BASES["Kochanek–Bartels"], q)
    other = recursive.KochanekBartels(
        [recursive.UnitQuaternion.from_unit_xyzw(np.roll(row, -1)) for row in q], TIMES, tcb=tuple(SHAPE.values())
    )
    for i in range(1, 5):
        start, behind, before, end = (np.array([p.scalar, *p.vector]) for p in other.segments[i])
        h = TIMES[i + 1] - TIMES[i]
        after = 6 * qa.short_log(qa.product(qa.conjugate(start), behind)[None])[0] / h
        until = 6 * qa.short_log(qa.product(qa.conjugate(before), end)[None])[0] / h
        np.testing.assert_allclose(motion.rate(TIMES[i]), after, atol=1e-12)
        np.testing.assert_allclose(motion.rate(np.nextafter(TIMES[i + 1], 0)), until, atol=1e-12)


@pytest.mark.parametrize("name", BASES)
def test_functions_are_the_sums_behind_and_their_derivatives(name):
    basis, t = BASES[name], np.linspace(0, 6, 61)
    functions = CumulativeBasis.of(basis)
    for nu in range(3):
        plain = basis(t, nu)
        np.testing.assert_allclose(functions(t, nu), np.cumsum(plain[:, ::-1], axis=1)[:, -2::-1], atol=1e-12)
    assert functions.relative == functions


def test_a_moved_key_turns_four_intervals_of_catmull_rom_whole_turns_among_them():
    count, key = 12, 6
    times, turns = np.cumsum(np.random.default_rng(1).uniform(0.2, 2, count)), np.tile([0, 2, -1], 4)[: count - 1]
    q = units(count, 2, 1.3)
    moved = q.copy()
    moved[key] = qa.product(q[key], qa.exp(np.array([0.2, -0.1, 0.3])))
    t = np.linspace(times[0], times[-1], 1201)
    near = (t > times[key - 2]) & (t < times[key + 2])
    for make in (
        lambda p: ProductMotion.over(sm.curves.catmull_rom(times, np.eye(count)), p, turns),
        lambda p: sm.interpolants.monotone_curve(times, p, turns),
    ):
        off = (make(q).rotation(t).inv() * make(moved).rotation(t)).magnitude()
        assert off[~near].max() < 1e-13 < 0.1 < off[near].max()


@pytest.mark.parametrize("periodic", [False, True])
def test_a_moved_control_of_a_b_spline_curve_keeps_whole_turns_and_turns_four_spans(periodic):
    basis = BSplineBasis.closed(np.arange(10.0), 3) if periodic else BSplineBasis.clamped(np.arange(10.0), 3)
    turns = np.resize([1, 0, -2, 0], basis.n - (not periodic))
    motion = QuaternionMotion.bspline(basis, units(basis.n, 4, 0.9), turns)
    i, t = 5, np.linspace(*basis.domain, 901)
    moved = motion.with_control(i, qa.product(motion.control_points[i], qa.exp(np.array([0.1, 0.05, -0.1]))))
    np.testing.assert_array_equal(moved.turns, motion.turns)
    off = (motion.rotation(t).inv() * moved.rotation(t)).magnitude()
    near = (t > basis.origin + basis.knots[i]) & (t < basis.origin + basis.knots[i + 4])
    assert off[~near].max() < 1e-12 < 0.01 < off[near].max()


def test_whole_turns_in_a_closed_polygon_are_those_of_the_scalar_spline():
    basis = BSplineBasis.closed([0.0, 1.0, 1.7, 2.5, 4.0, 5.0], 3)
    heights, turns = np.array([0.0, 1.0, 0.3, -0.6, 0.5]), np.array([1, 0, -1, 0, 3])
    motion = QuaternionMotion.bspline(basis, qa.exp(heights[:, None] / 2 * AXIS), turns)
    steps = np.diff(np.append(heights, heights[0]))
    steps = steps + 2 * np.pi * turns * np.sign(steps)
    # The angle climbs by the sum of the steps in a period: a straight line and a periodic part.
    climb = steps.sum() / 5.0
    where = basis.greville
    angle = np.append(0.0, np.cumsum(steps[:-1]))
    scalar = Spline(basis, angle - climb * where)
    t = np.linspace(0, 5, 100)
    np.testing.assert_allclose(motion.rate(t), (scalar(t, 1) + climb)[:, None] * AXIS, atol=1e-11)
    ends = motion.jet([0.0, 5.0], 2)
    np.testing.assert_allclose(np.abs(ends.quaternion[0] @ ends.quaternion[1]), 1.0, atol=1e-14)
    np.testing.assert_allclose(ends.acceleration[0], ends.acceleration[1], atol=1e-11)
    np.testing.assert_array_equal(motion.turns, np.round(np.abs(steps) / (2 * np.pi)))


def test_uniform_b_splines_with_phantom_controls_begin_and_end_at_controls():
    q, turns = units(6, 7, 1.2), [0, 1, 0, 0, -1]
    motion = QuaternionMotion.uniform(q, turns, span=(1.0, 3.5))
    ends = motion.jet([1.0, 3.5], 2)
    assert (qa.to_rotation(ends.quaternion).inv() * qa.to_rotation(q[[0, -1]])).magnitude().max() < 1e-13
    np.testing.assert_allclose(ends.acceleration, 0, atol=1e-11)
    heights = np.array([0.0, 1.0, 0.3, -0.6, 0.5])
    flat = QuaternionMotion.uniform(qa.exp(heights[:, None] / 2 * AXIS), span=(0.0, 4.0))
    longer = np.concatenate([[2 * heights[0] - heights[1]], heights, [2 * heights[-1] - heights[-2]]])
    scalar = Spline(BSplineBasis(np.arange(-3.0, 8.0), 3), longer)
    t = np.linspace(0, 4, 50)
    np.testing.assert_allclose(flat.rate(t), scalar(t, 1)[:, None] * AXIS, atol=1e-13)


ONE = np.array([1.0, 0.0, 0.0, 0.0])
LINE = BSplineBasis.clamped([0.0, 1.0], 1)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: ProductMotion.over(LINE, units(3)), "3 control quaternions for 2 functions"),
        (lambda: ProductMotion.over(LINE, units(2), frame=cast(Any, "moon")), "there are body, world"),
        (lambda: ProductMotion.over(Spline(LINE, 2 * np.eye(2)), units(2)), "do not sum to one.*by up to 1"),
        (lambda: ProductMotion.over(Spline(LINE, np.ones(2)), units(2)), "a column per function"),
        (lambda: ProductMotion.over(BSplineBasis.closed(np.arange(6.0), 3), units(5)), "periodic basis"),
        (lambda: ProductMotion(CumulativeBasis.of(LINE), ONE, np.zeros((2, 3))), r"finite, \(1, 3\) is needed"),
        (lambda: ProductMotion(CumulativeBasis.of(LINE), np.eye(4), np.zeros((1, 3))), r"one unit quaternion, \(4,\)"),
        (lambda: ProductMotion(CumulativeBasis.of(LINE), 2 * ONE, np.zeros((1, 3))), "length 2, not 1"),
        (lambda: ProductMotion.over(LINE, units(2)).jet(0.5, 4), "0 to 3 is needed"),
        (lambda: ProductMotion.over(LINE, units(2)).jet(np.nan), "times must be finite"),
        (lambda: ProductMotion.over(LINE, units(2))(1.5), "outside the domain"),
        (lambda: CumulativeBasis(LINE, np.arange(2), np.ones((1, 1))), "weights of shape"),
        (lambda: CumulativeBasis(LINE, np.array([1, 0]), np.ones((2, 1))), "do not decrease"),
    ],
)
def test_bad_input_names_the_culprit(call, message):
    with pytest.raises(sm.InputError, match=message):
        call()
