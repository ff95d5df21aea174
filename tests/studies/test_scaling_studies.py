"""The studies of cost in small forms: alternatives against known optima, budgets kept, counts against formulas."""

import os
import time
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np
import pytest
from studied import table

import symmotion as sm
from studies.solving import interactive, scaling
from studies.solving.scaling_alternatives import Answer, OptiIpopt, Sqpmethod, Tables, TrustConstr, expressions, judge
from studies.solving.scaling_fatrop import Fatrop
from studies.solving.scaling_figure import cost_figure
from studies.solving.scaling_limit import (
    ONCE,
    PHASES,
    REST,
    Limit,
    Rates,
    Work,
    divide,
    operations,
    prepared,
    spent,
    work,
)
from studies.solving.scaling_tables import METHODS, OURS, repeated_table, slope
from studies.solving.scaling_worker import BRIEF, Budget, Measurement, Nursery, measure, timed
from symmotion.program import Evaluator
from symmotion.report import Run, StudyOptions
from symmotion.solvers.solution import Seconds
from symmotion.systems import Condensed

KEYS = sm.examples.random_keyframes(5, 40, 0)
OTHERS = (OptiIpopt("SX"), OptiIpopt("MX"), Sqpmethod(), Fatrop(), TrustConstr())
PLENTY = Budget(60.0, 8192)


@pytest.fixture(scope="module")
def program():
    return sm.affine_program(KEYS)


@pytest.fixture(scope="module")
def ours(program):
    return sm.ExactNewton().solve(program).require()


@pytest.mark.parametrize("other", OTHERS, ids=repr)
def test_alternatives_reach_the_same_minimum_with_the_same_multipliers(other, program, ours):
    answer = other.attempt(program)
    solution = judge(program, other, answer)
    # trust-constr ends where its steps are of the size of rounding, a little short of the tolerance.
    solution.require(1e-7 if other.name == "trust-constr" else 1e-8)
    assert solution.inertia == "positive"
    assert solution.objective == pytest.approx(ours.objective, rel=1e-9)
    np.testing.assert_allclose(solution.x, ours.x, atol=1e-6)
    np.testing.assert_allclose(solution.multiplier_vector, ours.multiplier_vector, atol=1e-6)
    assert solution.iterations == answer.iterations
    assert solution.seconds.total > 0
    assert solution.solver == repr(other)


