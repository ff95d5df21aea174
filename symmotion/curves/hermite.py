"""Cubic splines made of slopes at their keys: Hermite, Catmull–Rom, Kochanek–Bartels."""

import numpy as np
from numpy.typing import ArrayLike

from symmotion.checks import choice, numbers
from symmotion.errors import InputError
from symmotion.splines import BSplineBasis, Spline, check_times, from_origin

ENDS = ("second-order", "natural", "clamped", "periodic")
TCB = {
    "tension": "at 1 the slope is zero, at −1 doubled; beyond 1 the curve would turn back at the key",
    "continuity": "at ±1 each side follows one neighbouring chord only; beyond, it would turn against the other",
    "bias": "at 1 the slope is that of the incoming chord, at −1 of the outgoing one; beyond, one of the two would "
    "count against",
}


def hermite_spline(times, values, slopes, right_slopes=None, *, periodic: bool = False) -> Spline:
    """The cubic spline with given values and slopes at its keys (lecture notes, "Cubic Hermite splines").

    On a segment of length h, u the share of it passed: y_i (2u³ − 3u² + 1) + y_{i+1} (−2u³ + 3u²) +
    h s_i (u³ − 2u² + u) + h s_{i+1} (u³ − u²).

    times: (M,) increasing, M ≥ 2; values: (M, …); slopes: (M, …), values per unit of time.
    right_slopes: (M, …) the slopes after each key where they differ from `slopes`, those before
    it; such a key is broken: the spline is only continuous there, else C¹.
    periodic: the last key is the first one a period later.

    Raises InputError for times that do not increase, values and slopes of other shapes, and keys that do not close.

    >>> sm.curves.hermite_spline([0.0, 1.0], [0.0, 1.0], [0.0, 0.0])(0.5)
    array(0.5)
    """
    times, values = check_keys(times, values, 2)
    origin, times = from_origin(times)
    left = _like(slopes, values, "slopes")
    right = left if right_slopes is None else _like(right_slopes, values, "right_slopes")
    broken = np.array([not np.array_equal(a, b) for a, b in zip(left, right, strict=True)])
    steps = np.diff(times)
    thirds = (steps / 3).reshape(-1, *(1,) * (values.ndim - 1))
    # A double knot has the two controls beside the key, y − h s/3 before it and y + h s/3 after; a triple one
    # (broken) also the key itself.
    before, after = values[1:] - thirds * left[1:], values[:-1] + thirds * right[:-1]
    if periodic:
        return _closed(times, values, left, right, before, after, origin)
    controls, copies = [values[0], after[0]], np.where(broken, 3, 2)[1:-1]
    for i in range(1, len(times) - 1):
        controls += [before[i - 1], *([values[i]] if broken[i] else []), after[i]]
    controls += [before[-1], values[-1]]
    knots = np.concatenate([np.full(4, times[0]), np.repeat(times[1:-1], copies), np.full(4, times[-1])])
    return Spline(BSplineBasis(knots, 3, origin=origin), np.array(controls))


def _closed(times, values, left, right, before, after, origin) -> Spline:
    """The periodic Hermite spline, whose knots repeat with the period."""
    _require_closed(times, values)
    for name, slopes in (("slopes", left), ("right_slopes", right)):
        if not np.allclose(slopes[0], slopes[-1], rtol=1e-9, atol=1e-9 * max(1.0, np.abs(slopes).max())):
            raise InputError(f"a periodic spline needs the last of the {name} equal to the first")
    before = np.concatenate([before[-1:], before[:-1]])
    broken = [not np.array_equal(a, b) for a, b in zip(left[:-1], right[:-1], strict=True)]
    controls, copies = [], np.where(broken, 3, 2)
    for i, tear in enumerate(broken):
        controls += [before[i], *([values[i]] if tear else []), after[i]]
    # The first control belongs to the three knots that end with the last copy of the first key.
    controls = np.roll(np.array(controls), -1 if broken[0] else 0, axis=0)
    period, one = times[-1] - times[0], np.repeat(times[:-1], copies)
    n = len(one)
    tiled = (one + period * np.arange(-2, 4)[:, None]).ravel()
    first = 2 * n + copies[0] - 1 - 3
    return Spline(BSplineBasis(tiled[first : first + n + 7], 3, periodic=True, origin=origin), controls)


