"""Newton's method on (x, λ) with the exact Hessian, made to descend."""

from dataclasses import dataclass, replace
from time import perf_counter
from typing import Any, Literal

import numpy as np

from symmotion.errors import InputError
from symmotion.program import Condensed, Evaluator, Program, Saddle, system_of
from symmotion.solvers.result import Iteration, Seconds, Solution, Status, conclude, require_equalities, start_vector

# The share θ of the exact Hessian grows tenfold with every step and falls back to LEAST where the matrix
# is not positive definite: the fewest evaluations of the schedules tried.
LEAST, GROW = 1e-3, 10.0
# A Gauss–Newton matrix may be only semidefinite (motions that stay rigid to first order cost nothing):
# the first multiple of the identity tried then, relative to the diagonal.
RIDGE = 1e-10


@dataclass(frozen=True)
class ExactNewton:
    """Newton on (x, λ) with exact Hessian, θ-blend convexification and exact line search.

    Each step solves the saddle system of M = H_GN + θ (H − H_GN), a blend of Gauss–Newton and
    exact Hessian that is positive definite along the conditions; at the end θ = 1 and
    convergence is quadratic. Terms that are no sums of squares get a multiple of the identity
    instead. Along the step the objective is a quartic for all residuals up to quadratic,
    minimised exactly. Iterates stay feasible, and the objective is the merit
    function. A stationary point that is no minimum is left along negative curvature.

    tolerance: on stationarity relative to max(1, ‖∇f‖∞).
    system: "condensed" (banded, where the conditions decouple), "sparse" (LDLᵀ, any linear
        equalities), or "auto", by the program's structure.
    """

    tolerance: float = 1e-8
    max_iterations: int = 200
    system: Literal["auto", "condensed", "sparse"] = "auto"

    def solve(self, program: Program, start: Any = None) -> Solution:
        """Solve a program with linear equalities; start: None, a Solution, a motion, or (unknowns,) numbers."""
        require_equalities(program, "ExactNewton")
        began = perf_counter()
        x = start_vector(program, start)
        evaluator = Evaluator(program)
        evaluator.prepare("value", "hessian", "line")
        system = self._system(program, evaluator, x)
        compiled = perf_counter()
        evaluator.seconds = 0.0
        run = _Run(self, evaluator, system)
        # A start of the caller's own is taken for close to the minimum, where the exact Hessian serves.
        failure = run.iterate(system.feasible(x, evaluator.violation(x)), LEAST if start is None else 1.0)
        seconds = Seconds(
            program.build_seconds, compiled - began, perf_counter() - compiled, evaluator.seconds, run.linear
        )
        method = "newton-sparse" if self.system == "sparse" else "newton"
        return conclude(program, self, method, run.x, run.multipliers, run.log, seconds, failure, evaluator)

    def _system(self, program: Program, evaluator: Evaluator, x: np.ndarray) -> Condensed | Saddle:
        if self.system == "auto":
            return system_of(program, evaluator, x)
        if self.system == "sparse":
            return Saddle.of(program, lambda: evaluator.jacobian(x))
        condensed = Condensed.of(program)
        if condensed is None:
            raise InputError('the conditions of this program do not decouple: use system="sparse" or insert more knots')
        return condensed


