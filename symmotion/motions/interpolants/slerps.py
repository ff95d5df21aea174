"""Quaternion curves by recursive slerps, the baselines that KKS compare with: slerp, squad, Shoemake's Bézier."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from symmotion.errors import InputError
from symmotion.motions.pictures import as_html, plot_rates
from symmotion.motions.quaternions.algebra import Signs, aligned, as_quaternions, conjugate, exp, log, product, rotate
from symmotion.motions.quaternions.curve import Frame, QuaternionJet, _require_frame
from symmotion.splines import check_times

# Chebyshev nodes per segment: the curves are analytic there, and 40 resolve turns of 120° to rounding.
NODES = 40


def slerp(a, b, u) -> np.ndarray:
    """a exp(u log(a⁻¹ b)), the geodesic from a to b (…, 4) at u (…), u in [0, 1] and beyond (KKS (3))."""
    return product(a, exp(np.asarray(u, dtype=float)[..., None] * log(product(conjugate(a), b))))


@dataclass(frozen=True, eq=False)
class SegmentCurve:
    """A quaternion curve in segments, each an analytic function of u = (t − t_i)/(t_{i+1} − t_i).

    times: (S + 1,) the ends of the segments; segment: from indices (N,) and u (N,) to (N, 4).
    Derivatives are those of its Chebyshev interpolant per segment; at a joint, of the segment that begins there.
    """

    times: np.ndarray
    segment: Callable[[np.ndarray, np.ndarray], np.ndarray]

    @property
    def domain(self) -> tuple[float, float]:
        return float(self.times[0]), float(self.times[-1])

    def _place(self, t) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        t = np.asarray(t, dtype=float)
        a, b = self.domain
        if not ((t >= a) & (t <= b)).all():
            raise InputError(f"times must lie in the domain [{a:g}, {b:g}]")
        i = np.clip(np.searchsorted(self.times, t.ravel(), side="right") - 1, 0, len(self.times) - 2)
        step = np.diff(self.times)[i]
        return i, (t.ravel() - self.times[i]) / step, step

    def __call__(self, t, nu: int = 0) -> np.ndarray:
        """The nu-th derivative of the unit quaternion at times t: t.shape + (4,)."""
        i, u, step = self._place(t)
        if nu == 0:
            values = self.segment(i, u)
        else:
            table = self._coefficients
            for _ in range(nu):
                table = np.polynomial.chebyshev.chebder(table)
            values = np.stack(
                [np.polynomial.chebyshev.chebval(2 * u - 1, table[:, i, c], tensor=False) for c in range(4)], axis=1
            )
            values *= (2 / step[:, None]) ** nu
        return values.reshape(*np.shape(t), 4)

    @cached_property
    def _coefficients(self) -> np.ndarray:
        """(NODES, S, 4) Chebyshev coefficients of the segments."""
        count = len(self.times) - 1
        x = np.cos(np.pi * (np.arange(NODES) + 0.5) / NODES)
        index = np.repeat(np.arange(count), NODES)
        samples = self.segment(index, np.tile((x + 1) / 2, count)).reshape(count, NODES, 4)
        return np.polynomial.chebyshev.chebfit(x, samples.transpose(1, 0, 2).reshape(NODES, -1), NODES - 1).reshape(
            NODES, count, 4
        )

    def jet(self, t, order: int = 2, frame: Frame = "body") -> QuaternionJet:
        """Orientation with rate [rad/s] and acceleration [rad/s²] at times t: Ω = 2 q⁻¹q̇, Ω̇ = 2 Im q⁻¹q̈."""
        if order not in (0, 1, 2):
            raise InputError(f"order {order!r}: 0 to 2 is needed")
        q = self(t)
        rates = [2 * product(conjugate(q), self(t, nu))[..., 1:] for nu in range(1, order + 1)]
        if _require_frame(frame) == "world":
            rates = [rotate(q, r) for r in rates]
        return QuaternionJet(q, *rates)

    plot = plot_rates
    _repr_html_ = as_html


def slerp_curve(times, quaternions) -> SegmentCurve:
    """The piecewise slerp through keyframes (KKS figure 1): constant rate between them, which jumps there."""
    times, q = _keys(times, quaternions)
    return SegmentCurve(times, lambda i, u: slerp(q[i], q[i + 1], u))


def squad(times, quaternions) -> SegmentCurve:
    """Shoemake's squad through keyframes: slerp(slerp(q_i, q_{i+1}, u), slerp(s_i, s_{i+1}, u), 2u (1 − u)).

    s_i = q_i exp(−(log q_i⁻¹q_{i+1} + log q_i⁻¹q_{i−1})/4), at the ends s = q. It is C¹ for uniform times.
    """
    times, q = _keys(times, quaternions)
    s = q.copy()
    to_next, to_last = log(product(conjugate(q[1:-1]), q[2:])), log(product(conjugate(q[1:-1]), q[:-2]))
    s[1:-1] = product(q[1:-1], exp(-(to_next + to_last) / 4))

    def segment(i: np.ndarray, u: np.ndarray) -> np.ndarray:
        return slerp(slerp(q[i], q[i + 1], u), slerp(s[i], s[i + 1], u), 2 * u * (1 - u))

    return SegmentCurve(times, segment)


def shoemake_bezier(control_quaternions, times=(0.0, 1.0), signs: Signs = "align") -> SegmentCurve:
    """Shoemake's Bézier curve of one or more segments by de Casteljau's algorithm with slerps.

    control_quaternions: (S, n + 1, 4), or (n + 1, 4) for one segment; times: (S + 1,); signs: as in `aligned`.
    """
    controls = np.asarray(control_quaternions, dtype=float)
    controls = controls[None] if controls.ndim == 2 else controls
    times = check_times(times, "joint")
    if controls.ndim != 3 or len(controls) != len(times) - 1 or controls.shape[1] < 2:
        raise InputError(
            f"control quaternions of shape {controls.shape}: ({len(times) - 1}, n + 1, 4) is needed for these times"
        )
    q = np.stack([aligned(as_quaternions(c, "control quaternion"), signs, "control quaternion") for c in controls])

    def segment(i: np.ndarray, u: np.ndarray) -> np.ndarray:
        points = q[i]
        while points.shape[1] > 1:
            points = slerp(points[:, :-1], points[:, 1:], u[:, None])
        return points[:, 0]

    return SegmentCurve(times, segment)


def shoemake_interpolant(times, quaternions) -> SegmentCurve:
    """Shoemake's cubic Bézier curves through keyframes, with his inner controls on great circles (SIGGRAPH 1985).

    The tangent at a keyframe bisects the double of the way in and the way out; inner controls lie a third
    of the way along it, for the length of each interval. The end segments leave towards their other inner control.
    """
    times, q = _keys(times, quaternions)
    inner_out, inner_in = q.copy(), q.copy()
    doubled = 2 * np.sum(q[:-2] * q[1:-1], axis=1, keepdims=True) * q[1:-1] - q[:-2]
    middle = doubled + q[2:]
    tangent = log(product(conjugate(q[1:-1]), middle / np.linalg.norm(middle, axis=1, keepdims=True)))
    # For uniform times this is a third of the tangent's way; else in proportion to the interval.
    share = np.diff(times)[:, None] * 2 / 3
    both = (times[2:] - times[:-2])[:, None]
    inner_out[1:-1] = product(q[1:-1], exp(tangent * share[1:] / both))
    inner_in[1:-1] = product(q[1:-1], exp(-tangent * share[:-1] / both))
    if len(q) > 2:
        inner_out[0] = slerp(q[0], inner_in[1], np.array(0.5))
        inner_in[-1] = slerp(q[-1], inner_out[-2], np.array(0.5))
    return shoemake_bezier(np.stack([q[:-1], inner_out[:-1], inner_in[1:], q[1:]], axis=1), times)


def _keys(times, quaternions) -> tuple[np.ndarray, np.ndarray]:
    q = aligned(as_quaternions(quaternions, "keyframe", 2))
    times = check_times(times)
    if len(times) != len(q):
        raise InputError(f"{len(times)} times for {len(q)} quaternions: one of each per keyframe is needed")
    return times, q
