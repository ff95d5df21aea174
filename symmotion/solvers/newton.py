"""Newton's method on (x, λ) with the exact Hessian, made to descend."""

from dataclasses import dataclass, replace
from time import perf_counter
from typing import Any, Literal

import numpy as np

from symmotion.errors import InputError
from symmotion.kernels import Kernels
from symmotion.program import Evaluator, Program
from symmotion.solvers.solution import Iteration, Seconds, Solution, Status, conclude, require_equalities, start_vector
from symmotion.solvers.sqp import GROW, LEAST, CurvedRun, multipliers_of
from symmotion.systems import Condensed, Saddle, gradient_scale, system_of

# A Gauss–Newton matrix may be only semidefinite (motions that stay rigid to first order cost nothing):
# the first multiple of the identity tried then, relative to the diagonal.
RIDGE = 1e-10
# The second descent's first multiple of the identity, relative to the diagonal, as IPOPT's.
FIRST_SHIFT = 1e-4
# A relative decrease that cannot be told from rounding.
ROUNDING = 1e-15


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
    the other descent before its own. Not so from a start of the caller's own.

    Nonlinear equalities are linearised at every iterate (SQP, see `sqp.CurvedRun`): M is the blend
    with the Hessian of the Lagrangian, and the merit function is f + μ ‖g‖₁.

    tolerance: on stationarity relative to `gradient_scale`. max_iterations: of a descent.
    system: "condensed" (banded, where the conditions decouple), "sparse" (LDLᵀ, any
        equalities), or "auto", by the program's structure.
    kernels: "compiled" by the machine's C compiler, which takes most objectives less than a second,
        once for a machine (study `kernels`); "interpreted" by CasADi; "auto": compiled where that was done before,
        for long programs, and from the second of a series of solves on, each started from the one
        before. threads: that a long program may use, as many as processors, four at most, when left
        out. Neither changes a bit of the result.
    """

    tolerance: float = 1e-8
    max_iterations: int = 200
    system: Literal["auto", "condensed", "sparse"] = "auto"
    kernels: Kernels = "auto"
    threads: int | None = None

    def solve(self, program: Program, start: Any = None) -> Solution:
        """Solve a program with equalities; start: None, a Solution, a motion, or (unknowns,) numbers."""
        require_equalities(program, "ExactNewton", curved=True)
        began = perf_counter()
        x = start_vector(program, start)
        if not program.linear:
            return self._solve_curved(program, x, start, began)
        evaluator = self._evaluator(program, start)
        evaluator.prepare("value", "gradient", "hessian", "line")
        system = self._system(program, evaluator, x)
        compiled = perf_counter()
        evaluator.seconds = 0.0
        x = system.feasible(x, evaluator.violation(x))
        run = _Run(self, evaluator, system)
        # A start of the caller's own is taken for close to the minimum, where the exact Hessian serves.
        failure = run.iterate(x, LEAST if start is None else 1.0)
        linear, log = run.linear, run.log
        if start is None and run.fell_back:
            other = _Run(self, evaluator, system, blend=False)
            other_failure = other.iterate(x, 1.0)
            linear, log = linear + other.linear, other.log + run.log
            if other_failure is None and (failure is not None or other.log[-1].objective < run.log[-1].objective):
                run, failure, log = other, other_failure, run.log + other.log
        seconds = Seconds(program.build_seconds, compiled - began, perf_counter() - compiled, evaluator.seconds, linear)
        method = "newton-sparse" if self.system == "sparse" else "newton"
        return conclude(program, self, method, run.x, run.multipliers, log, seconds, failure, evaluator)

    def _solve_curved(self, program: Program, x: np.ndarray, start: Any, began: float) -> Solution:
        if self.system == "condensed":
            raise InputError('the conditions of this program are nonlinear: use system="sparse"')
        evaluator = self._evaluator(program, start)
        evaluator.prepare("value", "gradient", "hessian")
        saddle = Saddle(program, evaluator.jacobian(x))
        compiled = perf_counter()
        evaluator.seconds = 0.0
        multipliers = multipliers_of(start, program)
        if multipliers is None:
            multipliers = saddle.multipliers(evaluator.gradient(x))
        run = CurvedRun(self.tolerance, self.max_iterations, evaluator, saddle)
        failure = run.iterate(x, multipliers)
        seconds = Seconds(
            program.build_seconds, compiled - began, perf_counter() - compiled, evaluator.seconds, run.linear
        )
        return conclude(program, self, "newton", run.x, run.multipliers, run.log, seconds, failure, evaluator)

    def _evaluator(self, program: Program, start: Any) -> Evaluator:
        # One of a series, such as the edits of a keyframe: the compiler is repaid.
        repeated = self.kernels == "auto" and isinstance(start, Solution)
        return Evaluator(program, "compiled" if repeated else self.kernels, self.threads)

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
    """The state of one descent; blend: by θ and exact line searches, or else by multiples of the identity."""

    def __init__(self, options: ExactNewton, evaluator: Evaluator, system: Condensed | Saddle, blend: bool = True):
        self.options, self.evaluator, self.system, self.blend = options, evaluator, system, blend
        self.shift, self.fell_back = FIRST_SHIFT, False
        self.x = self.multipliers = np.empty(0)
        self.log: list[Iteration] = []
        self.linear = 0.0

    def iterate(self, x: np.ndarray, theta: float) -> tuple[Status, str] | None:
        evaluator, system, options = self.evaluator, self.system, self.options
        objective, idle = evaluator.objective(x), 0
        # Steps along linear conditions leave it as it is up to rounding, which the certificate tells.
        violation = float(np.abs(evaluator.violation(x)).max(initial=0.0))
        while True:
            evaluated, solved = evaluator.seconds, self.linear
            gradient, matrix = evaluator.second_order(x, system.pattern, theta=theta)
            self.x, self.multipliers = x, system.multipliers(gradient)
            stationarity = float(np.abs(system.reduced(gradient)).max(initial=0.0))
            row = Iteration(objective, stationarity, violation)
            if not np.isfinite(objective) or not np.isfinite(matrix).all():
                self.log.append(row)
                return Status.DIVERGED, "the objective or a derivative is not finite"
            converged = stationarity <= options.tolerance * gradient_scale(gradient, matrix[system.diagonal], x)
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
                if factor is None and self.blend and theta > LEAST:
                    theta, self.fell_back = LEAST, True
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
            length, value = self._length(x, step, objective, float(gradient @ step), exact=self.blend or converged)
            seconds = {"evaluate": evaluator.seconds - evaluated, "linear": self.linear - solved}
            self.log.append(replace(row, theta=theta, step=length, inertia=inertia, **seconds))
            x = x + length * step
            # Less than the rounding of the objective is no progress either.
            idle = idle + 1 if value >= objective - ROUNDING * abs(objective) else 0
            objective, theta = value, min(1.0, GROW * theta)

    def _polish(self, x: np.ndarray, step: np.ndarray, stationarity: float) -> None:
        """One more step from a converged point: the factor is there, and it squares the error for one gradient."""
        evaluator, system = self.evaluator, self.system
        x = x + step
        gradient = evaluator.gradient(x)
        better = float(np.abs(system.reduced(gradient)).max(initial=0.0))
        if better < stationarity:
            self.x, self.multipliers = x, system.multipliers(gradient)
            row = self.log[-1]
            self.log[-1] = replace(row, theta=1.0, step=1.0)
            self.log.append(replace(row, objective=evaluator.objective(x), stationarity=better, inertia="positive"))

    def _timed(self, function: Any, *arguments: Any) -> Any:
        began = perf_counter()
        result = function(*arguments)
        self.linear += perf_counter() - began
        return result

    def _shifted(self, matrix: np.ndarray) -> Any:
        """The factor of the matrix plus the least multiple of the identity that makes it positive definite."""
        diagonal = self.system.diagonal
        squares = all(b.kernel.squares for b in self.evaluator.program.terms)
        scale = np.abs(matrix[diagonal]).max(initial=0.0) or 1.0
        # The second descent remembers what it needed last.
        shift = self.shift if not self.blend else RIDGE if squares else LEAST
        while True:
            matrix[diagonal] += shift * scale
            factor = self.system.factorise(matrix)
            if factor is not None:
                self.shift = max(shift / 3, RIDGE)
                return factor
            shift *= 10

    def _length(
        self, x: np.ndarray, step: np.ndarray, objective: float, slope: float, exact: bool
    ) -> tuple[float, float]:
        """The length of a step and the objective there: the first minimum with `exact`, else the first of 1, ½, ¼, …"""
        quartic = self.evaluator.line(x, step)
        if quartic is not None and exact:
            length = first_minimum(quartic)
            return length, float(np.polyval(quartic[::-1], length))
        length = 1.0
        while True:
            if quartic is None:
                value = self.evaluator.objective(x + length * step)
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
