"""From its own minimum ExactNewton tries the other way round where keyframes turn far."""

import numpy as np
import pytest

import symmotion as sm
from symmotion.design.rigid_start import other_way
from symmotion.program import Evaluator
from symmotion.solvers.ways import LARGE, large_turns, turned

FAR = sm.affine_program(sm.examples.random_keyframes(6, 160, seed=3))


def planar(*degrees: float) -> sm.program.Program:
    linear = np.stack([sm.examples.rotation_2d(a) for a in degrees])
    return sm.affine_program(sm.Keyframes(np.arange(float(len(degrees))), linear, np.zeros((len(degrees), 2))))


def test_the_rule_takes_turns_of_more_than_120_degrees_the_largest_first():
    assert np.degrees(LARGE) == pytest.approx(120)
    program = planar(0, 125, 244, 94, -66, 49)  # turns of 125, 119, 150, 160, 115
    assert large_turns(program, 9) == [3, 2, 0]
    assert large_turns(program, 2) == [3, 2] and large_turns(program, 0) == []
    fit = sm.fit_program(sm.examples.random_keyframes(12, 160, seed=2), controls=5, objective=sm.Rigidity())
    assert large_turns(fit, 3) == []


def test_the_lower_minimum_is_found_that_twenty_starts_knew():
    """Six keyframes turned by 160°: 2.833 from the program's own start alone, 1.987 is known."""
    own = sm.ExactNewton(ways=0).solve(FAR).require()
    found = sm.ExactNewton().solve(FAR).require()
    assert own.objective == pytest.approx(2.8332, abs=1e-4)
    assert found.objective == pytest.approx(1.98722, abs=1e-5) and found.inertia == "positive"
    # Its own descent ends the log.
    assert found.log[-1].objective == pytest.approx(found.objective, rel=1e-12)
    assert found.iterations > own.iterations


def same_bits(one: sm.Solution, other: sm.Solution) -> None:
    np.testing.assert_array_equal(one.x, other.x)
    np.testing.assert_array_equal(one.multiplier_vector, other.multiplier_vector)
    assert [row.objective for row in one.log] == [row.objective for row in other.log]


def test_all_else_stays_as_it_was():
    easy = sm.affine_program(sm.examples.random_keyframes(5, 119, seed=0))
    same_bits(sm.ExactNewton().solve(easy), sm.ExactNewton(ways=0).solve(easy))
    # A start of the caller's own, too, though it is the program's.
    same_bits(sm.ExactNewton().solve(FAR, FAR.x0), sm.ExactNewton(ways=0).solve(FAR, FAR.x0))
    np.testing.assert_array_equal(FAR.x0, sm.affine_program(sm.examples.random_keyframes(6, 160, seed=3)).x0)


def test_where_it_finds_nothing_lower_the_minimum_is_the_own_one():
    program = planar(0, 150, 320)
    own, found = sm.ExactNewton(ways=0).solve(program), sm.ExactNewton().solve(program)
    np.testing.assert_array_equal(found.x, own.x)
    assert found.iterations > own.iterations
    assert found.log[-1] == own.log[-1]


def test_comparisons_are_of_equal_starts():
    comparison = sm.compare(FAR, [sm.ExactNewton(), sm.Ipopt()])
    newton = comparison.solutions[0]
    assert "ways=0" in newton.solver
    same_bits(newton, sm.ExactNewton(ways=0).solve(FAR))


def test_the_segment_turns_rigidly_the_other_way_and_the_rest_stays():
    program = planar(0, 30, 180, 210)
    x = turned(program, program.x0, 1)
    motion = program.design.motion(program.unpack(x))
    np.testing.assert_allclose(
        motion(0.5).linear, program.design.motion(program.unpack(program.x0))(0.5).linear, atol=0.2
    )
    middle = motion(1.5).linear
    angle = np.degrees(np.arctan2(middle[1, 0] - middle[0, 1], middle[0, 0] + middle[1, 1]))
    assert angle == pytest.approx(105 - 180, abs=1)
    assert np.abs(Evaluator(program).violation(x)).max() > 0  # which the solver mends


def test_the_longer_way_between_two_linear_parts():
    turn = np.stack([np.eye(2), 2 * np.array(sm.examples.rotation_2d(90))])
    halfway = other_way(turn, np.array([0.0, 0.5, 1.0]))
    np.testing.assert_allclose(halfway[[0, 2]], turn, atol=1e-12)
    np.testing.assert_allclose(halfway[1], 1.5 * np.array(sm.examples.rotation_2d(-135)), atol=1e-12)
    mirror = np.diag([1.0, -1.0])
    np.testing.assert_allclose(other_way(turn @ mirror, np.array([0.5]))[0], halfway[1] @ mirror, atol=1e-12)


def test_what_is_refused():
    with pytest.raises(sm.InputError, match="ways"):
        sm.ExactNewton(ways=-1)
