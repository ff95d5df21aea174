"""Solvers in several threads at once, on the same program and on others; memory over many solves."""

import platform
import sys
from concurrent.futures import ThreadPoolExecutor
from threading import Barrier

import batches
import numpy as np
import pytest

import symmotion as sm
from symmotion.program import Evaluator
from symmotion.systems import Saddle

# Bytes that may stay behind from each solve: a solution takes 70,000.
LEAK = 2000
SOLVERS = (
    sm.ExactNewton(),
    sm.ExactNewton(system="sparse"),
    sm.Ipopt(),
    sm.Elimination(),
    sm.solvers.PlainIpopt(),
)


def cases(count: int = 15):
    """Programs, made when called for, and solvers: a program that all share, its own ones, curved conditions."""
    shared = sm.affine_program(batches.keyframes(0))
    flat = sm.affine_program(sm.examples.planar_keyframes(), objective=sm.Rigidity(2))
    quaternions = sm.examples.random_keyframes(4, 60, seed=2).rotations().as_quat()[:, [3, 0, 1, 2]]
    turning = sm.orientation_program(np.arange(4.0), quaternions, refine=0)

    def own(k: int) -> sm.program.Program:
        # A kernel that nobody has derived before: symbols are made and differentiated in every thread.
        fresh = sm.JetEnergy(lambda jet: jet.ddv * (1 + k / 100), squares=True)
        return sm.affine_program(
            batches.keyframes(k), objective=sm.Rigidity() + fresh, constraints=[sm.constraints.OnLine(2, [0, 0, 1])]
        )

    for k in range(count):
        solver = SOLVERS[k % 5]
        if k % 5 == 4:
            yield (lambda: flat), solver
        elif k % 3 == 0:
            yield (lambda: shared), solver
        elif solver == SOLVERS[0]:
            yield (lambda: turning), solver
        else:
            yield (lambda k=k: own(k) if SOLVERS[k % 5] in SOLVERS[:3] else flat), solver


def solved(case) -> list:
    program, solver = case
    return batches.numbers([solver.solve(program())])


def test_mixed_solves_in_four_threads_are_those_of_one():
    wanted = [solved(case) for case in cases()]
    barrier = Barrier(4)

    def run(fresh):
        barrier.wait()
        return [solved(case) for case in fresh]

    # Twice the same programs in all four threads, from which nothing was derived before.
    once = list(cases())
    with ThreadPoolExecutor(4) as threads:
        results = list(threads.map(run, [once, once, list(reversed(once)), list(cases())]))
    assert results[0] == wanted and results[1] == wanted and results[3] == wanted
    assert list(reversed(results[2])) == wanted


def test_a_singular_matrix_in_one_thread_is_not_another_ones(capfd):
    program = sm.affine_program(batches.keyframes(0))
    evaluator = Evaluator(program)
    jacobian = evaluator.jacobian(program.x0)
    size = Saddle(program, jacobian).pattern.size

    def factorise(singular: bool) -> list[bool]:
        saddle = Saddle(program, jacobian)
        values = np.zeros(size)
        values[saddle.diagonal] = 0.0 if singular else 1.0
        return [saddle.factorise(values) is None for _ in range(300)]

    interval = sys.getswitchinterval()
    sys.setswitchinterval(1e-6)
    try:
        with ThreadPoolExecutor(4) as threads:
            results = list(threads.map(factorise, [True, False, True, False]))
    finally:
        sys.setswitchinterval(interval)
    assert [set(r) for r in results] == [{True}, {False}, {True}, {False}]
    assert not capfd.readouterr().err


@pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="asks glibc what is allocated")
@pytest.mark.parametrize(("kind", "count"), [("threads", 20), ("fresh", 10), ("ipopt", 8), ("kept", 5)])
def test_memory_does_not_grow(kind, count):
    growth = batches.growth(kind, count)
    assert growth > LEAK if kind == "kept" else growth < LEAK
