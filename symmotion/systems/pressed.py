"""What a certificate sees along equalities that decouple and bounds that press, on the band of the equalities."""

import numpy as np
from scipy import sparse

from symmotion.program.bounded import Bounded
from symmotion.systems.condensed import Condensed
from symmotion.systems.curvature import banded_curvature
from symmotion.systems.system import gram_factor, largest, own_size, reach

# Weights of the bounds' normals beside a Hessian of order one, in turn.
WEIGHTS = (1e4, 1e2, 1e6, 1e8)
# Iterations of the bounds' multipliers on one factor, and the change of the bounds, beside the step's, that is none.
REFINED, STILL = 12, 1e-10


class Pressed:
    """The condensed system of a program's equalities, with bounds that press held beside them at a point x.

    The normals of bounds weigh in the Hessian, which keeps the band and is positive definite for some weight where the
    Hessian is along the bounds (Finsler), and their multipliers are iterated on its factor (Hestenes 1969,
    Powell 1969). jacobian: (conditions, unknowns) the program's, there; rows: of the conditions that press.
    """

    def __init__(
        self, bounded: Bounded, system: Condensed, x: np.ndarray, jacobian: sparse.csr_array, rows: np.ndarray
    ):
        self._bounded, self._system, self._x = bounded, system, x
        self._equal, bounds = bounded.places
        held = np.isin(bounds, rows)
        self._held, normals = bounds[held], jacobian[bounds[held]]
        unit = bounded.program.unit
        self._scale = reach(normals, unit)
        self._normals = sparse.csr_array(normals.multiply(1 / self._scale[:, None]))
        self._stiffness = np.zeros(len(bounds))
        self._stiffness[held] = self._scale**-2.0
        self.diagonal, self.on_diagonal = system.diagonal, system.on_diagonal

    def second_order(self, multipliers: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """∇f (unknowns,) and the reduced Hessian of f + λᵀg; λ: (conditions,)."""
        bounded, (equal, bounds) = self._bounded, self._bounded.places
        gradient, hessian = bounded.second_order(self._x, self._system.pattern, multipliers[equal])
        none = np.zeros(len(bounds))
        return gradient, bounded.stiffen(hessian, self._x, self._system.pattern, multipliers[bounds], none)

    def decrement(self, hessian: np.ndarray, residual: np.ndarray) -> float | None:
        """½ rᵀM⁻¹r along the conditions where the Hessian is positive definite there; None where that is not seen."""
        system, unit = self._system, self._bounded.program.unit
        size = own_size(system, hessian, unit) or 1.0
        for weight in WEIGHTS:
            stiffness = weight * size * self._stiffness
            matrix = self._bounded.stiffen(hessian.copy(), self._x, system.pattern, 0.0 * stiffness, stiffness)
            if banded_curvature(system.lower_bands(matrix)).inertia == "positive":
                break
        else:
            return None
        factor = system.factorise(matrix)
        if factor is None:
            return None
        forces = np.zeros(len(self._held))
        for _ in range(REFINED):
            step = system.step(factor, residual + self._normals.T @ forces)
            change = self._normals @ step
            forces += weight * size * change
            if largest(change) <= STILL * largest(step / unit):
                return max(0.0, -0.5 * float(residual @ step))
        return None

    def multipliers(self, gradient: np.ndarray) -> np.ndarray:
        """(conditions,) λ with ∇f + Jᵀλ small, of the equalities and the bounds that press; zero of the others."""
        system, normals, found = self._system, self._normals, np.zeros(self._bounded.program.conditions)
        if len(self._held):
            unit = system.on_diagonal(self._bounded.program.unit)
            own = sparse.csr_array(sparse.csr_array(system.whole_basis().T @ normals.T).multiply(unit[:, None]))
            forces = -gram_factor(sparse.csr_array(own.T)).solve(own.T @ (unit * system.reduced(gradient)))
            found[self._held] = forces / self._scale
            gradient = gradient + normals.T @ forces
        found[self._equal] = system.multipliers(gradient)
        return found
