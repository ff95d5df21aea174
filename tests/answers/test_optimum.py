"""Minima inside larger CasADi programs, and what times cost."""

import casadi as ca
import numpy as np
import pytest

import symmotion as sm
from symmotion.answers import optimum_function, time_prices

KEYS = sm.examples.random_keyframes(5, 40, 0)
OBJECTIVE = sm.Rigidity() + 1e-2 * sm.TrajectoryEnergy(np.eye(3))
SOLVER = sm.ExactNewton(tolerance=1e-10, kernels="interpreted")
GIVEN = np.array([[0.1, 0.2, 0.3], [0.0, -0.1, 0.2]])
TOUCH = sm.JetConstraint(
    lambda jet, p: ca.vertcat(jet.dv - p.v[0, :].T, jet.ddv - p.v[1, :].T),
    at=[KEYS.times[2]],
    name="touch",
    parameters={"v": GIVEN},
)
SOLUTION = SOLVER.solve(sm.affine_program(KEYS, objective=OBJECTIVE, constraints=[TOUCH])).require()


@pytest.mark.parametrize("name", ["v", "touch", "keyframes"])
def test_derivatives_of_the_function_are_those_of_minima_solved_again(name):
    function = optimum_function(SOLUTION, name, solver=SOLVER)
    size = function.size1_in(0)
    p0 = GIVEN.ravel(order="F") if name == "v" else np.zeros(size)
    np.testing.assert_allclose(np.array(function(p0)[0]).ravel(), SOLUTION.x, atol=1e-9)
    p, seed = ca.MX.sym("p", size), np.random.default_rng(0).normal(size=size)
    x, f = function(p)
    scalar = ca.sumsqr(x) + f
    along = ca.Function("along", [p], [ca.jtimes(x, p, ca.DM(seed)), ca.jtimes(f, p, ca.DM(seed))])
    whole = ca.Function("whole", [p], [ca.jacobian(x, p), ca.gradient(scalar, p)])

    def value(h: float) -> np.ndarray:
        return np.concatenate([np.array(part).ravel() for part in function(p0 + h * seed)])

    h = 1e-4
    difference = (8 * (value(h) - value(-h)) - (value(2 * h) - value(-2 * h))) / (12 * h)
    found = np.concatenate([np.array(part).ravel() for part in along(p0)])
    np.testing.assert_allclose(found, difference, atol=1e-7)
    jacobian, gradient = (np.array(part) for part in whole(p0))
    np.testing.assert_allclose(jacobian @ seed, found[:-1], atol=1e-10)
    assert float(gradient[:, 0] @ seed) == pytest.approx(2 * SOLUTION.x @ found[:-1] + found[-1], abs=1e-8)


def test_a_minimum_is_part_of_a_larger_program():
    """The best velocity of an inner program that passes with a given one is that of a program without."""
    velocity = sm.JetConstraint(
        lambda jet, p: jet.dv - p.w, at=[KEYS.times[2]], name="passing", parameters={"w": [0.5, 0.0, 0.0]}
    )
    inner = SOLVER.solve(sm.affine_program(KEYS, objective=OBJECTIVE, constraints=[velocity])).require()
    function = optimum_function(inner, "w", solver=SOLVER)
    opti = ca.Opti()
    w = opti.variable(3)
    opti.minimize(function(w)[1])
    opti.set_initial(w, [0.5, 0.0, 0.0])
    opti.solver("ipopt", {"print_time": False, "ipopt.print_level": 0, "ipopt.sb": "yes"})
    found = opti.solve()
    free = SOLVER.solve(sm.affine_program(KEYS, objective=OBJECTIVE)).require()
    assert found.value(opti.f) == pytest.approx(free.objective, rel=1e-9)
    h = 1e-5
    there = (free.motion(KEYS.times[2] + h).translation - free.motion(KEYS.times[2] - h).translation) / (2 * h)
    np.testing.assert_allclose(np.array(found.value(w)), there, atol=1e-4)


def test_weights_have_no_function():
    function = optimum_function(SOLUTION, "weight of R", solver=SOLVER)
    with pytest.raises(RuntimeError, match="keyframes, limits, parameters or samples"):
        function(1.0)


@pytest.mark.parametrize("refine", [0, 1])
def test_times_have_prices(refine):
    solution = SOLVER.solve(sm.affine_program(KEYS, objective=OBJECTIVE, refine=refine)).require()
    prices = time_prices(solution)
    change, h = np.array([0.3, -0.5, 0.8, 0.1, -0.7]), 1e-4

    def again(share: float) -> sm.Solution:
        keys = sm.Keyframes(KEYS.times + share * change, KEYS.linear, KEYS.translation)
        return SOLVER.solve(sm.affine_program(keys, objective=OBJECTIVE, refine=refine), start=solution.x).require()

    at = {k: again(k * h) for k in (-2, -1, 1, 2)}

    def difference(values: dict[int, np.ndarray]) -> np.ndarray:
        return (8 * (values[1] - values[-1]) - (values[2] - values[-2])) / (12 * h)

    slope = difference({k: np.array(s.objective) for k, s in at.items()})
    assert prices.gradient @ change == pytest.approx(float(slope), abs=1e-8)
    np.testing.assert_allclose(prices.tangent(change), difference({k: s.x for k, s in at.items()}), atol=1e-7)
    np.testing.assert_allclose(prices.tangent([change, 2 * change])[1], 2 * prices.tangent(change), atol=1e-12)


def test_prices_of_times_vanish_where_times_are_free():
    free = SOLVER.solve(sm.free_times_program(KEYS, objective=OBJECTIVE)).require()
    keys = free.program.design.keyframes_at(free.x)
    prices = time_prices(SOLVER.solve(sm.affine_program(keys, objective=OBJECTIVE), start=free.motion).require())
    np.testing.assert_allclose(prices.gradient[1:-1], 0, atol=1e-8)
    assert prices.gradient[-1] == pytest.approx(-free.multipliers["total time"], rel=1e-7)


def test_what_has_no_prices_of_times():
    knots = SOLVER.solve(sm.affine_program(KEYS, objective=OBJECTIVE, knots=[0.4, 1, 2, 3])).require()
    with pytest.raises(sm.InputError, match="knots equally spaced between the keyframes"):
        time_prices(knots)
    with pytest.raises(sm.InputError, match="of the solution of an affine_program"):
        time_prices(SOLVER.solve(sm.free_times_program(KEYS)))
