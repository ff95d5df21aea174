"""Condensed and Saddle are the same system, stored and solved in two ways."""

import numpy as np
import pytest

import symmotion as sm
from symmotion.program import Bounded, Evaluator, Program
from symmotion.systems import AnySystem, Condensed, HessianTriangle, Saddle, System, conflicting, kkt_pattern

KEYS = sm.examples.random_keyframes(6, 70, 5)
PROGRAMS = {
    "planar": lambda: sm.affine_program(sm.examples.planar_keyframes(), objective=sm.Rigidity()),
    "R* in space": lambda: sm.affine_program(KEYS, objective=sm.Rigidity(2)),
    "with translations": lambda: sm.affine_program(
        KEYS, objective=sm.Rigidity() + 0.1 * sm.TrajectoryEnergy(np.eye(3)), degree=5, refine=2
    ),
    "dense basis": lambda: sm.affine_program(KEYS, degree=4, refine=0, objective=sm.Rigidity(2)),
    "curve": lambda: sm.curve_program([sm.constraints.CurveCondition.at(np.arange(5.0), np.eye(5))], refine=1),
}
SYSTEMS = ("condensed", "sparse")


def system_of(name: str, program: Program, evaluator: Evaluator) -> AnySystem:
    condensed = Condensed.of(program)
    assert condensed is not None
    # Both are what the protocol says: a type checker reads these lines too.
    banded: System[np.ndarray] = condensed
    sparse: AnySystem = Saddle.of(program, lambda: evaluator.jacobian(program.x0))
    return banded if name == "condensed" else sparse


@pytest.fixture(params=PROGRAMS.values(), ids=list(PROGRAMS), scope="module")
def case(request):
    """A program, its evaluator, both its systems and its minimum."""
    program = request.param()
    evaluator = Evaluator(program, "interpreted")
    systems = [system_of(name, program, evaluator) for name in SYSTEMS]
    return program, evaluator, systems, sm.ExactNewton(kernels="interpreted").solve(program).require()


def nearby(case, size):
    """A point where the conditions hold, near the minimum."""
    program, evaluator, systems, solution = case
    x = solution.x + size * np.random.default_rng(3).normal(size=program.unknowns)
    return systems[0].feasible(x, evaluator.violation(x))


def test_feasible_points_are_feasible_and_stay(case):
    program, evaluator, systems, solution = case
    for system in systems:
        x = system.feasible(solution.x + 0.1, evaluator.violation(solution.x + 0.1))
        assert np.abs(evaluator.violation(x)).max() < 1e-12
        assert system.feasible(x, np.zeros(program.conditions)) is x


def test_the_pattern_holds_the_hessian_and_the_diagonal_lies_in_it(case):
    program, _, systems, _ = case
    for system in systems:
        places = np.arange(system.pattern.size)[system.diagonal]
        assert len(np.unique(places)) == len(places)
    assert len(np.arange(systems[1].pattern.size)[systems[1].diagonal]) == program.unknowns
    assert len(np.arange(systems[0].pattern.size)[systems[0].diagonal]) == program.unknowns - program.conditions


def test_near_a_minimum_the_inertia_is_right_and_the_steps_are_those_of_the_whole_matrix(case):
    program, evaluator, systems, _ = case
    x = nearby(case, 1e-4)
    steps = []
    for system in systems:
        gradient, flat = evaluator.second_order(x, system.pattern)
        factor = system.factorise(flat)
        assert factor is not None
        steps.append(system.step(factor, gradient))
    scale = np.abs(steps[0]).max()
    np.testing.assert_allclose(steps[1] / scale, steps[0] / scale, atol=1e-7)
    saddle = systems[1]
    whole = saddle.matrix(evaluator.second_order(x, saddle.pattern)[1]).toarray()
    exact = np.linalg.solve(whole, np.concatenate([-evaluator.gradient(x), np.zeros(program.conditions)]))
    np.testing.assert_allclose(steps[0] / scale, exact[: program.unknowns] / scale, atol=1e-7)
    assert np.abs(evaluator.jacobian(x) @ steps[0]).max() < 1e-10 * max(1.0, scale)


def test_at_the_minimum_the_multipliers_are_the_same(case):
    _, evaluator, systems, solution = case
    gradient = evaluator.gradient(solution.x)
    scale = np.abs(gradient).max() or 1.0
    for system in systems:
        np.testing.assert_allclose(system.multipliers(gradient), solution.multiplier_vector, atol=1e-7 * scale)
        assert np.abs(system.reduced(gradient)).max() < 1e-7 * scale


def test_matrices_with_the_wrong_inertia_are_refused_and_their_direction_is_found(case):
    program, evaluator, systems, solution = case
    hessian = HessianTriangle.of(program)
    full = hessian.full(evaluator.second_order(solution.x, hessian.pattern)[1], program.unknowns).toarray()
    for system in systems:
        _, flat = evaluator.second_order(solution.x, system.pattern)
        assert system.curvature(flat).inertia == "positive"
        opposite = system.curvature(-flat)
        direction = opposite.direction
        assert system.factorise(-flat) is None and opposite.inertia == "indefinite"
        assert direction is not None and direction @ full @ direction > 0  # and so of -flat below zero
        assert np.abs(evaluator.jacobian(solution.x) @ direction).max() < 1e-9 * np.abs(direction).max()


@pytest.mark.parametrize(
    "call", [Evaluator, Bounded, kkt_pattern, lambda value: conflicting(value, np.zeros(3))], ids=range(4)
)
def test_what_is_no_program_is_refused(call):
    with pytest.raises(sm.InputError, match="program of type Keyframes: what affine_program and its like return is"):
        call(KEYS)
