"""A short text that tells programs apart: the same for equal questions to equal solvers, in every process."""

from collections.abc import Iterable, Iterator
from hashlib import blake2b

import numpy as np

from symmotion.program import Block, Program
from symmotion.solvers.solver import Solver, start_multipliers, start_vector


def fingerprint(program: Program, solver: Solver, start: object = None) -> str:
    """32 hexadecimal digits of all that decides a solver's answer: kernels, tables, data, bounds, start, options."""
    return _digest(_parts(program, solver, start))


def structure_fingerprint(program: Program) -> str:
    """32 hexadecimal digits of what `Program.structure` is derived from: kernels and tables, not the data."""
    blocks = [*program.terms, *(c.block for c in program.constraints)]
    parts = [part for block in blocks for part in _of_block(block)]
    shapes = [f"{name} {value.shape}" for name, value in program.start.items()]
    bounds = [str(c.is_equality) for c in program.constraints]
    return _digest([str(len(program.terms)), *shapes, *bounds, *parts])


def _digest(parts: Iterable[str | np.ndarray]) -> str:
    digest = blake2b(digest_size=16)
    for part in parts:
        if isinstance(part, str):
            digest.update(f"s{len(part)}:{part}".encode())
        else:
            # Indices are of 32 or 64 bits, as the platform and the way of making them decide.
            part = np.ascontiguousarray(part, dtype=np.int64 if np.issubdtype(part.dtype, np.integer) else np.float64)
            digest.update(f"{part.dtype.kind}{part.shape}:".encode())
            digest.update(part.tobytes())
    return digest.hexdigest()


def _parts(program: Program, solver: Solver, start: object) -> Iterator[str | np.ndarray]:
    yield repr(solver)
    for name, value in program.start.items():
        yield name
        yield value
    for block in program.terms:
        yield from _of_block(block)
        yield block.data
    for constraint in program.constraints:
        yield from _of_block(constraint.block)
        yield constraint.block.data
        yield constraint.lower
        yield constraint.upper
    if start is not None:
        yield start_vector(program, start)
        multipliers = start_multipliers(program, start)
        if multipliers is not None:
            yield multipliers


def _of_block(block: Block) -> Iterator[str | np.ndarray]:
    yield f"{block.name}, {block.variable}, {block.channels}, {block.nodes}"
    yield f"{block.kernel.code}, {block.kernel.channels}, {block.kernel.squares}"
    operator = block.operator
    yield from (np.array(operator.shape), operator.indptr, operator.indices, operator.data, block.weights)
