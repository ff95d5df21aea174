"""Sensitivities against differences of minima that are solved again, whatever the program and the solver."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import casadi as ca
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import symmotion as sm
from symmotion.motions import noisy_net, smooth_net

KEYS = sm.examples.random_keyframes(5, 40, 0)
M = len(KEYS)
BOTH = sm.Rigidity() + 1e-2 * sm.TrajectoryEnergy(np.eye(3))
RNG = np.random.default_rng(1)
LINEAR, TRAVEL = RNG.normal(size=(M, 3, 3)), RNG.normal(size=(M, 3))
# Kernels of turns take the compiler long.
SOLVER = sm.ExactNewton(tolerance=1e-10, kernels="interpreted")
TURNS = Rotation.from_rotvec(np.cumsum(0.4 * RNG.normal(size=(M, 3)), axis=0))
SPIN = RNG.normal(size=(M, 3))
LIMIT = 0.02


def moved(h: float, keys: sm.Keyframes = KEYS) -> sm.Keyframes:
    return sm.Keyframes(keys.times, keys.linear + h * LINEAR, keys.translation + h * TRAVEL)


def turned(h: float) -> Rotation:
    return TURNS * Rotation.from_rotvec(h * SPIN)


def difference(value: Callable[[float], np.ndarray], h: float = 1e-4) -> np.ndarray:
    """The derivative at zero, of fourth order."""
    return (8 * (value(h) - value(-h)) - (value(2 * h) - value(-2 * h))) / (12 * h)


def solved(program: sm.program.Program, solver: Any = SOLVER, start: object = None) -> sm.Solution:
    return solver.solve(program, start=start).require()


def touching(velocity: float = 0.1, bound: float = LIMIT) -> sm.program.Program:
    """Conditions of all sorts: a tolerance that presses, a line, an equality with parameters."""
    constraints = [
        sm.constraints.OnLine(3, [1.0, 2.0, 3.0]),
        sm.Tolerance(linear=bound, translation=0.05, keyframes=[2]),
        sm.JetConstraint(
            lambda jet, p: jet.dv - p.v * jet.A[0, 0],
            at=[0.5 * KEYS.times[1]],
            name="touch",
            parameters={"v": [velocity, 0.2, 0.3]},
        ),
    ]
    return sm.affine_program(KEYS, objective=BOTH, constraints=constraints)


SAMPLES = sm.Keyframes(np.linspace(0, 4, 24), np.eye(3) + 0.2 * RNG.normal(size=(24, 3, 3)), RNG.normal(size=(24, 3)))
FRAMES, PLACES = RNG.normal(size=(24, 3, 3)), RNG.normal(size=(24, 3))


def followed(h: float) -> sm.Keyframes:
    return sm.Keyframes(SAMPLES.times, SAMPLES.linear + h * FRAMES, SAMPLES.translation + h * PLACES)


@pytest.mark.parametrize("objective", [sm.Rigidity(), BOTH], ids=["R", "R + E"])
@pytest.mark.parametrize("refine", [0, 1], ids=["sparse or small", "condensed"])
def test_affine_keyframes(objective, refine):
    program = sm.affine_program(KEYS, objective=objective, refine=refine)
    solution = solved(program)
    sensitivity = solution.sensitivity()
    tangent = sensitivity.tangent("keyframes", (LINEAR, TRAVEL))
    again = {h: solved(program.with_keyframes(moved(h)), start=solution) for h in (1e-4, -1e-4, 2e-4, -2e-4)}
    np.testing.assert_allclose(tangent, difference(lambda h: again[h].x), atol=1e-7)
    prices = sensitivity.multipliers("keyframes", (LINEAR, TRAVEL))["keyframes"]
    np.testing.assert_allclose(prices.linear, difference(lambda h: again[h].multipliers["keyframes"].linear), atol=1e-7)
    slope = sensitivity.optimum["keyframes"]
    change = (slope.linear * LINEAR).sum() + (slope.translation * TRAVEL).sum()
    assert change == pytest.approx(difference(lambda h: np.array(again[h].objective)), abs=1e-8)
    np.testing.assert_array_equal(slope.linear, -solution.multipliers["keyframes"].linear)


def test_linear_parts_alone_and_objects_with_two_parts():
    sensitivity = solved(sm.affine_program(KEYS, objective=BOTH)).sensitivity()
    alone = sensitivity.tangent("keyframes", LINEAR)
    np.testing.assert_array_equal(alone, sensitivity.tangent("keyframes", sm.Affine(LINEAR, np.zeros((M, 3)))))
    several = sensitivity.tangent("keyframes", np.stack([LINEAR, 2 * LINEAR, 0 * LINEAR, LINEAR, LINEAR]))
    np.testing.assert_allclose(several, np.outer([1, 2, 0, 1, 1], alone), atol=1e-12)


@pytest.mark.parametrize("solver", [SOLVER, sm.Ipopt(tolerance=1e-10, kernels="interpreted")], ids=["newton", "ipopt"])
def test_conditions_parameters_and_limits(solver):
    program = touching()
    solution = solved(program, solver)
    sensitivity = solution.sensitivity()

    def again(other: sm.program.Program) -> np.ndarray:
        return solved(other, start=solution.x).x

    tangent = sensitivity.tangent("keyframes", (LINEAR, TRAVEL))
    np.testing.assert_allclose(
        tangent, difference(lambda h: again(program.with_keyframes(moved(h))), 1e-5), atol=1e-7, rtol=1e-7
    )
    along = np.array([1.0, 0, 0])
    np.testing.assert_allclose(
        sensitivity.tangent("v", along), difference(lambda h: again(touching(velocity=0.1 + h))), atol=1e-7
    )
    # Both limits of an entry move outward by one.
    side = np.sign(solution.multipliers["tolerance"])
    side[:, 9:] = 0
    np.testing.assert_allclose(
        sensitivity.tangent("tolerance", side), difference(lambda h: again(touching(bound=LIMIT + h))), atol=1e-7
    )


def test_weights():
    solution = solved(sm.affine_program(KEYS, objective=BOTH))
    found = difference(
        lambda h: (
            solved(
                sm.affine_program(KEYS, objective=(1 + h) * sm.Rigidity() + 1e-2 * sm.TrajectoryEnergy(np.eye(3))),
                start=solution.x,
            ).x
        )
    )
    np.testing.assert_allclose(solution.sensitivity().tangent("weight of R", 1.0), found, atol=1e-7)


@pytest.mark.parametrize(
    "options",
    [{}, {"huber": 0.5, "exact": [3, 14]}, {"objective": 1e-2 * sm.Rigidity()}],
    ids=["least squares", "Huber, exact", "smoothed"],
)
def test_samples_of_fits(options):
    program = sm.fit_program(SAMPLES, controls=8, **options)
    solution = solved(program)
    found = difference(lambda h: solved(program.with_keyframes(followed(h)), start=solution).x)
    np.testing.assert_allclose(solution.sensitivity().tangent("samples", (FRAMES, PLACES)), found, atol=1e-7)


def test_orientations_and_poses():
    # Least rate: the kernel of the torque takes long to derive.
    still = sm.JetEnergy(lambda jet: ca.sumsqr(jet.rate))
    program = sm.orientation_program(KEYS.times, TURNS, objective=still)
    solution = solved(program)
    found = difference(lambda h: solved(program.with_keyframes((KEYS.times, turned(h))), start=solution).x)
    np.testing.assert_allclose(solution.sensitivity().tangent("keyframes", SPIN), found, atol=1e-7)
    objective = still + sm.TrajectoryEnergy(np.eye(3))
    poses = sm.pose_program(KEYS.times, TURNS, TRAVEL, objective=objective)
    solution = solved(poses)

    def again(h: float) -> np.ndarray:
        return solved(poses.with_keyframes((KEYS.times, turned(h), (1 + h) * TRAVEL)), start=solution).x

    sensitivity = solution.sensitivity()
    tangent = sensitivity.tangent("keyframes", SPIN) + sensitivity.tangent("translation", TRAVEL)
    np.testing.assert_allclose(tangent, difference(again), atol=1e-7)


def test_curves():
    values = RNG.normal(size=(4, 2))
    change = RNG.normal(size=(4, 2))

    def program(h: float) -> sm.program.Program:
        condition = sm.constraints.CurveCondition.at([0.0, 1, 2.5, 4], values + h * change, name="points")
        return sm.curve_program([condition], objective=sm.energies.Bending(), knots=[1.0, 2.0, 2.5, 3.0])

    solution = solved(program(0.0))
    found = difference(lambda h: solved(program(h)).x)
    np.testing.assert_allclose(solution.sensitivity().tangent("points", change), found, atol=1e-7)


def test_nets():
    net = noisy_net(smooth_net(7), 0.018, seed=1)
    where = tuple(float(a + 0.4 * (b - a)) for a, b in net.domain)

    def program(h: float) -> sm.program.Program:
        there = sm.JetConstraint(lambda jet: jet.d[:2], lower=0.2 + h, upper=0.2 + h, at=[where], name="place")
        return sm.fairing.fairing_program(net, weight=0.1, constraints=[there])

    solution = solved(program(0.0))
    found = difference(lambda h: solved(program(h)).x)
    np.testing.assert_allclose(solution.sensitivity().tangent("place", np.ones((1, 2))), found, atol=1e-7)


def test_free_times_and_joined_bodies():
    program = sm.free_times_program(KEYS, objective=BOTH)
    solution = solved(program)
    found = difference(lambda h: solved(program.with_keyframes(moved(h)), start=solution).x, 2e-5)
    np.testing.assert_allclose(
        solution.sensitivity().tangent("keyframes", (LINEAR, TRAVEL)), found, atol=1e-7, rtol=1e-7
    )
    bodies = {name: sm.affine_program(KEYS, objective=BOTH) for name in ("arm", "hand")}
    meeting = sm.JetConstraint(lambda a, b: a.v - b.v - 0.1, at=[(0.5, 1.5)], name="hinge")
    joined = sm.join(bodies, [meeting])
    solution = solved(joined)
    found = difference(lambda h: solved(joined.with_keyframes({"arm": moved(h)}), start=solution).x, 2e-5)
    np.testing.assert_allclose(
        solution.sensitivity().tangent("arm: keyframes", (LINEAR, TRAVEL)), found, atol=1e-7, rtol=1e-7
    )


@pytest.mark.parametrize("program", [touching(), sm.affine_program(KEYS)], ids=["sparse", "condensed"])
def test_the_adjoint_is_the_transposed(program):
    sensitivity = solved(program).sensitivity()
    gradients = np.random.default_rng(0).normal(size=(5, program.unknowns))
    pulled = sensitivity.adjoint(gradients)
    assert set(pulled) == set(sensitivity.names)
    for name in sensitivity.names:
        operator = sensitivity.operator(name)
        whole = operator @ np.eye(operator.shape[1])
        np.testing.assert_allclose(operator.T @ gradients.T, (gradients @ whole).T, atol=1e-10)
        datum = sensitivity.datum(name)
        shaped = datum.shaped(gradients @ whole)
        for part in ("linear", "translation") if datum.pair else (None,):
            found, wanted = (getattr(v, part) if part else v for v in (pulled[name], shaped))
            np.testing.assert_allclose(found, wanted, atol=1e-10)
        single = sensitivity.adjoint(gradients[1])[name]
        first = single.linear if datum.pair else single
        np.testing.assert_allclose(first, (pulled[name].linear if datum.pair else pulled[name])[1], atol=1e-10)


def test_bounds_that_do_not_touch_are_not_there_and_weak_ones_are_named():
    free = sm.affine_program(KEYS, objective=BOTH)
    solution = solved(free)
    at = float(KEYS.times[1]) / 3

    def bounded(limit: float) -> sm.Solution:
        height = sm.JetConstraint(lambda jet: jet.v[2], upper=limit, lower=-np.inf, at=at, name="ceiling")
        return solved(sm.affine_program(KEYS, objective=BOTH, constraints=[height]))

    reached = float(solution.motion(at).translation[2])
    above = bounded(reached + 0.1).sensitivity()
    tangent = solution.sensitivity().tangent("keyframes", (LINEAR, TRAVEL))
    np.testing.assert_allclose(above.tangent("keyframes", (LINEAR, TRAVEL)), tangent, atol=1e-7)
    assert not above.tangent("ceiling", 1.0).any()
    below = bounded(reached - 0.1)
    found = difference(lambda h: bounded(reached - 0.1 + h).x)
    np.testing.assert_allclose(below.sensitivity().tangent("ceiling", 1.0), found, atol=1e-7)
    with pytest.raises(sm.InputError, match=r"bounds 'ceiling' are met without a multiplier.*one-sided"):
        bounded(reached).sensitivity()


def test_contacts_of_bounds_that_hold_everywhere_move_along():
    free = solved(sm.affine_program(KEYS, objective=BOTH)).motion
    heights = free(np.linspace(KEYS.times[0], KEYS.times[-1], 400)).translation[:, 2]
    limit = 0.5 * (heights.max() + KEYS.translation[:, 2].max())
    ceiling = sm.JetConstraint(lambda jet: jet.v[2], lower=-np.inf, upper=limit, name="ceiling")
    program = sm.affine_program(KEYS, objective=BOTH, constraints=[ceiling])
    solution = solved(program)
    h = 1e-3
    found = (solved(program.with_keyframes(moved(h))).x - solved(program.with_keyframes(moved(-h))).x) / (2 * h)
    tangent = solution.sensitivity().tangent("keyframes", (LINEAR, TRAVEL))
    # The contact is known to the root of the excess; with a contact that stays it would be off by 0.1.
    np.testing.assert_allclose(tangent, found, atol=5e-3)


def test_what_is_refused():
    sensitivity = solved(touching()).sensitivity()
    with pytest.raises(sm.InputError, match="no datum 'w'; there are keyframes, line, tolerance, touch, v"):
        sensitivity.tangent("w", 1.0)
    with pytest.raises(sm.InputError, match=r"change of 'v' of shape \(2,\): finite, \(3,\), is needed"):
        sensitivity.tangent("v", [1.0, 2.0])
    with pytest.raises(sm.InputError, match=r"gradient of shape \(3,\)"):
        sensitivity.adjoint([1.0, 2.0, 3.0])
    still = sm.JetEnergy(lambda jet: ca.sumsqr(jet.rate))
    loose = sm.orientation_program(
        KEYS.times, TURNS, objective=still, constraints=[sm.Tolerance(turn=0.1, keyframes=[2])]
    )
    solution = solved(loose, sm.Ipopt(tolerance=1e-9))
    with pytest.raises(sm.InputError, match="some of it is no condition of the program"):
        solution.sensitivity().tangent("keyframes", SPIN)
    with pytest.raises(sm.SolveError, match="iteration-limit"):
        sm.ExactNewton(max_iterations=1).solve(sm.affine_program(KEYS)).sensitivity()


def test_edits_start_along_the_tangent_and_end_at_the_same_minimum():
    program = sm.affine_program(KEYS, objective=BOTH)
    solution = sm.ExactNewton().solve(program).require()
    for h in (1e-6, 1e-3, 1e-1):
        edited = program.with_keyframes(moved(h))
        warm = sm.ExactNewton().solve(edited, start=solution).require()
        cold = sm.ExactNewton().solve(edited, start=replace(solution).x).require()
        np.testing.assert_allclose(warm.x, cold.x, atol=1e-9)
        assert warm.inertia == "positive"
        np.testing.assert_allclose(warm.multiplier_vector, cold.multiplier_vector, atol=1e-8)
    near = sm.ExactNewton().solve(program.with_keyframes(moved(1e-6)), start=solution)
    assert "hessian" not in near.evaluations
