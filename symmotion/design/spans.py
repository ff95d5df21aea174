"""The degree of a program's splines, and where their knots lie between its keyframes."""

import numpy as np

from symmotion import checks
from symmotion.errors import InputError

MOST_KNOTS = 10**6
# Beyond them programs take minutes, and the numbers of higher degrees have no digits left.
MOST_DEGREE, MOST_REFINE = 30, 1000
# An interval is long beside a neighbour from so many times its length on.
LONG = 4.0


def spline_degree(degree: int, least: int = 1, what: str = "degree") -> int:
    """The degree of a program's splines; InputError unless it is one."""
    return checks.whole(degree, least, what, most=MOST_DEGREE)


def knots_between(refine: int, what: str = "refine", of: str = " of knots per segment") -> int:
    """How many knots lie between two keyframes; InputError unless they may be so many."""
    return checks.whole(refine, 0, what, of, most=MOST_REFINE)


def refined_times(times: np.ndarray, refine: int) -> np.ndarray:
    """The times with `refine` more, equally spaced, in every segment; InputError where they are too many."""
    if (len(times) - 1) * (refine + 1) > MOST_KNOTS:
        raise InputError(f"refine {refine}: with {len(times)} times that makes more than {MOST_KNOTS} knots")
    share = np.arange(refine + 1) / (refine + 1)
    return np.append((times[:-1, None] + np.diff(times)[:, None] * share).ravel(), times[-1])


def graded_times(times: np.ndarray, refine: int, closed: bool = False) -> np.ndarray:
    """Those of `refined_times`, and more where a segment is LONG beside a neighbour, closer towards that one.

    Away from the neighbour the distance of two grows by its own length until it is that of `refine`: a body that has
    turned fast for a short time turns on, and few knots do not follow it. closed: the first follows the last.
    """
    even, steps = refined_times(times, refine), np.diff(times)
    beside = np.pad(steps, 1, mode="wrap" if closed else "edge")
    ends = np.minimum(np.stack([beside[:-2], beside[2:]]), steps) / (refine + 1)
    long = np.flatnonzero(LONG * (refine + 1) * ends.min(axis=0) < steps)
    if not long.size:
        return even
    pieces = np.split(even[:-1], np.arange(1, len(steps)) * (refine + 1))
    for i in long:
        first, last = ends[:, i].tolist()
        pieces[i] = times[i] + _graded(float(steps[i]), first, last, float(steps[i]) / (refine + 1))
    return np.append(np.concatenate(pieces), times[-1])


def _graded(length: float, first: float, last: float, most: float) -> np.ndarray:
    """Times from 0 on, short of a length, whose distances grow from both ends up to the most.

    The density of knots at x is the reciprocal of min(first + x, last + length − x, most).
    """
    most = min(most, 0.5 * (first + last + length))
    rising, falling = np.log(most / first), np.log(most / last)
    level = (length - (most - first) - (most - last)) / most
    total = rising + level + falling
    count = int(np.ceil(total - 1e-9))
    y = np.arange(count) / count * total
    return np.where(
        y < rising,
        first * np.expm1(np.minimum(y, rising)),
        np.where(
            y < rising + level,
            most - first + most * (y - rising),
            length - last * np.expm1(np.clip(total - y, 0.0, falling)),
        ),
    )
