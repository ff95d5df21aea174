"""A program with bounds on a saddle system: the bounds in units of their own, eliminated into the matrix."""

import numpy as np

from symmotion.errors import InputError
from symmotion.program import Bounded
from symmotion.solvers.journal import Journal
from symmotion.systems import AnyFactor, AnySystem, Saddle, largest, own_size, reach, system_of


class Frame:
    """What interior point, active sets and the search for feasible points share.

    Bounds are scaled by what they change where the unknowns move by their units, at the point x of the start: values,
    limits `lower`, `upper` and multipliers are those of c / scale. Every step solves
    [[M + Jᵀ Σ J, J_Eᵀ], [J_E, 0]] (d, y⁺) = −(r, c_E), which keeps the band of the equalities' system, since the
    bounds of a node read the controls of its span only.

    system: "condensed", "sparse" or "auto", as ExactNewton's.
    """

    def __init__(self, bounded: Bounded, journal: Journal, x: np.ndarray, system: str = "auto"):
        self.bounded, self.evaluator, self.journal = bounded, bounded.evaluator, journal
        self.unit = bounded.program.unit
        self.curved = not bounded.equal.linear
        self.scale = reach(bounded.sides.jacobian(x), self.unit, (bounded.lower, bounded.upper))
        self.lower, self.upper = bounded.lower / self.scale, bounded.upper / self.scale
        self._first = self._system(x, system)

    def _system(self, x: np.ndarray, wanted: str) -> AnySystem:
        framed, evaluator = self.bounded.framed, self.evaluator
        if self.curved:
            if wanted == "condensed":
                raise InputError('the conditions of this program are nonlinear: use system="sparse"')
            return Saddle(framed, evaluator.jacobian(x))
        if wanted == "sparse":
            return Saddle.of(framed, lambda: evaluator.jacobian(x))
        system = system_of(framed, evaluator, x)
        if wanted == "condensed" and isinstance(system, Saddle):
            raise InputError('the conditions of this program do not decouple: use system="sparse"')
        return system

    def feasible(self, x: np.ndarray) -> np.ndarray:
        """x moved so that linear equalities hold."""
        return x if self.curved else self._first.feasible(x, self.evaluator.violation(x))

    def system(self, x: np.ndarray) -> AnySystem:
        """The saddle system at a point."""
        first = self._first
        return first.at(self.evaluator.jacobian(x)) if self.curved and isinstance(first, Saddle) else first

    def values(self, x: np.ndarray) -> np.ndarray:
        """(bounds,) c."""
        return self.bounded.sides.values(x) / self.scale

    def outside(self, values: np.ndarray) -> np.ndarray:
        """(bounds,) by how much values are above the upper limits, negative below the lower ones."""
        return np.maximum(values - self.upper, 0.0) - np.maximum(self.lower - values, 0.0)

    def missed(self, x: np.ndarray) -> float:
        """The largest violation of any condition, that of bounds in own units."""
        return max(largest(self.evaluator.violation(x)), largest(self.outside(self.values(x))))

    def along(self, x: np.ndarray, step: np.ndarray) -> np.ndarray:
        """(bounds,) J d."""
        return self.bounded.sides.along(x, step) / self.scale

    def pull(self, x: np.ndarray, multipliers: np.ndarray) -> np.ndarray:
        """(unknowns,) Jᵀλ."""
        return self.bounded.sides.pull(x, multipliers / self.scale)

    def second_order(
        self, system: AnySystem, x: np.ndarray, equalities: np.ndarray, theta: float = 1.0
    ) -> tuple[np.ndarray, np.ndarray]:
        """∇f and the Hessian of f + yᵀc_E, without the bounds."""
        return self.bounded.second_order(x, system.pattern, equalities, theta)

    def stiffen(
        self,
        matrix: np.ndarray,
        system: AnySystem,
        x: np.ndarray,
        multipliers: np.ndarray,
        stiffness: np.ndarray,
        theta: float = 1.0,
    ) -> np.ndarray:
        """That matrix with what the bounds add to it, in place: θ ∇²(λᵀc) + Jᵀ diag(σ) J."""
        scale = self.scale
        return self.bounded.stiffen(matrix, x, system.pattern, multipliers / scale, stiffness / scale**2, theta)

    def size(self, system: AnySystem, hessian: np.ndarray) -> float:
        """The largest diagonal entry of a matrix in the program's own units."""
        return own_size(system, hessian, self.unit)

    def factorise(self, system: AnySystem, matrix: np.ndarray) -> AnyFactor | None:
        return self.journal.timed(system.factorise, matrix)

    def step(
        self, system: AnySystem, factor: AnyFactor, residual: np.ndarray, violation: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray | None]:
        """The step d of a residual r (unknowns,), and the multipliers y⁺ beside it where they are solved for."""
        if not (self.curved and isinstance(system, Saddle)):
            return self.journal.timed(system.step, factor, residual), None
        solution = self.journal.timed(system.solve, factor, np.concatenate([-residual, -violation]))
        return solution[: system.n], solution[system.n :]

    def equalities(self, x: np.ndarray, multipliers: np.ndarray) -> np.ndarray:
        """The multipliers of the equalities, of least residual, that go with those of the bounds."""
        return self.system(x).multipliers(self.evaluator.gradient(x) + self.pull(x, multipliers))

    def joined(self, equalities: np.ndarray, multipliers: np.ndarray) -> np.ndarray:
        """(conditions,) the program's multipliers."""
        return self.bounded.joined(equalities, multipliers / self.scale)

    def parted(self, multipliers: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The inverse of `joined`."""
        equal, bounds = self.bounded.places
        return multipliers[equal], multipliers[bounds] * self.scale
