"""What Newton's saddle system of a program offers, however it is stored and solved."""

from collections.abc import Callable, Iterator
from math import inf
from typing import Any, Protocol, TypeAlias, TypeVar

import numpy as np
from scipy import sparse
from scipy.sparse.csgraph import reverse_cuthill_mckee
from scipy.sparse.linalg import SuperLU, splu

from symmotion import interrupts
from symmotion.program.evaluate import Pattern
from symmotion.systems.curvature import Curvature

# The factorised matrix, of which only its own system knows what it is.
Factor = TypeVar("Factor")


# Changes of a condition, relative to its bound, that are rounding.
STILL = 1e-9
# Conditions that are fewer than this in own units, of what the others leave, repeat them.
DEPENDENT = 1e-12  # of squares


class System(Protocol[Factor]):
    """Newton's saddle system [[H, Jᵀ], [J, 0]] (d, λ) = (−∇f, 0) of a program with linear conditions J x = c.

    H comes as a flat array in the order of `pattern`, from `Evaluator.second_order(x, system.pattern)`. A system holds
    working memory: one for each thread.

    >>> from symmotion.program import Evaluator
    >>> program = sm.affine_program(sm.examples.planar_keyframes())
    >>> system: sm.systems.System = sm.systems.system_of(program, Evaluator(program), program.x0)
    >>> system.reduced(Evaluator(program).gradient(program.x0)).shape
    (20,)
    """

    @property
    def pattern(self) -> Pattern:
        """Where the entries of H go in the flat array."""
        ...

    @property
    def diagonal(self) -> slice | np.ndarray:
        """Where the diagonal of H (unknowns,) lies in the flat array."""
        ...

    def on_diagonal(self, values: np.ndarray) -> np.ndarray:
        """Of values (unknowns,) those of the unknowns that the diagonal of H belongs to, in its order."""
        ...

    def feasible(self, x: np.ndarray, violation: np.ndarray) -> np.ndarray:
        """(unknowns,) x moved so that the conditions hold, which it misses by violation (conditions,)."""
        ...

    def reduced(self, gradient: np.ndarray) -> np.ndarray:
        """The part of a gradient (unknowns,) along the conditions: zero where it is stationary."""
        ...

    def multipliers(self, gradient: np.ndarray) -> np.ndarray:
        """(conditions,) λ with ∇f + Jᵀλ = 0 at stationary points; elsewhere an estimate, each system's own."""
        ...

    def factorise(self, flat: np.ndarray) -> Factor | None:
        """The factorised system; None where the inertia is wrong: H not positive definite along the conditions."""
        ...

    def step(self, factor: Factor, gradient: np.ndarray) -> np.ndarray:
        """(unknowns,) the Newton step d along the conditions."""
        ...

    def curvature(self, flat: np.ndarray) -> Curvature:
        """The curvature of H along the conditions, with a direction (unknowns,) where it is negative."""
        ...


# For whoever only hands a factor back to the system that made it. Any: known to that system only.
AnyFactor: TypeAlias = Any
AnySystem: TypeAlias = System[AnyFactor]  # condensed or saddle


def shifted(
    system: AnySystem,
    matrix: np.ndarray,
    unit: np.ndarray,
    shifts: Iterator[float],
    scale: float | None = None,
    factorise: Callable[[np.ndarray], AnyFactor] | None = None,
) -> tuple[AnyFactor, float]:
    """The factor of a matrix plus the first of growing multiples of the identity that make it positive definite.

    unit: (unknowns,) the units in which the identity is one, `Program.unit`. shifts: what is added to the matrix, in
    place and one after the other, times scale, which is the largest entry of the diagonal when left out; the last is
    returned beside the factor, which is None where they are used up. factorise: in place of the system's own.

    >>> from symmotion.program import Evaluator
    >>> program = sm.affine_program(sm.examples.planar_keyframes())
    >>> evaluator = Evaluator(program)
    >>> system = sm.systems.system_of(program, evaluator, program.x0)
    >>> matrix = evaluator.second_order(program.x0, system.pattern)[1]
    >>> factor, shift = sm.systems.shifted(system, matrix, program.unit, sm.systems.tenfold(1e-8))
    >>> shift >= 0
    True
    """
    identity, shift = system.on_diagonal(unit) ** -2.0, 0.0
    scale = largest(matrix[system.diagonal] / identity) or 1.0 if scale is None else scale
    for shift in shifts:
        interrupts.check()
        matrix[system.diagonal] += shift * scale * identity
        factor = (factorise or system.factorise)(matrix)
        if factor is not None:
            return factor, shift
    return None, shift


