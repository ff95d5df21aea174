"""Torque-minimal orientation and pose programs: optima, multipliers, bounds, and the nonlinear Newton method."""

from itertools import pairwise

import casadi as ca
import numpy as np
import pytest
from turns import AXIS, units

import symmotion as sm
from studies.quaternions.uneven_torque import uneven_program
from symmotion.design.control_nodes import TURN
from symmotion.design.control_start import carried
from symmotion.design.orientation import orientation_program
from symmotion.design.pose import pose_program
from symmotion.jets import rotation
from symmotion.motions.quaternions import algebra as qa
from symmotion.motions.quaternions.curve import QuaternionMotion
from symmotion.motions.quaternions.interpolation import interpolate_quaternions
from symmotion.program import Evaluator
from symmotion.splines import gauss

TIMES = np.array([0.0, 0.7, 1.5, 2.0, 3.2])
INERTIA = np.array([[2.0, 0.3, 0.0], [0.3, 1.0, 0.1], [0.0, 0.1, 2.9]])
Q = units(5, 21, angle=1.2)
REST = np.zeros((2, 3))


def _by_gauss(motion, inertia, nodes):
    """∫ ‖τ‖² dt of a curve by so many Gauss nodes on every span."""
    points, weights = gauss(motion.basis, nodes)
    jet, moments = motion.jet(points, 2), np.diag(inertia) if np.ndim(inertia) == 1 else np.asarray(inertia)
    torque = jet.acceleration @ moments + np.cross(jet.rate, jet.rate @ moments)
    return float(np.sum(weights * np.sum(torque**2, axis=-1)))


def test_symbolic_exp_and_log_are_those_of_numbers_with_two_derivatives_through_zero():
    v = ca.SX.sym("v", 3)
    q = ca.SX.sym("q", 4)
    both = ca.Function("both", [v], [rotation.exp(v), rotation.log(rotation.exp(v))])
    curved = ca.Function("curved", [v], [ca.hessian(ca.dot(rotation.exp(v), ca.DM([1, 2, 3, 4])), v)[0]])
    straight = ca.Function("straight", [q], [ca.jacobian(rotation.log(q), q)])
    for size in (0.0, 1e-9, 1e-3, 0.16, 0.2, 0.4999, 0.5001, 1.0, 2.9):
        x = size * AXIS
        there, back = both(x)
        np.testing.assert_allclose(np.asarray(there).ravel(), qa.exp(x), atol=1e-15)
        np.testing.assert_allclose(np.asarray(back).ravel(), x, atol=1e-13)
        assert np.isfinite(np.asarray(straight(qa.exp(x)))).all()
        h = 1e-4
        weights = qa.exp(x + h * (np.eye(3)[:, None] + np.eye(3))) - qa.exp(x + h * (np.eye(3)[:, None] - np.eye(3)))
        weights = weights - qa.exp(x - h * (np.eye(3)[:, None] - np.eye(3)))
        weights = weights + qa.exp(x - h * (np.eye(3)[:, None] + np.eye(3)))
        np.testing.assert_allclose(np.asarray(curved(x)), weights @ [1, 2, 3, 4] / (4 * h * h), atol=1e-6)
    longer = ca.Function("longer", [q], [rotation.log(q, ca.SX(1))])
    np.testing.assert_allclose(np.asarray(longer(qa.exp(0.4 * AXIS))).ravel(), (0.4 + 2 * np.pi) * AXIS, atol=1e-13)


def test_the_objective_is_the_torque_of_the_curve():
    program = orientation_program(TIMES, Q, objective=sm.Torque(INERTIA, gauss_nodes=10))
    motion = program.design.motion(program.start)
    assert Evaluator(program).objective(program.x0) == pytest.approx(_by_gauss(motion, INERTIA, 10), rel=1e-12)
    t, h = np.linspace(0.1, 3.1, 7), 1e-5
    momentum = lambda s: qa.rotate(motion(s), motion.rate(s) @ INERTIA)  # noqa: E731
    torque = (momentum(t + h) - momentum(t - h)) / (2 * h)  # the change of the momentum in the world's frame
    jet = motion.jet(t)
    body = jet.acceleration @ INERTIA + np.cross(jet.rate, jet.rate @ INERTIA)
    np.testing.assert_allclose(qa.rotate(jet.quaternion, body), torque, atol=1e-4)


