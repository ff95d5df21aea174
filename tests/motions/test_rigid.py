import numpy as np
import pytest
from scipy.linalg import polar
from scipy.spatial.transform import Rotation

import symmotion as sm
from symmotion.motions.examples import rotation_2d
from symmotion.motions.rigid import orthonormalise, polar_factors

RNG = np.random.default_rng(3)


def sliding(diagonals, times=(0.0, 1.0)):
    return sm.AffineMotion(sm.splines.BSplineBasis.clamped(times, 1), np.stack([np.diag(d) for d in diagonals]))


@pytest.mark.parametrize("d", [2, 3])
def test_polar_factors_are_those_of_scipy(d):
    matrices = RNG.normal(size=(6, d, d))
    rotations, stretches, sizes = polar_factors(matrices)
    for matrix, rotation, stretch, size in zip(matrices, rotations, stretches, sizes, strict=True):
        expected, expected_stretch = polar(matrix)
        np.testing.assert_allclose(rotation, expected, atol=1e-13)
        np.testing.assert_allclose(stretch, expected_stretch, atol=1e-13)
        np.testing.assert_allclose(size, np.linalg.eigvalsh(expected_stretch)[::-1], atol=1e-13)


@pytest.mark.parametrize("keys", [sm.examples.planar_keyframes(), sm.examples.spatial_keyframes()])
def test_samples_are_the_closest_rotations_and_the_deviation_their_distance(keys):
    motion = sm.ExactNewton().solve(sm.affine_program(keys)).motion
    t = np.linspace(0, 1, 17)
    rigid = orthonormalise(motion, t)
    linear, translation = motion(t)
    d = keys.dimension
    np.testing.assert_allclose(rigid.rotations.swapaxes(1, 2) @ rigid.rotations, np.stack([np.eye(d)] * 17), atol=1e-14)
    np.testing.assert_allclose(np.linalg.det(rigid.rotations), 1)
    np.testing.assert_array_equal(rigid.translation, translation)
    np.testing.assert_allclose(rigid.deviations, np.linalg.norm(linear - rigid.rotations, axis=(1, 2)), atol=1e-13)
    assert rigid.deviation == rigid.deviations.max() > 0.1
    # No rotation nearby is closer.
    for _ in range(20):
        angle = 0.1 * RNG.normal(size=3)
        turn = rotation_2d(np.rad2deg(angle[0])) if d == 2 else Rotation.from_rotvec(angle).as_matrix()
        assert (np.linalg.norm(linear - rigid.rotations @ turn, axis=(1, 2)) >= rigid.deviations - 1e-13).all()


def test_a_rigid_motion_keeps_its_rotations_and_scale_does_not_matter():
    keys = sm.examples.random_keyframes(5, 70, 1)
    motion = sm.AffineMotion(sm.splines.BSplineBasis.clamped(keys.times, 1), 1e-9 * keys.linear, keys.translation)
    at_keys = orthonormalise(motion, keys.times)
    np.testing.assert_allclose(at_keys.rotations, keys.linear, atol=1e-14)
    assert at_keys.deviation == pytest.approx(np.sqrt(3) * (1 - 1e-9))
    again = at_keys.keyframes
    np.testing.assert_array_equal(again.times, keys.times)
    assert orthonormalise(motion, 0.3).rotations.shape == (1, 3, 3)


def test_least_rigidity_comes_close_to_a_rigid_motion():
    keys = sm.examples.random_keyframes(6, 60, 0)
    program, t = sm.affine_program(keys), np.linspace(0, 5, 201)
    start = orthonormalise(program.design.motion(program.start), t).deviation
    assert orthonormalise(sm.ExactNewton().solve(program).motion, t).deviation < 0.05 * start


@pytest.mark.parametrize(
    ("motion", "times", "message"),
    [
        (sliding([[1, 1, 1], [-1, 1, 1]]), [0, 0.5, 0.6], "singular at time 0.5"),
        (sliding([[1, 1, 1], [-1, 1, 1]]), [0, 0.6, 1.0], "reflected at time 0.6"),
        (sliding([[1, 1], [0, 0]]), 1.0, "singular at time 1.0"),
        (sliding([[1, 1], [np.nan, 1]]), [0.0, 1.0], "not finite at time"),
        (sliding([[1, 1], [2, 1]]), [0.0, 1.5], "1.5 is outside the domain"),
        (sliding([[1, 1], [2, 1]]), [], "N ≥ 1"),
        (sliding([[1, 1], [2, 1]]), [[0.0]], r"shape \(1, 1\)"),
    ],
)
def test_what_cannot_be_made_rigid_is_named(motion, times, message):
    with pytest.raises(sm.InputError, match=message):
        orthonormalise(motion, times)


def test_a_body_that_collapses_between_rigid_keyframes_is_told():
    """Turned by 120° along a straight line of matrices: halfway the plane of the turn is halved, det A a quarter."""
    turns = np.stack([sm.examples.rotation_2d(0), sm.examples.rotation_2d(120)])
    linear = np.tile(np.eye(3), (2, 1, 1))
    linear[:, :2, :2] = turns
    keys = sm.Keyframes([2.0, 4.0], linear, [[0.0, 0, 0], [1, 0, 0]])
    solution = sm.ExactNewton().solve(sm.affine_program(keys, objective=sm.TrajectoryEnergy(np.eye(3)), refine=0))
    assert solution.status == "solved"
    (note,) = solution.notes
    assert "singular values of A are off by up to 0.5 (time 3), det A falls to 0.25 (time 3)" in note
    assert repr(solution).endswith("; between rigid keyframes the body is squeezed)")
    both = sm.ExactNewton().solve(sm.join({"a": solution.program, "b": solution.program}))
    assert both.notes == (f"a: {note}", f"b: {note}")


def test_free_times_tell_it_at_their_own_times():
    keys = sm.examples.random_keyframes(4, 140, seed=1)
    solution = sm.ExactNewton().solve(sm.free_times_program(keys, objective=sm.TrajectoryEnergy(np.eye(3)), refine=1))
    times = solution.motion.breakpoints[::2]
    np.testing.assert_allclose(solution.motion(times).linear, keys.linear, atol=1e-8)
    assert "between rigid keyframes the body is squeezed" in solution.notes[-1]


def test_keyframes_that_are_not_rigid_and_motions_that_are_say_nothing():
    keys = sm.examples.random_keyframes(4, 40, seed=1)
    solution = sm.ExactNewton().solve(sm.affine_program(keys))
    assert solution.notes == () and "squeezed" not in repr(solution)
    keys = sm.Keyframes(keys.times, 2 * keys.linear, keys.translation)
    assert sm.ExactNewton().solve(sm.affine_program(keys, objective=sm.TrajectoryEnergy(np.eye(3)))).notes == ()
