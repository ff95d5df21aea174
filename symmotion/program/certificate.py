"""What is true at a point with multipliers, computed the same way whatever solver returned them."""

from dataclasses import dataclass

import numpy as np

from symmotion.program.condensed import Condensed
from symmotion.program.evaluate import Evaluator
from symmotion.program.program import Program
from symmotion.program.saddle import Saddle


@dataclass(frozen=True)
class Certificate:
    """First- and second-order conditions at a point.

    objective: f; stationarity: ‖∇f + Jᵀλ‖∞; violation: ‖g‖∞, for inequalities the positive part;
    scale: max(1, ‖∇f‖∞), what a tolerance on stationarity is relative to; size: max(1, ‖x‖∞),
    what a tolerance on the violation is relative to.
    inertia: "positive" where the Hessian is positive definite along the conditions (a strict
    local minimum), "indefinite" where it is not, "unknown" where rounding or inequalities leave it open.
    """

    objective: float
    stationarity: float
    violation: float
    inertia: str
    scale: float
    size: float

    def holds(self, tolerance: float) -> bool:
        """Whether the first-order conditions hold to a tolerance."""
        return bool(
            np.isfinite(self.objective)
            and self.stationarity <= tolerance * self.scale
            and self.violation <= tolerance * self.size
        )


def system_of(program: Program, evaluator: Evaluator, x: np.ndarray) -> Condensed | Saddle:
    """The saddle system that suits the structure of a program with linear equalities: condensed, else sparse."""
    return Condensed.of(program) or Saddle.of(program, lambda: evaluator.jacobian(x))


def certify(
    program: Program, x: np.ndarray, multipliers: np.ndarray, evaluator: Evaluator | None = None
) -> Certificate:
    """The certificate of a point x (unknowns,) with multipliers (conditions,)."""
    evaluator = evaluator or Evaluator(program)
    if not (np.isfinite(x).all() and np.isfinite(multipliers).all()):
        nan = float("nan")
        return Certificate(nan, nan, nan, "unknown", 1.0, 1.0)
    jacobian = evaluator.jacobian(x)
    system = system_of(program, evaluator, x) if program.linear else Saddle(program, jacobian)
    gradient, hessian = evaluator.second_order(x, system.pattern, multipliers)
    return Certificate(
        objective=evaluator.objective(x),
        stationarity=float(np.abs(gradient + jacobian.T @ multipliers).max(initial=0.0)),
        violation=float(np.abs(evaluator.violation(x)).max(initial=0.0)),
        inertia=_inertia(system, hessian) if program.equalities_only else "unknown",
        scale=max(1.0, float(np.abs(gradient).max(initial=0.0))),
        size=max(1.0, float(np.abs(x).max(initial=0.0))),
    )


def _inertia(system: Condensed | Saddle, hessian: np.ndarray) -> str:
    if not np.isfinite(hessian).all():
        return "unknown"
    if system.factorise(hessian) is not None:
        return "positive"
    # An eigenvalue that is zero up to rounding decides nothing.
    hessian[system.diagonal] += 1e-12 * np.abs(hessian[system.diagonal]).max(initial=0.0)
    return "unknown" if system.factorise(hessian) is not None else "indefinite"
