from itertools import pairwise
from typing import Any, cast

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import symmotion as sm
from symmotion.answers.knots import span_contributions
from symmotion.motions.quaternions.algebra import aligned

KEYS = sm.examples.random_keyframes(6, 70, 3)
OBJECTIVE = sm.Rigidity(2) + 0.01 * sm.TrajectoryEnergy(np.eye(3))


def test_prices_predict_the_change_of_the_optimum():
    program = sm.affine_program(KEYS, objective=OBJECTIVE)
    solution = sm.ExactNewton().solve(program).require()
    prices = sm.answers.keyframe_prices(solution)
    assert list(prices.ranking) == sorted(range(6), key=lambda i: -prices.size[i])
    for i in prices.ranking[:3]:
        moved = prices.downhill(i, 1e-4)
        actual = sm.ExactNewton().solve(program.with_keyframes(moved), start=solution).require().objective
        change = actual - solution.objective
        assert prices.predict(moved) == pytest.approx(-1e-4 * prices.size[i], rel=1e-9)
        assert change == pytest.approx(prices.predict(moved), rel=1e-2)
        assert change < 0


@pytest.mark.parametrize("keys", [KEYS, sm.examples.planar_keyframes()], ids=["space", "plane"])
def test_turning_prices_are_the_change_per_radian(keys):
    program = sm.affine_program(keys, objective=sm.Rigidity(2))
    solution = sm.ExactNewton().solve(program).require()
    turning = sm.answers.keyframe_prices(solution).turning
    step = 1e-5

    def turn(angle):
        if keys.dimension == 2:
            return np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
        return Rotation.from_rotvec([0.0, angle, 0.0]).as_matrix()

    values = [
        sm.ExactNewton()
        .solve(program.with_keyframes(keys.moved(2, turn(a) @ keys.linear[2])), start=solution)
        .require()
        .objective
        for a in (step, -step)
    ]
    expected = turning[2] if keys.dimension == 2 else turning[2, 1]
    assert (values[0] - values[1]) / (2 * step) == pytest.approx(expected, rel=1e-5)


def test_a_free_keyframe_has_no_downhill():
    rigid = sm.Keyframes([0, 1, 2], np.stack([np.eye(3)] * 3))
    prices = sm.answers.keyframe_prices(sm.ExactNewton().solve(sm.affine_program(rigid)))
    with pytest.raises(sm.InputError, match="keyframe 1 costs nothing"):
        prices.downhill(1, 0.1)
    with pytest.raises(sm.InputError, match="as many"):
        prices.predict(KEYS)


def test_automatic_knots_beat_uniform_ones_on_uneven_keyframes():
    keys = sm.examples.uneven_turns()
    uniform = sm.ExactNewton().solve(sm.affine_program(keys, refine=3, objective=sm.Rigidity(2))).require()
    search = sm.answers.auto_knots(keys, objective=sm.Rigidity(2), budget=3 * (len(keys) - 1), fall=0.0)
    assert search.solution.program.unknowns <= uniform.program.unknowns
    assert search.solution.objective < 0.5 * uniform.objective
    values = [objective for _, objective in search.history]
    assert all(b <= a * (1 + 1e-9) for a, b in pairwise(values))
    assert "budget" in search.reason
    assert (
        "lowered the objective by less"
        in sm.answers.auto_knots(keys, objective=sm.Rigidity(2), budget=99, fall=0.9).reason
    )


def test_span_contributions_add_up():
    motion = sm.ExactNewton().solve(sm.affine_program(KEYS, objective=OBJECTIVE)).motion
    assert span_contributions(motion, OBJECTIVE).sum() == pytest.approx(sm.measure(motion, OBJECTIVE), rel=1e-12)


@pytest.mark.parametrize("count", [2, 3, 6])
def test_auxiliary_keyframes_lie_on_the_cubic_through_four_neighbours(count):
    keys = KEYS[:count]
    more = sm.answers.auxiliary_keyframes(keys, per_segment=2)
    assert len(more) == count + 2 * (count - 1)
    np.testing.assert_array_equal(more.times[::3], keys.times)
    np.testing.assert_array_equal(more.linear[::3], keys.linear)
    if count == 6:
        window = slice(1, 5)  # segment 2 lies in the middle of keyframes 1 to 4
        t = keys.times[window]
        lagrange = [np.prod([(more.times[7] - t[j]) / (t[i] - t[j]) for j in range(4) if j != i]) for i in range(4)]
        np.testing.assert_allclose(more.linear[7], np.tensordot(lagrange, keys.linear[window], 1), atol=1e-12)
    rigid = sm.answers.auxiliary_keyframes(keys, rigid=True)
    assert len(rigid.rotations()) == 2 * count - 1


def test_auxiliary_keyframes_of_the_second_kind_lie_on_rational_motions_through_four_neighbours():
    keys = sm.examples.random_keyframes(6, 120, 2)
    more = sm.answers.auxiliary_keyframes(keys, per_segment=2, rigid="rational")
    assert len(more.rotations()) == 16
    np.testing.assert_array_equal(more.linear[::3], keys.linear)
    t, at = keys.times[1:5], more.times[7]
    lagrange = [np.prod([(at - t[j]) / (t[i] - t[j]) for j in range(4) if j != i]) for i in range(4)]
    q = aligned(keys.rotations()[1:5].as_quat(scalar_first=True))
    mean = Rotation.from_quat(np.tensordot(lagrange, q, 1), scalar_first=True)
    np.testing.assert_allclose(more.linear[7], mean.as_matrix(), atol=1e-12)
    polar = sm.answers.auxiliary_keyframes(keys, per_segment=2, rigid="polar")
    assert polar == sm.answers.auxiliary_keyframes(keys, per_segment=2, rigid=True)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: sm.answers.auto_knots(KEYS, objective=sm.Rigidity(), budget=-1), "budget -1"),
        (lambda: sm.answers.auto_knots(KEYS, objective=sm.Rigidity(), budget=1, share=0.0), "share 0"),
        (lambda: sm.answers.auxiliary_keyframes(KEYS, per_segment=0), "per_segment 0"),
        (
            lambda: sm.answers.auxiliary_keyframes(
                sm.Keyframes([0, 1, 2], [np.eye(2), -0.1 * np.eye(2), np.diag([1.0, -1.0])]), rigid=True
            ),
            "between keyframes 1 and 2 the cubic is reflected",
        ),
        (lambda: sm.answers.auxiliary_keyframes(KEYS, rigid=cast(Any, "screw")), "there are polar, rational"),
        (
            lambda: sm.answers.auxiliary_keyframes(sm.examples.planar_keyframes(), rigid="rational"),
            "bodies in space: the keyframes are in the plane",
        ),
    ],
)
def test_bad_input_names_the_culprit(make, message):
    with pytest.raises(sm.InputError, match=message):
        make()


def test_knots_of_a_motion_that_costs_nothing_are_not_searched_for():
    still = sm.Keyframes([0.0, 1.0, 2.0, 3.0], np.tile(np.eye(2), (4, 1, 1)), np.zeros((4, 2)))
    search = sm.answers.auto_knots(still, objective=sm.Rigidity(), budget=1000)
    assert len(search.stages) == 1
    assert search.reason == "the objective is nothing but rounding"
