from contextlib import nullcontext
from typing import Any

import casadi as ca
import numpy as np
import pytest
from problems import body_points
from scipy import sparse

import symmotion as sm
from symmotion.kernels import Kernel
from symmotion.program import Block, Constraint, Evaluator, Program
from symmotion.systems import Condensed, Saddle, certify, kkt_pattern

RNG = np.random.default_rng(3)
MIXED = sm.Rigidity() + 0.1 * sm.TrajectoryEnergy(body_points(3)) + 0.01 * sm.Rigidity(2)


def mixed_program(degree=3, refine=1):
    return sm.affine_program(sm.examples.random_keyframes(6, 70, 1), degree=degree, refine=refine, objective=MIXED)


def away(program):
    """A point off the start, the same in every run."""
    return program.x0 + 0.1 * np.random.default_rng(0).normal(size=program.unknowns)


@pytest.fixture(scope="module")
def casadi_oracle():
    """The program as the plain CasADi problem, differentiated as a whole: what the batched kernels must equal."""
    program = mixed_program()
    nlp = program.nlp()
    x, f, g = nlp["x"], nlp["f"], nlp["g"]
    function = ca.Function("oracle", [x], [f, ca.gradient(f, x), ca.hessian(f, x)[0], g, ca.jacobian(g, x)])
    point = away(program)
    return program, point, [np.asarray(ca.densify(v)) for v in function(point)]


def test_batched_kernels_equal_the_whole_casadi_graph(casadi_oracle):
    program, x, (f, gradient, hessian, g, jacobian) = casadi_oracle
    evaluator = Evaluator(program)
    assert evaluator.objective(x) == pytest.approx(f.item(), rel=1e-13)
    np.testing.assert_allclose(evaluator.gradient(x), gradient.ravel(), atol=1e-11)
    np.testing.assert_allclose(evaluator.values(x), g.ravel(), atol=1e-13)
    np.testing.assert_allclose(evaluator.jacobian(x).toarray(), jacobian, atol=1e-15)
    saddle = Saddle.of(program, lambda: evaluator.jacobian(x))
    slopes, flat = evaluator.second_order(x, saddle.pattern)
    np.testing.assert_allclose(slopes, gradient.ravel(), atol=1e-11)
    whole = saddle.matrix(flat).toarray()
    expected = np.block([[hessian, jacobian.T], [jacobian, np.zeros((len(g), len(g)))]])
    np.testing.assert_allclose(whole, expected, atol=1e-11)


def test_condensed_system_is_the_hessian_on_a_null_space_basis(casadi_oracle):
    program, x, (_, gradient, hessian, g, jacobian) = casadi_oracle
    evaluator = Evaluator(program)
    condensed = Condensed.of(program)
    assert condensed is not None
    z = np.kron(condensed.basis.toarray(), np.eye(condensed.channels))
    assert np.abs(jacobian @ z).max() < 1e-14
    _, flat = evaluator.second_order(x, condensed.pattern)
    bands, reduced = condensed.lower_bands(flat), z.T @ hessian @ z
    for k in range(condensed.size):
        diagonal = np.diag(reduced, -k)
        expected = bands[k, : len(diagonal)] if k <= condensed.band else np.zeros_like(diagonal)
        np.testing.assert_allclose(expected, diagonal, atol=1e-11)
    multipliers = condensed.multipliers(gradient.ravel())
    pivots = np.abs(gradient.ravel() + jacobian.T @ multipliers).reshape(-1, condensed.channels)[condensed.pivots]
    assert pivots.max() < 1e-12
    feasible = condensed.feasible(x, g.ravel())
    assert np.abs(evaluator.values(feasible)).max() < 1e-14


@pytest.mark.parametrize("theta", [0.0, 0.3])
def test_theta_blends_gauss_newton_and_exact_hessian(theta):
    program = sm.affine_program(sm.examples.planar_keyframes())
    evaluator, x = Evaluator(program), away(program)
    saddle = Saddle.of(program, lambda: evaluator.jacobian(x))
    exact, blend, gauss_newton = (evaluator.second_order(x, saddle.pattern, theta=t)[1] for t in (1.0, theta, 0.0))
    np.testing.assert_allclose(blend, gauss_newton + theta * (exact - gauss_newton), atol=1e-12)
    eigenvalues = np.linalg.eigvalsh(saddle.matrix(gauss_newton).toarray()[: program.unknowns, : program.unknowns])
    assert eigenvalues.min() > -1e-12 * eigenvalues.max()


