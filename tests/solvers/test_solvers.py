from typing import Any

import casadi as ca
import numpy as np
import pytest
from problems import KNOWN, SOLVERS, body_points, quarter_turn

import symmotion as sm
from symmotion.solvers import solver_by_name
from symmotion.solvers.newton import first_minimum

MIXED = sm.Rigidity() + 0.1 * sm.TrajectoryEnergy(body_points(3))


@pytest.mark.parametrize("solver", SOLVERS, ids=repr)
@pytest.mark.parametrize("known", KNOWN.values(), ids=KNOWN)
def test_reaches_the_known_minimum(known, solver):
    solution = solver.solve(known.program).require(1e-8)
    assert solution.objective == pytest.approx(known.minimum, abs=5e-10 * max(1, known.minimum)), known.because
    assert solution.inertia == "positive"


@pytest.mark.parametrize("objective", [sm.Rigidity(), sm.Rigidity(2), MIXED], ids=lambda o: o.name)
def test_solvers_agree_on_minimiser_and_multipliers(objective):
    program = sm.affine_program(sm.examples.random_keyframes(6, 60, 5), objective=objective)
    comparison = sm.compare(program, [s for s in SOLVERS if s != sm.Elimination(stages="degree")])
    for solution in comparison.solutions:
        solution.require(1e-8)
        agreement = comparison.agreement(solution)
        assert agreement is not None
        minimiser, multipliers = agreement
        assert minimiser < 1e-6
        assert multipliers < 1e-6
        keyframes = solution.multipliers["keyframes"]
        assert keyframes.linear.shape == (6, 3, 3)
        assert keyframes.translation.shape == (6, 3)


@pytest.mark.parametrize("objective", [sm.Rigidity(2), MIXED], ids=lambda o: o.name)
def test_multipliers_are_minus_the_change_of_the_optimum(objective):
    keys = sm.examples.random_keyframes(5, 50, 2)
    program = sm.affine_program(keys, objective=objective)
    solution = sm.ExactNewton().solve(program).require(1e-9)
    price = solution.multipliers["keyframes"]
    step = 1e-5

    def optimum(i, entry, sign, part):
        change = np.zeros((3, 3) if part == "linear" else 3)
        change[entry] = sign * step
        moved = keys.moved(i, **{part: getattr(keys, part)[i] + change})
        return sm.ExactNewton().solve(program.with_keyframes(moved), start=solution).require(1e-8).objective

    for i, entry, part in [
        (0, (0, 1), "linear"),
        (2, (1, 1), "linear"),
        (4, (2, 0), "linear"),
        (3, (1,), "translation"),
    ]:
        slope = (optimum(i, entry, 1, part) - optimum(i, entry, -1, part)) / (2 * step)
        expected = -getattr(price, part)[i][entry]
        assert slope == pytest.approx(expected, rel=1e-6, abs=1e-8)
    if objective is not MIXED:
        assert not price.translation.any()


def test_convergence_is_quadratic_in_the_log():
    solution = sm.ExactNewton().solve(sm.affine_program(sm.examples.spatial_keyframes()))
    r = [row.stationarity for row in solution.log if row.stationarity > 1e-12]
    assert solution.log[-1].inertia == "positive"
    # r_{k+1} ≤ C r_k² with one constant over the last steps, and a fast last one.
    constants = [r[k + 1] / r[k] ** 2 for k in range(len(r) - 3, len(r) - 1)]
    assert r[-1] < 1e-4 * r[-2]
    assert max(constants) < 100
    assert all(row.theta == 1.0 for row in solution.log[-3:-1])


def test_log_and_seconds_tell_what_happened():
    solution = sm.ExactNewton().solve(sm.affine_program(sm.examples.random_keyframes(10, 90, 0)))
    assert solution.iterations == len(solution.log) - 1
    assert all(b.objective <= a.objective + 1e-12 for a, b in zip(solution.log, solution.log[1:], strict=False))
    assert all(row.violation < 1e-12 for row in solution.log)
    assert {row.inertia for row in solution.log} <= {None, "positive", "indefinite"}
    s = solution.seconds
    parts: tuple[Any, ...] = (s.build, s.compile, s.solve, s.evaluate, s.linear)
    build, compiling, solve, evaluate, linear = parts
    assert 0 < evaluate + linear <= solve
    assert s.total == pytest.approx(build + compiling + solve)


