import numpy as np
import pytest
from studied import table

import symmotion as sm
from studies.solving import robustness
from studies.solving.hard_keyframes import FAR, KINDS, OPPOSITE, problem
from symmotion.report import StudyOptions


def test_problems_are_seeded_and_of_every_kind():
    made = [problem(seed) for seed in range(300)]
    assert [p.kind for p in made[:5]] == list(KINDS)
    assert len({p.name for p in made}) == 300
    designs = [p.program.design for p in made]
    assert {len(d.keyframes) for d in designs} == {3, 4, 5, 6, 8, 10, 12}
    assert {d.basis.degree for d in designs} == {3, 4, 5, 6, 7}
    assert {d.keyframes.dimension for d in designs} == {2, 3}
    np.testing.assert_array_equal(problem(7).program.x0, made[7].program.x0)
    for p in made:
        keys = p.program.design.keyframes
        ratios = keys.linear[:-1].swapaxes(1, 2) @ keys.linear[1:]
        if p.kind == OPPOSITE:
            np.testing.assert_allclose(np.trace(ratios, axis1=1, axis2=2), 2 - 4 if keys.dimension == 2 else -1)
        if p.kind == FAR:
            assert np.abs(keys.translation - 1e6).max() < 0.01


def test_distinct_values_are_counted_once():
    assert robustness.distinct([2.0, 1.0, 1.0 + 1e-9, 2.0 - 1e-8, 3.0]) == [1.0, 2.0 - 1e-8, 3.0]
    assert robustness.distinct([1e-14, 0.0]) == [0.0]
    assert robustness.distinct([]) == []


@pytest.mark.parametrize("seed", [26, 36, 91, 101])
def test_a_second_descent_finds_the_lower_minimum_where_the_first_had_to_fall_back(seed):
    program = problem(seed).program
    solution = sm.ExactNewton(ways=0).solve(program).require()
    assert solution.inertia == "positive"
    # Two descents from one start: the log begins twice at the start's objective.
    starts = [i.objective for i in solution.log if i.objective == solution.log[0].objective]
    assert len(starts) == 2
    first = solution.log[[i.objective for i in solution.log].index(starts[1], 1) - 1].objective
    assert solution.objective < 0.8 * first
    assert solution.objective == pytest.approx(solution.log[-1].objective, rel=1e-12)


def test_robustness_study():
    result = robustness.STUDY.run(StudyOptions())
    rows = {(r["family"], r["solver"]): r for r in table(result, "families")}
    for kind in KINDS:
        assert rows[kind, "newton"]["certified"] == 100
        assert rows[kind, "ipopt"]["problems"] == 1
    assert rows["all", "elimination"]["certified"] < 50
    budgets = {(r["starts"], r["solver"]): r for r in table(result, "equal budgets")}
    for method in ("newton", "ipopt", "elimination"):
        assert budgets[1, method]["best known"] <= budgets[2, method]["best known"]
        assert budgets[1, method]["best known"] == rows["all", method]["best known"]
    assert len(result.runs) == 25
    assert sum(table(result, "local minima")[-1][k] for k in ("no minimum found", "one", "two", "more")) == 5
    assert [f.name for f in result.figures] == ["profile", "shares"]
