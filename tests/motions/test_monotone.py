"""Curves that turn steadily between keyframes, and how far curves turn: SciPy's PCHIP and roots as oracles."""

from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.interpolate import CubicSpline, PchipInterpolator
from turns import AXIS, units

import symmotion as sm
from symmotion.motions.interpolants import monotone_curve
from symmotion.motions.quaternions import algebra as qa
from symmotion.motions.quaternions import angles_travelled, extra_turns, interpolate_quaternions
from symmotion.splines import Spline

TIMES = np.array([0.0, 0.6, 1.3, 2.0, 3.5, 4.4, 6.0])


def far(seed, ratio=1000.0, count=9):
    """Times uneven by a ratio, and neighbours up to 179° apart, for odd seeds with extra turns."""
    r = np.random.default_rng(seed)
    axes = r.normal(size=(count - 1, 3))
    half = np.radians(r.uniform(0, 179, (count - 1, 1))) / 2
    q = [np.array([1.0, 0.0, 0.0, 0.0])]
    for way in qa.exp(half * axes / np.linalg.norm(axes, axis=1, keepdims=True)):
        q.append(qa.product(q[-1], way))
    times = np.append(0.0, np.cumsum(ratio ** r.uniform(0, 1, count - 1)))
    return times, np.array(q), r.integers(-1, 3, count - 1) if seed % 2 else np.zeros(count - 1, int)


@pytest.mark.parametrize("count", [2, 3, 7])
def test_about_one_axis_it_is_scipys_pchip(count):
    for seed in range(4):
        heights = np.random.default_rng(seed).uniform(-2.8, 2.8, count).cumsum()
        curve = monotone_curve(TIMES[:count], qa.exp(heights[:, None] / 2 * AXIS))
        t = np.linspace(0, TIMES[count - 1], 200)
        expected = PchipInterpolator(TIMES[:count], heights) if count > 2 else CubicSpline([0, 0.6], heights)
        np.testing.assert_allclose(curve.rate(t), expected(t, 1)[:, None] * AXIS, atol=1e-11)
        assert (curve.rotation(t).inv() * qa.to_rotation(qa.exp(expected(t)[:, None] / 2 * AXIS))).magnitude().max() < (
            1e-12
        )


def test_closed_about_one_axis_it_is_scipys_pchip_over_and_over():
    heights = np.array([0.0, 1.1, 0.4, 2.0, 3.5, 5.1, 2 * np.pi])
    curve = monotone_curve(TIMES, qa.exp(heights[:, None] / 2 * AXIS), ends="periodic")
    periods = [-1, 0, 1]
    times = np.concatenate([TIMES[:-1] + 6.0 * k for k in periods])
    unrolled = np.concatenate([heights[:-1] + 2 * np.pi * k for k in periods])
    t = np.linspace(0, 6, 200)
    expected = PchipInterpolator(times, unrolled)
    np.testing.assert_allclose(curve.rate(t), expected(t, 1)[:, None] * AXIS, atol=1e-11)


def test_closed_it_has_one_rate_at_both_ends_wherever_it_begins():
    times, q, turns = far(5, 100.0)
    q[-1] = q[0]
    curve = monotone_curve(times, q, turns, ends="periodic")
    np.testing.assert_allclose(*curve.rate(times[[0, -1]]), atol=1e-10 * np.abs(curve.rate(times)).max())
    later = np.concatenate([times[3:], times[1:4] + times[-1] - times[0]])
    other = monotone_curve(later, q[[3, 4, 5, 6, 7, 8, 1, 2, 3]], np.roll(turns, -3), ends="periodic")
    t = np.linspace(times[3], times[-1], 50)
    assert (curve.rotation(t).inv() * other.rotation(t)).magnitude().max() < 1e-11


@pytest.mark.parametrize("seed", range(6))
def test_it_goes_through_keyframes_once_differentiable_without_a_turn_more(seed):
    times, q, turns = far(seed)
    curve = monotone_curve(times, q, turns)
    assert (curve.rotation(times).inv() * qa.to_rotation(q)).magnitude().max() < 1e-12
    np.testing.assert_array_equal(curve.breakpoints, times)
    before, behind = curve.rate(np.nextafter(times[1:-1], 0)), curve.rate(times[1:-1])
    np.testing.assert_allclose(before, behind, atol=1e-9 * np.abs(behind).max())
    asked = 2 * np.linalg.norm(curve.increments[1::3], axis=1)
    assert (angles_travelled(curve, times) < 17 / 9 * asked + 1e-9).all()
    if not turns.any():
        assert not extra_turns(curve, times, q, turns).any()
    # The turn about the axis between two keyframes never goes back.
    t = np.linspace(times[:-1], times[1:], 40)[1:-1].ravel()
    assert curve.functions(t, 1)[:, 1::3].min() >= -1e-12


