"""From a minimum to that of a program with other data, by the factor that the certificate of the first one keeps."""

import numpy as np

from symmotion.program import Evaluator
from symmotion.solvers.journal import Journal
from symmotion.solvers.solution import Iteration, Solution
from symmotion.systems import AnySystem, largest

# Steps on one factor: as long as each lowers the decrement to this share, they cost less than a new Hessian.
FALLS, MOST = 0.1, 12
# The decrement from which the last step is taken, beside that which the tolerance asks for: a Newton step would have
# squared the error.
CLOSE = 1e-5


class Continued:
    """The steps on a kept factor from x, where conditions hold: the first is the tangent's, up to second order.

    x: where the steps end; multipliers: there, None where the steps stop before the minimum, which Newton's method has
    to find from x.
    """

    def __init__(
        self,
        evaluator: Evaluator,
        system: AnySystem,
        start: Solution,
        x: np.ndarray,
        tolerance: float,
        journal: Journal,
    ):
        self.x = x
        self.multipliers: np.ndarray | None = None
        factor = start.certificate.factor_of(system)
        if factor is None:
            return
        gradient = evaluator.gradient(x)
        step = system.step(factor, gradient)
        before = -0.5 * float(gradient @ step)
        enough = CLOSE * tolerance * tolerance * abs(start.objective)
        first = largest(system.reduced(gradient)), before
        for _ in range(MOST):
            there = self.x + step
            gradient = evaluator.gradient(there)
            step = journal.timed(system.step, factor, gradient)
            decrement = -0.5 * float(gradient @ step)
            if not decrement <= FALLS * before:
                return
            self.x, before = there, decrement
            if decrement <= enough:
                break
        else:
            return
        violation = largest(evaluator.violation(self.x))
        self.multipliers = system.multipliers(gradient)
        journal.add(Iteration(evaluator.objective(x), first[0], violation, step=1.0))
        found = largest(system.reduced(gradient))
        journal.add(Iteration(evaluator.objective(self.x), found, violation, inertia="positive"))