def test_line_is_the_objective_along_a_direction():
    program = mixed_program()
    evaluator, x, direction = Evaluator(program), away(program), RNG.normal(size=program.unknowns)
    quartic = evaluator.line(x, direction)
    assert quartic is not None
    for alpha in (-0.7, 0.0, 0.4, 2.0):
        assert np.polyval(quartic[::-1], alpha) == pytest.approx(evaluator.objective(x + alpha * direction), rel=1e-12)
    free = sm.JetEnergy(lambda jet: ca.exp(jet.dA[0, 0]))
    assert Evaluator(sm.affine_program(sm.examples.planar_keyframes(), objective=free)).line(x, direction) is None


@pytest.mark.parametrize(("degree", "refine"), [(3, 1), (3, 0), (4, 1), (2, 1)])
def test_both_saddle_systems_give_the_same_newton_step(degree, refine):
    program = mixed_program(degree, refine)
    evaluator = Evaluator(program)
    condensed, saddle = Condensed.of(program), Saddle.of(program, lambda: evaluator.jacobian(program.x0))
    assert condensed is not None
    steps = []
    systems: tuple[Any, ...] = (condensed, saddle)
    for system in systems:
        gradient, flat = evaluator.second_order(program.x0, system.pattern, theta=0.0)
        flat[system.diagonal] += 1e-6
        factor = system.factorise(flat)
        assert factor is not None
        steps.append(system.step(factor, gradient))
    # The ridge weighs free controls in one and all controls in the other: equal but for that.
    np.testing.assert_allclose(steps[0], steps[1], atol=1e-3 * np.abs(steps[0]).max())


def test_certificate_recomputes_everything():
    program = mixed_program()
    solution = sm.ExactNewton().solve(program)
    evaluator = Evaluator(program)
    good = certify(program, solution.x, solution.multiplier_vector)
    lagrangian = evaluator.gradient(solution.x) + evaluator.jacobian(solution.x).T @ solution.multiplier_vector
    assert good.stationarity == pytest.approx(np.abs(lagrangian).max())
    assert good.inertia == "positive"
    off = certify(program, solution.x + 1e-3, solution.multiplier_vector)
    assert off.violation == pytest.approx(1e-3, rel=1e-9)
    assert not off.holds(1e-8)
    wrong = certify(program, solution.x, 0 * solution.multiplier_vector)
    assert wrong.stationarity == pytest.approx(np.abs(evaluator.gradient(solution.x)).max())
    lost = certify(program, solution.x * np.nan, solution.multiplier_vector)
    assert lost.inertia == "unknown"
    assert not lost.holds(1e300)


def test_kkt_pattern_covers_the_matrix():
    program = mixed_program()
    evaluator = Evaluator(program)
    saddle = Saddle.of(program, lambda: evaluator.jacobian(program.x0))
    _, flat = evaluator.second_order(away(program), saddle.pattern)
    pattern = kkt_pattern(program).toarray()
    assert pattern.shape == (program.unknowns + program.conditions,) * 2
    assert not (saddle.matrix(flat).toarray()[~pattern] != 0).any()
    assert pattern.mean() < 0.6


def test_program_prints_its_unknowns_terms_and_constraints():
    text = str(mixed_program())
    assert text.splitlines()[0] == "Program: 156 unknowns, 72 conditions"
    for part in ("controls: 13 × 12", "R: 10 elements × 6 nodes", "E: 10 elements × 2 nodes", "R*: ", "72 multipliers"):
        assert part in text
    with pytest.raises(sm.InputError, match="no constraint 'speed'; there are keyframes"):
        mixed_program().constraint("speed")


class _Plain:
    """A design of bare numbers, for programs that are no motions."""

    def motion(self, unknowns):
        return unknowns

    def unknowns(self, motion):
        return motion

    def multipliers(self, multipliers):
        return multipliers


