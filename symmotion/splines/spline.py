"""Spline functions as values: evaluation, exact knot insertion, exact degree elevation."""

from functools import cached_property
from typing import TYPE_CHECKING, Protocol, runtime_checkable

import numpy as np

from symmotion.brief import between
from symmotion.checks import numbers, whole
from symmotion.errors import InputError
from symmotion.saving import save
from symmotion.splines.basis import BSplineBasis
from symmotion.splines.instants import no_part
from symmotion.values import read_only, value

if TYPE_CHECKING:
    from scipy.interpolate import BSpline


@value
class Spline:
    """The spline Σ N_j(t) c_j.

    basis: its B-splines; control_points: (n, …), any trailing shape.

    Raises InputError for numbers of controls that the basis does not have, and times outside of its domain.

    >>> spline = sm.splines.Spline(sm.splines.BSplineBasis.clamped([0.0, 1.0], 1), [[0.0, 0.0], [2.0, 4.0]])
    >>> spline(0.5), spline(0.5, nu=1)
    (array([1., 2.]), array([2., 4.]))
    """

    basis: BSplineBasis
    control_points: np.ndarray

    def __post_init__(self):
        controls = numbers(self.control_points, "control points")
        if controls.ndim == 0 or len(controls) != self.basis.n:
            raise InputError(
                f"control points of shape {controls.shape} for a basis of {self.basis.n} functions: "
                f"the first axis must be {self.basis.n}"
            )
        object.__setattr__(self, "control_points", read_only(controls))

    def __repr__(self) -> str:
        (a, b), shape = self.domain, self.control_points.shape[1:]
        kind = f"{self.basis.n} controls{f' of shape {shape}' if shape else ''}"
        return f"Spline({'periodic, ' if self.basis.periodic else ''}degree {self.degree}, {kind}, {between(a, b)})"

    @property
    def degree(self) -> int:
        """The degree of its polynomials."""
        return self.basis.degree

    @property
    def domain(self) -> tuple[float, float]:
        """First and last parameter."""
        return self.basis.domain

    @property
    def breakpoints(self) -> np.ndarray:
        """(K,) the borders of the polynomial pieces, ends of the domain included."""
        return self.basis.breakpoints

    def to_bspline(self) -> "Spline":
        """Itself: the call that brings every curve to B-spline form."""
        return self

    def __call__(self, t, nu: int = 0, extrapolate: bool = False) -> np.ndarray:
        """The nu-th derivative at t: shape t.shape + control_points.shape[1:].

        Raises InputError outside the domain unless `extrapolate`: then a periodic spline goes
        round and a clamped one continues its end pieces.
        """
        t, nu = numbers(t, "times"), whole(nu, 0, "derivative order")
        if not np.isfinite(t).all():
            raise InputError("parameters must be finite")
        if not extrapolate:
            self.basis.spans(t)
        t = t - self.basis.origin
        if nu > self.degree:
            return np.zeros(t.shape + self.control_points.shape[1:])
        return self._scipy(t, nu)

    @cached_property
    def _scipy(self) -> "BSpline":
        from scipy.interpolate import BSpline  # here, since it is a fifth of the time of `import symmotion`

        controls, p = self.control_points, self.degree
        if self.basis.periodic:
            controls = np.concatenate([controls, controls[:p]])
        return BSpline(self.basis.knots, controls, p, extrapolate="periodic" if self.basis.periodic else True)

    @cached_property
    def relative(self) -> "Spline":
        """The same spline with its origin at zero: its parameters are times from the origin on."""
        return Spline(self.basis.relative, self.control_points)

    def about(self, origin: float) -> "Spline":
        """The same function of time with the knots counted from another origin."""
        return self if origin == self.basis.origin else Spline(self.basis.about(origin), self.control_points)

    def derivative(self, nu: int = 1) -> "Spline":
        """The nu-th derivative as a spline of degree p − nu with controls p (c_{j+1} − c_j) / (t_{j+p+1} − t_{j+1})."""
        nu = whole(nu, 0, "derivative order")
        spline = self.clamped() if nu else self
        for _ in range(nu):
            p, knots, c = spline.degree, spline.basis.knots, spline.control_points
            if p == 0:
                return Spline(spline.basis, np.zeros_like(c))
            widths = knots[p + 1 : -1] - knots[1 : -p - 1]
            # A knot with more copies than the lower degree can have: a function without support goes with one of them.
            kept = widths > 0
            slopes = np.diff(c, axis=0)[kept] * (p / widths[kept]).reshape(-1, *(1,) * (c.ndim - 1))
            lower = BSplineBasis(np.delete(knots[1:-1], np.flatnonzero(~kept)), p - 1, origin=self.basis.origin)
            spline = Spline(lower, slopes)
        return spline

    def clamped(self) -> "Spline":
        """The same function over its domain on a clamped knot vector."""
        if not self.basis.periodic:
            return self
        a, b = self.relative.domain
        p, origin = self.degree, self.basis.origin
        inner = self.basis.knots[(self.basis.knots > a) & (self.basis.knots < b)]
        target = BSplineBasis(np.concatenate([np.full(p + 1, a), inner, np.full(p + 1, b)]), p, origin=origin)
        around = BSplineBasis(self.basis.knots, p, origin=origin)
        opened = Spline(around, np.concatenate([self.control_points, self.control_points[:p]]))
        return Spline(target, _blossom(opened, _windows(target, p), _piece(target, opened.basis)))

    def part(self, start: float, end: float) -> "Spline":
        """The same function between two times of its domain, on a clamped knot vector there."""
        a, b = self.domain
        if not a <= start < end <= b:
            raise InputError(no_part("part", start, end, (a, b)))
        plain, p, origin = self.clamped(), self.degree, self.basis.origin
        first, last, knots = start - origin, end - origin, plain.basis.knots
        inner = knots[(knots > first) & (knots < last)]
        target = BSplineBasis(np.concatenate([np.full(p + 1, first), inner, np.full(p + 1, last)]), p, origin=origin)
        return Spline(target, _blossom(plain, _windows(target, p), _piece(target, plain.basis)))

    def reversed(self) -> "Spline":
        """The same function backwards, over the same domain."""
        plain = self.clamped()
        knots, p = plain.basis.knots[::-1], self.degree
        a, b = knots[-p - 1], knots[p]
        turned = np.where(knots == a, b, np.where(knots == b, a, a + b - knots))
        return Spline(BSplineBasis(turned, p, origin=plain.basis.origin), plain.control_points[::-1])

    def refined(self, new_knots) -> "Spline":
        """The same function with knots inserted (Oslo algorithm: a control is the blossom of its knots)."""
        target = self.basis.with_knots(new_knots)
        return Spline(target, _blossom(self, _windows(target, self.degree), _piece(target, self.basis)))

    def elevated(self, times: int = 1) -> "Spline":
        """The same function with the degree raised: the new blossom averages the old one over its arguments."""
        spline = self
        for _ in range(times):
            p = spline.degree + 1
            target = spline.basis.elevated()
            arguments, piece = _windows(target, p), _piece(target, spline.basis)
            parts = [_blossom(spline, np.delete(arguments, i, axis=1), piece) for i in range(p)]
            spline = Spline(target, np.mean(parts, axis=0))
        return spline

    save = save


