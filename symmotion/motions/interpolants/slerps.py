"""Quaternion curves by recursive slerps, the baselines that KKS compare with: slerp, squad, Shoemake's Bézier."""

from collections.abc import Callable
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from symmotion.brief import in_a_line
from symmotion.checks import floats, numbers, whole
from symmotion.errors import InputError
from symmotion.motions.keyframes import Keyframes
from symmotion.motions.motion import as_points
from symmotion.motions.position import homogeneous
from symmotion.motions.quaternions.algebra import Signs, aligned, as_quaternions, conjugate, exp, log, product, rotate
from symmotion.motions.quaternions.curve import Frame, QuaternionJet, checked_frame, turning
from symmotion.motions.quaternions.keys import OrientationKeys
from symmotion.pictures import as_html, plot_rates
from symmotion.saving import save
from symmotion.splines import check_times
from symmotion.splines.instants import inside
from symmotion.values import read_only, value

if TYPE_CHECKING:
    from symmotion.motions.rotations import Rotations

# Chebyshev nodes per segment: the curves are analytic there, and 40 resolve turns of 120° to rounding.
NODES = 40


def slerp(a: ArrayLike, b: ArrayLike, u: ArrayLike) -> np.ndarray:
    """a exp(u log(a⁻¹ b)), the geodesic from a to b (…, 4), scalar first, at u (…) in [0, 1] and beyond (KKS (3)).

    Raises InputError for numbers that are not real.

    >>> sm.interpolants.slerp([1.0, 0, 0, 0], [0, 0, 0, 1.0], 0.5).round(6)
    array([0.707107, 0.      , 0.      , 0.707107])
    """
    return product(a, exp(floats(u, "u")[..., None] * log(product(conjugate(a), b))))


@value
class SegmentCurve:
    """A quaternion curve in segments, each an analytic function of u = (t − t_i)/(t_{i+1} − t_i).

    times: (S + 1,) the ends of the segments; segment: from indices (N,) and u (N,) to (N, 4); of a
    function of your own it can be evaluated, but not saved.
    Derivatives are those of its Chebyshev interpolant per segment; at a joint, of the segment that begins there.

    Raises InputError for times outside of the domain.

    >>> curve = sm.interpolants.slerp_curve([0.0, 1.0], [[1, 0, 0, 0], [0.6, 0, 0, 0.8]])
    >>> curve(0.5).round(6)
    array([0.894427, 0.      , 0.      , 0.447214])
    """

    times: np.ndarray
    segment: Callable[[np.ndarray, np.ndarray], np.ndarray]

    def __post_init__(self):
        object.__setattr__(self, "times", read_only(check_times(self.times, "joint")))

    def __repr__(self) -> str:
        a, b = self.domain
        return f"SegmentCurve({len(self.times) - 1} segments, times {a:g} to {b:g})"

    @property
    def dimension(self) -> int:
        """Of the space that the body is in: 3."""
        return 3

    @property
    def breakpoints(self) -> np.ndarray:
        """(M,) the ends of the segments."""
        return self.times

    @property
    def domain(self) -> tuple[float, float]:
        """First and last time, those of the keyframes."""
        return float(self.times[0]), float(self.times[-1])

    def _place(self, t: ArrayLike) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        t = numbers(t, "times")
        a, b = self.domain
        if not inside(t, (a, b)).all():
            raise InputError(f"times must lie in the domain [{a:g}, {b:g}]")
        t = np.clip(t, a, b)
        i = np.clip(np.searchsorted(self.times, t.ravel(), side="right") - 1, 0, len(self.times) - 2)
        step = np.diff(self.times)[i]
        return i, (t.ravel() - self.times[i]) / step, step

    def __call__(self, t: ArrayLike, nu: int = 0) -> np.ndarray:
        """The nu-th derivative of the unit quaternion at times t: t.shape + (4,)."""
        nu = whole(nu, 0, "derivative order")
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

    def jet(self, t: ArrayLike, order: int = 2, frame: Frame = "body") -> QuaternionJet:
        """Orientation with rate [rad/s] and acceleration [rad/s²] at times t: Ω = 2 q⁻¹q̇, Ω̇ = 2 Im q⁻¹q̈."""
        if order not in (0, 1, 2):
            raise InputError(f"order {order!r}: 0 to 2 is needed")
        q = self(t)
        rates = [2 * product(conjugate(q), self(t, nu))[..., 1:] for nu in range(1, order + 1)]
        if checked_frame(frame) == "world":
            rates = [rotate(q, r) for r in rates]
        return QuaternionJet(q, *rates)

    def matrix(self, t: ArrayLike, nu: int = 0) -> np.ndarray:
        """The nu-th derivative (0 to 2) of ((R, 0), (0, 1)), turning about the origin, at times t: t.shape + (4, 4)."""
        return homogeneous(turning(self, t, nu), float(nu == 0))

    def trajectory(self, points: ArrayLike, t: ArrayLike, nu: int = 0) -> np.ndarray:
        """The nu-th derivative (0 to 2) of the paths of body points (P, 3), P = 1 for one: t.shape + (P, 3)."""
        return turning(self, t, nu)(as_points(points))

    save = save
    plot = plot_rates
    _repr_html_ = as_html


@value
class Slerps:
    """slerp(q_i, q_{i+1}, u) between quaternions (S + 1, 4)."""

    quaternions: np.ndarray

    __repr__ = in_a_line

    def __post_init__(self):
        object.__setattr__(self, "quaternions", read_only(numbers(self.quaternions, "quaternions")))

    def __call__(self, i: np.ndarray, u: np.ndarray) -> np.ndarray:
        return slerp(self.quaternions[i], self.quaternions[i + 1], u)


