import numpy as np
import pytest
from problems import difference
from scipy.interpolate import CubicSpline, make_interp_spline

import symmotion as sm
from symmotion.constraints import CurveCondition
from symmotion.curves import catmull_rom, speed
from symmotion.design.curve import curve_program
from symmotion.program import Evaluator

RNG = np.random.default_rng(1)
TIMES = np.cumsum(RNG.uniform(0.3, 1.0, 12))
VALUES = RNG.normal(size=(12, 2))
AT, BETWEEN, CLOSED, LINKED = (
    CurveCondition.at,
    CurveCondition.between,
    CurveCondition.closed,
    CurveCondition.linked,
)
SOLVERS = (
    sm.ExactNewton(system="condensed"),
    sm.ExactNewton(system="sparse"),
    sm.Ipopt(),
    sm.solvers.PlainIpopt(),
    sm.Elimination(),
)


def grid(curve, count=401):
    a, b = curve.domain
    return np.linspace(a, b, count)


def energy(curve, order, count=20000):
    """∫ ‖x⁽ᵏ⁾‖² by the midpoint rule, piece by piece."""
    total = 0.0
    for a, b in zip(curve.breakpoints[:-1], curve.breakpoints[1:], strict=True):
        h = (b - a) / count
        t = a + h * (np.arange(count) + 0.5)
        total += h * float(np.sum(curve(t, order) ** 2))
    return total


@pytest.mark.parametrize("solver", SOLVERS, ids=repr)
@pytest.mark.parametrize("refine", [0, 1])
def test_values_alone_give_the_natural_spline(solver, refine):
    program = curve_program([AT(TIMES, VALUES)], refine=refine)
    solution = solver.solve(program).require(1e-8)
    assert solution.inertia == "positive"
    t = grid(solution.motion)
    expected = CubicSpline(TIMES, VALUES, bc_type="natural")
    np.testing.assert_allclose(solution.motion(t), expected(t), atol=1e-12)
    # With L = f + λᵀ(x − y), λ/2 is the jump of the natural spline's third derivative.
    third = np.concatenate([np.zeros((1, 2)), expected.c[0] * 6, np.zeros((1, 2))])
    scale = np.abs(third).max()
    np.testing.assert_allclose(solution.multipliers["values"] / 2, -np.diff(third, axis=0), atol=1e-10 * scale)


@pytest.mark.parametrize("order", [1, 2, 3])
def test_natural_splines_of_all_orders(order):
    solution = sm.ExactNewton().solve(curve_program([AT(TIMES, VALUES)], order=order)).require()
    zeros = [(k, np.zeros(2)) for k in range(order, 2 * order - 1)]
    expected = make_interp_spline(TIMES, VALUES, k=2 * order - 1, bc_type=(zeros, zeros) if order > 1 else None)
    t = grid(solution.motion)
    np.testing.assert_allclose(solution.motion(t), expected(t), atol=1e-12)
    assert solution.objective == pytest.approx(energy(solution.motion, order), rel=1e-6)


@pytest.mark.parametrize("solver", SOLVERS[1:3], ids=repr)
def test_periodicity_of_value_and_slope_gives_the_periodic_spline(solver):
    closed = np.concatenate([VALUES[:-1], VALUES[:1]])
    program = curve_program([AT(TIMES[:-1], VALUES[:-1]), CLOSED(TIMES[0], TIMES[-1])])
    curve = solver.solve(program).require(1e-8).motion
    t = grid(curve)
    np.testing.assert_allclose(curve(t), CubicSpline(TIMES, closed, bc_type="periodic")(t), atol=1e-12)


def test_end_slopes_give_the_clamped_spline():
    slopes = RNG.normal(size=(2, 2))
    program = curve_program([AT(TIMES, VALUES), AT(TIMES[[0, -1]], slopes, order=1)])
    curve = sm.ExactNewton().solve(program).require().motion
    t = grid(curve)
    expected = CubicSpline(TIMES, VALUES, bc_type=((1, slopes[0]), (1, slopes[1])))
    np.testing.assert_allclose(curve(t), expected(t), atol=1e-12)


MIXED = {
    "slopes inside, k = 2": ([AT(TIMES, VALUES), AT(TIMES[[3, 7]], VALUES[:2], order=1)], 2, ()),
    "slopes and accelerations, k = 3": (
        [AT(TIMES, VALUES), AT(TIMES[[2, 5]], VALUES[:2], order=1), AT(TIMES[[5, 8]], VALUES[:2], order=2)],
        3,
        (),
    ),
    "break, k = 2": ([AT(TIMES, VALUES), LINKED(TIMES[[4]], -0.7)], 2, TIMES[[4]]),
    "closed, k = 3": ([AT(TIMES[:-1], VALUES[:-1]), CLOSED(TIMES[0], TIMES[-1], (0, 1, 2))], 3, ()),
}


