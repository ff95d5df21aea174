"""Newton's method on (x, λ) with the exact Hessian, made to descend."""

from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np

from symmotion.checks import choice, whole
from symmotion.errors import InputError
from symmotion.kernels import Kernels, expect, is_compilable
from symmotion.program import Bounded, DesignT, Evaluator, Program
from symmotion.solvers.continuing import Continued
from symmotion.solvers.descent import LEAST, Enough, Point, descend
from symmotion.solvers.exchanging import exchange
from symmotion.solvers.feasibility import find_feasible
from symmotion.solvers.frame import Frame
from symmotion.solvers.interior import Interior
from symmotion.solvers.journal import Callback, Failure, Journal
from symmotion.solvers.options import require_kernels, require_limits
from symmotion.solvers.solution import Iteration, Solution, Status
from symmotion.solvers.solver import conclude, solving, start_multipliers, start_vector
from symmotion.solvers.sqp import Curved
from symmotion.solvers.ways import large_turns, turned
from symmotion.systems import (
    AnyFactor,
    AnySystem,
    Condensed,
    Saddle,
    certify,
    conflict,
    conflicting,
    largest,
    shifted,
    system_of,
    tenfold,
)

# A Gauss–Newton matrix may be only semidefinite (motions that stay rigid to first order cost nothing):
# the first multiple of the identity tried then, relative to the diagonal.
RIDGE = 1e-10
# The second descent's first multiple of the identity, relative to the diagonal, as IPOPT's.
FIRST_SHIFT = 1e-4
MOST_SHIFT = 1e6  # relative to the diagonal
# A relative decrease that cannot be told from rounding.
ROUNDING = 1e-15
# By how much bounds are widened where they may have no inside, see `Interior`.
WIDER = 1e-9
# Slopes of f along the Newton step, relative to f, below which a line search follows rounding.
LOCAL = 1e-12
# A descent leads to a higher minimum where FAR decrements do not take it below the known one at TWICE looks in a row,
# after EARLY ones; a lower minimum is lower by LOWER, relative.
FAR, TWICE, EARLY, LOWER = 5.0, 2, 3, 1e-6


