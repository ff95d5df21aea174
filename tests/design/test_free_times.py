from typing import Any, cast

import numpy as np
import pytest
from problems import body_points, difference
from scipy.optimize import minimize_scalar
from studied import certified, table

import symmotion as sm
from studies.affine import free_times
from symmotion.design.free_times import free_times_program
from symmotion.energies import Energy
from symmotion.program import Evaluator
from symmotion.report import StudyOptions
from symmotion.systems import HessianTriangle

KEYS = sm.examples.random_keyframes(5, 60, 1)
MIXED = sm.Rigidity() + 0.05 * sm.TrajectoryEnergy(body_points(3))


@pytest.fixture(scope="module")
def solved():
    return sm.Ipopt(tolerance=1e-10).solve(free_times_program(KEYS, objective=MIXED)).require(1e-9)


def fixed_optimum(keys, times, objective: Energy = MIXED):
    program = sm.affine_program(sm.Keyframes(times, keys.linear, keys.translation), objective=objective)
    return sm.ExactNewton().solve(program).require(1e-9)


@pytest.mark.parametrize("degree", [1, 2, 3, 4, 5])
@pytest.mark.parametrize("refine", [0, 1, 2])
def test_start_is_that_of_the_program_with_fixed_times(degree, refine):
    keys = sm.examples.spatial_keyframes()
    objective = sm.Rigidity() if degree == 1 else MIXED
    free = free_times_program(keys, degree=degree, refine=refine, objective=objective)
    fixed = sm.affine_program(keys, degree=degree, refine=refine, objective=objective)
    evaluator = Evaluator(free)
    assert evaluator.objective(free.x0) == pytest.approx(Evaluator(fixed).objective(fixed.x0), rel=1e-12)
    assert np.abs(evaluator.violation(free.x0)).max() < 1e-12
    np.testing.assert_allclose(free.design.times(free.x0), keys.times, atol=1e-14)
    motion, same = free.design.motion(free.unpack(free.x0)), fixed.design.motion(fixed.unpack(fixed.x0))
    a, b = motion.domain
    t = np.linspace(a, b, 50)
    np.testing.assert_allclose(motion(t).linear, same(t).linear, atol=1e-12)
    np.testing.assert_allclose(motion(t).translation, same(t).translation, atol=1e-12)


@pytest.mark.parametrize("degree", [1, 2, 3, 4])
def test_derivatives_agree_with_differences(degree):
    """Of the Lagrangian with random multipliers, away from the start: gradient, Jacobian, Hessian."""
    keys = sm.examples.planar_keyframes()
    program = free_times_program(keys, degree=degree, objective=sm.Rigidity())
    rng = np.random.default_rng(degree)
    x = program.x0 + 0.05 * rng.normal(size=program.unknowns)
    evaluator, lam = Evaluator(program), rng.normal(size=program.conditions)
    np.testing.assert_allclose(evaluator.gradient(x), difference(evaluator.objective, x), rtol=1e-6, atol=1e-5)
    jacobian = evaluator.jacobian(x).toarray()
    np.testing.assert_allclose(jacobian, difference(evaluator.values, x).T, atol=1e-7)
    triangle = HessianTriangle.of(program)
    _, flat = evaluator.second_order(x, triangle.pattern, lam)
    slopes = difference(lambda y: evaluator.gradient(y) + evaluator.jacobian(y).T @ lam, x)
    scale = np.abs(slopes).max()
    np.testing.assert_allclose(triangle.full(flat, program.unknowns).toarray() / scale, slopes / scale, atol=1e-7)


def test_optimum_is_that_for_its_times(solved):
    design = solved.program.design
    times = design.times(solved.x)
    assert (np.diff(times) > 0).all()
    assert tuple(times[[0, -1]]) == (0.0, 4.0)
    fixed = fixed_optimum(KEYS, times)
    assert fixed.objective == pytest.approx(solved.objective, rel=1e-9)
    np.testing.assert_allclose(fixed.motion.spline.control_points, solved.motion.spline.control_points, atol=1e-5)
    np.testing.assert_allclose(solved.motion(times).linear, KEYS.linear, atol=1e-10)
    np.testing.assert_allclose(solved.motion(times).translation, KEYS.translation, atol=1e-10)
    assert sm.measure(solved.motion, MIXED) == pytest.approx(solved.objective, rel=1e-10)
    np.testing.assert_array_equal(design.keyframes_at(solved.x).times, times)
    np.testing.assert_allclose(design.unknowns(solved.motion)["controls"].ravel(), solved.x, atol=1e-12)
    price, free = fixed.multipliers["keyframes"], solved.multipliers["keyframes"]
    np.testing.assert_allclose(free.linear, price.linear, atol=1e-5)
    np.testing.assert_allclose(free.translation, price.translation, atol=1e-5)


