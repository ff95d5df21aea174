"""The objective that suits rigid keyframes: units do not matter, and motions are met as closely as by SciPy."""

import numpy as np
import pytest
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation, RotationSpline

import symmotion as sm
from symmotion.motions import polar_factors
from symmotion.smoothing import is_rigid, own_objective, rigid_objective, stiffness


def swing(count: int) -> sm.Keyframes:
    t = np.linspace(0.0, 6.0, count)
    turns = Rotation.from_rotvec(np.stack([np.sin(t), 0.5 * np.cos(1.3 * t), 0.3 * t], axis=1))
    return sm.Keyframes(t, turns.as_matrix(), np.stack([np.cos(t), np.sin(0.7 * t), 0.2 * t], axis=1))


def designed(keys: sm.Keyframes, objective: sm.energies.Energy) -> sm.AffineMotion:
    return sm.ExactNewton().solve(sm.affine_program(keys, objective=objective)).require().motion


def off(truth: sm.Keyframes, turns: Rotation, places: np.ndarray) -> np.ndarray:
    """Root mean square distance, and angle in rad."""
    angle = (truth.rotations().inv() * turns).magnitude()
    return np.sqrt([((places - truth.translation) ** 2).sum(axis=1).mean(), (angle**2).mean()])


@pytest.mark.parametrize("every", [6, 8, 12])
def test_a_swing_is_met_closer_than_by_splines_of_scipy(every):
    truth = swing(121)
    keys, t = truth[::every], truth.times
    since, places = np.array(keys.times), np.array(keys.translation)  # SciPy takes no arrays that refuse writes
    scipy = off(truth, RotationSpline(since, keys.rotations())(t), CubicSpline(since, places)(t))
    linear, places = designed(keys, rigid_objective(keys))(t)
    own = off(truth, Rotation.from_matrix(polar_factors(linear)[0]), places)
    # Ends that bend least, as those of the natural spline, are off by five to fifteen times as much in place.
    assert own[1] < 0.7 * scipy[1] and own[0] < 1.5 * scipy[0]


def test_neither_clock_nor_yardstick_nor_room_matters():
    keys = swing(15)
    turn = Rotation.from_rotvec([0.3, -1.0, 0.4])
    moved = sm.Keyframes(
        60 * keys.times + 5, turn.as_matrix() @ keys.linear, 1000 * keys.translation @ turn.as_matrix().T + [7, 8, 9]
    )
    mine, theirs = (designed(k, rigid_objective(k)) for k in (keys, moved))
    t = np.linspace(0, 6, 40)
    linear, places = theirs(60 * t + 5)
    np.testing.assert_allclose(linear, turn.as_matrix() @ mine(t).linear, atol=1e-8)
    np.testing.assert_allclose(places, 1000 * mine(t).translation @ turn.as_matrix().T + [7, 8, 9], atol=1e-5)


def test_the_stiffness_is_that_of_the_process():
    """Paths drawn from ∫ ‖ẍ‖² alone are rarely taken for stiffer ones; what is smooth is stiff. Over 20 draws."""
    t, rough = np.linspace(0, 7, 60), []
    for seed in range(20):
        # Twice integrated white noise, exactly: velocity and what it adds to a step are correlated (Wahba 1978).
        rng, h = np.random.default_rng(seed), t[1]
        root = np.linalg.cholesky(h * np.array([[1.0, h / 2], [h / 2, h**2 / 3]]))
        faster, further = np.einsum("ij,jkc->ikc", root, rng.normal(size=(2, 59, 6)))
        velocity = np.cumsum(faster, axis=0) - faster
        rough.append(stiffness(t, np.cumsum(np.concatenate([np.zeros((1, 6)), further + h * velocity]), axis=0)))
    assert np.median(rough) == 0.0 and max(rough) < 1.0
    assert stiffness(t, np.stack([np.sin(2 * t), np.cos(3 * t)], axis=1)) == 100.0
    assert stiffness(60 * t + 1e6, 1e-3 * np.sin(2 * t)[:, None]) == 100.0
    assert stiffness(t, np.ones((60, 2))) == stiffness(t, t[:, None]) == stiffness(t[:5], np.sin(t[:5])[:, None]) == 0.0


def test_what_is_rigid_has_an_objective_of_its_own():
    keys, affine = swing(8), sm.examples.planar_keyframes()
    assert is_rigid(keys) and not is_rigid(affine)
    assert own_objective(keys)[0] == rigid_objective(keys) and own_objective(affine)[1] == "R + 0.0111 E"
    still = sm.Keyframes(np.arange(8.0), np.tile(np.eye(3), (8, 1, 1)), np.ones((8, 3)))
    np.testing.assert_allclose(designed(still, rigid_objective(still))(np.linspace(0, 7, 9)).translation, 1, atol=1e-9)


def test_many_poses_are_few_iterations():
    """R alone leaves free how fast the body turns, and needs as many as the poses are close (64 for 3,000)."""
    keys = sm.examples.recorded_tour(601)
    solution = sm.ExactNewton().solve(sm.affine_program(keys, objective=rigid_objective(keys)))
    assert solution.certified and solution.inertia == "positive"
