"""One call for every way to fair a motion."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from time import perf_counter
from typing import Literal

import numpy as np

from symmotion import checks
from symmotion.errors import InputError
from symmotion.fairing.coordinates import AnyMotion, Box, Coordinates, Parts, same_kind
from symmotion.fairing.greedy import GreedyRun, Limits, iterate
from symmotion.fairing.jumps import Jumps, StepTables
from symmotion.fairing.least_squares import LeastSquares
from symmotion.fairing.programs import FairingDesign, fairing_program, tolerances
from symmotion.fairing.reference import iterate_programs
from symmotion.fairing.result import FairingResult, FairingStatus
from symmotion.program import Program
from symmotion.solvers import ExactNewton, Ipopt, Solver, Status
from symmotion.systems import Certificate

Method = Literal["greedy", "orthogonal", "least-squares", "bounded"]
METHODS = ("greedy", "orthogonal", "least-squares", "bounded")
Form = Literal["closed", "program"]
STEPS_PER_KNOT = 100
STATUSES = {
    "target": FairingStatus.TARGET,
    "cap": FairingStatus.CAP,
    "diverged": FairingStatus.MINIMUM,
    "exhausted": FairingStatus.EXHAUSTED,
}


@np.errstate(all="ignore")  # what is not finite is told by name
def fair(
    motion: AnyMotion,
    method: Method = "greedy",
    *,
    target: float | None = None,
    max_steps: int | None = None,
    divergence: float = 10.0,
    tolerance: float | np.ndarray | None = None,
    weight: float | None = None,
    region: object = None,
    parts: Parts | None = None,
    length: float = 1.0,
    form: Form = "closed",
) -> FairingResult[AnyMotion]:
    """A motion made fairer: smaller jumps of its third derivatives at the knots, its outermost controls fixed.

    With L_kl = |Δ_uuu|² + |Δ_vvv|² at knot (u_k, v_l) and G = ΣL (PCG (15)–(17)):

    - "greedy": PCG table 1, at the largest L_kl the least move of the inner nine controls that
      makes both jumps zero (of a curve, three and one). G does not fall in every step and, if
      the iteration goes on, grows again for good: the best net seen is kept.
    - "orthogonal": the same with all 21 controls that the jumps read, but for the outermost.
    - "least-squares": min ΣL + w Σ|d − d⁰|², one linear system.
    - "bounded": min ΣL subject to |d − d⁰| ≤ δ at every control, by IPOPT.

    motion: a two-parameter motion, cubic in both directions, or a cubic one-parameter one, with
        simple interior knots and neighbouring control quaternions in one hemisphere.
    target: of G. The steps stop there; least squares finds the weight that leads there.
    max_steps: 100 per knot when left out; divergence: the steps stop where G is this multiple of the best.
    tolerance: δ, one or (n, m), in units of the faired coordinates: steps that move a control
        further are discarded; "bounded" needs it.
    weight: w > 0 of the least squares, 1 when left out together with `target`.
    region: fair only there: (a, b) of a curve, ((a, b), (c, d)) in u and v.
    parts: "real", "dual", "translation", "real+dual" (all that moves when left out) or
        "real+translation" (PCG 6); length: the unit that dual parts and translations are divided by.
    form: "closed", or "program": every step, or the whole net, as a constrained program
        of symbols with explicit multipliers, which ends at the same net and brings a certificate.

    Raises InputError for what cannot be faired and names the direction, knot or control at fault.
    """
    began = perf_counter()
    options = {"weight": weight, "max_steps": max_steps, "tolerance": tolerance, "target": target}
    _check(method, form, options, divergence)
    coordinates = Coordinates.of(motion, parts, length)
    jumps = Jumps.of(motion.bases)
    task = _Task(coordinates, jumps, Box.of(jumps, motion, region), coordinates.net)
    before = jumps.fairness(task.net)
    total = before.sum()
    if not np.isfinite(total):
        raise InputError(
            f"G = {total} at the start: the controls, up to {np.abs(task.net).max():.2g}, are too large for the "
            "squares of the jumps at these knots; measure them in larger units, or the dual parts by a larger length"
        )
    if method in ("greedy", "orthogonal"):
        cap = STEPS_PER_KNOT * task.knots if max_steps is None else max_steps
        allowed = None if tolerance is None else tolerances(tolerance, task.net.shape[:2])
        limits = Limits(target, cap, divergence, task.box.knots(jumps), allowed)
        found = _by_steps(task, method, limits, form)
    elif method == "least-squares":
        found = _by_least_squares(task, target, weight, region, form)
    else:
        assert tolerance is not None
        found = _bounded(task, tolerance, region)
    after = jumps.fairness(found.net)
    total = after.sum()
    if not np.isfinite(total):
        message = f"G = {total} at the end, and the motion is the one given"
        found, after = replace(found, net=task.net, status=FairingStatus.FAILED, message=message), before
    curve = len(motion.bases) == 1
    displacement = np.linalg.norm(found.net - task.net, axis=-1)
    history = np.array([before.sum(), after.sum()]) if found.history is None else found.history
    return FairingResult(
        motion=same_kind(motion, coordinates.motion_of(found.net)),
        start=motion,
        method=method,
        status=found.status,
        history=history,
        before=before[:, 0] if curve else before,
        after=after[:, 0] if curve else after,
        displacement=displacement[:, 0] if curve else displacement,
        multipliers=found.multipliers,
        certificate=found.certificate,
        steps=found.steps,
        best_step=found.best,
        seconds=perf_counter() - began,
        discarded=found.discarded,
        weight=found.weight,
        message=found.message,
    )


# The methods that take each of these options.
TAKEN_BY = {
    "weight": ("least-squares",),
    "max_steps": ("greedy", "orthogonal"),
    "tolerance": ("greedy", "orthogonal", "bounded"),
    "target": ("greedy", "orthogonal", "least-squares"),
}


def _check(method: str, form: str, options: Mapping[str, object], divergence: float) -> None:
    """InputError for a method, a form or options that there are not; options: by name, None where left out."""
    checks.choice(method, METHODS, "method")
    checks.choice(form, ("closed", "program"), "form")
    given = {name: value for name, value in options.items() if value is not None}
    for name in given.keys() & {"target", "weight"}:
        checks.positive(given[name], name)
    if "max_steps" in given:
        checks.whole(given["max_steps"], 0, "max_steps")
    if not checks.positive(divergence, "divergence") > 1:
        raise InputError(f"divergence {divergence!r}: a number above 1 is needed")
    if "target" in given and ("weight" in given or method == "bounded"):
        other = "weight" if "weight" in given else "bounded"
        raise InputError(f"target and {other} do not go together: give one")
    for name in TAKEN_BY:
        if name in given and method not in TAKEN_BY[name]:
            *others, last = TAKEN_BY[name]
            takers = f"{', '.join(others)} and {last}" if others else last
            remedy = "; least-squares takes a weight" if method == "least-squares" else ""
            raise InputError(f"{name} goes with {takers}, not with {method}{remedy}")
    if method == "bounded" and "tolerance" not in given:
        raise InputError("bounded needs a tolerance: how far each control may go")


@dataclass(frozen=True, eq=False)
class _Task:
    """The net (n, m, C) and where it is faired."""

    coordinates: Coordinates
    jumps: Jumps
    box: Box
    net: np.ndarray

    @property
    def knots(self) -> int:
        (a, b), (c, d) = self.box.u, self.box.v
        return (b - a) * (d - c)


@dataclass(frozen=True, eq=False)
class _Found:
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


def _by_steps(task: _Task, method: str, limits: Limits, form: str) -> _Found:
    jumps = task.jumps
    step = "nine" if method == "greedy" else "orthogonal"
    certificate, message = None, ""
    if form == "closed":
        run: GreedyRun = iterate(StepTables(jumps, step), jumps.at(task.net), limits)
        net = task.net - jumps.spread(run.multipliers, step)
    else:
        run, net, certificate, message = iterate_programs(task.coordinates, jumps, step, limits)
    status = STATUSES[run.status] if not message else FairingStatus.FAILED
    multipliers = {"jumps": run.multipliers}
    return _Found(
        net,
        status,
        multipliers,
        len(run.history) - 1,
        run.best,
        run.history,
        certificate,
        run.discarded,
        message=message,
    )


def _by_least_squares(task: _Task, target: float | None, weight: float | None, region: object, form: str) -> _Found:
    problem = LeastSquares(task.jumps, task.net, task.box.controls(task.jumps))
    if target is not None:
        net, chosen = problem.for_target(target)
    else:
        chosen = 1.0 if weight is None else float(weight)
        net = None if form == "program" else problem.solve(chosen)
    status = FairingStatus.SOLVED if target is None else FairingStatus.TARGET
    if form == "closed" and net is not None:
        # At the optimum d − d⁰ = −DᵀΔ/w: the jumps that are left play the part of the steps' multipliers.
        return _Found(net, status, {"jumps": task.jumps.at(net) / chosen}, 1, 1, weight=chosen)
    found = _solved(task, ExactNewton(), _program(task, region, weight=chosen))
    return found if found.status == FairingStatus.FAILED else replace(found, status=status, weight=chosen)


def _bounded(task: _Task, tolerance: float | np.ndarray | None, region: object) -> _Found:
    # G falls to next to nothing, of which an interior point has fewer digits.
    return _solved(task, Ipopt(), _program(task, region, tolerance=tolerance), enough=1e-6)


def _program(
    task: _Task, region: object, weight: float = 0.0, tolerance: float | np.ndarray | None = None
) -> Program[FairingDesign]:
    c = task.coordinates
    return fairing_program(c.motion, weight=weight, tolerance=tolerance, region=region, parts=c.parts, length=c.length)


def _solved(task: _Task, solver: Solver, program: Program[FairingDesign], enough: float = 0.0) -> _Found:
    """The net that a solver finds; enough: the tolerance to which the certificate is to hold where the solver fails."""
    solution = solver.solve(program)
    net = program.design.net(program.unpack(solution.x))
    good = solution.status == Status.SOLVED or solution.certificate.holds(enough)
    status = FairingStatus.SOLVED if good else FairingStatus.FAILED
    message = "" if status == FairingStatus.SOLVED else f"{solution.status}: {solution.message}"
    # Controls that are held by a constraint come back from a solver up to its tolerance.
    free = task.box.controls(task.jumps)
    inside, net = net[free], task.net.copy()
    if np.isfinite(inside).all():
        net[free] = inside
    multipliers = dict(solution.multipliers)
    certificate = solution.certificate
    return _Found(
        net, status, multipliers, solution.iterations, solution.iterations, None, certificate, message=message
    )
