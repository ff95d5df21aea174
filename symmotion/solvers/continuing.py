"""From a minimum to that of a program with other data, by the factor that the certificate of the first one keeps."""

from collections.abc import Sequence

import numpy as np

from symmotion.program import Evaluator
from symmotion.solvers.journal import Journal
from symmotion.solvers.solution import Iteration, Solution
from symmotion.systems import AnyFactor, AnySystem, largest

# Steps on one factor: as long as each lowers the decrement to this share, they cost less than a new Hessian.
FALLS, MOST = 0.3, 12
# The decrement from which the last step is taken, beside that which the tolerance asks for: a Newton step would have
# squared the error.
CLOSE = 1e-2


class Continued:
    """The steps on a kept factor from x, where conditions hold: the first is the tangent's, up to second order.

    What the gradients of the steps tell of the Hessian is added to the factor (L-BFGS, Nocedal 1980).
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
        seen: list[tuple[np.ndarray, np.ndarray, float]] = []
        for _ in range(MOST):
            there, last = self.x + step, gradient
            gradient = evaluator.gradient(there)
            bend = gradient - last
            curvature = float(step @ bend)
            if not curvature > 0:
                return
            seen.append((step, bend, curvature))
            step = journal.timed(_step, system, factor, gradient, seen)
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


def _step(
    system: AnySystem,
    factor: AnyFactor,
    gradient: np.ndarray,
    seen: Sequence[tuple[np.ndarray, np.ndarray, float]],
) -> np.ndarray:
    """(unknowns,) the step of a factor, updated by the steps before, the changes of the gradient and their products."""
    left, shares = gradient, []
    for step, bend, curvature in reversed(seen):
        shares.append(float(step @ left) / curvature)
        left = left - shares[-1] * bend
    found = system.step(factor, left)
    for (step, bend, curvature), share in zip(seen, reversed(shares), strict=True):
        found = found - (share + float(bend @ found) / curvature) * step
    return found
