from typing import Any

import numpy as np
import pytest
from problems import body_points
from scipy.spatial.transform import Rotation

import symmotion as sm

WRONG: Any = sm  # what a type checker would refuse
RNG = np.random.default_rng(1)


def motion(dimension=3, degree=3):
    basis = sm.splines.BSplineBasis.clamped([0.0, 0.7, 1.5, 2.0], degree)
    linear = RNG.normal(size=(basis.n, dimension, dimension))
    return sm.AffineMotion(basis, linear, RNG.normal(size=(basis.n, dimension)))


@pytest.mark.parametrize("dimension", [2, 3])
def test_body_points_travel_on_splines_with_moved_controls(dimension):
    m = motion(dimension)
    p = RNG.normal(size=dimension)
    t = np.linspace(0, 2, 20).reshape(4, 5)
    expected = sm.splines.Spline(m.basis, m.translation + m.linear @ p)
    for nu in range(3):
        assert m.trajectory(p, t, nu).shape == (4, 5, 1, dimension)
        np.testing.assert_allclose(m.trajectory(p, t, nu)[..., 0, :], expected(t, nu), atol=1e-12)
    np.testing.assert_allclose(m.gram(t), m(t).linear.swapaxes(-1, -2) @ m(t).linear)


def test_refined_and_elevated_motions_are_the_same():
    m = motion()
    t = np.linspace(0, 2, 101)
    for same in (m.refined([0.3, 1.1]), m.elevated(2), m.refined([1.0]).elevated()):
        for nu in (0, 1, 2):
            np.testing.assert_allclose(same(t, nu).linear, m(t, nu).linear, atol=1e-11)
            np.testing.assert_allclose(same(t, nu).translation, m(t, nu).translation, atol=1e-11)
    assert np.abs(m.refined([0.3])(t).linear - m(t).linear).max() < 1e-12


def test_motion_raises_outside_its_domain_unless_asked():
    m = motion()
    with pytest.raises(sm.InputError, match="outside the domain"):
        m(2.1)
    assert np.isfinite(m(2.1, extrapolate=True).linear).all()
    with pytest.raises(sm.InputError, match=r"\(P, 3\)"):
        m.trajectory([1.0, 2.0], 0.5)


@pytest.mark.parametrize("method", ["uniform", "chordal", "centripetal"])
def test_parametrisations_follow_the_distances_of_body_points(method):
    keys = sm.examples.spatial_keyframes()
    points = body_points(3)
    given = keys.with_times(method, points)
    assert given.times[0] == keys.times[0]
    assert given.times[-1] == pytest.approx(keys.times[-1])
    deltas = []
    for i in range(3):
        moved = [keys.translation[k] + points @ keys.linear[k].T for k in (i, i + 1)]
        deltas.append(np.sqrt(np.mean([np.sum((b - a) ** 2) for a, b in zip(*moved, strict=True)])))
    steps = {"uniform": np.ones(3), "chordal": np.array(deltas), "centripetal": np.sqrt(deltas)}[method]
    np.testing.assert_allclose(np.diff(given.times) / np.diff(given.times).sum(), steps / steps.sum(), rtol=1e-12)


def test_keyframes_from_scipy_rotations_and_back():
    rotations = Rotation.random(5, random_state=0)
    keys = sm.Keyframes.from_rotations(range(5), rotations, RNG.normal(size=(5, 3)))
    assert (keys.rotations().inv() * rotations).magnitude().max() < 1e-14
    assert len(keys[1:4]) == 3
    assert repr(keys) == "Keyframes(5 in 3D, times 0 to 4)"


def test_moving_a_keyframe_leaves_the_others():
    keys = sm.examples.planar_keyframes()
    moved = keys.moved(-1, translation=[1.0, 2.0])
    np.testing.assert_array_equal(moved.translation[-1], [1.0, 2.0])
    np.testing.assert_array_equal(moved.translation[:-1], keys.translation[:-1])
    np.testing.assert_array_equal(moved.linear, keys.linear)


