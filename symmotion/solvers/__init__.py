"""Solvers for programs, and their comparison."""

from symmotion.solvers.comparison import Comparison, compare, solver_by_name
from symmotion.solvers.elimination import Elimination
from symmotion.solvers.ipopt import Ipopt
from symmotion.solvers.many import Tally, solve_each, solve_many
from symmotion.solvers.newton import ExactNewton
from symmotion.solvers.result import Iteration, Seconds, Solution, Status
from symmotion.solvers.results_file import ResultsFile
from symmotion.solvers.workers import Failed

__all__ = [
    "Comparison",
    "Elimination",
    "ExactNewton",
    "Failed",
    "Ipopt",
    "Iteration",
    "ResultsFile",
    "Seconds",
    "Solution",
    "Status",
    "Tally",
    "compare",
    "solve_each",
    "solve_many",
    "solver_by_name",
]
