"""How a curve is passed in time: speed, arc length, constant speed, slow-in and slow-out."""

from functools import cached_property
from math import factorial

import numpy as np

from symmotion.brief import between, instant, instants
from symmotion.checks import floats, numbers, whole
from symmotion.curves.bezier import bezier, check_domain
from symmotion.curves.curve import Curve
from symmotion.curves.series import compose, product, reciprocal, root, taylor
from symmotion.curves.stops import derivatives, from_rest, resting
from symmotion.errors import InputError, SolveError
from symmotion.saving import save
from symmotion.splines import BSplineBasis, Integral, Spline, from_origin, integrate
from symmotion.splines.instants import distinct, inside, no_part, put_inside
from symmotion.values import value

LEAST_DIGITS = 6  # of a length that is of use: rounding may leave fewer than are asked for


def speed(curve: Curve, t) -> np.ndarray:
    """‖x'(t)‖, the shape of t; of a scalar curve |x'(t)|.

    curve: of any kind; t: (…) in its domain. Raises InputError for times outside of it.

    >>> sm.curves.speed(sm.curves.bezier([[0.0, 0.0], [3.0, 4.0]]), [0.0, 1.0])
    array([5., 5.])
    """
    t = numbers(t, "times")
    return np.linalg.norm(curve(t, 1).reshape(*t.shape, -1), axis=-1)


def arc_length(curve: Curve, start: float | None = None, end: float | None = None) -> float:
    """∫ ‖x'(t)‖ dt from `start` to `end`, the ends of the domain when left out.

    Adaptive quadrature by pieces, to 1e-14 of the length or what rounding leaves: far from the origin x' has fewer
    digits. Raises InputError where the speed is no number, SolveError where the length is not found to six digits.

    curve: any, within its domain.

    >>> round(sm.curves.arc_length(sm.curves.bezier([[0.0, 0.0], [3.0, 4.0]])), 9)
    5.0
    """
    a, b = curve.domain
    start, end = a if start is None else float(start), b if end is None else float(end)
    if not a <= start <= end <= b:
        raise InputError(no_part("arc length", start, end, (a, b)))
    inner = curve.breakpoints[(curve.breakpoints > start) & (curve.breakpoints < end)]
    ends = np.concatenate([[start], inner, [end]])
    return _lengths(curve, ends[:-1], ends[1:]).value


def _lengths(curve: Curve, start: np.ndarray, end: np.ndarray) -> Integral:
    """(N,) arc lengths over intervals that each lie in one piece; see `arc_length`."""
    origin = 0.0
    if isinstance(curve, Spline):
        # From where it begins: so no digits of the times are lost to when that is.
        origin = curve.domain[0]
        curve = curve.about(origin).relative
    slope = derivatives(curve)
    found = integrate(lambda t: np.linalg.norm(slope(t, 1), axis=1), start - origin, end - origin, 1e-14)
    if not np.isfinite(found.error):
        raise InputError(f"the speed of the curve is no finite number near time {instant(found.worst[0] + origin, 9)}")
    if not found.reached and found.digits < LEAST_DIGITS:
        raise SolveError(
            f"the length of the curve is {found.value:.9g} to {found.digits} digits only: its speed is too rough about "
            f"time {instant(found.worst[0] + origin, 9)}"
        )
    return found


