"""Solvers for programs, and their comparison."""

from symmotion.solvers.comparison import Comparison, compare, solver_by_name
from symmotion.solvers.elimination import Elimination
from symmotion.solvers.ipopt import Ipopt
from symmotion.solvers.newton import ExactNewton
from symmotion.solvers.solution import Iteration, Seconds, Solution, Status, conclude

__all__ = [
    "Comparison",
    "Elimination",
    "ExactNewton",
    "Ipopt",
    "Iteration",
    "Seconds",
    "Solution",
    "Status",
    "compare",
    "conclude",
    "solver_by_name",
]
