"""C² quaternion curves through keyframes: Newton on control quaternions and increments together."""

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike
from scipy import sparse
from scipy.sparse.linalg import splu

from symmotion.checks import choice, numbers
from symmotion.errors import InputError, SolveError
from symmotion.motions.keyframes import Keyframes
from symmotion.motions.quaternions.algebra import Signs, conjugate, exp, log, product, right_jacobian, rotate, short_log
from symmotion.motions.quaternions.curve import QuaternionMotion
from symmotion.motions.quaternions.keys import OrientationKeys
from symmotion.splines import BSplineBasis, cubic_interpolant, from_origin
from symmotion.splines.cumulative import cumulative

if TYPE_CHECKING:
    from symmotion.motions.rotations import Rotations

ENDS = ("natural", "clamped", "periodic")


def interpolate_quaternions(
    times: ArrayLike | Keyframes,
    quaternions: "Rotations | None" = None,
    ends: str = "natural",
    end_rates: ArrayLike | None = None,
    turns: ArrayLike | None = None,
    *,
    signs: Signs = "align",
    scalar_first: bool = True,
    norms: float | None = None,
    tolerance: float = 1e-12,
    max_iterations: int = 200,
) -> QuaternionMotion:
    """The C² cubic B-spline quaternion curve through keyframes (KKS 6.2, figure 10), to `tolerance` in rad.

    times: (M,) increasing; quaternions: (M, 4) scalar first unless `scalar_first` says else, or a
        SciPy `Rotation`; or rigid `Keyframes` alone.
    ends: "natural" (no angular acceleration there, M ≥ 2), "clamped" with `end_rates` (2, 3),
        body rates in rad/s, or "periodic" (M ≥ 4, the last keyframe equal to the first).
    turns: (M − 1,) whole turns added between neighbours, each about its own axis; negative
        ones go the other way round. signs: how those of neighbours are read, see `aligned`.
    norms: how far lengths of quaternions may be from 1; 1e-6 when left out.

    Raises InputError for what cannot be, SolveError where Newton does not converge.

    >>> keys = sm.examples.random_keyframes(4, 60, seed=1)
    >>> curve = sm.quaternions.interpolate_quaternions(keys.times, keys.rotations())
    >>> bool(np.allclose(curve.rotation(keys.times).as_matrix(), keys.linear))
    True
    """
    keys = OrientationKeys.of(times, quaternions, turns, signs, scalar_first=scalar_first, norms=norms)
    return interpolate_keys(keys, ends, end_rates, tolerance=tolerance, max_iterations=max_iterations)


def interpolate_keys(
    keys: OrientationKeys,
    ends: str,
    end_rates: ArrayLike | None = None,
    *,
    tolerance: float = 1e-12,
    max_iterations: int = 200,
) -> QuaternionMotion:
    """The curve of `interpolate_quaternions` through checked keyframes."""
    choice(ends, ENDS, "end condition")
    origin, since = from_origin(keys.times)
    if origin:
        # In times from the origin on; the curve alone knows it.
        there = interpolate_keys(
            replace(keys, times=since), ends, end_rates, tolerance=tolerance, max_iterations=max_iterations
        )
        return replace(there, basis=replace(there.basis, origin=origin))
    rates = _end_rates(ends, end_rates)
    if ends == "periodic":
        if len(keys) < 4:
            raise InputError(f"{len(keys)} keyframes are too few for periodic ends: at least 4 are needed")
        keys.require_closed()
        basis = BSplineBasis.closed(keys.times, 3)
    else:
        basis = BSplineBasis.clamped(keys.times, 3)
    point, miss = _continued(keys, basis, ends, rates, tolerance, max_iterations)
    if not miss <= tolerance:
        raise SolveError(
            f"no quaternion curve found through the keyframes: {miss:.2g} rad off after {max_iterations} iterations "
            f"(tolerance {tolerance:g}). Add keyframes where neighbours turn far, or lower the end rates"
        )
    # The chain of increments decides; the controls follow it to rounding.
    return QuaternionMotion(basis, *point)


Point = tuple[np.ndarray, np.ndarray]  # control quaternions (n, 4), increments


