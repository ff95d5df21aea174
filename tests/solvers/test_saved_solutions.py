"""Solutions as files: the motion exactly, with multipliers, certificate and excess beside it as JSON has them."""

import json

import numpy as np
import pytest

import symmotion as sm

KEYS = sm.examples.random_keyframes(5, 60, seed=1)
TIP = np.array([0.3, 0.0, 0.1])


def saved(solution, path):
    solution.save(path)
    assert sm.load(path) == solution.motion
    return json.loads(path.read_text(encoding="utf-8"), parse_constant=pytest.fail)["solution"]


def test_the_motion_comes_back_with_multipliers_and_certificate_beside_it(tmp_path):
    solution = sm.ExactNewton().solve(sm.affine_program(KEYS)).require()
    told = saved(solution, tmp_path / "affine.json")
    pair = solution.multipliers["keyframes"]
    np.testing.assert_array_equal(told["multipliers"]["keyframes"]["linear"], pair.linear)
    np.testing.assert_array_equal(told["multipliers"]["keyframes"]["translation"], pair.translation)
    assert told["certificate"]["decrement"] == solution.certificate.decrement
    assert (told["status"], told["objective"]) == ("solved", solution.objective)
    assert sm.files.read_motion(tmp_path / "affine.json") == solution.motion


def test_of_bounds_the_excess_is_told_too(tmp_path):
    program = sm.pose_program(KEYS, constraints=[sm.RateBound(4.0)], refine=2)
    solution = sm.ExactNewton().solve(program).require(1e-6)
    told = saved(solution, tmp_path / "pose.json")
    assert told["certificate"]["excess"]["rate bound"]["kind"] == "certified"
    assert told["certificate"]["excess"]["rate bound"]["value"] == solution.certificate.excess["rate bound"].value
    np.testing.assert_array_equal(told["multipliers"]["rate bound"], solution.multipliers["rate bound"])


def test_what_is_not_finite_is_null_and_several_bodies_are_said(tmp_path):
    broken = sm.ExactNewton(max_iterations=0).solve(sm.affine_program(KEYS, objective=sm.Rigidity()))
    object.__setattr__(broken, "tolerance", np.inf)
    assert saved(broken, tmp_path / "broken.json")["tolerance"] is None
    bodies = sm.join({"a": sm.affine_program(KEYS), "b": sm.affine_program(KEYS)})
    with pytest.raises(sm.InputError, match=r"several bodies: save solution\.motions\['a'\]"):
        sm.ExactNewton().solve(bodies).save(tmp_path / "both.json")
    assert not (tmp_path / "both.json").exists()
