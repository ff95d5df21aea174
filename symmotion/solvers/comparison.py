"""Several solvers on one program, side by side."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from symmotion.checks import choice
from symmotion.errors import InputError
from symmotion.pictures import as_html, plot_comparison
from symmotion.program import Program
from symmotion.program.program import require_program
from symmotion.solvers.elimination import Elimination
from symmotion.solvers.ipopt import Ipopt
from symmotion.solvers.minima import distinct
from symmotion.solvers.newton import ExactNewton
from symmotion.solvers.plain import PlainIpopt
from symmotion.solvers.pursuit import Run, pursue
from symmotion.solvers.solution import Solution, Status
from symmotion.solvers.solver import Solver, conclude, require_solver
from symmotion.solvers.verdict import verdict

# Short names of solvers, as reports and the command line use them.
BY_NAME: dict[str, Solver] = {
    "newton": ExactNewton(),
    "newton-sparse": ExactNewton(system="sparse"),
    "ipopt": Ipopt(),
    "ipopt-plain": PlainIpopt(),
    "elimination": Elimination(),
    "elimination-staged": Elimination(stages="knots"),
}


@dataclass(frozen=True, eq=False)
class Comparison:
    """The solutions of one program by several solvers, in the order asked for.

    descents: by ExactNewton, from points below all minima that a run has met on its way or failed at;
    left: method and objective of such points from which no minimum was certified.

    >>> comparison = sm.compare(sm.affine_program(sm.examples.planar_keyframes()))
    >>> comparison.best.certified, len(comparison.minima)
    (True, 1)
    """

    program: Program
    solutions: tuple[Solution, ...]
    descents: tuple[Solution, ...] = ()
    left: tuple[tuple[str, float], ...] = ()

    @property
    def found(self) -> tuple[Solution, ...]:
        """The solutions, and those of the descents."""
        return self.solutions + self.descents

    @property
    def minima(self) -> tuple[Solution, ...]:
        """The minima found that differ, lowest first."""
        return distinct(self.found)

    @property
    def verdict(self) -> str:
        """In one sentence who won, who failed and by how much."""
        return verdict(self.found, self.best, len(self.minima), self.left)

    @property
    def best(self) -> Solution | None:
        """The solved one of least objective, None where none solved.

        Of those alike to nine digits, the one of least stationarity.
        """
        solved = [s for s in self.found if s.status is Status.SOLVED]
        least = min((s.objective for s in solved), default=0.0)
        alike = [s for s in solved if s.objective <= least + 1e-9 * abs(least)]
        return min(alike, key=lambda s: s.stationarity, default=None)

    def agreement(self, solution: Solution) -> tuple[float, float] | None:
        """How far minimiser and multipliers are from the best one's, each relative to its largest entry."""
        best = self.best
        if best is None or solution.status is Status.UNSUPPORTED:
            return None
        return _relative(solution.x, best.x), _relative(solution.multiplier_vector, best.multiplier_vector)

    plot = plot_comparison
    _repr_html_ = as_html

    def __repr__(self) -> str:
        head = ("solver", "status", "objective", "stationarity", "violation", "inertia", "iterations")
        head += ("order", "seconds", "Δ minimiser", "Δ multipliers")
        rows: list[tuple[str, ...]] = [head]
        for s in self.found:
            order, agreement = s.convergence_order, self.agreement(s)
            rows.append(
                (
                    s.method,
                    s.ended,
                    f"{s.objective:.9g}",
                    f"{s.stationarity:.1e}",
                    f"{s.violation:.1e}",
                    s.inertia,
                    str(s.iterations),
                    "–" if order is None else f"{order:.2f}",
                    f"{s.seconds.total:.4f}",
                    *(("–", "–") if agreement is None else (f"{a:.1e}" for a in agreement)),
                )
            )
        widths = [max(len(r[k]) for r in rows) for k in range(len(head))]
        lines = ["  ".join(cell.ljust(w) for cell, w in zip(r, widths, strict=True)).rstrip() for r in rows]
        return "\n".join(lines + [f"{s.method}: {s.message}" for s in self.found if s.message])


def compare(program: Program, solvers: Sequence[Solver] | None = None, start: object = None) -> Comparison:
    """Run solvers one after the other on a program from the same start.

    solvers: ExactNewton(), Ipopt() and Elimination() when left out. One that cannot take the
    program gets a row that says why. An ExactNewton has no `ways` here, but the one start that all have. Where one has
    met a point that is lower than every minimum found, on its way or where it failed, ExactNewton descends from there,
    until no run has met a lower one: `descents`.

    Raises InputError for what are no solvers.

    >>> comparison = sm.compare(sm.affine_program(sm.examples.planar_keyframes()), [sm.ExactNewton(), sm.Ipopt()])
    >>> [solution.method for solution in comparison.solutions]
    ['newton', 'ipopt']
    """
    if solvers is None:
        solvers = (ExactNewton(), Ipopt(), Elimination())
    if not isinstance(solvers, Iterable):
        raise InputError(f"solvers {solvers!r}: a sequence is needed, such as [ExactNewton(), Ipopt()]")
    require_program(program)
    runs = []
    for asked in [require_solver(s, "tolerance") for s in solvers]:
        solver = replace(asked, ways=0) if isinstance(asked, ExactNewton) else asked
        try:
            found = solver.solve(program, start)
        except InputError as error:
            found = _unsupported(program, asked, str(error))
        if not isinstance(found, Solution):
            raise InputError(f"solver {solver!r} returns a {type(found).__name__}: a Solution is needed, see conclude")
        runs.append(Run(solver, found))
    return Comparison(program, tuple(run.solution for run in runs), *pursue(program, runs, start))


def solver_by_name(name: str) -> Solver:
    """The solver of a short name such as "newton"; InputError says which exist.

    >>> sm.solvers.solver_by_name("newton").tolerance
    1e-08
    """
    return BY_NAME[choice(name, BY_NAME, "solver")]


def _unsupported(program: Program, solver: Solver, reason: str) -> Solution:
    method = next((name for name, known in BY_NAME.items() if known == solver), "")
    nothing = np.full(program.unknowns, np.nan), np.full(program.conditions, np.nan)
    return conclude(program, solver, *nothing, method=method, failure=(Status.UNSUPPORTED, reason))


def _relative(a: np.ndarray, b: np.ndarray) -> float:
    return float(np.abs(a - b).max(initial=0.0) / (np.abs(b).max(initial=0.0) or 1.0))