def _continued(
    keys: OrientationKeys, basis: BSplineBasis, ends: str, rates: np.ndarray | None, tolerance: float, budget: int
) -> tuple[Point, float]:
    """The solution by Newton, else by continuation in keyframes whose ways grow to their full length.

    Returns it with what it misses by, in rad; budget: Newton steps in all.
    """
    share, pace, reached, point = 0.0, 1.0, keys, None
    start = _start(keys, ends, rates)
    while budget > 0 and pace > 1e-3:
        target = min(1.0, share + pace)
        wanted = tolerance if target == 1.0 else 1e-6
        goal = keys if target == 1.0 else keys.scaled(target)
        start = _start(goal, ends, rates) if point is None else _carried(point, reached, goal, basis, target / share)
        moved, miss, steps = _newton(_System(goal, basis, rates), start, wanted, min(budget, 15))
        budget -= steps
        if miss <= wanted:
            point, reached, share, pace = moved, goal, target, 1.5 * pace
            if target == 1.0:
                return point, miss
        else:
            pace /= 3
    whole = _System(keys, basis, rates)
    return start, 2 * whole.miss(whole.residual(*start))


def _carried(
    point: Point, reached: OrientationKeys, goal: OrientationKeys, basis: BSplineBasis, growth: float
) -> Point:
    """A solution for one set of keyframes as the start for the next: each control moves with its keyframe."""
    near = _nearest(reached.times, basis.greville)
    offsets = log(product(conjugate(reached.quaternions[near]), point[0]))
    # A logarithm of the other sign is a whole turn longer.
    offsets = np.where(np.linalg.norm(offsets, axis=1, keepdims=True) > np.pi / 2, 0.0, offsets)
    return product(goal.quaternions[near], exp(growth * offsets)), growth * point[1]


def _newton(system: "_System", point: Point, tolerance: float, most: int) -> tuple[Point, float, int]:
    """Newton's method with step control: the point, what it misses by in rad, the steps taken."""
    residual = system.residual(*point)
    for taken in range(most):
        size, miss = np.linalg.norm(residual), 2 * system.miss(residual)
        if miss <= 1e-3 * tolerance:
            return point, miss, taken
        step = splu(system.jacobian(*point)).solve(-residual)
        length = 1.0
        while True:
            moved = _moved(*point, length * step)
            fresh = system.residual(*moved)
            if np.linalg.norm(fresh) <= (1 - 1e-4 * length) * size or length < 0.05:
                break
            length /= 2
        if np.linalg.norm(fresh) >= size:
            # At the rounding level the norm no longer falls.
            return point, miss, taken + 1
        point, residual = moved, fresh
    return point, 2 * system.miss(residual), most


def _end_rates(ends: str, end_rates: ArrayLike | None) -> np.ndarray | None:
    if (ends == "clamped") != (end_rates is not None):
        raise InputError("end_rates go with clamped ends, and clamped ends need them")
    if end_rates is None:
        return None
    rates = numbers(end_rates, "end_rates")
    if rates.shape != (2, 3) or not np.isfinite(rates).all():
        raise InputError(f"end_rates of shape {rates.shape}: finite body rates, (2, 3) in rad/s, are needed")
    return rates


def _start(keys: OrientationKeys, ends: str, rates: np.ndarray | None) -> tuple[np.ndarray, np.ndarray]:
    """Control quaternions and increments as if turns commuted, which is exact about one axis."""
    unrolled = keys.unrolled
    drift = np.zeros(3)
    if ends == "periodic":
        # Turns that do not sum to zero are carried by a straight part, which has no bend.
        drift = unrolled[-1] / (keys.times[-1] - keys.times[0])
        flat = unrolled - drift * (keys.times - keys.times[0])[:, None]
        spline = cubic_interpolant(keys.times, flat, "periodic")
        where = spline.basis.greville
        points = spline.control_points + drift * (where - keys.times[0])[:, None]
        closing = points[0] + unrolled[-1] - points[-1]
        increments = np.concatenate([np.diff(points, axis=0), closing[None]])
    else:
        spline = cubic_interpolant(keys.times, unrolled, ends, None if rates is None else rates / 2)
        points, where = spline.control_points, spline.basis.greville
        increments = np.diff(points, axis=0)
    near = _nearest(keys.times, where)
    return product(keys.quaternions[near], exp(points - unrolled[near])), increments


def _nearest(times: np.ndarray, where: np.ndarray) -> np.ndarray:
    """The index of the time next to each place."""
    return np.searchsorted(0.5 * (times[1:] + times[:-1]), where)


def _moved(controls: np.ndarray, increments: np.ndarray, step: np.ndarray) -> Point:
    n = len(controls)
    moved = product(controls, exp(step[: 3 * n].reshape(-1, 3)))
    moved /= np.linalg.norm(moved, axis=1, keepdims=True)
    return moved, increments + step[3 * n :].reshape(-1, 3)


