"""The ways to fair a net, each from a task to a net: local steps, least squares, bounds."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from symmotion.errors import InputError
from symmotion.fairing.blocks import KEYFRAMES, on_displacements
from symmotion.fairing.borders import Freedom
from symmotion.fairing.coordinates import Coordinates
from symmotion.fairing.greedy import GreedyRun, Limits, iterate
from symmotion.fairing.held_steps import HeldSteps
from symmotion.fairing.jumps import Jumps, StepTables
from symmotion.fairing.keyframes import Held
from symmotion.fairing.least_squares import Faired, LeastSquares
from symmotion.fairing.metrics import Metric
from symmotion.fairing.pressing import Pressed, pressed
from symmotion.fairing.programs import FairingDesign
from symmotion.fairing.reference import iterate_programs
from symmotion.fairing.result import FairingStatus
from symmotion.jets.space import UNKNOWN
from symmotion.program import Program
from symmotion.solvers import Guess, Solver, Status
from symmotion.systems import Certificate

# The weight of the least squares that bounded fairing starts from, relative to `LeastSquares.scale`, and how far within
# its bound a control is at first.
LIGHT, HALFWAY = 0.01, 0.5
# Of a tolerance.
ROUNDING = 1e-9

STATUSES = {
    "target": FairingStatus.TARGET,
    "cap": FairingStatus.CAP,
    "diverged": FairingStatus.MINIMUM,
    "exhausted": FairingStatus.EXHAUSTED,
    "stalled": FairingStatus.STALLED,
}


@dataclass(frozen=True, eq=False)
class Task:
    """The net (n, m, C), what of it may move, what is to hold, and how moves are measured."""

    coordinates: Coordinates
    jumps: Jumps
    freedom: Freedom
    net: np.ndarray
    keyframes: tuple[Held, ...] = ()
    metric: Metric = field(default_factory=Metric)

    @property
    def knots(self) -> int:
        (a, b), (c, d) = self.freedom.box.u, self.freedom.box.v
        return (b - a) * (d - c)

    @property
    def problem(self) -> LeastSquares:
        return LeastSquares(self.jumps, self.net, self.freedom, self.keyframes, self.metric)

    def far(self, net: np.ndarray) -> np.ndarray:
        """(n, m) how far the controls of a net are from those given, in the metric."""
        move = net - self.net
        return np.sqrt(np.maximum(np.sum(move * self.metric.times(move), axis=-1), 0.0))

    def prices(self, active: Sequence[int], multipliers: np.ndarray) -> dict[str, np.ndarray]:
        """The multipliers (E,) of the active keyframes' equations as forms on their displacements."""
        if not self.keyframes:
            return {}
        given: list[np.ndarray | None] = [None] * len(self.keyframes)
        ends = np.cumsum([len(self.keyframes[i].target) for i in active])
        for i, part in zip(active, np.split(multipliers, ends[:-1]), strict=True):
            given[i] = part
        return {KEYFRAMES: on_displacements([k.covector for k in self.keyframes], given)}


@dataclass(frozen=True, eq=False)
class Found:
    """What a method found, before it is put into words."""

    net: np.ndarray
    status: FairingStatus
    multipliers: dict[str, np.ndarray]
    steps: int
    best: int
    history: np.ndarray | None = None
    certificate: Certificate | None = None
    discarded: int = 0
    weight: float | None = None
    message: str = ""


def _require_within(far: np.ndarray, tolerance: np.ndarray) -> None:
    """InputError that names a control that conditions alone move by more (n, m) than it may."""
    beyond = far > tolerance * (1 + ROUNDING)
    if beyond.any():
        where = tuple(np.argwhere(beyond)[0].tolist())
        raise InputError(f"tolerance: keyframes and borders alone move control {where} further, by {far[where]:.3g}")


def by_steps(task: Task, method: str, limits: Limits, form: str) -> Found:
    """Local steps from the net at which keyframes and borders hold, which they keep."""
    problem = task.problem
    jumps = task.jumps.with_ring(task.freedom.ring)
    step = "nine" if method == "greedy" else "orthogonal"
    bound = bool(problem.active) or bool(task.freedom.edges)
    first = problem.met() if bound else Faired(task.net, 1.0, np.zeros(0))
    if limits.tolerance is not None and bound:
        _require_within(np.linalg.norm(first.net - task.net, axis=-1), limits.tolerance)
    tables = StepTables(jumps, step)
    active = [task.keyframes[i] for i in problem.active]
    held = HeldSteps.of(tables, task.net.shape, active, tuple(task.freedom.edges.items()), task.metric)
    certificate, message = None, ""
    if form == "program":
        found = iterate_programs(task.coordinates, jumps, step, limits, task.metric, held, first.net)
        run, net, certificate, message = found
    else:
        run = iterate(tables, jumps.at(first.net), limits, held, first.net - task.net)
        net = first.net
    status = STATUSES[run.status] if not message else FairingStatus.FAILED
    multipliers = {"jumps": run.multipliers}
    if held is None:
        if form == "closed":
            # Of a form that all controls share, which cancels out of the net.
            multipliers = {"jumps": task.metric.shared(run.multipliers)}
        net = net if form == "program" else net - jumps.spread(run.multipliers, step)
        return _stepped(run, net, status, multipliers, certificate, message)
    plain, move, prices = held.split(run.multipliers)
    if form == "closed":
        net = first.net + move - jumps.spread(plain, step)
        if bound:
            # Thousands of steps add up their rounding: a last move of that size takes it out.
            net = replace(problem, net=net, freedom=replace(task.freedom, shift=None)).met().net
    count = sum(len(k.target) for k in active)
    multipliers |= task.prices(problem.active, first.multipliers + prices[:count])
    return _stepped(run, net, status, multipliers, certificate, message)


