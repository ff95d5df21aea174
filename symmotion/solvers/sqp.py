"""Newton's method where equality constraints are curved: SQP on the sparse saddle system."""

from dataclasses import replace

import numpy as np

from symmotion.errors import InputError
from symmotion.program import Evaluator
from symmotion.solvers.descent import CLEARLY, ESCAPES, Enough, Point, downhill
from symmotion.solvers.filter import Filter, Seen
from symmotion.solvers.journal import Journal
from symmotion.solvers.solution import Iteration
from symmotion.systems import AnyFactor, Saddle, largest, reach, shifted, tenfold

# The multiple of the identity that is tried first, and the least, in units of gradient over unknown, as IPOPT has them.
FIRST, LEAST = 1e-4, 1e-10
MOST = 1e10
# Second-order corrections of a step, and what each leaves of the violation at most.
CORRECTIONS, LEFT = 4, 0.99
# Steps shorter than this one are none: then the conditions are gone for alone, by so many steps, to so much less.
SHORTEST, RESTORING, NEARER = 1e-8, 50, 0.9
# From a step shorter than this one on, the next is damped by a multiple of the identity, more every time.
SHORT = 0.1
# Multipliers, in units of the gradient, that are no more than an ill-conditioned step.
WILD = 1e3


class Curved:
    """The course of a descent to the minimum of f subject to c = 0, c nonlinear.

    Each step solves [[M, Jᵀ], [J, 0]] (d, λ⁺) = (−∇f, −c), M the exact Hessian of the Lagrangian plus the multiple of
    the identity that makes it positive definite along the conditions. The line search is by a filter: a step is taken
    where it lowers f or ‖c‖₁ against all points that stand for both. Where a whole step raises ‖c‖₁ second-order
    corrections, −c(x + d) through the same factor, are tried before a shorter one, and where no step is left the way
    to the conditions, of least length, comes first. Steps that were short damp those that follow. Unit vectors are
    normalised. Source: Wächter and Biegler 2006.

    saddle: the program's, at any point; x (unknowns,), multipliers (conditions,): where it stands.
    """

    strange = "the objective, a condition or a derivative is not finite"
    idle = "steps lower neither the objective nor the violation any more"
    blend = False
    corrects = True
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
        # The multiple of the identity that was needed last, and that which short steps ask for.
        self._escapes, self._shift, self._damping = 0, 0.0, 0.0
        # What counts as one of a condition in ‖c‖₁, and of the objective: as at the start.
        unit = evaluator.program.unit
        self._own, self._size = reach(saddle.jacobian, unit), largest(unit * evaluator.gradient(x)) or 1.0
        self._filter = Filter(self._missed(evaluator.violation(x)), saddle.m)

    def look(self, theta: float) -> Point:
        evaluator, x = self.evaluator, self.x
        self._objective, self._violation = evaluator.objective(x), evaluator.violation(x)
        self.system = self.system.at(evaluator.jacobian(x))
        gradient, matrix = self._second_order(theta)
        if self._damping:
            identity = self.system.on_diagonal(evaluator.program.unit) ** -2.0
            matrix[self.system.diagonal] += self._damping * self._size * identity
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
        unit, system = self.evaluator.program.unit, self.system
        shifts = tenfold(max(LEAST, self._shift / 3) if self._shift else FIRST, most=MOST)
        factor, self._shift = shifted(
            system, matrix, unit, shifts, self._size, lambda m: self.journal.timed(system.factorise, m)
        )
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
            not self._damping
            and missed <= tolerance
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
        step, wanted = (point.step, self._wanted) if outward is None else (outward, self.multipliers)
        here = self._seen(self._objective, self._violation)
        x, length, there = self._searched(step, here, float(point.gradient @ step) / self._size, factor)
        damping = max(FIRST, 10 * self._damping) if length < SHORT else 0.1 * self._damping
        self._damping = damping if damping >= FIRST else 0.0
        if not length:
            return 0.0, self._restored(here)
        self.x = x
        self.multipliers = self.multipliers + length * (wanted - self.multipliers)
        if largest(self.multipliers * self._own) > WILD * self._size:
            self.multipliers = self._least(self.system.at(self.evaluator.jacobian(x)))
        # Rounding may hide the last decrease: only several steps without one are the end.
        return length, there < here or there.objective < here.objective or outward is not None

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

    def _searched(
        self, step: np.ndarray, here: Seen, slope: float, factor: AnyFactor
    ) -> tuple[np.ndarray, float, Seen]:
        """The point accepted along a step, the length of the step, and what is seen there; of no length if none is."""
        length, onto, none = 1.0, self.evaluator.program.normalised, np.zeros(self.system.n)
        while length >= SHORTEST:
            point = onto(self.x + length * step)
            there, violation = self._at(point)
            accepted = self._filter.accepts(here, there, length, slope)
            for _ in range(CORRECTIONS if length == 1.0 else 0):
                if accepted or there.missed < here.missed:
                    break
                before, right = there.missed, np.concatenate([none, -violation])
                point = onto(point + self.journal.timed(self.system.solve, factor, right)[: self.system.n])
                there, violation = self._at(point)
                accepted = self._filter.accepts(here, there, length, slope)
                if not there.missed < LEFT * before:
                    break
            if accepted:
                return point, length, there
            length *= 0.5
        return self.x, 0.0, here

    def _restored(self, here: Seen) -> bool:
        """Go to a point that is nearer to the conditions, by the least changes in own units; whether there is one."""
        evaluator, onto, x, system = self.evaluator, self.evaluator.program.normalised, self.x, self.system
        self._filter.keep(here)
        for _ in range(RESTORING):
            violation = evaluator.violation(x)
            missed, length = self._missed(violation), 1.0
            try:
                step = self.journal.timed(system.feasible, x, violation) - x
            except InputError:
                return False
            while not self._missed(evaluator.violation(onto(x + length * step))) < (1 - 1e-4 * length) * missed:
                length *= 0.5
                if length < SHORTEST:
                    return False
            x = onto(x + length * step)
            system, there = system.at(evaluator.jacobian(x)), self._at(x)[0]
            if there.missed <= NEARER * here.missed and self._filter.takes(there):
                self.x, self.multipliers = x, self._least(system)
                return True
        return False

    def _least(self, system: Saddle) -> np.ndarray:
        """The multipliers that leave least of the gradient, or none where these are out of all measure too."""
        try:
            found = system.multipliers(self.evaluator.gradient(self.x))
        except InputError:
            return np.zeros(system.m)
        return found if largest(found * self._own) <= WILD * self._size else np.zeros(system.m)

    def _at(self, x: np.ndarray) -> tuple[Seen, np.ndarray]:
        violation = self.evaluator.violation(x)
        return self._seen(self.evaluator.objective(x), violation), violation

    def _seen(self, objective: float, violation: np.ndarray) -> Seen:
        return Seen(self._missed(violation), objective / self._size)

    def _missed(self, violation: np.ndarray) -> float:
        """‖c‖₁ in own units."""
        return float(np.abs(violation / self._own).sum())
