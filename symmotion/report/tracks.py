"""Motions sampled to piecewise cubics, as players have them."""

import numpy as np

from symmotion.errors import InputError
from symmotion.motions import Affine
from symmotion.motions.motion import Moving
from symmotion.report.values import Track

ACCURACY = 3e-4  # of what the motion spans: a fifth of a pixel of a player
FIRST, MOST = 9, 129  # times of a track at first and at most
TOLERATED = 1e-2  # of what the motion spans
SHORTEST = 1e-6  # of all time: a step within which a motion may jump


def sampled(label: str, colour: str, motion: Moving, corners: np.ndarray, accuracy: float) -> Track:
    """The motion as cubics between times that are put where they are needed.

    Every step is halved where the cubic misses a body point (P, d) by more than `accuracy`, up to
    129 times; numbers are rounded to about a hundredth of that. Raises InputError where that many
    leave a hundredth of what the motion spans.
    """
    box = np.array(np.meshgrid(*np.stack([corners.min(axis=0), corners.max(axis=0)]).T)).reshape(corners.shape[1], -1).T
    times = np.linspace(*motion.domain, FIRST)
    while (missed := _missed(motion, times, box)).max() > accuracy and len(times) < MOST:
        worst = np.argsort(-missed)[: MOST - len(times)]
        worst = worst[missed[worst] > accuracy]
        times = np.sort(np.append(times, (times[worst] + times[worst + 1]) / 2))
    if missed.max() > TOLERATED / ACCURACY * accuracy:
        raise InputError(f"{label!r}: the motion bends too often for {MOST} times: choose a shorter span")
    size, radius = accuracy / ACCURACY, float(np.abs(corners).max())
    step = float(np.diff(times).max())
    # As many digits as keep the closest times apart.
    digits = 4 - int(np.floor(np.log10(np.diff(times).min())))
    return Track(
        label,
        colour,
        tuple(round(float(t), digits) + 0.0 for t in times),
        rounded(flat(motion(times)), size, radius),
        rounded(flat(motion(times, 1)), size / step, radius),
    )


def _missed(motion: Moving, times: np.ndarray, points: np.ndarray) -> np.ndarray:
    """(N − 1,) how far body points are off in each step, at its quarters; 0 where it is too short to be seen."""
    from scipy.interpolate import CubicHermiteSpline  # here, as in `splines`: it takes a tenth of a second

    between = (times[:-1, None] + np.diff(times)[:, None] * [0.25, 0.5, 0.75]).ravel()
    cubic = CubicHermiteSpline(times, flat(motion(times)), flat(motion(times, 1)))
    off = (cubic(between) - flat(motion(between))).reshape(len(times) - 1, 3, -1)
    d = points.shape[1]
    away = off[..., None, d * d :] + points @ np.swapaxes(off[..., : d * d].reshape(*off.shape[:2], d, d), -1, -2)
    seen = np.diff(times) > SHORTEST * (times[-1] - times[0])
    return np.where(seen, np.linalg.norm(away, axis=-1).max(axis=(1, 2)), 0.0)


def flat(position: Affine) -> np.ndarray:
    """(N, d² + d) poses: each matrix row by row, then the translation."""
    return np.concatenate([position.linear.reshape(len(position.linear), -1), position.translation], axis=1)


def extent(motion: Moving, corners: np.ndarray) -> float:
    """The diagonal of the box that the body passes through."""
    linear, translation = motion(np.linspace(*motion.domain, 65))
    places = translation[:, None] + corners @ np.swapaxes(linear, 1, 2)
    return float(np.linalg.norm(np.ptp(places.reshape(-1, places.shape[-1]), axis=0)))


def rounded(poses: np.ndarray, size: float, radius: float) -> tuple[tuple[float, ...], ...]:
    """Poses rounded to five digits of what they span."""
    d = 2 if poses.shape[1] == 6 else 3
    places, turns = (4 - int(np.floor(np.log10(s))) for s in (size, size / radius))
    whole = np.concatenate([np.round(poses[:, : d * d], turns), np.round(poses[:, d * d :], places)], axis=1)
    return tuple(tuple(row) for row in (whole + 0.0).tolist())  # without −0