@value
class ArcParameter:
    """The parameter of a curve as a function of the arc length passed, scaled to a domain: a warp of constant speed.

    domain: of the new parameter; (0, length) when left out, which gives speed 1.

    Raises InputError for a curve of length zero.

    Finding parameters raises SolveError where the speed is too rough to be integrated.

    >>> curve = sm.curves.bezier([[0.0, 0.0], [0.0, 0.0], [4.0, 0.0]])
    >>> round(float(curve(sm.curves.ArcParameter(curve)(2.0))[0]), 6)
    2.0
    """

    curve: Curve
    # None only on the way in.
    domain: tuple[float, float] = None  # pyright: ignore[reportAssignmentType]

    def __post_init__(self):
        if not self.length > 0:
            raise InputError("the curve has no length: it stays at one point")
        object.__setattr__(self, "domain", (0.0, self.length) if self.domain is None else check_domain(self.domain))

    def __repr__(self) -> str:
        a, b = self.domain
        return f"ArcParameter(length {self.length:g} of {self.curve!r}, {between(a, b)})"

    @cached_property
    def _table(self) -> tuple[np.ndarray, np.ndarray]:
        """Parameters, and the arc length up to each."""
        # Halves of the pieces: brackets for the inversion.
        ends = self.curve.breakpoints
        t = np.sort(np.concatenate([ends, (ends[1:] + ends[:-1]) / 2]))
        return t, np.concatenate([[0.0], np.cumsum(_lengths(self.curve, t[:-1], t[1:]).parts)])

    @property
    def length(self) -> float:
        """The arc length of the whole curve."""
        return float(self._table[1][-1])

    @property
    def speed(self) -> float:
        """The constant speed, arc length per unit of the new parameter."""
        return self.length / (self.domain[1] - self.domain[0])

    @property
    def breakpoints(self) -> np.ndarray:
        """(N,) the new parameters of the curve's breakpoints, ascending."""
        return self.preimages(self.curve.breakpoints)

    def preimages(self, parameters) -> np.ndarray:
        """(N,) the new parameters of parameters of the curve."""
        parameters = np.atleast_1d(floats(parameters, "parameters"))
        table, sums = self._table
        k = np.clip(np.searchsorted(table, parameters, side="right") - 1, 0, len(table) - 2)
        return self.domain[0] + (sums[k] + _lengths(self.curve, table[k], parameters).parts) / self.speed

    def __call__(self, t, nu: int = 0, extrapolate: bool = False) -> np.ndarray:
        """The nu-th derivative at t, the shape of t; for nu > 0 InputError where the curve itself stops: infinite."""
        t = put_inside(t, self.domain)
        u = self._inverse(t.ravel()).reshape(t.shape)
        if nu == 0:
            return u
        stops = self.stops(u.ravel())
        if not np.isnan(stops).all():
            raise InputError(
                f"the curve stops at time {instant(stops[~np.isnan(stops)][0], 9)}: the derivatives of its parameter "
                "by the arc length are infinite there"
            )
        # ds/du = ‖x'‖ as a series; then du/ds = 1/‖x'(u(s))‖ gives one coefficient of u after the other.
        slopes = [(k + 1) * c.reshape(*t.shape, -1) for k, c in enumerate(taylor(self.curve, u, nu)[1:])]
        pace = root(product(slopes, slopes, lambda a, b: (a * b).sum(axis=-1)))
        slowness = [self.speed * c for c in reciprocal(pace)]
        series = [u]
        for k in range(nu):
            series.append(compose(slowness[: k + 1], series)[k] / (k + 1))
        return factorial(nu) * series[nu]

    def stops(self, parameters: np.ndarray) -> np.ndarray:
        """(N,) the parameters of the curve at which it stops, NaN for the others."""
        a, b = self.curve.domain
        return resting(self.curve, parameters, self.length / (b - a))

    def _inverse(self, t: np.ndarray) -> np.ndarray:
        """Newton's method in brackets, bisection where it would leave them, for all t (N,) at once."""
        table, sums = self._table
        wanted = np.clip((t - self.domain[0]) * self.speed, 0.0, sums[-1])
        k = np.clip(np.searchsorted(sums, wanted, side="right") - 1, 0, len(table) - 2)
        base, low, high = table[k], table[k], table[k + 1]
        rest = wanted - sums[k]
        share = rest / np.where(sums[k + 1] > sums[k], sums[k + 1] - sums[k], 1.0)
        u = low + share * (high - low)
        for _ in range(60):
            passed = _lengths(self.curve, base, u)
            error = passed.parts - rest
            known = max(1e-14 * sums[-1], passed.error / len(u))
            low, high = np.where(error <= 0, u, low), np.where(error >= 0, u, high)
            if np.all((np.abs(error) <= known) | (high - low <= 1e-15 * np.abs(table).max())):
                break
            with np.errstate(divide="ignore", invalid="ignore"):
                step = u - error / speed(self.curve, u)
            u = np.where((step >= low) & (step <= high), step, (low + high) / 2)
        return u


