"""Quaternion curves that turn from keyframe to keyframe without going back: PCHIP about the axes between them."""

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from symmotion.checks import choice
from symmotion.errors import InputError
from symmotion.motions.keyframes import Keyframes
from symmotion.motions.quaternions.algebra import Signs
from symmotion.motions.quaternions.keys import OrientationKeys
from symmotion.motions.quaternions.products import ProductMotion
from symmotion.splines import BSplineBasis, CumulativeBasis, from_origin

if TYPE_CHECKING:
    from symmotion.motions.rotations import Rotations

ENDS = ("free", "periodic")


def monotone_curve(
    times: ArrayLike | Keyframes,
    quaternions: "Rotations | None" = None,
    turns: ArrayLike | None = None,
    *,
    ends: str = "free",
    signs: Signs = "align",
    scalar_first: bool = True,
    norms: float | None = None,
) -> ProductMotion:
    """The C¹ quaternion curve through keyframes that turns steadily about the axes between them, whatever the times.

    On an interval of length h with the way ω between its keyframes, q(t) = q_i exp(δ_i A) exp(ω S) exp(δ'_i B): S rises
    from 0 to 1 and never falls, A = h u (1 − u)² and B = −h u² (1 − u) bend the axis such that rates at keyframes
    agree. The half-angle rate there is v_i = H (e_{i−1} + e_i)/2, e the axes before and behind, H the weighted harmonic
    mean of the speeds ‖ω‖/h; its part along each axis is the slope of S, what is left δ. About one axis the angle is
    SciPy's PCHIP. Slopes are 3 times the mean one at most, so that S is monotone (Fritsch and Carlson 1980, Fritsch and
    Butland 1984), and the body turns through less than 17/9 of the way asked in every interval: of keyframes without
    extra turns by no turn more. A keyframe changes four intervals, whole turns among them. The acceleration jumps at
    keyframes.

    times, quaternions, turns, signs, scalar_first, norms: as for `interpolate_quaternions`.
    ends: "free", where the slope is that of a parabola within PCHIP's limits, or "periodic" (3 keyframes or more, the
        last one equal to the first), where the rate at the end is that at the start.

    Raises InputError for what cannot be.

    >>> curve = sm.interpolants.monotone_curve([0.0, 1.0, 1.01, 9.0], np.eye(4)[[0, 1, 2, 3]] + 0.2, norms=1.0)
    >>> bool(sm.quaternions.extra_turns(curve, curve.breakpoints, curve(curve.breakpoints)).any())
    False
    """
    keys = OrientationKeys.of(times, quaternions, turns, signs, scalar_first=scalar_first, norms=norms)
    if choice(ends, ENDS, "end condition") == "periodic":
        if len(keys) < 3:
            raise InputError(f"{len(keys)} keyframes are too few for periodic ends: at least 3 are needed")
        keys.require_closed()
    origin, since = from_origin(keys.times)
    steps = np.diff(since)
    length = np.linalg.norm(keys.ways, axis=1)
    axes = keys.ways / np.where(length > 0, length, 1.0)[:, None]
    rates = _rates(steps, length / steps, axes, ends == "periodic")
    rise = [np.sum(r * axes, axis=1) for r in (rates[:-1], rates[1:])]
    bends = [r - along[:, None] * axes for r, along in zip((rates[:-1], rates[1:]), rise, strict=True)]
    # Bézier ordinates of A, S and B behind their first, which is zero, on knots that are there three times.
    third, zero = steps / 3, np.zeros(len(steps))
    low, high = (third * slope / np.where(length > 0, length, 1.0) for slope in rise)
    ordinates = [[third, zero, zero], [low, 1 - high, zero + 1], [zero, -third, zero]]
    knots = np.concatenate([since[:1], np.repeat(since, 3), since[-1:]])
    functions = CumulativeBasis(
        BSplineBasis(knots, 3, origin=origin),
        np.repeat(3 * np.arange(len(steps)) + 1, 3),
        np.array(ordinates).transpose(2, 0, 1).reshape(-1, 3),
    )
    increments = np.stack([bends[0], keys.ways, bends[1]], axis=1).reshape(-1, 3)
    return ProductMotion(functions, keys.quaternions[0], increments)


def _rates(steps: np.ndarray, speeds: np.ndarray, axes: np.ndarray, periodic: bool) -> np.ndarray:
    """(M, 3) the rates at keyframes, from the intervals between them."""
    if periodic:
        return _inner(*(np.concatenate([part[-1:], part, part[:1]]) for part in (steps, speeds, axes)))
    if len(steps) == 1:
        return np.repeat(speeds[:, None] * axes, 2, axis=0)
    ends = [_end(steps[[k, n]], speeds[k], speeds[n] * (axes[n] @ axes[k])) * axes[k] for k, n in ((0, 1), (-1, -2))]
    return np.concatenate([ends[:1], _inner(steps, speeds, axes), ends[1:]])


def _inner(steps: np.ndarray, speeds: np.ndarray, axes: np.ndarray) -> np.ndarray:
    """(S − 1, 3) the rates between S intervals."""
    before, behind = steps[:-1], steps[1:]
    first, second = 2 * behind + before, behind + 2 * before
    product = speeds[:-1] * speeds[1:]
    sums = first * speeds[1:] + second * speeds[:-1]
    mean = (first + second) * product / np.where(sums > 0, sums, 1.0)
    return mean[:, None] * (axes[:-1] + axes[1:]) / 2


def _end(steps: np.ndarray, speed: float, following: float) -> float:
    """The slope at an end as PCHIP has it, of a speed that is not negative: that of a parabola, within limits."""
    slope = ((2 * steps[0] + steps[1]) * speed - steps[0] * following) / steps.sum()
    return float(np.clip(slope, 0.0, 3 * speed if following < 0 else np.inf))
