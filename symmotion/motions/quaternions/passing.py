"""The conditions that make a cumulative quaternion curve pass through keyframes, and their banded Jacobian."""

import numpy as np
from scipy import sparse

from symmotion.motions.quaternions.algebra import conjugate, exp, log, product, right_jacobian, rotate
from symmotion.motions.quaternions.keys import OrientationKeys
from symmotion.splines import BSplineBasis
from symmotion.splines.cumulative import cumulative

Point = tuple[np.ndarray, np.ndarray]  # control quaternions (n, 4), increments


class Passing:
    """The conditions on turns δ_j of the controls and changes of the increments ω_l, and their banded Jacobian.

    Keyframes log(q_i⁻¹ q(t_i)) = 0; the chain log(q_l⁻¹ q_{l−1} exp(ω_l)) = 0; end conditions,
    which are linear in the ω. With increments as unknowns of their own no logarithm has to know
    its branch, whatever the number of turns.
    All ways between keyframes, and the end rates, are shortened to `share` of their length, about the first keyframe.
    A closed motion is then closed up to a rotation G of the world, which grows with them: q(t + T) = G q(t).
    """

    def __init__(self, keys: OrientationKeys, basis: BSplineBasis, rates: np.ndarray | None):
        self.basis, self.n, self._keys = basis, basis.n, keys
        self._used = slice(0, len(keys) - 1) if basis.periodic else slice(None)
        times = keys.times[self._used]
        spans, weights = cumulative(basis, times)
        self.base = spans - basis.degree
        self.weights = np.stack(weights[0])
        self.way = self.n if basis.periodic else self.n - 1
        self.following = (np.arange(self.way) + 1) % self.n
        self.ends, self._whole = self._end_conditions(rates)
        self.shorten(1.0)

    def shorten(self, share: float) -> None:
        """Take keyframes whose ways have a share of their length."""
        keys = self._keys.scaled(share) if share != 1.0 else self._keys
        self._scaled = keys.quaternions
        self._wanted = share * self._whole
        self._closing = product(keys.quaternions[-1], conjugate(keys.quaternions[0]))
        if share == 1.0 and self.basis.periodic:
            self._closing = np.round(self._closing)

    def start(self) -> Point:
        """The solution where all ways have no length."""
        return np.repeat(self._keys.quaternions[:1], self.n, axis=0), np.zeros((self.way, 3))

    def drift(self, point: Point) -> np.ndarray:
        """The derivative of the residual by the share, where the keyframes are met."""
        # Ways turn about axes of their own, in the world those of the keyframe where they begin.
        turned = np.cumsum(rotate(self._scaled[:-1], self._keys.ways), axis=0)
        turned = np.concatenate([np.zeros((1, 3)), turned])
        keys, chain = rotate(conjugate(self._scaled), turned)[self._used], np.zeros((self.way, 3))
        if self.basis.periodic:
            chain[-1] = rotate(conjugate(product(self._closing, point[0][0])), turned[-1])
        return np.concatenate([-keys.ravel(), -chain.ravel(), -self._whole.ravel()])

    @staticmethod
    def moved(point: Point, step: np.ndarray) -> Point:
        """A point with its controls turned and its increments changed by a step."""
        controls, increments = point
        n = len(controls)
        fresh = product(controls, exp(step[: 3 * n].reshape(-1, 3)))
        fresh /= np.linalg.norm(fresh, axis=1, keepdims=True)
        return fresh, increments + step[3 * n :].reshape(-1, 3)

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

    def residual(self, point: Point) -> np.ndarray:
        """(unknowns,) what the conditions miss by, in half angles, and the end conditions."""
        controls, increments = point
        q = controls[self.base]
        for m, b in enumerate(self.weights):
            q = product(q, exp(increments[self._place(m)] * b[:, None]))
        keys = log(product(conjugate(self._scaled[self._used]), q))
        following = controls[self.following]
        if self.basis.periodic:
            following[-1] = product(self._closing, following[-1])
        chain = log(product(conjugate(following), product(controls[: self.way], exp(increments))))
        return np.concatenate([keys.ravel(), chain.ravel(), (self.ends @ increments - self._wanted).ravel()])

    @staticmethod
    def miss(residual: np.ndarray) -> float:
        """The largest condition, in rad."""
        return 2 * float(np.abs(residual).max(initial=0.0))

    def jacobian(self, point: Point) -> sparse.csc_array:
        """The residual's derivative by steps of `moved`, where the conditions hold."""
        controls, increments = point
        m, n, way = len(self.base), len(controls), self.way
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
