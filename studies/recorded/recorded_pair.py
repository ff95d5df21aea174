"""A noisy recording with the truth beside it: reading, aligning, judging. Material for studies, no study itself."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation, Slerp

import symmotion as sm
from studies.recorded.recorded_poses import RECORDING
from studies.runner.recordings import recorded
from symmotion.motions import polar_factors

ESTIMATE = recorded("freiburg1_xyz-rgbdslam.txt")


@dataclass(frozen=True, eq=False)
class Pair:
    """estimate: noisy poses, aligned with the truth, from 0 s; truth: while the estimate lasts; note: where from."""

    estimate: sm.Keyframes
    truth: sm.Keyframes
    note: str


def load() -> Pair:
    """The recorded pair beside the checkout, else the project's example, five times as noisy as by default."""
    if ESTIMATE.is_file() and RECORDING.is_file():
        estimate, truth = sm.read_keyframes(ESTIMATE), sm.read_keyframes(RECORDING)
        source = f"Recorded pair: {ESTIMATE.name}, judged by {RECORDING.name} (TUM RGB-D benchmark, CC BY 4.0)."
    else:
        estimate, truth = sm.examples.recorded_tour(noise=5.0), sm.examples.recorded_tour(2001, noise=0.0)
        source = f"Ran on example data made by the project: {ESTIMATE.name} is not beside the checkout."
    aligned, said = _align(estimate, truth)
    start = aligned.times[0]
    during = truth[(truth.times >= start) & (truth.times <= aligned.times[-1])]
    noisy, judging = (sm.Keyframes(k.times - start, k.linear, k.translation) for k in (aligned, during))
    return Pair(noisy, judging, f"{source} {said}")


def _align(estimate: sm.Keyframes, truth: sm.Keyframes) -> tuple[sm.Keyframes, str]:
    """The estimate in the truth's frames, both of the room and of the body, by least squares at common times."""
    common = (estimate.times >= truth.times[0]) & (estimate.times <= truth.times[-1])
    noisy = estimate[common]
    position = _linear(truth.times, truth.translation, noisy.times)
    orientation = Slerp(truth.times, truth.rotations(1e-3))(noisy.times)
    centre, goal = noisy.translation.mean(axis=0), position.mean(axis=0)
    turn, _ = Rotation.align_vectors(position - goal, noisy.translation - centre)
    moved = turn.apply(noisy.translation - centre) + goal
    turned = turn * noisy.rotations(1e-3)
    # What the body's own axes are off, in the mean: two calibrations of one camera.
    offset = (turned.inv() * orientation).mean()
    said = (
        f"The truth was evaluated at the estimate's {len(noisy)} times (linear, slerp); a least-squares rigid "
        f"alignment turned the estimate by {np.rad2deg(turn.magnitude()):.3g}°, and the mean offset of the body's "
        f"axes, {np.rad2deg(offset.magnitude()):.3g}°, was taken out. No time offset was fitted."
    )
    return sm.Keyframes.from_rotations(noisy.times, turned * offset, moved), said


def _linear(times: np.ndarray, values: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    flat = values.reshape(len(values), -1)
    return np.stack([np.interp(wanted, times, column) for column in flat.T], axis=1).reshape(-1, *values.shape[1:])


@dataclass(frozen=True)
class Error:
    """Root mean squares against the truth: position in mm, orientation in °, velocity (over 0.1 s) in mm/s.

    distortion: largest entry of |AᵀA − I| before the polar factor was taken.
    """

    position: float
    orientation: float
    velocity: float
    distortion: float


def judge(pair: Pair, linear: np.ndarray, translation: np.ndarray) -> Error:
    """The error of matrices (N, 3, 3) and positions (N, 3) at the truth's times; matrices are orthonormalised."""
    truth = pair.truth
    turned = Rotation.from_matrix(polar_factors(linear)[0])
    angle = np.rad2deg((truth.rotations(1e-3).inv() * turned).magnitude())
    away = translation - truth.translation
    pace = max(1, round(0.1 / float(np.median(np.diff(truth.times)))))
    drift = (away[pace:] - away[:-pace]) / (truth.times[pace:] - truth.times[:-pace])[:, None]
    return Error(
        1e3 * float(np.sqrt((away**2).sum(axis=1).mean())),
        float(np.sqrt((angle**2).mean())),
        1e3 * float(np.sqrt((drift**2).sum(axis=1).mean())),
        float(np.abs(linear.transpose(0, 2, 1) @ linear - np.eye(3)).max()),
    )


def judge_motion(pair: Pair, motion: sm.AffineMotion) -> Error:
    return judge(pair, *motion(pair.truth.times))


def straight(pair: Pair, samples: sm.Keyframes) -> tuple[np.ndarray, np.ndarray]:
    """Samples interpolated entry by entry in straight lines at the truth's times."""
    parts = (_linear(samples.times, values, pair.truth.times) for values in (samples.linear, samples.translation))
    linear, translation = parts
    return linear, translation


def moving_average(pair: Pair, samples: sm.Keyframes, width: int) -> tuple[np.ndarray, np.ndarray]:
    """Means of `width` samples, entry by entry, in straight lines at the truth's times."""
    from scipy.ndimage import uniform_filter1d

    means = (uniform_filter1d(v, width, axis=0, mode="nearest") for v in (samples.linear, samples.translation))
    return straight(pair, sm.Keyframes(samples.times, *means))


def smoothing_spline(pair: Pair, samples: sm.Keyframes) -> tuple[np.ndarray, np.ndarray]:
    """SciPy's smoothing spline of every entry, its parameter by generalised cross-validation, at the truth's times."""
    from scipy.interpolate import make_smoothing_spline

    entries = np.concatenate([samples.linear.reshape(-1, 9), samples.translation], axis=1)
    values = np.stack([make_smoothing_spline(samples.times, e)(pair.truth.times) for e in entries.T], axis=1)
    return values[:, :9].reshape(-1, 3, 3), values[:, 9:]
