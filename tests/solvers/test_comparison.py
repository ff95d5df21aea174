"""Comparisons: no minimum is called the best where a run has met a lower point, and one sentence tells who won."""

from dataclasses import dataclass, field

import numpy as np
import pytest

import symmotion as sm
from symmotion.program import Evaluator
from symmotion.solvers import Iteration, Status, conclude
from symmotion.solvers.minima import distinct, same

TURNS = np.stack([sm.examples.rotation_2d(a) for a in (0.0, 150.0, 320.0)])
KEYS = sm.Keyframes(np.arange(3.0), TURNS, 3.0 * np.array([[0.0, 0.0], [1.0, 0.4], [2.0, 0.0]]))
PROGRAM = sm.affine_program(KEYS, refine=0)
# Two of the four minima of these keyframes, see the study `minima`.
LOW, *_, HIGH = sm.explore(PROGRAM, budget=12, unseen=0).minima


def beside(minimum, size=1e-2, along=True):
    """A point near a minimum, which keeps the conditions or does not."""
    step = size * np.random.default_rng(0).normal(size=len(minimum.x))
    jacobian = Evaluator(PROGRAM).jacobian(minimum.x).toarray()
    return minimum.x + (step - np.linalg.lstsq(jacobian, jacobian @ step, rcond=None)[0] if along else step)


@dataclass(frozen=True)
class Wanderer:
    """A solver that is led along points, and says that it solved or failed at the last."""

    points: tuple = field(repr=False)
    status: Status = Status.SOLVED
    tolerance: float = 1e-8
    max_iterations: int = 100

    def solve(self, program, start=None):
        evaluate, points = Evaluator(program), self.points[: self.max_iterations + 1]
        log = [Iteration(evaluate.objective(x), 0.0, float(np.abs(evaluate.violation(x)).max())) for x in points]
        multipliers = HIGH.multiplier_vector if points[-1] is HIGH.x else np.zeros(program.conditions)
        failure = None if self.status is Status.SOLVED else (self.status, "tired")
        return conclude(program, self, points[-1], multipliers, log=log, failure=failure)


def test_minima_that_differ_lowest_first():
    assert same(LOW, LOW) and not same(LOW, HIGH)
    assert distinct([HIGH, LOW, HIGH]) == (LOW, HIGH)


def test_where_a_run_has_passed_lower_a_descent_begins():
    comparison = sm.compare(PROGRAM, [Wanderer((beside(LOW), HIGH.x))])
    (passed,) = comparison.solutions
    assert passed.certified and passed.objective == pytest.approx(HIGH.objective)
    (descent,) = comparison.descents
    assert descent.method == "newton from wanderer" and comparison.best is descent
    assert descent.objective == pytest.approx(LOW.objective) and descent.certified
    assert [m.objective for m in comparison.minima] == pytest.approx([LOW.objective, HIGH.objective])
    won = f"newton from wanderer won with {LOW.objective:.6g}, best of 2 minima"
    assert comparison.verdict == f"{won}; wanderer ended {HIGH.objective / LOW.objective:.3g} times as high."
    assert comparison.left == ()
    assert "newton from wanderer" in repr(comparison)


def test_where_a_run_has_failed_lower_a_descent_begins_too():
    solvers = [Wanderer((HIGH.x,)), Wanderer((HIGH.x, beside(LOW)), Status.STALLED)]
    comparison = sm.compare(PROGRAM, solvers)
    assert [s.status for s in comparison.found] == ["solved", "stalled", "solved"]
    assert comparison.best is comparison.descents[0] and len(comparison.minima) == 2
    assert "wanderer failed (stalled, " in comparison.verdict and "higher" in comparison.verdict


def test_points_that_miss_the_conditions_are_no_lower_ones():
    comparison = sm.compare(PROGRAM, [Wanderer((beside(LOW, along=False), HIGH.x))])
    assert comparison.descents == comparison.left == () and comparison.best is comparison.solutions[0]
    assert comparison.verdict == f"wanderer won with {HIGH.objective:.6g}, best of 1 minimum."


def test_a_lower_point_that_cannot_be_met_again_is_told():
    class Forgetful(Wanderer):
        """One that goes all the way, whenever it is told to stop."""

        def solve(self, program, start=None):
            return Wanderer(self.points).solve(program, start)

    low = Evaluator(PROGRAM).objective(beside(LOW))
    comparison = sm.compare(PROGRAM, [Forgetful((beside(LOW), HIGH.x))])
    assert comparison.descents == () and comparison.left == (("wanderer", low),)
    assert comparison.verdict.endswith(f"; wanderer met {low:.6g}, below which no minimum was certified.")


def test_the_real_solvers_agree_in_one_sentence():
    comparison = sm.compare(sm.affine_program(sm.examples.planar_keyframes()))
    best = comparison.best
    assert best is not None and len(comparison.minima) == 1 and comparison.descents == ()
    won, *others = comparison.verdict.split("; ")
    assert won.endswith(f" won with {best.objective:.6g}, best of 1 minimum") and len(others) == 2
    assert all(" got there in " in other and "times the time" in other for other in others)


def test_what_failed_is_said():
    program = sm.affine_program(sm.examples.planar_keyframes())
    comparison = sm.compare(program, [sm.ExactNewton(), sm.ExactNewton(max_iterations=1)])
    assert "; newton failed (iteration-limit, " in comparison.verdict and "higher)." in comparison.verdict
    nothing = sm.compare(program, [sm.Ipopt(max_iterations=0)])
    assert nothing.verdict == "No solver reached a minimum: ipopt iteration-limit."


def test_a_minimum_that_is_flat_is_not_listed_as_plain_solved():
    still = sm.Keyframes(np.arange(4.0), np.tile(np.eye(2), (4, 1, 1)), np.arange(8.0).reshape(4, 2) ** 2)
    program = sm.affine_program(still, degree=1, objective=sm.TrajectoryEnergy(np.eye(2)))
    comparison = sm.compare(program, [sm.ExactNewton()])
    (solution,) = comparison.solutions
    assert solution.ended == "solved, but flat" and not solution.certified
    assert "solved, but flat" in repr(comparison)
    assert comparison.verdict == "newton won with 0, best of 1 minimum, which is not certified (flat)."