def test_about_one_axis_the_optimum_is_the_natural_cubic():
    heights = np.array([0.0, 2.0, 1.0, 3.9, 3.0])
    program = orientation_program(TIMES, qa.exp(heights[:, None] / 2 * AXIS), objective=sm.Torque(2.0 * np.ones(3)))
    solution = sm.ExactNewton().solve(program).require(1e-8)
    scalar, t = sm.splines.cubic_interpolant(TIMES, heights), np.linspace(0, 3.2, 300)
    np.testing.assert_allclose(solution.motion.rate(t), scalar(t, 1)[:, None] * AXIS, atol=1e-9)
    np.testing.assert_allclose(solution.motion.acceleration(t), scalar(t, 2)[:, None] * AXIS, atol=1e-8)


@pytest.mark.parametrize("inertia", [None, INERTIA], ids=["unit", "asymmetric"])
def test_energy_falls_with_knots_and_both_solvers_agree(inertia):
    found = [sm.measure(interpolate_quaternions(TIMES, Q), sm.Torque(inertia))]
    for knots in (1, 2, 4, 8):
        program = orientation_program(TIMES, Q, objective=sm.Torque(inertia), refine=knots - 1)
        newton, ipopt = sm.ExactNewton().solve(program).require(1e-8), sm.Ipopt().solve(program).require(1e-7)
        assert newton.inertia == "positive"
        assert newton.objective == pytest.approx(ipopt.objective, rel=1e-9)
        assert newton.objective == pytest.approx(sm.measure(newton.motion, sm.Torque(inertia)), rel=1e-4)
        np.testing.assert_allclose(np.linalg.norm(newton.x.reshape(-1, 7)[:, 3:], axis=1), 1.0, atol=1e-8)
        found.append(sm.measure(newton.motion, sm.Torque(inertia)))
    assert all(b < a for a, b in pairwise(found))
    drops = -np.diff(found[1:])
    assert drops[-1] < 0.3 * drops[-2] < 0.3 * drops[-3]


def test_the_optimum_is_a_riemannian_cubic_where_knots_are_many():
    """Noakes, Heinzinger and Paden 1989: Ω⃛ = Ω̈ × Ω, so R Ω̈ is constant between keyframes; it jumps there by −λ/2."""
    solution = sm.ExactNewton().solve(orientation_program(TIMES, Q, refine=23)).require(1e-8)
    breaks = solution.motion.basis.breakpoints
    middle = (breaks[1:] + breaks[:-1]) / 2
    turned = qa.rotate(solution.motion(middle), solution.motion.jerk(middle)).reshape(4, 24, 3)
    assert turned.std(axis=1).max() < 0.01 * np.abs(turned).max()
    jumps = 2 * np.diff(turned.mean(axis=1), axis=0)
    prices = qa.rotate(solution.motion(TIMES), solution.multipliers["keyframes"])[1:-1]
    np.testing.assert_allclose(jumps, -prices, atol=0.01 * np.abs(prices).max())


@pytest.mark.parametrize("inertia", [None, INERTIA], ids=["unit", "asymmetric"])
def test_multipliers_predict_the_change_of_energy_when_a_keyframe_turns(inertia):
    program = orientation_program(TIMES, Q, objective=sm.Torque(inertia))
    # The compiler would take longer than all these solves.
    solver = sm.ExactNewton(tolerance=1e-10, kernels="interpreted")
    solution = solver.solve(program)
    rng = np.random.default_rng(0)
    for i in range(len(Q)):
        axis = rng.normal(size=3)
        values = []
        for side in (1, -1):
            turned = Q.copy()
            turned[i] = qa.product(Q[i], qa.exp(side * 1e-4 / 2 * axis))
            again = program.with_keyframes(turned)
            assert again.structure is program.structure
            values.append(solver.solve(again, start=solution).objective)
        predicted = -solution.multipliers["keyframes"][i] @ axis
        assert (values[0] - values[1]) / 2e-4 == pytest.approx(predicted, rel=1e-5, abs=1e-5)