@dataclass(frozen=True)
class ExactNewton:
    """Newton on (x, λ) with exact Hessian, θ-blend convexification and exact line search.

    Each step solves the saddle system of M = H_GN + θ (H − H_GN), a blend of Gauss–Newton and
    exact Hessian that is positive definite along the conditions; at the end θ = 1 and
    convergence is quadratic. Terms that are no sums of squares get a multiple of the identity
    instead. Along the step the objective is a quartic for all residuals up to quadratic,
    minimised exactly. Iterates stay feasible, and the objective is the merit
    function. A stationary point that is no minimum is left along negative curvature.

    Where θ had to fall back on the way, several minima compete, and a second descent from the
    same start, with the exact Hessian plus a multiple of the identity and steps as long as they
    descend, often ends elsewhere: the lower minimum of the two is returned, and the log holds
    the other descent before its own.
    Where neighbouring keyframes are turned by more than 120° (`solvers.ways`), others begin at that minimum with such a
    segment turning rigidly the other way round, the largest turns first, and are given up once decrements say that they
    lead to a higher one. Neither from a start of the caller's own.

    Nonlinear equalities are linearised at every iterate (SQP, see `sqp.Curved`): M is the blend
    with the Hessian of the Lagrangian, and the merit function is f + μ ‖g‖₁.

    tolerance: of the certificate, see `Certificate.holds`. max_iterations: of a descent.
    steps: "twice", as said. To compare with: "blend", the first descent alone; "shifted", the second alone, along
        linear equalities; "gauss-newton", θ = 0 until that has converged.
    system: "condensed" (banded, where the conditions decouple), "sparse" (SuperLU, any
        equalities), or "auto", by the program's structure.
    kernels: "compiled" by the machine's C compiler, which takes most objectives less than a second,
        once for a machine (study `kernels`); "interpreted" by CasADi; "auto": compiled where that was done before.
        For long programs, and from the second of a series of solves on, each started from the one before, the compiler
        works beside the solve, which goes on with what it has made as soon as it is there. threads: that a long
        program may use, as many as processors, four at most, when left out. Neither changes a bit of the result.
    time_limit: wall-clock seconds for a solve, looked at before every step; None for no limit.
    callback: called with every `Iteration` of the log; where it returns True the solve stops.
    ways: segments that are tried the other way round; 0 for the program's own start alone, as `compare` has it.

    Raises InputError for options out of range, and for what a system cannot take.

    >>> solution = sm.ExactNewton(tolerance=1e-10).solve(sm.affine_program(sm.examples.planar_keyframes()))
    >>> solution.status.value, solution.inertia
    ('solved', 'positive')
    """

    tolerance: float = 1e-8
    max_iterations: int = 200
    system: Literal["auto", "condensed", "sparse"] = "auto"
    kernels: Kernels = "auto"
    threads: int | None = None
    time_limit: float | None = None
    callback: Callback | None = field(default=None, repr=False, compare=False)
    steps: Literal["twice", "blend", "shifted", "gauss-newton"] = "twice"
    ways: int = 3

    def __post_init__(self):
        require_limits(self.tolerance, self.max_iterations, self.time_limit, self.callback)
        choice(self.steps, ("twice", "blend", "shifted", "gauss-newton"), "steps")
        object.__setattr__(self, "ways", whole(self.ways, 0, "ways"))
        choice(self.system, ("auto", "condensed", "sparse"), "system")
        require_kernels(self.kernels, self.threads)

    @solving
    def solve(self, program: Program[DesignT], start: object = None) -> Solution[DesignT]:
        """Solve a program; start: None, a Solution, a motion, or (unknowns,) numbers.

        Bounds that are meant for all times hold at all: see `exchange`.
        """
        every = Journal(self.max_iterations)
        series = self.kernels == "auto" and isinstance(start, Solution)
        # One of a series, such as the edits of a keyframe: the compiler is repaid if it takes most of the work.
        repaid = series and all(is_compilable(b.kernel, "hessian") for b in program.terms)
        for b in program.terms if repaid else ():
            expect(b.kernel)
        return exchange(program, lambda p, s: self._at_times(p, s, every.elapsed), start)

    def _at_times(self, program: Program[DesignT], start: object, spent: float = 0.0) -> Solution[DesignT]:
        """The solution of a program with its bounds held at the times that it has; spent: seconds before."""
        journal = Journal(self.max_iterations, self.time_limit, self.callback, spent)
        x = start_vector(program, start)
        evaluator = Evaluator(program, self.kernels, self.threads)
        along = self._bounded if not program.equalities_only else self._straight if program.linear else self._curved
        if self.steps == "shifted" and along != self._straight:
            raise InputError('steps="shifted" goes along linear equalities only, which this program has not alone')
        if isinstance(start, Solution) and along == self._straight:
            x, multipliers = self._continued(evaluator, x, start, journal)
            if multipliers is not None:
                found = self._concluded(evaluator, x, multipliers, None, journal)
                if found.status is Status.SOLVED and found.inertia == "positive":
                    return found
        x, multipliers, failure = along(evaluator, x, start, journal)
        return self._concluded(evaluator, x, multipliers, failure, journal)

    def _concluded(
        self, evaluator: Evaluator, x: np.ndarray, multipliers: np.ndarray, failure: Failure | None, journal: Journal
    ) -> Solution:
        journal.solved()
        program = evaluator.program
        return conclude(
            program,
            self,
            x,
            multipliers,
            method="newton-sparse" if self.system == "sparse" and program.linear else "newton",
            log=journal.log,
            seconds=journal.seconds(program, evaluator.seconds),
            failure=failure,
            evaluator=evaluator,
        )

    def _continued(
        self, evaluator: Evaluator, x: np.ndarray, start: Solution, journal: Journal
    ) -> tuple[np.ndarray, np.ndarray | None]:
        """Where a minimum moves to, from x, by the factor kept there, and the multipliers where that is the end."""
        system = self._system(evaluator, x)
        x = system.feasible(x, evaluator.violation(x))
        carried = Continued(evaluator, system, start, x, self.tolerance, journal)
        return carried.x, carried.multipliers

    def _straight(
        self, evaluator: Evaluator, x: np.ndarray, start: object, journal: Journal
    ) -> tuple[np.ndarray, np.ndarray, Failure | None]:
        """Where the lower of one or two descents along linear conditions ended, the multipliers, and what failed."""
        evaluator.prepare("value", "gradient", "hessian", "line")
        system = self._system(evaluator, x)
        journal.compiled()
        evaluator.seconds = 0.0
        if (failure := _contradicted(evaluator, system, x)) is not None:
            return x, np.zeros(evaluator.program.conditions), failure
        x = system.feasible(x, evaluator.violation(x))
        first = Straight(self.tolerance, evaluator, system, journal, x, blend=self.steps != "shifted")
        # A start of the caller's own is taken for close to the minimum, where the exact Hessian serves.
        failure, fell_back = descend(first, self._theta(LEAST if start is None else 1.0))
        if start is not None or self.steps != "twice":
            return first.x, first.multipliers, failure
        best, before = (first, failure), []
        if fell_back and not journal.stopped:
            log, journal.log = journal.log, []
            second = Straight(self.tolerance, evaluator, system, journal, x, blend=False)
            other, _ = descend(second, 1.0)
            if (other is not None, journal.log[-1].objective) < (failure is not None, log[-1].objective):
                best, before = (second, other), log
            else:
                journal.log, before = log, journal.log
        best, before = self._ways(best, before)
        journal.log = before + journal.log
        course, failure = best
        return course.x, course.multipliers, journal.ending() if journal.stopped else failure

    def _ways(
        self, best: "tuple[Straight, Failure | None]", before: list[Iteration]
    ) -> "tuple[tuple[Straight, Failure | None], list[Iteration]]":
        """The lowest of a descent and of those with a large turn the other way round, and the rows of all others.

        The journal has the rows of the lowest.
        """
        first = best[0]
        evaluator, system, journal = first.evaluator, first.system, first.journal
        for segment in large_turns(evaluator.program, self.ways if best[1] is None else 0):
            if journal.stopped:
                break
            known, log = best[0], journal.log
            journal.log = []
            x = turned(evaluator.program, known.x, segment)
            x = system.feasible(x, evaluator.violation(x))
            course = Straight(self.tolerance, evaluator, system, journal, x, blend=False, most=known.objective)
            failure, _ = descend(course, 1.0)
            journal.vain = None
            if failure is None and course.objective < known.objective - LOWER * abs(known.objective):
                best, before = (course, failure), before + log
            else:
                journal.log, before = log, before + journal.log
        return best, before

    def _curved(
        self, evaluator: Evaluator, x: np.ndarray, start: object, journal: Journal
    ) -> tuple[np.ndarray, np.ndarray, Failure | None]:
        """Where the descent along nonlinear conditions ended, the multipliers there, and what failed."""
        if self.system == "condensed":
            raise InputError('the conditions of this program are nonlinear: use system="sparse"')
        evaluator.prepare("value", "gradient", "hessian")
        saddle = Saddle(evaluator.program, evaluator.jacobian(x))
        journal.compiled()
        evaluator.seconds = 0.0
        if (failure := _contradicted(evaluator, saddle, x)) is not None:
            return x, np.zeros(evaluator.program.conditions), failure
        multipliers = start_multipliers(evaluator.program, start)
        if multipliers is None:
            multipliers = saddle.multipliers(evaluator.gradient(x))
        course = Curved(self.tolerance, evaluator, saddle, journal, x, multipliers)
        failure, _ = descend(course, self._theta(1.0))
        return course.x, course.multipliers, failure

    def _bounded(
        self, evaluator: Evaluator, x: np.ndarray, start: object, journal: Journal
    ) -> tuple[np.ndarray, np.ndarray, Failure | None]:
        """Where the descent between bounds ended, the multipliers there, and what failed."""
        bounded = Bounded(evaluator.program, evaluator.kernels, self.threads)
        frame = Frame(bounded, journal, x, self.system)
        frame.evaluator.prepare("value", "gradient", "hessian")
        journal.compiled()
        x = frame.feasible(x)
        course = Interior(self.tolerance, frame, x)
        known = start_multipliers(evaluator.program, start)
        continued = known is not None and course.continues(known)
        failure = None if continued else descend(course, self._theta(LEAST if start is None else 1.0))[0]
        evaluator.seconds, evaluator.counts = bounded.seconds, bounded.counts
        if failure is not None and not journal.stopped and frame.missed(course.x) > self.tolerance:
            found = find_feasible(frame, x)
            if found.conflict:
                failure = Status.INFEASIBLE, conflict(evaluator.program, found.conflict, found.proven)
                return found.x, np.zeros(evaluator.program.conditions), failure
            if found.feasible:
                x, course = found.x, Interior(self.tolerance, frame, found.x)
                failure, _ = descend(course, self._theta(LEAST))
        if not journal.stopped and (failure is not None or not self._granted(evaluator, course)):
            # Bounds that only meet, such as those of complementary places, have no inside for a barrier.
            wide = Interior(self.tolerance, frame, x, wider=min(WIDER, 0.1 * self.tolerance), follows=True)
            if descend(wide, self._theta(LEAST))[0] is None and (failure or self._granted(evaluator, wide)):
                course, failure = wide, None
        evaluator.seconds, evaluator.counts = bounded.seconds, bounded.counts
        return course.x, course.multipliers, failure

    def _granted(self, evaluator: Evaluator, course: Interior) -> bool:
        """Whether a course has ended at a minimum: on held bounds, or by the barrier where the certificate agrees.

        Beside bounds whose distance vanishes whatever the barrier is, its steps are rounding.
        """
        if course.over:
            return True
        return not certify(evaluator.program, course.x, course.multipliers, evaluator).wanting(self.tolerance)

    def _theta(self, usual: float) -> float:
        """The share of the exact Hessian in the first matrix."""
        return {"gauss-newton": 0.0, "shifted": 1.0}.get(self.steps, usual)

    def _system(self, evaluator: Evaluator, x: np.ndarray) -> AnySystem:
        program = evaluator.program
        if self.system == "auto":
            return system_of(program, evaluator, x)
        if self.system == "sparse":
            return Saddle.of(program, lambda: evaluator.jacobian(x))
        condensed = Condensed.of(program)
        if condensed is None:
            raise InputError('the conditions of this program do not decouple: use system="sparse" or insert more knots')
        return condensed


