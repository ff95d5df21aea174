"""Bounds everywhere: they hold, by a bound; few times press; the motion is that of many fixed times."""

import pickle

import casadi as ca
import numpy as np
import pytest

import symmotion as sm
from studies.solving.bounded_problems import problem
from symmotion.batches import ResultsFile, solve_many
from symmotion.solvers import exchange

KEYS = sm.examples.random_keyframes(5, 60, 1)
TIP = np.array([0.3, 0.0, 0.1])
SMOOTH = sm.JetEnergy(lambda jet: ca.vertcat(ca.vec(jet.ddA), jet.ddv), squares=True, label="bends")
SOLVER = sm.Ipopt()


def speeding(share=0.97, keys=KEYS, **options):
    """A program of a quadratic objective whose speed is bounded a little below what is best without."""
    free = sm.ExactNewton().solve(sm.affine_program(keys, objective=SMOOTH)).require().motion
    t = np.linspace(*free.domain, 2001)
    limit = share * float(np.linalg.norm(free.trajectory(TIP, t, 1)[:, 0], axis=1).max())
    bound = sm.SpeedBound(TIP, limit, **options)
    return sm.affine_program(keys, objective=SMOOTH, constraints=[bound]), bound


PROGRAM, BOUND = speeding()
SOLUTION = SOLVER.solve(PROGRAM).require(1e-7)


def test_the_bound_holds_everywhere_and_is_certified():
    found = SOLUTION.certificate.excess["speed"]
    assert found.kind == "certified" and found.value <= 1e-7
    assert sm.excess(SOLUTION.motion, BOUND) == found
    t = np.linspace(*SOLUTION.motion.domain, 20001)
    fastest = np.linalg.norm(SOLUTION.motion.trajectory(TIP, t, 1)[:, 0], axis=1).max()
    assert fastest <= float(np.asarray(BOUND.limit)) * (1 + 1e-7)
    assert SOLUTION.exchange is not None and SOLUTION.exchange.holds
    assert SOLUTION.exchange.before["speed"].value > 1e-6


def test_it_is_the_limit_of_many_fixed_times():
    """The optimum grows with the times held, and what is exceeded between them falls as their distance squared."""
    objectives, exceeded = [], []
    for count in (200, 400):
        times = np.linspace(KEYS.times[0], KEYS.times[-1], count + 1)
        fixed = SOLVER._at_times(PROGRAM.with_times({"speed": times}), None)
        objectives.append(fixed.objective)
        exceeded.append(fixed.certificate.excess["speed"].value)
    assert objectives[0] <= objectives[1] * (1 + 1e-9) and objectives[1] <= SOLUTION.objective * (1 + 1e-8)
    assert objectives[1] == pytest.approx(SOLUTION.objective, rel=1e-4)
    assert exceeded[1] < 1e-3


def test_as_many_times_press_as_there_are_contacts_and_the_multipliers_are_theirs():
    program = SOLUTION.program
    times = np.asarray(program.constraint("speed").times)
    multipliers = SOLUTION.multipliers["speed"]
    assert multipliers.shape == (len(times), 1) and (multipliers > 0).all()
    assert sm.certify(program, SOLUTION.x, SOLUTION.multiplier_vector).holds(1e-7)
    speeds = np.linalg.norm(SOLUTION.motion.trajectory(TIP, times[:, 0], 1)[:, 0], axis=1)
    np.testing.assert_allclose(speeds, np.asarray(BOUND.limit), rtol=1e-6)
    assert (np.diff(times[:, 0]) > 1e-3).all()


def test_multipliers_tell_what_the_limit_costs():
    step = 1e-4
    limit = float(np.asarray(BOUND.limit))
    optima = []
    for sign in (1, -1):
        bound = sm.SpeedBound(TIP, limit * (1 + sign * step))
        optima.append(SOLVER.solve(sm.affine_program(KEYS, objective=SMOOTH, constraints=[bound])).objective)
    slope = (optima[0] - optima[1]) / (limit**2 * ((1 + step) ** 2 - (1 - step) ** 2))
    assert slope == pytest.approx(-SOLUTION.multipliers["speed"].sum(), rel=1e-3)


