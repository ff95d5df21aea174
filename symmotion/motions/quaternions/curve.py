"""Unit quaternion curves in cumulative form: Bézier, Hermite and B-spline curves with simple derivatives (KKS)."""

from dataclasses import replace
from functools import cached_property, partial
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from symmotion.brief import between
from symmotion.checks import numbers
from symmotion.curves.bezier import check_domain
from symmotion.errors import InputError
from symmotion.motions.quaternions.algebra import (
    Signs,
    aligned,
    as_quaternions,
    conjugate,
    exp,
    from_rotation,
    increments_between,
    log,
    product,
    rotate,
    ways_like,
)
from symmotion.motions.quaternions.jets import bspline_factors, evaluate
from symmotion.motions.quaternions.turning import (
    Frame,
    QuaternionJet,
    acceleration,
    asked,
    checked_frame,
    derivative,
    jerk,
    matrix,
    rate,
    rotation,
    trajectory,
)
from symmotion.pictures import as_html, plot_rates
from symmotion.saving import save
from symmotion.splines import BSplineBasis
from symmotion.values import read_only, value

if TYPE_CHECKING:
    from scipy.spatial.transform import Rotation

    from symmotion.motions.rotations import Rotations


@value
class QuaternionMotion:
    """The unit quaternion curve q(t) = q_0 Π exp(ω_i B̃_i(t)), B̃_i = Σ_{j ≥ i} B_j (KKS (7)).

    basis: the B-splines B_j, of degree 1 or more, clamped or not or periodic; control_points:
    (n, 4) unit quaternions q_i, scalar first; increments: (n − 1, 3), of a periodic curve (n, 3)
    with the way from the last to the first, half-angle vectors ω_i with q_{i−1} exp(ω_i) = ± q_i.
    Left out, they are the shortest ways between the control quaternions with aligned signs.

    The curve is C^{degree − 1} at simple knots, and a control quaternion moves it on degree + 1 spans only.

    Raises InputError for controls that are no unit quaternions, increments that do not lead between them, and times
    outside.

    >>> curve = sm.quaternions.QuaternionMotion.bezier([[1, 0, 0, 0], [0.8, 0, 0, 0.6], [0, 0, 0, 1]])
    >>> curve(0.0), curve.rate(0.0).round(3) + 0.0
    (array([1., 0., 0., 0.]), array([0.   , 0.   , 2.574]))
    """

    basis: BSplineBasis
    control_points: np.ndarray
    # None only on the way in: the shortest ways are put in its place.
    increments: np.ndarray = None  # pyright: ignore[reportAssignmentType]

    def __post_init__(self):
        n, closed = self.basis.n, self.basis.periodic
        if self.basis.degree < 1:
            raise InputError("a quaternion curve needs degree 1 or more")
        q = as_quaternions(self.control_points, "control quaternion")
        if len(q) != n:
            raise InputError(f"{len(q)} control quaternions: {n} are needed for this basis")
        way = n if closed else n - 1
        if self.increments is None:
            q = aligned(q, what="control quaternion")
            increments = increments_between(q)
            if closed:
                last = q[:1] * (1 if q[0] @ q[-1] >= 0 else -1)
                increments = np.concatenate([increments, log(product(conjugate(q[-1:]), last))])
        else:
            increments = numbers(self.increments, "increments")
            if increments.shape != (way, 3) or not np.isfinite(increments).all():
                raise InputError(f"increments of shape {increments.shape}: finite, ({way}, 3) is needed")
            q, error = _chained(q, increments)
            if error.max(initial=0.0) > 1e-6:
                i = int(np.argmax(error > 1e-6))
                raise InputError(
                    f"increment {i} does not lead from control quaternion {i} to the next one: off by {error[i]:.2g}"
                )
        object.__setattr__(self, "control_points", read_only(q))
        object.__setattr__(self, "increments", read_only(increments))

    @staticmethod
    def bezier(
        control_quaternions: "Rotations",
        turns: ArrayLike | None = None,
        span: tuple[float, float] = (0.0, 1.0),
        signs: Signs = "align",
        *,
        scalar_first: bool = True,
    ) -> "QuaternionMotion":
        """The Bézier quaternion curve of degree n over `span` (KKS (10)).

        control_quaternions: (n + 1, 4) or a `Rotation`, n ≥ 1; turns: (n,) whole physical turns
        added to each increment; signs: as in `aligned`.
        """
        q = as_quaternions(control_quaternions, "control quaternion", least=2, scalar_first=scalar_first)
        return QuaternionMotion.bspline(BSplineBasis.clamped(check_domain(span, "span"), len(q) - 1), q, turns, signs)

    @staticmethod
    def bspline(
        basis: BSplineBasis,
        control_quaternions: "Rotations",
        turns: ArrayLike | None = None,
        signs: Signs = "align",
        *,
        scalar_first: bool = True,
    ) -> "QuaternionMotion":
        """The B-spline quaternion curve of any order over any knots (KKS 5.3), with whole extra turns.

        turns: (n − 1,) physical turns added to each increment along its own direction, (n,) of a periodic curve with
        the way from the last control to the first; signs: as in `aligned`.
        """
        q = as_quaternions(control_quaternions, "control quaternion", least=2, scalar_first=scalar_first)
        if len(q) != basis.n:
            raise InputError(
                f"{len(q)} control quaternions for a basis of degree {basis.degree} with {basis.n} functions: "
                f"{basis.n} are needed"
            )
        way = np.concatenate([q, q[:1]]) if basis.periodic else q
        way = aligned(way, signs, "control quaternion")
        return QuaternionMotion(basis, way[: len(q)], increments_between(way, turns, "control quaternion"))

    @staticmethod
    def uniform(
        control_quaternions: "Rotations",
        turns: ArrayLike | None = None,
        span: tuple[float, float] = (0.0, 1.0),
        signs: Signs = "align",
        *,
        scalar_first: bool = True,
    ) -> "QuaternionMotion":
        """The uniform cubic B-spline curve from the first control to the last, without acceleration there.

        A phantom control lies beyond each end, by the increment that is there once more: q_0 exp(−ω_1), q_n exp(ω_n).

        control_quaternions: (n + 1, 4) or a `Rotation`, n ≥ 1; turns: (n,) whole physical turns
        added to each increment; span: its domain; signs: as in `aligned`.
        """
        what, (a, b) = "control quaternion", check_domain(span, "span")
        q = aligned(as_quaternions(control_quaternions, what, least=2, scalar_first=scalar_first), signs, what)
        ways = increments_between(q, turns, what)
        q = np.concatenate([product(q[:1], exp(-ways[:1])), q, product(q[-1:], exp(ways[-1:]))])
        knots = (b - a) * np.arange(-3.0, len(ways) + 4) / len(ways)
        return QuaternionMotion(BSplineBasis(knots, 3, origin=a), q, np.concatenate([ways[:1], ways, ways[-1:]]))

    @staticmethod
    def hermite(
        start: ArrayLike,
        end: ArrayLike,
        start_rate: ArrayLike,
        end_rate: ArrayLike,
        turns: int = 0,
        span: tuple[float, float] = (0.0, 1.0),
        frame: Frame = "body",
        *,
        scalar_first: bool = True,
    ) -> "QuaternionMotion":
        """The cubic Hermite quaternion curve from `start` to `end` with given end rates (KKS 5.2).

        start, end: unit quaternions (4,); rates: (3,) in rad/s, in the body's or the world's frame;
        turns: whole physical turns added to the middle factor along its own direction; the end
        rates stay. ω_1 = ω_a/3, ω_3 = ω_b/3, ω_2 = log(exp(ω_1)⁻¹ q_a⁻¹ q_b exp(ω_3)⁻¹).
        """
        ends = as_quaternions(np.stack([start, end]), "end quaternion", scalar_first=scalar_first)
        outer = [numbers(r, "end rates") for r in (start_rate, end_rate)]
        if any(r.shape != (3,) or not np.isfinite(r).all() for r in outer):
            raise InputError("end rates: two finite vectors (3,) in rad/s are needed")
        rates = np.stack(outer)
        a, b = check_domain(span, "span")
        if checked_frame(frame) == "world":
            rates = rotate(conjugate(ends), rates)
        outer = rates * (b - a) / 6
        inner = np.stack([product(ends[0], exp(outer[0])), product(ends[1], exp(-outer[1]))])
        inner = aligned(inner, what="inner control quaternion")
        middle = increments_between(inner, np.array([turns]), "inner control quaternion")
        controls = np.stack([ends[0], inner[0], inner[1], ends[1]])
        return QuaternionMotion(
            BSplineBasis.clamped([a, b], 3), controls, np.concatenate([outer[:1], middle, outer[1:]])
        )

    @property
    def dimension(self) -> int:
        """Of the space that the body is in: 3."""
        return 3

    @property
    def degree(self) -> int:
        """The degree of the spline of quaternions that is normalised."""
        return self.basis.degree

    @property
    def domain(self) -> tuple[float, float]:
        """First and last time."""
        return self.basis.domain

    @property
    def breakpoints(self) -> np.ndarray:
        """(K,) the borders of the spans, ends of the domain included."""
        return self.basis.breakpoints

    @cached_property
    def relative(self) -> "QuaternionMotion":
        """The same curve with its origin in time at zero: its times count from the origin on."""
        return self if self.basis.origin == 0 else replace(self, basis=self.basis.relative)

    def about(self, origin: float) -> "QuaternionMotion":
        """The same curve with its knots counted from another origin in time."""
        return self if origin == self.basis.origin else replace(self, basis=self.basis.about(origin))

    @property
    def turns(self) -> np.ndarray:
        """(n − 1,) whole physical turns in each increment beyond the short way."""
        return np.round(np.linalg.norm(self.increments, axis=1) / np.pi).astype(int)

    def __repr__(self) -> str:
        a, b = self.domain
        return f"QuaternionMotion(degree {self.degree}, {self.basis.n} control quaternions, times {between(a, b)})"

    @cached_property
    def table(self) -> tuple[np.ndarray, np.ndarray]:
        """Control quaternions (4, n) and, by the control they lead to, axis and half angle of the increments (4, n)."""
        shifted = np.zeros((self.basis.n, 3))
        if self.basis.periodic:
            shifted = np.roll(self.increments, 1, axis=0)
        else:
            shifted[1:] = self.increments
        angle = np.linalg.norm(shifted, axis=1)
        axis = shifted / np.where(angle > 0, angle, 1.0)[:, None]
        return np.ascontiguousarray(self.control_points.T), np.concatenate([axis.T, angle[None]])

    def jet(self, t: ArrayLike, order: int = 2, frame: Frame = "body") -> QuaternionJet:
        """Orientation with its angular rates up to `order` (≤ 3) at times t, in one pass; in the body's or world frame.

        InputError outside the domain.
        """
        t, world = asked(t, order, frame)
        q, rates = evaluate(partial(bspline_factors, self.basis, self.table), t.ravel(), order, world)
        return QuaternionJet(q.reshape(*t.shape, 4), *(r.reshape(*t.shape, 3) for r in rates))

    __call__ = derivative
    matrix = matrix
    trajectory = trajectory
    rotation = rotation
    rate = rate
    acceleration = acceleration
    jerk = jerk

    def with_control(self, i: int, quaternion: ArrayLike, *, scalar_first: bool = True) -> "QuaternionMotion":
        """The same curve with control quaternion i replaced, turned the short way to both its neighbours.

        Where increments had whole turns more, they keep them: the curve changes on degree + 1 spans, and nowhere else.
        """
        if not -self.basis.n <= i < self.basis.n:
            raise InputError(f"control quaternion {i} does not exist: there are {self.basis.n}")
        q, i = self.control_points.copy(), i % self.basis.n
        q[i] = as_quaternions(np.atleast_2d(quaternion), "control quaternion", scalar_first=scalar_first)[0]
        increments = self.increments.copy()
        for k in (i - 1, i) if self.basis.periodic else range(max(0, i - 1), min(self.basis.n - 1, i + 1)):
            ends = aligned(q[[k, (k + 1) % self.basis.n]], what="control quaternion")
            if self.turns[k]:
                increments[k] = ways_like(increments[[k]], ends[:1], ends[1:])[0]
            else:
                increments[k] = increments_between(ends)[0]
        return replace(self, control_points=q, increments=increments)

    save = save
    plot = plot_rates
    _repr_html_ = as_html


def from_rotations(rotation: "Rotation") -> np.ndarray:
    """Scalar-first unit quaternions with aligned signs of a SciPy `Rotation` of M rotations, for the constructors."""
    return aligned(as_quaternions(from_rotation(rotation)))


def _chained(q: np.ndarray, increments: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """q with the signs that the increments lead to, and how far each increment misses (way,)."""
    following = np.roll(q, -1, axis=0)[: len(increments)]
    reached = product(q[: len(increments)], exp(increments))
    cosine = np.sum(reached * following, axis=1)
    error = np.linalg.norm(reached - np.where(cosine < 0, -1, 1)[:, None] * following, axis=1)
    signs = np.cumprod(np.where(cosine < 0, -1.0, 1.0))
    return q * np.concatenate([[1.0], signs])[: len(q), None], error