class _Run:
    """The state of one solve."""

    def __init__(self, options: ExactNewton, evaluator: Evaluator, system: Condensed | Saddle):
        self.options, self.evaluator, self.system = options, evaluator, system
        self.x = self.multipliers = np.empty(0)
        self.log: list[Iteration] = []
        self.linear = 0.0

    def iterate(self, x: np.ndarray, theta: float) -> tuple[Status, str] | None:
        evaluator, system, options = self.evaluator, self.system, self.options
        objective, idle = evaluator.objective(x), 0
        while True:
            evaluated, solved = evaluator.seconds, self.linear
            gradient, matrix = evaluator.second_order(x, system.pattern, theta=theta)
            self.x, self.multipliers = x, system.multipliers(gradient)
            stationarity = float(np.abs(system.reduced(gradient)).max(initial=0.0))
            violation = float(np.abs(evaluator.violation(x)).max(initial=0.0))
            row = Iteration(objective, stationarity, violation)
            if not np.isfinite(objective) or not np.isfinite(matrix).all():
                self.log.append(row)
                return Status.DIVERGED, "the objective or a derivative is not finite"
            converged = stationarity <= options.tolerance * max(1.0, np.abs(gradient).max(initial=0.0))
            if converged and theta < 1.0:
                theta = 1.0
                _, matrix = evaluator.second_order(x, system.pattern)
            factor = self._timed(system.factorise, matrix)
            inertia = None if theta < 1.0 else "positive" if factor is not None else "indefinite"
            if converged:
                step = None if factor is not None else self._timed(system.negative_curvature, matrix)
                if step is None:
                    self.log.append(replace(row, inertia=inertia))
                    if factor is not None:
                        self._polish(x, self._timed(system.step, factor, gradient), stationarity)
                    return None
            else:
                if factor is None and theta > LEAST:
                    theta = LEAST
                    _, matrix = evaluator.second_order(x, system.pattern, theta=theta)
                    factor = self._timed(system.factorise, matrix)
                if factor is None:
                    factor = self._timed(self._shifted, matrix)
                step = self._timed(system.step, factor, gradient)
            if len(self.log) == options.max_iterations or idle > 3:
                self.log.append(replace(row, inertia=inertia))
                if idle > 3:
                    return Status.STALLED, "steps no longer lower the objective"
                return Status.ITERATION_LIMIT, f"{options.max_iterations} iterations"
            length, value = self._length(x, step, objective, float(gradient @ step))
            seconds = {"evaluate": evaluator.seconds - evaluated, "linear": self.linear - solved}
            self.log.append(replace(row, theta=theta, step=length, inertia=inertia, **seconds))
            x = x + length * step
            idle = idle + 1 if value >= objective else 0
            objective, theta = value, min(1.0, GROW * theta)

    def _polish(self, x: np.ndarray, step: np.ndarray, stationarity: float) -> None:
        """One more step from a converged point: the factor is there, and it squares the error for one gradient."""
        evaluator, system = self.evaluator, self.system
        x = x + step
        gradient = evaluator.gradient(x)
        better = float(np.abs(system.reduced(gradient)).max(initial=0.0))
        if better < stationarity:
            self.x, self.multipliers = x, system.multipliers(gradient)
            self.log[-1] = replace(self.log[-1], theta=1.0, step=1.0)
            violation = float(np.abs(evaluator.violation(x)).max(initial=0.0))
            self.log.append(Iteration(evaluator.objective(x), better, violation, inertia="positive"))

    def _timed(self, function: Any, *arguments: Any) -> Any:
        began = perf_counter()
        result = function(*arguments)
        self.linear += perf_counter() - began
        return result

    def _shifted(self, matrix: np.ndarray) -> Any:
        """The factor of the matrix plus the least multiple of the identity that makes it positive definite."""
        diagonal = self.system.diagonal
        squares = all(b.kernel.squares for b in self.evaluator.program.terms)
        shift = (RIDGE if squares else LEAST) * (np.abs(matrix[diagonal]).max(initial=0.0) or 1.0)
        while True:
            matrix[diagonal] += shift
            factor = self.system.factorise(matrix)
            if factor is not None:
                return factor
            shift *= 10

    def _length(self, x: np.ndarray, step: np.ndarray, objective: float, slope: float) -> tuple[float, float]:
        """The length of a step and the objective there."""
        quartic = self.evaluator.line(x, step)
        if quartic is not None:
            length = first_minimum(quartic)
            return length, float(np.polyval(quartic[::-1], length))
        length = 1.0
        while True:
            value = self.evaluator.objective(x + length * step)
            # The last terms allow for rounding where the decrease is below it.
            if value <= objective + 1e-4 * length * min(slope, 0.0) + 1e-15 * abs(objective) or length < 1e-12:
                return length, value
            length *= 0.5


def first_minimum(quartic: np.ndarray) -> float:
    """The first α > 0 where the slope of c₀ + c₁α + … + c₄α⁴ vanishes; 1 where there is none."""
    slope = quartic[1:] * np.arange(1, len(quartic))
    degree = int(np.flatnonzero(slope)[-1]) if slope.any() else 0
    # The eigenvalues of the companion matrix; np.roots finds the same at five times the cost.
    companion = np.eye(degree, k=-1)
    companion[:1] = -slope[:degree][::-1] / slope[degree]
    roots = np.linalg.eigvals(companion)
    real = roots.real[np.abs(roots.imag) <= 1e-9 * np.maximum(1.0, np.abs(roots.real))]
    return float(real[real > 0].min()) if (real > 0).any() else 1.0
