"""Bounds on speeds, places and torques: how sure and how fast are the two solvers, and what does a bound cost?"""

from dataclasses import dataclass
from time import process_time

import symmotion as sm
from studies.solving.bounded_problems import POINTS, BoundedProblem

SAME = 1e-6  # relative difference up to which two values are the same minimum
QUICK, FULL = 33, 330  # problems, of all kinds alike
SIZES, LONG = (20, 100), (20, 100, 400, 1000)  # keyframes of the speed comparison
EDITS, MANY = 20, 200  # neighbouring programs solved from a solution
SAMPLED = (5, 10, 20)  # times in each span
PATIENCE = 30.0  # seconds for a solve
OBJECTIVE = sm.Rigidity() + 1e-2 * sm.TrajectoryEnergy(POINTS)


@dataclass(frozen=True, eq=False)
class Pair:
    """Both solvers on one problem, and the CPU seconds of each."""

    task: BoundedProblem
    newton: sm.Solution
    ipopt: sm.Solution
    seconds: tuple[float, float]

    @property
    def solutions(self) -> tuple[sm.Solution, sm.Solution]:
        return self.newton, self.ipopt


def solve_both(task: BoundedProblem, kernels: sm.solvers.Kernels = "auto") -> Pair:
    """From the program's own start, at the times that the program holds its bounds, one after the other."""
    found, seconds = [], []
    for solver in (
        sm.ExactNewton(kernels=kernels, time_limit=PATIENCE),
        sm.Ipopt(kernels=kernels, time_limit=PATIENCE),
    ):
        began = process_time()
        found.append(solver.solve(task.program))
        seconds.append(process_time() - began)
    return Pair(task, found[0], found[1], (seconds[0], seconds[1]))
