"""A solver written with public names only is one among the others."""

from typing import Any

import numpy as np
import pytest
from own_solver import TrustRegion

import symmotion as sm
from symmotion.batches import solve_many

KEYS = sm.examples.planar_keyframes()
PROGRAM = sm.affine_program(KEYS, objective=sm.Rigidity())


def test_it_joins_the_comparison():
    comparison = sm.compare(PROGRAM, [sm.ExactNewton(), TrustRegion()])
    mine = comparison.solutions[1].require(1e-7)
    assert (mine.method, mine.solver) == ("trustregion", repr(TrustRegion()))
    apart = comparison.agreement(mine)
    assert apart is not None and max(apart) < 1e-6
    assert mine.iterations == len(mine.log) > 3
    assert "trustregion  solved" in repr(comparison)


def test_what_it_does_not_take_is_a_row_too():
    bounded = sm.affine_program(
        KEYS,
        objective=sm.Rigidity(),
        constraints=[sm.JetConstraint(lambda jet: jet.A[0, 0], lower=-5, upper=5, at=[0.5])],
    )
    (mine,) = sm.compare(bounded, [TrustRegion()]).solutions
    assert (mine.status, mine.method) == ("unsupported", "trustregion")
    assert "TrustRegion takes equalities only" in mine.message


def test_it_solves_batches_and_nonlinear_equalities(tmp_path):
    moved = [PROGRAM.with_keyframes(KEYS.moved(0, linear=KEYS.linear[0] * size)) for size in (1.0, 1.1)]
    solutions: list[Any] = solve_many(moved, TrustRegion(), results=tmp_path / "own.results")
    expected: list[Any] = solve_many(moved, sm.ExactNewton())
    for mine, known in zip(solutions, expected, strict=True):
        assert isinstance(mine, sm.Solution) and isinstance(known, sm.Solution)
        assert mine.require(1e-7).objective == pytest.approx(known.objective, rel=1e-9)
    again = solve_many(moved, TrustRegion(), results=tmp_path / "own.results")
    assert [a.x.tobytes() for a in again if isinstance(a, sm.Solution)] == [
        s.x.tobytes() for s in solutions if isinstance(s, sm.Solution)
    ]
    volume = sm.affine_program(
        sm.examples.random_keyframes(3, 60, 1), objective=sm.Rigidity(), constraints=[sm.constraints.UnitVolume([0.3])]
    )
    mine, known = TrustRegion().solve(volume), sm.ExactNewton().solve(volume).require()
    assert mine.objective == pytest.approx(known.objective, rel=1e-6)
    assert np.abs(mine.multiplier_vector - known.multiplier_vector).max() < 1e-3


def test_its_limits_are_those_of_all_solvers():
    assert TrustRegion(max_iterations=2).solve(PROGRAM).status == "iteration-limit"
    assert TrustRegion(callback=lambda row: True).solve(PROGRAM).status == "stopped"
    with pytest.raises(sm.InputError, match="time_limit -1: a positive number"):
        TrustRegion(time_limit=-1)


def test_what_is_no_program_point_or_answer_is_refused_by_name():
    wrong: Any = sm
    program = sm.affine_program(sm.examples.random_keyframes(4, 60, 1))
    solution = sm.ExactNewton().solve(program)

    class Silent:
        tolerance, max_iterations = 1e-8, 1

        def solve(self, program, start=None):
            return None

    for make, message in (
        (lambda: wrong.ExactNewton().solve(None), "program of type NoneType"),
        (lambda: wrong.Ipopt().solve("x"), "program of type str"),
        (lambda: wrong.compare(3), "program of type int"),
        (lambda: wrong.compare(program, [Silent()]), "returns a NoneType: a Solution is needed"),
        (lambda: sm.certify(program, solution.x[:3], solution.multiplier_vector), r"x of shape \(3,\)"),
        (lambda: wrong.certify(program, solution.x, None), "multipliers: a NoneType"),
        (lambda: wrong.certify(None, solution.x, solution.multiplier_vector), "program of type NoneType"),
        (lambda: wrong.certify(program, solution.x, solution.multiplier_vector).holds("x"), "tolerance 'x'"),
        (lambda: wrong.ExactNewton().solve(program).require("x"), "tolerance 'x'"),
        (lambda: wrong.answers.keyframe_prices(None), "solution of type NoneType"),
    ):
        with pytest.raises(sm.InputError, match=message):
            make()
