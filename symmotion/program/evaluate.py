"""Numbers for programs: objective, gradient, constraints, Jacobian and Hessian, the same for every solver."""

from collections import Counter
from dataclasses import dataclass
from functools import cached_property
from time import perf_counter
from typing import get_args

import numpy as np
from scipy import sparse

from symmotion.brief import in_a_line
from symmotion.errors import InputError
from symmotion.kernels.mapped import Kernels, default_threads
from symmotion.program.local import LocalTables, Targets
from symmotion.program.nodes import BlockEvaluator
from symmotion.program.program import Program, require_program


@dataclass(frozen=True, eq=False)
class Pattern:
    """Where the blocks of the Hessian go in a flat array of numbers.

    tables, targets: per block of the program (terms, then curved constraints) its local tables, and where the blocks of
    its Hessian go.

    >>> from symmotion.program import Evaluator
    >>> program = sm.affine_program(sm.examples.planar_keyframes())
    >>> system = sm.systems.system_of(program, Evaluator(program), program.x0)
    >>> Evaluator(program).second_order(program.x0, system.pattern)[1].shape == (system.pattern.size,)
    True
    """

    tables: tuple[LocalTables, ...]
    targets: tuple[Targets, ...]
    size: int

    __repr__ = in_a_line


class Evaluator:
    """A program's functions at points x (unknowns,), with working memory. One per thread.

    kernels: see `kernel_function`; threads: that a long program may use, see `default_threads`;
    seconds: spent in it so far; counts: how often what was evaluated.

    Raises InputError for kernels and threads that there are not.

    >>> from symmotion.program import Evaluator
    >>> program = sm.affine_program(sm.examples.planar_keyframes())
    >>> Evaluator(program).gradient(program.x0).shape
    (36,)
    """

    def __init__(self, program: Program, kernels: Kernels = "auto", threads: int | None = None):
        self.program = require_program(program)
        self.kernels: Kernels = kernels
        if kernels not in get_args(Kernels):
            raise InputError(f"kernels {kernels!r}: there are {', '.join(get_args(Kernels))}")
        if threads is not None and not (isinstance(threads, int) and threads > 0):
            raise InputError(f"threads {threads!r}: a positive number is needed")
        self.threads = threads or default_threads()
        self.terms = [BlockEvaluator(b, kernels, self.threads) for b in program.terms]
        self.constraints = [BlockEvaluator(c.block, kernels, self.threads) for c in program.constraints]
        self.seconds, self.counts = 0.0, Counter[str]()
        # Of a quadratic program the Hessian, with the pattern and the factor that it was made for.
        self._kept: tuple[Pattern, float, np.ndarray] | None = None

    def __repr__(self) -> str:
        return f"Evaluator({self.program.unknowns} unknowns, {self.program.conditions} conditions)"

    @cached_property
    def quadratic(self) -> bool:
        """Whether the Hessian is the same everywhere: squares of what is linear, under linear constraints."""
        return self.program.linear and all(b.kernel.constant for b in self.program.terms)

    def prepare(self, *kinds: str) -> None:
        """Derive the terms' functions of these kinds now instead of at their first use."""
        for e in self.terms:
            for kind in kinds:
                e.prepare(kind)

    def _read(self, evaluators: list[BlockEvaluator], x: np.ndarray) -> list[tuple[BlockEvaluator, np.ndarray]]:
        """Blocks, each with the controls that it reads."""
        arrays = self.program.arrays(x)
        return [(e, arrays[e.block.variable]) for e in evaluators]

    def terms_at(self, x: np.ndarray) -> dict[str, float]:
        """The value of each term, its factor included."""
        values: dict[str, float] = {}
        for e, controls in self._read(self.terms, x):
            values[e.block.name] = e.value(controls)
        return values

    def objective(self, x: np.ndarray) -> float:
        """The objective's value at x (unknowns,)."""
        self.counts["objective"] += 1
        began = perf_counter()
        value = sum(e.value(controls) for e, controls in self._read(self.terms, x))
        self.seconds += perf_counter() - began
        return float(value)

    def rounding(self, x: np.ndarray) -> float:
        """What of the objective is rounding, see `BlockEvaluator.rounding`: no decrease below it can be told."""
        arrays = self.program.arrays(np.abs(x))
        sizes = [e.block.sizes(arrays[e.block.variable]) for e in self.terms]
        pairs = zip(self._read(self.terms, x), sizes, strict=True)
        return sum((e.rounding(controls, size) for (e, controls), size in pairs), 0.0)

    def gradient(self, x: np.ndarray) -> np.ndarray:
        """(unknowns,) ∇f."""
        self.counts["gradient"] += 1
        began = perf_counter()
        total = np.zeros_like(x)
        arrays = self.program.arrays(total)
        for e, controls in self._read(self.terms, x):
            arrays[e.block.variable][:, e.block.channels] += e.gradient(controls)
        self.seconds += perf_counter() - began
        return total

    def violation(self, x: np.ndarray) -> np.ndarray:
        """(conditions,) how far g lies outside its bounds, with sign: g itself for equalities to zero."""
        g = self.values(x)
        return np.maximum(g - self.program.upper, 0) - np.maximum(self.program.lower - g, 0)

    def values(self, x: np.ndarray) -> np.ndarray:
        """(conditions,) g."""
        self.counts["conditions"] += 1
        parts = [e.out(controls).ravel() for e, controls in self._read(self.constraints, x)]
        return np.concatenate(parts) if parts else np.empty(0)

    def jacobian(self, x: np.ndarray) -> sparse.csr_array:
        """(conditions, unknowns) ∂g/∂x; made once where all constraints are linear."""
        structure = self.program.structure
        if "jacobian" in structure:
            return structure["jacobian"]
        self.counts["jacobian"] += 1
        began = perf_counter()
        counts, columns, values = [np.zeros(1, dtype=np.int64)], [np.empty(0, dtype=np.int64)], [np.empty(0)]
        for e, controls in self._read(self.constraints, x):
            block, v = e.block, e.jacobian(controls)
            first, stride = self.program.place(block.variable)
            channel = first + np.arange(stride)[block.channels]
            place = block.local.columns[..., None] * stride + channel
            # Where the conditions are linear, what is zero stays zero.
            kept = v != 0 if self.program.linear else np.ones(v.shape, dtype=bool)
            counts.append(kept.reshape(v.shape[0] * v.shape[1], -1).sum(axis=1))
            columns.append(np.broadcast_to(place[:, None], v.shape)[kept])
            values.append(v[kept])
        data, indices, pointers = (np.concatenate(part) for part in (values, columns, counts))
        shape = (self.program.conditions, self.program.unknowns)
        result = sparse.csr_array((data, indices, np.cumsum(pointers)), shape=shape)
        result.sum_duplicates()
        if self.program.linear:
            structure["jacobian"] = result
        self.seconds += perf_counter() - began
        return result

    def second_order(
        self,
        x: np.ndarray,
        pattern: Pattern,
        multipliers: np.ndarray | None = None,
        *,
        theta: float = 1.0,
        factor: float = 1.0,
    ) -> tuple[np.ndarray, np.ndarray]:
        """∇f (unknowns,) and the Hessian of factor · f + λᵀg (pattern.size,) in the order of the pattern.

        Of terms that are sums of squares, the Hessian's Gauss–Newton part plus theta times the rest. That of a
        quadratic program is made once.
        """
        if self._kept is not None and self._kept[0] is pattern and self._kept[1] == factor:
            return self.gradient(x), self._kept[2].copy()
        self.counts["hessian"] += 1
        began = perf_counter()
        flat, slopes = np.zeros(pattern.size), np.zeros_like(x)
        arrays = self.program.arrays(slopes)
        curved = [e for e in self.constraints if not e.block.kernel.linear]
        parts = self.program.split(multipliers) if multipliers is not None else {}
        for k, (e, controls) in enumerate(self._read(self.terms + curved, x)):
            where = pattern.tables[k], pattern.targets[k], flat
            if k < len(self.terms):
                gradient = e.second_order(controls, *where, theta, factor=factor)
                arrays[e.block.variable][:, e.block.channels] += gradient
            else:
                e.second_order(controls, *where, 1.0, parts.get(e.block.name))
        self.seconds += perf_counter() - began
        if self.quadratic:
            self._kept = pattern, factor, flat.copy()
        return slopes, flat

    def stiffen(
        self,
        matrix: np.ndarray,
        x: np.ndarray,
        pattern: Pattern,
        multipliers: np.ndarray,
        stiffness: np.ndarray,
        theta: float = 1.0,
    ) -> np.ndarray:
        """A matrix (pattern.size,) with theta · ∇²(λᵀg) + Jᵀ diag(σ) J added in place, in a pattern of the constraints.

        Where constraints read little of a wide band, a matrix of zeros beside it would cost more than what is added.
        """
        self.counts["hessian"] += 1
        began = perf_counter()
        weights = self.program.split(multipliers), self.program.split(stiffness)
        read = self._read(self.constraints, x)
        for (e, controls), table, target in zip(read, pattern.tables, pattern.targets, strict=True):
            mu, sigma = (part[e.block.name] for part in weights)
            e.second_order(controls, table, target, matrix, theta, mu, sigma)
        self.seconds += perf_counter() - began
        return matrix

    def along(self, x: np.ndarray, direction: np.ndarray) -> np.ndarray:
        """(conditions,) J d, the derivative of g along a direction (unknowns,); J is not formed."""
        self.counts["slope"] += 1
        began = perf_counter()
        pairs = zip(self._read(self.constraints, x), self._read(self.constraints, direction), strict=True)
        parts = [e.along(controls, change).ravel() for (e, controls), (_, change) in pairs]
        self.seconds += perf_counter() - began
        return np.concatenate([*parts, np.empty(0)])

    def pull(self, x: np.ndarray, multipliers: np.ndarray) -> np.ndarray:
        """(unknowns,) Jᵀλ, the gradient of λᵀg; J is not formed."""
        self.counts["slope"] += 1
        began = perf_counter()
        total = np.zeros_like(x)
        arrays, parts = self.program.arrays(total), self.program.split(multipliers)
        for e, controls in self._read(self.constraints, x):
            arrays[e.block.variable][:, e.block.channels] += e.gradient(controls, parts[e.block.name])
        self.seconds += perf_counter() - began
        return total

    def line(self, x: np.ndarray, direction: np.ndarray) -> np.ndarray | None:
        """(5,) coefficients of the quartic f(x + α direction), or None where some term is no such polynomial."""
        self.counts["line"] += 1
        if not all(e.block.kernel.quartic for e in self.terms):
            return None
        began = perf_counter()
        pairs = zip(self._read(self.terms, x), self._read(self.terms, direction), strict=True)
        total = sum((e.line(controls, change) for (e, controls), (_, change) in pairs), np.zeros(5))
        self.seconds += perf_counter() - began
        return total
