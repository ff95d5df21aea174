"""Interpolating and least-squares splines, and the closest spline of another space."""

from datetime import datetime, timedelta

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import splu, spsolve

from symmotion.brief import instants
from symmotion.checks import choice, floats, numbers
from symmotion.errors import InputError
from symmotion.splines.basis import BSplineBasis, from_origin
from symmotion.splines.instants import distinct, require_steps
from symmotion.splines.quadrature import gauss
from symmotion.splines.spline import Spline

ENDS = ("natural", "not-a-knot", "clamped", "periodic")
FAR = 1e3  # distance from zero, in extents of the values, from which it is subtracted


def amid(places: np.ndarray) -> np.ndarray:
    """(…) what to subtract from places (M, …) and from everything there: one of them where they are far from zero.

    The digits that the distance would take are those that small detail needs. Zero where they are not far.

    >>> sm.splines.amid(np.array([[1e9, 0.0], [1e9 + 1, 1.0]]))
    array([1.e+09, 0.e+00])
    """
    centre = places[0]
    near = np.abs(centre).max(initial=0.0) <= FAR * np.abs(places - centre).max(initial=0.0)
    return np.zeros_like(centre) if near else centre


def check_times(times, what: str = "keyframe") -> np.ndarray:
    """A copy of `times` as a float array (M,), finite and increasing; InputError names the first that is not.

    Dates and durations, of NumPy, Python or an index of pandas, become seconds since the first.

    what: of which the times are, for the message.

    >>> sm.splines.check_times([0, 1, 3])
    array([0., 1., 3.])
    """
    times = _seconds(times, what)
    if times.ndim != 1:
        raise InputError(f"times of shape {times.shape}: one time per {what} is needed, shape (M,)")
    finite = np.isfinite(times)
    if not finite.all():
        raise InputError(f"the time of {what} {int(np.argmin(finite))} is {times[np.argmin(finite)]}")
    steps = np.diff(times)
    if (steps <= 0).any():
        k = int(np.argmax(steps <= 0))
        how = "repeats" if steps[k] == 0 else "comes before"
        before, behind = instants(*times[k : k + 2])
        raise InputError(
            f"the time of {what} {k + 1}, {behind}, {how} that of {what} {k}, {before}: "
            "times must increase; leave one of them out"
        )
    require_steps(times, f"the times of {what}s")
    return times


def _seconds(times, what: str) -> np.ndarray:
    """Numbers as they are, dates and durations as seconds since the first."""
    if np.ma.is_masked(times):
        return numbers(times, "times")
    try:
        given = np.asarray(times)
    except ValueError:
        given = np.empty(())
    if given.dtype.kind not in "mMO" or given.ndim != 1 or not given.size:
        return numbers(times, "times")
    if given.dtype.kind == "O":
        # An index with a time zone is an array of dates.
        if not all(isinstance(t, datetime) for t in given) and not all(isinstance(t, timedelta) for t in given):
            return numbers(times, "times")
        try:
            return np.array([(t - given[0]).total_seconds() for t in given])
        except TypeError:
            raise InputError("times: dates with and without a time zone cannot be compared") from None
    if np.isnat(given).any():
        raise InputError(f"the time of {what} {int(np.argmax(np.isnat(given)))} is {given.dtype.type('NaT')}")
    return (given - given[0]) / np.timedelta64(1, "s")


def cubic_interpolant(times, values, ends: str = "natural", end_slopes=None) -> Spline:
    """The C² cubic spline with simple knots at `times` through `values` (tridiagonal system; HJK 2.2).

    times: (M,) increasing; values: (M, …).
    ends: "natural" (no end acceleration, M ≥ 2), "not-a-knot" (M ≥ 4), "clamped" with
        `end_slopes` (2, …) in values per unit of time, or "periodic" (M ≥ 4; the first value
        repeated at the end).

    Raises InputError for times that do not increase, and ends that go with other values.

    >>> sm.splines.cubic_interpolant([0.0, 1.0, 2.0], [0.0, 1.0, 0.0])(1.0)
    array(1.)
    """
    from scipy.interpolate import make_interp_spline  # here: see Spline._scipy

    times, values = check_times(times), numbers(values, "values")
    origin, there = from_origin(times)
    if len(values) != len(times):
        raise InputError(f"{len(times)} times for {len(values)} values")
    choice(ends, ENDS, "end condition")
    finite = np.isfinite(values.reshape(len(values), -1)).all(axis=1)
    if not finite.all():
        raise InputError(f"the value of key {int(np.argmin(finite))} is not finite")
    spread = np.abs(values - values[0]).max(axis=0)
    centre = np.where(np.abs(values[0]) > FAR * spread, values[0], 0.0)
    values = values - centre
    least = 4 if ends in ("not-a-knot", "periodic") else 2
    if len(times) < least:
        raise InputError(f"{len(times)} keyframes are too few for {ends} ends: at least {least} are needed")
    if (ends == "clamped") != (end_slopes is not None):
        raise InputError("end_slopes go with clamped ends, and clamped ends need them")
    if ends == "clamped":
        slopes = numbers(end_slopes, "end_slopes")
        if slopes.shape != (2, *values.shape[1:]):
            raise InputError(f"end_slopes of shape {slopes.shape}: {(2, *values.shape[1:])} is needed")
        conditions = ([(1, slopes[0])], [(1, slopes[1])])
    elif ends == "periodic":
        if not np.allclose(values[0], values[-1], rtol=1e-9, atol=1e-9 * max(1.0, np.abs(values).max())):
            raise InputError("periodic ends need the last keyframe equal to the first")
        fitted = make_interp_spline(there, np.concatenate([values[:-1], values[:1]]), k=3, bc_type="periodic")
        return Spline(BSplineBasis.closed(times, 3), fitted.c[: len(times) - 1] + centre)
    else:
        conditions = ends
    fitted = make_interp_spline(there, values, k=3, bc_type=conditions)
    return Spline(BSplineBasis(fitted.t, 3, origin=origin), fitted.c + centre)


