"""Shares, profiles and tests of comparisons, on attempts that are made up; and the solvers that are compared."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from scipy.stats import binom
from studied import table

import symmotion as sm
from studies import shares
from studies.solving import casadi_solvers, conditioning, variants
from studies.solving.contest import profiles, tables
from studies.solving.contest.attempts import Attempt, Budget, Contender, Contest, Task, contend, start_of
from studies.solving.problem_set import load
from symmotion.report import StudyOptions

KEYS = sm.examples.planar_keyframes()


def attempt(problem: str, method: str, value: float | None, seconds: float, start: int = 0) -> Attempt:
    good = value is not None
    return Attempt(problem, "all", method, start, good, good, value or 9.0, seconds, int(10 * seconds), 1, 3)


# a is first on p, the only one on q; on r both fail from the first start, and only b finds the best from the second.
MADE = Contest(
    (
        attempt("p", "a", 1.0, 1.0),
        attempt("p", "b", 1.0, 4.0),
        attempt("q", "a", 2.0, 2.0),
        attempt("q", "b", None, 1.0),
        attempt("r", "a", None, 1.0),
        attempt("r", "a", 6.0, 1.0, 1),
        attempt("r", "b", None, 1.0),
        attempt("r", "b", 5.0, 2.0, 1),
    ),
    {"p": 1.0, "q": 2.0, "r": 5.0},
)


def test_costs_and_ratios_are_those_of_dolan_and_more():
    found = profiles.costs(MADE, MADE.reached, lambda a: a.seconds, ["a", "b"])
    np.testing.assert_array_equal(found, [[1.0, 4.0], [2.0, np.inf], [np.inf, 3.0]])
    ratios = profiles.ratios(found)
    np.testing.assert_array_equal(ratios, [[1.0, 4.0], [1.0, np.inf], [np.inf, 1.0]])
    shares_a = profiles.share_within(ratios[:, 0], np.array([0.5, 1.0, 100.0]))
    np.testing.assert_allclose(shares_a, [0.0, 2 / 3, 2 / 3])
    nobody = profiles.ratios(np.full((1, 2), np.inf))
    assert np.isinf(nobody).all()


def test_differences_are_counted_problem_by_problem():
    assert tables.outdone(MADE, "a", "b", 1, tables.certified) == (1, 0, 1.0)
    assert tables.outdone(MADE, "a", "b", 2, MADE.reached) == (1, 1, 1.0)
    assert tables.passed(MADE, "b", 2, MADE.reached).startswith("2 of 3 (")
    rows = tables.differences(MADE, "a", (1, 2)).rows
    assert [r[:6] for r in rows] == [
        (1, "b", "certified", 3, 1, 0),
        (1, "b", "best known", 3, 1, 0),
        (2, "b", "certified", 3, 1, 0),
        (2, "b", "best known", 3, 1, 1),
    ]
    # From one start only p is certified by both, and b takes four times as long.
    assert rows[0][7:] == pytest.approx((4.0, 4.0, 4.0))


def test_the_exact_test_is_that_of_the_signs():
    first = [True] * 9 + [False] * 5 + [True] * 46
    second = [False] * 9 + [True] * 5 + [True] * 46
    only, other, p = shares.paired(first, second)
    assert (only, other) == (9, 5)
    assert p == pytest.approx(2 * binom.sf(8, 14, 0.5))
    assert shares.versus(first, second) == "9 : 5, p = 0.42"
    assert shares.paired([True], [True]) == (0, 0, 1.0)


def test_means_and_ratios():
    assert shares.shifted_mean([3.0, 3.0], 1.0) == pytest.approx(3.0)
    assert shares.shifted_mean([0.0, 3.0], 1.0) == pytest.approx(1.0)
    middle, low, high = shares.ratio([2.0, 8.0, 4.0, 4.0], [1.0, 1.0, 1.0, 1.0])
    assert middle == pytest.approx(4.0) and low < middle < high
    assert shares.ratio([2.0] * 5, [1.0] * 5) == pytest.approx((2.0, 2.0, 2.0))


def test_every_contender_has_the_same_starts_and_budget():
    program = sm.affine_program(KEYS)
    seen: dict[str, list[np.ndarray]] = {"one": [], "two": []}

    @dataclass(frozen=True)
    class Watched:
        name: str
        max_iterations: int = 50

        def solve(self, program, start=None):
            if self.max_iterations > 1:
                seen[self.name].append(program.x0 if start is None else start)
            return replace(sm.ExactNewton(), max_iterations=self.max_iterations).solve(program, start)

    task = Task("made", "all", 3, lambda: program, best=1.0)
    found = contend([task], [Contender(name, Watched(name)) for name in seen], Budget(3, 0.0, 3))
    assert [len(v) for v in seen.values()] == [3, 3]
    np.testing.assert_array_equal(seen["one"], seen["two"])
    assert start_of(program, 3, 0) is None and np.ptp(np.array(seen["one"]), axis=0).max() > 0.1
    assert found.best["made"] <= 1.0 and found.methods == ["one", "two"]
    assert [a.start for a in found.attempts] == [0, 1, 2, 0, 1, 2]


def test_who_does_not_take_a_problem_has_no_attempts():
    objective = sm.Rigidity() + sm.TrajectoryEnergy(np.eye(2))
    program = sm.affine_program(KEYS, objective=objective)
    bounded = sm.affine_program(KEYS, objective=objective, constraints=[sm.Tolerance(linear=0.1, translation=0.1)])
    tasks = [Task("free", "all", 0, lambda: program), Task("bounded", "all", 1, lambda: bounded)]
    found = contend(tasks, [Contender("elimination", sm.Elimination())], Budget())
    assert [a.problem for a in found.attempts] == ["free"]
    assert found.attempts[0].evaluations > found.attempts[0].hessians > 0


def test_solvers_in_processes_of_their_own_answer_or_are_told_why_not():
    name = "keyframes-30"
    settings = {"structure_detection": "none", "fatrop": {"print_level": 0}}
    (good,) = casadi_solvers.asked([name], "fatrop", "fatrop", settings, 30.0)
    assert good.claimed and good.certificate is not None and good.certificate.inertia == "positive"
    assert good.evaluations > 0 and good.family == load.load(name).about["family"]
    missing = list(casadi_solvers.asked([name, "keyframes-34"], "none", "nothing", {}, 30.0))
    assert [a.problem for a in missing] == [name, "keyframes-34"]
    assert all("not found" in a.said and a.certificate is None and not a.claimed for a in missing)
    slow = list(casadi_solvers.asked([name, "keyframes-34"], "ipopt", "ipopt", {}, 1e-3))
    assert [a.said for a in slow] == ["more than 0.001 s"] * 2


def test_variants_are_counted_against_their_default():
    result = variants.STUDY.run(StudyOptions())
    rows = {r["solver"]: r for r in table(result, "variants")}
    assert rows["newton"]["certified"] == rows["ipopt"]["certified"] == 100
    assert rows["newton"]["problems"] == 3 > rows["elimination"]["problems"] == 2
    assert rows["newton, shifted exact"]["problems"] == 2
    assert rows["ipopt, L-BFGS"]["evaluations"] > 3 * rows["ipopt"]["evaluations"]
    against = table(result, "against the default")
    assert {r["variant"] for r in against} == {m for m in rows if "," in m}
    assert all(r["only the variant"] + r["only the default"] <= r["problems"] for r in against)
    warm = {r["way"]: r for r in table(result, "warm starts")}
    assert warm["newton, warm"]["iterations"] < warm["newton"]["iterations"]
    assert warm["ipopt, warm"]["iterations"] < warm["ipopt"]["iterations"]


def test_condition_grows_with_the_degree_and_elimination_takes_some_of_it():
    result = conditioning.STUDY.run(StudyOptions())
    rows = {(r["objective"], r["degree"], r["system"]): r["condition"] for r in table(result, "condition")}
    for objective in conditioning.OBJECTIVES:
        explicit = [rows[objective, p, "explicit, rows of length one"] for p in conditioning.DEGREES]
        eliminated = [rows[objective, p, "eliminated"] for p in conditioning.DEGREES]
        assert explicit == sorted(explicit) and explicit[-1] > 50 * explicit[0]
        assert all(1.5 < a / b < 10 for a, b in zip(explicit, eliminated, strict=True))
    assert rows["R", 3, "explicit, as it is"] == pytest.approx(5.07e4, rel=0.01)
    assert all(r["Δ multipliers, most"] < 1e-6 for r in table(result, "multipliers"))
    regular = {r["family"]: r for r in table(result, "regularity")}
    assert regular["degenerate"]["LICQ"] == 0 and regular["equalities"]["LICQ"] == 100
    assert regular["all"]["second order"] == 100


def test_casadis_solvers_are_judged_by_the_same_certificate(monkeypatch):
    monkeypatch.setattr(casadi_solvers, "QUICK_PLUGINS", ("ipopt", "uno, filterSQP"))
    result = casadi_solvers.STUDY.run(StudyOptions())
    rows = {r["plugin"]: r for r in table(result, "plugins")}
    assert rows["ipopt"]["to 1e-8"] == 100 and rows["ipopt"]["says solved and is not"] == 0
    # A saddle point is what it calls solved.
    assert rows["uno, filterSQP"]["says solved and is not"] == 1
    assert [r["such as"] for r in table(result, "failures")] == ["keyframes-01"]
