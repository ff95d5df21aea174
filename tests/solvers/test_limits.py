"""What every solver takes beside its own options: tolerance, max_iterations, time_limit and callback."""

import gc
import os
import pickle
import signal
import threading
import time
from dataclasses import replace
from typing import Any, cast

import casadi as ca
import numpy as np
import pytest

import symmotion as sm
from studies.solving.hard_keyframes import problem
from symmotion.program import Evaluator
from symmotion.solvers import PlainIpopt, Solver, solver_by_name

SOLVERS = (
    sm.ExactNewton(),
    sm.ExactNewton(system="sparse"),
    sm.Ipopt(),
    PlainIpopt(),
    sm.Elimination(),
    sm.Elimination(stages="knots"),
)


def hard() -> sm.program.Program:
    """A program that takes every solver a number of steps, and ExactNewton two descents."""
    return sm.affine_program(sm.examples.random_keyframes(4, 120, 1), objective=sm.Rigidity(2))


def curved() -> sm.program.Program:
    keys = sm.examples.random_keyframes(3, 90, 1)
    return sm.affine_program(keys, objective=sm.Rigidity(), constraints=[sm.constraints.UnitVolume([0.3])])


every = pytest.mark.parametrize("solver", SOLVERS, ids=repr)


@every
def test_what_claims_to_be_a_solver_is_one(solver):
    claimed: Solver = solver
    assert (claimed.tolerance, pickle.loads(pickle.dumps(solver))) == (1e-8, solver)
    assert eval(repr(solver), {**vars(sm), "PlainIpopt": PlainIpopt}) == solver
    assert hash(replace(solver, tolerance=1e-6)) == hash(replace(solver, tolerance=1e-6))
    solution = solver.solve(hard())
    assert solution.solver == repr(solver)
    assert solution.tolerance == solver.tolerance


@every
def test_the_callback_sees_every_row_and_changes_nothing(solver):
    rows: list[sm.solvers.Iteration] = []
    program = hard()
    watched = replace(solver, callback=rows.append)
    assert watched == solver and repr(watched) == repr(solver)
    solution, known = watched.solve(program), solver.solve(program)
    assert solution.x.tobytes() == known.x.tobytes()
    assert len(rows) >= len(solution.log) > 3
    assert {row.objective for row in rows} >= {row.objective for row in solution.log}


@every
def test_a_callback_that_returns_true_stops(solver):
    rows = []

    def third(row):
        rows.append(row)
        return len(rows) == 3

    solution = replace(solver, callback=third).solve(hard())
    assert solution.status == "stopped"
    assert len(rows) in (3, 4)
    assert np.isfinite(solution.x).all()
    with pytest.raises(sm.SolveError, match="stopped"):
        solution.require()


@every
def test_the_time_limit_ends_a_solve_where_it_is(solver):
    slow = replace(solver, time_limit=0.2, callback=lambda row: time.sleep(0.1))
    began = time.process_time()
    solution = slow.solve(hard())
    assert solution.status == "time-limit"
    assert solution.message in ("0.2 seconds", "Maximum_WallTime_Exceeded")
    assert time.process_time() - began < 2.0
    assert 1 <= len(solution.log) <= 4
    assert replace(solver, time_limit=60.0).solve(hard()).status == solver.solve(hard()).status


@pytest.mark.parametrize("solver", [sm.ExactNewton(), sm.Ipopt(), PlainIpopt()], ids=repr)
def test_so_do_they_along_curved_conditions(solver):
    assert replace(solver, callback=lambda row: True).solve(curved()).status == "stopped"
    slow = replace(solver, time_limit=1e-4, callback=lambda row: time.sleep(0.1))
    assert slow.solve(curved()).status == "time-limit"


@every
@pytest.mark.parametrize("error", [KeyError("mine"), KeyboardInterrupt()], ids=repr)
def test_an_exception_in_the_callback_comes_through(solver, error, capfd):
    def fail(row):
        raise error

    with pytest.raises(type(error)) as caught:
        replace(solver, callback=fail).solve(hard())
    assert caught.value is error
    assert not capfd.readouterr().err
    solver.solve(hard())  # and the next solve is as ever