def test_the_expression_of_the_users_is_the_objective_of_the_program(program, ours):
    X = ca.MX.sym("X", 9, program.unknowns // 9)
    both = ca.Function("both", [X], expressions(Tables.of(program), X))
    rng = np.random.default_rng(3)
    x = ours.x + 0.3 * rng.normal(size=ours.x.shape)
    value, conditions = both(x.reshape(-1, 9).T)
    evaluator = Evaluator(program)
    assert float(value) == pytest.approx(evaluator.objective(x), rel=1e-12)
    np.testing.assert_allclose(np.asarray(conditions).T.ravel(), evaluator.values(x), atol=1e-13)


def test_an_answer_that_is_no_minimum_is_not_certified_whatever_it_says(program):
    there = Answer(program.x0, np.zeros(program.conditions), Seconds(0.1, 0.1, 0.1), 3, "", program.unknowns)
    solution = judge(program, OptiIpopt("MX"), there)
    assert solution.status == "failed"
    assert "certificate does not agree" in solution.message


def test_problems_that_the_alternatives_are_not_written_for():
    planar = sm.affine_program(sm.examples.planar_keyframes())
    with pytest.raises(sm.InputError, match="rigidity in space"):
        OptiIpopt("MX").attempt(planar)
    with pytest.raises(sm.InputError, match="refine=1"):
        Fatrop().attempt(sm.affine_program(KEYS, refine=2))
    with pytest.raises(sm.InputError, match="insert a knot"):
        work(sm.affine_program(sm.examples.random_keyframes(60, 40, 0), refine=0))


@dataclass(frozen=True)
class Sleeper:
    """Takes its time, or memory, or breaks down."""

    how: str
    tolerance: float = 1e-8
    name: str = "sleeper"

    def attempt(self, program: sm.program.Program) -> Answer:
        if self.how == "sleep":
            time.sleep(600)
        if self.how == "grow":
            held = [np.ones(2_000_000) for _ in range(60)]
            time.sleep(600 + len(held))
        if self.how == "die":
            os._exit(3)
        raise RuntimeError("no such\nmethod")


@pytest.mark.parametrize(
    ("how", "budget", "status", "message"),
    [
        ("sleep", Budget(0.2, 8192), "stopped", "more than 0.2 s"),
        ("grow", Budget(60, 300), "stopped", "more than 300 MB"),
        ("die", PLENTY, "stopped", "ended with code 3"),
        ("raise", PLENTY, "failed", "no such method"),
    ],
)
def test_a_method_that_does_not_return_is_a_row(how, budget, status, message):
    if how == "grow" and not os.path.exists("/proc/self/status"):
        pytest.skip("the system does not tell the memory of another process")
    found = measure("sleeper", Sleeper(how), 4, budget)
    assert (found.run.status, found.seconds) == (status, None)
    assert message in found.run.message
    assert bool(found.stopped) == (status == "stopped")


def test_one_nursery_serves_on_after_what_was_stopped_or_broke_down():
    with Nursery() as nursery:
        stopped = measure("sleeper", Sleeper("sleep"), 4, Budget(0.1, 8192), nursery)
        died = measure("sleeper", Sleeper("die"), 4, PLENTY, nursery)
        found = measure("newton", sm.ExactNewton(kernels="interpreted"), 4, PLENTY, nursery)
    assert (stopped.run.status, died.run.status) == ("stopped", "stopped")
    assert found.run.certified


def test_a_measurement_in_a_process_of_its_own():
    found = measure("newton", sm.ExactNewton(kernels="interpreted"), 4, PLENTY)
    again = timed("newton", sm.ExactNewton(kernels="interpreted"), 4)
    assert found.run.certified
    assert found.run.objective == again.run.objective
    assert found.unknowns == again.unknowns == 81
    assert found.first is not None
    assert found.seconds is not None
    # The first solve of a process derives the kernels, which no later one does; on a slow machine it is the only one.
    assert found.first > found.seconds if found.first < BRIEF else found.first == found.seconds
    assert found.beyond is not None
    assert found.beyond > 0
    rows: Any = repeated_table([again, found]).rows
    for m in (again, found):
        if len(m.repeated) > 1:
            assert (4, "newton", len(m.repeated)) in [row[:3] for row in rows]
            assert 1e3 * min(m.repeated) <= 1e3 * (m.seconds or 0.0) <= 1e3 * max(m.repeated)
    assert all(row[4] <= row[3] <= row[5] for row in rows)


def _measured(keyframes, seconds, memory=None):
    row = Run("case", "newton", "", "solved", inertia="positive", seconds=Seconds(solve=seconds))
    return Measurement("newton", keyframes, row, seconds, memory, 0.0)


def test_slopes_are_those_of_the_largest_decade():
    points = [_measured(k, 5.0 if k < 100 else 1e-3 * k**1.5, 2.0 * k) for k in (10, 30, 100, 300, 1000)]
    assert slope(points, "seconds") == pytest.approx(1.5)
    assert slope(points, "beyond") == pytest.approx(1.0)
    assert slope(points[:1], "seconds") is None


def test_work_grows_with_the_segments_and_counts_the_band():
    small, large = (work(sm.affine_program(sm.examples.random_keyframes(m, 40, 0))) for m in (11, 21))
    assert large.operations["evaluation"] == pytest.approx(2 * small.operations["evaluation"], rel=0.05)
    # Three free controls per two segments' spans read each other: n b² of the banded Cholesky factorisation.
    program = sm.affine_program(sm.examples.random_keyframes(21, 40, 0))
    system = Condensed.of(program)
    assert system is not None
    assert large.operations["factorisation"] == system.size * system.band**2
    # At least value, slope and curvature of 9 residuals in 18 local values; fewer than a dense product would take.
    assert 171 < operations(program.terms[0]) < 2 * 9 * 18**2


def test_the_larger_of_arithmetic_and_traffic_is_the_limit():
    task = Work({"a": 10.0, "b": 10.0}, {"a": 1.0, "b": 100.0})
    assert task.seconds(Rates(10.0, 10.0)) == {"a": 1.0, "b": 10.0}


def test_time_is_divided_up_completely():
    keys = sm.examples.random_keyframes(20, 40, 0)
    solver = sm.ExactNewton(kernels="interpreted", threads=1)
    began = time.perf_counter()
    parts = spent(lambda: solver.solve(sm.affine_program(keys)))
    whole = time.perf_counter() - began
    assert 0.3 * whole < sum(parts.values()) <= whole
    assert all(v > 0 for v in parts.values())
    assert set(parts) == {*PHASES, REST}
    idle = spent(lambda: time.sleep(0.02))
    assert idle[REST] == pytest.approx(sum(idle.values()))
    assert idle[REST] >= 0.02


def test_division_adds_up_to_its_excess():
    limit, division = divide(KEYS, Rates(1e11, 1e11))
    assert sum(map(division.excess, division.compiled)) == pytest.approx(100)
    assert limit.seconds(len(KEYS)) == pytest.approx(sum(division.limit.values()))
    assert division.factor("interpreted") > 1
    assert set(division.compiled) == {*PHASES, ONCE, REST}


def test_a_solve_makes_nothing_of_what_is_made_once():
    program = prepared(sm.examples.random_keyframes(20, 40, 0))
    made = dict(program.structure)
    assert made
    sm.ExactNewton(kernels="interpreted", threads=1).solve(program).require()
    assert program.structure.keys() == made.keys()
    assert all(program.structure[name] is value for name, value in made.items())


def test_scaling_study_in_small():
    left_out = ("ipopt", "elimination", "opti-sx", "ipopt-plain", "sqpmethod", "fatrop", "trust-constr")
    extent = scaling.Extent((4,), (8,), 8, PLENTY, left_out)
    steps = []
    result = scaling.compare_scaling(extent, StudyOptions(progress=steps.append))
    assert "opti-mx, 4 keyframes" in steps
    assert all(r.certified for r in result.runs)
    sizes = {r["method"]: r["reaches"] for r in table(result, "methods")}
    assert sizes == {"newton": 8, "newton-compiled": 8, "opti-mx": 4}
    assert [r["keyframes"] for r in table(result, "build and solve")] == [4, 8]
    assert [f.name for f in result.figures] == ["scaling", "phases"]
    assert "opti-mx" in result.conclusion
    values = {r.objective for r in result.runs if " 8 keyframes" in r.case and r.method.startswith("newton")}
    assert len(values) == 1  # neither kernels nor threads change a bit


def test_larger_sizes_are_not_tried_beyond_the_budget():
    steps = []
    extent = scaling.Extent((4, 40, 10**9), (), 8, Budget(30.0, 8192), tuple(m.name for m in METHODS[1:]))
    result = scaling.compare_scaling(extent, StudyOptions(progress=steps.append))
    assert [s for s in steps if "keyframes" in s] == ["newton, 4 keyframes", "newton, 40 keyframes"]
    (row,) = table(result, "methods")
    assert row["reaches"] == 40
    assert "not tried" in row["not certified"]
    assert [r.status for r in result.runs] == ["solved", "solved", "skipped"]


def test_a_busy_machine_on_which_nothing_keeps_within_the_budget_has_a_figure():
    assert cost_figure([], ["newton"], Limit(1e-6, 10), Budget(1.5, 2048)).svg.startswith("<svg")


def test_methods_have_names_of_their_own():
    names = [m.name for m in METHODS]
    assert len(set(names)) == len(names)
    assert METHODS[: len(OURS)] == OURS


def test_dragging_follows_the_minimum_and_comes_back():
    offsets, turns = interactive.path(50)
    np.testing.assert_allclose(offsets[-1], 0, atol=1e-14)
    np.testing.assert_allclose(turns[-1], 0, atol=1e-14)
    dragged = interactive.drag(20, sm.Rigidity(), sm.ExactNewton(kernels="interpreted"), 5.0, 12)
    assert dragged.certified.all()
    np.testing.assert_allclose(dragged.last.x, dragged.start.x, atol=1e-9)
    assert dragged.start.objective == pytest.approx(0.0101200045, rel=1e-7)
    assert (dragged.iterations >= 1).all()
    assert dragged.seconds.shape == (12,)


def test_interactive_study_in_small(monkeypatch):
    monkeypatch.setattr(interactive, "SIZES", ((6, 5.0, 4, 4), (12, 30.0, 3, 3)))
    result = interactive.STUDY.run(StudyOptions())
    assert all(r.certified for r in result.runs)
    rows = table(result, "drag")
    assert [r["steps"] for r in rows] == [4, 4, 4, 3, 3, 3]
    for r in rows:
        assert r["certified"] == 100
        assert 0 < r["median"] <= r["90 %"] <= r["99 %"] <= r["slowest"]
    assert [f.name for f in result.figures] == ["distribution", "path"]