def test_no_other_times_are_better(solved):
    times, step = solved.program.design.times(solved.x), 1e-3
    for i in range(1, len(times) - 1):
        change = np.eye(len(times))[i] * step
        up, down = (fixed_optimum(KEYS, times + s * change).objective for s in (1, -1))
        assert min(up, down) > solved.objective
        curvature = (up + down - 2 * solved.objective) / step**2
        assert abs(up - down) / (2 * step) < 0.05 * curvature * step


@pytest.mark.parametrize(
    ("objective", "k"), [(sm.Rigidity(), 1), (sm.Rigidity(2), 3)], ids=lambda o: getattr(o, "name", "")
)
def test_price_of_the_total_time(objective, k):
    """f ∝ 1/Tᵏ, so that λ = −∂f*/∂T = k f/T: and so by differences."""
    keys = sm.examples.spatial_keyframes()
    solution = sm.Ipopt(tolerance=1e-10).solve(free_times_program(keys, objective=objective)).require(1e-9)
    price = solution.multipliers["total time"]
    assert price == pytest.approx(k * solution.objective, rel=1e-7)
    values = []
    for factor in (0.999, 1.001):
        longer = sm.Keyframes(factor * keys.times, keys.linear, keys.translation)
        program = free_times_program(longer, objective=objective)
        values.append(sm.Ipopt(tolerance=1e-10).solve(program).require(1e-9).objective)
    assert (values[1] - values[0]) / 0.002 == pytest.approx(-price, rel=1e-4)


def test_multipliers_of_keyframes_and_other_keyframes(solved):
    price, step = solved.multipliers["keyframes"], 1e-4

    def optimum(i, part, entry, sign):
        change = np.zeros_like(getattr(KEYS, part)[i])
        change[entry] = sign * step
        moved = solved.program.with_keyframes(KEYS.moved(i, **{part: getattr(KEYS, part)[i] + change}))
        return sm.Ipopt(tolerance=1e-10).solve(moved, start=solved.motion).require(1e-8).objective

    for i, part, entry in ((1, "linear", (0, 2)), (3, "translation", (1,)), (4, "linear", (1, 1))):
        slope = (optimum(i, part, entry, 1) - optimum(i, part, entry, -1)) / (2 * step)
        assert slope == pytest.approx(-getattr(price, part)[i][entry], rel=1e-5, abs=1e-6)


def test_one_free_time_agrees_with_a_line_search():
    keys = sm.examples.planar_keyframes()[:3]
    keys = sm.Keyframes([0, 0.5, 1], keys.linear, keys.translation)
    solution = sm.Ipopt().solve(free_times_program(keys)).require()
    found = minimize_scalar(
        lambda t: fixed_optimum(keys, [0, t, 1], sm.Rigidity()).objective, bounds=(0.2, 0.8), options={"xatol": 1e-9}
    )
    assert solution.objective == pytest.approx(found.fun, rel=1e-9)
    assert solution.program.design.times(solution.x)[1] == pytest.approx(found.x, abs=1e-5)


def test_symmetric_keyframes_get_symmetric_times():
    turns = [sm.examples.rotation_2d(a) for a in (0, 50, 130, 180)]
    keys = sm.Keyframes([0.0, 0.9, 2.2, 3.0], turns)
    solution = sm.Ipopt().solve(free_times_program(keys)).require()
    steps = np.diff(solution.program.design.times(solution.x))
    assert steps[0] == pytest.approx(steps[2], abs=1e-6)
    assert steps[0] < steps[1]


