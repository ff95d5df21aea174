"""A short text that tells programs apart: the same for equal questions to equal solvers, in every process."""

from collections.abc import Iterator
from hashlib import blake2b
from typing import Any

import numpy as np

from symmotion.program import Block, Program
from symmotion.solvers.result import start_vector
from symmotion.solvers.sqp import multipliers_of


def fingerprint(program: Program, solver: Any, start: Any = None) -> str:
    """32 hexadecimal digits of all that decides a solver's answer: kernels, tables, data, bounds, start, options."""
    digest = blake2b(digest_size=16)
    for part in _parts(program, solver, start):
        if isinstance(part, str):
            digest.update(f"s{len(part)}:{part}".encode())
        else:
            # Indices are of 32 or 64 bits, as the platform and the way of making them decide.
            part = np.ascontiguousarray(part, dtype=np.int64 if np.issubdtype(part.dtype, np.integer) else np.float64)
            digest.update(f"{part.dtype.kind}{part.shape}:".encode())
            digest.update(part.tobytes())
    return digest.hexdigest()


def _parts(program: Program, solver: Any, start: Any) -> Iterator[str | np.ndarray]:
    yield repr(solver)
    for name, value in program.start.items():
        yield name
        yield value
    for block in program.terms:
        yield from _of_block(block)
    for constraint in program.constraints:
        yield from _of_block(constraint.block)
        yield constraint.lower
        yield constraint.upper
    if start is not None:
        yield start_vector(program, start)
        multipliers = multipliers_of(start, program)
        if multipliers is not None:
            yield multipliers


def _of_block(block: Block) -> Iterator[str | np.ndarray]:
    yield f"{block.name}, {block.variable}, {block.channels}, {block.nodes}"
    yield f"{block.kernel.code}, {block.kernel.channels}, {block.kernel.squares}"
    operator = block.operator
    yield from (np.array(operator.shape), operator.indptr, operator.indices, operator.data, block.weights, block.data)
