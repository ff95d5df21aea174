"""Animation keys: cubic Hermite keys of splines and motions, and where sampled ones have to lie."""

from collections.abc import Callable
from dataclasses import dataclass
from math import factorial

import numpy as np

from symmotion.brief import instant, instants
from symmotion.errors import InputError
from symmotion.motions import AffineMotion, PoseMotion
from symmotion.motions.interpolants.blends import Interpolant
from symmotion.motions.motion import Moving
from symmotion.motions.quaternions import ProductMotion, QuaternionMotion, angles_travelled
from symmotion.splines import Spline
from symmotion.splines.continuity import first_jump
from symmotion.splines.instants import distinct

# Where between two keys a deviation is measured; its largest values lie near the middle.
INSIDE = np.arange(1, 16) / 16
MOST_KEYS = 100_000
PART = 512  # intervals at a time, which bounds the memory
# No interval becomes shorter than this times the duration, or than some rounding of the times: there it jumps.
SHORTEST = 1e-12


@dataclass(frozen=True, eq=False)
class HermiteKeys:
    """The piecewise cubic with values and slopes at its keys.

    times: (K,) increasing; values: (K, …); arriving, leaving: (K, …) slopes before and behind each key.
    """

    times: np.ndarray
    values: np.ndarray
    arriving: np.ndarray
    leaving: np.ndarray

    def __call__(self, t: np.ndarray) -> np.ndarray:
        """The values (N, …) at times t (N,)."""
        k = np.clip(np.searchsorted(self.times, t, side="right") - 1, 0, len(self.times) - 2)
        step = self.times[k + 1] - self.times[k]
        tail = (-1, *(1,) * (self.values.ndim - 1))
        u, h = ((t - self.times[k]) / step).reshape(tail), step.reshape(tail)
        start = (2 * u**3 - 3 * u**2 + 1) * self.values[k] + h * (u**3 - 2 * u**2 + u) * self.leaving[k]
        return start + (3 * u**2 - 2 * u**3) * self.values[k + 1] + h * (u**3 - u**2) * self.arriving[k + 1]

    def column(self, j: int) -> "HermiteKeys":
        """The keys of the values' entry j."""
        return HermiteKeys(self.times, self.values[:, j], self.arriving[:, j], self.leaving[:, j])

    def stored(self, times: np.ndarray) -> "HermiteKeys":
        """The keys as a file of single precision holds them, at `times` (K,) on the file's clock.

        Slopes are those that keep every piece as it is, over its rounded duration.
        """
        stretch = (np.diff(self.times) / np.diff(times)).reshape(-1, *(1,) * (self.values.ndim - 1))
        arriving, leaving = self.arriving.copy(), self.leaving.copy()
        arriving[1:] *= stretch
        leaving[:-1] *= stretch
        return HermiteKeys(times, *(single(array) for array in (self.values, arriving, leaving)))


def single(array: np.ndarray) -> np.ndarray:
    """An array rounded to single precision, as doubles."""
    with np.errstate(over="ignore"):
        rounded = np.asarray(array, dtype=np.float32).astype(float)
    if not np.isfinite(rounded).all():
        raise InputError("the motion has coordinates beyond the range of single precision: use smaller units")
    return rounded


def clock(times: np.ndarray, start: float, rate: float) -> np.ndarray:
    """(K,) keys on a file's clock of single precision, from 0 at `start` on; InputError where keys fall together."""
    ticks = single((times - start) * rate)
    if (np.diff(ticks) <= 0).any():
        i = int(np.argmax(np.diff(ticks) <= 0))
        raise InputError(
            f"the keys at times {' and '.join(instants(*times[i : i + 2]))} fall together in single precision, "
            "which this format has"
        )
    return ticks


def require_continuous(spline: Spline) -> None:
    """Raise InputError that names the time of a jump."""
    if (time := first_jump(spline)) is not None:
        raise InputError(f"the motion jumps at time {instant(time)}: keys hold continuous motions")


