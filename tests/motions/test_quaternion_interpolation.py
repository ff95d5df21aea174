"""C² quaternion curves through keyframes: ends, times, turns, and what cannot be."""

import numpy as np
import pytest
from turns import AXIS, units

import symmotion as sm
from symmotion.motions.quaternions import algebra as qa
from symmotion.motions.quaternions.continuation import newton
from symmotion.motions.quaternions.interpolation import interpolate_quaternions
from symmotion.motions.quaternions.keys import OrientationKeys
from symmotion.motions.quaternions.passing import Passing

TIMES = np.array([0.0, 0.6, 1.3, 2.0, 3.5, 4.4, 6.0])


def off(motion, times, q):
    """The largest angle in rad between the curve and the keyframes."""
    return float(2 * np.linalg.norm(qa.short_log(qa.product(qa.conjugate(q), motion(times))), axis=1).max())


@pytest.mark.parametrize("angle", [0.2, 1.0, 1.8])
@pytest.mark.parametrize("ends", ["natural", "clamped", "periodic"])
def test_goes_through_the_keyframes_and_has_its_ends(ends, angle):
    q = units(7, 11, angle)
    rates = np.array([[1.0, 0.0, -2.0], [0.5, 3.0, 0.0]])
    if ends == "periodic":
        q[-1] = -q[0]
    motion = interpolate_quaternions(TIMES, q, ends, rates if ends == "clamped" else None)
    assert off(motion, TIMES, q) < 1e-12
    jet = motion.jet(TIMES[[0, -1]], 2)
    if ends == "natural":
        np.testing.assert_allclose(jet.acceleration, 0.0, atol=1e-12 * np.abs(motion.acceleration(TIMES)).max())
    elif ends == "clamped":
        np.testing.assert_allclose(jet.rate, rates, atol=1e-12)
    else:
        np.testing.assert_allclose(jet.rate[0], jet.rate[1], atol=1e-11 * np.abs(jet.rate).max())
        np.testing.assert_allclose(
            jet.acceleration[0], jet.acceleration[1], atol=1e-11 * np.abs(jet.acceleration).max()
        )
    inner, h = TIMES[1:-1], 1e-10
    for order in (1, 2):
        before, after = motion.jet(inner - h, order)[order], motion.jet(inner + h, order)[order]
        assert np.abs(after - before).max() < 1e-6 * np.abs(after).max()


@pytest.mark.parametrize("ends", ["natural", "clamped"])
def test_about_one_axis_it_is_the_scalar_cubic(ends):
    rng = np.random.default_rng(0)
    heights = rng.uniform(-2.8, 2.8, len(TIMES)).cumsum()
    slopes = np.array([0.7, -1.1]) if ends == "clamped" else None
    rates = None if slopes is None else slopes[:, None] * AXIS
    motion = interpolate_quaternions(TIMES, qa.exp(heights[:, None] / 2 * AXIS), ends, rates)
    scalar, t = sm.splines.cubic_interpolant(TIMES, heights, ends, slopes), np.linspace(0, 6, 500)
    np.testing.assert_allclose(motion.rate(t), scalar(t, 1)[:, None] * AXIS, atol=1e-9)
    np.testing.assert_allclose(motion.acceleration(t), scalar(t, 2)[:, None] * AXIS, atol=1e-9)


def test_whole_turns_about_one_axis_are_those_of_the_scalar_cubic():
    rng = np.random.default_rng(2)
    steps = rng.uniform(0.2, 2.8, len(TIMES) - 1) * rng.choice([-1, 1], len(TIMES) - 1)
    turns = np.array([0, 1, -2, 3, 0, 1])
    q = qa.exp(np.append(0, steps.cumsum())[:, None] / 2 * AXIS)
    motion = interpolate_quaternions(TIMES, q, turns=turns)
    scalar = sm.splines.cubic_interpolant(TIMES, np.append(0, (steps + 2 * np.pi * turns * np.sign(steps)).cumsum()))
    t = np.linspace(0, 6, 500)
    np.testing.assert_allclose(motion.rate(t), scalar(t, 1)[:, None] * AXIS, atol=1e-9)
    assert off(motion, TIMES, q) < 1e-12


