"""Keyframes that are hardly two: too close in time, or reflections of each other."""

import numpy as np

from symmotion.errors import InputError
from symmotion.splines.instants import rounding

# Of the median step: keyframes closer than the first are one, told twice; closer than the second, hardly two.
CROWDED, CLOSE = 1e-6, 1e-3


def close(times: np.ndarray) -> float:
    """How far apart keyframes are that are hardly two: a thousandth of the median step, or what rounding can tell."""
    return max(CLOSE * float(np.median(np.diff(times))), rounding(times))


def require_apart(times: np.ndarray, what: str = "keyframes", numbers: np.ndarray | None = None) -> None:
    """InputError that names the keyframes closer than a millionth of the median step, or than rounding can tell.

    what, numbers: (M,) what they are called; 0, 1, 2, … when left out.
    """
    if (found := _closest(times, CROWDED * float(np.median(np.diff(times))))) is not None:
        raise InputError(f"{_pair(times, found, what, numbers)}, hardly two: leave one out, as keys.merged() does")
    if (found := _closest(times, rounding(times))) is not None:
        raise InputError(
            f"{_pair(times, found, what, numbers)}, closer than times of that size can tell: count from a nearer origin"
        )


def close_note(times: np.ndarray) -> str | None:
    """What there is to say of keyframes closer than a thousandth of the median step; None where none are."""
    found = _closest(times, close(times))
    if found is None:
        return None
    return f"{_pair(times, found, 'keyframes')}, where the motion may swing; keys.merged() leaves one out"


def _closest(times: np.ndarray, least: float) -> int | None:
    """The number of the shortest step, where it is shorter than `least`."""
    steps = np.diff(times)
    i = int(np.argmin(steps))
    return i if steps[i] < least else None


def _pair(times: np.ndarray, i: int, what: str, numbers: np.ndarray | None = None) -> str:
    steps, (one, other) = np.diff(times), (i, i + 1) if numbers is None else numbers[[i, i + 1]]
    share = steps[i] / np.median(steps)
    when = f"times {float(times[i])!r} and {float(times[i + 1])!r}"
    return f"{what} {one} and {other} ({when}) are {share:.1e} of the median step apart"


def opposite_note(linear: np.ndarray) -> str | None:
    """What there is to say of keyframes (M, d, d) of opposite orientations; None where all have one."""
    volumes = np.linalg.det(linear)
    turned = volumes[:-1] * volumes[1:] < 0
    if not turned.any():
        return None
    i = int(np.argmax(turned))
    return (
        f"keyframes {i} and {i + 1} have determinants {volumes[i]:.3g} and {volumes[i + 1]:.3g}, opposite "
        "orientations: between them det A passes zero, and the body is flat there"
    )
