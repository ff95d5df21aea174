"""What Newton's saddle system of a program offers, however it is stored and solved."""

from typing import Any, Protocol, TypeAlias, TypeVar

import numpy as np

from symmotion.program.evaluate import Pattern
from symmotion.systems.curvature import Curvature

# The factorised matrix, of which only its own system knows what it is.
Factor = TypeVar("Factor")


class System(Protocol[Factor]):
    """Newton's saddle system [[H, Jᵀ], [J, 0]] (d, λ) = (−∇f, 0) of a program with linear conditions J x = c.

    H comes as a flat array in the order of `pattern`, from `Evaluator.second_order(x, system.pattern)`. A system holds
    working memory: one for each thread.
    """

    @property
    def pattern(self) -> Pattern:
        """Where the entries of H go in the flat array."""
        ...

    @property
    def diagonal(self) -> slice | np.ndarray:
        """Where the diagonal of H lies in the flat array."""
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
AnySystem: TypeAlias = System[AnyFactor]
