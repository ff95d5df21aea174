"""Motions as keyframes, sampled."""

import numpy as np
from numpy.typing import ArrayLike

from symmotion.bodies.places import Oriented, placed
from symmotion.errors import InputError
from symmotion.files.formats import FilePath
from symmotion.files.text import write_csv, write_tum
from symmotion.motions import Keyframes, rigid
from symmotion.motions.motion import Moving
from symmotion.splines import check_times

DEFAULT_SAMPLES = 200
MOST_SAMPLES = 10**7
RIGID_TOLERANCE = 1e-6


def write_samples_csv(
    motion: Moving | Oriented, path: FilePath, *, times: ArrayLike | None = None, rate: float | None = None
) -> None:
    """Write samples of a motion exactly, for `read_keyframes`."""
    motion = placed(motion)
    chosen = sample_times(motion, times, rate)
    write_csv(Keyframes(chosen, *motion(chosen)), path)


def write_samples_tum(
    motion: Moving | Oriented,
    path: FilePath,
    *,
    times: ArrayLike | None = None,
    rate: float | None = None,
    orthonormalise: bool = False,
) -> None:
    """Write the rotations of a motion's samples, the closest ones; InputError names when there is none near.

    orthonormalise: however far the samples are from rigid, else at most 1e-6.
    """
    motion = placed(motion)
    write_tum(rigid_samples(motion, sample_times(motion, times, rate), path, orthonormalise), path)


def rigid_samples(motion: Moving, times: np.ndarray, path: FilePath, orthonormalise: bool) -> Keyframes:
    """The motion at times (N,), with the closest rotations; InputError as for `write_samples_tum`."""
    try:
        samples = rigid.orthonormalise(motion, times)
    except InputError as error:
        raise InputError(f"{path}: {error}: write csv or json") from None
    far = samples.deviations > (np.inf if orthonormalise else RIGID_TOLERANCE)
    if far.any():
        time = times[np.argmax(far)]
        raise InputError(
            f"{path}: the motion is not rigid at time {time}: orthonormalise=True writes the closest rotations, csv "
            "and json what it is"
        )
    return samples.keyframes


def sample_times(motion: Moving, times: ArrayLike | None, rate: float | None) -> np.ndarray:
    """(N,) those given, or so many per unit of time from the beginning on, 200 in all where neither is given."""
    a, b = motion.domain
    if times is not None and rate is not None:
        raise InputError("times and rate are two ways to say the same: give one")
    if times is not None:
        return check_times(times, "sample")
    if rate is None:
        return np.linspace(a, b, DEFAULT_SAMPLES)
    steps = (b - a) * rate
    if not 1 <= steps <= MOST_SAMPLES:
        raise InputError(f"rate {rate:g} makes {steps:.3g} steps over the motion: 1 to {MOST_SAMPLES:g} can be written")
    # Rounding must neither drop an end that is a whole number of steps away nor go beyond it.
    return np.minimum(a + np.arange(int(steps * (1 + 1e-12)) + 1) / rate, b)