def test_whole_turns_about_several_axes():
    q, turns = units(7, 4, angle=0.5), np.array([0, 1, 0, 0, 2, 0])
    motion = interpolate_quaternions(TIMES, q, turns=turns)
    assert off(motion, TIMES, q) < 1e-12
    # An odd number of turns ends on the other side of the sphere.
    signs = np.sign(np.sum(motion(TIMES) * qa.aligned(q), axis=1))
    np.testing.assert_array_equal(signs, np.cumprod(np.append(1, (-1.0) ** turns)))
    closed = units(7, 4, angle=0.4)
    closed[-1] = closed[0]
    loop = interpolate_quaternions(TIMES, closed, "periodic", turns=[0, 1, 0, 0, 0, 0])
    assert off(loop, TIMES, closed) < 1e-12


def test_a_thousand_keyframes_and_far_turns_converge():
    q = units(1000, 5, angle=1.0)
    assert off(interpolate_quaternions(np.arange(1000.0), q), np.arange(1000.0), q) < 1e-12
    far, t = units(20, 6, angle=2.9), np.arange(20.0)
    assert off(interpolate_quaternions(t, far), t, far) < 1e-12


def test_two_keyframes_make_a_slerp_and_a_rotation_is_taken():
    q = units(2, 1, angle=1.5)
    motion = interpolate_quaternions([1.0, 3.0], qa.to_rotation(q))
    np.testing.assert_allclose(np.linalg.norm(motion.rate(np.linspace(1, 3, 9)), axis=1), 0.75, atol=1e-13)


def test_keys_turned_a_little_keep_their_ways():
    q = units(5, 3, angle=1.0)
    keys = OrientationKeys.of(np.arange(5.0), q, turns=[0, 1, -1, 2])
    turned = keys.turned(-qa.product(q, qa.exp(1e-6 * AXIS)))
    np.testing.assert_allclose(turned.ways, keys.ways, atol=1e-4)
    np.testing.assert_allclose(np.abs(np.sum(turned.quaternions * keys.quaternions, axis=1)), 1.0, atol=1e-10)
    steps = qa.product(turned.quaternions[:-1], qa.exp(turned.ways))
    np.testing.assert_allclose(steps, turned.quaternions[1:], atol=1e-12)
    with pytest.raises(sm.InputError, match="4 quaternions for 5 times"):
        keys.turned(q[:4])


Q = units(5, 2, angle=0.7)
T = np.arange(5.0)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: interpolate_quaternions(T[[0, 2, 1, 3, 4]], Q), "time of keyframe 2, 1, comes before"),
        (lambda: interpolate_quaternions(T[:4], Q), "4 times for 5 quaternions"),
        (lambda: interpolate_quaternions(T[:1], Q[:1]), "too few: at least 2"),
        (lambda: interpolate_quaternions(T[:3], Q[:3], "periodic"), "at least 4"),
        (lambda: interpolate_quaternions(T, Q, "periodic"), "the last keyframe equal to the first"),
        (lambda: interpolate_quaternions(T, Q, "loose"), "there are natural, clamped, periodic"),
        (lambda: interpolate_quaternions(T, Q, "clamped"), "clamped ends need them"),
        (lambda: interpolate_quaternions(T, Q, end_rates=np.zeros((2, 3))), "end_rates go with clamped"),
        (lambda: interpolate_quaternions(T, Q, "clamped", np.zeros((2, 2))), r"\(2, 3\) in rad/s"),
        (lambda: interpolate_quaternions(T, Q * [[1], [1], [0], [1], [1]]), "keyframe 2 is zero"),
        (lambda: interpolate_quaternions(T, 2 * Q), "keyframe 0 has length 2"),
        (lambda: interpolate_quaternions(T, Q, turns=[1, 0]), r"\(4,\), is needed"),
        (lambda: interpolate_quaternions(T, Q * [[1], [-1], [1], [1], [1]], signs="check"), "keyframes 0 and 1.*mixed"),
    ],
)
def test_bad_input_names_the_culprit(call, message):
    with pytest.raises(sm.InputError, match=message):
        call()


