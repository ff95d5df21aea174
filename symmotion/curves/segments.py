"""One polynomial from any list of constraints: basis matrix, blending functions, segment."""

from collections.abc import Iterable, Sequence
from math import factorial
from typing import overload

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike

from symmotion.checks import numbers
from symmotion.curves.bezier import bezier, check_domain
from symmotion.curves.symbolic import SYMBOLIC, SymbolicSpline
from symmotion.errors import InputError
from symmotion.splines import BSplineBasis, Spline

Conditions = Sequence[tuple[float, int]]


def constraint_matrix(conditions: Conditions) -> np.ndarray:
    """(L+1, L+1) B with B A = G: the rows are the derivatives of [t^L … t 1] that the constraints take.

    conditions: L + 1 pairs (parameter, derivative order), distinct; A: coefficients by falling
    powers; G: the constraints' values (lecture notes, "Parametric cubic curves from constraints").

    Raises InputError for conditions that are no such pairs.

    >>> sm.curves.constraint_matrix([(0, 0), (1, 0), (1, 1)])
    array([[0., 0., 1.],
           [1., 1., 1.],
           [2., 1., 0.]])
    """
    checked = _check(conditions)
    size = len(checked)
    matrix = np.zeros((size, size))
    for row, (t, order) in zip(matrix, checked, strict=True):
        for power in range(order, size):
            row[size - 1 - power] = np.prod(np.arange(power - order + 1, power + 1)) * t ** (power - order)
    return matrix


def basis_matrix(conditions: Conditions) -> np.ndarray:
    """(L+1, L+1) M = B⁻¹, the basis matrix of a list of constraints: x(t) = [t^L … t 1] M G.

    Raises InputError for a singular list, with a polynomial that the constraints do not see.

    conditions: (parameter, derivative order), L + 1 pairs.

    >>> sm.curves.basis_matrix([(0, 0), (1, 0), (0, 1), (1, 1)]).round(9) + 0.0
    array([[ 2., -2.,  1.,  1.],
           [-3.,  3., -2., -1.],
           [ 0.,  0.,  1.,  0.],
           [ 1.,  0.,  0.,  0.]])
    """
    checked = _check(conditions)
    _require_regular(checked, _hull(checked))
    return np.linalg.inv(constraint_matrix(checked))


def blending_functions(conditions: Conditions, domain: tuple[float, float] = (0.0, 1.0)) -> Spline:
    """The polynomials [t^L … t 1] M, each the weight of one constraint: a curve with values (L + 1,).

    conditions: as for `basis_matrix`; domain: of the curve.

    Raises InputError as `basis_matrix` does.

    >>> sm.curves.blending_functions([(0, 0), (1, 0)])(0.25)
    array([0.75, 0.25])
    """
    return polynomial_segment(conditions, np.eye(len(list(conditions))), domain)


@overload
def polynomial_segment(
    conditions: Conditions, values: ca.SX | ca.MX, domain: tuple[float, float] = ...
) -> SymbolicSpline: ...
@overload
def polynomial_segment(conditions: Conditions, values: ArrayLike, domain: tuple[float, float] = ...) -> Spline: ...
def polynomial_segment(
    conditions: Conditions, values: ca.SX | ca.MX | ArrayLike, domain: tuple[float, float] = (0.0, 1.0)
) -> Spline | SymbolicSpline:
    """The polynomial of degree L with x⁽ᵒ⁾(t) = value for each of L + 1 constraints (t, o).

    conditions: (parameter, derivative order), distinct, anywhere; values: (L + 1, …) numbers, or
    CasADi (L + 1, d), and then the curve is a SymbolicSpline of them; domain: of the segment.

    Raises InputError for a singular list, with a polynomial that the constraints do not see.

    >>> sm.curves.polynomial_segment([(0, 0), (0.5, 0), (1, 0)], [0.0, 1.0, 0.0])(0.25)
    array(0.75)
    """
    checked, domain = _check(conditions), check_domain(domain)
    given = values if isinstance(values, SYMBOLIC) else numbers(values, "values")
    if not given.shape or given.shape[0] != len(checked):
        raise InputError(f"values of shape {given.shape} for {len(checked)} constraints: one row each is needed")
    if isinstance(given, np.ndarray) and not np.isfinite(given).all():
        raise InputError("the constraints' values must be finite")
    # In the Bernstein basis over the constraints' own interval, which is far better conditioned than powers.
    hull = _hull(checked)
    controls = np.linalg.inv(_require_regular(checked, hull))
    if hull != domain:
        # The change from the hull's Bernstein basis to the domain's, by values at as many points.
        points = np.linspace(*domain, len(checked))
        controls = np.linalg.solve(
            BSplineBasis.clamped(domain, len(checked) - 1)(points), _bernstein(hull, len(checked), points) @ controls
        )
    if isinstance(given, SYMBOLIC):
        knots = ca.DM(BSplineBasis.clamped(domain, len(checked) - 1).about(0.0).knots)
        return SymbolicSpline(knots, ca.DM(controls) @ given, len(checked) - 1)
    return bezier(np.tensordot(controls, given, axes=1), domain)