def spline_keys(spline: Spline, times: np.ndarray) -> HermiteKeys:
    """Values and one-sided slopes of a spline at times (K,) that include its breakpoints: exact up to degree 3.

    Raises InputError that names the time of a jump.
    """
    require_continuous(spline)
    b = spline.breakpoints
    piece = np.clip(np.searchsorted(b, times[:-1], side="right") - 1, 0, len(b) - 2)
    # Derivatives at the beginning of a piece are those of the piece; its end belongs to the next one.
    series = [spline(b[:-1], nu)[piece] / factorial(nu) for nu in range(spline.degree + 1)]
    tail = (-1, *(1,) * (series[0].ndim - 1))
    ends = [_horner(series, (times[side] - b[piece]).reshape(tail)) for side in (slice(0, -1), slice(1, None))]
    (left, leaving), (right, arriving) = ends
    values = np.concatenate([left, right[-1:]])
    return HermiteKeys(times, values, np.concatenate([leaving[:1], arriving]), np.concatenate([leaving, arriving[-1:]]))


def _horner(series: list[np.ndarray], x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Value and slope at x of the polynomials with these Taylor coefficients."""
    value, slope = np.zeros_like(series[0]), np.zeros_like(series[0])
    for coefficient in reversed(series):
        slope = value + x * slope
        value = coefficient + x * value
    return value, slope


def breakpoints(motion: Moving) -> np.ndarray:
    """The times where a motion is made of other pieces, ends included, and 17 equidistant ones if it may turn far."""
    if isinstance(motion, PoseMotion):
        both = np.concatenate([turning_points(motion.orientation), motion.translation.breakpoints])
        return distinct(both, motion.domain)
    own: np.ndarray | None = getattr(motion, "breakpoints", None)
    if own is not None and isinstance(motion, AffineMotion | Interpolant):
        return own
    even = np.linspace(*motion.domain, 17)
    return even if own is None else distinct(np.concatenate([own, even]), own)


def turning_points(curve: QuaternionMotion | ProductMotion) -> np.ndarray:
    """The breakpoints, with spans cut into pieces as many as it turns round within, or one more.

    Whole turns between two looks at a motion could else not be told from none.
    """
    knots = curve.breakpoints
    pieces = 1 + (angles_travelled(curve) / (2 * np.pi)).astype(int)
    parts = [np.linspace(a, b, n + 1)[1:] for a, b, n in zip(knots, knots[1:], pieces, strict=False)]
    return np.concatenate([knots[:1], *parts])


def between(times: np.ndarray) -> np.ndarray:
    """(15 (K − 1),) times between those given (K,), in order, where deviations are measured."""
    return (times[:-1, None] + np.diff(times)[:, None] * INSIDE).ravel()


def largest(times: np.ndarray, deviations: Callable[[np.ndarray], np.ndarray]) -> np.ndarray:
    """(K − 1,) the largest deviation in each interval; `deviations` as in `halved_until`, asked part by part."""
    parts = [times[i : i + PART + 1] for i in range(0, len(times) - 1, PART)]
    return np.concatenate([deviations(part).reshape(-1, len(INSIDE)).max(axis=1) for part in parts])


def halved_until(times: np.ndarray, deviations: Callable[[np.ndarray], np.ndarray], tolerance: float) -> np.ndarray:
    """Times with intervals halved until no deviation between them exceeds the tolerance.

    deviations: from times (K,) to those at `between(times)`, (15 (K − 1),). Raises InputError
    where that takes more than 100,000 keys, and where no interval is short enough, naming when.
    """
    shortest = max(SHORTEST * (times[-1] - times[0]), 64 * np.spacing(np.abs(times).max()))
    while True:
        worst = largest(times, deviations)
        open_ = ~(worst <= tolerance)
        if not open_.any():
            return times
        short = open_ & (np.diff(times) <= shortest)
        if short.any():
            raise InputError(
                f"the motion jumps at time {instant(times[np.argmax(short)], 9)}, or is known less well there than to "
                f"the tolerance {tolerance:.3g}: keys hold continuous motions"
            )
        if len(times) + open_.sum() > MOST_KEYS:
            raise InputError(f"more than {MOST_KEYS} keys would be needed: allow a larger tolerance than {tolerance:g}")
        times = np.sort(np.concatenate([times, (times[:-1] + times[1:])[open_] / 2]))