def test_says_so_where_it_does_not_converge():
    with pytest.raises(sm.SolveError, match="rad off after 1 iterations"):
        interpolate_quaternions(TIMES, units(7, 11, 1.8), max_iterations=1)


def far_keys(seed, ends, turns):
    """Neighbours up to 179° apart, intervals uneven by 100, and how the ends are, for some with extra turns."""
    r = np.random.default_rng(seed)
    count = int(r.integers(4, 8))
    axes = r.normal(size=(count - 1, 3))
    ways = np.radians(r.uniform(0, 179, (count - 1, 1))) / 2 * axes / np.linalg.norm(axes, axis=1, keepdims=True)
    q = [np.array([1.0, 0.0, 0.0, 0.0])]
    for way in qa.exp(ways):
        q.append(qa.product(q[-1], way))
    q = np.array(q)
    if ends == "periodic":
        q[-1] = q[0]
    times = np.append(0.0, np.cumsum(100.0 ** r.uniform(0, 1, count - 1)))
    rates = r.normal(size=(2, 3)) / np.diff(times).mean() if ends == "clamped" else None
    return times, q, rates, r.integers(-1, 2, count - 1) if turns else np.zeros(count - 1, int)


@pytest.mark.parametrize("ends", ["natural", "clamped", "periodic"])
@pytest.mark.parametrize("turns", [False, True], ids=["plain", "turns"])
@pytest.mark.parametrize("seed", range(2))
def test_far_turns_at_uneven_times_converge(seed, turns, ends):
    times, q, rates, extra = far_keys(seed, ends, turns)
    motion = interpolate_quaternions(times, q, ends, rates, extra)
    assert off(motion, times, q) < 1e-11
    # An odd number of turns ends on the other side of the sphere.
    odd = np.cumprod(np.append(1, (-1.0) ** extra))
    sides = np.sign(np.sum(motion(times) * qa.aligned(q), axis=1))
    np.testing.assert_array_equal(sides, odd)


@pytest.mark.parametrize("ends", ["natural", "clamped", "periodic"])
def test_the_conditions_change_with_the_share_of_the_ways_as_their_derivative_says(ends):
    times, q, rates, extra = far_keys(1, ends, True)
    keys = OrientationKeys.of(times, q, extra)
    basis = (sm.splines.BSplineBasis.closed if ends == "periodic" else sm.splines.BSplineBasis.clamped)(times, 3)
    system = Passing(keys, basis, rates)
    system.shorten(0.3)
    point, miss, _ = newton(system, system.start(), 1e-12, 50)
    assert miss < 1e-12
    h = 1e-6
    sides = []
    for share in (0.3 + h, 0.3 - h):
        system.shorten(share)
        sides.append(system.residual(point))
    system.shorten(0.3)
    np.testing.assert_allclose(system.drift(point), (sides[0] - sides[1]) / (2 * h), atol=1e-8)
    # And by steps of the unknowns.
    step = np.random.default_rng(0).normal(size=system.jacobian(point).shape[1])
    ahead, behind = (system.residual(system.moved(point, sign * h * step)) for sign in (1, -1))
    np.testing.assert_allclose(system.jacobian(point) @ step, (ahead - behind) / (2 * h), atol=1e-7)


def test_what_is_at_fault_is_named():
    times, q, _, extra = far_keys(0, "natural", True)
    with pytest.raises(sm.SolveError, match=r"intervals of .* and .* stand beside each other"):
        interpolate_quaternions(times, q, turns=extra, max_iterations=3)
    with pytest.raises(sm.SolveError, match=r"keyframes 1 and 2 are 7\d\d° apart: add keyframes between"):
        interpolate_quaternions(np.arange(len(q)), q, turns=[0, 2, *np.zeros(len(q) - 3, int)], max_iterations=3)