def circle_program(bound: bool):
    """Minimise (x₁ − 2)² + (x₂ − 1)² on the unit circle, or inside it: optimum (2, 1)/√5 and λ = √5 − 1."""
    z, data = ca.SX.sym("z", 2), ca.SX.sym("data", 0)
    one, nothing = np.ones(1), np.empty((1, 0))
    eye = sm.splines.BSplineBasis.clamped([0.0, 1.0], 0).matrix([0.5])
    term = Block(
        "distance", Kernel(z, data, z - ca.DM([2, 1]), 2, squares=True), "x", slice(0, 2), eye, 1, one, nothing
    )
    norm = Block("circle", Kernel(z, data, ca.sumsqr(z) - 1, 2), "x", slice(0, 2), eye, 1, one, nothing)
    constraint = Constraint(norm, np.full((1, 1), -np.inf), np.zeros((1, 1))) if bound else Constraint.equality(norm)
    return Program({"x": np.array([[0.5, 0.5]])}, (term,), (constraint,), _Plain())  # pyright: ignore


@pytest.mark.parametrize("bound", [False, True])
def test_nonlinear_constraints_and_bounds_are_for_ipopt_and_newton(bound):
    program = circle_program(bound)
    solution = sm.Ipopt().solve(program).require(1e-7)
    np.testing.assert_allclose(solution.x, np.array([2, 1]) / np.sqrt(5), atol=1e-7)
    assert solution.multipliers["circle"].item() == pytest.approx(np.sqrt(5) - 1, abs=1e-6)
    assert solution.inertia == "positive"
    word = "an inequality" if bound else "nonlinear"
    with pytest.raises(sm.InputError, match=f"linear equalities only and 'circle' is {word}"):
        sm.Elimination().solve(program)
    row = sm.compare(program, [sm.Elimination()]).solutions[0]
    assert row.status == "unsupported"
    assert "circle" in row.message


@pytest.mark.parametrize("bound", [False, True])
def test_newton_takes_nonlinear_equalities_and_inequalities(bound):
    program = circle_program(bound)
    solution = sm.ExactNewton().solve(program).require(1e-10)
    np.testing.assert_allclose(solution.x, np.array([2, 1]) / np.sqrt(5), atol=1e-10)
    assert solution.multipliers["circle"].item() == pytest.approx(np.sqrt(5) - 1, abs=1e-9)
    assert solution.inertia == "positive"
    # The bound alone leaves nothing to eliminate.
    with pytest.raises(sm.InputError, match='nonlinear: use system="sparse"') if not bound else nullcontext():
        sm.ExactNewton(system="condensed").solve(program).require()


def test_newton_leaves_the_farthest_point_of_a_circle():
    """(−2, −1)/√5 is stationary on the circle, a maximum: negative curvature leads away from it."""
    program = circle_program(False)
    solution = sm.ExactNewton().solve(program, start=-np.array([2.0, 1.0]) / np.sqrt(5)).require(1e-7)
    assert solution.log[0].stationarity < 1e-12
    assert solution.log[0].inertia == "indefinite"
    np.testing.assert_allclose(solution.x, np.array([2, 1]) / np.sqrt(5), atol=1e-7)


def test_a_block_without_nodes_is_refused():
    z = ca.SX.sym("z", 1)
    kernel = Kernel(z, ca.SX.sym("data", 0), z, 1, squares=True)
    with pytest.raises(sm.InputError, match="block 'empty' has no nodes: leave it out"):
        Block("empty", kernel, "x", slice(0, 1), sparse.csr_array((0, 1)), 1, np.empty(0), np.empty((0, 0)))


def test_the_hessian_of_a_quadratic_program_is_made_once():
    """The same for every point and theta, by a table of its own each time; of others it is made anew."""
    keys = sm.examples.spatial_keyframes()
    for objective, times in ((sm.energies.Roughness(1.0, 2.0), 1), (sm.Rigidity(), 3)):
        program = sm.affine_program(keys, objective=objective)
        evaluator, fresh = Evaluator(program), Evaluator(program)
        pattern = sm.systems.system_of(program, evaluator, program.x0).pattern
        first = evaluator.second_order(program.x0, pattern)[1]
        kept = first.copy()
        first[:] = 0.0
        x = program.x0 + 0.1
        gradient, second = evaluator.second_order(x, pattern, theta=0.3)
        other = fresh.second_order(x, pattern, theta=0.3)
        np.testing.assert_array_equal(second, other[1])
        np.testing.assert_allclose(gradient, other[0], rtol=1e-12, atol=1e-9)
        assert np.array_equal(second, kept) == (times == 1)
        evaluator.second_order(x, pattern)
        assert evaluator.counts["hessian"] == times
        doubled = evaluator.second_order(x, pattern, factor=2.0)[1]
        np.testing.assert_allclose(doubled, 2 * evaluator.second_order(x, pattern)[1], rtol=1e-12)
