"""Splines with an origin in time: as exact far from zero as they are there."""

import json
from typing import Any

import numpy as np
import pytest

import symmotion as sm
from symmotion.splines import BSplineBasis, Spline, closest, cubic_interpolant, from_origin, gauss, least_squares

UNIX = 1.7e9
STEPS = np.array([0.0, 1.0, 2.5, 3.0, 4.25, 5.0]) * 2.0**-10
COARSE = [0, 2, 5]
RNG = np.random.default_rng(4)


@pytest.mark.parametrize("far", [UNIX, -UNIX, 3 * STEPS[-1], -3 * STEPS[-1], 2.0**52 * 2.0**-10])
def test_the_origin_is_subtracted_exactly_and_added_back(far):
    times = far + STEPS
    origin, since = from_origin(times)
    assert origin == times[0]
    assert np.array_equal(origin + since, times)
    assert np.array_equal(since, times - times[0])


def test_near_zero_there_is_none():
    times = 0.1 + STEPS * 1000
    assert from_origin(times) == (0.0, pytest.approx(times, rel=0))
    assert BSplineBasis.clamped(times, 3).origin == 0.0


@pytest.mark.parametrize("make", [BSplineBasis.clamped, BSplineBasis.closed])
@pytest.mark.parametrize("degree", [1, 2, 3])
def test_a_basis_at_unix_time_is_the_one_from_zero_bit_for_bit(make, degree):
    far, near = make(UNIX + STEPS, degree), make(STEPS, degree)
    assert far.domain == (UNIX, UNIX + STEPS[-1])
    assert np.array_equal(far.breakpoints, UNIX + STEPS)
    t = np.linspace(0, STEPS[-1], 40)
    t = (UNIX + t) - UNIX
    for nu in range(degree + 1):
        assert np.array_equal(far(UNIX + t, nu), near(t, nu))
    assert far.relative == near
    assert np.array_equal(gauss(far.relative, 5)[0], gauss(near, 5)[0])
    assert far.about(UNIX - 8.0).about(UNIX) == far


def test_what_is_made_of_a_spline_keeps_its_origin():
    values = RNG.normal(size=(6, 2))
    t = (UNIX + np.linspace(0, STEPS[-1], 30)) - UNIX
    far, near = cubic_interpolant(UNIX + STEPS, values), cubic_interpolant(STEPS, values)
    basis, plain = BSplineBasis.clamped(UNIX + STEPS[COARSE], 3), BSplineBasis.clamped(STEPS[COARSE], 3)
    pairs = {
        "itself": (far, near),
        "derivative": (far.derivative(), near.derivative()),
        "elevated": (far.elevated(), near.elevated()),
        "refined": (far.refined([UNIX + 2.0**-10 * 0.5]), near.refined([2.0**-10 * 0.5])),
        "closest": (closest(basis, far, UNIX + STEPS[COARSE]), closest(plain, near, STEPS[COARSE])),
        "fitted": (least_squares(basis, UNIX + STEPS, values), least_squares(plain, STEPS, values)),
        "catmull": (sm.curves.catmull_rom(UNIX + STEPS, values), sm.curves.catmull_rom(STEPS, values)),
    }
    for what, (one, other) in pairs.items():
        assert one.basis.origin == UNIX, what
        assert np.array_equal(one(UNIX + t), other(t)), what
    around = np.concatenate([values[:-1], values[:1]])
    closed, plain = cubic_interpolant(UNIX + STEPS, around, "periodic"), cubic_interpolant(STEPS, around, "periodic")
    assert np.array_equal(closed.clamped()(UNIX + t), plain.clamped()(t))


def test_quaternion_curves_and_interpolants_too():
    keys = sm.examples.random_keyframes(6, 60, seed=2)
    quaternions = keys.rotations().as_quat()[:, [3, 0, 1, 2]]
    t = (UNIX + np.linspace(0, STEPS[-1], 30)) - UNIX
    far = sm.quaternions.interpolate_quaternions(UNIX + STEPS, quaternions)
    near = sm.quaternions.interpolate_quaternions(STEPS, quaternions)
    assert np.array_equal(far(UNIX + t), near(t))
    assert np.array_equal(far.acceleration(UNIX + t), near.acceleration(t))


def test_json_brings_the_origin_back(tmp_path):
    spline = cubic_interpolant(UNIX + STEPS, RNG.normal(size=(6, 12)))
    motion = sm.motions.AffineMotion.from_spline(spline, 3)
    for kept in (spline, motion):
        kept.save(tmp_path / "kept.json")
        assert sm.load(tmp_path / "kept.json") == kept
    sm.write_motion(motion, tmp_path / "motion.json")
    assert sm.load(tmp_path / "motion.json") == motion
    document = json.loads((tmp_path / "kept.json").read_text())
    # As files were before there were origins.
    document["basis"].pop("origin")
    (tmp_path / "kept.json").write_text(json.dumps(document))
    kept: Any = sm.load(tmp_path / "kept.json")
    assert kept.basis.origin == 0.0


def test_an_origin_is_a_finite_number():
    with pytest.raises(sm.InputError, match="origin inf: a finite number is needed"):
        BSplineBasis([0.0, 0.0, 1.0, 1.0], 1, origin=np.inf)


def test_a_spline_over_knots_far_away_is_brought_to_an_origin():
    plain = Spline(BSplineBasis(np.r_[[UNIX] * 4, UNIX + STEPS[1:-1], [UNIX + STEPS[-1]] * 4], 3), RNG.normal(size=8))
    moved = plain.about(UNIX)
    assert np.array_equal(moved.basis.knots, np.r_[[0.0] * 4, STEPS[1:-1], [STEPS[-1]] * 4])
    assert moved(UNIX + STEPS) == pytest.approx(plain(UNIX + STEPS), rel=1e-12)
