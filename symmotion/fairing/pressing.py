"""Which bounds press on a faired net, and how hard: weights of the least squares, one for each control."""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import lapack

from symmotion.fairing.least_squares import LeastSquares

# The share of controls that are to be inside at first, how far, and by halving what powers of ten of weights.
MOST, INSIDE, POWERS, HALVINGS = 0.9, 0.95, (-6.0, 2.0), 6
# Weights follow the square of how far a control is, by so many steps extrapolated from so many, changes of their
# logarithms and of distances at most, and no weight is lighter relative to the scale.
STEPS, EXTRAPOLATED, LEAP, SHORT, LIGHTEST = 250, 4, 4.0, 0.1, 1e-13
# Where it ends: what bounds are exceeded by, and the worth of weights of controls inside, relative to G, now and first.
EXCEEDED, WORTH, NOTHING = 1e-3, 1e-4, 1e-9


@dataclass(frozen=True, eq=False)
class Pressed:
    """A net (n, m, C), and the multipliers (n, m) of |d − d⁰|²/δ² ≤ 1 at its controls, zero where they do not press."""

    net: np.ndarray
    multipliers: np.ndarray


def pressed(problem: LeastSquares, tolerance: np.ndarray) -> Pressed | None:
    """A net close to min ΣL subject to |d − d⁰| ≤ δ; None with keyframes, continued borders, and forms as metric.

    At the minimum it is that of the least squares with weights λ = μ/δ², whose system is the same for all coordinates:
    a sixteenth of the work of Newton's, where bounds couple the four of a quaternion. λ ← λ (|d − d⁰|/δ)² is their
    fixed point, which Anderson's extrapolation of log λ reaches in some dozens of steps (Walker and Ni 2011).

    tolerance: (n, m) δ, in the metric.
    """
    freedom, metric = problem.freedom, problem.metric
    shape = freedom.u.shape[1], freedom.v.shape[1]
    plain = freedom.u.nnz == shape[0] and freedom.v.nnz == shape[1] and not freedom.edges
    if problem.keyframes or not plain or metric.form is not None or metric.forms is not None or not all(shape):
        return None
    limit = tolerance if metric.scale is None else tolerance / np.sqrt(metric.scale)
    limit = freedom.drop(limit[..., None])[:, 0]
    # The shorter side inside, which keeps the band narrow.
    order = np.arange(limit.size).reshape(shape)
    order = order.ravel() if shape[1] <= shape[0] else order.T.ravel()
    limit, slope = limit[order], problem.slope[order]
    scale = problem.scale
    bands = _bands(problem, order)
    bands[0] += problem.nearest

    def at(weights: np.ndarray | float) -> tuple[np.ndarray, np.ndarray]:
        stiff = bands.copy(order="F")
        stiff[0] += weights
        factor = lapack.dpbtrf(stiff, lower=1, overwrite_ab=1)[0]
        move = lapack.dpbtrs(factor, -slope, lower=1)[0]
        return move, np.linalg.norm(move, axis=1) / limit

    low, high = POWERS
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if np.quantile(at(scale * 10**middle)[1], MOST) < INSIDE else (middle, high)
    first = float(np.sum(problem.jumps.fairness(problem.start)))
    logs = np.full(limit.size, np.log(scale * 10**high))
    course, weights = _Anderson(), np.exp(logs)
    move, far = at(weights)
    worth = weights * limit**2
    if not np.isfinite(far).all():
        return None
    for _ in range(STEPS):
        value = first + float(np.sum(slope * move) - np.sum(worth * far**2))
        least = max(WORTH * abs(value), NOTHING * first)
        if far.max() <= 1 + EXCEEDED and abs(float(np.sum(worth * (1 - far**2)))) <= least:
            break
        change = course.step(logs, 2 * np.log(np.maximum(far, SHORT)), np.sqrt(weights / weights.max()))
        logs = np.maximum(logs + np.clip(change, -LEAP, LEAP), np.log(LIGHTEST * scale))
        weights = np.exp(logs)
        move, far = at(weights)
        worth = weights * limit**2
        if not np.isfinite(far).all():
            return None
    multipliers = np.where(far >= 1 - EXCEEDED, worth, 0.0)
    back = np.argsort(order)
    net = problem.start + freedom.lift(move[back])
    return Pressed(net, freedom.lift(multipliers[back, None])[..., 0])


class _Anderson:
    """Steps of a fixed point iteration x ← x + g, extrapolated from the last few (type II), residuals weighted."""

    def __init__(self):
        self._points: list[np.ndarray] = []
        self._residuals: list[np.ndarray] = []

    def step(self, x: np.ndarray, g: np.ndarray, weights: np.ndarray) -> np.ndarray:
        """The change of x."""
        self._points = [*self._points, x][-EXTRAPOLATED - 1 :]
        self._residuals = [*self._residuals, g][-EXTRAPOLATED - 1 :]
        if len(self._points) == 1:
            return g
        moved, changed = (np.diff(np.array(rows), axis=0).T for rows in (self._points, self._residuals))
        share = np.linalg.lstsq(changed * weights[:, None], g * weights, rcond=1e-8)[0]
        return g - (moved + changed) @ share


def _bands(problem: LeastSquares, order: np.ndarray) -> np.ndarray:
    """(band + 1, N) the lower bands of the jumps' Gram matrix, in an order of its unknowns."""
    gram, place = problem.gram.tocoo(), np.argsort(order)
    row, column = place[gram.coords[0]], place[gram.coords[1]]
    lower = row >= column
    off = (row - column)[lower]
    bands = np.zeros((int(off.max(initial=0)) + 1, len(order)), order="F")
    bands[off, column[lower]] = gram.data[lower]
    return bands