def solved(matrix: sparse.csc_array, right: np.ndarray) -> np.ndarray:
    """The solution of a sparse system of symmetric pattern, by a factorisation with pivots; RuntimeError if singular.

    matrix: (n, n); right: (n,). The order follows the motion, in which saddle systems are banded: half the entries and
    time of SuperLU's own.

    >>> from scipy import sparse
    >>> sm.systems.solved(sparse.csc_array([[2.0, 1.0], [1.0, 0.0]]), np.array([3.0, 1.0]))
    array([1., 1.])
    """
    pattern = sparse.csr_matrix(abs(matrix) + abs(matrix.T))
    order = reverse_cuthill_mckee(pattern, symmetric_mode=True)
    found = np.empty_like(right)
    found[order] = splu(sparse.csc_array(matrix[order][:, order]), permc_spec="NATURAL").solve(right[order])
    return found


def gram_factor(rows: sparse.csr_array) -> SuperLU:
    """The factor of A Aᵀ for rows (k, n) of order one, with next to nothing added where they depend on each other.

    What is solved for then are next to the smallest multipliers of all that serve.

    >>> from scipy import sparse
    >>> twice = sparse.csr_array([[1.0, 0.0], [1.0, 0.0]])
    >>> sm.systems.gram_factor(twice).solve(np.array([1.0, 1.0])).round(6)
    array([0.5, 0.5])
    """
    gram = sparse.csc_array(rows @ rows.T)
    try:
        return splu(gram)
    except RuntimeError:
        ridge = DEPENDENT * (float(abs(gram.diagonal()).max(initial=0.0)) or 1.0)
        return splu(sparse.csc_array(gram + ridge * sparse.eye_array(gram.shape[0])))


def tenfold(first: float, most: float = inf) -> Iterator[float]:
    """first, 10 first, 100 first, … while the sum of those before is `most` or less.

    >>> list(sm.systems.tenfold(1.0, most=10.0))
    [1.0, 10.0]
    """
    whole = 0.0
    while whole <= most:
        yield first
        whole += first
        first *= 10


def reach(
    jacobian: sparse.csr_array, unit: np.ndarray, bounds: tuple[np.ndarray, np.ndarray] | None = None
) -> np.ndarray:
    """(conditions,) by how much each condition changes where the unknowns move by their units; 1 where not at all.

    bounds: lower and upper ones, beside the larger of which a change that is rounding counts as none: that of squares
    at their zero. The bound itself is what counts then.

    jacobian: (conditions, unknowns); unit: (unknowns,), `Program.unit`.

    >>> from scipy import sparse
    >>> sm.systems.reach(sparse.csr_array([[1.0, -2.0], [0.0, 0.0]]), np.array([1.0, 10.0]))
    array([21.,  1.])
    """
    change = np.asarray(abs(jacobian) @ unit)
    if bounds is not None:
        sizes = np.max([np.abs(np.where(np.isfinite(b), b, 0.0)) for b in bounds], axis=0)
        change = np.where(change <= STILL * sizes, sizes, change)
    return np.where(np.isfinite(change) & (change > 0), change, 1.0)


class Diagonal(Protocol):
    """Of a `System` where its diagonal lies, and what belongs to it."""

    @property
    def diagonal(self) -> slice | np.ndarray: ...

    def on_diagonal(self, values: np.ndarray) -> np.ndarray: ...


def own_size(system: Diagonal, flat: np.ndarray, unit: np.ndarray) -> float:
    """The largest diagonal entry of a matrix, in the order of a system's pattern, where the unknowns' units are one.

    unit: (unknowns,), `Program.unit`.

    flat: the matrix in the order of that pattern.

    >>> from symmotion.program import Evaluator
    >>> program = sm.affine_program(sm.examples.planar_keyframes())
    >>> system = sm.systems.system_of(program, Evaluator(program), program.x0)
    >>> sm.systems.own_size(system, np.ones(system.pattern.size), program.unit) > 0
    True
    """
    return largest(flat[system.diagonal] * system.on_diagonal(unit) ** 2)


def largest(values: np.ndarray) -> float:
    """‖values‖∞, 0 of none.

    >>> sm.systems.largest(np.array([1.0, -3.0])), sm.systems.largest(np.empty(0))
    (3.0, 0.0)
    """
    return float(np.abs(values).max(initial=0.0))
