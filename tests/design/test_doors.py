"""What the doors of programs take, and what they say of what they do not take."""

from typing import Any, cast

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import symmotion as sm

KEYS = sm.examples.random_keyframes(4, 60, seed=3)
TURNS = Rotation.from_matrix(np.array(KEYS.linear))
wrong: Any = cast(Any, sm)  # for input that the type checker would not let through


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: wrong.curve_program("keys.tum"), r"keys 'keys.tum' is a path: read_keyframes\('keys.tum'\)"),
        (lambda: wrong.pose_program("keys.tum"), r"keys 'keys.tum' is a path: read_keyframes\('keys.tum'\)"),
        (lambda: sm.pose_program(KEYS.times, TURNS), r"translation: \(M, 3\), the places of the keyframes, is needed"),
        (lambda: wrong.affine_program(KEYS, objective=sm.Rigidity), r"objective Rigidity is a class: Rigidity\(…\) m"),
        (lambda: wrong.affine_program(KEYS, objective="R"), "objective 'R' is no energy, such as"),
        (lambda: wrong.affine_program(KEYS, constraints=[abs]), r"abs.* is no condition on a motion: JetConstraint\("),
    ],
)
def test_what_is_not_taken_is_named_with_what_is(make, message):
    with pytest.raises(sm.InputError, match=message):
        make()


def test_a_rigid_transform_brings_both_halves_of_a_pose():
    transform = pytest.importorskip("scipy.spatial.transform")
    if not hasattr(transform, "RigidTransform"):
        pytest.skip("SciPy has no RigidTransform before 1.16")
    poses = transform.RigidTransform.from_components(KEYS.translation, TURNS)
    program, same = sm.pose_program(KEYS.times, poses), sm.pose_program(KEYS)
    np.testing.assert_allclose(program.x0, same.x0, atol=1e-14)


def test_quaternions_may_have_their_scalar_last():
    last = TURNS.as_quat()
    for make, more in ((sm.orientation_program, ()), (sm.pose_program, (KEYS.translation,))):
        program = make(KEYS.times, last, *more, scalar_first=False)
        np.testing.assert_allclose(program.x0, make(KEYS.times, TURNS, *more).x0, atol=1e-14)


def test_energies_sum():
    assert sum([sm.Rigidity(), sm.Rigidity(2)]) == sm.Rigidity() + sm.Rigidity(2)


def test_all_that_is_public_is_listed():
    assert {"kernels", "systems", "views", "report"} <= set(dir(sm)) and len(sm.__all__) <= 60
