"""What is true at a point with multipliers, computed the same way whatever solver returned them."""

from dataclasses import dataclass

import numpy as np
from scipy import sparse

from symmotion import checks
from symmotion.errors import InputError
from symmotion.program.evaluate import Evaluator
from symmotion.program.program import Program
from symmotion.systems.condensed import Condensed
from symmotion.systems.saddle import HessianTriangle, Saddle
from symmotion.systems.system import AnySystem

# Multipliers and distances from a bound below this, relative, count as none: IPOPT's are never exactly zero.
WEAK = 1e-6
# A curvature of less than this, relative to the diagonal, counts as zero: the factorisation does not pivot.
FLAT = 1e-9


@dataclass(frozen=True)
class Certificate:
    """First- and second-order conditions at a point.

    objective: f; stationarity: ‖∇f + Jᵀλ‖∞; violation: ‖g‖∞, for inequalities the positive part;
    scale: what a tolerance on stationarity is relative to, see `gradient_scale`; size: max(1, ‖x‖∞),
    what a tolerance on the violation is relative to.
    inertia: "positive" where the Hessian is positive definite along the conditions (a strict
    local minimum), "indefinite" where it is not, "unknown" where rounding leaves it open, or a bound
    that is met without a multiplier.
    """

    objective: float
    stationarity: float
    violation: float
    inertia: str
    scale: float
    size: float

    def holds(self, tolerance: float) -> bool:
        """Whether the first-order conditions hold to a tolerance."""
        checks.not_negative(tolerance, "tolerance")
        return bool(
            np.isfinite(self.objective)
            and self.stationarity <= tolerance * self.scale
            and self.violation <= tolerance * self.size
        )


def gradient_scale(gradient: np.ndarray, diagonal: np.ndarray, x: np.ndarray) -> float:
    """What a tolerance on stationarity is relative to: max(‖∇f‖∞, min(1, ‖diag H‖∞ ‖x‖∞)).

    The second part is what gradients are like away from the optimum. In small units it is small,
    where a tolerance on the gradient as such would accept the start.
    """
    usual = float(np.abs(diagonal).max(initial=0.0)) * float(np.abs(x).max(initial=0.0))
    return max(float(np.abs(gradient).max(initial=0.0)), min(1.0, usual)) or 1.0


def system_of(program: Program, evaluator: Evaluator, x: np.ndarray) -> AnySystem:
    """The saddle system that suits the structure of a program with linear equalities: condensed, else sparse."""
    return Condensed.of(program) or Saddle.of(program, lambda: evaluator.jacobian(x))


def certify(
    program: Program, x: np.ndarray, multipliers: np.ndarray, evaluator: Evaluator | None = None
) -> Certificate:
    """The certificate of a point x (unknowns,) with multipliers (conditions,)."""
    if not isinstance(program, Program):
        raise InputError(f"program of type {type(program).__name__}: a Program is needed")
    x = checks.array(x, (program.unknowns,), "x", finite=False)
    multipliers = checks.array(multipliers, (program.conditions,), "multipliers", finite=False)
    evaluator = evaluator or Evaluator(program)
    if not (np.isfinite(x).all() and np.isfinite(multipliers).all()):
        nan = float("nan")
        return Certificate(nan, nan, nan, "unknown", 1.0, 1.0)
    jacobian, violation = evaluator.jacobian(x), evaluator.violation(x)
    size = max(1.0, float(np.abs(x).max(initial=0.0)))
    system = _system_at(program, evaluator, x, multipliers, jacobian, size)
    shape = system or HessianTriangle.of(program)
    gradient, hessian = evaluator.second_order(x, shape.pattern, multipliers)
    return Certificate(
        objective=evaluator.objective(x),
        stationarity=float(np.abs(gradient + jacobian.T @ multipliers).max(initial=0.0)),
        violation=float(np.abs(violation).max(initial=0.0)),
        inertia="unknown" if system is None else _inertia(system, hessian),
        scale=gradient_scale(gradient, hessian[shape.diagonal], x),
        size=size,
    )


def _system_at(
    program: Program,
    evaluator: Evaluator,
    x: np.ndarray,
    multipliers: np.ndarray,
    jacobian: sparse.csr_array,
    size: float,
) -> AnySystem | None:
    """The saddle system along which the Hessian has to be positive: of the equalities and the active bounds.

    A bound is active where its multiplier is larger than its distance. None where both are zero up
    to rounding, which decides nothing.
    """
    if program.equalities_only:
        return system_of(program, evaluator, x) if program.linear else Saddle(program, jacobian)
    equal = program.lower == program.upper
    values = evaluator.values(x)
    slack = np.maximum(np.minimum(program.upper - values, values - program.lower), 0.0) / size
    press = np.abs(multipliers) / max(1.0, float(np.abs(multipliers).max(initial=0.0)))
    if (np.maximum(slack, press) < WEAK)[~equal].any():
        return None
    return Saddle(program, jacobian[np.flatnonzero(equal | (press > slack))])


def _inertia(system: AnySystem, hessian: np.ndarray) -> str:
    if not np.isfinite(hessian).all():
        return "unknown"
    if system.factorise(hessian) is not None:
        return "positive"
    # An eigenvalue that is zero up to rounding decides nothing.
    hessian[system.diagonal] += FLAT * np.abs(hessian[system.diagonal]).max(initial=0.0)
    if system.factorise(hessian) is not None:
        return "unknown"
    # Where a factorisation may fail for rounding alone, a direction of negative curvature is a proof.
    proven = system.conclusive or system.negative_curvature(hessian) is not None
    return "indefinite" if proven else "unknown"