@value
class Squads:
    """slerp(slerp(q_i, q_{i+1}, u), slerp(s_i, s_{i+1}, u), 2u (1 − u)) with q and s (S + 1, 4)."""

    outer: Slerps
    inner: Slerps

    __repr__ = in_a_line

    def __call__(self, i: np.ndarray, u: np.ndarray) -> np.ndarray:
        return slerp(self.outer(i, u), self.inner(i, u), 2 * u * (1 - u))


@value
class SlerpBezier:
    """De Casteljau's algorithm with slerps on control quaternions (S, n + 1, 4)."""

    controls: np.ndarray

    __repr__ = in_a_line

    def __post_init__(self):
        object.__setattr__(self, "controls", read_only(numbers(self.controls, "control quaternions")))

    def __call__(self, i: np.ndarray, u: np.ndarray) -> np.ndarray:
        points = self.controls[i]
        while points.shape[1] > 1:
            points = slerp(points[:, :-1], points[:, 1:], u[:, None])
        return points[:, 0]


def slerp_curve(
    times: ArrayLike | Keyframes, quaternions: "Rotations | None" = None, *, scalar_first: bool = True
) -> SegmentCurve:
    """The piecewise slerp through keyframes (KKS figure 1): constant rate between them, which jumps there.

    times, quaternions: as for `interpolate_quaternions`; scalar_first: the order of the components.

    Raises InputError for times that do not increase, and quaternions that are not of length 1.

    >>> curve = sm.interpolants.slerp_curve([0.0, 1.0], [[1, 0, 0, 0], [0.6, 0, 0, 0.8]])
    >>> curve([0.0, 0.5, 1.0]).round(6)
    array([[1.      , 0.      , 0.      , 0.      ],
           [0.894427, 0.      , 0.      , 0.447214],
           [0.6     , 0.      , 0.      , 0.8     ]])
    """
    keys = OrientationKeys.of(times, quaternions, scalar_first=scalar_first)
    return SegmentCurve(keys.times, Slerps(keys.quaternions))


def squad(
    times: ArrayLike | Keyframes, quaternions: "Rotations | None" = None, *, scalar_first: bool = True
) -> SegmentCurve:
    """Shoemake's squad through keyframes: slerp(slerp(q_i, q_{i+1}, u), slerp(s_i, s_{i+1}, u), 2u (1 − u)).

    s_i = q_i exp(−(log q_i⁻¹q_{i+1} + log q_i⁻¹q_{i−1})/4), at the ends s = q. It is C¹ for uniform times.

    times, quaternions: as for `interpolate_quaternions`; scalar_first: the order of the components.

    Raises InputError for times that do not increase, and quaternions that are not of length 1.

    >>> keys = sm.examples.random_keyframes(4, 60, seed=1)
    >>> sm.interpolants.squad(keys)(keys.times).shape
    (4, 4)
    """
    keys = OrientationKeys.of(times, quaternions, scalar_first=scalar_first)
    q = keys.quaternions
    s = q.copy()
    to_next, to_last = log(product(conjugate(q[1:-1]), q[2:])), log(product(conjugate(q[1:-1]), q[:-2]))
    s[1:-1] = product(q[1:-1], exp(-(to_next + to_last) / 4))
    return SegmentCurve(keys.times, Squads(Slerps(q), Slerps(s)))


def shoemake_bezier(
    control_quaternions: ArrayLike,
    times: ArrayLike = (0.0, 1.0),
    signs: Signs = "align",
    *,
    scalar_first: bool = True,
) -> SegmentCurve:
    """Shoemake's Bézier curve of one or more segments by de Casteljau's algorithm with slerps.

    control_quaternions: (S, n + 1, 4), or (n + 1, 4) for one segment; times: (S + 1,); signs: as in `aligned`.

    scalar_first: the order of the components. Raises InputError for numbers of controls that make no segments.

    >>> curve = sm.interpolants.shoemake_bezier([[1, 0, 0, 0], [0.8, 0, 0, 0.6], [0.6, 0, 0, 0.8], [0, 0, 0, 1]])
    >>> curve(0.5).round(6)
    array([0.707107, 0.      , 0.      , 0.707107])
    """
    controls = numbers(control_quaternions, "control quaternions")
    controls = controls[None] if controls.ndim == 2 else controls
    times = check_times(times, "joint")
    if controls.ndim != 3 or len(controls) != len(times) - 1 or controls.shape[1] < 2:
        raise InputError(
            f"control quaternions of shape {controls.shape}: ({len(times) - 1}, n + 1, 4) is needed for these times"
        )
    what = "control quaternion"
    q = np.stack([aligned(as_quaternions(c, what, scalar_first=scalar_first), signs, what) for c in controls])
    return SegmentCurve(times, SlerpBezier(q))


def shoemake_interpolant(
    times: ArrayLike | Keyframes, quaternions: "Rotations | None" = None, *, scalar_first: bool = True
) -> SegmentCurve:
    """Shoemake's cubic Bézier curves through keyframes, with his inner controls on great circles (SIGGRAPH 1985).

    The tangent at a keyframe bisects the double of the way in and the way out; inner controls lie a third
    of the way along it, for the length of each interval. The end segments leave towards their other inner control.

    times, quaternions: as for `interpolate_quaternions`; scalar_first: the order of the components.

    Raises InputError for times that do not increase, and quaternions that are not of length 1.

    >>> keys = sm.examples.random_keyframes(4, 60, seed=1)
    >>> sm.interpolants.shoemake_interpolant(keys).domain
    (0.0, 3.0)
    """
    keys = OrientationKeys.of(times, quaternions, scalar_first=scalar_first)
    times, q = keys.times, keys.quaternions
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