def test_a_solve_can_start_from_another_solution_or_motion():
    keys = sm.examples.random_keyframes(8, 60, 4)
    program = sm.affine_program(keys)
    first = sm.ExactNewton().solve(program)
    again = sm.ExactNewton().solve(program, start=first)
    assert again.iterations <= 1
    finer = sm.affine_program(keys, refine=3)
    from_motion = sm.ExactNewton().solve(finer, start=first.motion)
    assert from_motion.log[0].objective == pytest.approx(first.objective, rel=1e-9)
    assert from_motion.objective < first.objective
    with pytest.raises(sm.InputError, match="start of shape"):
        sm.ExactNewton().solve(program, start=np.zeros(3))


def test_a_start_that_is_almost_the_minimum_asks_for_no_more_digits_than_there_are():
    keys = sm.Keyframes([0, 1], np.array([np.eye(2), [[0, -1], [1, 0]]]))
    below, program = (sm.affine_program(keys, degree=k, refine=0, objective=sm.Rigidity()) for k in (3, 4))
    newton, ipopt = (
        s.solve(program, start=sm.ExactNewton().solve(below).motion) for s in (sm.ExactNewton(), sm.Ipopt())
    )
    # It ends by itself, not by its limit, and where the other does.
    assert ipopt.require().iterations < sm.Ipopt().max_iterations
    assert ipopt.objective == pytest.approx(newton.require().objective, abs=1e-18)


def test_moved_keyframes_reuse_structure_and_reach_the_same_optimum():
    keys = sm.examples.random_keyframes(8, 60, 4)
    program = sm.affine_program(keys)
    solution = sm.ExactNewton().solve(program)
    moved = keys.moved(3, linear=keys.linear[3] @ keys.linear[2].T @ keys.linear[3] * 0.5 + keys.linear[3] * 0.5)
    quick = program.with_keyframes(moved)
    assert quick.structure is program.structure
    warm = sm.ExactNewton().solve(quick, start=solution).require(1e-8)
    cold = sm.ExactNewton().solve(sm.affine_program(moved)).require(1e-8)
    assert warm.objective == pytest.approx(cold.objective, rel=1e-9)
    for solver in (sm.Ipopt(), sm.ExactNewton(system="sparse")):
        assert solver.solve(quick, start=solution).require(1e-8).objective == pytest.approx(cold.objective, rel=1e-9)


def test_an_integrand_that_is_no_sum_of_squares_is_solved():
    stretch = sm.JetEnergy(lambda jet: ca.exp(0.3 * ca.sumsqr(jet.gram_rate)), label="exponential")
    program = sm.affine_program(sm.examples.planar_keyframes(), objective=stretch)
    newton, ipopt = sm.ExactNewton().solve(program).require(1e-8), sm.Ipopt().solve(program).require(1e-8)
    assert newton.objective == pytest.approx(ipopt.objective, rel=1e-9)


def test_newton_leaves_a_saddle_point_along_negative_curvature():
    """Turns by +180° and −180° are alike, so among motions that only scale the best one is stationary: a saddle."""
    keys = sm.Keyframes([0.0, 1.0], [np.eye(2), -np.eye(2)])
    program = sm.affine_program(keys, degree=3, refine=0, objective=sm.Rigidity(2))
    stuck = sm.Elimination().solve(program)
    assert (stuck.status, stuck.inertia) == ("saddle", "indefinite")
    with pytest.raises(sm.SolveError, match="saddle"):
        stuck.require()
    for solver in (sm.ExactNewton(), sm.ExactNewton(system="sparse")):
        solution = solver.solve(program, start=stuck).require(1e-8)
        assert solution.log[0].inertia == "indefinite"
        assert solution.inertia == "positive"
        assert solution.objective < 0.5 * stuck.objective


