"""Rational motions: what follows from a dual quaternion and its derivatives, whatever they depend on."""

from collections.abc import Callable
from functools import cached_property
from itertools import product as combinations
from math import comb, prod
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike

from symmotion.brief import between
from symmotion.curves.timing import solutions
from symmotion.errors import InputError
from symmotion.motions.dual import DualQuaternions
from symmotion.motions.motion import matrix, trajectory
from symmotion.motions.position import Affine
from symmotion.motions.quaternions.algebra import conjugate, product
from symmotion.pictures import as_html, plot_positions
from symmotion.saving import save
from symmotion.splines import BSplineBasis, Spline
from symmotion.splines.instants import distinct, inside
from symmotion.values import value

Order = tuple[int, ...]
Pair = tuple[np.ndarray, np.ndarray]
UNITS = np.eye(4)[1:]


def positions(pairs: Callable[[Order], Pair], order: Order) -> Affine:
    """Derivatives of rotation matrix and translation from those of the dual quaternion Q + εR.

    QQ* (A, d) is the homogeneous form of PCG (13), bilinear in Q and R: its derivatives follow
    from the product rule, those of (A, d) from the quotient rule.

    pairs: for an order of derivative (by u, by v, …) those of Q and R, (…, 4) each.
    Returns linear (…, 3, 3) and translation (…, 3).
    """
    if min(order) < 0:
        raise InputError(f"derivative orders {order!r}: 0 or more is needed")
    jet = {k: pairs(k) for k in _lower(order)}
    both = quotient(lambda k: _homogeneous(jet, k), order)
    return Affine(both[..., :3], both[..., 3])


def quotient(parts: Callable[[Order], tuple[np.ndarray, np.ndarray]], order: Order) -> np.ndarray:
    """Derivatives of a quotient from those of its numerator and denominator, by the product rule solved for it.

    parts: for an order of derivative those of the numerator (…, any) and of the denominator (…).
    """
    values: dict[Order, np.ndarray] = {}
    jet = {k: parts(k) for k in _lower(order)}
    zero = (0,) * len(order)
    extend = (...,) + (None,) * (jet[zero][0].ndim - jet[zero][1].ndim)
    for k, (part, _) in jet.items():
        for i in _lower(k):
            if any(i):
                part = part - _binomial(k, i) * jet[i][1][extend] * values[_minus(k, i)]
        values[k] = part / jet[zero][1][extend]
    return values[order]


def _lower(order: Order) -> list[Order]:
    """All orders up to this one, in an order in which each comes after the lower ones."""
    return list(combinations(*(range(k + 1) for k in order)))


def _minus(k: Order, i: Order) -> Order:
    return tuple(a - b for a, b in zip(k, i, strict=True))


def _homogeneous(jet: dict[Order, Pair], order: Order) -> tuple[np.ndarray, np.ndarray]:
    """Derivatives of QQ* [A d] (…, 3, 4) and of QQ* (…)."""
    weight, value = np.zeros(()), np.zeros(())
    for i in _lower(order):
        q, r = jet[i]
        back = conjugate(jet[_minus(order, i)][0])
        factor = _binomial(order, i)
        turned = product(product(q[..., None, :], UNITS), back[..., None, :])[..., 1:]
        moved = 2 * product(r, back)[..., 1:]
        columns = np.concatenate([turned, moved[..., None, :]], axis=-2)
        value = value + factor * np.swapaxes(columns, -1, -2)
        weight = weight + factor * np.sum(q * conjugate(back), axis=-1)
    return value, weight


def _binomial(n: Order, k: Order) -> int:
    return prod(comb(a, b) for a, b in zip(n, k, strict=True))


