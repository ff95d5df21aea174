"""Bounds in the exact Newton method: against IPOPT, SciPy and what is known, for every kind of program."""

import casadi as ca
import numpy as np
import pytest
from problems import body_points
from scipy.optimize import minimize

import symmotion as sm
from studies.solving.bounded_problems import KINDS, problem
from studies.solving.problem_set import load, tasks
from symmotion.program import Bounded, Evaluator
from symmotion.systems import HessianTriangle

# Of each kind of program the seed of a small problem that has a solution.
FEASIBLE = {
    "speed": 0,
    "tolerance": 34,
    "no inversion": 46,
    "floor": 80,
    "keep out": 48,
    "fit": 27,
    "rate": 50,
    "torque": 40,
    "pose": 74,
    "curve": 64,
    "free times": 87,
}
KEYS = sm.examples.random_keyframes(6, 60, 1)
POINTS = body_points(3)
BOTH = sm.Rigidity() + 0.01 * sm.TrajectoryEnergy(POINTS)
NEWTON = sm.ExactNewton(kernels="interpreted")


def fastest() -> float:
    motion = NEWTON.solve(sm.affine_program(KEYS, objective=BOTH)).motion
    t = np.linspace(*motion.domain, 400)
    moved = motion(t, 1)
    places = np.einsum("nij,pj->npi", moved.linear, POINTS) + moved.translation[:, None]
    return float(np.linalg.norm(places, axis=2).max())


FASTEST = fastest()


def slowed(share: float = 0.97, **options) -> sm.program.Program:
    bound = sm.SpeedBound(POINTS, share * FASTEST)
    return sm.affine_program(KEYS, objective=BOTH, constraints=[bound], **options)


@pytest.mark.parametrize("kind", KINDS)
def test_every_kind_of_program_ends_where_ipopt_does(kind):
    program = problem(FEASIBLE[kind]).program
    newton = sm.ExactNewton().solve(program).require(1e-8)
    # At the times at which it ended, from its own start.
    ipopt = sm.Ipopt()._at_times(newton.program, None).require(1e-7)
    assert newton.objective == pytest.approx(ipopt.objective, rel=1e-8)
    assert newton.inertia == "positive"
    assert max((e.value for e in newton.certificate.excess.values()), default=0.0) <= 1e-7
    most = np.abs(ipopt.multiplier_vector).max()
    if not newton.certificate.degenerate:
        np.testing.assert_allclose(newton.multiplier_vector, ipopt.multiplier_vector, atol=1e-4 * most)


def test_a_quadratic_program_against_scipy():
    keys = sm.Keyframes([0.0, 1.0, 2.0, 3.0], np.tile(np.eye(2), (4, 1, 1)), [[0, 0], [1, 2], [2, -2], [3, 0]])
    low = sm.JetConstraint(lambda jet: jet.x[1], lower=-2.1, upper=2.05, at=np.linspace(0.1, 2.9, 15), name="strip")
    program = sm.curve_program(keys, degree=5, constraints=[low])
    solution = NEWTON.solve(program).require(1e-8)
    evaluator = Evaluator(program)
    jacobian, equal = evaluator.jacobian(program.x0).toarray(), program.lower == program.upper
    values = evaluator.values(np.zeros(program.unknowns))
    found = minimize(
        evaluator.objective,
        program.x0,
        jac=evaluator.gradient,
        method="SLSQP",
        constraints=[
            {
                "type": "eq",
                "fun": lambda x: (values + jacobian @ x - program.lower)[equal],
                "jac": lambda x: jacobian[equal],
            },
            {
                "type": "ineq",
                "fun": lambda x: (program.upper - values - jacobian @ x)[~equal],
                "jac": lambda x: -jacobian[~equal],
            },
            {
                "type": "ineq",
                "fun": lambda x: (values + jacobian @ x - program.lower)[~equal],
                "jac": lambda x: jacobian[~equal],
            },
        ],
        options={"maxiter": 500, "ftol": 1e-15},
    )
    assert solution.objective == pytest.approx(found.fun, rel=1e-7)
    # Both sides press, each with its own sign.
    assert solution.multipliers["strip"].max() > 1e-3 > -1e-3 > solution.multipliers["strip"].min()


def test_the_price_of_a_bound_is_its_multiplier():
    step = 1e-4 * FASTEST
    solution = NEWTON.solve(slowed()).require()
    beside = [NEWTON.solve(slowed(0.97 + s * 1e-4)).require().objective for s in (-1, 1)]
    limit = 0.97 * FASTEST
    # Of ‖v‖² ≤ limit²: the optimum changes by −λ with the bound.
    price = -2 * limit * solution.multipliers["speed"].sum()
    assert (beside[1] - beside[0]) / (2 * step) == pytest.approx(price, rel=1e-3)