@pytest.mark.parametrize("name", ["objective", "gradient", "second_order", "values"])
@pytest.mark.parametrize("error", [ZeroDivisionError("here"), KeyboardInterrupt()], ids=repr)
def test_an_exception_in_a_function_of_ipopt_comes_through(monkeypatch, capfd, name, error):
    calls = []
    genuine = getattr(Evaluator, name)

    def fail(*arguments, **options):
        calls.append(None)
        if len(calls) > 4:
            raise error
        return genuine(*arguments, **options)

    program = hard()
    monkeypatch.setattr(Evaluator, name, fail)
    with pytest.raises(type(error)) as caught:
        sm.Ipopt().solve(program)
    assert caught.value is error
    assert len(calls) == 5  # IPOPT has asked for nothing more
    captured = capfd.readouterr()
    assert not captured.err and not captured.out


@pytest.mark.skipif(os.name == "nt", reason="signals as POSIX has them")
@pytest.mark.parametrize("solver", [sm.ExactNewton(), sm.Ipopt(), sm.Elimination(), PlainIpopt()], ids=repr)
def test_ctrl_c_ends_a_solve_wherever_it_is(solver):
    """The signal comes at any time of a solve, which may be where no exception of ours gets through."""
    plain = isinstance(solver, PlainIpopt)
    energy = sm.Rigidity(2) + sm.JetEnergy(lambda jet: 1e-3 * ca.sin(40 * ca.sumsqr(jet.A)), label="wavy")
    keys = sm.examples.random_keyframes(4 if plain else 20, 120, 1)
    program = sm.affine_program(keys, objective=energy, refine=3)
    endless = replace(solver, max_iterations=10**6, tolerance=1e-300)
    random, handler, timers = np.random.default_rng(1), signal.getsignal(signal.SIGINT), []
    for _ in range(3 if plain else 30):
        sent = threading.Event()

        def interrupt(sent=sent):
            sent.set()
            os.kill(os.getpid(), signal.SIGINT)

        timer = threading.Timer(random.uniform(0.0, 0.1), interrupt)
        timers.append(timer)  # collected during a solve, it would run weak references' callbacks, which swallow errors
        with pytest.raises(KeyboardInterrupt):
            timer.start()
            while True:
                late = sent.is_set()
                endless.solve(program)
                assert not late, "the signal is lost"
        timer.join()
        assert signal.getsignal(signal.SIGINT) is handler


@pytest.mark.skipif(os.name == "nt", reason="signals as POSIX has them")
def test_what_a_handler_of_the_users_raises_ends_a_solve():
    def late(number, frame):
        raise TimeoutError("late")

    program, before = hard(), signal.signal(signal.SIGALRM, late)
    # Threads of other tests, collected as the solve begins, would run weak references' callbacks, which swallow errors.
    gc.collect()
    try:
        signal.setitimer(signal.ITIMER_REAL, 1e-3)
        with pytest.raises(TimeoutError, match="late"):
            sm.Ipopt(max_iterations=10**6, tolerance=1e-300).solve(program)
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)


@every
@pytest.mark.parametrize(
    ("option", "value", "message"),
    [
        ("tolerance", 0.0, r"tolerance 0\.0: a positive number"),
        ("tolerance", "1e-8", "tolerance '1e-8': a positive number"),
        ("tolerance", np.nan, "tolerance nan: a positive"),
        ("max_iterations", -1, "max_iterations -1: a whole number, 0 or more"),
        ("max_iterations", 2.5, r"max_iterations 2\.5: a whole number"),
        ("time_limit", 0, "time_limit 0: a positive number"),
        ("callback", "print", "callback 'print': a function of an Iteration"),
    ],
)
def test_options_are_refused_where_they_are_given(solver, option, value, message):
    with pytest.raises(sm.InputError, match=message):
        replace(solver, **{option: value})


@pytest.mark.parametrize("solver", [sm.ExactNewton, sm.Ipopt])
def test_kernels_and_threads_are_refused_where_they_are_given(solver):
    with pytest.raises(sm.InputError, match="kernels 'fast' is unknown; there are auto, compiled, interpreted"):
        solver(kernels="fast")
    for threads in (0, True, 1.5):
        with pytest.raises(sm.InputError, match=f"threads {threads!r}: a whole number, 1 or more"):
            solver(threads=threads)


def test_options_of_one_solver_are_refused_where_they_are_given():
    with pytest.raises(sm.InputError, match="system 'banded' is unknown; there are auto, condensed, sparse"):
        sm.ExactNewton(system="banded")  # pyright: ignore
    for damping in (0, -1, "half", np.nan):
        with pytest.raises(sm.InputError, match=f"damping {damping!r}"):
            sm.Elimination(damping=damping)  # pyright: ignore


