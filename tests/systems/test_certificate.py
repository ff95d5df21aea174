"""Certificates: points that are minima pass, and a thousand and more that only look like some are refused."""

import numpy as np
import pytest

import symmotion as sm
from studies.solving.certificates import E2, KINDS, TOLERANCE, affine, judged

COUNT = 8  # programs of a kind; the study has a hundred
RNG = np.random.default_rng(11)


@pytest.mark.parametrize("kind", KINDS)
def test_minima_pass_and_what_only_looks_like_one_is_refused(kind):
    found = judged(kind, COUNT)
    assert found["passed"] == found["true"] == COUNT
    assert found["refused"] == found["forged"] >= 2 * COUNT


def test_a_saddle_point_is_told_whoever_ends_there():
    """Turns by +180° and −180° are alike, so among motions that only scale the best one is stationary: a saddle."""
    keys = sm.Keyframes([0.0, 1.0], [np.eye(2), -np.eye(2)])
    solution = sm.solvers.Elimination().solve(sm.affine_program(keys, refine=0, objective=sm.Rigidity(2)))
    assert (solution.status, solution.inertia) == ("saddle", "indefinite")
    assert solution.certificate.stationary(TOLERANCE) and not solution.certificate.holds(TOLERANCE)


def test_a_hessian_that_is_zero_is_flat_and_the_point_a_minimum():
    keys = sm.Keyframes(np.arange(4.0), np.tile(np.eye(2), (4, 1, 1)), RNG.normal(size=(4, 2)))
    solution = sm.ExactNewton().solve(sm.affine_program(keys, degree=1, objective=E2)).require()
    assert (solution.inertia, solution.objective) == ("flat", 0.0)


def test_a_straight_motion_is_solved_where_nothing_but_rounding_is_left():
    keys = sm.examples.random_keyframes(2, 20, seed=1)
    for unit in (1e-9, 1e-2, 1.0, 1e9):
        quick = sm.Keyframes(unit * keys.times, keys.linear, keys.translation)
        energy = sm.TrajectoryEnergy(np.vstack([np.zeros(keys.dimension), np.eye(keys.dimension)]))
        solution = sm.ExactNewton().solve(sm.affine_program(quick, objective=energy)).require()
        assert solution.inertia == "positive"


def test_a_sign_is_wrong_on_one_side_only():
    """min (x − 1)² from 0 to 2, with x ≤ 1.5: neither bound presses; from there on none may."""
    program = affine(0, constraints=[sm.JetConstraint(lambda jet: jet.v[0], lower=-100.0, upper=100.0, name="wide")])
    solution = sm.Ipopt().solve(program).require()
    multipliers = solution.multiplier_vector.copy()
    for value in (1.0, -1.0):
        multipliers[-1] = value
        certificate = sm.certify(solution.program, solution.x, multipliers)
        assert not certificate.holds(TOLERANCE) and certificate.pressing > 0.1
