"""Quaternion curves by recursive slerps, which KKS compare with: squad, Bézier curves, B-splines, Barry and Goldman."""

from collections.abc import Callable
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from symmotion.brief import between, in_a_line
from symmotion.checks import floats, numbers, whole
from symmotion.errors import InputError
from symmotion.motions.keyframes import Keyframes
from symmotion.motions.quaternions.algebra import Signs, aligned, as_quaternions, conjugate, exp, log, product, rotate
from symmotion.motions.quaternions.keys import OrientationKeys
from symmotion.motions.quaternions.turning import Frame, QuaternionJet, checked_frame, matrix, trajectory
from symmotion.pictures import as_html, plot_rates
from symmotion.saving import save
from symmotion.splines import BSplineBasis, check_times
from symmotion.splines.instants import put_inside
from symmotion.values import read_only, value

if TYPE_CHECKING:
    from symmotion.motions.rotations import Rotations

# Chebyshev nodes per segment: the curves are analytic there, and 40 resolve turns of 120° to rounding. Slerps that go
# on far beyond their ends take more, until the last coefficients are below the tail.
NODES, TAIL = (40, 80, 160), 1e-13


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
        return f"SegmentCurve({len(self.times) - 1} segments, times {between(a, b)})"

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
        t = put_inside(t, self.domain, "time")
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
        """(nodes, S, 4) Chebyshev coefficients of the segments."""
        count, table = len(self.times) - 1, np.empty(0)
        for nodes in NODES:
            x = np.cos(np.pi * (np.arange(nodes) + 0.5) / nodes)
            index = np.repeat(np.arange(count), nodes)
            samples = self.segment(index, np.tile((x + 1) / 2, count)).reshape(count, nodes, 4)
            columns = samples.transpose(1, 0, 2).reshape(nodes, -1)
            table = np.polynomial.chebyshev.chebfit(x, columns, nodes - 1).reshape(nodes, count, 4)
            if np.abs(table[-2:]).max() <= TAIL:
                break
        return table

    def jet(self, t: ArrayLike, order: int = 2, frame: Frame = "body") -> QuaternionJet:
        """Orientation with rate [rad/s] and acceleration [rad/s²] at times t: Ω = 2 q⁻¹q̇, Ω̇ = 2 Im q⁻¹q̈."""
        if order not in (0, 1, 2):
            raise InputError(f"order {order!r}: 0 to 2 is needed")
        q = self(t)
        rates = [2 * product(conjugate(q), self(t, nu))[..., 1:] for nu in range(1, order + 1)]
        if checked_frame(frame) == "world":
            rates = [rotate(q, r) for r in rates]
        return QuaternionJet(q, *rates)

    matrix = matrix
    trajectory = trajectory
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
class SlerpPyramid:
    """Slerps of neighbours among control quaternions (S, n + 1, 4), slerps among these, until one is left.

    intervals: (S, n (n + 1)/2, 2) the u between which each slerp goes, level after level: [0, 1] in all is de
    Casteljau's algorithm, those of knots de Boor's.
    """

    controls: np.ndarray
    intervals: np.ndarray

    __repr__ = in_a_line

    def __post_init__(self):
        object.__setattr__(self, "controls", read_only(numbers(self.controls, "control quaternions")))
        object.__setattr__(self, "intervals", read_only(numbers(self.intervals, "intervals")))

    @staticmethod
    def bezier(controls: np.ndarray) -> "SlerpPyramid":
        """De Casteljau's algorithm."""
        segments, count = controls.shape[:2]
        return SlerpPyramid(controls, np.broadcast_to([0.0, 1.0], (segments, count * (count - 1) // 2, 2)))

    def __call__(self, i: np.ndarray, u: np.ndarray) -> np.ndarray:
        points, done = self.controls[i], 0
        while (left := points.shape[1] - 1) > 0:
            start, end = np.moveaxis(self.intervals[i, done : done + left], -1, 0)
            points = slerp(points[:, :-1], points[:, 1:], (u[:, None] - start) / (end - start))
            done += left
        return points[:, 0]


@value
class Squads:
    """slerp(slerp(q_i, q_{i+1}, u), slerp(a_i, b_i, u), 2u (1 − u)) with q (S + 1, 4), and a and b (S, 2, 4)."""

    outer: Slerps
    inner: SlerpPyramid

    __repr__ = in_a_line

    def __call__(self, i: np.ndarray, u: np.ndarray) -> np.ndarray:
        return slerp(self.outer(i, u), self.inner(i, u), 2 * u * (1 - u))


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
    """Shoemake's squad through keyframes, C¹ at any times: two slerps, blended by a third with 2u (1 − u).

    slerp(slerp(q_i, q_{i+1}, u), slerp(a_i, b_i, u), 2u (1 − u)) has the rate of the parabola through ω_{i−1} and ω_i,
    v_i = (h_i ω_{i−1}/h_{i−1} + h_{i−1} ω_i/h_i)/(h_{i−1} + h_i), where a_i = q_i exp((h_i v_i − ω_i)/2) behind a
    keyframe, and b_{i−1} = q_i exp((ω_{i−1} − h_{i−1} v_i)/2) before it; at the ends they are the keyframes. At uniform
    times a_i = b_{i−1} = q_i exp(−(log q_i⁻¹q_{i+1} + log q_i⁻¹q_{i−1})/4), as in Shoemake 1987.

    times, quaternions: as for `interpolate_quaternions`; scalar_first: the order of the components.

    Raises InputError for times that do not increase, and quaternions that are not of length 1.

    >>> keys = sm.examples.random_keyframes(4, 60, seed=1)
    >>> sm.interpolants.squad(keys)(keys.times).shape
    (4, 4)
    """
    keys = OrientationKeys.of(times, quaternions, scalar_first=scalar_first)
    q, ways, steps = keys.quaternions, keys.ways, np.diff(keys.times)[:, None]
    mean = (steps[1:] * ways[:-1] / steps[:-1] + steps[:-1] * ways[1:] / steps[1:]) / (steps[1:] + steps[:-1])
    inner = np.stack([q[:-1], q[1:]], axis=1)
    inner[1:, 0] = product(q[1:-1], exp((steps[1:] * mean - ways[1:]) / 2))
    inner[:-1, 1] = product(q[1:-1], exp((ways[:-1] - steps[:-1] * mean) / 2))
    return SegmentCurve(keys.times, Squads(Slerps(q), SlerpPyramid.bezier(inner)))


def barry_goldman(
    times: ArrayLike | Keyframes, quaternions: "Rotations | None" = None, *, scalar_first: bool = True
) -> SegmentCurve:
    """Catmull–Rom by Barry and Goldman's pyramid with slerps: blends of slerps that go on beyond their keyframes.

    On [t_i, t_{i+1}] three slerps between the four keyframes around, two slerps of these on [t_{i−1}, t_{i+1}] and
    [t_i, t_{i+2}], and one of these. C¹ at any times. Before the first keyframe and behind the last one the way there
    is taken once more. Source: Barry and Goldman 1988, with slerps for straight lines (Schlag 1991).

    times, quaternions: as for `interpolate_quaternions`; scalar_first: the order of the components.

    Raises InputError for times that do not increase, and quaternions that are not of length 1.

    >>> keys = sm.examples.random_keyframes(4, 60, seed=1)
    >>> sm.interpolants.barry_goldman(keys)(keys.times).shape
    (4, 4)
    """
    keys = OrientationKeys.of(times, quaternions, scalar_first=scalar_first)
    t, q = keys.times, keys.quaternions
    t = np.concatenate([2 * t[:1] - t[1:2], t, 2 * t[-1:] - t[-2:-1]])
    q = np.concatenate([product(q[:1], exp(-keys.ways[:1])), q, product(q[-1:], exp(keys.ways[-1:]))])
    return _pyramid(keys.times, q, t, 3, [(0, 1), (1, 2), (2, 3), (0, 2), (1, 3), (1, 2)])


def slerp_bspline(basis: BSplineBasis, control_quaternions: "Rotations", *, scalar_first: bool = True) -> SegmentCurve:
    """The B-spline quaternion curve by de Boor's algorithm with slerps: C¹ at simple knots, and no more (KKS 1).

    basis: of degree 1 or more, not periodic; control_quaternions: one per function; scalar_first: the order of the
    components. Source: Schlag 1991; `QuaternionMotion` over the same basis is C^{degree − 1}.

    Raises InputError for a periodic basis, and where there are not as many quaternions as functions.

    >>> basis = sm.splines.BSplineBasis.clamped([0.0, 1.0, 2.0], 3)
    >>> sm.interpolants.slerp_bspline(basis, sm.examples.random_keyframes(5, 60, seed=1).rotations()).domain
    (0.0, 2.0)
    """
    if basis.periodic or basis.degree < 1:
        raise InputError("de Boor's algorithm with slerps takes a basis of degree 1 or more that is not periodic")
    what, p = "control quaternion", basis.degree
    q = aligned(as_quaternions(control_quaternions, what, scalar_first=scalar_first), what=what)
    if len(q) != basis.n:
        raise InputError(f"{len(q)} control quaternions: {basis.n} are needed for this basis")
    pairs = [(level + j, p + j) for level in range(p) for j in range(p - level)]
    spans = basis.spans(basis.breakpoints[:-1]) - p
    times = basis.origin + basis.knots[1:-1]
    return _pyramid(basis.breakpoints, q, times, p, pairs, spans)


def _pyramid(
    joints: np.ndarray,
    q: np.ndarray,
    times: np.ndarray,
    degree: int,
    pairs: list[tuple[int, int]],
    first: np.ndarray | None = None,
) -> SegmentCurve:
    """Segments between joints, of degree + 1 quaternions from `first` on, and slerps between the times of pairs."""
    first = np.arange(len(joints) - 1) if first is None else first
    intervals = times[first[:, None, None] + np.array(pairs)]
    intervals = (intervals - joints[:-1, None, None]) / np.diff(joints)[:, None, None]
    return SegmentCurve(joints, SlerpPyramid(q[first[:, None] + np.arange(degree + 1)], intervals))


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
    return SegmentCurve(times, SlerpPyramid.bezier(q))


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
