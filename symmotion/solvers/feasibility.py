"""The search for a point between the bounds, and what contradicts where it finds none."""

from dataclasses import dataclass

import casadi as ca
import numpy as np

from symmotion import interrupts
from symmotion.program import Constraint
from symmotion.solvers.frame import Frame
from symmotion.systems import AnyFactor, AnySystem, largest, reach, shifted, tenfold

# Steps of the search, and the decrement relative to the violation's square at which it is stationary.
STEPS, STATIONARY = 200, 1e-7
# Violations, in own units, that count as none, and shares of the largest that count as conflicts.
NONE, SHARE = 1e-9, 1e-3
# What is added to the matrix, relative to the bounds' normals, so that what they do not see stays where it is: at
# least, at first and at most; ten times as much after a step that had to be shortened, else a third.
LEAST_DAMPING, DAMPING, MOST_DAMPING = 1e-10, 1e-4, 1e4


@dataclass(frozen=True, eq=False)
class Found:
    """Where the search ended: at a feasible point, or where the violation cannot be lowered from nearby.

    conflict: names of conditions that contradict each other there, none where the point is feasible or the search
    gave up. proven: whether no point at all satisfies them, since they are convex.
    """

    x: np.ndarray
    feasible: bool
    conflict: tuple[str, ...] = ()
    proven: bool = False


def find_feasible(frame: Frame, x: np.ndarray) -> Found:
    """Minimise ½ Σ outside(c)² along the equalities from x, by Newton's method on the same systems.

    At a stationary point with a violation, λ = outside(c) and the equalities' multipliers say which conditions
    contradict: where those are convex, Σ λ_i (c_i − bound_i) > 0 everywhere.
    """
    evaluator, penalty, damping = frame.evaluator, 0.0, DAMPING
    values, violation = frame.values(x), evaluator.violation(x)
    forces = np.zeros_like(violation)
    for _ in range(STEPS):
        interrupts.step()
        outside, system = frame.outside(values), frame.system(x)
        missed = max(largest(outside), largest(violation))
        if missed <= NONE:
            return Found(x, True)
        if frame.journal.stopped:
            return Found(x, False)
        gradient = frame.pull(x, outside)
        factor = _factor(frame, system, x, outside, forces, damping)
        if factor is None:
            return Found(x, False)
        step, equalities = frame.step(system, factor, gradient, violation)
        value, slope = 0.5 * float(outside @ outside), float(gradient @ step)
        off = float(np.abs(violation).sum())
        if equalities is not None:
            penalty = max(penalty, 1.5 * largest(equalities))
        if off > 0.0:
            penalty = max(penalty, 2.0 * slope / off)
        merit = value + penalty * off
        if -slope <= STATIONARY * value and off <= NONE:
            if equalities is None:
                equalities = system.multipliers(gradient)
            return Found(x, False, _conflict(frame, x, outside, equalities), _convex(frame, x, outside))
        if equalities is not None:
            forces = equalities
        length = 1.0
        while True:
            fresh = x + length * step
            values, violation = frame.values(fresh), evaluator.violation(fresh)
            if length == 1.0 and equalities is not None:
                # What the equalities' curvature leaves, through the same factor.
                corrected = fresh + frame.step(system, factor, np.zeros_like(x), violation)[0]
                closer = frame.values(corrected), evaluator.violation(corrected)
                if largest(closer[1]) < largest(violation):
                    fresh, (values, violation) = corrected, closer
            outside = frame.outside(values)
            now = 0.5 * float(outside @ outside) + penalty * float(np.abs(violation).sum())
            if now <= merit + 1e-4 * length * min(slope - penalty * off, 0.0):
                break
            length *= 0.5
            if length < 1e-10:
                return Found(x, False)
        damping = max(LEAST_DAMPING, damping / 3) if length == 1.0 else min(MOST_DAMPING, damping * 10)
        x = fresh
    return Found(x, False)


def _factor(
    frame: Frame, system: AnySystem, x: np.ndarray, outside: np.ndarray, forces: np.ndarray, damping: float
) -> AnyFactor | None:
    """Of the Hessian of the squares, with the conditions' curvature where that is positive definite, else without."""
    broken = (outside != 0).astype(float)
    identity = system.on_diagonal(frame.unit) ** -2.0
    for theta in (1.0, 0.0):
        matrix = frame.stiffen(np.zeros(system.pattern.size), system, x, outside, broken, theta)
        if theta and frame.curved:
            matrix += frame.second_order(system, x, forces)[1] - frame.second_order(system, x, 0.0 * forces)[1]
        if not np.isfinite(matrix).all():
            return None
        matrix[system.diagonal] += damping * frame.size(system, matrix) * identity
        factor = frame.factorise(system, matrix)
        if factor is not None:
            return factor
    return shifted(system, matrix, frame.unit, tenfold(damping, most=MOST_DAMPING))[0]


def _conflict(frame: Frame, x: np.ndarray, outside: np.ndarray, equalities: np.ndarray) -> tuple[str, ...]:
    """Names of the bounds that are broken and of the equalities that keep them so."""
    outside_alone = frame.bounded.joined(np.zeros_like(equalities), outside)
    forces = frame.bounded.joined(equalities * reach(frame.evaluator.jacobian(x), frame.unit), outside)
    most = {name: largest(part) for name, part in frame.bounded.program.split(forces).items()}
    # Bounds that are broken are part of it, however lightly they weigh beside the equalities.
    broken = {name: largest(part) for name, part in frame.bounded.program.split(outside_alone).items()}
    worst, heaviest = max(broken.values()), max(most.values())
    return tuple(name for name, m in most.items() if m > SHARE * heaviest or broken[name] > SHARE * worst)


def _convex(frame: Frame, x: np.ndarray, outside: np.ndarray) -> bool:
    """Whether the equalities are linear and the broken bounds convex on their sides, as far as quadratics tell."""
    if frame.curved:
        return False
    parts = frame.bounded.bounds.split(outside)
    return all(_convex_block(c, parts[c.name]) for c in frame.bounded.bounds.constraints)


def _convex_block(c: Constraint, outside: np.ndarray) -> bool:
    kernel = c.block.kernel
    if kernel.linear or not outside.any():
        return True
    if not kernel.quartic:
        return False
    mu = ca.SX.sym("mu", kernel.out.numel())
    hessian = ca.Function("curvature", [kernel.data, mu], [ca.densify(ca.hessian(ca.dot(mu, kernel.out), kernel.z)[0])])
    broken = np.flatnonzero(outside.any(axis=1))
    for node in broken:
        # Each component by itself: a positive sum of convex functions is, too.
        for component in np.flatnonzero(outside[node]):
            weights = np.zeros(outside.shape[1])
            weights[component] = np.sign(outside[node, component])
            lowest = float(np.linalg.eigvalsh(np.asarray(hessian(c.block.data[node], weights)))[0])
            if lowest < -1e-12:
                return False
    return True
