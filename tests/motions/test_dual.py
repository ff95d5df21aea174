import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import symmotion as sm
from symmotion.motions.dual import DualQuaternions

RNG = np.random.default_rng(7)
TURNS = Rotation.random(12, random_state=3)
PLACES = RNG.normal(size=(12, 3)) * 4
NET = DualQuaternions.from_rotations(TURNS, PLACES)
POINTS = RNG.normal(size=(5, 3))


def carried(displacements, points):
    linear, translation = displacements.matrices
    return points @ np.swapaxes(linear, -1, -2) + translation[:, None]


def test_every_way_in_gives_the_same_displacements():
    axis_angle = TURNS.as_rotvec()
    angle = np.linalg.norm(axis_angle, axis=1)
    homogeneous = np.zeros((12, 4, 4))
    homogeneous[:, :3, :3], homogeneous[:, :3, 3], homogeneous[:, 3, 3] = TURNS.as_matrix(), PLACES, 1
    ways = (
        NET,
        DualQuaternions.from_axis_angle(3 * axis_angle, angle, PLACES),
        DualQuaternions.from_matrices(TURNS.as_matrix(), PLACES),
        DualQuaternions.from_matrices(homogeneous),
        DualQuaternions.from_parts(2.5 * TURNS.as_quat()[:, [3, 0, 1, 2]], PLACES),
    )
    for way in ways:
        np.testing.assert_allclose(way.matrices.linear, TURNS.as_matrix(), atol=1e-14)
        np.testing.assert_allclose(way.translation, PLACES, atol=1e-13)
        np.testing.assert_allclose(way.plucker, 0, atol=1e-14)


def test_a_quarter_turn_about_z_is_scalar_first():
    turn = DualQuaternions.from_axis_angle([0, 0, 2.0], np.pi / 2, [1.0, 2.0, 3.0])
    np.testing.assert_allclose(turn.real, [np.sqrt(0.5), 0, 0, np.sqrt(0.5)], atol=1e-16)
    np.testing.assert_allclose(turn.matrices.linear, [[0, -1, 0], [1, 0, 0], [0, 0, 1]], atol=1e-15)
    np.testing.assert_allclose(turn.dual[0], -0.5 * np.array([1, 2, 3]) @ turn.real[1:], atol=1e-16)


def test_translation_of_unnormalised_pairs_that_violate_the_plucker_condition():
    """PCG (9): a common factor, and a part of Q⁰ along Q, change neither rotation nor translation."""
    factor = RNG.uniform(0.2, 5, size=(12, 1))
    general = DualQuaternions(NET.real * factor, NET.dual * factor + RNG.normal(size=(12, 1)) * NET.real)
    assert np.abs(general.plucker).min() > 1e-3
    np.testing.assert_allclose(general.translation, PLACES, atol=1e-12)
    np.testing.assert_allclose(general.matrices.linear, TURNS.as_matrix(), atol=1e-14)


def test_products_and_inverses_are_those_of_homogeneous_matrices():
    other = DualQuaternions.from_rotations(TURNS[::-1], PLACES[::-1] + 1)
    both = NET @ other
    np.testing.assert_allclose(
        carried(both, POINTS),
        np.stack([carried(NET, p)[i] for i, p in enumerate(carried(other, POINTS))]),
        atol=1e-12,
    )
    unit = NET @ NET.inverse()
    np.testing.assert_allclose(unit.matrices.linear, np.broadcast_to(np.eye(3), (12, 3, 3)), atol=1e-14)
    np.testing.assert_allclose(unit.translation, 0, atol=1e-12)


def test_frame_changes_move_the_displaced_points_rigidly():
    fixed, moving = (DualQuaternions.from_rotations(TURNS[k], PLACES[k]) for k in (2, 5))
    seen = NET.seen_from(fixed, moving)
    new_body = POINTS @ moving.matrices.linear.T + moving.translation
    expected = carried(NET, POINTS) @ fixed.matrices.linear.T + fixed.translation
    np.testing.assert_allclose(carried(seen, new_body), expected, atol=1e-12)


@pytest.mark.parametrize("shape", [(9,), (5, 7)])
def test_alignment_undoes_any_choice_of_signs(shape):
    steps = Rotation.from_rotvec(0.2 * RNG.normal(size=(int(np.prod(shape)), 3)))
    smooth = DualQuaternions.from_rotations(steps, RNG.normal(size=(int(np.prod(shape)), 3)))
    real, dual = smooth.real.reshape(*shape, 4), smooth.dual.reshape(*shape, 4)
    real = real * np.sign(real[..., :1])
    dual = dual * np.sign(smooth.real.reshape(*shape, 4)[..., :1])
    signs = RNG.choice([-1.0, 1.0], size=(*shape, 1))
    aligned = DualQuaternions(real * signs, dual * signs).aligned()
    first = signs.ravel()[0]
    np.testing.assert_array_equal(aligned.real, first * real)
    np.testing.assert_array_equal(aligned.dual, first * dual)


def test_a_net_that_turns_too_far_around_a_cell_cannot_be_aligned():
    angles = np.deg2rad([[0.0, 120.0], [0.0, 240.0]])
    around = DualQuaternions.from_axis_angle(np.broadcast_to([0, 0, 1.0], (2, 2, 3)), angles)
    with pytest.raises(sm.InputError, match=r"\(0, 1\) and \(1, 1\) are in different hemispheres"):
        around.aligned()


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: DualQuaternions(np.zeros((3, 3))), r"shape \(3, 3\): \(…, 4\) is needed"),
        (lambda: DualQuaternions(np.ones((3, 4)), np.ones((2, 4))), r"\(2, 4\): \(3, 4\)"),
        (lambda: DualQuaternions(np.eye(4)[[0, 1]] * [[1], [0]]), "quaternion 1 is zero"),
        (lambda: DualQuaternions(np.ones((2, 2, 4)), np.full((2, 2, 4), np.inf)), r"quaternion \(0, 0\) is not finite"),
        (lambda: DualQuaternions.from_parts(np.ones((3, 4)), np.ones((3, 2))), r"\(3, 3\) is needed"),
        (lambda: DualQuaternions.from_axis_angle(np.zeros((2, 3)), np.ones(2)), "axis 0 is zero"),
        (lambda: DualQuaternions.from_axis_angle(np.ones((2, 3)), np.ones(3)), r"\(2, 3\) for angles of shape \(3,\)"),
        (lambda: DualQuaternions.from_matrices(2 * np.eye(3)[None]), "not rigid"),
        (lambda: DualQuaternions.from_matrices(np.diag([1, 1, -1.0])[None]), "reflected"),
        (lambda: DualQuaternions.from_matrices(np.ones((4, 4))), "last row"),
        (lambda: DualQuaternions.from_matrices(np.ones((2, 2))), r"\(…, 3, 3\)"),
        (lambda: DualQuaternions.from_matrices(np.full((1, 3, 3), np.nan)), "matrix 0 is not finite"),
    ],
)
def test_bad_input_names_the_culprit(make, message):
    with pytest.raises(sm.InputError, match=message):
        make()
