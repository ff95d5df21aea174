"""Solvers for programs, their comparison, and the pieces of which a solver of one's own is made."""

from typing import TYPE_CHECKING

from symmotion.renamed import moved
from symmotion.solvers.comparison import Comparison, compare, solver_by_name
from symmotion.solvers.elimination import Elimination
from symmotion.solvers.exchanging import exchange
from symmotion.solvers.ipopt import Ipopt
from symmotion.solvers.journal import Callback, Failure, Journal
from symmotion.solvers.newton import ExactNewton
from symmotion.solvers.options import require_limits
from symmotion.solvers.plain import PlainIpopt
from symmotion.solvers.sensitivity import Sensitivity
from symmotion.solvers.solution import Course, Iteration, Round, Seconds, Solution, Status
from symmotion.solvers.solver import Guess, Solver, conclude, require_equalities, start_multipliers, start_vector

__all__ = [
    "Callback",
    "Comparison",
    "Course",
    "Elimination",
    "ExactNewton",
    "Failure",
    "Guess",
    "Ipopt",
    "Iteration",
    "Journal",
    "PlainIpopt",
    "Round",
    "Seconds",
    "Sensitivity",
    "Solution",
    "Solver",
    "Status",
    "compare",
    "conclude",
    "exchange",
    "require_equalities",
    "require_limits",
    "solver_by_name",
    "start_multipliers",
    "start_vector",
]

if not TYPE_CHECKING:
    # Names of 0.1.0.
    __getattr__ = moved(
        __name__,
        {
            "batches": "Failed ResultsFile Tally solve_each solve_many",
        },
    )
