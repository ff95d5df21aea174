"""Newton's method on the equalities that pressing bounds make, with the set of those that press found as it goes."""

from dataclasses import dataclass

import numpy as np

from symmotion.solvers.descent import CLEARLY, Enough
from symmotion.solvers.frame import Frame
from symmotion.solvers.solution import Iteration
from symmotion.systems import largest

# Steps that are tried: as long as they converge two or three serve. Where fewer and fewer bounds change, or none, there
# may be more.
MOST, LIMIT = 8, 16
# The weight of held bounds beside the Hessian, in own units, and the iterations of their multipliers on one factor,
# each of which divides what is missed by about that weight.
STIFF, REFINED = 1e4, 6
# What values may be beyond a bound by rounding.
ROUNDING = 1e-12


@dataclass(frozen=True, eq=False)
class Held:
    """A point x with multipliers y of equalities and λ of bounds in own units, and the bounds that are held there.

    low, high: (bounds,) whether the lower or the upper bound is held. rows: of the log, on the way here.
    """

    x: np.ndarray
    equalities: np.ndarray
    multipliers: np.ndarray
    low: np.ndarray
    high: np.ndarray
    rows: tuple[Iteration, ...] = ()


def held_newton(frame: Frame, enough: Enough, start: Held, most: float) -> Held | None:
    """The minimum that Newton's method finds from a start close by; None where it finds none in a few steps.

    Bounds that pull are let go and bounds that are broken are held, as long as that changes (the primal–dual active
    set method: Hintermüller, Ito, Kunisch 2002). Held bounds keep the band: their normals weigh in the matrix, and
    their multipliers are iterated on its factor (Hestenes 1969, Powell 1969), which needs no independent normals.

    most: the decrement of a step from which on it counts as lost.
    """
    x, y, multipliers, low, high = start.x, start.equalities, start.multipliers, start.low, start.high
    evaluator, values = frame.evaluator, frame.values(start.x)
    rows: list[Iteration] = []
    found: Held | None = None
    fewest = len(low)
    for k in range(LIMIT):
        system, held = frame.system(x), low | high
        off = np.where(low, values - frame.lower, np.where(high, values - frame.upper, 0.0))
        gradient, matrix = frame.second_order(system, x, y)
        violation = evaluator.violation(x)
        stiffness = STIFF * frame.size(system, matrix) * held
        frame.stiffen(matrix, system, x, multipliers, stiffness)
        if not np.isfinite(matrix).all():
            return found
        if k:
            rows.append(_row(frame, x, y, multipliers, gradient, values))
        factor = frame.factorise(system, matrix)
        if factor is None:
            return found
        step, wanted = np.zeros_like(x), None
        for _ in range(REFINED):
            residual = gradient + frame.pull(x, multipliers + stiffness * off)
            step, wanted = frame.step(system, factor, residual, violation)
            left = np.where(held, frame.along(x, step) + off, 0.0)
            multipliers = multipliers + stiffness * left
            if largest(left) <= ROUNDING * (1 + largest(off)):
                break
        along = gradient + frame.pull(x, multipliers)
        if wanted is not None:
            y = wanted
            along += evaluator.pull(x, y)
        # Of the system solved this is ½ dᵀ ∇²L d.
        decrement = 0.5 * abs(float(along @ step))
        x = x + step
        objective, values = evaluator.objective(x), frame.values(x)
        if not (decrement <= most and np.isfinite(objective) and np.isfinite(values).all()):
            return found
        rounding = ROUNDING * np.maximum(1.0, np.abs(values))
        fresh_low = (low & (multipliers < 0)) | (~held & (values < frame.lower - rounding))
        fresh_high = (high & (multipliers > 0)) | (~held & (values > frame.upper + rounding))
        same = bool((fresh_low == low).all() and (fresh_high == high).all())
        close = max(largest(off), largest(violation)) <= enough.tolerance
        if same and close and enough(decrement, objective, x):
            row = _row(frame, x, y, multipliers, evaluator.gradient(x), values)
            if found is not None and row.stationarity >= found.rows[-1].stationarity:
                return found
            again, found = found is not None, Held(x, y, multipliers, low, high, (*rows, row))
            # The decrement is that of the step before: what it leaves of the multipliers is another one's.
            if again or _balanced(frame, x, y, multipliers, enough.tolerance):
                return found
        elif found is not None:
            return found
        changes = int(np.count_nonzero(fresh_low != low) + np.count_nonzero(fresh_high != high))
        if k + 1 >= MOST and changes and changes >= fewest:
            break
        low, high, fewest = fresh_low, fresh_high, min(fewest, changes)
        multipliers = np.where(low | high, multipliers, 0.0)
    return found


def _balanced(frame: Frame, x: np.ndarray, y: np.ndarray, multipliers: np.ndarray, tolerance: float) -> bool:
    """Whether what multipliers leave of the gradient is clearly below the tolerance, in own units."""
    gradient, unit = frame.evaluator.gradient(x), frame.unit
    residual = gradient + frame.pull(x, multipliers)
    if frame.curved:
        left = unit * (residual + frame.evaluator.pull(x, y))
    else:
        system = frame.system(x)
        left = system.on_diagonal(unit) * system.reduced(residual)
    return largest(left) <= CLEARLY * tolerance * largest(unit * gradient)


def _row(
    frame: Frame, x: np.ndarray, y: np.ndarray, multipliers: np.ndarray, gradient: np.ndarray, values: np.ndarray
) -> Iteration:
    residual = gradient + frame.pull(x, multipliers)
    residual = residual + frame.evaluator.pull(x, y) if frame.curved else frame.system(x).reduced(residual)
    violation = max(largest(frame.evaluator.violation(x)), largest(frame.outside(values) * frame.scale))
    return Iteration(frame.evaluator.objective(x), largest(residual), violation, inertia="positive")