@pytest.mark.parametrize(("conditions", "order", "breaks"), MIXED.values(), ids=MIXED)
def test_more_knots_do_not_lower_the_minimum(conditions, order, breaks):
    # The knots chosen hold the minimiser among all functions.
    coarse, fine = (
        sm.ExactNewton().solve(curve_program(conditions, order=order, breaks=breaks, refine=r)).require(1e-7)
        for r in (0, 2)
    )
    assert coarse.objective == pytest.approx(fine.objective, rel=1e-9)
    t = grid(coarse.motion)
    np.testing.assert_allclose(coarse.motion(t), fine.motion(t), atol=1e-7)
    for name, multipliers in coarse.multipliers.items():
        other = fine.multipliers[name]
        np.testing.assert_allclose(multipliers, other, atol=1e-6 * np.abs(other).max(), err_msg=name)


@pytest.mark.parametrize(("conditions", "order", "breaks"), MIXED.values(), ids=MIXED)
def test_multipliers_are_the_slopes_of_the_optimum(conditions, order, breaks):
    program = curve_program(conditions, order=order, breaks=breaks)
    solution = sm.ExactNewton().solve(program).require(1e-7)
    for condition in conditions:
        data = program.constraint(condition.name).block.data

        def optimum(x, name=condition.name, shape=data.shape):
            return sm.ExactNewton().solve(program.with_data(name, x.reshape(shape))).objective

        slopes = difference(optimum, data.ravel(), 1e-3)
        multipliers = solution.multipliers[condition.name]
        np.testing.assert_allclose(slopes, -multipliers.ravel(), atol=1e-6 * np.abs(slopes).max())


def test_conditions_hold_and_derivatives_are_continuous_where_asked_for():
    conditions = [
        AT(TIMES, VALUES),
        AT(TIMES[[3]], [[1.0, 2.0]], order=1),
        AT(TIMES[[6]], [[0.0, -1.0]], order=2),
    ]
    curve = sm.ExactNewton().solve(curve_program(conditions)).require().motion
    np.testing.assert_allclose(curve(TIMES), VALUES, atol=1e-12)
    for t, order, value in ((TIMES[3], 1, [1, 2]), (TIMES[6], 2, [0, -1])):
        for moment in (t, np.nextafter(t, 0)):
            np.testing.assert_allclose(curve(moment, order), value, atol=1e-10)


def test_a_rebound_links_the_slopes_of_both_sides():
    hits = TIMES[[2, 5]]
    program = curve_program([AT(TIMES, VALUES[:, 0]), LINKED(hits, [-0.5, -0.8])], breaks=hits)
    solution = sm.ExactNewton().solve(program).require()
    before, after = solution.motion(np.nextafter(hits, 0), 1), solution.motion(hits, 1)
    np.testing.assert_allclose(after, [-0.5, -0.8] * before, atol=1e-9)
    free = sm.ExactNewton().solve(curve_program([AT(TIMES, VALUES[:, 0])], breaks=hits)).require()
    assert free.objective < solution.objective
    left = AT(hits, [1.0, 1.0], order=1, side="left")
    sided = sm.ExactNewton().solve(curve_program([AT(TIMES, VALUES[:, 0]), left], breaks=hits)).require().motion
    np.testing.assert_allclose(sided(np.nextafter(hits, 0), 1), 1.0, atol=1e-9)
    assert np.abs(sided(hits, 1) - 1).min() > 1e-3


@pytest.mark.parametrize("solver", [sm.Ipopt(), sm.solvers.PlainIpopt()], ids=repr)
def test_bounds_are_complementary_and_binding(solver):
    times = np.linspace(TIMES[0], TIMES[-1], 40)
    bound = BETWEEN(times, -0.9, 0.9, name="box")
    values = np.repeat([0.85, -0.85] * 3, 2)
    program = curve_program([AT(TIMES, values), bound])
    solution = solver.solve(program).require(1e-7)
    assert solution.inertia == "positive"
    free = sm.ExactNewton().solve(curve_program([AT(TIMES, values)])).require()
    assert np.abs(free.motion(times)).max() > 0.95
    inside = solution.motion(times)
    assert np.abs(inside).max() < 0.9 + 1e-6
    price = solution.multipliers["box"]
    assert price.shape == (40,)
    active = np.abs(price) > 1e-4 * np.abs(price).max()
    assert active.any()
    np.testing.assert_allclose(np.abs(inside[active]), 0.9, atol=1e-6)
    assert (price[active] * inside[active] > 0).all()
    assert solution.objective > free.objective
    # The active bounds as equalities have the same optimum.
    equal = curve_program([AT(TIMES, values), AT(times[active], 0.9 * np.sign(inside[active]), name="box")])
    again = sm.ExactNewton().solve(equal).require()
    assert solution.objective == pytest.approx(again.objective, rel=1e-6)
    np.testing.assert_allclose(again.multipliers["box"], price[active], rtol=1e-3)


