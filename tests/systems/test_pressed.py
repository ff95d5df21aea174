"""The band with bounds that press sees what the sparse saddle system sees."""

import numpy as np
import pytest

import symmotion as sm
from studies.solving.bounded_problems import problem
from symmotion.systems import Condensed, Inspection

# Of each kind whose equalities decouple a small problem that has a solution.
SEEDS = {"speed": 0, "tolerance": 34, "no inversion": 46, "floor": 80, "keep out": 48, "fit": 27, "curve": 64}
NEWTON = sm.ExactNewton(kernels="interpreted")


@pytest.mark.parametrize("kind", SEEDS)
def test_certificates_of_the_band_and_of_the_saddle_system_agree(kind, monkeypatch):
    solution = NEWTON.solve(problem(SEEDS[kind]).program).require()
    program, rng = solution.program, np.random.default_rng(2)
    assert Inspection(program, sm.program.Evaluator(program), solution.x, solution.multiplier_vector).pressed
    off = 1e-4 * rng.normal(size=program.unknowns) * program.unit
    points = [solution.x, solution.x + off]
    banded = [sm.certify(program, x, solution.multiplier_vector) for x in points]
    monkeypatch.setattr(Condensed, "of", staticmethod(lambda program: None))
    sparse = [sm.certify(program, x, solution.multiplier_vector) for x in points]
    for a, b in zip(banded, sparse, strict=True):
        assert (a.inertia, a.holds(1e-8)) == (b.inertia, b.holds(1e-8))
        assert a.stationarity == pytest.approx(b.stationarity, rel=1e-6, abs=1e-12)
    assert banded[0].holds(1e-8) and not banded[1].holds(1e-8)
    assert banded[1].decrement == pytest.approx(sparse[1].decrement, rel=1e-5)