def test_the_lower_of_two_descents_is_returned_where_conditions_leave_rounding_in_steps():
    """The gradient across the conditions is as large as the multipliers: a step may not be judged by it."""
    turning = sm.constraints.AngularRate(2, [0.1, 0.4, 0.7])
    program = sm.affine_program(sm.examples.spatial_keyframes(), constraints=[turning], refine=2)
    solution = sm.ExactNewton().solve(program).require()
    ends = [row.objective for row in solution.log if row.stationarity < 1e-8]
    assert max(ends) > 1.002 * min(ends)
    assert solution.objective == pytest.approx(min(ends), rel=1e-12)
    polished = sm.Ipopt(tolerance=1e-10).solve(program, start=solution).require(1e-9)
    assert polished.objective == pytest.approx(solution.objective, rel=1e-10)


def test_failure_is_data_and_require_raises():
    program = sm.affine_program(sm.examples.random_keyframes(8, 140, 1), objective=sm.Rigidity(2))
    for solver in (
        sm.ExactNewton(max_iterations=2),
        sm.Ipopt(max_iterations=2),
        sm.solvers.PlainIpopt(max_iterations=2),
        sm.Elimination(max_iterations=2),
    ):
        solution = solver.solve(program)
        assert solution.status == "iteration-limit"
        assert solution.iterations == 2
        with pytest.raises(sm.SolveError, match="iteration-limit"):
            solution.require()


def test_an_energy_that_is_not_a_number_is_reported():
    energy = sm.JetEnergy(lambda jet: ca.log(-1 - ca.sumsqr(jet.dA)), label="not a number")
    program = sm.affine_program(sm.examples.planar_keyframes(), objective=energy + sm.Rigidity())
    solution = sm.ExactNewton().solve(program)
    assert solution.status == "diverged"
    assert not solution.certificate.holds(1e300)


def test_elimination_diverges_or_stops_without_raising_where_newton_does_not():
    program = sm.affine_program(sm.examples.random_keyframes(8, 60, 0), degree=4, refine=2, objective=sm.Rigidity(2))
    classical = sm.Elimination().solve(program)
    assert classical.status in set(sm.solvers.Status)
    assert sm.ExactNewton().solve(program).require().objective <= classical.objective + 1e-12


def test_what_a_solver_cannot_take_is_said():
    program = sm.affine_program(sm.examples.random_keyframes(60, 40, 0), degree=5, refine=1)
    with pytest.raises(sm.InputError, match="insert more knots"):
        sm.Elimination().solve(program)
    with pytest.raises(sm.InputError, match='use system="sparse"'):
        sm.ExactNewton(system="condensed").solve(program)
    comparison = sm.compare(program)
    assert [s.status for s in comparison.solutions] == ["solved", "solved", "unsupported"]
    assert "insert more knots" in str(comparison)
    assert comparison.best in comparison.solutions[:2]
    assert comparison.agreement(comparison.solutions[2]) is None
    with pytest.raises(sm.InputError, match=r"damping 2\.0"):
        sm.Elimination(damping=2.0)
    with pytest.raises(sm.InputError, match="there are degree, knots"):
        sm.Elimination(stages="times")  # pyright: ignore
    with pytest.raises(sm.InputError, match="leave out start"):
        sm.Elimination(stages="knots").solve(quarter_turn(3), start=quarter_turn(3).x0)


def test_solver_names():
    assert solver_by_name("newton") == sm.ExactNewton()
    with pytest.raises(sm.InputError, match="'snopt' is unknown; there are newton"):
        solver_by_name("snopt")