def _windows(basis: BSplineBasis, length: int) -> np.ndarray:
    """(n, length) the knots strictly inside the support of each function: its control's blossom arguments."""
    if length == 0:
        return np.empty((basis.n, 0))
    return np.lib.stride_tricks.sliding_window_view(basis.knots[1:-1], length)[: basis.n]


def _piece(target: BSplineBasis, source: BSplineBasis) -> np.ndarray:
    """(n,) a span of `source` inside the support of each target function: any one has the blossom wanted."""
    k = np.arange(target.n)
    left, right = target.knots[k], target.knots[k + target.degree + 1]
    # The support may be made of several spans; its widest step holds no knot of the source inside.
    steps = np.lib.stride_tricks.sliding_window_view(target.knots, target.degree + 2)[: target.n]
    widest = np.argmax(np.diff(steps, axis=1), axis=1)
    middle = 0.5 * (steps[k, widest] + steps[k, widest + 1])
    return source.relative.spans(np.clip(middle, left, right))


def _blossom(spline: Spline, arguments: np.ndarray, span: np.ndarray) -> np.ndarray:
    """The blossom of the polynomial pieces `span` (N,) at `arguments` (N, p): de Boor, one argument a step."""
    p, knots = spline.degree, spline.basis.knots
    controls = spline.control_points
    points = controls[span[:, None] + np.arange(-p, 1)]
    tail = (1,) * (controls.ndim - 1)
    for r in range(p):
        left = knots[span[:, None] + np.arange(r + 1 - p, 1)]
        right = knots[span[:, None] + np.arange(1, p - r + 1)]
        share = ((arguments[:, r, None] - left) / (right - left)).reshape(left.shape + tail)
        points = (1 - share) * points[:, :-1] + share * points[:, 1:]
    return points[:, 0]


@runtime_checkable
class SplineLike(Protocol):
    """A curve that can be written as a spline.

    >>> curve: sm.splines.SplineLike = sm.curves.bezier([[0.0], [1.0]])
    >>> curve.to_bspline().degree
    1
    """

    def to_bspline(self) -> Spline:
        """The same curve as a spline."""
        ...
