"""Curves where they stop: the direction and the bends of the path there, which the zero speed hides."""

from collections.abc import Callable

import numpy as np

from symmotion.brief import instant
from symmotion.curves.curve import Curve
from symmotion.curves.series import Series, product, reciprocal, root
from symmotion.errors import InputError
from symmotion.splines import BSplineBasis, Spline

# A speed below this, relative to the mean speed, is none.
STILL = 1e-9
# A time as near to a border of the pieces, in shares of the piece, is meant for it: lengths tell no more there.
NEAR = 1e-6
# Derivatives that are looked at for the first that does not vanish.
MOST_ORDERS = 24

Derivatives = Callable[[np.ndarray, int], np.ndarray]


def derivatives(curve: Curve) -> Derivatives:
    """The k-th derivatives of a curve at times, from the right where a knot parts two; all numbers (N, d)."""
    if not isinstance(curve, Spline):
        return lambda t, k: np.asarray(curve(t, k)).reshape(len(t), -1)

    def exact(t: np.ndarray, k: int) -> np.ndarray:
        # Differences of controls keep the digits that the distance from the origin takes from derivatives.
        return curve.derivative(k)(t).reshape(len(t), -1)

    return exact


def resting(curve: Curve, t: np.ndarray, mean: float) -> np.ndarray:
    """(N,) the times t at which a curve stops, those meant for a border of its pieces brought there; NaN elsewhere.

    mean: the mean speed.
    """
    marks = np.asarray(curve.breakpoints)
    k = np.clip(np.searchsorted(marks, t), 1, len(marks) - 1)
    nearest = np.where(t - marks[k - 1] < marks[k] - t, marks[k - 1], marks[k])
    snapped = np.where(np.abs(t - nearest) <= NEAR * (marks[k] - marks[k - 1]), nearest, t)
    slope = derivatives(curve)
    return np.where(np.linalg.norm(slope(snapped, 1), axis=1) <= STILL * mean, snapped, np.nan)


def from_rest(curve: Curve, t: float, nu: int, mean: float) -> np.ndarray:
    """(d,) the nu-th derivative by arc length, nu ≥ 1, at a time t where the curve stops.

    With x' = a(τ) τᵐ the unit tangent is T = a/‖a‖, and d/ds = (‖a‖ τᵐ)⁻¹ d/dτ. InputError where the tangent turns, or
    where the derivative is infinite, as the bend of a path is that curves where it stops.
    """
    marks = np.asarray(curve.breakpoints)
    begins, ends = t <= marks[0], t >= marks[-1]
    right = None if ends else _after(derivatives(curve), t, _width(marks, t, 1), nu, mean)
    left = None if begins else _after(_mirrored(curve), -t, _width(marks, t, -1), nu, mean)
    if left is not None:
        left = [(-1) ** (k + 1) * c for k, c in enumerate(left)]
    if right is not None and left is not None and np.linalg.norm(right[0] - left[0]) > 1e-5:
        raise InputError(
            f"the curve stops at time {instant(t, 9)} and turns there: at constant speed it has no derivative"
        )
    found = right if right is not None else left
    if found is None:
        raise InputError(f"the curve rests about time {instant(t, 9)}: at constant speed it has no derivative there")
    if len(found) < nu:
        raise InputError(
            f"the curve stops at time {instant(t, 9)} and bends there: its derivative of order {nu} at constant "
            "speed is infinite"
        )
    return found[nu - 1] + 0.0  # no minus before a zero


def _width(marks: np.ndarray, t: float, side: int) -> float:
    k = np.searchsorted(marks, t, side="right" if side > 0 else "left")
    return float(np.diff(marks)[np.clip(k - 1, 0, len(marks) - 2)])


def _mirrored(curve: Curve) -> Derivatives:
    """The derivatives of y(−t) = x(t), from the right at −t: those of x from the left."""
    if isinstance(curve, Spline):
        plain = curve.clamped()
        mirror = BSplineBasis(-plain.basis.knots[::-1], plain.degree, origin=-plain.basis.origin)
        return derivatives(Spline(mirror, plain.control_points[::-1]))
    return lambda t, k: (-1) ** k * np.asarray(curve(-t - 1e-9 * np.ptp(curve.breakpoints), k)).reshape(len(t), -1)


def _after(slope: Derivatives, t: float, width: float, nu: int, mean: float) -> list[np.ndarray] | None:
    """The derivatives by arc length of orders 1 … nu behind t, fewer where the next is infinite; None at rest."""
    at, found = np.array([t]), list[np.ndarray]()
    # In shares of the piece, so that all coefficients are of one size.
    coefficients: Series = []
    m = None
    for k in range(MOST_ORDERS):
        c = slope(at, k + 1)[0] * width ** (k + 1) / float(np.prod(np.arange(1.0, k + 1)))
        coefficients.append(c)
        if m is None and np.linalg.norm(c) > STILL * mean * width:
            m = k
        if m is not None and k == m + (nu - 1) * (m + 1):
            break
    if m is None:
        return None
    a = coefficients[m:]
    slowness = reciprocal(root(product(a, a, lambda p, q: np.array([p @ q]))))
    tangent = product(slowness, a)
    found.append(tangent[0])
    for _ in range(2, nu + 1):
        change = [(k + 1) * c for k, c in enumerate(tangent[1:])]
        if any(np.linalg.norm(c) > 1e-8 * np.linalg.norm(found[0]) * (k + 1) for k, c in enumerate(change[:m])):
            return found
        tangent = product(slowness, change[m:])
        found.append(tangent[0])
    return found
