"""B-splines of CasADi symbols: Cox–de Boor over symbolic knots and controls, differentiable in both."""

import os
from dataclasses import dataclass

import casadi as ca
import numpy as np

from symmotion.checks import numbers, whole
from symmotion.errors import InputError
from symmotion.splines import BSplineBasis, Spline
from symmotion.splines.symbolic import Expression, local_basis

SYMBOLIC = (ca.SX, ca.MX)


def symbolic_basis(knots: Expression, degree: int, t: Expression, nu: int = 0, extrapolate: bool = False) -> Expression:
    """The nu-th derivatives of all B-splines N_{j,p}(t), p the degree, by Cox and de Boor, as a CasADi matrix (N, n).

    N_{j,q} = (t − t_j) / (t_{j+q} − t_j) N_{j,q−1} + (t_{j+q+1} − t) / (t_{j+q+1} − t_{j+1}) N_{j+1,q−1},
    0/0 counting as 0; the last nu steps differentiate (lecture notes, whose order m is p + 1). Span by
    span, by `local_basis`.

    knots: (n + p + 1,) and t: (N,) or one, each numbers or CasADi; knots must not decrease and t
    must lie in the domain [t_p, t_n], which for symbols is the caller's care: elsewhere the values
    are NaN, or with `extrapolate` the end pieces continued.

    Raises InputError for too few knots.

    >>> import casadi as ca
    >>> t = ca.SX.sym("t")
    >>> hats = ca.Function("hats", [t], [sm.curves.symbolic_basis([0.0, 0.0, 1.0, 1.0], 1, t)])
    >>> hats(0.25)
    DM([[0.75, 0.25]])
    """
    knots, t = _column(knots), _column(t)
    degree, nu = whole(degree, 0, "degree"), whole(nu, 0, "derivative order")
    n = knots.numel() - degree - 1
    if n < degree + 1:
        raise InputError(f"{knots.numel()} knots are too few for degree {degree}: at least {2 * degree + 2} are needed")
    k = [knots[i] for i in range(knots.numel())]
    a, b = k[degree], k[n]
    columns: list[Expression] = [0 * t for _ in range(n)]
    for j in range(degree, n):
        # The span in force; the last one is closed on the right.
        piece = (k[j] <= t) * (t < k[j + 1]) + (t == b) * (k[j] < b) * (k[j + 1] == b)
        if extrapolate:
            piece += (k[j] < k[j + 1]) * ((t < a) * (k[j] == a) + (t > b) * (k[j + 1] == b))
        values = local_basis(k[j + 1 - degree : j + 1 + degree], degree, t, nu, _divided)
        for i, value in enumerate(values, start=j - degree):
            columns[i] += piece * value
    matrix = ca.horzcat(*columns)
    return matrix if extrapolate else matrix + ca.if_else((t < a) + (t > b) > 0, np.nan, 0)


def _divided(a: Expression, width: Expression) -> Expression:
    """a / width, and 0 where the width is 0: without a division by zero, whose NaN would reach derivatives."""
    empty = width == 0
    return a * ((1 - empty) / (width + empty))


def _column(values: Expression) -> Expression:
    """Numbers or CasADi expressions as a CasADi column."""
    if isinstance(values, SYMBOLIC):
        return ca.vec(values)
    if isinstance(values, list | tuple) and any(isinstance(v, SYMBOLIC) for v in values):
        return ca.vertcat(*values)
    given = numbers(values, "knots and parameters")
    if not np.isfinite(given).all():
        raise InputError("knots and parameters must be finite")
    return ca.DM(given.reshape(-1, 1))


@dataclass(frozen=True, eq=False)
class SymbolicSpline:
    """The spline Σ N_j(t) c_j whose knots and controls may be CasADi expressions.

    knots: (n + degree + 1,), non-decreasing, numbers or CasADi; control_points: (n, d), numbers or CasADi.
    Every value is an expression of both, so that `casadi.jacobian` differentiates by either. Two of
    them are equal where they are one: what symbols stand for is open.

    Raises InputError for numbers of controls and knots that do not go together.

    >>> import casadi as ca
    >>> p = ca.SX.sym("p", 2, 1)
    >>> sm.curves.SymbolicSpline([0.0, 0.0, 1.0, 1.0], p, 1)(0.25)
    SX(((0.75*p_0)+(0.25*p_1)))
    """

    knots: Expression
    control_points: Expression
    degree: int

    def __post_init__(self):
        knots = _column(self.knots)
        controls = self.control_points
        if not isinstance(controls, SYMBOLIC):
            controls = ca.DM(numbers(controls, "control points"))
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
    def domain(self) -> tuple[Expression, Expression]:
        """The ends t_p and t_n of the domain, floats where the knots are numbers."""
        ends = self.knots[self.degree], self.knots[self.control_points.shape[0]]
        return ends if isinstance(self.knots, SYMBOLIC) else (float(ends[0]), float(ends[1]))

    def __repr__(self) -> str:
        what = [name for name, x in (("knots", self.knots), ("controls", self.control_points)) if _symbols(x)]
        n, d = self.control_points.shape
        return f"SymbolicSpline(degree {self.degree}, {n} controls of {d}, symbols in {' and '.join(what) or 'none'})"

    def __call__(self, t: Expression, nu: int = 0, extrapolate: bool = False) -> Expression:
        """The nu-th derivative at t, numbers or CasADi (N,): a CasADi matrix (N, d); see `symbolic_basis`.

        Raises InputError outside the domain where knots and t are numbers, unless `extrapolate`.
        """
        column = _column(t)
        if not extrapolate and not isinstance(self.knots, SYMBOLIC) and not isinstance(column, SYMBOLIC):
            BSplineBasis(np.asarray(self.knots).ravel(), self.degree).spans(np.asarray(column).ravel())
        return symbolic_basis(self.knots, self.degree, column, nu, extrapolate) @ self.control_points

    def to_bspline(self) -> Spline:
        """The spline of numbers; InputError names the symbols that are left."""
        values = []
        for part in (self.knots, self.control_points):
            if free := _symbols(part):
                raise InputError(f"the symbols {', '.join(free)} have no values yet: substitute them")
            values.append(np.asarray(ca.evalf(part) if isinstance(part, SYMBOLIC) else part))
        return Spline(BSplineBasis(values[0].ravel(), self.degree), values[1])

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the spline of numbers, which is what `load` returns; InputError names the symbols that are left."""
        self.to_bspline().save(path)


def _symbols(expression: Expression) -> list[str]:
    """The names of the symbols in it."""
    return [s.name() for s in ca.symvar(expression)] if isinstance(expression, SYMBOLIC) else []