def test_systems_and_kernels_agree():
    program = slowed()
    condensed, sparse = (sm.ExactNewton(system=s).solve(program).require() for s in ("condensed", "sparse"))
    np.testing.assert_allclose(condensed.x, sparse.x, atol=1e-9)
    np.testing.assert_allclose(condensed.multiplier_vector, sparse.multiplier_vector, atol=1e-8)
    first, second = (sm.ExactNewton(kernels=k).solve(program).x for k in ("interpreted", "compiled"))
    np.testing.assert_array_equal(first, second)


def test_equal_free_and_bounded_components_in_one_condition():
    at = [0.5 * (a + b) for a, b in zip(KEYS.times[:-1], KEYS.times[1:], strict=True)]
    free = NEWTON.solve(sm.affine_program(KEYS, objective=BOTH)).motion(np.array(at)).translation
    lower, upper = np.full((5, 3), -np.inf), np.full((5, 3), np.inf)
    lower[:, 0] = upper[:, 0] = free[:, 0] + 0.01  # given
    upper[:3, 1] = free[:3, 1] - 0.02  # bounded above, at some times
    lower[4, 2] = free[4, 2] + 0.02
    mixed = sm.JetConstraint(lambda jet: jet.v, lower=lower, upper=upper, at=at, name="mixed")
    program = sm.affine_program(KEYS, objective=BOTH, constraints=[mixed])
    newton, ipopt = NEWTON.solve(program).require(1e-8), sm.Ipopt().solve(program).require(1e-7)
    assert newton.objective == pytest.approx(ipopt.objective, rel=1e-9)
    np.testing.assert_allclose(newton.multipliers["mixed"], ipopt.multipliers["mixed"], atol=1e-5)
    assert (newton.multipliers["mixed"][3, 1:] == 0).all()


def test_parts_of_a_program_with_bounds_have_its_derivatives():
    program, rng = slowed(), np.random.default_rng(2)
    bounded, whole = Bounded(program, "interpreted"), Evaluator(program)
    x, d = program.x0 + 0.1 * rng.normal(size=program.unknowns), rng.normal(size=program.unknowns)
    jacobian = whole.jacobian(x)
    equal, bounds = bounded.places
    np.testing.assert_allclose(bounded.sides.along(x, d), jacobian[bounds] @ d, rtol=1e-12, atol=1e-12)
    weights, sigma = rng.normal(size=len(bounds)), rng.uniform(0, 1, len(bounds))
    np.testing.assert_allclose(bounded.sides.pull(x, weights), jacobian[bounds].T @ weights, atol=1e-10)
    triangle = HessianTriangle.of(bounded.framed)
    gradient, flat = bounded.second_order(x, triangle.pattern, np.zeros(len(equal)))
    flat = bounded.stiffen(flat, x, triangle.pattern, weights, sigma)
    theirs = HessianTriangle.of(program)
    wanted = theirs.full(
        whole.second_order(x, theirs.pattern, bounded.joined(np.zeros(len(equal)), weights))[1], program.unknowns
    ).toarray()
    normals = jacobian[bounds].toarray()
    np.testing.assert_allclose(gradient, whole.gradient(x), atol=1e-12)
    np.testing.assert_allclose(
        triangle.full(flat, program.unknowns).toarray(), wanted + normals.T @ (sigma[:, None] * normals), atol=1e-9
    )


def test_contradicting_bounds_are_named_and_proven_where_they_are_convex():
    solution = NEWTON.solve(slowed(0.5))
    assert solution.status == "infeasible"
    assert solution.message == "'keyframes' and 'speed' cannot hold together"
    with pytest.raises(sm.SolveError, match="cannot hold together"):
        solution.require()


def test_a_keep_out_around_a_keyframe_is_infeasible_nearby():
    centre = KEYS.translation[2] + 0.01
    out = sm.JetConstraint(lambda jet: ca.sumsqr(jet.v - centre), lower=0.1, upper=np.inf, at=KEYS.times, name="out")
    solution = NEWTON.solve(sm.affine_program(KEYS, objective=BOTH, constraints=[out]))
    assert solution.status == "infeasible"
    assert (
        "'out'" in solution.message
        and "'keyframes'" in solution.message
        and solution.message.endswith("near this motion")
    )


