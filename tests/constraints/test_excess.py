from dataclasses import replace
from itertools import pairwise
from typing import Any, cast

import casadi as ca
import numpy as np
import pytest
from scipy.optimize import minimize_scalar

import symmotion as sm
from symmotion import constraints as C
from symmotion.constraints.highest import SHARP
from symmotion.splines.pieces import EPS

KEYS = sm.examples.random_keyframes(6, 60, 1)
TIP = np.array([0.3, 0.0, 0.1])
INERTIA = np.diag([1.0, 2.0, 2.5])
AFFINE = sm.affine_program(KEYS, refine=1).design.start
MOTION = sm.AffineMotion.from_spline(AFFINE, 3)
TURNING = sm.quaternions.interpolate_quaternions(KEYS.times, KEYS.rotations())
PATH = sm.splines.cubic_interpolant(KEYS.times, KEYS.translation)
POSE = sm.motions.PoseMotion(TURNING, PATH)


def highest(function, breaks, samples=400):
    """The maximum of a function of times, by SciPy's search between the best of many samples."""
    times = np.unique(np.concatenate([np.linspace(a, b, samples) for a, b in pairwise(breaks)]))
    values = function(times)
    k = int(np.argmax(values))
    ends = times[max(k - 1, 0)], times[min(k + 1, len(times) - 1)]
    found = minimize_scalar(
        lambda t: -function(np.array([t]))[0], bounds=ends, method="bounded", options={"xatol": 1e-11}
    )
    return max(values[k], -found.fun)


def norm(values):
    return np.linalg.norm(values, axis=-1)


def torque(t):
    w, a = TURNING.rate(t), TURNING.acceleration(t)
    return norm(a @ INERTIA + np.cross(w, w @ INERTIA))


# Constraint by its limit, the quantity that it names, and whether that is to be below.
CASES = {
    "speed": (MOTION, lambda x: sm.SpeedBound(TIP, x), lambda t: norm(MOTION.trajectory(TIP, t, 1)[:, 0]), 1),
    "volume": (MOTION, C.NoInversion, lambda t: np.linalg.det(MOTION(t).linear), -1),
    "spin of an affine motion": (
        MOTION,
        sm.RateBound,
        lambda t: norm(
            np.stack(
                [
                    (s := np.linalg.inv(MOTION(t).linear) @ MOTION(t, 1).linear)[:, i, j] - s[:, j, i]
                    for i, j in ((2, 1), (0, 2), (1, 0))
                ],
                1,
            )
            / 2
        ),
        1,
    ),
    "norm": (
        MOTION,
        lambda x: sm.JetConstraint(lambda jet: 2 * ca.norm_2(jet.ddv), lower=-np.inf, upper=x),
        lambda t: 2 * norm(MOTION(t, 2).translation),
        1,
    ),
    "rate": (TURNING, sm.RateBound, lambda t: norm(TURNING.rate(t)), 1),
    "acceleration": (TURNING, C.AccelerationBound, lambda t: norm(TURNING.acceleration(t)), 1),
    "torque": (TURNING, lambda x: C.TorqueBound(x, INERTIA), torque, 1),
    "floor": (
        POSE,
        lambda x: sm.JetConstraint(lambda jet: jet.place(TIP)[2], lower=x, upper=np.inf),
        lambda t: POSE.trajectory(TIP, t)[:, 0, 2],
        -1,
    ),
    "keep-out": (
        POSE,
        lambda x: sm.JetConstraint(lambda jet: ca.sumsqr(jet.place(TIP) - 5.0), lower=x, upper=np.inf),
        lambda t: norm(POSE.trajectory(TIP, t)[:, 0] - 5.0) ** 2,
        -1,
    ),
    "curve": (
        PATH,
        lambda x: sm.JetConstraint(lambda jet: jet.dx[0] / (2 + jet.x[1] ** 2), lower=-np.inf, upper=x),
        lambda t: PATH(t, 1)[:, 0] / (2 + PATH(t)[:, 1] ** 2),
        1,
    ),
}


@pytest.mark.parametrize("name", CASES)
@pytest.mark.parametrize("share", [0.7, 1.0])
def test_a_bound_is_above_the_true_excess_and_attained(name, share):
    motion, constraint, quantity, sign = CASES[name]
    worst = sign * highest(lambda t: sign * quantity(t), KEYS.times)
    limit = worst * (share if sign * worst > 0 else 2 - share)
    found = sm.excess(motion, constraint(limit))
    true = sign * (worst - limit) / abs(limit)
    assert found.kind == "certified"
    assert true - 1e-13 <= found.value <= true + 2 * SHARP
    there = sign * (quantity(np.array([found.time]))[0] - limit) / abs(limit)
    assert there == pytest.approx(true, abs=1e-8)
    assert float(found) == found.value