def catmull_rom(times, values, ends: str = "second-order", end_slopes=None) -> Spline:
    """The C¹ cubic spline whose slope at a key is that of the parabola through it and its neighbours.

    s_i = (h_{i−1} c_i + h_i c_{i−1}) / (h_{i−1} + h_i), with h_i = t_{i+1} − t_i and chords
    c_i = (y_{i+1} − y_i) / h_i (lecture notes, with the products that they print as quotients).

    times: (M,) increasing; values: (M, …).
    ends: "second-order", the slope at the end of the parabola through the three last keys (M ≥ 3):
        s_0 = ((t_2 − t_0) c_0 − (t_1 − t_0) (y_2 − y_0) / (t_2 − t_0)) / (t_2 − t_1);
        "natural", no acceleration at the end (M ≥ 2); "clamped", with `end_slopes` (2, …);
        "periodic", the last key being the first one a period later (M ≥ 3).

    Raises InputError for times that do not increase, values of another number, and ends that are none.

    >>> sm.curves.catmull_rom([0.0, 1.0, 3.0], [0.0, 1.0, 9.0])([0.0, 1.0, 3.0], nu=1)
    array([0., 2., 6.])
    """
    return kochanek_bartels(times, values, ends=ends, end_slopes=end_slopes)


def kochanek_bartels(
    times,
    values,
    tension: ArrayLike = 0.0,
    continuity: ArrayLike = 0.0,
    bias: ArrayLike = 0.0,
    ends: str = "second-order",
    end_slopes=None,
) -> Spline:
    """The cubic spline with tension T, continuity C and bias B at every key; zeros give Catmull–Rom.

    Slope before a key: (1−T) [(1−C)(1+B) h_i c_{i−1} + (1+C)(1−B) h_{i−1} c_i] / (h_{i−1} + h_i),
    after it:           (1−T) [(1+C)(1+B) h_i c_{i−1} + (1−C)(1−B) h_{i−1} c_i] / (h_{i−1} + h_i),
    with h_i = t_{i+1} − t_i and chords c_i = (y_{i+1} − y_i) / h_i.

    Sign of the bias: positive leans on the incoming chord and overshoots the key, as in Kochanek and
    Bartels (1984) and in the package `splines`; the lecture notes have the opposite sign.

    times: (M,) increasing; values: (M, …); tension, continuity, bias: one number for all keys or
    (M,), each in [−1, 1]. ends: see `catmull_rom`. An end key has one chord only: tension shortens
    its second-order slope, continuity and bias mean nothing there and must be 0 where given per key.

    end_slopes: (2, …), of clamped ends. Raises InputError that names the key at fault.

    >>> loose = sm.curves.kochanek_bartels([0.0, 1.0, 2.0], [0.0, 1.0, 0.5])
    >>> tight = sm.curves.kochanek_bartels([0.0, 1.0, 2.0], [0.0, 1.0, 0.5], tension=1.0)
    >>> loose(1.0, nu=1), tight(1.0, nu=1)
    (array(0.25), array(0.))
    """
    choice(ends, ENDS, "end condition")
    times, values = check_keys(times, values, 3 if ends in ("second-order", "periodic") else 2, f" for {ends} ends")
    if (ends == "clamped") != (end_slopes is not None):
        raise InputError("end_slopes go with clamped ends, and clamped ends need them")
    flat = values.reshape(len(times), -1)
    closed = ends == "periodic"
    t, c, b = (
        _shape_parameter(name, given, len(times), closed)
        for name, given in (("tension", tension), ("continuity", continuity), ("bias", bias))
    )
    steps = np.diff(times)
    chords = np.diff(flat, axis=0) / steps[:, None]
    left, right = np.empty_like(flat), np.empty_like(flat)
    if closed:
        _require_closed(times, values)
        around = (np.r_[steps[-1], steps], np.concatenate([chords[-1:], chords]))
        left[:-1], right[:-1] = _tcb_slopes(*around, t[:-1], c[:-1], b[:-1])
        left[-1], right[-1] = left[0], right[0]
    else:
        left[1:-1], right[1:-1] = _tcb_slopes(steps, chords, t[1:-1], c[1:-1], b[1:-1])
        if ends == "clamped":
            right[0], left[-1] = _like(end_slopes, values[:2], "end_slopes").reshape(2, -1)
        elif ends == "second-order":
            share = steps[[0, -1]] / (steps[[0, -1]] + steps[[1, -2]])
            right[0] = (1 - t[0]) * (chords[0] + share[0] * (chords[0] - chords[1]))
            left[-1] = (1 - t[-1]) * (chords[-1] + share[1] * (chords[-1] - chords[-2]))
        elif len(times) == 2:
            right[0] = left[-1] = chords[0]
        else:
            right[0] = (3 * chords[0] - left[1]) / 2
            left[-1] = (3 * chords[-1] - right[-2]) / 2
        left[0], right[-1] = right[0], left[-1]
    return hermite_spline(times, values, left.reshape(values.shape), right.reshape(values.shape), periodic=closed)


