"""Newton's method where equality constraints are curved: SQP on the sparse saddle system."""

from dataclasses import replace
from time import perf_counter
from typing import Any

import numpy as np

from symmotion.program import Evaluator, Program
from symmotion.solvers.solution import Iteration, Solution, Status
from symmotion.systems import Saddle, gradient_scale

# The share θ of the exact Hessian grows tenfold with every step and falls back to LEAST where the matrix
# is not positive definite: the fewest evaluations of the schedules tried, here and in `newton`.
LEAST, GROW = 1e-3, 10.0
RIDGE = 1e-8
# The share of the linearised violation that the merit's slope must at least account for.
ACCOUNTED = 0.5


class CurvedRun:
    """The state of one solve: minimise f subject to c = 0, c nonlinear.

    Each step solves [[M, Jᵀ], [J, 0]] (d, λ⁺) = (−∇f, −c), M = H_GN + θ (H − H_GN + Σ λ_i ∇²c_i), a
    blend of Gauss–Newton and exact Lagrangian Hessian that is positive definite along the
    conditions, with θ = 1 at the end. The line search is on the merit f + μ ‖c‖₁; where the full
    step fails for the curvature of the conditions, a second-order correction, −c(x + d) through
    the same factor, is tried before a shorter one.
    """

    def __init__(self, tolerance: float, max_iterations: int, evaluator: Evaluator, saddle: Saddle):
        self.tolerance, self.max_iterations = tolerance, max_iterations
        self.evaluator, self.saddle = evaluator, saddle
        self.x: np.ndarray = np.empty(0)
        self.multipliers: np.ndarray = np.empty(0)
        self.log: list[Iteration] = []
        self.linear = 0.0

    def iterate(self, x: np.ndarray, multipliers: np.ndarray) -> tuple[Status, str] | None:
        """Run from x and multipliers; None once solved, else how it ended."""
        evaluator = self.evaluator
        theta, penalty, idle, escapes = 1.0, 0.0, 0, 0
        while True:
            evaluated, solved = evaluator.seconds, self.linear
            objective, violation = evaluator.objective(x), evaluator.violation(x)
            saddle = self.saddle.at(evaluator.jacobian(x))
            gradient, matrix = evaluator.second_order(x, saddle.pattern, theta * multipliers, theta=theta)
            self.x, self.multipliers = x, multipliers
            stationarity = float(np.abs(gradient + saddle.jacobian.T @ multipliers).max(initial=0.0))
            missed = float(np.abs(violation).max(initial=0.0))
            row = Iteration(objective, stationarity, missed)
            if not np.isfinite(objective) or not np.isfinite(matrix).all() or not np.isfinite(violation).all():
                self.log.append(row)
                return Status.DIVERGED, "the objective, a condition or a derivative is not finite"
            scale = gradient_scale(gradient, matrix[saddle.diagonal], x)
            size = max(1.0, float(np.abs(x).max(initial=0.0)))
            converged = stationarity <= self.tolerance * scale and missed <= self.tolerance * size
            if converged and theta < 1.0:
                theta = 1.0
                _, matrix = evaluator.second_order(x, saddle.pattern, multipliers)
            factor = self._timed(saddle.factorise, matrix)
            inertia = None if theta < 1.0 else "positive" if factor is not None else "indefinite"
            escape = None
            if converged:
                if factor is None and escapes < 5:
                    escape = self._timed(saddle.negative_curvature, matrix)
                if escape is None:
                    self.log.append(replace(row, inertia=inertia))
                    return None
                escapes += 1
            if factor is None and theta > LEAST:
                theta = LEAST
                _, matrix = evaluator.second_order(x, saddle.pattern, theta * multipliers, theta=theta)
                factor = self._timed(saddle.factorise, matrix)
            if factor is None:
                factor = self._timed(self._shifted, saddle, matrix)
            if len(self.log) == self.max_iterations or idle > 3 or factor is None:
                self.log.append(replace(row, inertia=inertia))
                if factor is None:
                    return Status.FAILED, "the saddle system is singular: conditions are redundant or contradict"
                if idle > 3:
                    return Status.STALLED, "steps lower neither the objective nor the violation any more"
                return Status.ITERATION_LIMIT, f"{self.max_iterations} iterations"
            if escape is None:
                solution = self._timed(saddle.solve, factor, np.concatenate([-gradient, -violation]))
                step, wanted = solution[: saddle.n], solution[saddle.n :]
                penalty = self._penalty(penalty, float(gradient @ step), violation, wanted)
            else:
                step, wanted = _outward(escape, x, gradient), multipliers
            merit = objective + penalty * np.abs(violation).sum()
            slope = float(gradient @ step) - penalty * np.abs(violation).sum()
            fresh, length, value = self._searched(x, step, merit, slope, penalty, saddle, factor)
            seconds = {"evaluate": evaluator.seconds - evaluated, "linear": self.linear - solved}
            self.log.append(replace(row, theta=theta, step=length, inertia=inertia, **seconds))
            # Rounding may hide the last decrease; several steps without one are the end.
            idle = idle + 1 if value >= merit and escape is None else 0
            x = fresh
            multipliers = multipliers + min(1.0, length) * (wanted - multipliers)
            theta = min(1.0, GROW * theta)

    def _penalty(self, penalty: float, slope: float, violation: np.ndarray, multipliers: np.ndarray) -> float:
        """μ large enough for d to descend on f + μ ‖c‖₁, and no larger than need be."""
        missed = float(np.abs(violation).sum())
        if missed == 0.0:
            return penalty
        needed = slope / ((1 - ACCOUNTED) * missed)
        # Powell's rule: it follows the multipliers down as well, after a start far away.
        largest = float(np.abs(multipliers).max(initial=0.0))
        return max(1.1 * needed, largest, 0.5 * (penalty + largest))

    def _searched(
        self, x: np.ndarray, step: np.ndarray, merit: float, slope: float, penalty: float, saddle: Saddle, factor: Any
    ) -> tuple[np.ndarray, float, float]:
        """The point accepted along a step, the length of the step and the merit there."""
        length = 1.0
        rounding = 1e-14 * (abs(merit) + 1e-300)
        while True:
            fresh = x + length * step
            value, violation = self._merit(fresh, penalty)
            if value <= merit + 1e-4 * length * min(slope, 0.0) + rounding or length < 1e-10:
                return fresh, length, value
            if length == 1.0:
                correction = self._timed(saddle.solve, factor, np.concatenate([np.zeros(saddle.n), -violation]))
                corrected = fresh + correction[: saddle.n]
                value, _ = self._merit(corrected, penalty)
                if value <= merit + 1e-4 * min(slope, 0.0) + rounding:
                    return corrected, length, value
            length *= 0.5

    def _merit(self, x: np.ndarray, penalty: float) -> tuple[float, np.ndarray]:
        violation = self.evaluator.violation(x)
        value = self.evaluator.objective(x) + penalty * float(np.abs(violation).sum())
        return (value if np.isfinite(value) else np.inf), violation

    def _shifted(self, saddle: Saddle, matrix: np.ndarray) -> Any:
        """The factor of the matrix plus the least multiple of the identity that makes it positive definite."""
        scale = np.abs(matrix[saddle.diagonal]).max(initial=0.0) or 1.0
        shift, whole = RIDGE * scale, 0.0
        while whole <= 1e3 * scale:
            matrix[saddle.diagonal] += shift
            whole += shift
            factor = saddle.factorise(matrix)
            if factor is not None:
                return factor
            shift *= 10
        return None

    def _timed(self, function: Any, *arguments: Any) -> Any:
        began = perf_counter()
        result = function(*arguments)
        self.linear += perf_counter() - began
        return result


def _outward(direction: np.ndarray, x: np.ndarray, gradient: np.ndarray) -> np.ndarray:
    """A direction of negative curvature as a step: downhill, a tenth of the size of x."""
    size = 0.1 * max(1.0, float(np.abs(x).max(initial=0.0))) / float(np.abs(direction).max())
    return (-size if gradient @ direction > 0 else size) * direction


def multipliers_of(start: Any, program: Program) -> np.ndarray | None:
    """The multipliers that a start brings along, where it is a solution of a program of the same conditions."""
    if isinstance(start, Solution) and start.program.structure is program.structure:
        return start.multiplier_vector
    return None