def _stepped(
    run: GreedyRun,
    net: np.ndarray,
    status: FairingStatus,
    multipliers: dict[str, np.ndarray],
    certificate: Certificate | None = None,
    message: str = "",
) -> Found:
    steps = len(run.history) - 1
    return Found(net, status, multipliers, steps, run.best, run.history, certificate, run.discarded, message=message)


def by_least_squares(task: Task, target: float | None, weight: float | None, noise: float | None) -> Found:
    """One linear system, its weight given, found for a target, or for a displacement of the size of the noise."""
    problem = task.problem
    if noise is not None:
        found = problem.for_displacement(noise)
    elif target is not None:
        found = problem.for_target(target)
    else:
        found = problem.solve(1.0 if weight is None else float(weight))
    status = FairingStatus.SOLVED if target is None else FairingStatus.TARGET
    # At the optimum d − d⁰ = −DᵀΔ/w: the jumps that are left play the part of the steps' multipliers.
    multipliers = {"jumps": task.jumps.at(found.net) / found.weight} | task.prices(problem.active, found.multipliers)
    return Found(found.net, status, multipliers, 1, 1, weight=found.weight)


def by_bounds(task: Task, solver: Solver, program: Program[FairingDesign], tolerance: np.ndarray) -> Found:
    """The net within the tolerances (n, m), from where bounds press, else the least squares drawn inside, else the net.

    At the net given, the centre of all bounds, their slopes vanish: what a barrier is told there is little.
    """
    problem, design = task.problem, program.design
    _require_within(np.where(task.freedom.free, 0.0, task.far(problem.start)), tolerance)
    alone = problem.solve(problem.nearest).net
    inside = bool((task.far(alone) <= tolerance).all())
    guess = Pressed(alone, np.zeros_like(tolerance)) if inside else pressed(problem, tolerance)
    if guess is not None:
        bounds = program.split(np.arange(program.conditions))["bounds"].ravel().astype(int)
        multipliers = np.zeros(program.conditions)
        multipliers[bounds] = guess.multipliers[task.freedom.free]
        start = Guess(program.pack({UNKNOWN: _rows(guess.net - design.shift)}), multipliers)
    else:
        near = problem.solve(LIGHT * problem.scale).net
        move = near - task.net
        move *= np.minimum(1.0, HALFWAY * tolerance / np.maximum(task.far(near), 1e-300))[..., None]
        start = program.pack({UNKNOWN: _rows(task.net + move - design.shift)})
    found = by_program(task, solver, program, start=start)
    return found if found.status == FairingStatus.SOLVED else by_program(task, solver, program)


def _rows(net: np.ndarray) -> np.ndarray:
    return net.reshape(-1, net.shape[-1])


def by_program(
    task: Task,
    solver: Solver,
    program: Program[FairingDesign],
    enough: float = 0.0,
    weight: float | None = None,
    start: np.ndarray | Guess | None = None,
) -> Found:
    """The net that a solver finds; enough: the tolerance to which the certificate is to hold where the solver fails."""
    solution = solver.solve(program, start)
    net = program.design.net(program.unpack(solution.x))
    good = solution.status == Status.SOLVED or solution.certificate.holds(enough)
    status = FairingStatus.SOLVED if good else FairingStatus.FAILED
    message = "" if status == FairingStatus.SOLVED else f"{solution.status}: {solution.message}"
    # Controls that are held by a constraint come back from a solver up to its tolerance.
    free = task.freedom.free
    inside, net = net[free], task.problem.start.copy()
    if np.isfinite(inside).all():
        net[free] = inside
    multipliers = dict(solution.multipliers)
    certificate = solution.certificate
    return Found(
        net,
        status,
        multipliers,
        solution.iterations,
        solution.iterations,
        None,
        certificate,
        weight=weight,
        message=message,
    )
