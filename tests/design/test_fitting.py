from itertools import pairwise
from pathlib import Path
from typing import Any, cast

import numpy as np
import pytest
from noise import noisy, of_motion, swing
from problems import difference
from scipy.interpolate import BSpline, make_lsq_spline
from scipy.optimize import least_squares
from studied import certified, table

import symmotion as sm
from studies.affine import morphing
from studies.recorded import fitting, recorded_pair
from symmotion.design.fitting import fit_program
from symmotion.motions.morphing import copy_deviations, keyframes_from_copies
from symmotion.program import Evaluator
from symmotion.report import StudyOptions

TOUR = sm.examples.recorded_tour(121, noise=5.0)
POINTS = np.concatenate([np.eye(3), -np.eye(3)])
SMOOTH = 1e-2 * sm.Rigidity() + 1e-5 * sm.TrajectoryEnergy(POINTS)
EXACT = (0, 57, -1)


def flat(samples):
    return np.concatenate([samples.linear.reshape(len(samples), -1), samples.translation], axis=1)


def planar_samples(count, seed, spread=0.05):
    """Samples about a slow planar turn."""
    rng = np.random.default_rng(seed)
    t = np.sort(rng.uniform(0, 2, count))
    linear = np.array([sm.examples.rotation_2d(40 * s) for s in t]) + spread * rng.normal(size=(count, 2, 2))
    return sm.Keyframes(t, linear, np.column_stack([t, t**2]) + spread * rng.normal(size=(count, 2)))


def spoilt():
    """The tour with every tenth pose thrown off, and the numbers of these."""
    rng = np.random.default_rng(0)
    thrown = np.arange(5, len(TOUR), 10)
    translation = TOUR.translation.copy()
    translation[thrown] += rng.normal(size=(len(thrown), 3))
    return sm.Keyframes(TOUR.times, TOUR.linear, translation), thrown


@pytest.mark.parametrize("degree", [1, 2, 3, 5])
def test_without_energies_it_is_the_weighted_least_squares_spline(degree):
    weights = np.random.default_rng(0).uniform(0.5, 2, len(TOUR))
    solution = sm.ExactNewton().solve(fit_program(TOUR, degree=degree, controls=17, weights=weights)).require()
    spline = make_lsq_spline(TOUR.times, flat(TOUR), solution.motion.basis.knots, degree, w=np.sqrt(weights))
    np.testing.assert_allclose(solution.motion.spline.control_points, spline.c, atol=1e-9)
    assert solution.motion.basis.n == 17


@pytest.mark.parametrize("degree", [3, 5])
@pytest.mark.parametrize("noise", [None, (0.005, 0.01)])
def test_controls_and_weights_are_chosen_as_smooth_does(degree, noise):
    """By the noise, or cross-validation; the truth is met as `smooth` meets it, which chooses the degree as well."""
    truth = swing(100)
    samples = noisy(truth, 0, (0.005, 0.01))
    program = fit_program(samples, noise=noise, degree=degree)
    solution, other = sm.ExactNewton().solve(program).require(), sm.smooth(samples, noise=noise)
    assert (of_motion(truth, solution.motion) < 1.02 * of_motion(truth, other.motion)).all()
    assert solution.motion.degree == degree and solution.motion.basis.n == other.motion.basis.n
    assert solution.program.notes[1:] == other.program.notes[1:]
    assert program.design.objective is not None and solution.iterations <= 1
    if degree == other.motion.degree:
        np.testing.assert_allclose(solution.x, other.x, atol=1e-9)


def test_what_is_given_is_not_chosen():
    samples = noisy(swing(60), 0, (0.005, 0.01))
    counted = fit_program(samples, objective=1e-3 * sm.Rigidity())
    assert counted.design.objective == 1e-3 * sm.Rigidity()
    assert counted.notes == (
        f"a spline of degree 3 with {counted.design.basis.n} controls follows 60 keyframes, as many as serve by "
        "generalised cross-validation",
    )
    knotted = fit_program(samples, knots=np.linspace(0.5, 5.5, 11), noise=(0.005, 0.01))
    assert knotted.design.basis.n == 15 and "15 controls follows" in knotted.notes[0]
    plain = fit_program(samples, controls=15)
    assert plain.design.objective is None and not plain.notes


