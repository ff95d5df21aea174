"""Newton's method where equality constraints are curved: SQP on the sparse saddle system."""

from dataclasses import replace

import numpy as np

from symmotion.program import Evaluator
from symmotion.solvers.descent import CLEARLY, ESCAPES, Enough, Point, downhill
from symmotion.solvers.journal import Journal
from symmotion.solvers.solution import Iteration
from symmotion.systems import AnyFactor, Saddle, largest, reach, shifted, tenfold

EPS = float(np.finfo(float).eps)
RIDGE = 1e-8
# The share of the linearised violation that the merit's slope must at least account for.
ACCOUNTED = 0.5
# Second-order corrections of a step, each of which halves the violation at least.
CORRECTIONS = 4
# A step is short from here on down.
SHORT = 0.2


class Curved:
    """The course of a descent to the minimum of f subject to c = 0, c nonlinear.

    Each step solves [[M, Jᵀ], [J, 0]] (d, λ⁺) = (−∇f, −c), M = H_GN + θ (H − H_GN + Σ λ_i ∇²c_i), a
    blend of Gauss–Newton and exact Lagrangian Hessian that is positive definite along the
    conditions, with θ = 1 at the end. The line search is on the merit f + μ ‖c‖₁, c in own units; where a step fails
    for the curvature of the conditions, second-order corrections, −c(x + d) through the same factor, are tried before
    a shorter one. Unit vectors are normalised. Where steps are short the next multiple of the identity that makes M
    positive definite begins larger.

    saddle: the program's, at any point; x (unknowns,), multipliers (conditions,): where it stands.
    """

    strange = "the objective, a condition or a derivative is not finite"
    idle = "steps lower neither the objective nor the violation any more"
    blend = corrects = True
    over = False

    def __init__(
        self,
        tolerance: float,
        evaluator: Evaluator,
        saddle: Saddle,
        journal: Journal,
        x: np.ndarray,
        multipliers: np.ndarray,
    ):
        self.evaluator, self.system, self.journal = evaluator, saddle, journal
        self.x, self.multipliers = x, multipliers
        self._enough, self._wanted = Enough(tolerance, evaluator), multipliers
        self._objective, self._violation = 0.0, np.empty(0)
        self._penalty, self._escapes = 0.0, 0
        # The multiple of the identity that M is given first where it needs one, and the one it was given last.
        self._first, self._shift = RIDGE, 0.0
        # What a condition counts in the merit, in own units: (conditions,), as at the start.
        self._own = reach(saddle.jacobian, evaluator.program.unit)

    def look(self, theta: float) -> Point:
        evaluator, x = self.evaluator, self.x
        self._objective, self._violation = evaluator.objective(x), evaluator.violation(x)
        self.system = self.system.at(evaluator.jacobian(x))
        gradient, matrix = self._second_order(theta)
        finite = np.isfinite(self._objective) and np.isfinite(matrix).all() and np.isfinite(self._violation).all()
        stationarity = largest(gradient + self.system.jacobian.T @ self.multipliers)
        row = Iteration(self._objective, stationarity, largest(self._violation))
        return Point(row, gradient, matrix, bool(finite))

    def matrix(self, theta: float) -> np.ndarray:
        return self._second_order(theta)[1]

    def _second_order(self, theta: float) -> tuple[np.ndarray, np.ndarray]:
        # By θ the conditions' part grows with the exact part of the objective's.
        return self.evaluator.second_order(self.x, self.system.pattern, theta * self.multipliers, theta=theta)

    def shifted(self, matrix: np.ndarray) -> AnyFactor:
        scale = largest(matrix[self.system.diagonal]) or 1.0
        shifts = tenfold(self._first * scale, most=1e3 * scale)
        unit, system = self.evaluator.program.unit, self.system
        factor, shift = shifted(system, matrix, unit, shifts, 1.0, lambda m: self.journal.timed(system.factorise, m))
        self._shift = shift / scale
        return factor

    def settled(self, point: Point, factor: AnyFactor) -> bool:
        jacobian, unit = self.system.jacobian, self.evaluator.program.unit
        # For the change of the multipliers: beside what these carry of the gradient a small step would be rounding.
        residual = point.gradient + jacobian.T @ self.multipliers
        right = np.concatenate([-residual, -self._violation])
        solution = self.journal.timed(self.system.solve, factor, right)
        point.step, change = solution[: self.system.n], solution[self.system.n :]
        self._wanted = self.multipliers + change
        missed = largest(self._violation / reach(jacobian, unit))
        mismatch = largest(unit * (jacobian.T @ change))
        tolerance = CLEARLY * self._enough.tolerance
        return (
            missed <= tolerance
            and mismatch <= tolerance * largest(unit * point.gradient)
            and self._enough(0.5 * abs(float(residual @ point.step)), self._objective, self.x)
        )

    def outward(self, point: Point) -> np.ndarray | None:
        if self._escapes == ESCAPES:
            return None
        direction = self.journal.timed(self.system.curvature, self.matrix(1.0)).direction
        if direction is None:
            return None
        self._escapes += 1
        return downhill(direction, point.gradient, self.x, self.evaluator.program.unit)

    def advance(self, point: Point, factor: AnyFactor, outward: np.ndarray | None) -> tuple[float, bool]:
        gradient, violation = point.gradient, self._violation
        if outward is None:
            step, wanted = point.step, self._wanted
            self._penalty = self._weighed(float(gradient @ step), wanted)
        else:
            step, wanted = outward, self.multipliers
        missed = self._penalty * self._missed(violation)
        merit = self._objective + missed
        self.x, length, value = self._searched(step, merit, float(gradient @ step) - missed, factor)
        self.multipliers = self.multipliers + min(1.0, length) * (wanted - self.multipliers)
        if self._shift:
            self._first = max(RIDGE, self._shift * (10.0 if length < SHORT else 0.1 if length == 1.0 else 1.0))
            self._shift = 0.0
        # Rounding may hide the last decrease: only several steps without one are the end.
        return length, value < merit or outward is not None

    def rest(self, point: Point, factor: AnyFactor) -> None:
        """One more step from a minimum, the factor of which is there: it squares the error for one gradient."""
        if factor is None:
            return
        evaluator, x = self.evaluator, self.evaluator.program.normalised(self.x + point.step)
        violation, jacobian = evaluator.violation(x), evaluator.jacobian(x)
        stationarity = largest(evaluator.gradient(x) + jacobian.T @ self._wanted)
        if largest(violation) <= largest(self._violation) and stationarity <= point.row.stationarity:
            self.x, self.multipliers = x, self._wanted
            row = self.journal.log.pop()
            self.journal.log.append(replace(row, theta=1.0, step=1.0))
            at = Iteration(evaluator.objective(x), stationarity, largest(violation), inertia="positive")
            self.journal.add(at)

    def _weighed(self, slope: float, multipliers: np.ndarray) -> float:
        """μ large enough for d to descend on f + μ ‖c‖₁, and no larger than need be."""
        missed = self._missed(self._violation)
        if missed == 0.0:
            return self._penalty
        needed = slope / ((1 - ACCOUNTED) * missed)
        # Powell's rule: it follows the multipliers down as well, after a start far away.
        most = largest(multipliers * self._own)
        return max(1.1 * needed, most, 0.5 * (self._penalty + most))

    def _searched(
        self, step: np.ndarray, merit: float, slope: float, factor: AnyFactor
    ) -> tuple[np.ndarray, float, float]:
        """The point accepted along a step, the length of the step and the merit there."""
        length, onto = 1.0, self.evaluator.program.normalised
        rounding = 1e-14 * (abs(merit) + 1e-300) + EPS * self._penalty * self.system.m
        while True:
            enough = merit + 1e-4 * length * min(slope, 0.0) + rounding
            point = plain = onto(self.x + length * step)
            value, violation = at_once, _ = self._merit(point)
            for _ in range(CORRECTIONS):
                if value <= enough:
                    break
                before, right = self._missed(violation), np.concatenate([np.zeros(self.system.n), -violation])
                point = onto(point + self.journal.timed(self.system.solve, factor, right)[: self.system.n])
                value, violation = self._merit(point)
                if not self._missed(violation) < 0.5 * before:
                    break
            if value <= enough:
                return point, length, value
            if length < 1e-10:
                return plain, length, at_once
            length *= 0.5

    def _merit(self, x: np.ndarray) -> tuple[float, np.ndarray]:
        violation = self.evaluator.violation(x)
        value = self.evaluator.objective(x) + self._penalty * self._missed(violation)
        return (value if np.isfinite(value) else np.inf), violation

    def _missed(self, violation: np.ndarray) -> float:
        """‖c‖₁ in own units."""
        return float(np.abs(violation / self._own).sum())