def _tcb_slopes(steps, chords, t, c, b) -> tuple[np.ndarray, np.ndarray]:
    """The slopes before and after each inner key of the steps (K + 1,) and chords (K + 1, D)."""
    whole = steps[:-1] + steps[1:]
    incoming = ((1 - t) * (1 + b) * steps[1:] / whole)[:, None] * chords[:-1]
    outgoing = ((1 - t) * (1 - b) * steps[:-1] / whole)[:, None] * chords[1:]
    less, more = (1 - c)[:, None], (1 + c)[:, None]
    return less * incoming + more * outgoing, more * incoming + less * outgoing


def check_keys(times, values, least: int, what: str = "") -> tuple[np.ndarray, np.ndarray]:
    """Times (M,) and values (M, …) of keys as arrays; InputError names what is wrong with them."""
    times, values = check_times(times, "key"), numbers(values, "values")
    if values.ndim == 0 or len(values) != len(times):
        raise InputError(f"values of shape {values.shape} for {len(times)} times: one row per key is needed")
    if len(times) < least:
        raise InputError(f"{len(times)} key{'s' * (len(times) != 1)}: at least {least} are needed{what}")
    finite = np.isfinite(values.reshape(len(values), -1)).all(axis=1)
    if not finite.all():
        raise InputError(f"the value of key {int(np.argmin(finite))} is not finite")
    return times, values


def _require_closed(times: np.ndarray, values: np.ndarray) -> None:
    if len(times) < 3:
        raise InputError(f"{len(times)} keys: a periodic spline needs at least 3")
    if not np.allclose(values[0], values[-1], rtol=1e-9, atol=1e-9 * max(1.0, np.abs(values).max())):
        raise InputError("a periodic spline needs the last key's value equal to the first one's")


def _like(slopes, values: np.ndarray, what: str) -> np.ndarray:
    slopes = numbers(slopes, what)
    if slopes.shape != values.shape:
        raise InputError(f"{what} of shape {slopes.shape}: {values.shape}, one per key, is needed")
    if not np.isfinite(slopes).all():
        raise InputError(f"{what}: number {int(np.argwhere(~np.isfinite(slopes))[0][0])} is not finite")
    return slopes


def _shape_parameter(name: str, given, count: int, closed: bool) -> np.ndarray:
    """(M,) tension, continuity or bias; InputError names the key where it is outside its meaning, and why."""
    values = numbers(given, name)
    if values.shape not in ((), (count,)):
        raise InputError(f"{name} of shape {values.shape}: one number, or one for each of the {count} keys, is needed")
    per_key = np.broadcast_to(values, count)
    outside = ~(np.abs(per_key) <= 1)
    if outside.any():
        key = int(np.argmax(outside))
        raise InputError(f"{name} {per_key[key]:g} at key {key} is outside [−1, 1]: {TCB[name]}")
    if closed and values.shape and per_key[0] != per_key[-1]:
        raise InputError(f"{name} of a periodic spline: the last key is the first one, and needs the same {name}")
    if name != "tension" and values.shape and not closed and (per_key[0] or per_key[-1]):
        key = 0 if per_key[0] else count - 1
        raise InputError(
            f"{name} {per_key[key]:g} at key {key}, an end: it weighs the chords before and after a key, "
            "of which an end has one; give 0 there"
        )
    return per_key
