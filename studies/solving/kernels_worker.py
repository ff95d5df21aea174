"""What kernels take: at a node, and before the first iteration of a solve in a process of its own."""

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from statistics import median
from time import perf_counter

import numpy as np

import symmotion as sm
from symmotion.kernels import ArrayFunction, Kernels, Mapped
from symmotion.program import Evaluator

OBJECTIVES = (sm.Rigidity(), sm.Rigidity(2), sm.TrajectoryEnergy(np.eye(3)), sm.StrainRate())
WAYS: tuple[Kernels, Kernels] = "interpreted", "compiled"
LONGEST = sm.StrainAcceleration()  # the long form only: its compiler run takes seconds


def in_new_process(directory: str, objectives: int, nodes: bool) -> list[list[float]]:
    """What `measured` tells of each objective in a new process with its own cache: one opens a kernel only once."""
    environment = os.environ | {"SYMMOTION_CACHE": directory}
    code = f"from studies.solving.kernels_worker import measured; print(*measured({objectives}, {nodes}))"
    root = Path(__file__).parents[2]
    done = subprocess.run(
        [sys.executable, "-c", code], env=environment, cwd=root, capture_output=True, text=True, check=True
    )
    numbers = [float(word) for word in done.stdout.split()]
    each = len(numbers) // objectives
    return [numbers[k * each : (k + 1) * each] for k in range(objectives)]


def measured(count: int, nodes: bool) -> list[float]:
    """For each of the first objectives the seconds that differentiating, compiling and loading its functions take.

    nodes: whether the instructions of its Hessian kernel, and its seconds at a node, interpreted by CasADi, carried out
    by NumPy and compiled, follow.
    """
    found = []
    for objective in (*OBJECTIVES, LONGEST)[:count]:
        program = sm.affine_program(sm.examples.random_keyframes(20, 40, seed=0), objective=objective)
        found.append(sm.ExactNewton(kernels="compiled").solve(program).seconds.compile or 0.0)
        if nodes:
            longer = sm.affine_program(sm.examples.random_keyframes(100, 40, seed=0), objective=objective)
            found.append(float(program.terms[0].kernel.function("hessian").n_instructions()))
            plain, compiled = (Evaluator(longer, k, threads=1).terms[0] for k in WAYS)
            block, listed = plain.block, ArrayFunction.of(plain.block.kernel.function("hessian"))
            assert listed is not None
            ways = plain.prepare("hessian"), Mapped(listed, block.count, block.nodes), compiled.prepare("hessian")
            found += [_node_seconds(longer, mapped) for mapped in ways]
    return found


def _node_seconds(program: sm.program.Program, mapped: Mapped) -> float:
    block = program.terms[0]
    z, share = block.rows(program.start[block.variable]), np.ones((block.count, 1))
    return median_seconds(lambda: mapped.each(lambda *_: None, z, block.data, None, share)) / block.count


def median_seconds(call: Callable[[], object]) -> float:
    """The median of several times, after one that does not count."""
    call()
    times = []
    while len(times) < 3 or sum(times) < 0.05:
        began = perf_counter()
        call()
        times.append(perf_counter() - began)
    return median(times)