def _check(conditions: Conditions) -> list[tuple[float, int]]:
    if not isinstance(conditions, Iterable):
        raise InputError(f"constraints {conditions!r}: pairs (parameter, derivative order) are needed")
    checked = []
    for i, condition in enumerate(conditions):
        try:
            t, order = condition
            t, whole = float(t), int(order)
        except (TypeError, ValueError) as error:
            raise InputError(
                f"constraint {i}, {condition!r}: a pair (parameter, derivative order) is needed"
            ) from error
        if not np.isfinite(t) or whole != order or whole < 0:
            raise InputError(f"constraint {i}, {condition!r}: a finite parameter and an order 0, 1, 2, … are needed")
        if (t, whole) in checked:
            raise InputError(f"constraint {i}, {condition!r}, repeats constraint {checked.index((t, whole))}")
        checked.append((t, whole))
    if len(checked) < 2:
        raise InputError(f"{len(checked)} constraints: a segment needs at least 2")
    return checked


def _hull(conditions: Conditions) -> tuple[float, float]:
    """The interval of the constraints; of unit length where all are at one parameter."""
    times = [t for t, _ in conditions]
    return (min(times), max(times)) if min(times) < max(times) else (times[0], times[0] + 1.0)


def _bernstein(interval: tuple[float, float], size: int, t, nu: int = 0) -> np.ndarray:
    eye = Spline(BSplineBasis.clamped(interval, size - 1), np.eye(size))
    return eye(t, nu, extrapolate=True)


def _require_regular(conditions: Conditions, hull: tuple[float, float]) -> np.ndarray:
    """The constraints on the controls (L+1, L+1); InputError where some polynomial is zero in all of them."""
    size = len(conditions)
    matrix = np.concatenate([_bernstein(hull, size, np.array([t]), order) for t, order in conditions])
    scale = np.abs(matrix).max(axis=1, keepdims=True)
    scaled = matrix / np.where(scale > 0, scale, 1.0)
    _, strengths, vectors = np.linalg.svd(scaled)
    if strengths[-1] > 1e-13 * strengths[0]:
        return matrix
    unseen = bezier(vectors[-1], hull)
    # Its Taylor coefficients about 0 are what a reader can check.
    taylor = np.array([float(unseen(0.0, k, extrapolate=True)) / factorial(k) for k in range(size)])
    taylor /= taylor[np.argmax(np.abs(taylor))]
    raise InputError(
        f"the constraints {', '.join(f'x{_primes(o)}({t:g})' for t, o in conditions)} are singular: all of them are "
        f"zero for the polynomial {_polynomial(taylor)}, so they do not determine one of degree {size - 1}; "
        "change one of them"
    )


def _polynomial(coefficients: np.ndarray) -> str:
    """Σ c_k t^k in print, lowest power first."""
    text = ""
    for k, c in enumerate(coefficients):
        if abs(c) > 1e-9:
            size = "" if k and abs(abs(c) - 1) < 1e-9 else f"{abs(c):.4g} "
            sign = " − " if c < 0 else " + "
            text += f"{sign}{size}{'' if not k else 't' if k == 1 else f't^{k}'}".rstrip()
    return text.removeprefix(" + ").strip()


def _primes(order: int) -> str:
    return "'" * order if order < 4 else f"^({order})"
