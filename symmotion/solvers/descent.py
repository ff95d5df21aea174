"""What Newton's method does whether the conditions are straight or curved: blend, convexify, step, and see an end."""

from dataclasses import dataclass, field, replace
from typing import Protocol

import numpy as np

from symmotion.program import Evaluator
from symmotion.solvers.journal import Failure, Journal
from symmotion.solvers.solution import Iteration, Status
from symmotion.systems import AnyFactor, AnySystem, largest

# The share θ of the exact Hessian grows tenfold with every step and falls back to LEAST where the matrix
# is not positive definite: the fewest evaluations of the schedules tried, along straight and curved conditions.
LEAST, GROW = 1e-3, 10.0
# A decrement as far below the tolerance leaves nothing to doubt.
CLEARLY = 0.25
# Decrements, relative to the first objective, below which the rounding of the objective is asked for.
NEAR = 1e-10
# Times that θ falls back before multiples of the identity are added to the exact Hessian in its place.
FALLS = 5
# Stationary points that are left along negative curvature, one after the other.
ESCAPES = 5
# Steps in a row without progress that are the end.
IDLE = 3


class Enough:
    """When a decrement is small enough: at most tolerance² |f|, or the rounding of f; see `Certificate`.

    At a point that is good to the tolerance one more Newton step squares the error, so that the certificate, which
    looks at the same figures there, agrees.
    """

    def __init__(self, tolerance: float, evaluator: Evaluator):
        self.tolerance, self._evaluator = tolerance, evaluator
        self._first, self._rounding = None, None
        self._x, self._least, self._idle = None, np.inf, False

    def __call__(self, decrement: float, objective: float, x: np.ndarray) -> bool:
        """Whether a decrement is small enough at a point x with this objective."""
        self._first = self._first or abs(objective)
        if x is not self._x:
            self._idle, self._least = not abs(objective) < self._least, min(self._least, abs(objective))
            self._x = x
        if decrement <= CLEARLY * self.tolerance**2 * abs(objective):
            return True
        if decrement > NEAR * self._first:
            # From a start that is next to the minimum no step leads down, and all of f may be rounding.
            return self._idle and decrement <= self._evaluator.rounding(x)
        if self._rounding is None:
            self._rounding = self._evaluator.rounding(x)
        return decrement <= self._rounding


@dataclass
class Point:
    """What is seen from where a descent stands.

    row: the log's, without the step; gradient: ∇f (unknowns,); matrix: M in the order of the system's pattern;
    finite: whether all of it is; step: the Newton step (unknowns,) of the factor last asked for.
    """

    row: Iteration
    gradient: np.ndarray
    matrix: np.ndarray
    finite: bool
    step: np.ndarray = field(default_factory=lambda: np.empty(0))


class Course(Protocol):
    """What is descended, and where on it the descent stands: `newton.Straight` or `sqp.Curved`.

    system: the saddle system at the point; strange, idle: what to say where numbers are not finite, and where
    steps make no progress. blend: whether θ is lowered where the matrix is not positive definite.
    corrects: whether a step along negative curvature needs a factor too. over: whether it has ended where the exact
    Hessian was looked at.
    """

    evaluator: Evaluator
    journal: Journal
    strange: str
    idle: str
    blend: bool
    corrects: bool

    @property
    def over(self) -> bool: ...

    @property
    def system(self) -> AnySystem: ...

    def look(self, theta: float) -> Point:
        """What is seen from here, M being the blend of share θ."""
        ...

    def matrix(self, theta: float) -> np.ndarray:
        """M from here for another θ."""
        ...

    def shifted(self, matrix: np.ndarray) -> AnyFactor:
        """The factor of the matrix plus a multiple of the identity, None where none makes it positive definite."""
        ...

    def settled(self, point: Point, factor: AnyFactor) -> bool:
        """Whether the point is stationary to the tolerance, by the Newton step of a factor, which is kept."""
        ...

    def outward(self, point: Point) -> np.ndarray | None:
        """A direction of negative curvature of the exact Hessian at a stationary point, None where there is none."""
        ...

    def advance(self, point: Point, factor: AnyFactor, outward: np.ndarray | None) -> tuple[float, bool]:
        """Go along the Newton step, or outward: the length of the step, and whether that was progress."""
        ...

    def rest(self, point: Point, factor: AnyFactor) -> None:
        """What is left to do at a stationary point; factor: None where M is not positive definite."""
        ...


def descend(course: Course, theta: float) -> tuple[Failure | None, bool]:
    """Descend from where the course stands: None once converged, else how it ended; and whether θ ever fell back.

    theta: the share of the exact Hessian in the first matrix. At the end it is 1.
    """
    evaluator, journal = course.evaluator, course.journal
    idle, fell_back, falls = 0, False, 0
    while True:
        evaluated, linear = evaluator.seconds, journal.linear
        point = course.look(theta)
        if not point.finite:
            journal.add(point.row)
            return (Status.DIVERGED, course.strange), fell_back
        factor = journal.timed(course.system.factorise, point.matrix)
        settled = factor is not None and course.settled(point, factor)
        if settled and theta < 1.0 and not course.over:
            theta, point.matrix = 1.0, course.matrix(1.0)
            factor = journal.timed(course.system.factorise, point.matrix)
            settled = factor is not None and course.settled(point, factor)
        exact = theta == 1.0
        row = replace(point.row, inertia=None if not exact else "positive" if factor is not None else "indefinite")
        outward, ending = None, None
        if factor is None:
            factor, least, fell = _convexified(course, point, theta, blend=course.blend and falls < FALLS)
            falls += fell
            if factor is None:
                ending = Status.FAILED, "the saddle system is singular: conditions are redundant or contradict"
            elif course.settled(point, factor):
                outward = None if course.over else course.outward(point)
                settled = outward is None
            if outward is None or course.corrects:
                theta, fell_back = least, fell_back or (fell and not settled)
        if settled:
            journal.add(row)
            course.rest(point, factor if row.inertia == "positive" else None)
            return None, fell_back
        if idle > IDLE:
            ending = ending or (Status.STALLED, course.idle)
        ending = ending or journal.ending()
        if ending is not None:
            journal.add(row)
            return ending, fell_back
        length, progress = course.advance(point, factor, outward)
        spent = {"evaluate": evaluator.seconds - evaluated, "linear": journal.linear - linear}
        journal.add(replace(row, theta=theta, step=length, **spent))
        idle = 0 if progress else idle + 1
        theta = min(1.0, GROW * theta)


def _convexified(course: Course, point: Point, theta: float, blend: bool) -> tuple[AnyFactor, float, bool]:
    """The factor of a matrix that is positive definite along the conditions, its θ, and whether θ fell back to it."""
    falls = blend and theta > LEAST
    factor = None
    if falls:
        theta = LEAST
        point.matrix = course.matrix(theta)
        factor = course.journal.timed(course.system.factorise, point.matrix)
    if factor is None:
        factor = course.shifted(point.matrix)
    return factor, theta, falls


def downhill(direction: np.ndarray, gradient: np.ndarray, x: np.ndarray, unit: np.ndarray) -> np.ndarray:
    """A direction of negative curvature, turned downhill and a tenth of the size of x long, in own units."""
    size = 0.1 * max(1.0, largest(x / unit)) / largest(direction / unit)
    return (-size if gradient @ direction > 0 else size) * direction