def test_end_conditions():
    rates, bends = np.array([[1.0, 0, -1], [0, 2, 0]]), np.array([[0.0, 1, 0], [3, 0, 0]])
    program = orientation_program(
        TIMES, Q, ends="clamped", end_rates=rates, constraints=[sm.constraints.EndAccelerations(bends)]
    )
    jet = sm.ExactNewton().solve(program).require(1e-8).motion.jet(TIMES[[0, -1]])
    np.testing.assert_allclose(jet.rate, rates, atol=1e-7)
    np.testing.assert_allclose(jet.acceleration, bends, atol=1e-6)
    closed = np.concatenate([Q[:-1], -Q[:1]])
    solution = sm.ExactNewton().solve(orientation_program(TIMES, closed, ends="periodic")).require(1e-8)
    jet = solution.motion.jet(TIMES[[0, -1]])
    np.testing.assert_allclose(jet.rate[0], jet.rate[1], atol=1e-10)
    np.testing.assert_allclose(jet.acceleration[0], jet.acceleration[1], atol=1e-9)
    assert solution.multipliers["keyframes"].shape == (5, 3)
    # Free ends have no torque at the optimum, up to what the knots allow.
    free = sm.ExactNewton().solve(orientation_program(TIMES, Q, refine=7)).motion
    assert np.abs(free.acceleration(TIMES[[0, -1]])).max() < 0.02 * np.abs(free.acceleration(TIMES)).max()


def test_whole_turns_about_one_axis_stay():
    heights = np.array([0.0, 0.5, 1.0, 1.6, 2.0])
    turns = [0, 1, 0, 0]
    program = orientation_program(TIMES, qa.exp(heights[:, None] / 2 * AXIS), turns=turns)
    scalar = sm.splines.cubic_interpolant(TIMES, heights + 2 * np.pi * np.array([0, 0, 1, 1, 1]))
    t = np.linspace(0, 3.2, 100)
    start = program.design.motion(program.start)
    np.testing.assert_allclose(start.rate(t), scalar(t, 1)[:, None] * AXIS, atol=1e-9)
    stationary = sm.ExactNewton(max_iterations=0).solve(program)
    assert stationary.stationarity < 1e-6 * np.abs(Evaluator(program).gradient(program.x0)).max()


BOUNDS = {"rate": sm.RateBound, "acceleration": sm.constraints.AccelerationBound}


def test_bounds_hold_and_cost():
    t = np.linspace(0, 3.2, 2000)
    free = sm.ExactNewton().solve(orientation_program(TIMES, Q, refine=2))
    for name, values in (("rate", free.motion.rate(t)), ("acceleration", free.motion.acceleration(t))):
        most = 0.9 * np.linalg.norm(values, axis=1).max()
        program = orientation_program(TIMES, Q, refine=2, constraints=[BOUNDS[name](most)])
        solution = sm.Ipopt().solve(program).require(1e-6)
        found = np.linalg.norm(getattr(solution.motion, name)(t), axis=1).max()
        assert found < 1.05 * most  # held at five parameters per span, not between them
        assert solution.objective > free.objective * (1 + 1e-6)
        bound = solution.multipliers[f"{name} bound"]
        assert bound.min() > -1e-6 and bound.max() > 1e-3
        assert sm.ExactNewton().solve(program).require().objective == pytest.approx(solution.objective, rel=1e-7)
    same = orientation_program(TIMES, Q, refine=2, constraints=[sm.constraints.TorqueBound(1e3)])
    assert sm.Ipopt().solve(same).objective == pytest.approx(free.objective, rel=1e-7)


def test_tolerances_save_energy():
    exact = sm.ExactNewton().solve(orientation_program(TIMES, Q))
    allowed = np.array([0.0, 0.1, 0.0, 0.05, 0.0])
    loose = sm.Ipopt().solve(orientation_program(TIMES, Q, constraints=[sm.Tolerance(turn=allowed)])).require(1e-6)
    missed = 2 * np.linalg.norm(qa.short_log(qa.product(qa.conjugate(Q), loose.motion(TIMES))), axis=1)
    assert (missed <= allowed + 1e-7).all() and missed[1] > 0.09
    assert loose.objective < 0.95 * exact.objective
    np.testing.assert_array_equal(loose.multipliers["keyframes"][[1, 3]], 0.0)


def test_a_start_is_carried_to_finer_knots():
    coarse = sm.ExactNewton().solve(orientation_program(TIMES, Q, refine=1))
    fine = orientation_program(TIMES, Q, refine=3)
    warm = sm.ExactNewton().solve(fine, start=coarse)
    assert warm.log[0].objective == pytest.approx(coarse.objective, rel=2e-2)
    assert warm.objective == pytest.approx(sm.ExactNewton().solve(fine).objective, rel=1e-9)
    again = sm.ExactNewton().solve(fine, start=warm)
    assert again.iterations <= 1  # the last one, which squares the error
    basis = sm.splines.BSplineBasis.clamped(np.linspace(0, 3.2, 41), 3)
    near, _ = carried(coarse.motion, basis)
    t = np.linspace(0, 3.2, 100)
    assert np.abs(near(t) - coarse.motion(t)).max() < 1e-3