def test_a_tolerance_lets_values_go_to_its_edge():
    loose = sm.Ipopt().solve(curve_program([AT(TIMES, VALUES, tolerance=0.1)])).require(1e-7)
    exact = sm.ExactNewton().solve(curve_program([AT(TIMES, VALUES)])).require()
    assert loose.objective < exact.objective
    off = loose.motion(TIMES) - VALUES
    assert np.abs(off).max() < 0.1 + 1e-6
    price = loose.multipliers["values"]
    active = np.abs(price) > 1e-3 * np.abs(price).max()
    np.testing.assert_allclose(off[active], 0.1 * np.sign(price[active]), atol=1e-5)


def test_speed_limits_hold_at_their_times_and_price_the_limit():
    times, keys, places = np.linspace(0, 4, 33), np.array([0.0, 1.0, 2.5, 4.0]), VALUES[:4] * 2
    rest = AT([0.0, 4.0], np.zeros((2, 2)), order=1)
    free = sm.ExactNewton().solve(curve_program([AT(keys, places), rest])).require()
    limit = 0.9 * speed(free.motion, times).max()

    def solve(v):
        return sm.Ipopt().solve(curve_program([AT(keys, places), rest, CurveCondition.norm_below(times, v)]))

    solution = solve(limit).require(1e-7)
    assert speed(solution.motion, times).max() <= limit * (1 + 1e-7)
    price = solution.multipliers["speed"]
    assert price.shape == (33,)
    # At rest the speed is settled: those rows are left out, and cost nothing.
    assert price[0] == price[-1] == 0
    slope = (solve(limit + 1e-3).objective - solve(limit - 1e-3).objective) / 2e-3
    assert slope == pytest.approx(-2 * limit * price.sum(), rel=1e-4)
    bounded = curve_program([AT(keys, places), rest, CurveCondition.norm_below(times, limit)])
    newton = sm.ExactNewton().solve(bounded).require()
    np.testing.assert_allclose(newton.multipliers["speed"], price, atol=1e-5 * price.max())
    with pytest.raises(sm.InputError, match="'speed' is an inequality"):
        sm.Elimination().solve(bounded)


def test_bounds_where_a_value_is_settled_are_checked_and_left_out():
    program = curve_program([AT([0.0, 1.0, 2.0], [0.0, 1.0, 0.0]), BETWEEN([0.0, 1.0], 0.0, 1.0, name="box")])
    assert [c.name for c in program.constraints] == ["values"]
    solution = sm.ExactNewton().solve(program).require()
    np.testing.assert_array_equal(solution.multipliers["box"], [0, 0])
    with pytest.raises(sm.InputError, match="box at time 1 contradicts values there"):
        curve_program([AT([0.0, 1.0, 2.0], [0.0, 1.0, 0.0]), BETWEEN([1.0], 0.0, 0.9, name="box")])
    with pytest.raises(sm.InputError, match="speed at time 0 contradicts slopes there"):
        curve_program([AT([0.0, 1.0], [0, 1]), AT(0.0, 2.0, order=1), CurveCondition.norm_below([0.0, 0.5], 1.0)])


def test_a_curve_seeds_a_program_and_data_change_in_place():
    program = curve_program([AT(TIMES, VALUES)], refine=1)
    seed = catmull_rom(TIMES, VALUES)
    start = program.pack(program.design.unknowns(seed))
    again = program.design.motion(program.unpack(start))
    assert np.abs(Evaluator(program).values(start)).max() < 0.5
    t = grid(again)
    assert np.abs(again(t) - seed(t)).max() < 0.5
    natural = sm.splines.cubic_interpolant(TIMES, VALUES)
    exact = program.design.motion(program.unpack(program.pack(program.design.unknowns(natural))))
    np.testing.assert_allclose(exact(t), natural(t), atol=1e-12)
    solution = sm.ExactNewton().solve(program, start=seed).require()
    moved = program.with_data("values", VALUES + 1)
    assert moved.structure is program.structure
    shifted = sm.ExactNewton().solve(moved, start=solution).require()
    np.testing.assert_allclose(shifted.motion(t), solution.motion(t) + 1, atol=1e-11)
    with pytest.raises(sm.InputError, match="are needed"):
        program.design.unknowns(catmull_rom(TIMES + 1, VALUES))


