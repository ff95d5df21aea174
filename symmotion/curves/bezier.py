"""Bézier curves, de Casteljau's construction, and rational quadratics."""

from functools import cached_property
from math import comb

import numpy as np

from symmotion.brief import between
from symmotion.checks import numbers, whole
from symmotion.errors import InputError
from symmotion.saving import save
from symmotion.splines import BSplineBasis, Spline
from symmotion.values import read_only, value


def bernstein(degree: int, u, nu: int = 0) -> np.ndarray:
    """The nu-th derivatives of the Bernstein polynomials B_k(u) = C(L, k) (1 − u)^(L−k) u^k.

    u: (N,) in [0, 1]. Returns (N, L + 1), L the degree.

    Raises InputError for a degree that is no whole number ≥ 0, and u outside of [0, 1].

    >>> sm.curves.bernstein(2, 0.5)
    array([[0.25, 0.5 , 0.25]])
    """
    return BSplineBasis.clamped([0.0, 1.0], degree)(u, nu)


def bezier(control_points, domain: tuple[float, float] = (0.0, 1.0)) -> Spline:
    """The Bézier curve Σ B_k(u) P_k, u the share of the domain passed (lecture notes, "Bernstein polynomials").

    control_points: (L + 1, …), at least two, for degree L; domain: in units of time.

    Raises InputError for fewer than two points, or numbers that are not finite.

    >>> sm.curves.bezier([[0.0, 0.0], [1.0, 2.0], [2.0, 0.0]])(0.5)
    array([1., 1.])
    """
    points = _check_points(control_points)
    if len(points) < 2:
        raise InputError(f"a Bézier curve needs at least 2 control points, not {len(points)}")
    return Spline(BSplineBasis.clamped(check_domain(domain), len(points) - 1), points)


def de_casteljau(control_points, u: float) -> tuple[np.ndarray, ...]:
    """De Casteljau's construction of the point at u: P_k^r = (1 − u) P_k^{r−1} + u P_{k+1}^{r−1}.

    control_points: (L + 1, …); u: the share of the domain passed, below 0 or above 1 beyond its
    ends. Returns the levels r = 0 … L, arrays (L + 1 − r, …); the last one holds the curve's point.
    The first points of all levels are the controls of the part before u, the last ones of that after.

    Raises InputError for a parameter that is no finite number.

    >>> [level.tolist() for level in sm.curves.de_casteljau([0.0, 2.0, 0.0], 0.5)]
    [[0.0, 2.0, 0.0], [1.0, 1.0], [1.0]]
    """
    points = _check_points(control_points)
    if np.ndim(u) or not np.isfinite(u):
        raise InputError(f"parameter {u!r}: one finite number is needed")
    levels = [points]
    while len(levels[-1]) > 1:
        levels.append((1 - u) * levels[-1][:-1] + u * levels[-1][1:])
    return tuple(levels)


def check_domain(domain, what: str = "domain") -> tuple[float, float]:
    """The two ends of a domain as floats; InputError unless finite and increasing."""
    ends = numbers(domain, what)
    if ends.shape != (2,) or not np.isfinite(ends).all() or ends[0] >= ends[1]:
        raise InputError(f"{what} {domain!r}: two finite times, the first before the second, are needed")
    return float(ends[0]), float(ends[1])


def _check_points(control_points) -> np.ndarray:
    points = numbers(control_points, "control points")
    if points.ndim == 0 or not len(points):
        raise InputError("control points: an array with one row per point is needed")
    finite = np.isfinite(points.reshape(len(points), -1)).all(axis=1)
    if not finite.all():
        raise InputError(f"control point {int(np.argmin(finite))} is not finite")
    return points


@value
class RationalQuadratic:
    """The conic arc (P₀ (1−u)² + 2 w P₁ u (1−u) + P₂ u²) / ((1−u)² + 2 w u (1−u) + u²) (lecture notes).

    control_points: (3, …); weight: w > −1, so that the denominator has no root on the arc;
    w < 1 gives an ellipse, w = 1 a parabola, w > 1 a hyperbola; domain: in units of time.

    Raises InputError unless there are three points and the weight is above −1.

    >>> arc = sm.curves.RationalQuadratic([[1.0, 0.0], [1.0, 1.0], [0.0, 1.0]], np.sqrt(0.5))
    >>> np.linalg.norm(arc(np.linspace(0, 1, 5)), axis=1).round(9)
    array([1., 1., 1., 1., 1.])
    """

    control_points: np.ndarray
    weight: float
    domain: tuple[float, float] = (0.0, 1.0)

    def __post_init__(self):
        points = _check_points(self.control_points)
        if len(points) != 3:
            raise InputError(f"a rational quadratic has 3 control points, not {len(points)}")
        if not np.isfinite(self.weight) or self.weight <= -1:
            raise InputError(
                f"weight {self.weight!r}: must be above −1, where the arc passes through infinity "
                "(below 1 an ellipse, 1 a parabola, above 1 a hyperbola)"
            )
        object.__setattr__(self, "control_points", read_only(points))
        object.__setattr__(self, "weight", float(self.weight))
        object.__setattr__(self, "domain", check_domain(self.domain))

    def __repr__(self) -> str:
        a, b = self.domain
        return f"RationalQuadratic({self.kind}, weight {self.weight:g}, times {between(a, b)})"

    @property
    def kind(self) -> str:
        """What conic it is an arc of: "ellipse", "parabola" or "hyperbola"."""
        return "parabola" if self.weight == 1 else "ellipse" if self.weight < 1 else "hyperbola"

    @property
    def breakpoints(self) -> np.ndarray:
        """(2,) the ends: it is one piece."""
        return np.array(self.domain)

    @cached_property
    def homogeneous(self) -> Spline:
        """The arc exactly as B-splines in homogeneous coordinates: controls (3, d + 1), the last one the weight."""
        weights = np.array([1.0, self.weight, 1.0])[:, None]
        points = weights * self.control_points.reshape(3, -1)
        return bezier(np.concatenate([points, weights], axis=1), self.domain)

    def __call__(self, t, nu: int = 0, extrapolate: bool = False) -> np.ndarray:
        """The nu-th derivative at t: shape t.shape + control_points.shape[1:].

        From (w x)⁽ᵏ⁾ = Σ C(k, i) w⁽ⁱ⁾ x⁽ᵏ⁻ⁱ⁾. Raises InputError outside the domain unless `extrapolate`.
        """
        nu = whole(nu, 0, "derivative order")
        jets = [self.homogeneous(t, k, extrapolate) for k in range(min(nu, 2) + 1)]
        derivatives: list[np.ndarray] = []
        for k in range(nu + 1):
            total = jets[k][..., :-1] if k < 3 else np.zeros_like(jets[0][..., :-1])
            for i in range(1, min(k, 2) + 1):
                total = total - comb(k, i) * jets[i][..., -1:] * derivatives[k - i]
            derivatives.append(total / jets[0][..., -1:])
        return derivatives[nu].reshape(np.shape(t) + self.control_points.shape[1:])

    def to_bspline(self) -> Spline:
        """The same curve as a spline: exact for the parabola, InputError else, `homogeneous` being the exact form."""
        if self.weight != 1:
            raise InputError(
                f"an arc of {'an ellipse' if self.weight < 1 else 'a hyperbola'} is no polynomial spline: "
                "take .homogeneous, its B-spline form with the weight as last coordinate"
            )
        return bezier(self.control_points, self.domain)

    save = save