EYES = np.stack([np.eye(3)] * 3)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: sm.Keyframes([0, 1, 1], EYES), "keyframe 2, 1, repeats"),
        (lambda: sm.Keyframes([0, 2, 1], EYES), "keyframe 2, 1, comes before that of keyframe 1, 2"),
        (lambda: sm.Keyframes([0, np.nan, 1], EYES), "time of keyframe 1 is nan"),
        (lambda: sm.Keyframes([0, 1], EYES), "2 times for 3 linear parts"),
        (lambda: sm.Keyframes([0], EYES[:1]), "1 keyframe: a motion needs at least 2"),
        (lambda: sm.Keyframes([], EYES[:0]), "0 keyframes"),
        (lambda: sm.Keyframes([0, 1, 2], EYES[:, :2]), r"shape \(3, 2, 3\)"),
        (lambda: sm.Keyframes([0, 1, 2], EYES, np.zeros((3, 2))), r"\(3, 3\) is needed"),
        (lambda: sm.Keyframes([0, 1, 2], EYES, [[0, 0, 0], [0, np.inf, 0], [0, 0, 0]]), "keyframe 1 has an entry"),
        (lambda: sm.Keyframes.parametrised(EYES, method="chordal"), "keyframes 0 and 1 coincide"),
        (lambda: sm.Keyframes.parametrised(EYES, method="arc"), "'arc' is unknown; there are uniform"),
        (lambda: sm.Keyframes.parametrised(EYES, points=np.zeros((2, 2))), r"\(P, 3\)"),
        (lambda: sm.Keyframes([0, 1, 2], EYES).moved(3), "keyframe 3 does not exist"),
        (lambda: WRONG.Keyframes([0, 1, 2], EYES).moved("a"), "keyframe 'a' does not exist"),
        (lambda: WRONG.Keyframes([0, 1, 2], EYES).moved(1.0, EYES[0]), "keyframe 1.0 does not exist"),
        (lambda: sm.Keyframes([0, 1, 2], EYES).moved(0, [1.0, 2.0, 3.0]), r"linear of shape \(3,\): finite, \(3, 3\)"),
        (lambda: sm.Keyframes([0, 1, 2], EYES).moved(0, 0.0), r"linear of shape \(\): finite, \(3, 3\)"),
        (lambda: sm.Keyframes([0, 1, 2], EYES).moved(0, translation=1.0), r"translation of shape \(\): finite, \(3,\)"),
        (lambda: sm.Keyframes([0, 1, 2], 2 * EYES).rotations(), "position 0 is not rigid"),
        (lambda: sm.Keyframes([0, 1, 2], -EYES).rotations(), "position 0 is reflected"),
        (lambda: sm.Keyframes([0, 1, 2], -EYES).require_orientation("this"), "keyframe 0 is reflected"),
        (lambda: sm.Keyframes([0, 1, 2], EYES * [[[1]], [[0]], [[1]]]).require_orientation("x"), "1 is singular"),
        (lambda: sm.examples.quarter_turn().rotations(), "three dimensions"),
        (lambda: sm.examples.random_keyframes(1, 40, 0), "at least 2"),
        (lambda: sm.AffineMotion(sm.splines.BSplineBasis.clamped([0, 1], 1), EYES), r"\(2, d, d\)"),
        (lambda: sm.AffineMotion(sm.splines.BSplineBasis.clamped([0, 1], 1), EYES[:2], np.zeros((2, 2))), r"\(2, 3\)"),
    ],
)
def test_bad_input_names_the_culprit(make, message):
    with pytest.raises(sm.InputError, match=message):
        make()


def test_a_keyframe_moves_to_a_rotation():
    keys = sm.examples.random_keyframes(4, 60, seed=3)
    np.testing.assert_allclose(keys.moved(-1, keys.rotations()[1]).linear[3], keys.linear[1], atol=1e-15)


def test_random_keyframes_turn_by_the_angle_asked_for():
    keys = sm.examples.random_keyframes(6, 40, seed=3)
    turns = keys.rotations()
    np.testing.assert_allclose(np.rad2deg((turns[:-1].inv() * turns[1:]).magnitude()), 40, atol=1e-9)
