"""A program's own units, in which solvers that are not ours see it: everything of order one."""

from dataclasses import dataclass

import numpy as np

from symmotion.program import Evaluator
from symmotion.systems import HessianTriangle, largest, reach

# What rounding leaves of a gradient, relative to the sizes of what cancels in it: no test asks for less.
ROUNDING = 1e-15


@dataclass(frozen=True, eq=False)
class OwnUnits:
    """What counts as one: of each unknown (n,), of each condition (m,), and of the objective.

    With x = u x̂, f = s f̂ and g = c ĝ the multipliers are λ = s λ̂ / c.
    """

    unknowns: np.ndarray
    conditions: np.ndarray
    objective: float

    @staticmethod
    def of(evaluator: Evaluator, x: np.ndarray, tolerance: float) -> "OwnUnits":
        """The units of a program at a start x: unknowns as `Program.unit`, the rest by what these change.

        tolerance: of the test of the gradient. At a start that is almost stationary the gradient counts as no smaller
        than makes rounding the tolerance's part of it.
        """
        program = evaluator.program
        unit, triangle = program.unit, HessianTriangle.of(program)
        gradient, hessian = evaluator.second_order(x, triangle.pattern, np.zeros(program.conditions))
        usual = largest(hessian[triangle.diagonal] * unit[triangle.rows[triangle.diagonal]] ** 2)
        size = max(largest(unit * gradient), usual * ROUNDING / max(tolerance, ROUNDING))
        size = size if np.isfinite(size) and size > 0 else 1.0
        return OwnUnits(unit, reach(evaluator.jacobian(x), unit, (program.lower, program.upper)), size)

    @property
    def multipliers(self) -> np.ndarray:
        """(m,) what a multiplier of one is worth."""
        return self.objective / self.conditions