def require_warp(warp: Spline | ArcParameter, domain: tuple[float, float], outside: str) -> None:
    """Raise InputError unless a warp is of scalars with values in the domain of what it times; outside: where else."""
    ends, (a, b) = np.asarray(warp(np.array(warp.domain))), domain
    if ends.shape != (2,):
        raise InputError("a time warp must be a curve of scalars")
    if not inside(ends, (a, b)).all():
        first, last, low, high = instants(*ends, a, b)
        raise InputError(f"the warp leads from {first} to {last}, {outside} [{low}, {high}]")


@value
class Retimed:
    """The curve x(w(t)): the same path, passed as the warp w says.

    curve: x; warp: w, a scalar curve (a Spline, as from `slow_in_out`) or an ArcParameter, with
    values in the domain of the curve. Derivatives are composed as Taylor series, to any order.

    Raises InputError where the warp leaves the curve's domain.

    >>> curve = sm.curves.bezier([[0.0, 0.0], [4.0, 0.0]])
    >>> sm.curves.Retimed(curve, sm.curves.smooth_step())(0.25)
    array([0.625, 0.   ])
    """

    curve: Curve
    warp: Spline | ArcParameter

    def __post_init__(self):
        require_warp(self.warp, self.curve.domain, "which is not in the curve's domain")

    def __repr__(self) -> str:
        a, b = self.domain
        return f"Retimed({self.curve!r}, times {between(a, b)})"

    @property
    def domain(self) -> tuple[float, float]:
        """First and last of the new parameters."""
        return self.warp.domain

    @property
    def breakpoints(self) -> np.ndarray:
        """(K,) the borders between which the curve is smooth."""
        inner = self.curve.breakpoints[1:-1]
        if isinstance(self.warp, ArcParameter):
            return self.warp.breakpoints if self.warp.curve == self.curve else self.warp.preimages(inner)
        times = [self.warp.breakpoints, *(solutions(self.warp, value) for value in inner)]
        return distinct(np.concatenate(times), self.domain)

    def __call__(self, t, nu: int = 0, extrapolate: bool = False) -> np.ndarray:
        """The nu-th derivative at t; raises InputError outside the domain, `extrapolate` or not."""
        nu = whole(nu, 0, "derivative order")
        t = put_inside(t, self.domain)
        if nu and isinstance(self.warp, ArcParameter) and self.warp.curve == self.curve:
            stops = self.warp.stops(self.warp(t.ravel()))
            if not np.isnan(stops).all():
                return self._past_stops(self.warp, t, nu, stops)
        return self._composed(t, nu)

    def _past_stops(self, warp: ArcParameter, t: np.ndarray, nu: int, stops: np.ndarray) -> np.ndarray:
        """The nu-th derivative where the curve stops at some of the times t: its path goes on."""
        a, b = self.curve.domain
        mean, moving = warp.length / (b - a), np.isnan(stops)
        there = [from_rest(self.curve, stop, nu, mean) * warp.speed**nu for stop in stops[~moving]]
        shape = np.shape(self.curve(a))
        result = np.empty((t.size, *shape))
        result[~moving] = np.reshape(there, (-1, *shape))
        if moving.any():
            result[moving] = self._composed(t.ravel()[moving], nu)
        return result.reshape(*t.shape, *shape)

    def _composed(self, t: np.ndarray, nu: int) -> np.ndarray:
        inner = taylor(self.warp, t, nu)
        inner[0] = put_inside(inner[0], self.curve.domain)
        outer = taylor(self.curve, inner[0], nu)
        return factorial(nu) * compose(outer, inner)[nu]

    def to_bspline(self) -> Spline:
        """The same curve as a spline of degree p q with C⁰ knots, exact where warp and curve are splines."""
        if isinstance(self.warp, ArcParameter):
            raise InputError("a curve passed at constant speed is no polynomial spline")
        inner = self.curve.to_bspline()
        breaks, degree = self.breakpoints, max(1, inner.degree * self.warp.degree)
        share = np.arange(degree + 1) / degree
        times = (breaks[:-1, None] + np.diff(breaks)[:, None] * share).ravel()
        pieces = self(times).reshape(len(breaks) - 1, degree + 1, -1)
        controls = np.linalg.solve(BSplineBasis.clamped([0.0, 1.0], degree)(share), pieces)
        knots = np.concatenate([breaks[:1], np.repeat(breaks, degree), breaks[-1:]])
        joined = np.concatenate([controls[:, :-1].reshape(-1, controls.shape[2]), controls[-1, -1:]])
        return Spline(BSplineBasis(knots, degree), joined.reshape(-1, *inner.control_points.shape[1:]))

    save = save