def test_it_follows_other_frames():
    times, q, turns = far(3, 10.0)
    curve, t = monotone_curve(times, q, turns), np.linspace(0, 1, 50)
    t = times[0] + (times[-1] - times[0]) * t
    fixed, moving = units(2, 8)
    other = monotone_curve(times, qa.product(qa.product(fixed, q), moving), turns)
    expected = qa.to_rotation(qa.product(qa.product(fixed, curve(t)), moving))
    assert (other.rotation(t).inv() * expected).magnitude().max() < 1e-11


def test_where_neighbours_are_alike_it_rests():
    q = units(4, 3, 1.0)[[0, 1, 1, 2]]
    curve = monotone_curve([0.0, 1.0, 2.0, 3.0], q)
    np.testing.assert_allclose(curve.rate(np.linspace(1, 2, 9)), 0.0, atol=1e-14)


def test_angles_travelled_about_one_axis_are_the_variation_of_the_scalar_curve():
    heights = np.array([0.0, 2.5, 0.4, -2.0, 0.5, 3.0, 2.9])
    times = np.array([0.0, 1.0, 1.05, 2.0, 3.5, 3.6, 6.0])
    curve = interpolate_quaternions(times, qa.exp(heights[:, None] / 2 * AXIS))
    steps = np.diff(heights)
    steps -= 2 * np.pi * np.round(steps / (2 * np.pi))
    unrolled = np.append(0, steps.cumsum())
    scalar = CubicSpline(times, unrolled, bc_type="natural")
    places = np.sort(np.concatenate([times, scalar.derivative().roots(extrapolate=False)]))
    variation = np.abs(np.diff(scalar(places)))
    expected = [variation[(places[:-1] >= a) & (places[:-1] < b)].sum() for a, b in pairwise(times)]
    np.testing.assert_allclose(angles_travelled(curve, times), expected, rtol=1e-6)
    beyond = np.floor((np.array(expected) - np.abs(steps)) / (2 * np.pi))
    assert beyond.max() >= 1
    np.testing.assert_array_equal(extra_turns(curve, times, qa.exp(heights[:, None] / 2 * AXIS)), beyond)


def test_its_torque_is_scipys_integral_and_the_one_of_a_pose_with_it():
    times, q, turns = far(1, 10.0, 4)
    curve = monotone_curve(times + 1e4, q, turns)
    expected = sum(
        quad(lambda t: np.sum(curve.acceleration(t) ** 2), a, b, epsabs=0, epsrel=1e-11)[0]
        for a, b in pairwise(curve.breakpoints)
    )
    path = sm.curves.catmull_rom(curve.breakpoints, np.random.default_rng(2).normal(size=(4, 3)))
    for motion in (curve, sm.motions.PoseMotion(curve, path)):
        assert sm.measure(motion, sm.energies.Torque()) == pytest.approx(expected, rel=1e-8)


def test_programs_and_fairing_say_that_it_has_no_control_polygon():
    keys = sm.examples.random_keyframes(5, 60, seed=1)
    curve = monotone_curve(keys)
    program = sm.pose_program(keys, refine=0)
    pose = sm.motions.PoseMotion(
        curve, Spline(program.design.motion(program.start).translation.basis, np.zeros((7, 3)))
    )
    with pytest.raises(sm.InputError, match=r"start ProductMotion.*QuaternionMotion"):
        program.design.unknowns(pose)
    with pytest.raises(sm.InputError, match="no control polygon to fair: parts='translation'"):
        sm.fair(pose)
    faired = sm.fair(pose, parts="translation", target=0.1)
    assert faired.motion.orientation == curve


def test_turns_that_were_asked_for_are_not_extra():
    q, turns = units(7, 4, 0.5), np.array([0, 1, 0, 0, 2, 0])
    curve = monotone_curve(TIMES, q, turns)
    assert not extra_turns(curve, TIMES, q, turns).any()
    np.testing.assert_array_equal(extra_turns(curve, TIMES, q) >= turns, True)


def test_what_is_at_fault_names_the_curves_that_serve():
    times, q, _ = far(0)
    with pytest.raises(sm.SolveError, match=r"interpolants\.monotone_curve goes through them"):
        interpolate_quaternions(times, q, max_iterations=1)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: monotone_curve(TIMES[::-1], units(7)), "comes before"),
        (lambda: monotone_curve(TIMES, units(7), ends="natural"), "there are free, periodic"),
        (lambda: monotone_curve(TIMES, units(7), ends="periodic"), "last keyframe equal to the first"),
        (lambda: monotone_curve([0, 1], units(2), ends="periodic"), "at least 3 are needed"),
        (lambda: monotone_curve(TIMES, units(7, 1, 1.0), [1]), r"\(6,\), is needed"),
        (lambda: extra_turns(monotone_curve(TIMES, units(7, 1)), TIMES, units(7, 2)), "not go through keyframe 0"),
        (lambda: angles_travelled(monotone_curve(TIMES, units(7, 1)), [0.0, 7.0]), "outside the domain"),
    ],
)
def test_bad_input_names_the_culprit(call, message):
    with pytest.raises(sm.InputError, match=message):
        call()
