"""The sparse saddle system: its steps are exact, however stiff some bounds are."""

import numpy as np
import pytest

import symmotion as sm
from symmotion.program import Bounded, Evaluator
from symmotion.solvers.frame import Frame
from symmotion.solvers.journal import Journal
from symmotion.systems import Saddle

KEYS = sm.examples.random_keyframes(5, 50, 3)
POSE = sm.pose_program(
    KEYS.times, KEYS.rotations(), KEYS.translation, refine=2, constraints=[sm.SpeedBound([0.3, -0.1, 0.5], 4.0)]
)


@pytest.mark.parametrize("stiff", [0.0, 1e4, 1e8, 1e10])
def test_steps_are_exact_beside_stiff_bounds(stiff):
    frame = Frame(Bounded(POSE, "interpreted", 1), Journal(10), POSE.x0)
    system = frame.system(POSE.x0)
    assert isinstance(system, Saddle)
    gradient, matrix = frame.second_order(system, POSE.x0, np.zeros(system.m), 0.001)
    pressing = np.zeros(len(frame.lower))
    pressing[::3] = stiff * frame.size(system, matrix)
    frame.stiffen(matrix, system, POSE.x0, np.zeros_like(pressing), pressing, 0.001)
    factor = system.factorise(matrix)
    assert factor is not None
    rng = np.random.default_rng(1)
    right = np.concatenate([-gradient, rng.normal(size=system.m)])
    whole = system.matrix(matrix).toarray()
    # In units in which rows and columns are of size one.
    d = 1 / np.sqrt(np.abs(whole).max(axis=1))
    for _ in range(20):
        d /= np.sqrt(np.abs(whole * d * d[:, None]).max(axis=1))
    left = d * (right - whole @ system.solve(factor, right))
    assert np.linalg.norm(left) <= 1e-10 * np.linalg.norm(d * right)


def test_a_step_does_not_see_what_the_conditions_carry_of_a_gradient():
    """Beside multipliers of a million, decrements once were the rounding of these, and descents never ended."""
    keys = sm.examples.random_keyframes(5, 50, 2)
    ends = [(float(keys.times[0]), float(keys.times[-1]))]
    closed = sm.JetConstraint(lambda one, two: one.dv - two.dv, at=ends, name="closed")
    objective = sm.Rigidity(2) + 0.1 * sm.TrajectoryEnergy(np.zeros((1, 3)))
    program = sm.affine_program(keys, objective=objective, constraints=[closed])
    x, evaluator = sm.ExactNewton().solve(program).require().x, Evaluator(program)
    saddle = Saddle(program, evaluator.jacobian(x))
    gradient, matrix = evaluator.second_order(x, saddle.pattern)
    factor = saddle.factorise(matrix)
    assert factor is not None
    forces = 1e6 * np.random.default_rng(1).standard_normal(program.conditions)
    pulled = gradient + saddle.jacobian.T @ forces
    assert abs(pulled @ saddle.step(factor, pulled)) < 1e-12  # of a stationary point