def test_the_excess_of_a_product_of_turns_is_sampled():
    curve = sm.interpolants.monotone_curve(KEYS)
    pose = sm.motions.PoseMotion(curve, sm.curves.catmull_rom(KEYS.times, KEYS.translation))
    worst = highest(lambda t: norm(curve.rate(t)), KEYS.times)
    for motion in (curve, pose):
        found = sm.excess(motion, sm.RateBound(0.5 * worst))
        assert found.kind == "sampled"
        assert found.value == pytest.approx(1.0, abs=1e-9)


@pytest.mark.parametrize("name", CASES)
def test_nothing_is_exceeded_where_the_bound_is_wide(name):
    motion, constraint, quantity, sign = CASES[name]
    worst = sign * highest(lambda t: sign * quantity(t), KEYS.times)
    found = sm.excess(motion, constraint(worst + sign * 1e-6 * abs(worst)))
    assert found.value == 0 and found.kind == "certified"


def test_a_limit_of_zero_counts_absolutely():
    floor = sm.JetConstraint(lambda jet: jet.v[2], lower=0.0, upper=np.inf)
    low = -highest(lambda t: -MOTION(t).translation[:, 2], KEYS.times)
    assert low < 0
    assert sm.excess(MOTION, floor).value == pytest.approx(-low, rel=1e-8)


def test_rounding_far_from_the_origin_counts():
    """What the controls far away round off may be missing from a bound of the place, and is added."""
    away = 1e9
    far = sm.AffineMotion(MOTION.basis, MOTION.linear, MOTION.translation + away)
    top = highest(lambda t: MOTION(t).translation[:, 0], KEYS.times)
    wall = sm.JetConstraint(lambda jet: jet.v[0] - away, lower=-np.inf, upper=0.5 * top)
    found = sm.excess(far, wall)
    assert found.value >= 1 - 2 * EPS * away / top
    assert found.value == pytest.approx(1.0, abs=1e3 * EPS * away / top)
    fast = highest(lambda t: norm(MOTION(t, 1).translation), KEYS.times)
    assert sm.excess(far, sm.SpeedBound([0.0, 0.0, 0.0], fast)).value < 1e-6


def test_a_sphere_far_from_the_origin_is_as_sharp_as_a_place_there():
    """‖v − c‖² is as small as the radius, whatever v and c are: 5·10⁶ m away it once was exceeded by 100 %."""
    away = 5e6
    far = sm.AffineMotion(MOTION.basis, MOTION.linear, MOTION.translation + away)
    centre = MOTION(0.5 * sum(MOTION.domain)).translation + 0.1
    near = -highest(lambda t: -norm(MOTION(t).translation - centre), KEYS.times)
    sphere = sm.JetConstraint(
        lambda jet: ca.sumsqr(jet.v - (centre + away)), lower=(2 * near) ** 2, upper=np.inf, power=2
    )
    assert sm.excess(far, sphere).value == pytest.approx(0.5, abs=1e-6)


@pytest.mark.parametrize(("power", "function"), [(2, lambda v: -(v**2)), (3, lambda v: v**3)])
def test_powers_of_what_is_negative_are_told_of_the_quantity(power, function):
    """−v² ≥ −(l)² and v³ ≥ (−l)³: once nothing was exceeded where the limit is negative."""
    values = MOTION(np.linspace(*MOTION.domain, 20001)).translation[:, 0]
    quantity = -np.abs(values) if power == 2 else values
    limit = 0.5 * quantity.min()
    assert limit < 0
    bound = sm.JetConstraint(lambda jet: function(jet.v[0]), lower=-(abs(limit) ** power), upper=np.inf, power=power)
    assert sm.excess(MOTION, bound).value == pytest.approx(1.0, abs=1e-6)
    assert sm.excess(MOTION, replace(bound, at=[2.0])).value == pytest.approx(
        max(0.0, float((-abs(MOTION(2.0).translation[0]) if power == 2 else MOTION(2.0).translation[0]) / limit) - 1)
    )


