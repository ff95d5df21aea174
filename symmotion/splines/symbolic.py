"""Cox and de Boor's recursion for symbols: the same steps whatever knots and parameter are."""

from collections.abc import Callable, Sequence
from operator import truediv
from typing import Any, TypeAlias

# SX, MX, DM or a number. Any: arithmetic of a union of these is not typed, and all of one call are of one kind.
Expression: TypeAlias = Any


def local_basis(
    knots: Sequence[Expression],
    degree: int,
    t: Expression,
    nu: int = 0,
    divide: Callable[[Expression, Expression], Expression] = truediv,
) -> list[Expression]:
    """The nu-th derivatives of the degree + 1 B-splines that can differ from zero on one span, in order of time.

    Of degree q they are made of those of degree q − 1: each is shared between its two successors,
    (t − left) / (right − left) of it rises; the last nu steps differentiate. `BSplineBasis.local` for symbols.

    knots: the 2 degree ones about the span, which lies between numbers degree − 1 and degree; t: in the
    span, else the polynomials in force there go on. divide: what does the divisions by widths, none of
    which is zero unless the span is empty.
    """
    if nu > degree:
        return [0.0] * (degree + 1)
    values: list[Expression] = [1.0]
    for q in range(1, degree + 1):
        higher: list[Expression] = [0.0] * (q + 1)
        for i, value in enumerate(values):
            left, right = knots[degree + i - q], knots[degree + i]
            if q > degree - nu:
                rising = divide(q * value, right - left)
                higher[i] += -rising
            else:
                rising = divide(t - left, right - left) * value
                higher[i] += value - rising
            higher[i + 1] += rising
        values = higher
    return values