def constant_speed(curve: Curve, domain: tuple[float, float] | None = None) -> Retimed:
    """The curve reparametrised to constant speed; by arc length, so with speed 1, when `domain` is left out.

    curve: of any kind; domain: of the new parameter. Raises InputError for a curve of length zero.

    >>> curve = sm.curves.bezier([[0.0, 0.0], [0.0, 1.0], [4.0, 1.0]])
    >>> sm.curves.speed(sm.curves.constant_speed(curve), [0.1, 1.0, 2.0]).round(6)
    array([1., 1., 1.])
    """
    return Retimed(curve, ArcParameter(curve, domain))  # pyright: ignore[reportArgumentType]


def slow_in_out(
    slow_in: float = 0.3,
    slow_out: float = 0.3,
    domain: tuple[float, float] = (0.0, 1.0),
    values: tuple[float, float] = (0.0, 1.0),
) -> Spline:
    """The time warp that speeds up, keeps its speed and slows down again: parabola, line, parabola, joined C¹.

    slow_in, slow_out: the shares of the domain for speeding up and slowing down, each ≥ 0,
    together at most 1; domain: of the new time; values: from where to where it leads.

    Raises InputError for shares that are negative or more than the whole.

    >>> sm.curves.slow_in_out(0.25, 0.25)([0.0, 0.5, 1.0], nu=1).round(6)
    array([0.      , 1.333333, 0.      ])
    """
    a, b = check_domain(domain)
    if not (slow_in >= 0 and slow_out >= 0 and slow_in + slow_out <= 1):
        raise InputError(
            f"slow_in {slow_in!r} and slow_out {slow_out!r}: shares ≥ 0 with a sum of at most 1 are needed"
        )
    ends = numbers(values, "values")
    if ends.shape != (2,) or not np.isfinite(ends).all():
        raise InputError(f"values {values!r}: the two values that the warp leads from and to are needed")
    # Greville points of the controls on the line of constant speed, which crosses 0 and 1 half-way through the ramps.
    u = np.array([s for s in (slow_in, 1 - slow_out) if 0 < s < 1])
    knots = np.concatenate([np.zeros(3), distinct(u), np.ones(3)])
    greville = (knots[1:-2] + knots[2:-1]) / 2
    line = (greville - slow_in / 2) / (1 - (slow_in + slow_out) / 2)
    # A ramp keeps its first two controls at the end value, which makes the speed zero there.
    line[greville <= slow_in / 2] = 0.0
    line[greville >= 1 - slow_out / 2] = 1.0
    origin, (first, last) = from_origin(np.array([a, b]))
    basis = BSplineBasis(first + (last - first) * knots, 2, origin=origin)
    return Spline(basis, ends[0] + (ends[1] - ends[0]) * line)


def smooth_step(order: int = 1, domain: tuple[float, float] = (0.0, 1.0)) -> Spline:
    """The time warp from 0 to 1 of degree 2 k + 1 whose first k derivatives are zero at both ends; k = `order`.

    domain: in the unit of time.

    Raises InputError for an order that is no whole number ≥ 0.

    >>> sm.curves.smooth_step()([0.0, 0.25, 1.0])
    array([0.     , 0.15625, 1.     ])
    """
    return bezier(np.repeat([0.0, 1.0], whole(order, 0, "order") + 1), domain)


def solutions(warp: Spline, value: float) -> np.ndarray:
    """The times at which a scalar spline takes a value."""
    from scipy.interpolate import BSpline, PPoly  # here: see Spline._scipy

    plain = warp.clamped()
    origin = plain.basis.origin
    a, b = warp.domain
    polynomials = PPoly.from_spline(BSpline(plain.basis.knots, plain.control_points, plain.degree))
    times = np.asarray(polynomials.solve(value, discontinuity=False, extrapolate=False))
    return np.clip(origin + times[np.isfinite(times)], a, b)