def test_plain_ipopt_has_a_class_of_its_own():
    with pytest.raises(sm.InputError, match=r"derivatives 'plain': .* symmotion\.solvers\.PlainIpopt\(\)"):
        sm.Ipopt(derivatives="plain")
    assert sm.Ipopt(derivatives="mapped") == sm.Ipopt()
    assert solver_by_name("ipopt-plain") == PlainIpopt()
    solution = PlainIpopt().solve(hard())
    assert (solution.method, solution.solver[:11]) == ("ipopt-plain", "PlainIpopt(")


def test_ipopt_takes_its_own_options_by_their_own_names():
    options = {"mu_strategy": "adaptive", "mu_init": 1e-3, "hessian_approximation": "limited-memory"}
    solver = sm.Ipopt(options=options)
    options["mu_strategy"] = "monotone"
    assert solver.options["mu_strategy"] == "adaptive"
    assert "'mu_strategy': 'adaptive'" in repr(solver)
    assert solver != sm.Ipopt() and hash(solver) == hash(pickle.loads(pickle.dumps(solver)))
    program = hard()
    solution, usual = solver.solve(program), sm.Ipopt().solve(program)
    assert solution.iterations > 2 * usual.iterations  # without second derivatives
    scaled = sm.Ipopt(options={"obj_scaling_factor": 1.0, "print_level": 0}).solve(program)
    assert scaled.require().objective == pytest.approx(usual.objective, rel=1e-9)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"mu_stratgy": "adaptive"}, "option 'mu_stratgy': 'adaptive': IPOPT has no such option"),
        ({"mu_strategy": "other"}, "option 'mu_strategy': 'other': IPOPT has no such option, or does not take"),
        ({"mu_strategy": 3}, "option 'mu_strategy': 3"),
        ({"mu_init": -1.0}, r"option 'mu_init': -1\.0"),
        ({"ipopt.mu_init": 1.0}, "option 'ipopt.mu_init': IPOPT's own name is needed"),
        ({"tol": 1e-3}, "option 'tol': this is what the solver's argument tolerance says"),
        ({"max_iter": 3}, "argument max_iterations says"),
        ({"max_wall_time": 3.0}, "argument time_limit says"),
        ({"mu_oracle": None}, "option 'mu_oracle': None"),
        ({"sb": True}, "option 'sb': True"),
        (["mu_init"], r"options \['mu_init'\]: IPOPT's own by name are needed"),
    ],
)
def test_options_that_ipopt_does_not_take(options, message):
    with pytest.raises(sm.InputError, match=message):
        sm.Ipopt(options=options)


def test_a_variant_of_newton_takes_its_own_way_to_a_minimum():
    program = problem(26).program
    found = {s: sm.ExactNewton(steps=s).solve(program).require() for s in ("twice", "blend", "shifted")}
    descents = {name: [i.objective for i in s.log].count(s.log[0].objective) for name, s in found.items()}
    assert descents == {"twice": 2, "blend": 1, "shifted": 1}
    assert found["twice"].objective == min(found["blend"].objective, found["shifted"].objective)
    assert all(i.theta == 1.0 for i in found["shifted"].log if i.theta is not None)
    gauss = sm.ExactNewton(steps="gauss-newton").solve(hard()).require()
    thetas = [i.theta for i in gauss.log if i.theta is not None]
    assert thetas[0] == 0.0 and set(thetas) <= {0.0, 1.0}
    assert sm.ExactNewton(steps="gauss-newton").solve(curved()).certified
    with pytest.raises(sm.InputError, match="linear equalities only"):
        sm.ExactNewton(steps="shifted").solve(curved())
    with pytest.raises(sm.InputError, match="steps"):
        sm.ExactNewton(steps=cast(Any, "thrice"))


def test_a_solution_tells_what_its_solver_claimed_before_its_certificate():
    program = sm.affine_program(sm.examples.random_keyframes(4, 140, 1))
    assert sm.ExactNewton().solve(program).claimed
    saddle = sm.Elimination(damping=0.5).solve(program)
    stopped = sm.ExactNewton(max_iterations=2).solve(program)
    assert stopped.status == "iteration-limit" and not stopped.claimed
    assert saddle.claimed == (saddle.status in ("solved", "saddle"))
    assert saddle.evaluations["hessian"] == len(saddle.log)