def test_weights_tell_as_repeated_samples_do():
    """A sample of weight 2 counts as two; one without weight as none."""
    samples = noisy(swing(60), 0, (0.005, 0.01))
    weights = np.ones(60)
    weights[::5] = 0
    kept = np.flatnonzero(weights)
    alone, weighed = fit_program(samples[kept]), fit_program(samples, weights=weights)
    assert weighed.notes == alone.notes
    doubled = fit_program(samples, weights=np.full(60, 2.0), noise=(0.005, 0.01))
    halved = fit_program(samples, noise=(0.005 / np.sqrt(2), 0.01 / np.sqrt(2)))
    twice, once = (Evaluator(p).objective(p.x0) for p in (doubled, halved))
    assert twice == pytest.approx(2 * once, rel=5e-3)


def test_smoothing_solves_the_normal_equations():
    """(Bᵀ W B + μ K) c = Bᵀ W y entry by entry, B and K by SciPy; ± unit points weigh v thrice as much as A in both."""
    lam, weights = 1e-3, np.random.default_rng(1).uniform(0.5, 2, len(TOUR))
    program = fit_program(TOUR, controls=30, weights=weights, objective=lam * sm.TrajectoryEnergy(POINTS))
    solution = sm.ExactNewton().solve(program).require()
    basis = solution.motion.basis
    collocation = BSpline.design_matrix(TOUR.times, basis.knots, 3).toarray()
    bends = BSpline(basis.knots, np.eye(basis.n), 3).derivative(2)
    # Of piecewise linear functions, on each span: Simpson's rule is exact for their products.
    ends = basis.breakpoints
    stiffness = np.zeros((basis.n, basis.n))
    for a, b in pairwise(ends):
        for t, share in ((a, 1 / 6), (0.5 * (a + b), 4 / 6), (b, 1 / 6)):
            inside = bends(np.clip(t, a + 1e-9 * (b - a), b - 1e-9 * (b - a)))
            stiffness += share * (b - a) * np.outer(inside, inside)
    matrix = collocation.T @ (weights[:, None] * collocation) + 6 * lam * stiffness
    expected = np.linalg.solve(matrix, collocation.T @ (weights[:, None] * flat(TOUR)))
    np.testing.assert_allclose(solution.motion.spline.control_points, expected, atol=1e-7)


@pytest.mark.parametrize("huber", [None, 0.02])
@pytest.mark.parametrize("exact", [(), EXACT], ids=["none exact", "some exact"])
def test_solvers_agree(huber, exact):
    program = fit_program(spoilt()[0], controls=20, objective=SMOOTH, huber=huber, exact=exact)
    solvers = (sm.ExactNewton(), sm.ExactNewton(system="sparse"), sm.Ipopt(), sm.solvers.PlainIpopt())
    solutions = [s.solve(program).require(1e-7) for s in solvers]
    for s in solutions:
        assert s.inertia == "positive"
        np.testing.assert_allclose(s.x, solutions[0].x, atol=1e-6)
        np.testing.assert_allclose(s.multiplier_vector, solutions[0].multiplier_vector, atol=1e-5)


def test_huber_term_and_its_derivatives():
    samples, delta = planar_samples(15, 2, spread=0.3), 0.2
    program = fit_program(samples, controls=5, huber=delta)
    evaluator = Evaluator(program)
    x = program.x0 + 0.1 * np.random.default_rng(3).normal(size=program.unknowns)
    motion = program.design.motion(program.unpack(x))
    points = np.concatenate([np.eye(2), -np.eye(2)])
    given = samples.translation[:, None] + points @ samples.linear.transpose(0, 2, 1)
    squares = ((motion.trajectory(points, samples.times) - given) ** 2).sum(axis=2).mean(axis=1)
    np.testing.assert_allclose(program.design.distances(motion), np.sqrt(squares), rtol=1e-12)
    np.testing.assert_allclose(program.design.influence(motion), 1 / np.sqrt(1 + squares / delta**2), rtol=1e-12)
    assert evaluator.objective(x) == pytest.approx(
        2 * delta**2 * (np.sqrt(1 + squares / delta**2) - 1).sum(), rel=1e-12
    )
    np.testing.assert_allclose(evaluator.gradient(x), difference(evaluator.objective, x), atol=1e-7)