def test_a_translation_that_the_objective_does_not_see_follows_the_times():
    solution = sm.Ipopt().solve(free_times_program(KEYS)).require()
    times = solution.program.design.times(solution.x)
    spline = sm.splines.cubic_interpolant(times, KEYS.translation)
    t = np.linspace(0, 4, 50)
    np.testing.assert_allclose(solution.motion(t).translation, spline(t), atol=1e-12)
    assert not solution.multipliers["keyframes"].translation.any()


def test_least_step_binds_and_has_a_price(solved):
    steps = np.diff(solved.program.design.times(solved.x))
    least = 1.05 * steps.min()
    values, price = [], np.empty(0)
    for change in (0.0, 1e-4, -1e-4):
        program = free_times_program(KEYS, objective=MIXED, least_step=least + change)
        bound = sm.Ipopt(tolerance=1e-10).solve(program).require(1e-8)
        values.append(bound.objective)
        assert np.diff(program.design.times(bound.x)).min() == pytest.approx(least + change, abs=1e-7)
        if not change:
            price = bound.multipliers["order"]
    assert values[0] > solved.objective
    slope = (values[1] - values[2]) / 2e-4
    assert slope == pytest.approx(-price.sum(), rel=1e-3)
    assert np.argmin(price) == np.argmin(steps)


def test_both_forms_of_ipopt_and_newton_agree(solved):
    plain = sm.solvers.PlainIpopt(tolerance=1e-10).solve(solved.program).require(1e-9)
    np.testing.assert_allclose(plain.x, solved.x, atol=1e-6)
    newton = sm.ExactNewton().solve(solved.program).require()
    np.testing.assert_allclose(newton.x, solved.x, atol=1e-6)


def clock():
    return sm.JetEnergy(lambda jet: jet.t * jet.dA, squares=True, label="clock", gauss_nodes=6)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: free_times_program(KEYS[:2]), "2 keyframes have no inner time"),
        (lambda: free_times_program(sm.Keyframes([0, 2, 1], KEYS.linear[:3])), "times must increase"),
        (lambda: free_times_program(KEYS, least_step=1.0), "least_step 1: between 0 and the mean step, 1"),
        (lambda: free_times_program(KEYS, least_step=0.0), "least_step 0"),
        (lambda: free_times_program(KEYS, least_step=-0.1), r"least_step -0\.1"),
        (
            lambda: free_times_program(sm.Keyframes([0, 0.1, 2, 3, 4], KEYS.linear), least_step=0.2),
            r"keyframes 0 and 1 start 0\.1 apart",
        ),
        (lambda: free_times_program(KEYS, degree=0), "degree 0"),
        (lambda: free_times_program(KEYS, refine=-1), "refine -1"),
        (lambda: free_times_program(KEYS, refine=cast(Any, 1.5)), r"refine 1\.5"),
        (lambda: free_times_program(KEYS, objective=cast(Any, "R")), "'R' is no energy"),
        (lambda: free_times_program(KEYS, objective=clock()), "clock depends on the time itself"),
        (lambda: free_times_program(KEYS).with_keyframes(KEYS[:4]), "4 in 3D"),
        (
            lambda: free_times_program(KEYS).with_keyframes(sm.Keyframes(2 * KEYS.times, KEYS.linear)),
            "keeps the first and the last time",
        ),
        (lambda: free_times_program(KEYS).stages("knots"), "no stages"),
    ],
)
def test_bad_input_names_the_culprit(make, message):
    with pytest.raises(sm.InputError, match=message):
        make()


def test_free_times_study():
    result = free_times.STUDY.run(StudyOptions())
    rows = table(result, "optima for given and for free times")
    assert all(r["given over best"] >= 1 for r in rows)
    found = {(r["keyframes"], r["objective"], r["start"]): r["optimum, times free"] for r in rows}
    for start in ("uniform", "chordal", "centripetal"):
        assert found["spatial, 4", "R", start] == pytest.approx(10.3135933056, rel=1e-9)
    # From uniform times the uneven tour ends in a local minimum: reported as such.
    assert found["tour, 9, uneven", "R", "uniform"] > 5 * found["tour, 9, uneven", "R", "chordal"]
    assert "3 of 4 sets" in result.conclusion
    assert certified(result, ("newton", "ipopt"))