def test_what_is_told_of_it():
    told = str(SOLUTION.exchange)
    assert "rounds" in told and "speed at" in told and "certified excess" in told
    assert "excess" not in repr(SOLUTION)
    fixed = SOLVER._at_times(PROGRAM, None)
    assert "certified excess" in repr(fixed) and "of speed" in repr(fixed)
    assert f"everywhere, held at {PROGRAM.constraint('speed').block.count} times" in str(PROGRAM)


def test_any_function_that_solves_is_taken():
    calls = []

    def solve(program, start):
        calls.append(program.constraint("speed").block.count)
        return SOLVER._at_times(program, start)

    found = exchange(PROGRAM, solve, tolerance=1e-5)
    assert found.certificate.excess["speed"].value <= 1e-5
    assert len(calls) == len(found.exchange.rounds)  # pyright: ignore[reportOptionalMemberAccess] it was exchanged
    assert found.objective == pytest.approx(SOLUTION.objective, rel=1e-4)


def test_a_start_that_was_exchanged_brings_its_times():
    again = SOLVER.solve(PROGRAM, start=SOLUTION)
    assert again.exchange is not None and len(again.exchange.rounds) == 1
    assert again.objective == pytest.approx(SOLUTION.objective, rel=1e-9)


def test_kernels_and_parameters_are_kept_at_other_times():
    floor = sm.JetConstraint(lambda jet, p: jet.place(TIP)[2] - p.z, upper=np.inf, parameters={"z": -9.0}, name="floor")
    program = sm.affine_program(KEYS, objective=SMOOTH, constraints=[floor]).with_parameters(z=-8.0)
    moved = program.with_times({"floor": np.array([0.3, 0.4])})
    old, new = program.constraint("floor"), moved.constraint("floor")
    assert new.block.kernel is old.block.kernel and new.block.count == 2
    assert moved.parameters["z"] == -8.0
    motion = moved.design.motion(moved.start)
    from symmotion.program import Evaluator

    values = moved.split(Evaluator(moved).values(moved.x0))["floor"][:, 0]
    np.testing.assert_allclose(values, motion.trajectory(TIP, [0.3, 0.4])[:, 0, 2] + 8.0)
    with pytest.raises(sm.InputError, match="a condition at given times stays there"):
        moved.with_times({"keyframes": [0.0]})


def test_programs_solutions_and_results_files_keep_it(tmp_path):
    copy = pickle.loads(pickle.dumps(SOLUTION))
    assert copy.certificate.excess["speed"] == SOLUTION.certificate.excess["speed"]
    moved = pickle.loads(pickle.dumps(PROGRAM)).with_times({"speed": [0.5]})
    assert moved.constraint("speed").block.count == 1
    path = tmp_path / "results"
    (first,) = solve_many([PROGRAM], SOLVER, results=path)
    (second,) = solve_many([PROGRAM], SOLVER, results=path)
    assert isinstance(first, sm.Solution) and isinstance(second, sm.Solution)
    assert second.exchange == first.exchange
    np.testing.assert_array_equal(second.program.constraint("speed").times, first.program.constraint("speed").times)
    assert second.certificate.excess == first.certificate.excess
    assert ResultsFile(path)


def test_orientations_are_certified_too():
    free = sm.ExactNewton().solve(sm.orientation_program(KEYS)).require().motion
    top = float(np.linalg.norm(free.rate(np.linspace(*free.domain, 2001)), axis=1).max())
    program = sm.orientation_program(KEYS, refine=2, constraints=[sm.RateBound(0.98 * top)])
    found = SOLVER.solve(program).require(1e-7)
    excess = found.certificate.excess["rate bound"]
    assert excess.kind == "certified" and excess.value <= 1e-7
    fastest = np.linalg.norm(found.motion.rate(np.linspace(*found.motion.domain, 20001)), axis=1).max()
    assert fastest <= 0.98 * top * (1 + 1e-7)


def fastest_change(motion):
    """The largest Frobenius norm of Ȧ, over many times."""
    return float(
        np.linalg.norm(motion(np.linspace(motion.domain[0], motion.domain[1], 4001), 1).linear, axis=(1, 2)).max()
    )


