"""The classical way: interpolation conditions eliminated, damped Newton on what is left (HJK 4.3, 4.4)."""

from dataclasses import dataclass
from time import perf_counter
from typing import Any, Literal

import numpy as np
from scipy.linalg import LinAlgError, solve_banded

from symmotion.errors import InputError
from symmotion.program import Evaluator, Program
from symmotion.solvers.solution import Iteration, Seconds, Solution, Status, conclude, require_equalities, start_vector
from symmotion.systems import Condensed, gradient_scale

BLOW_UP = 1e12  # growth of the objective that counts as divergence


@dataclass(frozen=True)
class Elimination:
    """Newton on the free controls with a fixed damping factor and no globalisation, as HJK publish it.

    The conditions are solved for one control each, which is substituted. The Hessian is exact
    and need not be positive definite, so the iteration may end at a saddle or diverge.

    damping: HJK's λ, 0 < λ ≤ 1. stages: "degree" (raised one by one) or "knots" (inserted
    gradually), each stage starting from the optimum of the one before; None for all at once.
    tolerance: on stationarity relative to `gradient_scale`.
    """

    tolerance: float = 1e-8
    max_iterations: int = 200
    damping: float = 1.0
    stages: Literal["degree", "knots"] | None = None

    def __post_init__(self):
        if not 0 < self.damping <= 1:
            raise InputError(f"damping {self.damping!r}: must be in (0, 1]")
        if self.stages not in (None, "degree", "knots"):
            raise InputError(f"stages {self.stages!r} are unknown; there are degree, knots")

    def solve(self, program: Program, start: Any = None) -> Solution:
        """Solve a program with interpolation conditions; start: None, a Solution, a motion, or (unknowns,) numbers.

        With stages the start is the first stage's own, and the log holds all stages.
        """
        require_equalities(program, "Elimination")
        began = perf_counter()
        if self.stages and start is not None:
            raise InputError("a staged elimination starts from the program's own spline: leave out start")
        stages = [program] if self.stages is None else [*program.stages(self.stages), program]
        log: list[Iteration] = []
        x, multipliers = program.x0, np.zeros(program.conditions)
        compiled = solved = evaluated = linear = 0.0
        failure, motion = None, None
        for stage in stages:
            x = start_vector(stage, start if motion is None else motion)
            evaluator, system = Evaluator(stage), _system(stage)
            evaluator.prepare("hessian")
            compiled += perf_counter() - began
            began = perf_counter()
            evaluator.seconds = 0.0
            x = system.feasible(x, evaluator.violation(x))
            x, multipliers, seconds, failure = self._iterate(x, evaluator, system, log)
            evaluated, linear = evaluated + evaluator.seconds, linear + seconds
            solved += perf_counter() - began
            began = perf_counter()
            if failure:
                break
            motion = stage.design.motion(stage.unpack(x))
        if len(x) != program.unknowns:  # an early stage failed: the certificate is that of the start
            x, multipliers = program.x0, np.zeros(program.conditions)
        seconds = Seconds(program.build_seconds, compiled, solved, evaluated, linear)
        method = "elimination-staged" if self.stages else "elimination"
        return conclude(program, self, method, x, multipliers, log, seconds, failure)

    def _iterate(
        self, x: np.ndarray, evaluator: Evaluator, system: Condensed, log: list[Iteration]
    ) -> tuple[np.ndarray, np.ndarray, float, tuple[Status, str] | None]:
        """Newton from x: where it ended, the multipliers there, seconds of linear algebra, and what went wrong."""
        linear, first, count = 0.0, evaluator.objective(x), 0
        while True:
            objective = evaluator.objective(x)
            gradient, matrix = evaluator.second_order(x, system.pattern)
            multipliers = system.multipliers(gradient)
            stationarity = float(np.abs(system.reduced(gradient)).max(initial=0.0))
            row = Iteration(objective, stationarity, float(np.abs(evaluator.violation(x)).max(initial=0.0)))
            if not np.isfinite(objective) or objective > BLOW_UP * max(first, 1.0):
                log.append(row)
                return x, multipliers, linear, (Status.DIVERGED, f"the objective grew to {objective:.2g}")
            if stationarity <= self.tolerance * gradient_scale(gradient, matrix[system.diagonal], x):
                log.append(row)
                return x, multipliers, linear, None
            if count == self.max_iterations:
                log.append(row)
                return x, multipliers, linear, (Status.ITERATION_LIMIT, f"{count} iterations")
            began = perf_counter()
            try:
                step = system.expand(_solve_symmetric(system.lower_bands(matrix), -system.reduced(gradient)))
            except LinAlgError:
                log.append(row)
                return x, multipliers, linear, (Status.FAILED, "the reduced Hessian is singular")
            linear += perf_counter() - began
            log.append(Iteration(objective, stationarity, row.violation, theta=1.0, step=self.damping))
            x, count = x + self.damping * step, count + 1


def _system(program: Program) -> Condensed:
    system = Condensed.of(program)
    if system is None:
        raise InputError(
            "Elimination needs a control for every keyframe that no other keyframe reads: insert more knots per segment"
        )
    return system


def _solve_symmetric(lower: np.ndarray, rhs: np.ndarray) -> np.ndarray:
    """Solve a symmetric system given by its lower bands (band + 1, n), positive definite or not."""
    band, n = lower.shape[0] - 1, lower.shape[1]
    full = np.zeros((2 * band + 1, n))
    full[band:] = lower
    for k in range(1, min(band, n - 1) + 1):
        full[band - k, k:] = lower[k, : n - k]
    return solve_banded((band, band), full, rhs)