def test_values_keep_their_shape_and_programs_print():
    program = curve_program([AT([0.0, 1.0, 2.0], RNG.normal(size=(3, 2, 2))), BETWEEN([0.5], -5.0, 5.0, order=1)])
    solution = sm.Ipopt().solve(program).require(1e-7)
    assert solution.motion(0.3).shape == (2, 2)
    assert solution.multipliers["values"].shape == (3, 2, 2)
    assert solution.multipliers["bounds on slopes"].shape == (1, 2, 2)
    text = str(program)
    for part in ("∫ ‖x''‖²: 3 elements × 2 nodes", "values: 3 elements", "equality", "bounds on slopes", "bounds"):
        assert part in text


LINE = AT([0.0, 1.0], [0.0, 1.0])
BAD = {
    "nothing": (lambda: curve_program([]), "one CurveCondition or more"),
    "no condition": (lambda: curve_program([3]), "one CurveCondition or more"),  # pyright: ignore
    "names": (lambda: curve_program([LINE, AT([2.0], [1.0])]), "same name, 'values'"),
    "order": (lambda: curve_program([LINE], order=4), "order 4: 1, 2 or 3"),
    "degree": (lambda: curve_program([LINE], degree=1), "degree 1: a whole number, 2 or more"),
    "refine": (lambda: curve_program([LINE], refine=-1), "refine -1"),
    "break": (lambda: curve_program([LINE], breaks=[1.0]), "break 1 is not inside the domain"),
    "domain": (lambda: curve_program([LINE], domain=(0.0, 0.5)), r"values: time 1 is outside the domain \[0, 0.5\]"),
    "moment": (lambda: curve_program([AT([1.0], [0.0])]), "conditions at two times or more"),
    "redundant": (
        lambda: curve_program([LINE, AT([2.0, 1.0], [0.0, 5.0], name="again")]),
        r"again, row 1 \(time 1\), follows from the conditions before it or contradicts",
    ),
    "crowded": (
        lambda: curve_program([AT(np.linspace(0, 1, 9), np.zeros(9))], knots=[0.5]),
        r"values, row 4 \(time 0.5\), follows .* insert knots",
    ),
    "free": (lambda: curve_program([LINE], order=3), "undetermined: parabolas .* 3 degrees of freedom .* fix 2"),
    "floating": (
        lambda: curve_program([AT([0.0, 1.0], [0.0, 1.0], order=1)]),
        "undetermined: straight lines .* 2 degrees of freedom",
    ),
    "broken": (lambda: curve_program([LINE], breaks=[0.5]), "straight lines between the breaks .* 3 degrees"),
    "shapes": (
        lambda: curve_program([AT([0.0, 1.0], np.zeros((2, 3))), AT([0.5], np.zeros((1, 2)), name="other")]),
        r"other: values of shape \(2,\) on a curve of values of shape \(3,\)",
    ),
    "repeat": (lambda: AT([0.0, 1.0, 0.0], [0, 1, 0]), "values: time 0 is given twice"),
    "times": (lambda: AT([0.0, np.nan], [0, 1]), "values: times of shape"),
    "rows": (lambda: AT([0.0, 1.0], [0, 1, 2]), r"values: values of shape \(3,\) for 2 times"),
    "one for all": (lambda: AT([0.0, 1.0], 3.0), r"values: values of shape \(\) for 2 times"),
    "nan": (lambda: AT([0.0, 1.0], [0, np.nan]), "values: values: row 1 is not finite"),
    "tolerance": (lambda: AT([0.0], [1.0], tolerance=-1), "tolerance -1"),
    "side": (lambda: AT([0.0], [1.0], side="up"), "side 'up' is unknown; there are left, right"),
    "derivative": (lambda: AT([0.0], [1.0], order=-1), "derivative order -1"),
    "crossed": (lambda: BETWEEN([0.0, 1.0], [0, 2], 1.0), "the lower bound at time 1 is above"),
    "limit": (lambda: CurveCondition.norm_below([0.0], 0.0), "speed: limit: one positive number"),
    "backwards": (lambda: CLOSED(1.0, 0.0), "periodic: the start 1 comes after the end 0"),
    "orders": (lambda: CLOSED(0.0, 1.0, (1, 1)), "at least one, each once"),
    "factor": (lambda: LINKED([0.5], [[1.0, 2.0]]), "rebound: factor of shape"),
}


@pytest.mark.parametrize(("make", "message"), BAD.values(), ids=BAD)
def test_bad_conditions(make, message):
    with pytest.raises(sm.InputError, match=message):
        make()