def test_huber_fit_agrees_with_soft_l1_of_scipy():
    """SciPy's soft_l1 of the distances is the same loss, 2δ²(√(1 + s/δ²) − 1), halved."""
    samples, delta = planar_samples(25, 4), 0.03
    program = fit_program(samples, controls=6, huber=delta)
    solution = sm.ExactNewton().solve(program).require()
    found = least_squares(
        lambda x: program.design.distances(program.design.motion(program.unpack(x))),
        program.x0,
        loss="soft_l1",
        f_scale=delta,
        xtol=1e-14,
        ftol=1e-14,
        gtol=1e-10,
    )
    assert solution.objective == pytest.approx(2 * found.cost, rel=1e-8)
    np.testing.assert_allclose(solution.x, found.x, atol=1e-4)


def test_huber_forgives_outliers():
    samples, thrown = spoilt()
    truth = sm.examples.recorded_tour(121, noise=0.0)
    away = {}
    for huber in (None, 0.02):
        program = fit_program(samples, controls=30, objective=SMOOTH, huber=huber)
        motion = sm.ExactNewton().solve(program).require().motion
        away[huber] = np.linalg.norm(motion(truth.times).translation - truth.translation, axis=1).max()
    assert away[0.02] < 0.1 * away[None]
    influence = program.design.influence(motion)
    assert influence[thrown].max() < 0.2 < np.delete(influence, thrown).min()


def test_exact_samples_are_met_and_have_prices():
    program = fit_program(TOUR, controls=20, objective=SMOOTH, huber=0.02, exact=EXACT)
    solution = sm.ExactNewton().solve(program).require(1e-9)
    met = TOUR[[0, 57, 120]]
    np.testing.assert_allclose(solution.motion(met.times).linear, met.linear, atol=1e-12)
    np.testing.assert_allclose(solution.motion(met.times).translation, met.translation, atol=1e-12)
    price = solution.multipliers["exact samples"]
    assert price.linear.shape == (3, 3, 3)
    step = 1e-5

    def optimum(i, part, entry, sign):
        change = np.zeros_like(getattr(TOUR, part)[i])
        change[entry] = sign * step
        moved = program.with_keyframes(TOUR.moved(i, **{part: getattr(TOUR, part)[i] + change}))
        return sm.ExactNewton().solve(moved, start=solution).require(1e-9).objective

    for k, part, entry in (
        (0, "linear", (0, 1)),
        (1, "linear", (2, 2)),
        (1, "translation", (1,)),
        (2, "translation", (0,)),
    ):
        slope = (optimum(EXACT[k], part, entry, 1) - optimum(EXACT[k], part, entry, -1)) / (2 * step)
        assert slope == pytest.approx(-getattr(price, part)[k][entry], rel=1e-5, abs=1e-8)


def test_other_samples_at_the_same_times_and_samples_left_out():
    program = fit_program(TOUR, controls=20, objective=SMOOTH, exact=EXACT)
    other = sm.examples.recorded_tour(121, seed=1, noise=5.0)
    fresh = sm.ExactNewton().solve(fit_program(other, controls=20, objective=SMOOTH, exact=EXACT)).require()
    reused = sm.ExactNewton().solve(program.with_keyframes(other)).require()
    np.testing.assert_allclose(reused.x, fresh.x, atol=1e-9)
    samples, thrown = spoilt()
    weights = np.ones(len(samples))
    weights[thrown] = 0.0
    knots = np.linspace(0, 20, 12)[1:-1]
    without = sm.ExactNewton().solve(fit_program(samples, knots=knots, weights=weights, objective=SMOOTH)).require()
    kept = samples[np.delete(np.arange(len(samples)), thrown)]
    left = sm.ExactNewton().solve(fit_program(kept, knots=knots, objective=SMOOTH)).require()
    np.testing.assert_allclose(without.x, left.x, atol=1e-10)


