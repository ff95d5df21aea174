"""Motions made of motions: at other times, one after the other, as seen from each other; and the paths of points."""

from collections.abc import Iterable
from math import factorial
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
from numpy.typing import ArrayLike

from symmotion import checks
from symmotion.brief import between, instant
from symmotion.curves.series import Series, compose, product
from symmotion.curves.timing import ArcParameter, require_warp, solutions
from symmotion.errors import InputError
from symmotion.motions.affine import AffineMotion
from symmotion.motions.motion import matrix, trajectory
from symmotion.motions.position import Affine, homogeneous
from symmotion.pictures import as_html, plot_positions
from symmotion.saving import save
from symmotion.splines import BSplineBasis, Spline
from symmotion.splines.instants import distinct, no_part, put_inside, rounding_in
from symmotion.values import read_only, value

# Any: of whatever kind, from a motion of one's own to a curve of quaternions, which turns about the origin.
AnyMotion = Any


class _Derived(Protocol):
    """What motions made of motions have: a domain, and derivatives of their homogeneous matrices (N, d + 1, d + 1)."""

    @property
    def dimension(self) -> int: ...

    @property
    def domain(self) -> tuple[float, float]: ...

    def matrices(self, t: np.ndarray, nu: int) -> np.ndarray: ...


def _positions(self: _Derived, t: ArrayLike, nu: int = 0) -> Affine:
    """The nu-th derivative at times t: linear t.shape + (d, d), translation t.shape + (d,).

    As far as the motions that it is made of have one.
    """
    times, d = put_inside(t, self.domain), self.dimension
    found = self.matrices(times.ravel(), checks.whole(nu, 0, "derivative order")).reshape(*times.shape, d + 1, d + 1)
    return Affine(found[..., :d, :d], found[..., :d, d])


def _told(self: _Derived) -> str:
    a, b = self.domain
    return f"{type(self).__name__}({self.dimension}D, times {between(a, b)})"


@value
class RetimedMotion:
    """The motion M(w(t)): the same positions, passed as the warp w says.

    motion: of any kind; warp: w, a scalar `Spline`, as from `slow_in_out`, or an `ArcParameter`, with values in the
    motion's domain. Raises InputError where the warp leaves it.

    >>> motion = sm.interpolants.component_cubic(sm.examples.planar_keyframes())
    >>> slow = sm.motions.RetimedMotion(motion, sm.curves.smooth_step())
    >>> bool((slow(0.5).linear == motion(0.5).linear).all()), slow(0.0, 1).translation
    (True, array([0., 0.]))
    """

    motion: AnyMotion
    warp: Spline | ArcParameter

    def __post_init__(self):
        require_warp(self.warp, self.motion.domain, "out of the motion's domain")

    @property
    def dimension(self) -> int:
        """Of the space that the body is in, d = 2 or 3."""
        return dimension_of(self.motion)

    @property
    def domain(self) -> tuple[float, float]:
        """First and last of the new times."""
        return self.warp.domain

    @property
    def breakpoints(self) -> np.ndarray:
        """(K,) the times between which it is smooth."""
        inner = marks_of(self.motion)[1:-1]
        if isinstance(self.warp, ArcParameter):
            return distinct(np.concatenate([self.warp.breakpoints, self.warp.preimages(inner)]), self.domain)
        times = [self.warp.breakpoints, *(solutions(self.warp, at) for at in inner)]
        return distinct(np.concatenate(times), self.domain)

    def matrices(self, t: np.ndarray, nu: int) -> np.ndarray:
        """(N, d + 1, d + 1) the nu-th derivatives of the homogeneous matrices at times t (N,) of the domain."""
        inner = [np.asarray(self.warp(t, k)) / factorial(k) for k in range(nu + 1)]
        inner[0] = put_inside(inner[0], self.motion.domain)
        return factorial(nu) * compose(_series(self.motion, inner[0], nu), inner)[nu]

    __call__ = _positions
    __repr__ = _told
    matrix = matrix
    trajectory = trajectory
    save = save
    plot = plot_positions
    _repr_html_ = as_html