@value
class RationalMotion:
    """The one-parameter motion Σ N_i(t) (Q_i + εQ⁰_i).

    basis: the B-splines N_i; real: (n, 4) control quaternions Q_i, scalar-first, of any norm;
    dual: (n, 4) their dual parts, None for a spherical motion, which is about the origin.

    Raises InputError for controls of other shapes, and times outside of its domain.

    >>> basis = sm.splines.BSplineBasis.clamped([0.0, 1.0], 1)
    >>> motion = sm.motions.RationalMotion(basis, [[1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]])
    >>> motion(0.5).linear.round(9) + 0.0
    array([[ 0., -1.,  0.],
           [ 1.,  0.,  0.],
           [ 0.,  0.,  1.]])
    """

    basis: BSplineBasis
    real: np.ndarray
    dual: np.ndarray | None = None

    def __post_init__(self):
        pair = DualQuaternions.of(self.real, self.dual)
        if pair.shape != (self.basis.n,):
            raise InputError(f"control quaternions of shape {pair.real.shape}: ({self.basis.n}, 4) is needed")
        object.__setattr__(self, "real", pair.real)
        object.__setattr__(self, "dual", None if self.dual is None else pair.dual)

    def __repr__(self) -> str:
        (a, b), kind = self.domain, "spherical" if self.spherical else "spatial"
        return f"RationalMotion({kind}, degree {self.basis.degree}, {self.basis.n} controls, times {between(a, b)})"

    @property
    def spherical(self) -> bool:
        """Whether it only turns: there is no dual part."""
        return self.dual is None

    @property
    def bases(self) -> tuple[BSplineBasis, ...]:
        """The basis, as the only one of its net."""
        return (self.basis,)

    @property
    def control_displacements(self) -> DualQuaternions:
        """The controls as displacements (n,)."""
        return DualQuaternions.of(self.real, self.dual)

    def with_controls(self, real: np.ndarray, dual: np.ndarray | None) -> "RationalMotion":
        """The motion with other control quaternions over the same knots."""
        return RationalMotion(self.basis, real, dual)

    @property
    def dimension(self) -> int:
        """Of the space that the body is in: 3."""
        return 3

    @property
    def domain(self) -> tuple[float, float]:
        """First and last time."""
        return self.basis.domain

    @property
    def breakpoints(self) -> np.ndarray:
        """(K,) the borders of the spans, ends of the domain included."""
        return self.basis.breakpoints

    @cached_property
    def _spline(self) -> Spline:
        dual = np.zeros_like(self.real) if self.dual is None else self.dual
        return Spline(self.basis, np.concatenate([self.real, dual], axis=1))

    def pair(self, t: ArrayLike, nu: int = 0) -> Pair:
        """The nu-th derivatives of real and dual part at t, t.shape + (4,) each."""
        values = self._spline(t, nu)
        return values[..., :4], values[..., 4:]

    def __call__(self, t: ArrayLike, nu: int = 0) -> Affine:
        """The nu-th derivative at times t: linear t.shape + (3, 3), translation t.shape + (3,)."""
        return positions(lambda k: self.pair(t, k[0]), (nu,))

    matrix = matrix
    trajectory = trajectory
    save = save
    plot = plot_positions
    _repr_html_ = as_html


def _snapped(x: np.ndarray, low: float, high: float) -> np.ndarray:
    """Parameters that rounding has put outside their interval, on its end; others as they are."""
    return np.where(inside(x, (low, high)), np.clip(x, low, high), x)


class Surface(Protocol):
    """What a motion along a curve asks of the two-parameter motion that it runs in."""

    @property
    def bases(self) -> tuple[BSplineBasis, ...]: ...

    @property
    def domain(self) -> tuple[tuple[float, float], tuple[float, float]]: ...

    def __call__(self, u: ArrayLike, v: ArrayLike, nu: tuple[int, int] = (0, 0)) -> Affine: ...


@value
class CurveMotion:
    """The one-parameter motion along a curve (u(t), v(t)) in the domain of a two-parameter motion.

    curve: a spline with control points (n, 2), its domain that of the motion.

    surface: the two-parameter motion. Raises InputError for a curve of others than u and v, and derivatives above
    the second.

    >>> net = sm.motions.smooth_net(6)
    >>> (a, b), (c, d) = net.domain
    >>> net.along(sm.curves.bezier([[a, c], [b, d]])).domain
    (0.0, 1.0)
    """

    surface: Surface
    curve: Spline

    def __post_init__(self):
        shape = self.curve.control_points.shape[1:]
        if shape != (2,):
            raise InputError(f"a curve with control points of shape (n, *{shape}): (n, 2), u and v, is needed")

    def __repr__(self) -> str:
        a, b = self.domain
        return f"CurveMotion(times {between(a, b)}, in {self.surface!r})"

    @property
    def dimension(self) -> int:
        """Of the space that the body is in: 3."""
        return 3

    @property
    def domain(self) -> tuple[float, float]:
        """First and last time, the parameters of the ends of the curve."""
        return self.curve.domain

    @property
    def breakpoints(self) -> np.ndarray:
        """(K,) the borders of the curve's pieces, and when it crosses a knot line of the two-parameter motion."""
        times = [self.curve.breakpoints]
        for k, basis in enumerate(self.surface.bases):
            coordinate = Spline(self.curve.basis, self.curve.control_points[:, k])
            times += [solutions(coordinate, line) for line in basis.breakpoints[1:-1]]
        # A knot of the curve on a knot line is found twice, up to rounding.
        return distinct(np.concatenate(times), self.curve.breakpoints)

    def __call__(self, t: ArrayLike, nu: int = 0) -> Affine:
        """The nu-th derivative, up to the second, at times t: linear t.shape + (3, 3), translation t.shape + (3,)."""
        if nu not in (0, 1, 2):
            raise InputError(f"derivative order {nu}: 0, 1 or 2 along a curve")
        u, v = (_snapped(x, *d) for x, d in zip(np.moveaxis(self.curve(t), -1, 0), self.surface.domain, strict=True))
        if nu == 0:
            return self.surface(u, v)
        rates = [np.moveaxis(self.curve(t, k), -1, 0) for k in range(1, nu + 1)]
        (du, dv), first = rates[0], [(1, 0), (0, 1)]
        terms = list(zip(first, rates[nu - 1], strict=True))
        if nu == 2:
            terms += [((2, 0), du * du), ((1, 1), 2 * du * dv), ((0, 2), dv * dv)]
        parts = [(self.surface(u, v, order), factor) for order, factor in terms]
        linear = sum(p.linear * f[..., None, None] for p, f in parts)
        return Affine(np.asarray(linear), np.asarray(sum(p.translation * f[..., None] for p, f in parts)))

    matrix = matrix
    trajectory = trajectory
    save = save
    plot = plot_positions
    _repr_html_ = as_html
