"""The two solvers that take bounds, on the same programs with bounds at the same times: who takes how long?"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from time import process_time

import casadi as ca
import numpy as np

import symmotion as sm
from studies.solving.bounded_problems import POINTS, drawn_turns
from studies.solving.contest.attempts import SAME
from symmotion.report import Column, Table

DENSE, FEW = 8, 4  # times in every segment at which affine programs, and those of orientations, hold their bound
INERTIA = (1.0, 2.0, 2.5)
PATIENCE = 30.0  # seconds for a solve
OBJECTIVE = sm.Rigidity() + 1e-2 * sm.TrajectoryEnergy(POINTS)
METHODS = ("newton", "ipopt")


def solvers(kernels: sm.kernels.Kernels = "auto") -> tuple[sm.ExactNewton, sm.Ipopt]:
    """The two that take bounds, with the same kernels and the same time."""
    return sm.ExactNewton(kernels=kernels, time_limit=PATIENCE), sm.Ipopt(kernels=kernels, time_limit=PATIENCE)


@dataclass(frozen=True, eq=False)
class Pair:
    """Both solvers on one problem from its own start, and the CPU seconds of each."""

    name: str
    kind: str
    solutions: tuple[sm.Solution, sm.Solution]
    seconds: tuple[float, float]

    @staticmethod
    def of(name: str, kind: str, program: sm.program.Program, kernels: sm.kernels.Kernels = "auto") -> "Pair":
        found, seconds = [], []
        for solver in solvers(kernels):
            began = process_time()
            found.append(solver.solve(program))
            seconds.append(process_time() - began)
        return Pair(name, kind, (found[0], found[1]), (seconds[0], seconds[1]))

    @staticmethod
    def warm(name: str, kind: str, program: sm.program.Program) -> "Pair":
        """As `of`, with compiled kernels that are there."""
        for solver in solvers("compiled"):
            replace(solver, max_iterations=1).solve(program)
        return Pair.of(name, kind, program, "compiled")

    @property
    def best(self) -> float:
        """The least certified objective, infinite where neither has one."""
        return min((s.objective for s in self.solutions if certified(s)), default=np.inf)


def certified(solution: sm.Solution) -> bool:
    """Solved, by its certificate, and nowhere beyond its bounds by more than 1e-6 of them."""
    worst = max((e.value for e in solution.certificate.excess.values()), default=0.0)
    return solution.status == "solved" and worst <= SAME


def fixed(count: int) -> sm.program.Program:
    """Keyframes turned by up to 40° whose body points may move at 0.97 of the speed they have without a bound.

    Held at the same eight times in every segment.
    """
    keys = sm.examples.random_keyframes(count, 40, 0)
    motion = sm.ExactNewton(kernels="compiled").solve(sm.affine_program(keys, objective=OBJECTIVE)).motion
    share = np.arange(DENSE + 1)[:-1] / DENSE
    times = np.append((keys.times[:-1, None] + np.diff(keys.times)[:, None] * share).ravel(), keys.times[-1])
    limit = 0.97 * float(np.linalg.norm(motion.trajectory(POINTS, times, 1), axis=-1).max())
    return sm.affine_program(keys, objective=OBJECTIVE, constraints=[slow_at(times, limit)])


def slow_at(times: np.ndarray, limit: float) -> sm.JetConstraint:
    """The speed bound of the body points at given times only."""
    return sm.JetConstraint(
        lambda jet: ca.vertcat(*(ca.sumsqr(jet.velocity(p)) for p in POINTS)),
        lower=-np.inf,
        upper=limit**2,
        at=times,
        power=2,
        name="speed",
    )


def turning(count: int, torque: bool) -> sm.program.Program:
    """Orientations whose rate, or torque, is held at nine tenths of what it is without a bound, at the same times."""
    times, rotations = drawn_turns(np.random.default_rng(1), count)
    share = np.arange(FEW) / FEW
    at = np.append((times[:-1, None] + np.diff(times)[:, None] * share).ravel(), times[-1])
    energy = sm.Torque(INERTIA) if torque else None

    def made(limit: float | None) -> sm.program.Program:
        bounds = [] if limit is None else [_turning_at(at, limit, torque)]
        return sm.orientation_program(times, rotations, objective=energy, refine=2, constraints=bounds)

    free, wide = sm.ExactNewton(kernels="compiled").solve(made(None)), made(1.0)
    most = float(sm.program.Evaluator(wide).values(free.x)[-len(at) :].max())
    return made(0.9 * most**0.5)


def _turning_at(times: np.ndarray, limit: float, torque: bool) -> sm.JetConstraint:
    inertia = np.diag(INERTIA)

    def square(jet: sm.jets.RigidJet) -> ca.SX:
        return ca.sumsqr(jet.torque(inertia) if torque else jet.rate)

    return sm.JetConstraint(square, lower=-np.inf, upper=limit**2, at=times, power=2, name="turning")


def speeds(sped: Sequence[Pair]) -> Table:
    rows = []
    for pair in sped:
        newton, ipopt = pair.solutions
        pressing = int((np.abs(newton.multipliers["turning" if pair.kind != "speed" else "speed"]) > 1e-7).sum())
        apart = abs(newton.objective - ipopt.objective) / abs(ipopt.objective)
        ratio = pair.seconds[1] / pair.seconds[0]
        counts = newton.iterations, ipopt.iterations
        rows.append((pair.kind, pair.name, newton.program.conditions, pressing, *counts, *pair.seconds, ratio, apart))
    columns = (
        Column("bounded"),
        Column("keyframes"),
        Column("conditions"),
        Column("bounds that press"),
        Column("newton, iterations"),
        Column("ipopt, iterations"),
        Column("newton, CPU", "s"),
        Column("ipopt, CPU", "s"),
        Column("ipopt / newton"),
        Column("difference of objectives, relative"),
    )
    caption = (
        "One cold solve each of the same program: a bound on the speed of four body points at the same eight times in "
        "every segment, on the rate and on the torque of orientations at four; compiled kernels for both, which the "
        "same program without its bound, and a step of both, have made."
    )
    return Table("speed", columns, tuple(rows), caption)