@value
class SequentialMotion:
    """Motions one after the other, each at the time at which the one before it ends; the first keeps its own times.

    motions: of any kinds, in one dimension. Where one ends and the next begins elsewhere the body jumps, and at that
    time is where the next begins. Raises InputError for none, and for dimensions that differ.

    >>> there = sm.interpolants.component_cubic(sm.examples.planar_keyframes())
    >>> both = sm.motions.SequentialMotion((there, sm.motions.reverse(there)))
    >>> both.domain, bool(np.allclose(both(2.0).translation, there(0.0).translation))
    ((0.0, 2.0), True)
    """

    motions: tuple[AnyMotion, ...]

    def __post_init__(self):
        if not isinstance(self.motions, Iterable):
            raise InputError(f"motions of type {type(self.motions).__name__}: a list of motions is needed")
        object.__setattr__(self, "motions", tuple(self.motions))
        if not self.motions:
            raise InputError("no motions: one or more is needed")
        found = {dimension_of(motion) for motion in self.motions}
        if len(found) > 1:
            raise InputError("motions in the plane and in space do not follow each other")

    @property
    def dimension(self) -> int:
        """Of the space that the body is in, d = 2 or 3."""
        return dimension_of(self.motions[0])

    @property
    def ends(self) -> np.ndarray:
        """(n + 1,) the time at which the first begins, and those at which each ends."""
        lengths = [b - a for a, b in (motion.domain for motion in self.motions)]
        return self.motions[0].domain[0] + np.concatenate([[0.0], np.cumsum(lengths)])

    @property
    def domain(self) -> tuple[float, float]:
        """First time of the first motion and last time of the last, one after the other."""
        return float(self.ends[0]), float(self.ends[-1])

    @property
    def breakpoints(self) -> np.ndarray:
        """(K,) the times between which it is smooth."""
        marks = [marks_of(m) - m.domain[0] + end for m, end in zip(self.motions, self.ends, strict=False)]
        return distinct(np.concatenate([self.ends, *marks]), self.ends)

    def matrices(self, t: np.ndarray, nu: int) -> np.ndarray:
        """(N, d + 1, d + 1) the nu-th derivatives of the homogeneous matrices at times t (N,) of the domain."""
        ends, d = self.ends, self.dimension
        which = np.clip(np.searchsorted(ends, t, side="right") - 1, 0, len(self.motions) - 1)
        found = np.empty((len(t), d + 1, d + 1))
        for k in np.unique(which):
            a, b = self.motions[k].domain
            found[which == k] = matrices_of(self.motions[k], np.clip(t[which == k] - ends[k] + a, a, b), nu)
        return found

    __call__ = _positions
    __repr__ = _told
    matrix = matrix
    trajectory = trajectory
    save = save
    plot = plot_positions
    _repr_html_ = as_html


@value
class RelativeMotion:
    """A motion as seen from a body that moves, N(t)⁻¹ M(t), while both do.

    motion, reference: M and N, of any kinds, in one dimension. Raises InputError where their times do not overlap,
    for dimensions that differ, and at times where N is singular.

    >>> keys = sm.examples.planar_keyframes()
    >>> motion = sm.interpolants.component_cubic(keys)
    >>> sm.motions.RelativeMotion(motion, motion)(0.3).linear.round(9) + 0.0
    array([[1., 0.],
           [0., 1.]])
    """

    motion: AnyMotion
    reference: AnyMotion

    def __post_init__(self):
        if dimension_of(self.motion) != dimension_of(self.reference):
            raise InputError("a motion in the plane and one in space are not seen from each other")
        a, b = self.domain
        if not b - a > rounding_in(a, b):
            raise InputError(
                f"the motions have domains {self.motion.domain} and {self.reference.domain}: no time in common"
            )

    @property
    def dimension(self) -> int:
        """Of the space that the bodies are in, d = 2 or 3."""
        return dimension_of(self.motion)

    @property
    def domain(self) -> tuple[float, float]:
        """First and last of the times that both motions have."""
        (a, b), (c, d) = self.motion.domain, self.reference.domain
        return max(a, c), min(b, d)

    @property
    def breakpoints(self) -> np.ndarray:
        """(K,) the times between which it is smooth."""
        both = np.concatenate([marks_of(self.motion), marks_of(self.reference)])
        a, b = self.domain
        return distinct(np.concatenate([[a, b], both[(both > a) & (both < b)]]), self.domain)

    def matrices(self, t: np.ndarray, nu: int) -> np.ndarray:
        """(N, d + 1, d + 1) the nu-th derivatives of the homogeneous matrices at times t (N,) of the domain."""
        moving, frame = (_series(m, np.clip(t, *m.domain), nu) for m in (self.motion, self.reference))
        try:
            inverse = [np.linalg.inv(frame[0])]
        except np.linalg.LinAlgError:
            i = int(np.argmin(np.abs(np.linalg.det(frame[0]))))
            raise InputError(f"the reference is singular at time {instant(t[i])}: nothing is seen from it") from None
        for k in range(1, nu + 1):
            inverse.append(-inverse[0] @ sum(frame[i] @ inverse[k - i] for i in range(1, k + 1)))
        return factorial(nu) * product(inverse, moving, np.matmul)[nu]

    __call__ = _positions
    __repr__ = _told
    matrix = matrix
    trajectory = trajectory
    save = save
    plot = plot_positions
    _repr_html_ = as_html


def part(motion: AnyMotion, start: float, end: float) -> "AffineMotion | RetimedMotion":
    """A motion between two times of its domain, at the same times; of an `AffineMotion` one again, exactly.

    start, end: in the unit of time of the motion, start < end.

    Raises InputError for times out of the domain or order.

    >>> motion = sm.interpolants.component_cubic(sm.examples.planar_keyframes())
    >>> piece = sm.motions.part(motion, 0.25, 0.5)
    >>> piece.domain, bool(np.allclose(piece(0.4).linear, motion(0.4).linear))
    ((0.25, 0.5), True)
    """
    a, b = _domain(motion)
    start, end = checks.number(start, "start"), checks.number(end, "end")
    slack = rounding_in(a, b)
    if not a - slack <= start < end <= b + slack or end - start <= slack:
        raise InputError(no_part("part", start, end, (a, b)))
    start, end = max(start, a), min(end, b)
    if isinstance(motion, AffineMotion):
        return AffineMotion.from_spline(motion.spline.part(start, end), motion.dimension)
    return RetimedMotion(motion, Spline(BSplineBasis.clamped([start, end], 1), np.array([start, end])))


