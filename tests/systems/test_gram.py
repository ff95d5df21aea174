"""Multipliers where rows depend on each other: next to the smallest of all that serve, and never an exception."""

import casadi as ca
import numpy as np
import pytest
from scipy import sparse

import symmotion as sm
from symmotion.program import Bounded, Evaluator
from symmotion.systems import Condensed, gram_factor
from symmotion.systems.pressed import Pressed

KEYS = sm.examples.random_keyframes(5, 60, 1)
SMOOTH = sm.JetEnergy(lambda jet: ca.vertcat(ca.vec(jet.ddA), jet.ddv), squares=True, label="bends")


@pytest.mark.parametrize("rows", [[[0.0, 0.0]], [[1.0, 2.0], [1.0, 2.0]], [[1.0, 2.0], [0.0, 0.0], [2.0, 4.0]]])
def test_it_solves_as_least_squares_do(rows):
    a, right = np.array(rows), np.array([0.3, -0.7])
    found = gram_factor(sparse.csr_array(a)).solve(a @ right)
    np.testing.assert_allclose(a.T @ found, a.T @ np.linalg.lstsq(a.T, right)[0], atol=1e-6)


def test_a_bound_that_keyframes_decide_has_multipliers():
    """Its normal vanishes along the keyframes, so that what it weighs is exactly nothing."""
    again = sm.JetConstraint(
        lambda jet: jet.v[0], lower=-np.inf, upper=float(KEYS.translation[2, 0]), at=KEYS.times[2], name="again"
    )
    program = sm.affine_program(KEYS, objective=SMOOTH, constraints=[again])
    solution = sm.ExactNewton().solve(program).require()
    bounded, evaluator = Bounded(program, "interpreted", 1), Evaluator(program)
    system = Condensed.of(bounded.framed)
    assert system is not None
    pressed = Pressed(bounded, system, solution.x, evaluator.jacobian(solution.x), bounded.places[1])
    gradient = evaluator.gradient(solution.x)
    found = pressed.multipliers(gradient)
    left = gradient + evaluator.jacobian(solution.x).T @ found
    assert np.abs(left).max() < 1e-6 * np.abs(gradient).max()