ORIGIN = sm.TrajectoryEnergy(np.zeros((1, 3)))


def test_pose_program_is_both_programs_where_nothing_couples_them():
    places = np.random.default_rng(3).normal(size=(5, 3))
    program = pose_program(TIMES, Q, places, objective=sm.Torque(INERTIA) + ORIGIN)
    solution = sm.ExactNewton().solve(program).require(1e-8)
    alone = sm.ExactNewton().solve(orientation_program(TIMES, Q, objective=sm.Torque(INERTIA)))
    spline, t = sm.splines.cubic_interpolant(TIMES, places), np.linspace(0, 3.2, 50)
    np.testing.assert_allclose(solution.motion(t).translation, spline(t), atol=1e-8)
    assert solution.terms["torque"] == pytest.approx(alone.objective, rel=1e-9)
    np.testing.assert_allclose(solution.multipliers["keyframes"], alone.multipliers["keyframes"], atol=1e-5)


@pytest.mark.parametrize("ends", ["natural", "periodic"])
def test_pose_program_with_the_energy_of_body_points(ends):
    places = np.random.default_rng(3).normal(size=(5, 3))
    q = Q.copy()
    if ends == "periodic":
        q[-1], places[-1] = q[0], places[0]
    energy = sm.TrajectoryEnergy(np.diag([1.0, 2.0, 0.0]), masses=np.array([1.0, 2.0, 3.0]))
    program = pose_program(TIMES, q, places, objective=0.1 * sm.Torque() + energy, ends=ends)
    solution, other = sm.ExactNewton().solve(program).require(1e-7), sm.Ipopt().solve(program).require(1e-6)
    assert solution.objective == pytest.approx(other.objective, rel=1e-9)
    np.testing.assert_allclose(solution.motion(TIMES).translation, places, atol=1e-8)
    points, weights = gauss(solution.motion.translation.basis, 6)
    paths = solution.motion.trajectory(energy.points, points, 2)
    direct = np.sum(weights * np.sum(np.sum(paths**2, axis=-1) * energy.masses, axis=-1))
    assert solution.terms["E"] == pytest.approx(direct, rel=1e-8)


def test_far_starts_are_convexified():
    """With a whole turn more about changing axes the start is no minimum: it can be unwound."""
    program = orientation_program(np.arange(5.0), Q, turns=[0, 1, 0, 0], refine=3)
    solution = sm.ExactNewton().solve(program).require(1e-7)
    assert any(row.inertia == "indefinite" for row in solution.log)
    assert solution.inertia == "positive"
    assert solution.objective == pytest.approx(sm.Ipopt().solve(program, start=solution).objective, rel=1e-9)


def test_a_curve_follows_its_increments_whichever_sign_its_controls_have():
    """−q_j is the orientation q_j, and the constraint "increments" holds for it as well."""
    program = orientation_program(np.arange(5.0), Q, turns=[0, 1, 0, 0])
    controls = program.unpack(program.x0)["controls"]
    flipped = controls.copy()
    flipped[3:6, TURN] *= -1
    t = np.linspace(0, 4, 50)
    motion, same = (program.design.motion({"controls": c}) for c in (controls, flipped))
    np.testing.assert_allclose(same.rate(t), motion.rate(t), atol=1e-12)
    np.testing.assert_allclose(np.abs(np.sum(same(t) * motion(t), axis=1)), 1.0, atol=1e-14)


def test_far_turns_at_uneven_times_have_the_energy_that_the_program_says():
    """Seeds that had minima of another winding than their curves, or were not found."""
    for seed in (67, 86):
        program = uneven_program(seed, 100.0)
        solution = sm.ExactNewton().solve(program).require()
        assert solution.objective == pytest.approx(sm.measure(solution.motion, program.design.objective), rel=1e-2)
        assert sm.Ipopt().solve(program, start=solution).objective == pytest.approx(solution.objective, rel=1e-6)