def reverse(motion: AnyMotion) -> "AffineMotion | RetimedMotion":
    """The motion backwards, over the same domain; of an `AffineMotion` one again, exactly.

    motion: of any kind. Raises InputError for what is none.

    >>> motion = sm.interpolants.component_cubic(sm.examples.planar_keyframes())
    >>> bool(np.allclose(sm.motions.reverse(motion)(0.2).translation, motion(0.8).translation))
    True
    """
    if isinstance(motion, AffineMotion):
        return AffineMotion.from_spline(motion.spline.reversed(), motion.dimension)
    a, b = _domain(motion)
    return RetimedMotion(motion, Spline(BSplineBasis.clamped([a, b], 1), np.array([b, a])))


def concatenate(motions: Iterable[AnyMotion]) -> SequentialMotion:
    """Motions one after the other; see `SequentialMotion`.

    motions: one or more, of one dimension, of any kind. Raises InputError for others.

    >>> motion = sm.interpolants.component_cubic(sm.examples.planar_keyframes())
    >>> sm.motions.concatenate([motion, motion, motion]).domain
    (0.0, 3.0)
    """
    return SequentialMotion(motions)  # pyright: ignore[reportArgumentType] any iterable will do


@value
class PointPath:
    """The path of a body point: a curve, for `arc_length`, `speed`, `constant_speed` and whatever takes one.

    motion: of any kind; point: (d,). Raises InputError for a point of another dimension.

    >>> motion = sm.interpolants.component_cubic(sm.examples.planar_keyframes())
    >>> path = sm.motions.PointPath(motion, [1.0, 0.0])
    >>> steady = sm.motions.RetimedMotion(motion, sm.curves.ArcParameter(path))
    >>> bool(np.allclose(np.linalg.norm(steady.trajectory([1.0, 0.0], [0.2, 0.7], 1), axis=-1), 1))
    True
    """

    motion: AnyMotion
    point: np.ndarray

    if TYPE_CHECKING:
        # Whatever is like an array goes in; the field is an array.
        def __init__(self, motion: AnyMotion, point: ArrayLike) -> None: ...

    def __post_init__(self):
        point = checks.array(self.point, (dimension_of(self.motion),), "point")
        object.__setattr__(self, "point", read_only(point))

    def __repr__(self) -> str:
        return f"PointPath({self.motion!r}, point {self.point.tolist()})"

    @property
    def domain(self) -> tuple[float, float]:
        """First and last time, those of the motion."""
        return self.motion.domain

    @property
    def breakpoints(self) -> np.ndarray:
        """(K,) the times between which it is smooth."""
        return marks_of(self.motion)

    def __call__(self, t: ArrayLike, nu: int = 0, extrapolate: bool = False) -> np.ndarray:
        """The nu-th derivative at times t, t.shape + (d,); InputError outside the domain, `extrapolate` or not."""
        t = put_inside(t, self.domain)
        d = len(self.point)
        found = matrices_of(self.motion, t.ravel(), nu)[:, :d] @ np.append(self.point, 1.0)
        return found.reshape(*t.shape, d)

    def to_bspline(self) -> Spline:
        """The same path as a spline, of an `AffineMotion`; InputError of other motions."""
        if not isinstance(self.motion, AffineMotion):
            raise InputError(f"the path of a point of a {type(self.motion).__name__} is no polynomial spline")
        return Spline(self.motion.basis, self.motion.translation + self.motion.linear @ self.point)

    save = save


def matrices_of(motion: AnyMotion, t: np.ndarray, nu: int = 0) -> np.ndarray:
    """(N, d + 1, d + 1) derivatives of the homogeneous matrices of any motion at times t (N,)."""
    own = getattr(motion, "matrix", None)
    return homogeneous(motion(t, nu), float(nu == 0)) if own is None else own(t, nu)


def dimension_of(motion: AnyMotion) -> int:
    """2 or 3; asked of a matrix, since not all kinds of motion say it."""
    try:
        return matrices_of(motion, np.array([motion.domain[0]])).shape[-1] - 1
    except (AttributeError, TypeError):
        raise InputError(f"a {type(motion).__name__} is no motion: one with a domain and positions is needed") from None


def _domain(motion: AnyMotion) -> tuple[float, float]:
    """The motion's domain; InputError where it is no motion."""
    dimension_of(motion)
    return motion.domain


def marks_of(motion: AnyMotion) -> np.ndarray:
    """The times between which a motion is smooth, as far as it says."""
    own = getattr(motion, "breakpoints", None)
    return np.asarray(motion.domain if own is None else own, dtype=float)


def _series(motion: AnyMotion, t: np.ndarray, order: int) -> Series:
    return [matrices_of(motion, t, k) / factorial(k) for k in range(order + 1)]