def test_free_times_fits_and_joined_programs():
    planar = sm.examples.planar_keyframes()
    rest = SOLVER.solve(sm.free_times_program(planar, objective=sm.Rigidity(2))).require(1e-7).motion
    limit = 0.9 * fastest_change(rest)
    bound = sm.JetConstraint(
        lambda jet: ca.sumsqr(jet.dA), lower=-np.inf, upper=limit**2, power=2, density=3, name="change"
    )
    timed = SOLVER.solve(sm.free_times_program(planar, objective=sm.Rigidity(2), constraints=[bound])).require(1e-7)
    assert timed.certificate.excess["change"].value <= 1e-7
    assert fastest_change(timed.motion) == pytest.approx(limit, rel=1e-6)

    bodies = {"left": PROGRAM, "right": sm.affine_program(KEYS.moved(2, translation=[0, 0, 1]), objective=SMOOTH)}
    joined = SOLVER.solve(sm.join(bodies)).require(1e-7)
    assert joined.certificate.excess["left: speed"].value <= 1e-7
    assert joined.motions["left"] is not None
    np.testing.assert_allclose(joined.multipliers["left: speed"], SOLUTION.multipliers["speed"], rtol=1e-4)

    samples = sm.examples.recorded_tour(60)
    loose = sm.ExactNewton().solve(sm.fit_program(samples, controls=12)).require().motion
    t = np.linspace(*loose.domain, 2001)
    limit = 0.97 * float(np.linalg.norm(loose(t, 1).translation, axis=1).max())
    fit = SOLVER.solve(sm.fit_program(samples, controls=12, constraints=[sm.SpeedBound([0.0, 0, 0], limit)]))
    assert fit.require(1e-7).certificate.excess["speed"].value <= 1e-7


def test_bounds_at_times_stay_and_tell_their_excess_there():
    near = sm.affine_program(KEYS, objective=SMOOTH, constraints=[sm.Tolerance(linear=0.05, translation=0.1)])
    found = SOLVER.solve(near).require(1e-7)
    assert found.exchange is None
    assert found.certificate.excess["tolerance"].value <= 1e-6
    start = near.design.motion(near.start)
    off = sm.certify(near, near.x0, np.zeros(near.conditions)).excess["tolerance"]
    assert off.value == pytest.approx(sm.excess(start, sm.Tolerance(linear=0.05, translation=0.1), keys=KEYS).value)


def test_an_excess_that_is_only_sampled_is_exchanged_and_said():
    limit = float(np.asarray(BOUND.limit))
    bent = sm.JetConstraint(
        lambda jet: ca.tanh(ca.sumsqr(jet.velocity(TIP)) / limit**2), lower=-np.inf, upper=np.tanh(1.0), name="bent"
    )
    found = SOLVER.solve(sm.affine_program(KEYS, objective=SMOOTH, constraints=[bent])).require(1e-7)
    excess = found.certificate.excess["bent"]
    assert excess.kind == "sampled" and excess.value <= 1e-7
    assert "sampled excess" in str(found.exchange)
    assert found.objective == pytest.approx(SOLUTION.objective, rel=1e-6)


def test_a_bound_that_a_keyframe_is_beyond_is_infeasible():
    """Times that follow the maxima come ever closer to the keyframe: that conflicts with none of them."""
    keys = sm.examples.random_keyframes(4, 40, seed=24)
    energies = sm.Rigidity() + 0.1 * sm.TrajectoryEnergy(np.eye(keys.dimension))
    most = keys.translation[:, 0].max() - 1e-4
    wall = sm.JetConstraint(lambda jet: jet.v[0], lower=-np.inf, upper=float(most), name="wall")
    solution = sm.ExactNewton().solve(sm.affine_program(keys, objective=energies, constraints=[wall]))
    assert solution.status == "infeasible"
    assert solution.message == "'keyframes' and 'wall' cannot hold together"


def test_where_the_bound_is_exceeded_between_its_times_nothing_is_called_solved():
    found = exchange(PROGRAM, SOLVER._at_times, most_rounds=1)
    assert found.certificate.excess["speed"].value > 1e-6
    assert found.status == "stalled" and not found.certified
    assert "speed is exceeded by" in found.message


def test_times_that_lead_back_to_themselves_are_left():
    """A pose whose tip cannot be as slow as asked: where contacts settle, and the solve from there, took turns."""
    found = sm.ExactNewton().solve(problem(195).program)
    assert found.status == "infeasible" and "'speed' cannot hold together" in found.message
    assert found.exchange is not None and len(found.exchange.rounds) < 20