def test_failure_is_data():
    program = orientation_program(TIMES, Q, objective=sm.Torque(INERTIA))
    solution = sm.ExactNewton(max_iterations=1).solve(program)
    assert (solution.status, solution.iterations) == ("iteration-limit", 1)
    with pytest.raises(sm.SolveError, match="iteration-limit"):
        solution.require()


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"refine": -1}, "refine -1: a whole number of knots per segment, 0 or more"),
        ({"degree": 1}, "degree 1: a whole number, 2 or more"),
        ({"ends": "loose"}, "there are natural, clamped, periodic"),
        ({"ends": "clamped"}, "clamped ends need them"),
        ({"constraints": [sm.constraints.EndAccelerations([0])]}, r"finite, \(2, 3\)"),
        ({"inertia": np.eye(3)}, r"inertia is objective=Torque\(inertia\) from 0.2.0 on"),
        ({"nodes": 5}, r"nodes is objective=Torque\(inertia, gauss_nodes=…\)"),
        ({"end_accelerations": np.zeros((2, 3))}, r"end_accelerations is constraints=\[EndAccelerations"),
        ({"tolerances": 0.1}, r"tolerances is constraints=\[Tolerance\(turn=…\)\]"),
        (
            {"degree": 2, "refine": 0, "ends": "clamped", "end_rates": np.zeros((2, 3))},
            "7 conditions for 6",
        ),
    ],
)
def test_bad_input_names_the_culprit(options, message):
    with pytest.raises(sm.InputError, match=message):
        orientation_program(TIMES, Q, **options)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: sm.Torque([1.0, 2.0, 0.0]), "inertia is singular"),
        (lambda: sm.Torque(-np.eye(3)), "inertia is singular or not positive"),
        (lambda: sm.Torque([[1, 1, 0], [0, 1, 0], [0, 0, 1]]), "symmetric"),
        (lambda: sm.Torque(np.eye(2)), r"\(3, 3\) or \(3,\), is needed"),
        (lambda: sm.Torque(gauss_nodes=0), "Gauss nodes 0"),
        (lambda: sm.Tolerance(turn=[0, 0, -1, 0, 0]), "tolerance of keyframe 2 is -1"),
        (lambda: orientation_program(TIMES, Q, constraints=[sm.RateBound(0)]), "bound on the rate: 0"),
        (lambda: orientation_program(TIMES, Q, constraints=[sm.RateBound(1, density=0)]), "density 0"),
    ],
)
def test_energies_and_constraints_name_the_culprit(make, message):
    with pytest.raises(sm.InputError, match=message):
        make()


def test_more_bad_input():
    with pytest.raises(sm.InputError, match="half a turn apart"):
        orientation_program([0, 1], [[1, 0, 0, 0], [0, 1, 0, 0]])
    with pytest.raises(sm.InputError, match="time of keyframe 1"):
        orientation_program([0, 0, 1, 2, 3], Q)
    with pytest.raises(sm.InputError, match="translation of shape"):
        pose_program(TIMES, Q, np.zeros((4, 3)))
    with pytest.raises(sm.InputError, match="torque_weight is objective=weight"):
        pose_program(TIMES, Q, np.zeros((5, 3)), torque_weight=0)  # pyright: ignore[reportCallIssue]
    with pytest.raises(sm.InputError, match="does not see the translation: add a TrajectoryEnergy"):
        pose_program(TIMES, Q, np.zeros((5, 3)), objective=sm.Torque())
    with pytest.raises(sm.InputError, match="has no stages by 'knots'"):
        orientation_program(TIMES, Q).stages("knots")
    line = QuaternionMotion.bezier(Q[:2])
    assert sm.measure(line, sm.Torque()) == pytest.approx(0.0, abs=1e-12)


def test_keyframes_stand_for_times_and_quaternions():
    keys = sm.examples.random_keyframes(4, 50, 0)
    turns = keys.rotations()
    for whole, parts in (
        (orientation_program(keys), orientation_program(keys.times, turns)),
        (pose_program(keys), pose_program(keys.times, turns, keys.translation)),
    ):
        np.testing.assert_array_equal(whole.x0, parts.x0)
    with pytest.raises(sm.InputError, match="or Keyframes alone"):
        orientation_program(keys, turns)
    with pytest.raises(sm.InputError, match="times and quaternions are needed"):
        orientation_program(keys.times)


def test_energy_falls_towards_the_riemannian_cubic_of_an_independent_package():
    package = pytest.importorskip("interpolatepy", reason="the extra [bench] is not installed")
    keys = sm.examples.random_keyframes(5, 50, 1)
    q = keys.rotations().as_quat()[:, [3, 0, 1, 2]]
    shot = package.ShootingQuaternionInterpolation(keys.times, [package.Quaternion(*row) for row in q.tolist()])
    least = shot.acceleration_energy
    found = [sm.ExactNewton().solve(orientation_program(keys, refine=k - 1)).require().objective for k in (2, 8)]
    assert least < found[1] < found[0]
    assert found[1] == pytest.approx(least, rel=1e-4)
