"""B-spline bases of any degree over clamped and periodic knot vectors."""

from dataclasses import replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike
from scipy import sparse

from symmotion.brief import between, instant, instants
from symmotion.checks import floats, number, numbers, whole
from symmotion.errors import InputError
from symmotion.splines.instants import require_inside, require_steps, rounding_in, same_times, unified
from symmotion.values import read_only, value

MOST_DEGREE = 1000
AT_ONCE = 16_384  # parameters whose functions are evaluated together, in cache


@value
class BSplineBasis:
    """The B-splines N_0 … N_{n−1} of one degree over one knot vector.

    knots: (n + degree + 1,), non-decreasing, in the unit of time, from the origin on; for a periodic basis the
        knots beyond the domain repeat the period, and N_{j+n} is the same function as N_j.
    degree: at least 0.
    periodic: whether the last `degree` functions are identified with the first.
    origin: the time from which the knots count, so that knots far from zero lose no digits: N_j(t) is a function of
        t − origin. Domain, breakpoints and parameters are times, with the origin in them.

    Knots that agree up to rounding are copies of one. Raises InputError for knots that decrease, are
    not finite or are too few, and where a knot has more than degree + 1 copies.

    >>> basis = sm.splines.BSplineBasis.clamped([0.0, 1.0, 2.0], 3)
    >>> basis.n, basis(1.0)
    (5, array([[0.  , 0.25, 0.5 , 0.25, 0.  ]]))
    """

    knots: np.ndarray
    degree: int
    periodic: bool = False
    origin: float = 0.0

    if TYPE_CHECKING:
        # Whatever is like an array goes in; the fields are arrays.
        def __init__(self, knots: ArrayLike, degree: int, periodic: bool = False, origin: float = 0.0) -> None: ...

    def __post_init__(self):
        knots, degree = numbers(self.knots, "knots"), whole(self.degree, 0, "degree", most=MOST_DEGREE)
        if knots.ndim != 1 or knots.size < 2 * degree + 2:
            raise InputError(
                f"{knots.size} knots are too few for degree {degree}: at least {2 * degree + 2} are needed"
            )
        if not np.isfinite(knots).all():
            raise InputError(f"knot {int(np.argmin(np.isfinite(knots)))} is not finite")
        steps, origin = np.diff(knots), number(self.origin, "origin")
        if (steps < 0).any():
            k = int(np.argmax(steps < 0))
            raise InputError(f"knots decrease from {' to '.join(instants(*knots[k : k + 2]))} at knot {k + 1}")
        if ((steps > 0) & (steps <= rounding_in(origin + knots[0], origin + knots[-1]))).any():
            knots = unified(knots, marks=knots[[0, -1, degree, -degree - 1]], origin=origin)
        ends = knots[[degree, -degree - 1]]
        crowded = knots[degree + 1 :] == knots[: -degree - 1]
        if crowded.any():
            k = int(np.argmax(crowded))
            raise InputError(f"knot {instant(knots[k])} has more than degree + 1 = {degree + 1} copies")
        require_steps(ends, "the ends of the knots, number")
        object.__setattr__(self, "knots", read_only(knots))
        object.__setattr__(self, "degree", degree)
        object.__setattr__(self, "periodic", bool(self.periodic))
        object.__setattr__(self, "origin", origin)

    def __repr__(self) -> str:
        a, b = self.domain
        kind = "periodic, " if self.periodic else ""
        return f"BSplineBasis({kind}degree {self.degree}, {self.n} functions, {between(a, b)})"

    @staticmethod
    def clamped(breakpoints, degree: int) -> "BSplineBasis":
        """The basis with simple knots at increasing `breakpoints`, the end ones repeated degree + 1 times."""
        degree = whole(degree, 0, "degree", most=MOST_DEGREE)
        origin, b = from_origin(floats(breakpoints, "breakpoints"))
        knots = np.concatenate([np.full(degree, b[0]), b, np.full(degree, b[-1])])
        return BSplineBasis(knots, degree, origin=origin)

    @staticmethod
    def closed(breakpoints, degree: int) -> "BSplineBasis":
        """The periodic basis with simple knots at increasing `breakpoints`; the last is the first, a period later."""
        origin, b = from_origin(floats(breakpoints, "breakpoints"))
        if b.size <= degree:
            raise InputError(f"a periodic basis of degree {degree} needs more than {degree} spans, not {b.size - 1}")
        period = b[-1] - b[0]
        before, after = b[-1 - degree : -1] - period, b[1 : degree + 1] + period
        return BSplineBasis(np.concatenate([before, b, after]), degree, periodic=True, origin=origin)

    @cached_property
    def relative(self) -> "BSplineBasis":
        """The same basis with its origin at zero: its parameters are times from the origin on."""
        return self if self.origin == 0 else replace(self, origin=0.0)

    def about(self, origin: float) -> "BSplineBasis":
        """The same functions of time with the knots counted from another origin."""
        if origin == self.origin:
            return self
        return replace(self, knots=self.knots + (self.origin - origin), origin=origin)

    def same_knots(self, other: "BSplineBasis") -> bool:
        """Whether the knots are those of another basis up to rounding, as times."""
        return same_times(self.origin + self.knots, other.origin + other.knots)

    @property
    def n(self) -> int:
        """Number of different functions, and so of control points."""
        return self.knots.size - self.degree - 1 - (self.degree if self.periodic else 0)

    @property
    def domain(self) -> tuple[float, float]:
        """The parameter interval on which the functions sum to one."""
        return float(self.origin + self.knots[self.degree]), float(self.origin + self.knots[-self.degree - 1])

    @property
    def breakpoints(self) -> np.ndarray:
        """(K,) the different knots inside the domain, ends included: the borders of the spans."""
        return self.origin + np.unique(self.knots[self.degree : self.knots.size - self.degree])

    @property
    def greville(self) -> np.ndarray:
        """(n,) knot averages: the parameter at which each control acts most directly."""
        if self.degree == 0:
            return self.origin + 0.5 * (self.knots[1:] + self.knots[:-1])
        windows = np.lib.stride_tricks.sliding_window_view(self.knots[1:-1], self.degree)
        return self.origin + windows.mean(axis=1)[: self.n]

    def spans(self, t) -> np.ndarray:
        """(N,) index k of the span [knots[k], knots[k+1]) that holds each t; the right end counts to the last span.

        A time that misses an end of the domain by its rounding counts to the span there, and is evaluated as it is.
        """
        t = floats(t, "parameters")
        a, b = self.domain
        require_inside(t, (a, b))
        times = self.origin + self.knots
        first = int(np.searchsorted(times, a, side="right")) - 1
        last = int(np.searchsorted(times, b, side="left")) - 1
        return np.clip(np.searchsorted(times, t, side="right") - 1, first, last)

    def local(self, t, nu: int = 0) -> tuple[np.ndarray, np.ndarray]:
        """The degree + 1 functions that can differ from zero at each t, and their nu-th derivatives.

        t: (N,) in the domain. Returns their indices (N, degree + 1), in order of time, and
        values (N, degree + 1): Cox–de Boor, whose last nu steps differentiate.
        """
        t = np.atleast_1d(floats(t, "parameters"))
        span, t = self.spans(t), t - self.origin
        parts = [slice(first, first + AT_ONCE) for first in range(0, max(1, t.size), AT_ONCE)]
        values = np.concatenate([self._values(t[part], span[part], nu) for part in parts])
        indices = span[:, None] + np.arange(-self.degree, 1)
        if self.periodic:
            indices %= self.n
        return indices, values

    def _values(self, t: np.ndarray, span: np.ndarray, nu: int) -> np.ndarray:
        """(N, degree + 1) the nu-th derivatives of the functions that can differ from zero at t (N,) in these spans."""
        values = np.ones((t.size, 1))
        for q in range(1, self.degree + 1):
            left = self.knots[span[:, None] + np.arange(1 - q, 1)]
            width = self.knots[span[:, None] + np.arange(1, q + 1)] - left
            higher = np.zeros((t.size, q + 1))
            if q <= self.degree - nu:
                share = (t[:, None] - left) / width * values
                higher[:, :-1] = values - share
                higher[:, 1:] += share
            else:
                slope = q / width * values
                higher[:, :-1] = -slope
                higher[:, 1:] += slope
            values = higher
        return values if nu <= self.degree else np.zeros_like(values)

    def matrix(self, t, nu: int = 0) -> sparse.csr_array:
        """(N, n) nu-th derivatives of all functions at the parameters t, as a sparse array."""
        indices, values = self.local(t, nu)
        rows = np.repeat(np.arange(len(indices)), self.degree + 1)
        return sparse.csr_array((values.ravel(), (rows, indices.ravel())), shape=(len(indices), self.n))

    def __call__(self, t, nu: int = 0) -> np.ndarray:
        """(N, n) nu-th derivatives of all functions at the parameters t, dense."""
        return self.matrix(t, nu).toarray()

    def with_knots(self, new) -> "BSplineBasis":
        """The basis with the knots `new` inserted, each inside the domain; a value given twice counts twice."""
        if self.periodic:
            raise InputError("knot insertion takes a clamped basis")
        new = np.atleast_1d(floats(new, "knots"))
        self.spans(new)
        return replace(self, knots=np.sort(np.concatenate([self.knots, new - self.origin])))

    def elevated(self, times: int = 1) -> "BSplineBasis":
        """The basis of degree + `times` that holds every spline of this one: each knot gains `times` copies."""
        if self.periodic:
            raise InputError("degree elevation takes a clamped basis")
        values, copies = np.unique(self.knots, return_counts=True)
        return replace(self, knots=np.repeat(values, copies + times), degree=self.degree + times)


def from_origin(times: np.ndarray) -> tuple[float, np.ndarray]:
    """An origin for increasing times, and the times from it on: the first where all are far from zero, else zero.

    Far is twice their extent: then the differences are exact, and adding the origin gives the times back (Sterbenz).

    >>> sm.splines.from_origin(np.array([1e9, 1e9 + 1.0]))
    (1000000000.0, array([0., 1.]))
    """
    first = float(times[0])
    if not abs(first) >= 2 * (times[-1] - first):
        return 0.0, times
    return first, times - first