@pytest.mark.parametrize("side", [(-np.inf, 1.0), (-1.0, np.inf)])
def test_what_is_no_number_is_infinite(side):
    """A root of what is negative somewhere, and what overflows: once they were certified to exceed nothing."""
    lower, upper = side
    x = MOTION(np.linspace(*MOTION.domain, 1001)).translation[:, 0]
    level = 0.5 * (x.min() + x.max())
    root = sm.JetConstraint(lambda jet: ca.sqrt(jet.v[0] - level), lower=lower, upper=upper)
    assert sm.excess(MOTION, root).value == np.inf
    inside = sm.JetConstraint(lambda jet: ca.sqrt(jet.v[0] - x.min() + 1e-3), lower=-1.0, upper=np.inf)
    assert sm.excess(MOTION, inside).value == 0.0
    far = sm.AffineMotion(MOTION.basis, MOTION.linear, 1e14 * (MOTION.translation + 1))
    power = sm.JetConstraint(lambda jet: jet.v[0] ** 24, lower=lower, upper=upper)
    assert sm.excess(far, power).value == np.inf


def test_expressions_that_are_no_polynomials_and_motions_that_are_no_splines_are_sampled():
    wave = sm.JetConstraint(lambda jet: ca.sin(jet.v[0]), lower=-np.inf, upper=0.1)
    found = sm.excess(MOTION, wave)
    true = highest(lambda t: np.sin(MOTION(t).translation[:, 0]), KEYS.times) / 0.1 - 1
    assert found.kind == "sampled" and found.value == pytest.approx(true, rel=1e-9)
    blend = sm.interpolants.polar_blend(KEYS)
    found = sm.excess(blend, sm.SpeedBound(TIP, 1.0))
    true = highest(lambda t: norm(blend.trajectory(TIP, t, 1)[:, 0]), KEYS.times) - 1
    assert found.kind == "sampled" and found.value == pytest.approx(true, rel=1e-9)
    swung = sm.interpolants.squad(KEYS.times, KEYS.rotations())
    found = sm.excess(swung, sm.RateBound(1.0))
    true = highest(lambda t: norm(swung.jet(t, 1).rate), KEYS.times) - 1
    assert found.kind == "sampled" and found.value == pytest.approx(true, rel=1e-6)


def test_conditions_at_times_are_looked_at_there():
    still = sm.JetConstraint(lambda jet: jet.dv, at=[0.5, 2.5], name="still")
    expected = np.abs(MOTION(np.array([0.5, 2.5]), 1).translation).max()
    assert sm.excess(MOTION, still).value == pytest.approx(expected)
    same = sm.JetConstraint(lambda a, b: a.v - b.v, at=[(0.5, 2.5)])
    assert sm.excess(MOTION, same).value == pytest.approx(np.abs(np.subtract(*MOTION([0.5, 2.5]).translation)).max())
    missed = KEYS.moved(2, translation=KEYS.translation[2] + np.array([0.0, 0.3, 0.0]))
    found = sm.excess(MOTION, sm.Tolerance(translation=0.1), keys=missed)
    assert found.value == pytest.approx(2.0) and found.time == KEYS.times[2]
    turned = sm.excess(POSE, sm.Tolerance(turn=0.1), keys=KEYS)
    assert turned.value == 0
    fast = C.CurveCondition.norm_below([1.0], 0.1)
    assert sm.excess(PATH, fast).value == pytest.approx(norm(PATH(1.0, 1)) / 0.1 - 1)


def test_parameters_and_several_bodies():
    floor = sm.JetConstraint(lambda jet, p: jet.v[2] - p.z, upper=np.inf, parameters={"z": 0.25})
    low = -highest(lambda t: -MOTION(t).translation[:, 2], KEYS.times)
    assert sm.excess(MOTION, floor).value == pytest.approx(0.25 - low, rel=1e-8)
    apart = sm.JetConstraint(lambda a, b: ca.sumsqr(a.v - b.v), lower=2.0, upper=np.inf)
    found = sm.excess({"a": MOTION, "b": PATH_MOTION}, apart)
    nearest = -highest(lambda t: -(norm(MOTION(t).translation - PATH_MOTION(t).translation) ** 2), KEYS.times)
    assert found.value == pytest.approx(max(0.0, 1 - nearest / 2), rel=1e-8, abs=1e-12)


PATH_MOTION = sm.AffineMotion(MOTION.basis, MOTION.linear, MOTION.translation[::-1])


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: sm.excess(MOTION, cast(Any, 3.0)), "constraint 3.0 is no condition"),
        (lambda: sm.excess(cast(Any, 3.0), sm.RateBound(1.0)), "a float is no motion or curve with a domain"),
        (lambda: sm.excess(MOTION, sm.constraints.Velocity(1, [0, 0, 0])), "this program has no keyframes"),
        (lambda: sm.excess(PATH, sm.RateBound(1.0)), "rate"),
    ],
)
def test_what_is_refused(call, message):
    with pytest.raises(sm.InputError, match=message):
        call()