def test_a_motion_of_the_space_is_a_start_that_is_kept():
    program = fit_program(TOUR, controls=20, objective=SMOOTH)
    motion = sm.ExactNewton().solve(program).require().motion
    again = program.design.unknowns(motion)
    np.testing.assert_allclose(again["controls"], motion.spline.control_points, atol=1e-10)


FEW = TOUR[:10]


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: fit_program(FEW, controls=11), "10 samples cannot determine 11 controls"),
        (lambda: fit_program(FEW, controls=9, weights=[1, 0, 0] + [1] * 7), "8 samples cannot determine 9 controls"),
        (lambda: fit_program(FEW, controls=3), "controls 3: a whole number for degree 3, 4 or more"),
        (lambda: fit_program(FEW, controls=5, knots=[0.1]), "either controls"),
        (lambda: fit_program(FEW[:7]), "7 samples are too few to tell noise from motion: give noise, or controls"),
        (lambda: fit_program(FEW[:4], noise=(0.1, 0.1)), "4 samples at 4 times are too few to smooth: 5 or more"),
        (lambda: fit_program(FEW, noise=(0, 0)), "noise 0 asks for a motion through all samples, which affine_program"),
        (lambda: fit_program(FEW, noise=(1, 0)), "noise of one part is 0"),
        (lambda: fit_program(FEW, noise=cast(Any, 0.1)), "σ of places, σ of turns"),
        (lambda: fit_program(FEW, huber=0.1), "with huber give controls and an objective"),
        (lambda: fit_program(FEW, degree=1), "degree 1: bends tell how much to smooth"),
        (lambda: fit_program(FEW, controls=5, objective=sm.Rigidity(), noise=(1, 1)), "noise has nothing to choose"),
        (lambda: fit_program(FEW, knots=FEW.times[1] * np.array([0.2, 0.4, 0.6, 0.8])), "where there are no samples"),
        (lambda: fit_program(FEW, controls=5, weights=-np.ones(10)), "weight of sample 0 is -1"),
        (lambda: fit_program(FEW, controls=5, weights=np.ones(9)), r"weights of shape \(9,\) for 10 samples"),
        (lambda: fit_program(FEW, controls=5, huber=0.0), r"huber 0\.0"),
        (lambda: fit_program(FEW, controls=5, huber=-1.0), r"huber -1\.0"),
        (lambda: fit_program(FEW, controls=5, exact=[10]), "exact sample 10 does not exist: there are 10"),
        (lambda: fit_program(FEW, controls=5, exact=[-11]), "exact sample -11"),
        (lambda: fit_program(FEW, controls=5, exact=cast(Any, [0.5])), "exact sample 0.5 does not exist"),
        (lambda: fit_program(FEW, controls=5, exact=range(6)), "exact sample 4"),
        (lambda: fit_program(FEW, controls=10, exact=range(10)), "nothing is left"),
        (lambda: fit_program(FEW, controls=5, objective=cast(Any, "R")), "'R' is no energy"),
        (lambda: fit_program(FEW, controls=5, degree=0), "degree 0"),
        (lambda: fit_program(FEW, controls=5, points=np.zeros((1, 3))), "do not fix an affine position"),
        (lambda: fit_program(FEW, controls=5, points=np.eye(2)), r"shape \(P, 3\)"),
        (lambda: fit_program(FEW, controls=5).with_keyframes(TOUR), "keeps the times"),
        (lambda: fit_program(FEW, controls=5).with_keyframes(planar_samples(10, 0)), "2D for a program in 3D"),
        (lambda: fit_program(FEW, controls=5).stages("knots"), "no stages"),
    ],
)
def test_bad_input_names_the_culprit(make, message):
    with pytest.raises(sm.InputError, match=message):
        make()


SHAPE = np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [0.5, 1.5]])