def test_what_is_no_solver_is_said():
    program = quarter_turn(3)
    for solvers, message in (
        (sm.Ipopt(), r"solvers Ipopt\(.*\): a sequence is needed"),
        ([sm.Ipopt], r"solver Ipopt is a class: Ipopt\(\) makes one"),
        (["newton"], "solver 'newton' has no method solve"),
    ):
        with pytest.raises(sm.InputError, match=message):
            sm.compare(program, solvers)  # pyright: ignore
    for start in ("home", [1.0, 2.0], np.full(program.unknowns, np.nan)):
        with pytest.raises(sm.InputError, match="start"):
            sm.ExactNewton().solve(program, start=start)
    for start in (
        3.0,
        sm.AffineMotion,
        sm.quaternions.QuaternionMotion.bezier([[1, 0, 0, 0], [0.8, 0.6, 0, 0]]),
        sm.interpolants.component_cubic(sm.examples.spatial_keyframes()),
    ):
        with pytest.raises(sm.InputError, match=r"^start .*: a motion|^start .* is in 3D: 2D is needed"):
            sm.ExactNewton().solve(program, start=start)
    listed = sm.ExactNewton().solve(program, start=program.x0.tolist())
    assert listed.x.tobytes() == sm.ExactNewton().solve(program, start=program.x0).x.tobytes()


def test_comparison_prints_a_row_per_solver():
    comparison = sm.compare(quarter_turn(3))
    text = repr(comparison)
    assert text == str(comparison)
    assert [line.split()[0] for line in text.splitlines()] == ["solver", "newton", "ipopt", "elimination"]
    assert "0.002298006" in text


@pytest.mark.parametrize(
    ("quartic", "expected"),
    [
        ([0, -2, 1, 0, 0], 1.0),
        ([1, -4, 0, 0, 1], 1.0),
        ([0, -1, 0, 0, 0], 1.0),
        ([0, -1e-9, -1, 0, 1], 0.70710678),
        # Overflow is for the objective there to tell.
        ([0, -1, np.inf, 0, 1], 1.0),
        ([0, np.nan, 1, 0, 1], 1.0),
        ([0, -1e300, 0, 0, 1e-300], 1.0),
    ],
)
def test_first_minimum_of_a_quartic(quartic, expected):
    assert first_minimum(np.array(quartic, dtype=float)) == pytest.approx(expected, rel=1e-7)


@pytest.mark.parametrize("size", [1e-3, 1.0, 1e2])
@pytest.mark.parametrize("solver", [sm.ExactNewton(), sm.Ipopt()], ids=repr)
def test_units_of_length_do_not_matter(solver, size):
    keys = sm.examples.spatial_keyframes()
    scaled = sm.Keyframes(keys.times, size * keys.linear, size * keys.translation)
    solution = solver.solve(sm.affine_program(scaled)).require(1e-8)
    assert solution.objective / size**4 == pytest.approx(10.6588107062966, rel=1e-8)


def test_detail_far_from_the_origin_keeps_its_digits():
    keys = sm.examples.random_keyframes(6, 60, 3)
    objective = sm.Rigidity() + sm.TrajectoryEnergy(1e-3 * body_points(3))
    near = sm.Keyframes(keys.times, keys.linear, 1e-3 * keys.translation)
    far = sm.Keyframes(keys.times, keys.linear, 1e-3 * keys.translation + [1e6, -2e6, 3e6])
    solutions = [sm.ExactNewton().solve(sm.affine_program(k, objective=objective)).require(1e-8) for k in (near, far)]
    assert solutions[0].objective == pytest.approx(solutions[1].objective, rel=1e-6)
    reached = solutions[1].motion(keys.times)
    np.testing.assert_allclose(reached.translation, far.translation, atol=1e-8)


@pytest.mark.parametrize("step", [1.0, 0.01])
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_start_that_costs_nothing_is_the_end(seed, step):
    """Two keyframes and E alone: the linear motion has none, in a flat valley of others, and rounding leads nowhere."""
    keys = sm.examples.random_keyframes(2, 20, seed)
    keys = sm.Keyframes(step * keys.times, keys.linear, keys.translation)
    program = sm.affine_program(keys, objective=sm.TrajectoryEnergy(np.eye(keys.dimension)))
    for solver in (sm.ExactNewton(), sm.Ipopt(), sm.Elimination()):
        solution = solver.solve(program).require()
        assert abs(solution.objective) <= solution.certificate.rounding
        assert solution.iterations < solver.max_iterations / 10