def least_squares(basis: BSplineBasis, times, values) -> Spline:
    """The spline of `basis` with least Σ ‖s(t_i) − values_i‖² (pseudo-inverse; HJK 2.2).

    It interpolates where there are as many conditions as controls (M = n). times: (M,)
    increasing, values: (M, …). Raises InputError where controls are left undetermined or, with
    M = n, where keyframes crowd (Schoenberg–Whitney), naming them.

    >>> t = np.linspace(0, 1, 20)
    >>> line = sm.splines.least_squares(sm.splines.BSplineBasis.clamped([0.0, 1.0], 1), t, 2 * t)
    >>> line.control_points.round(9) + 0.0
    array([0., 2.])
    """
    times, values = check_times(times), numbers(values, "values")
    if len(times) < basis.n:
        raise InputError(f"{len(times)} keyframes cannot determine {basis.n} controls: fewer knots are needed")
    collocation, flat = basis.matrix(times), values.reshape(len(times), -1)
    if len(times) == basis.n:
        if not basis.periodic:
            require_schoenberg_whitney(basis, times)
        controls = spsolve(collocation.tocsc(), flat)
    else:
        controls, _, rank, _ = np.linalg.lstsq(collocation.toarray(), flat)
        if rank < basis.n:
            untouched = np.flatnonzero(np.asarray(abs(collocation).sum(axis=0)) == 0)
            where = f"control {untouched[0]} has no keyframe in its support" if untouched.size else "keyframes crowd"
            raise InputError(f"the keyframes leave controls undetermined ({where}): fewer knots are needed")
    return Spline(basis, np.reshape(controls, (basis.n, *values.shape[1:])))


def require_schoenberg_whitney(basis: BSplineBasis, times: np.ndarray) -> None:
    """Raise InputError unless interpolation at `times` (M,) can be solved: every keyframe needs a control of its own.

    Taken in order, keyframe i gets the next control whose support holds t_i (Schoenberg and
    Whitney 1953); where none is left, the keyframes that crowd together are named.
    """
    used = -1
    for i, free in enumerate(_seeing(basis, times)):
        used = max(used + 1, free[0])
        if used > free[1]:
            first = _crowd(basis, times, i)
            raise InputError(
                f"keyframes {first} to {i} (times {' to '.join(instants(times[first], times[i]))}) are more "
                "conditions than the controls that act there: insert knots between them or raise the degree"
            )


def _seeing(basis: BSplineBasis, times: np.ndarray) -> np.ndarray:
    """(M, 2) the first and the last control that is not zero at each time."""
    indices, values = basis.local(times)
    inside = np.where(values != 0, indices, -1).max(axis=1)
    return np.column_stack([np.where(values != 0, indices, basis.n).min(axis=1), inside])


def _crowd(basis: BSplineBasis, times: np.ndarray, last: int) -> int:
    """The first keyframe of the group that ends with `last` and has more members than controls."""
    seen = _seeing(basis, times)
    for first in range(last, -1, -1):
        if seen[first : last + 1, 1].max() - seen[first : last + 1, 0].min() + 1 < last - first + 1:
            return first
    return 0


def closest(basis: BSplineBasis, spline: Spline, times) -> Spline:
    """The spline s of `basis` with s = `spline` at `times` and least ∫ ‖s⁽ᵐ⁾ − spline⁽ᵐ⁾‖² dt, m = min(2, degree).

    This carries a start value into a space of another degree: it is exact where the space
    holds `spline`, and stays smooth where it does not. Solved as one sparse saddle system.

    times: (M,), fewer than the basis has controls. Raises InputError for times outside of the domain.

    >>> spline = sm.splines.cubic_interpolant([0.0, 1.0, 2.0], [0.0, 1.0, 0.0])
    >>> fewer = sm.splines.closest(sm.splines.BSplineBasis.clamped([0.0, 2.0], 3), spline, np.array([0.0, 2.0]))
    >>> fewer.basis.n
    4
    """
    times = floats(times, "times")
    require_schoenberg_whitney(basis, times)
    order = min(2, basis.degree)
    # Products of two m-th derivatives have degree at most 2 max(p) − 2m on the spans of both splines together.
    spline, times = spline.about(basis.origin).relative, times - basis.origin
    target, basis = basis, basis.relative
    marks = distinct([*spline.basis.breakpoints, *basis.breakpoints], basis.breakpoints, target.origin)
    merged = BSplineBasis.clamped(marks, 1)
    points, weights = gauss(merged, max(basis.degree, spline.degree) - order + 1)
    slopes = basis.matrix(points.ravel(), order)
    weighted = slopes.T.tocsr().multiply(weights.ravel()).tocsr()
    collocation = basis.matrix(times)
    rhs = np.concatenate(
        [
            weighted @ spline(points.ravel(), order).reshape(points.size, -1),
            spline(times).reshape(len(times), -1),
        ]
    )
    gram = weighted @ slopes
    scale = 1 / abs(gram).max()  # of the order of the conditions, for the accuracy of the solve
    rhs[: basis.n] *= scale
    system = sparse.block_array([[scale * gram, collocation.T], [collocation, None]], format="csc")
    factor = splu(system)
    solution = factor.solve(rhs)
    solution += factor.solve(rhs - system @ solution)
    return Spline(target, solution[: basis.n].reshape(basis.n, *spline.control_points.shape[1:]))