def _contradicted(evaluator: Evaluator, system: AnySystem, x: np.ndarray) -> Failure | None:
    """What is wrong where conditions depend on each other at x and cannot hold together."""
    if isinstance(system, Saddle) and not system.independent and conflicting(evaluator.program, x, evaluator):
        return Status.FAILED, "the saddle system is singular"
    return None


class Straight:
    """The course of a descent along linear conditions, from a point x where they hold.

    blend: by θ and exact line searches, or else by multiples of the identity and steps as long as they descend.
    most: the descent ends where it leads to higher values.
    """

    strange = "the objective or a derivative is not finite"
    idle = "steps no longer lower the objective"
    corrects = over = False

    def __init__(
        self,
        tolerance: float,
        evaluator: Evaluator,
        system: AnySystem,
        journal: Journal,
        x: np.ndarray,
        blend: bool,
        most: float = np.inf,
    ):
        self.evaluator, self.system, self.journal, self.blend = evaluator, system, journal, blend
        self.x, self.multipliers = x, np.empty(0)
        self._enough, self._shift = Enough(tolerance, evaluator), FIRST_SHIFT
        self.objective, self._most, self._looks, self._above = evaluator.objective(x), most, 0, 0
        # Steps along linear conditions leave it as it is up to rounding, which the certificate tells.
        self._violation = largest(evaluator.violation(x))

    def look(self, theta: float) -> Point:
        gradient, matrix = self.evaluator.second_order(self.x, self.system.pattern, theta=theta)
        self.multipliers = self.system.multipliers(gradient)
        finite = bool(np.isfinite(self.objective) and np.isfinite(matrix).all())
        row = Iteration(self.objective, largest(self.system.reduced(gradient)), self._violation)
        return Point(row, gradient, matrix, finite)

    def matrix(self, theta: float) -> np.ndarray:
        return self.evaluator.second_order(self.x, self.system.pattern, theta=theta)[1]

    def shifted(self, matrix: np.ndarray) -> AnyFactor:
        squares = all(b.kernel.squares for b in self.evaluator.program.terms)
        # The second descent remembers what it needed last.
        first = self._shift if not self.blend else RIDGE if squares else LEAST
        # A matrix that no multiple of the identity of this size mends is singular in its conditions.
        factor, shift = shifted(
            self.system,
            matrix,
            self.evaluator.program.unit,
            tenfold(first, most=MOST_SHIFT),
            factorise=lambda m: self.journal.timed(self.system.factorise, m),
        )
        self._shift = max(shift / 3, RIDGE)
        return factor

    def settled(self, point: Point, factor: AnyFactor) -> bool:
        point.step = self.journal.timed(self.system.step, factor, point.gradient)
        slope = float(point.gradient @ point.step)
        if isinstance(self.system, Saddle):
            # By rounding the step leaves the conditions, across which the gradient is as large as the multipliers.
            slope += float(self.multipliers @ (self.system.jacobian @ point.step))
        self._tell(-0.5 * slope)
        return self._enough(-0.5 * slope, self.objective, self.x)

    def _tell(self, decrement: float) -> None:
        """Tell the journal where the descent leads to more than `most`, as far as decrements tell."""
        above = self.objective - FAR * max(decrement, 0.0) > self._most
        self._looks, self._above = self._looks + 1, self._above + 1 if above else 0
        if self._above >= TWICE and self._looks > EARLY:
            self.journal.vain = Status.STALLED, "the descent leads to a higher minimum"

    def outward(self, point: Point) -> np.ndarray | None:
        return self.journal.timed(self.system.curvature, self.matrix(1.0)).direction

    def advance(self, point: Point, factor: AnyFactor, outward: np.ndarray | None) -> tuple[float, bool]:
        step = point.step if outward is None else outward
        before, slope = self.objective, float(point.gradient @ step)
        if outward is None and -slope <= LOCAL * abs(before):
            length, self.objective = 1.0, self.evaluator.objective(self.x + step)
        else:
            length, self.objective = self._length(step, slope, exact=self.blend or outward is not None)
        self.x = self.x + length * step
        # Less than the rounding of the objective is no progress either.
        return length, self.objective < before - ROUNDING * abs(before)

    def rest(self, point: Point, factor: AnyFactor) -> None:
        """One more step from a minimum: the factor is there, and it squares the error for one gradient."""
        step = self._last(point, factor)
        if step is None:
            return
        x = self.x + step
        gradient = self.evaluator.gradient(x)
        better = largest(self.system.reduced(gradient))
        if better < point.row.stationarity:
            self.x, self.multipliers = x, self.system.multipliers(gradient)
            row = self.journal.log.pop()
            self.journal.log.append(replace(row, theta=1.0, step=1.0))
            objective = self.evaluator.objective(x)
            self.journal.add(replace(row, objective=objective, stationarity=better, inertia="positive"))

    def _last(self, point: Point, factor: AnyFactor) -> np.ndarray | None:
        """The step of the exact Hessian, None where it is not positive definite along the conditions."""
        system, timed = self.system, self.journal.timed
        if factor is not None:
            return timed(system.step, factor, point.gradient)
        # What is factorised for the steps does not pivot, and may fail where the matrix is regular.
        hessian = self.matrix(1.0)
        if isinstance(system, Saddle) and timed(system.curvature, hessian).inertia == "positive":
            return timed(system.pivoted_step, hessian, point.gradient)
        return None

    def _length(self, step: np.ndarray, slope: float, exact: bool) -> tuple[float, float]:
        """The length of a step and the objective there: the first minimum with `exact`, else the first of 1, ½, ¼, …"""
        quartic, objective = self.evaluator.line(self.x, step), self.objective
        if quartic is not None and exact:
            length = first_minimum(quartic)
            return length, float(np.polyval(quartic[::-1], length))
        length = 1.0
        while True:
            if quartic is None:
                value = self.evaluator.objective(self.x + length * step)
            else:
                value = float(np.polyval(quartic[::-1], length))
            # The last terms allow for rounding where the decrease is below it.
            if value <= objective + 1e-4 * length * min(slope, 0.0) + ROUNDING * abs(objective) or length < 1e-12:
                return length, value
            length *= 0.5


def first_minimum(quartic: np.ndarray) -> float:
    """The first α > 0 where the slope of c₀ + c₁α + … + c₄α⁴ vanishes; 1 where there is none."""
    # Plain numbers: for three eigenvalues of a companion matrix NumPy's overhead is most of the work.
    slope = [k * c for k, c in enumerate(quartic.tolist())][1:]
    while slope and not slope[-1]:
        slope.pop()
    if len(slope) < 2:
        return 1.0
    companion = np.eye(len(slope) - 1, k=-1)
    companion[0] = [-c / slope[-1] for c in slope[-2::-1]]
    if not np.isfinite(companion).all():
        return 1.0
    roots = np.linalg.eigvals(companion).tolist()
    return min((r.real for r in roots if r.real > 0 and abs(r.imag) <= 1e-9 * max(1.0, abs(r.real))), default=1.0)
