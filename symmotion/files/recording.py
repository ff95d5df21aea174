"""Keyframes out of files with what there is to say of them: what was repaired, what was left out, where gaps are."""

from dataclasses import dataclass

import numpy as np

from symmotion import checks
from symmotion.bodies.shapes import Up
from symmotion.brief import in_a_line, instant
from symmotion.errors import InputError
from symmotion.motions import Keyframes

GAP = 5.0  # of the median step


@dataclass(frozen=True, eq=False)
class Recording:
    """Keyframes, and notes: lines on what a reader chose, repaired and left out.

    up: the axis that is upright, "y" or "z", which `plot`, films and players take; None where the file does not say.

    >>> sm.write_keyframes(sm.examples.random_keyframes(4, 40, seed=1), "walk.tum")
    >>> sm.files.read_recording("walk.tum", every=2).keyframes
    Keyframes(3 in 3D, times 0 to 3)
    """

    keyframes: Keyframes
    notes: tuple[str, ...] = ()
    up: Up | None = None

    __repr__ = in_a_line


def gaps(times: np.ndarray) -> str | None:
    """What there is to say of steps longer than five times the median one; None where none are."""
    steps = np.diff(times)
    wide = np.flatnonzero(steps > GAP * np.median(steps))
    if not wide.size:
        return None
    shown = ", ".join(f"{steps[i]:.4g} after time {instant(float(times[i]), 9)}" for i in wide[:3])
    return f"{len(wide)} gap{'s' * (len(wide) > 1)} longer than {GAP:g} median steps: {shown}{' …' * (len(wide) > 3)}"


def thinned(recording: Recording, every: int | None = None, rate: float | None = None) -> Recording:
    """Every n-th keyframe, or those nearest to a number per unit of time; first and last stay, gaps are told.

    Raises InputError where both are given.
    """
    keyframes, notes = recording.keyframes, list(recording.notes)
    count, times = len(keyframes), keyframes.times
    if every is not None and rate is not None:
        raise InputError("every and rate are two ways to thin a recording: give one")
    if every is not None:
        kept = np.arange(0, count, checks.whole(every, 1, "every"))
    elif rate is not None:
        wanted = (times[-1] - times[0]) * checks.positive(rate, "rate")
        targets = times[0] + np.arange(int(min(wanted, count)) + 1) / rate
        right = np.clip(np.searchsorted(times, targets), 1, count - 1)
        kept = np.where(targets - times[right - 1] <= times[right] - targets, right - 1, right)
        kept = np.arange(count) if wanted > count else kept
    else:
        kept = None
    if kept is not None and len(kept := np.unique(np.append(kept, count - 1))) < count:
        keyframes = keyframes[kept]
        notes.append(f"{len(kept)} of {count} keyframes are kept")
    if (gap := gaps(keyframes.times)) is not None:
        notes.append(gap)
    return Recording(keyframes, tuple(notes), recording.up)


def apart(times: np.ndarray, repeated: str) -> list[np.ndarray]:
    """The rows of each keyframe: one, or those whose times repeat or crowd, to be merged or of which the first is kept.

    Crowded are times closer than a thousandth of the median step that follow each other. times: (N,) not decreasing.
    """
    steps = np.diff(times)
    positive = steps[steps > 0]
    reach = 1e-3 * float(np.median(positive)) if positive.size else 0.0
    starts = np.concatenate([[0], np.flatnonzero(steps > reach) + 1])
    crowds = np.split(np.arange(len(times)), starts[1:])
    return [crowd[:1] if repeated == "drop" else crowd for crowd in crowds]
