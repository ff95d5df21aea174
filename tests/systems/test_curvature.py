"""Curvature: nothing above rounding is missed, on matrices whose eigenvalues range over twelve decades."""

import numpy as np
import pytest
import scipy.linalg as la
from scipy import sparse

import symmotion as sm
from studies.quaternions.constructions import chain
from symmotion.program import Evaluator
from symmotion.systems import HessianTriangle, Saddle
from symmotion.systems.curvature import banded_curvature, dense_curvature, first_failing_pivot


def bands(matrix: np.ndarray) -> np.ndarray:
    return np.array([np.r_[np.diag(matrix, -k), np.zeros(k)] for k in range(len(matrix))])


@pytest.mark.parametrize("negative", [False, True])
def test_one_negative_eigenvalue_is_found_and_none_is_invented(negative):
    rng = np.random.default_rng(5)
    for _ in range(100):
        n = int(rng.integers(2, 60))
        basis = np.linalg.qr(rng.normal(size=(n, n)))[0]
        values = 10.0 ** rng.uniform(-12, 0, n)
        values[0] = 1.0
        values[-1] *= -1.0 if negative else 1.0
        matrix = (basis * values) @ basis.T
        matrix = (matrix + matrix.T) / 2
        # In other units the answer is the same.
        units = 10.0 ** rng.uniform(-6, 6, n)
        for each in (matrix, units[:, None] * matrix * units):
            for found in (dense_curvature(each), banded_curvature(bands(each))):
                assert found.inertia == ("indefinite" if negative else "positive")
                assert (found.direction is not None) == negative
                if found.direction is not None:
                    assert found.direction @ each @ found.direction < 0
        pivot = first_failing_pivot(sparse.csc_array(matrix))
        assert (pivot is not None) == negative
        if pivot is not None:
            assert pivot @ matrix @ pivot <= 0


def test_what_is_zero_is_flat_and_what_rounding_hides_is_unknown():
    column = np.random.default_rng(0).normal(size=(4, 1))
    for curvature in (dense_curvature, lambda m: banded_curvature(bands(m))):
        assert curvature(np.zeros((3, 3))).inertia == "flat"
        assert curvature(column @ column.T).inertia == "unknown"
        assert curvature(np.array([[0.0, 1.0], [1.0, 0.0]])).inertia == "indefinite"


def test_large_sparse_systems_along_their_conditions():
    """At a minimum, the Hessian is positive along the conditions, its negative is not, and zero is flat."""
    program = sm.affine_program(sm.examples.random_keyframes(40, 40, seed=0), objective=sm.Rigidity())
    solution = sm.ExactNewton().solve(program).require()
    evaluator = Evaluator(program)
    saddle = Saddle.of(program, lambda: evaluator.jacobian(program.x0))
    assert saddle.n > 300
    flat = evaluator.second_order(solution.x, saddle.pattern)[1]
    assert saddle.curvature(flat).inertia == "positive"
    lowest = saddle.curvature(-flat)
    assert lowest.inertia == "indefinite" and lowest.direction is not None
    assert np.abs(evaluator.jacobian(solution.x) @ lowest.direction).max() < 1e-9 * np.abs(lowest.direction).max()
    assert saddle.curvature(0.0 * flat).inertia == "flat"


def test_rounding_of_what_breaks_the_conditions_is_no_curvature_along_them():
    """Beside λ∇²c the Hessian is negative across the conditions, which the first weights do not outweigh."""
    program = sm.orientation_program(np.arange(8.0), chain(8, 130, 0), refine=7)
    evaluator, solution = Evaluator(program, "interpreted"), sm.ExactNewton().solve(program).require()
    saddle = Saddle(program, evaluator.jacobian(solution.x))
    rng = np.random.default_rng(1)
    for _ in range(12):
        x = solution.x + 1e-6 * rng.normal(size=program.unknowns)
        system = saddle.at(evaluator.jacobian(x))
        flat = evaluator.second_order(x, system.pattern, solution.multiplier_vector)[1]
        basis = la.null_space(system.jacobian.toarray() * program.unit) * program.unit[:, None]
        full = HessianTriangle.of(program).full(flat, program.unknowns)
        assert la.eigvalsh(basis.T @ (full @ basis))[0] > 0
        assert system.curvature(flat).inertia == "positive"
