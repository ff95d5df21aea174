"""Programs with inequalities, taken apart: the equalities, and bounds whose normals weigh in the Hessian."""

from collections import Counter
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from scipy import sparse

from symmotion.kernels import Kernel, Kernels
from symmotion.program.evaluate import Evaluator, Pattern
from symmotion.program.program import Constraint, Program, Structure, require_program


class Bounded:
    """A program as min f(x) subject to c_E(x) = 0 and lower ≤ c(x) ≤ upper, with working memory. One per thread.

    equal: the program with its equalities alone; bounds: with its bounds alone, and no terms; framed: with the bounds
    among the terms, whose systems have room for ∇²L + Jᵀ diag(σ) J, J = ∂c/∂x. evaluator, sides: of the first two.
    lower, upper: (bounds,), at least one of the two finite: what is not bounded is left out. places: which of the
    program's conditions the equalities are, and which the bounds.

    kernels, threads: as ExactNewton's.

    Raises InputError for what is no program, and kernels and threads that are none.

    >>> from symmotion.program import Bounded
    >>> keys = sm.examples.planar_keyframes()
    >>> near = sm.Tolerance(linear=0.1)
    >>> len(Bounded(sm.affine_program(keys, constraints=[near])).lower) > 0
    True
    """

    def __init__(self, program: Program, kernels: Kernels = "auto", threads: int | None = None):
        self.program = require_program(program)
        equal, bounds, self.places = _taken_apart(program)
        made = program.structure.setdefault(("bounded", self.places[1].tobytes()), [Structure() for _ in range(3)])
        self.equal = replace(program, constraints=equal, structure=made[0])
        self.bounds = replace(program, terms=(), constraints=bounds, structure=made[1])
        terms = (*program.terms, *(c.block for c in bounds))
        self.framed = replace(program, terms=terms, constraints=equal, structure=made[2])
        self.evaluator = Evaluator(self.equal, kernels, threads)
        self.sides = Evaluator(self.bounds, kernels, threads)
        self._parted: tuple[Pattern, tuple[Pattern, Pattern]] | None = None

    def __repr__(self) -> str:
        return f"Bounded({self.equal.conditions} equalities, {self.bounds.conditions} bounds)"

    @property
    def lower(self) -> np.ndarray:
        """(bounds,) the lower sides of what is bounded, −∞ where there is none."""
        return self.bounds.lower

    @property
    def upper(self) -> np.ndarray:
        """(bounds,) the upper sides of what is bounded, ∞ where there is none."""
        return self.bounds.upper

    @property
    def seconds(self) -> float:
        """Spent in the functions so far."""
        return self.evaluator.seconds + self.sides.seconds

    @property
    def counts(self) -> Counter[str]:
        """How often what was evaluated: of the objective and the equalities, and of the bounds."""
        return self.evaluator.counts + Counter({f"bounds: {kind}": n for kind, n in self.sides.counts.items()})

    def second_order(
        self, x: np.ndarray, pattern: Pattern, equalities: np.ndarray, theta: float = 1.0
    ) -> tuple[np.ndarray, np.ndarray]:
        """∇f (unknowns,) and the Hessian of f + yᵀc_E in the order of the pattern of `framed`.

        theta: the share of what is not Gauss and Newton's.
        """
        return self.evaluator.second_order(x, self._parts(pattern)[0], theta * equalities, theta=theta)

    def stiffen(
        self,
        matrix: np.ndarray,
        x: np.ndarray,
        pattern: Pattern,
        multipliers: np.ndarray,
        stiffness: np.ndarray,
        theta: float = 1.0,
    ) -> np.ndarray:
        """Add θ ∇²(λᵀc) + Jᵀ diag(σ) J of the bounds to a matrix in the pattern of `framed`; λ, σ: (bounds,)."""
        return self.sides.stiffen(matrix, x, self._parts(pattern)[1], multipliers, stiffness, theta)

    def _parts(self, pattern: Pattern) -> tuple[Pattern, Pattern]:
        """The pattern of the terms and the equalities, and that of the bounds; the same ones for the same pattern."""
        if self._parted is not None and self._parted[0] is pattern:
            return self._parted[1]
        a, b = len(self.equal.terms), len(self.framed.terms)

        def taken(part: slice, more: slice) -> Pattern:
            tables = pattern.tables[part] + pattern.tables[more]
            return Pattern(tables, pattern.targets[part] + pattern.targets[more], pattern.size)

        self._parted = pattern, (taken(slice(0, a), slice(b, None)), taken(slice(a, b), slice(0, 0)))
        return self._parted[1]

    def joined(self, equalities: np.ndarray, bounds: np.ndarray) -> np.ndarray:
        """(conditions,) the program's multipliers, from those of its equalities and of its bounds."""
        multipliers = np.zeros(self.program.conditions)
        multipliers[self.places[0]], multipliers[self.places[1]] = equalities, bounds
        return multipliers


def _taken_apart(
    program: Program,
) -> tuple[tuple[Constraint, ...], tuple[Constraint, ...], tuple[np.ndarray, np.ndarray]]:
    """The equalities and the bounds of a program, and the places of their components among its conditions."""
    parts: tuple[list[Constraint], list[Constraint]] = [], []
    places: tuple[list[np.ndarray], list[np.ndarray]] = [], []
    for c, numbers in zip(program.constraints, program.split(np.arange(program.conditions)).values(), strict=True):
        kinds = np.where(c.lower == c.upper, 0, np.where(np.isfinite(c.lower) | np.isfinite(c.upper), 1, 2))
        for kind in (0, 1):
            for piece, where in _pieces(c, kinds == kind, program):
                parts[kind].append(piece)
                places[kind].append(numbers[where].ravel())
    none = [np.empty(0, dtype=int)]
    return tuple(parts[0]), tuple(parts[1]), (np.concatenate(places[0] + none), np.concatenate(places[1] + none))


def _pieces(
    c: Constraint, wanted: np.ndarray, program: Program
) -> Iterator[tuple[Constraint, tuple[np.ndarray | slice, ...]]]:
    """Constraints of the components (E, C) that are wanted, each with the places of its own there."""
    if wanted.all():
        yield c, (slice(None), slice(None))
        return
    # Nodes of which the same components are wanted make one constraint.
    kinds, of = np.unique(wanted, axis=0, return_inverse=True)
    for k, components in enumerate(kinds):
        if not components.any():
            continue
        nodes, chosen = np.flatnonzero(of.ravel() == k), np.flatnonzero(components)
        block, rows = c.block, c.block.kernel.rows
        lines = (nodes[:, None] * rows + np.arange(rows)).ravel()
        key = "piece", c.name, chosen.tobytes()
        if key not in program.structure:
            kernel = block.kernel
            out = kernel.out[chosen.tolist()]
            program.structure[key] = (
                kernel if len(chosen) == kernel.out.numel() else Kernel(kernel.z, kernel.data, out, kernel.channels)
            )
        name = c.name if len(kinds) == 1 else f"{c.name} ({k})"
        piece = replace(
            block,
            name=name,
            kernel=program.structure[key],
            operator=sparse.csr_array(block.operator[lines]),
            weights=block.weights[nodes],
            data=block.data[nodes],
        )
        where = np.ix_(nodes, chosen)
        yield Constraint(piece, c.lower[where], c.upper[where]), where
