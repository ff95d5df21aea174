"""PCG table 1 with every local step solved as a constrained program: the reference of the closed form."""

from dataclasses import replace

import numpy as np

from symmotion.fairing.coordinates import Coordinates
from symmotion.fairing.greedy import GreedyRun, Limits
from symmotion.fairing.held_steps import HeldSteps
from symmotion.fairing.jumps import Jumps, Step
from symmotion.fairing.metrics import Metric
from symmotion.fairing.programs import JUMPS, FairingDesign, LocalSteps
from symmotion.solvers import ExactNewton, Status
from symmotion.systems import Certificate


def iterate_programs(
    coordinates: Coordinates,
    jumps: Jumps,
    step: Step,
    limits: Limits,
    metric: Metric,
    held: HeldSteps | None,
    first: np.ndarray,
) -> tuple[GreedyRun, np.ndarray, Certificate | None, str]:
    """The run, the best net (n, m, C), the worst of the steps' certificates and the message of a solve that failed.

    The measures are computed from the net after every step; nothing is updated in place. first: (n, m, C) the net at
    which conditions hold, which the steps of `held` keep.
    """
    solver, steps = ExactNewton(), LocalSteps(coordinates, jumps, step, metric, held)
    start, net = coordinates.net, first
    best, kept = 0, net
    patience = limits.max_steps if limits.patience is None else limits.patience
    allowed = np.ones(jumps.shape, dtype=bool) if limits.knots is None else limits.knots
    open_knots = allowed.copy()
    history = [float(jumps.fairness(net).sum())]
    total = np.zeros((*jumps.shape, jumps.kinds, net.shape[-1]))
    kept_total, worst = total.copy(), None
    discarded, message, status = 0, "", ""
    while not status:
        measure = np.where(open_knots, jumps.fairness(net), 0.0)
        if limits.target is not None and history[-1] <= limits.target:
            status = "target"
        elif len(history) > limits.max_steps:
            status = "cap"
        elif history[-1] > limits.divergence * history[best] or len(history) - 1 - best > patience:
            status = "diverged"
        elif not measure.max() > 0:
            status = "exhausted"
        if status:
            break
        k, l = (int(i) for i in np.unravel_index(int(measure.argmax()), measure.shape))  # noqa: E741
        if held is not None and held.touched[k, l] and not held.at(k, l).clears:
            status, message = "cap", f"step {len(history)} at knot ({k}, {l}): conditions leave no room for both jumps"
            break
        program = steps.program((k, l), net)
        solution = solver.solve(program)
        worst = _worse(worst, solution.certificate)
        if solution.status != Status.SOLVED:
            status, message = "cap", f"step {len(history)} at knot ({k}, {l}): {solution.status} {solution.message}"
            break
        assert isinstance(program.design, FairingDesign)
        moved = program.design.net(program.unpack(solution.x))
        gone = np.linalg.norm(moved - start, axis=-1)
        if limits.tolerance is not None and (gone > limits.tolerance).any():
            open_knots[k, l] = False
            discarded += 1
            continue
        net = moved
        reach = 3 if step == "nine" else 4
        near = slice(max(0, k - reach), k + reach + 1), slice(max(0, l - reach), l + reach + 1)
        open_knots[near] = allowed[near]
        open_knots[k, l] = False
        total[k, l] += np.stack([solution.multipliers[name][0] for name in JUMPS[: jumps.kinds]])
        history.append(float(jumps.fairness(net).sum()))
        if history[-1] < history[best]:
            best, kept, kept_total = len(history) - 1, net, total.copy()
        if abs(history[-1] - history[-2]) < limits.change:
            status = "stalled"
    run = GreedyRun(kept_total, np.array(history), best, discarded, status)
    return run, kept, worst, message


def _worse(one: Certificate | None, other: Certificate) -> Certificate:
    """The larger of every figure of two certificates."""
    if one is None:
        return other
    ranks = ("positive", "flat", "unknown", "indefinite")
    shown = ("stationarity", "violation", "decrement", "complementarity")
    figures = (*shown, "rounding", "mismatch", "missed", "pressing")
    worst = {name: max(getattr(one, name), getattr(other, name)) for name in figures}
    return replace(other, **worst, inertia=max(one.inertia, other.inertia, key=ranks.index))
