"""The classical way: interpolation conditions eliminated, damped Newton on what is left (HJK 4.3, 4.4)."""

from collections import Counter
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np
from scipy.linalg import LinAlgError, solve_banded

from symmotion.checks import choice, positive
from symmotion.errors import InputError
from symmotion.program import DesignT, Evaluator, Program
from symmotion.program.block import EPS
from symmotion.solvers.descent import Enough
from symmotion.solvers.journal import Callback, Failure, Journal
from symmotion.solvers.options import require_limits
from symmotion.solvers.solution import Iteration, Solution, Status
from symmotion.solvers.solver import conclude, require_equalities, solving, start_vector
from symmotion.systems import Condensed, conflict, conflicting, largest

BLOW_UP = 1e12  # growth of the objective that counts as divergence


@dataclass(frozen=True)
class Elimination:
    """Newton on the free controls with a fixed damping factor and no globalisation, as HJK publish it.

    The conditions are solved for one control each, which is substituted. The Hessian is exact
    and need not be positive definite, so the iteration may end at a saddle or diverge.

    damping: HJK's λ, 0 < λ ≤ 1. stages: "degree" (raised one by one) or "knots" (inserted
    gradually), each stage starting from the optimum of the one before; None for all at once.
    tolerance: of the certificate, see `Certificate.holds`. max_iterations: of a stage.
    time_limit, callback: as ExactNewton's.

    Raises InputError for programs with other than linear equalities, by the constraint's name.

    >>> sm.Elimination(damping=0.8).solve(sm.affine_program(sm.examples.planar_keyframes())).require().method
    'elimination'
    """

    tolerance: float = 1e-8
    max_iterations: int = 200
    damping: float = 1.0
    stages: Literal["degree", "knots"] | None = None
    time_limit: float | None = None
    callback: Callback | None = field(default=None, repr=False, compare=False)

    def __post_init__(self):
        require_limits(self.tolerance, self.max_iterations, self.time_limit, self.callback)
        if not positive(self.damping, "damping") <= 1:
            raise InputError(f"damping {self.damping!r}: must be in (0, 1]")
        if self.stages is not None:
            choice(self.stages, ("degree", "knots"), "stages")

    @solving
    def solve(self, program: Program[DesignT], start: object = None) -> Solution[DesignT]:
        """Solve a program with interpolation conditions; start: None, a Solution, a motion, or (unknowns,) numbers.

        With stages the start is the first stage's own, and the log holds all stages.
        """
        require_equalities(program, "Elimination")
        journal = Journal(self.max_iterations, self.time_limit, self.callback)
        if self.stages and start is not None:
            raise InputError("a staged elimination starts from the program's own spline: leave out start")
        stages = [program] if self.stages is None else [*program.stages(self.stages), program]
        log: list[Iteration] = []
        x, multipliers = program.x0, np.zeros(program.conditions)
        evaluated, failure, counts = 0.0, None, Counter[str]()
        for stage in stages:
            x = start_vector(stage, start)
            evaluator, system = Evaluator(stage), _system(stage)
            evaluator.prepare("hessian")
            journal.compiled()
            evaluator.seconds = 0.0
            x = system.feasible(x, evaluator.violation(x))
            x, multipliers, failure = self._descend(x, evaluator, system, journal)
            log, journal.log = log + journal.log, []
            evaluated += evaluator.seconds
            counts += evaluator.counts
            journal.solved()
            if failure:
                break
            start = stage.design.motion(stage.unpack(x))
        if len(x) != program.unknowns:  # an early stage failed: the certificate is that of the start
            x, multipliers = program.x0, np.zeros(program.conditions)
        solution = conclude(
            program,
            self,
            x,
            multipliers,
            method="elimination-staged" if self.stages else "elimination",
            log=log,
            seconds=journal.seconds(program, evaluated),
            failure=failure,
        )
        return replace(solution, evaluations=dict(counts))

    def _descend(
        self, x: np.ndarray, evaluator: Evaluator, system: Condensed, journal: Journal
    ) -> tuple[np.ndarray, np.ndarray, Failure | None]:
        """Newton from x: where it ended, the multipliers there, and what went wrong."""
        most, enough = 0.0, Enough(self.tolerance, evaluator)
        while True:
            objective = evaluator.objective(x)
            gradient, matrix = evaluator.second_order(x, system.pattern)
            multipliers, reduced = system.multipliers(gradient), system.reduced(gradient)
            row = Iteration(objective, largest(reduced), largest(evaluator.violation(x)))
            failure, step = None, None
            if not most:
                unit = system.on_diagonal(evaluator.program.unit)
                most = BLOW_UP * max(abs(objective), largest(matrix[system.diagonal] * unit**2))
            if not np.isfinite(objective) or objective > most:
                failure = Status.DIVERGED, f"the objective grew to {objective:.2g}"
            else:
                try:
                    step = journal.timed(_solve_symmetric, system.lower_bands(matrix), -reduced)
                except LinAlgError:
                    failure = Status.FAILED, "the reduced Hessian is singular"
            if step is not None and not enough(0.5 * abs(float(reduced @ step)), objective, x):
                failure = journal.ending()
                step = step if failure is None else None
            else:
                step = None
            if step is None:
                journal.add(row)
                return x, multipliers, failure
            journal.add(replace(row, theta=1.0, step=self.damping))
            x = x + self.damping * system.expand(step)


def _system(program: Program) -> Condensed:
    system = Condensed.of(program)
    if system is None:
        if names := conflicting(program, program.x0):
            raise InputError(f"Elimination starts where the conditions hold, and {conflict(program, names)}")
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
    try:
        return solve_banded((band, band), full, rhs)
    except LinAlgError:
        # Symmetry can make a matrix singular whose right-hand side it reaches: whether rounding hides it is luck.
        full[band] += EPS * np.abs(full[band]).max()
        return solve_banded((band, band), full, rhs)