class _System:
    """The conditions on turns δ_j of the controls and changes of the increments ω_l, and their banded Jacobian.

    Keyframes log(q_i⁻¹ q(t_i)) = 0; the chain log(q_l⁻¹ q_{l−1} exp(ω_l)) = 0; end conditions,
    which are linear in the ω. With increments as unknowns of their own no logarithm has to know
    its branch, whatever the number of turns.
    """

    def __init__(self, keys: OrientationKeys, basis: BSplineBasis, rates: np.ndarray | None):
        self.basis, self.n = basis, basis.n
        used = slice(0, len(keys) - 1) if basis.periodic else slice(None)
        self.inverse_keys = conjugate(keys.quaternions[used])
        times = keys.times[used]
        spans, weights = cumulative(basis, times)
        self.base = spans - basis.degree
        self.weights = np.stack(weights[0])
        self.way = self.n if basis.periodic else self.n - 1
        self.following = (np.arange(self.way) + 1) % self.n
        self.ends, self.wanted = self._end_conditions(rates)

    def _end_conditions(self, rates: np.ndarray | None) -> tuple[np.ndarray, np.ndarray]:
        """(2, way) coefficients c and (2, 3) values r of the conditions Σ c_l ω_l = r."""
        ends = np.zeros((0 if self.basis.periodic else 2, self.way))
        wanted = np.zeros((len(ends), 3))
        if len(ends):
            # At the right end exp(ω_n) leaves ω_n as it is, so both ends read alike.
            nu = 2 if rates is None else 1
            t = np.array(self.basis.domain)
            spans, weights = cumulative(self.basis, t, nu)
            for row, base in enumerate(spans - self.basis.degree):
                ends[row, base : base + self.basis.degree] = [w[row] for w in weights[nu]]
            scale = np.abs(ends).max(axis=1, keepdims=True)
            wanted = (0 if rates is None else rates / 2) / scale * np.ones((2, 3))
            ends /= scale
        return ends, wanted

    def _place(self, factor: int) -> np.ndarray:
        """(m,) which increment each keyframe's factor has."""
        return (self.base + factor) % self.way

    def residual(self, controls: np.ndarray, increments: np.ndarray) -> np.ndarray:
        q = controls[self.base]
        for m, b in enumerate(self.weights):
            q = product(q, exp(increments[self._place(m)] * b[:, None]))
        keys = short_log(product(self.inverse_keys, q))
        chain = short_log(product(conjugate(controls[self.following]), product(controls[: self.way], exp(increments))))
        return np.concatenate([keys.ravel(), chain.ravel(), (self.ends @ increments - self.wanted).ravel()])

    def miss(self, residual: np.ndarray) -> float:
        """The largest condition, in half angles."""
        return float(np.abs(residual).max(initial=0.0))

    def jacobian(self, controls: np.ndarray, increments: np.ndarray) -> sparse.csc_array:
        m, n, way = len(self.base), self.n, self.way
        rows, columns, values = [], [], []

        def put(row: np.ndarray, column: np.ndarray, blocks: np.ndarray) -> None:
            r = 3 * row[:, None, None] + np.arange(3)[:, None]
            c = 3 * column[:, None, None] + np.arange(3)
            rows.append(np.broadcast_to(r, blocks.shape).ravel())
            columns.append(np.broadcast_to(c, blocks.shape).ravel())
            values.append(blocks.ravel())

        here = np.arange(m)
        later = np.broadcast_to(np.eye(3), (m, 3, 3))  # turns at a factor, seen behind all later ones
        for k in range(len(self.weights) - 1, -1, -1):
            place = self._place(k)
            scaled = increments[place] * self.weights[k][:, None]
            put(here, n + place, later @ (right_jacobian(scaled) * self.weights[k][:, None, None]))
            later = later @ _matrix(conjugate(exp(scaled)))
        put(here, self.base, later)
        chain = m + np.arange(way)
        put(chain, np.arange(way), _matrix(conjugate(exp(increments))))
        put(chain, n + np.arange(way), right_jacobian(increments))
        put(chain, self.following, np.broadcast_to(-np.eye(3), (way, 3, 3)))
        for row, coefficients in enumerate(self.ends):
            used = np.flatnonzero(coefficients)
            put(np.full(len(used), m + way + row), n + used, coefficients[used, None, None] * np.eye(3))
        size = 3 * (n + way)
        entries = (np.concatenate(values), (np.concatenate(rows), np.concatenate(columns)))
        return sparse.csc_array(entries, shape=(size, size))


def _matrix(q: np.ndarray) -> np.ndarray:
    """(N, 3, 3) the rotation matrices of unit quaternions."""
    return np.swapaxes(rotate(q[:, None, :], np.eye(3)), -1, -2)