def test_keyframes_of_affine_copies():
    keys = sm.examples.planar_keyframes()
    copies = keys.translation[:, None] + SHAPE @ keys.linear.transpose(0, 2, 1)
    found = keyframes_from_copies(SHAPE, copies, times=keys.times)
    np.testing.assert_allclose(found.linear, keys.linear, atol=1e-12)
    np.testing.assert_allclose(found.translation, keys.translation, atol=1e-12)
    np.testing.assert_array_equal(keyframes_from_copies(SHAPE, copies).times[[0, -1]], [0, 1])
    np.testing.assert_allclose(copy_deviations(found, SHAPE, copies), 0, atol=1e-12)
    # The residual of least squares is orthogonal to all affine images of the shape.
    drawn = copies + 0.1 * np.random.default_rng(0).normal(size=copies.shape)
    found = keyframes_from_copies(SHAPE, drawn)
    residual = found.translation[:, None] + SHAPE @ found.linear.transpose(0, 2, 1) - drawn
    np.testing.assert_allclose(np.einsum("pi,mpj->mij", np.column_stack([SHAPE, np.ones(4)]), residual), 0, atol=1e-12)
    np.testing.assert_allclose(copy_deviations(found, SHAPE, drawn), np.sqrt((residual**2).sum((1, 2)) / 4), rtol=1e-12)


@pytest.mark.parametrize(
    ("shape", "copies", "message"),
    [
        (SHAPE[:2], [SHAPE[:2]] * 2, "the shape's 2 points"),
        (SHAPE * [1, 0], [SHAPE] * 2, "the shape's 4 points lie in a line"),
        (SHAPE, [SHAPE, SHAPE * [1, 0]], "copy 1 is flat"),
        (SHAPE, [SHAPE, SHAPE * np.nan], "copy 1 has a point that is not finite"),
        (SHAPE, [SHAPE[:3]] * 2, r"\(M, 4, 2\) is needed"),
        (SHAPE[:, :1], [SHAPE] * 2, "a shape of"),
        (SHAPE, [SHAPE, SHAPE], "coincide"),
    ],
)
def test_bad_copies_are_named(shape, copies, message):
    with pytest.raises(sm.InputError, match=message):
        keyframes_from_copies(shape, np.array(copies))


def test_morphing_study():
    result = morphing.STUDY.run(StudyOptions())
    rows = {r["motion"]: r for r in table(result, "morphs")}
    assert rows["least R*"]["R*"] < 0.5 * rows["interpolating spline"]["R*"]
    assert rows["least R"]["R"] == min(r["R"] for r in rows.values())
    assert rows["least R"]["smallest area"] > 0.85 > 0.6 > rows["interpolating spline"]["smallest area"]
    assert certified(result)


def test_fitting_study_on_example_data_where_there_is_no_recording(monkeypatch):
    monkeypatch.setattr(recorded_pair, "ESTIMATE", Path("nowhere"))
    monkeypatch.setattr(fitting, "WEIGHTS", (None, 0.0, 1e-2))
    result = fitting.STUDY.run(StudyOptions())
    assert "example data made by the project" in result.notes[0]
    rows = {r["method"]: r for r in table(result, "outliers")}
    robust, plain = rows["robust fit, Huber δ = 10 mm"], rows["plain fit"]
    assert robust["position"] < 0.2 * plain["position"]
    assert robust["orientation"] < 0.2 * plain["orientation"]
    assert certified(result, ("newton",))


@pytest.mark.skipif(not recorded_pair.ESTIMATE.is_file(), reason=f"{recorded_pair.ESTIMATE} is not there")
def test_fitting_study_on_the_recorded_pair(monkeypatch):
    monkeypatch.setattr(fitting, "WEIGHTS", (None, 0.0, 1e-3))
    result = fitting.STUDY.run(StudyOptions())
    rows = {(r["controls"], r["objective beside the data"]): r for r in table(result, "error of the fits")}
    assert rows[160, "R + 0.001 E"]["position"] == pytest.approx(12.386, abs=1e-3)
    assert rows[160, "R + 0.001 E"]["velocity"] == pytest.approx(41.736, abs=1e-3)
    beside = {r["method"]: r for r in table(result, "beside")}
    assert beside["the estimate itself"]["position"] == pytest.approx(13.322, abs=1e-3)
    assert certified(result, ("newton",))
    assert len(result.figures) == 2
