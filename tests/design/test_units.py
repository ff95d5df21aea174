"""Programs of every kind in other units of time and length, from other origins, over random problems."""

import numpy as np
import pytest

import symmotion as sm
from studies.affine.invariance_of_units import PROBLEMS, UNITS, Units, deviation

# Those whose solves take longest are asked by the study.
CHEAP = [name for name in PROBLEMS if name not in ("free times", "orientation, rate bound")]


@pytest.mark.parametrize("name", CHEAP)
def test_an_answer_is_the_same_in_other_units(name):
    number = CHEAP.index(name)
    for seed in (1, 2):
        units = UNITS[(number + seed) % len(UNITS)]
        found = deviation(PROBLEMS[name], units, seed)
        assert found.same, units
        assert found.iterations <= 1, units
        # Where places are given far away, and say something of the turns, these are known as well as those.
        assert found.linear <= (units.resolved if "given" in name else 1e-9), units
        assert found.place <= units.resolved, units
        assert found.multipliers <= max(1e-8, 100 * units.resolved if units.w else 0.0), units


@pytest.mark.parametrize("origin", [1.7e9, -1.7e9])
def test_programs_at_unix_time_are_those_from_zero_bit_for_bit(origin):
    keys = sm.examples.random_keyframes(5, 60, seed=3)
    steps = np.array([0.0, 1.0, 2.5, 3.0, 4.25]) * 2.0**-10
    near, far = (sm.Keyframes(t, keys.linear, keys.translation) for t in (steps, origin + steps))
    paths = sm.TrajectoryEnergy(np.eye(3))
    programs = (
        lambda k: sm.affine_program(k, objective=sm.Rigidity(2) + paths),
        lambda k: sm.pose_program(k),
        lambda k: sm.curve_program(k, order=3),
        lambda k: sm.fit_program(k, controls=4, objective=1e-9 * paths),
    )
    for program in programs:
        one, other = sm.ExactNewton().solve(program(far)), sm.ExactNewton().solve(program(near))
        assert one.objective == other.objective
        assert np.array_equal(one.x, other.x)
        assert one.motion.domain == (far.times[0], far.times[-1])
    energy = sm.Rigidity(2) + paths
    motions = [sm.ExactNewton().solve(programs[0](k)).motion for k in (far, near)]
    assert sm.measure(motions[0], energy) == sm.measure(motions[1], energy)


def test_free_times_at_unix_time():
    keys = sm.examples.random_keyframes(4, 60, seed=3)
    steps = np.array([0.0, 1.0, 2.5, 3.0]) * 2.0**-10
    near, far = (sm.Keyframes(t, keys.linear, keys.translation) for t in (steps, 1.7e9 + steps))
    one, other = (sm.Ipopt().solve(sm.free_times_program(k, objective=sm.Rigidity(2), refine=0)) for k in (far, near))
    assert np.array_equal(one.x, other.x)
    found = one.program.design.times(one.x)
    assert found == pytest.approx(1.7e9 + other.program.design.times(other.x), abs=5e-7)
    assert found[[0, -1]].tolist() == far.times[[0, -1]].tolist()


def test_what_reads_the_place_itself_may_be_far_away_too():
    # A spring to a point: the integrand knows where the origin is, and the program subtracts it all the same.
    keys = sm.examples.random_keyframes(4, 60, seed=3)
    t, answers = np.linspace(keys.times[0], keys.times[-1], 20), []
    for far in (0.0, 1e6):
        place = np.array([far, -far, 0.0])
        moved = sm.Keyframes(keys.times, keys.linear, keys.translation + place)
        spring = sm.JetEnergy(lambda jet, p=place: jet.v - p, squares=True, label="spring")
        objective = sm.Rigidity() + 0.1 * sm.TrajectoryEnergy(np.eye(3)) + spring
        solution = sm.ExactNewton().solve(sm.affine_program(moved, objective=objective)).require()
        assert np.abs(solution.program.x0).max() < 100
        assert sm.measure(solution.motion, objective) == pytest.approx(solution.objective, rel=1e-6)
        answers.append((solution.objective, solution.motion(t).linear))
    assert answers[1][0] == pytest.approx(answers[0][0], rel=1e-8)
    assert answers[1][1] == pytest.approx(answers[0][1], abs=1e-8)


def test_keyframes_of_no_extent_have_units():
    still = sm.Keyframes([0.0, 1.0, 2.0], np.tile(np.eye(3), (3, 1, 1)), np.full((3, 3), 1e7))
    solution = sm.ExactNewton().solve(sm.affine_program(still, objective=sm.TrajectoryEnergy(np.eye(3))))
    assert solution.status == "solved"
    assert solution.motion(0.5).translation.tolist() == [1e7] * 3


def test_units_say_what_they_resolve():
    assert Units("near").resolved == 1e-9
    assert Units("far", w=1e9).resolved == pytest.approx(1.4e-5, rel=0.1)