def test_a_neighbour_is_solved_from_a_solution_with_its_multipliers():
    program = slowed()
    first = NEWTON.solve(program).require()
    assert NEWTON.solve(program, start=first).require().objective == pytest.approx(first.objective, rel=1e-12)
    edited = program.with_keyframes(KEYS.moved(2, translation=KEYS.translation[2] + 0.02))
    assert edited.structure is program.structure
    warm, cold = NEWTON.solve(edited, start=first).require(), NEWTON.solve(edited).require()
    assert warm.objective == pytest.approx(cold.objective, rel=1e-10)
    ipopt = sm.Ipopt()
    again = ipopt.solve(edited, start=ipopt.solve(program)).require(1e-7)
    assert again.objective == pytest.approx(cold.objective, rel=1e-8)


def test_bounds_that_do_not_press_leave_the_solution_alone():
    loose, free = NEWTON.solve(slowed(2.0)).require(), NEWTON.solve(sm.affine_program(KEYS, objective=BOTH))
    assert loose.objective == pytest.approx(free.objective, rel=1e-10)
    assert (loose.multipliers["speed"] == 0).all()


def test_limits_and_callbacks_end_a_solve_between_bounds():
    program, rows = slowed(), []
    assert sm.ExactNewton(max_iterations=2).solve(program).status == "iteration-limit"
    assert sm.ExactNewton(time_limit=1e-9).solve(program).status == "time-limit"

    def stop(row) -> bool:
        rows.append(row)
        return len(rows) == 2

    assert sm.ExactNewton(callback=stop).solve(program).status == "stopped"
    solution = NEWTON.solve(program)
    assert solution.evaluations["bounds: hessian"] > 0 and solution.iterations > 0


@pytest.mark.parametrize("kind", ["repeated", "redundant"])
@pytest.mark.parametrize("k", range(1, 4))
def test_bounds_that_equalities_say_again_change_nothing(kind, k):
    program = tasks.program(f"{kind}-{k}")
    free = sm.affine_program(program.design.keyframes, objective=program.design.objective)
    assert NEWTON.solve(program).require().objective == pytest.approx(NEWTON.solve(free).objective, rel=1e-9)


@pytest.mark.parametrize("system", ["auto", "sparse"])
@pytest.mark.parametrize("squared", [False, True])
def test_a_bound_that_an_equality_of_the_users_implies_changes_nothing(system, squared):
    """Between the keyframes, where the equalities do not decouple: its distance is zero whatever the barrier."""
    free = NEWTON.solve(sm.affine_program(KEYS, objective=BOTH))
    place = float(free.motion(2.5).translation[0]) + 0.1
    said = sm.JetConstraint(lambda jet: jet.v[0], lower=place, upper=place, at=2.5, name="said")
    again = sm.JetConstraint(lambda jet: -jet.v[0], lower=-place, upper=np.inf, at=2.5, name="again")
    if squared:
        sign = np.sign(place)
        again = sm.JetConstraint(
            lambda jet: sign * jet.v[0] ** 2, lower=-np.inf, upper=sign * place**2, at=2.5, name="again"
        )
    alone, both = (sm.affine_program(KEYS, objective=BOTH, constraints=c) for c in ([said], [said, again]))
    solution = sm.ExactNewton(kernels="interpreted", system=system).solve(both).require()
    assert solution.objective == pytest.approx(NEWTON.solve(alone).require().objective, rel=1e-9)


@pytest.mark.parametrize("system", ["auto", "sparse"])
def test_steps_end_along_equalities_that_do_not_decouple(system):
    """A bound that does not press, beside rates that are equal at both ends: it once took all steps that there are."""
    keys = sm.examples.random_keyframes(5, 50, 2)
    objective = sm.Rigidity(2) + 0.1 * sm.TrajectoryEnergy(np.zeros((1, 3)))
    ends = [(float(keys.times[0]), float(keys.times[-1]))]
    closed = sm.JetConstraint(lambda one, two: one.dv - two.dv, at=ends, name="closed")
    program = sm.affine_program(keys, objective=objective, constraints=[closed, sm.SpeedBound(np.zeros(3), 8.0)])
    solution = sm.ExactNewton(kernels="interpreted", system=system).solve(program).require()
    assert not solution.multipliers["speed"].any() and solution.iterations < 40


@pytest.mark.parametrize("k", range(5))
def test_complementary_places_have_no_inside(k):
    name = f"corner-{k}"
    best = next(row["best"]["objective"] for row in load.manifest()["problems"] if row["name"] == name)
    program = tasks.program(name)
    # Rounding decides what becomes of a start: of hundred next to each other about eighty-seven get there.
    starts = [None, *(program.x0 * (1 + k * 1e-15) for k in (1, 2))]
    found = (NEWTON.solve(program, start) for start in starts)
    assert any(s.certified and s.objective <= best * (1 + 1e-8) for s in found)
