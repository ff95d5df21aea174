"""One pass over elements by machine code, and lists of instructions by NumPy: the bits of CasADi's interpreter."""

import numpy as np
import pytest

import symmotion as sm
from symmotion.kernels import compiled, mapped
from symmotion.kernels.arrays import ArrayFunction
from symmotion.program import Bounded, Evaluator
from symmotion.program.local import Targets
from symmotion.systems import Condensed, HessianTriangle

needs_compiler = pytest.mark.skipif(not compiled._compiler(), reason="no C compiler on this machine")
KEYS = sm.examples.planar_keyframes()
POINTS = np.array([[0.0, 0.0], [1.0, 0.0]])
BOTH = sm.Rigidity() + 0.1 * sm.TrajectoryEnergy(POINTS)


def programs():
    """Several terms and bounds; knots that leave the ends fewer columns; a spline that closes; another degree."""
    near = [sm.Tolerance(linear=0.1), sm.SpeedBound(POINTS, 9.0)]
    yield sm.affine_program(KEYS, objective=BOTH, constraints=near)
    yield sm.affine_program(KEYS, objective=BOTH, degree=4, refine=2)
    yield sm.affine_program(KEYS, objective=BOTH, refine=0)


def everything(program, kernels, threads=1):
    """All that is evaluated at a point, where the matrices are those of every system that there is."""
    rng = np.random.default_rng(0)
    x, d = (program.x0 + 0.1 * rng.normal(size=program.unknowns) for _ in range(2))
    multipliers = rng.normal(size=program.conditions)
    bounded = Bounded(program, kernels, threads)
    whole, system = Evaluator(program, kernels, threads), Condensed.of(bounded.framed)
    found = [np.array([whole.objective(x), whole.rounding(x)]), whole.gradient(x), whole.line(x, d)]
    found += [whole.values(x), whole.along(x, d), whole.pull(x, multipliers), whole.jacobian(x).data]
    pattern = HessianTriangle.of(program).pattern
    found += [*whole.second_order(x, pattern, multipliers, theta=0.3, factor=0.7)]
    if system is not None:
        count = bounded.bounds.conditions
        y = np.zeros(bounded.equal.conditions)
        slopes, matrix = bounded.second_order(x, system.pattern, y, 0.3)
        weights = rng.normal(size=count), rng.uniform(size=count)
        found += [slopes, bounded.stiffen(matrix.copy(), x, system.pattern, *weights, 0.4), matrix]
    functions = [f for e in (*whole.terms, *whole.constraints) for f, _ in e._functions.values()]
    return found, functions


@needs_compiler
@pytest.mark.parametrize("program", list(programs()), ids=["bounds", "degree 4", "no knots"])
def test_passes_have_the_interpreters_bits(program):
    (found, functions), (wanted, _) = everything(program, "compiled"), everything(program, "interpreted")
    assert all(f.compiled for f in functions) and sum(f.elements is not None for f in functions) > 4
    assert len(found) == len(wanted)
    for one, other in zip(found, wanted, strict=True):
        assert one.tobytes() == other.tobytes()


@needs_compiler
def test_passes_of_several_threads_have_the_bits_of_one(monkeypatch):
    times = np.arange(30.0)
    keys = sm.Keyframes(
        times, [sm.examples.rotation_2d(30 * t) for t in times], np.stack([times, np.sin(times)], axis=1)
    )
    program = sm.affine_program(keys, objective=BOTH, constraints=[sm.SpeedBound(POINTS, 9.0)])
    wanted, _ = everything(program, "compiled")
    monkeypatch.setattr(mapped, "CHUNK", 1)
    monkeypatch.setattr(mapped, "THREADS_FROM", 1)
    for threads in (2, 3):
        found, functions = everything(program, "compiled", threads)
        assert {f.threads for f in functions} == {threads}
        for one, other in zip(found, wanted, strict=True):
            assert one.tobytes() == other.tobytes()


@needs_compiler
def test_arrays_that_a_pass_would_read_beyond_are_refused():
    program = next(programs())
    evaluator = Evaluator(program, "compiled", 1).constraints[1]
    controls = program.arrays(program.x0)[evaluator.block.variable]
    with pytest.raises(ValueError, match="mu of 1 numbers"):
        evaluator.gradient(controls, np.ones((1, 1)))
    with pytest.raises(ValueError, match="x of"):
        evaluator.out(controls[1:])


def test_lists_by_numpy_have_the_interpreters_bits(monkeypatch, tmp_path):
    monkeypatch.setattr(mapped, "ARRAYS_FROM", 0)
    monkeypatch.setattr(mapped, "load", lambda *_, **__: None)
    program = next(programs())
    (found, functions), (wanted, _) = everything(program, "auto"), everything(program, "interpreted")
    assert functions and not any(f.compiled for f in functions)
    for one, other in zip(found, wanted, strict=True):
        assert one.tobytes() == other.tobytes()
    kernel = program.terms[0].kernel
    assert isinstance(mapped.kernel_function(kernel, "value", 1, "auto"), ArrayFunction)
    assert mapped.kernel_function(kernel, "value", 1, "interpreted") is kernel.function("value")


def test_columns_that_are_no_neighbours_are_sorted():
    """The tables of every other control: the same numbers where there is nothing between."""
    block = sm.affine_program(KEYS).terms[0]
    operator = block.operator
    n = operator.shape[1]
    apart = operator.copy()
    apart.indices = (10 * apart.indices).astype(apart.indices.dtype)
    wide = type(operator)((apart.data, apart.indices, apart.indptr), shape=(operator.shape[0], 10 * n))
    near, far = block.tables(operator), block.tables(wide)
    assert np.array_equal(10 * near.columns, far.columns) and np.array_equal(10 * near.blocks, far.blocks)
    assert np.array_equal(near.coefficients, far.coefficients) and np.array_equal(near.places, far.places)
    dense = np.zeros((block.elements, block.nodes * block.kernel.rows, n))
    for e, columns in enumerate(near.columns):
        for k, column in enumerate(columns):
            dense[e, :, column] += near.coefficients[e, ..., k].ravel()
    np.testing.assert_array_equal(dense.reshape(-1, n), operator.toarray())


def test_places_that_do_not_follow_each_other_are_kept():
    starts, own = np.array([[0, 4], [8, 12]]), np.array([True, False])
    targets = Targets(16, own, starts)
    assert targets.places.tolist() == [[[0, 1], [16, 5]], [[8, 9], [12, 13]]]
    across = Targets(16, own, starts, mirrored=True)
    assert across.places.tolist() == [[[0, 4], [16, 5]], [[8, 12], [9, 13]]]
    again = Targets.of(across.places, own, 16)
    assert again.mirrored and again.starts is not None and np.array_equal(again.starts, starts)
    odd = Targets.of(targets.places, own, 16)
    assert odd.starts is None and np.array_equal(odd.places, targets.places)
    assert odd.wanted[1].tolist() == [0, 1, 5, 8, 9, 12, 13]
