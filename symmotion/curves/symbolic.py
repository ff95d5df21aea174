"""B-splines of CasADi symbols: Cox–de Boor over symbolic knots and controls, differentiable in both."""

from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from symmotion.errors import InputError
from symmotion.splines import BSplineBasis, Spline

SYMBOLIC = (ca.SX, ca.MX)


def symbolic_basis(knots, degree: int, t, nu: int = 0, extrapolate: bool = False) -> Any:
    """The nu-th derivatives of all B-splines N_{j,p}(t), p the degree, by Cox and de Boor, as a CasADi matrix (N, n).

    N_{j,q} = (t − t_j) / (t_{j+q} − t_j) N_{j,q−1} + (t_{j+q+1} − t) / (t_{j+q+1} − t_{j+1}) N_{j+1,q−1},
    0/0 counting as 0; the last nu steps differentiate (lecture notes, whose order m is p + 1).

    knots: (n + p + 1,) and t: (N,) or one, each numbers or CasADi; knots must not decrease and t
    must lie in the domain [t_p, t_n], which for symbols is the caller's care: elsewhere the values
    are NaN, or with `extrapolate` the end pieces continued.
    """
    knots, t = _column(knots), _column(t)
    n = knots.numel() - degree - 1
    if isinstance(degree, bool) or int(degree) != degree or degree < 0:
        raise InputError(f"degree {degree!r}: must be a whole number, 0 or more")
    if n < degree + 1:
        raise InputError(f"{knots.numel()} knots are too few for degree {degree}: at least {2 * degree + 2} are needed")
    if nu < 0:
        raise InputError(f"derivative order {nu}: must be 0 or more")
    k = [knots[i] for i in range(knots.numel())]
    a, b = k[degree], k[n]
    # Pieces beyond the domain are never the ones in force; the last one is closed on the right.
    values: list[Any] = [0 * t for _ in range(n + degree)]
    for j in range(degree, n):
        piece = (k[j] <= t) * (t < k[j + 1]) + (t == b) * (k[j] < b) * (k[j + 1] == b)
        if extrapolate:
            piece += (k[j] < k[j + 1]) * ((t < a) * (k[j] == a) + (t > b) * (k[j + 1] == b))
        values[j] = piece
    for q in range(1, degree + 1):
        higher: list[Any] = []
        for j in range(n + degree - q):
            left, right = _inverse(k[j + q] - k[j]), _inverse(k[j + q + 1] - k[j + 1])
            if q <= degree - nu:
                higher.append((t - k[j]) * left * values[j] + (k[j + q + 1] - t) * right * values[j + 1])
            else:
                higher.append(q * (left * values[j] - right * values[j + 1]))
        values = higher
    matrix = ca.horzcat(*values) if nu <= degree else 0 * ca.horzcat(*values)
    return matrix if extrapolate else matrix + ca.if_else((t < a) + (t > b) > 0, np.nan, 0)


def _inverse(width: Any) -> Any:
    """1 / width, and 0 where the width is 0: without a division by zero, whose NaN would reach derivatives."""
    empty = width == 0
    return (1 - empty) / (width + empty)


def _column(values: Any) -> Any:
    """Numbers or CasADi expressions as a CasADi column."""
    if isinstance(values, SYMBOLIC):
        return ca.vec(values)
    if isinstance(values, list | tuple) and any(isinstance(v, SYMBOLIC) for v in values):
        return ca.vertcat(*values)
    numbers = np.asarray(values, dtype=float)
    if not np.isfinite(numbers).all():
        raise InputError("knots and parameters must be finite")
    return ca.DM(numbers.reshape(-1, 1))


@dataclass(frozen=True, eq=False)
class SymbolicSpline:
    """The spline Σ N_j(t) c_j whose knots and controls may be CasADi expressions.

    knots: (n + degree + 1,), non-decreasing, numbers or CasADi; control_points: (n, d), numbers or CasADi.
    Every value is an expression of both, so that `casadi.jacobian` differentiates by either.
    """

    knots: Any
    control_points: Any
    degree: int

    def __post_init__(self):
        knots = _column(self.knots)
        controls = self.control_points
        if not isinstance(controls, SYMBOLIC):
            controls = ca.DM(np.asarray(controls, dtype=float))
        n = knots.numel() - self.degree - 1
        if not isinstance(knots, SYMBOLIC):
            BSplineBasis(np.asarray(knots).ravel(), self.degree)  # for its checks
        if controls.shape[0] != n:
            raise InputError(
                f"{controls.shape[0]} control points for {knots.numel()} knots and degree {self.degree}: "
                f"{max(n, 0)} are needed, one row each"
            )
        object.__setattr__(self, "knots", knots)
        object.__setattr__(self, "control_points", controls)

    @property
    def domain(self) -> tuple[Any, Any]:
        """The ends t_p and t_n of the domain, floats where the knots are numbers."""
        ends = self.knots[self.degree], self.knots[self.control_points.shape[0]]
        return ends if isinstance(self.knots, SYMBOLIC) else (float(ends[0]), float(ends[1]))

    def __call__(self, t, nu: int = 0, extrapolate: bool = False) -> Any:
        """The nu-th derivative at t, numbers or CasADi (N,): a CasADi matrix (N, d); see `symbolic_basis`.

        Raises InputError outside the domain where knots and t are numbers, unless `extrapolate`.
        """
        column = _column(t)
        if not extrapolate and not isinstance(self.knots, SYMBOLIC) and not isinstance(column, SYMBOLIC):
            BSplineBasis(np.asarray(self.knots).ravel(), self.degree).spans(np.asarray(column).ravel())
        return symbolic_basis(self.knots, self.degree, column, nu, extrapolate) @ self.control_points

    def to_bspline(self) -> Spline:
        """The spline of numbers; InputError names the symbols that are left."""
        numbers = []
        for part in (self.knots, self.control_points):
            free = ca.symvar(part) if isinstance(part, SYMBOLIC) else []
            if free:
                raise InputError(f"the symbols {', '.join(s.name() for s in free)} have no values yet: substitute them")
            numbers.append(np.asarray(ca.evalf(part) if isinstance(part, SYMBOLIC) else part))
        return Spline(BSplineBasis(numbers[0].ravel(), self.degree), numbers[1])
