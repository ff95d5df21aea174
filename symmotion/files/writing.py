"""Keyframes and motions into files."""

import csv
import json
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from symmotion.bodies.body import placed
from symmotion.errors import InputError
from symmotion.files import formats
from symmotion.files.formats import FilePath
from symmotion.files.gltf_writing import write_gltf
from symmotion.files.usd import write_usd
from symmotion.files.written import WrittenMotion
from symmotion.motions import AffineMotion, Keyframes, as_rotations, rigid
from symmotion.motions.motion import Motion
from symmotion.motions.quaternions import QuaternionMotion
from symmotion.splines import check_times
from symmotion.whole import whole_file

MOTION_FORMATS = ("json", "csv", "tum", *formats.SCENES)
DEFAULT_SAMPLES = 200
MOST_SAMPLES = 10**7
RIGID_TOLERANCE = 1e-6


def write_keyframes(keyframes: Keyframes, path: FilePath, format: str | None = None) -> None:
    """Write a file that `read_keyframes` reads, in the format that its ending names unless one is given.

    csv: columns t, a11 …, v1 …; json: the object of arrays; kitti: 3D, and times 0, 1, 2, …
    only, since it has none; tum: rotations only. Numbers come back exactly, from tum the
    rotations up to rounding. The file appears whole or not at all.

    Raises InputError for keyframes that the format cannot hold and a path that cannot be written.
    """
    chosen = formats.format_of(path, format, formats.FORMATS)
    times, linear, translation = keyframes.times, keyframes.linear, keyframes.translation
    m, d = len(keyframes), keyframes.dimension
    if chosen == "json":
        _write_json(path, {"times": times, "linear": linear, "translation": translation})
    elif chosen == "csv":
        header = ("t", *formats.MATRICES[d], *formats.TRANSLATIONS[-1][:d])
        _write_table(path, [header], np.column_stack([times, linear.reshape(m, -1), translation]), ",")
    elif chosen == "kitti":
        if d != 3:
            raise InputError(f"{path}: kitti holds 3D keyframes; write csv or json")
        if (times != np.arange(m)).any():
            raise InputError(f"{path}: kitti has no times, and these are not 0, 1, 2, …; write csv or json")
        _write_table(path, [], np.concatenate([linear, translation[:, :, None]], axis=2).reshape(m, 12), " ")
    else:
        try:
            quaternions = as_rotations(linear).as_quat()
        except InputError as error:
            raise InputError(f"{path}: tum holds rigid 3D keyframes: {error}; write csv or json") from None
        _write_table(path, [("#", *formats.TUM)], np.column_stack([times, translation, quaternions]), " ")


def write_motion(
    motion: Motion | QuaternionMotion,
    path: FilePath,
    times: ArrayLike | None = None,
    rate: float | None = None,
    orthonormalise: bool = False,
) -> WrittenMotion | None:
    """Write a motion exactly (.json, for `read_motion`) or sampled (.csv, .tum, for `read_keyframes`), or as a scene.

    json takes an `AffineMotion`; in the others an orientation alone turns about the origin. A
    scene, .glb or .usda, has a letter F in motion: `write_gltf` and `write_usd`, which take other
    bodies too, say how; what they say of the file's error is returned.

    times: (N,) increasing, N ≥ 2, of the samples; or rate: samples per unit of time from the
    start of the domain on; 200 samples from end to end when both are left out.
    orthonormalise: in .tum write the closest rotation of each sample, rigid or not.

    Raises InputError that names the time of a sample that is singular or reflected or, unless
    `orthonormalise`, further than 1e-6 from rigid (.tum), and for a path that cannot be written.
    """
    chosen = formats.format_of(path, None, MOTION_FORMATS)
    if chosen not in ("csv", "tum") and not (times is None and rate is None):
        kind = "the exact motion" if chosen == "json" else "keys of its own choice"
        raise InputError(f"{path}: {chosen} holds {kind}: times and rate go with csv and tum")
    if chosen != "tum" and orthonormalise:
        raise InputError(f"{path}: {chosen} holds the motion as it is: orthonormalise goes with tum")
    if chosen in formats.SCENES:
        return write_gltf(motion, path) if chosen == "glb" else write_usd(motion, path)
    if chosen == "json":
        if not isinstance(motion, AffineMotion):
            raise InputError(f"{path}: json holds an AffineMotion: {type(motion).__name__} does not go into it")
        _write_motion_json(motion, path)
        return None
    motion = placed(motion)
    sample_times = _sample_times(motion, times, rate)
    if chosen == "tum":
        samples = _closest_rotations(path, motion, sample_times, np.inf if orthonormalise else RIGID_TOLERANCE)
    else:
        samples = Keyframes(sample_times, *motion(sample_times))
    write_keyframes(samples, path)
    return None


def _write_motion_json(motion: AffineMotion, path: FilePath) -> None:
    finite = np.isfinite(motion.spline.control_points).all(axis=1)
    if not finite.all():
        raise InputError(f"{path}: control {int(np.argmin(finite))} of the motion is not finite")
    entries = {
        "degree": motion.degree,
        "periodic": motion.basis.periodic,
        "knots": motion.basis.knots,
        "linear": motion.linear,
        "translation": motion.translation,
    }
    _write_json(path, formats.MOTION | entries)


def _sample_times(motion: Motion, times: ArrayLike | None, rate: float | None) -> np.ndarray:
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


def _closest_rotations(path: FilePath, motion: Motion, times: np.ndarray, tolerance: float) -> Keyframes:
    """The rigid samples of a motion; InputError where one is no rotation or further from one than the tolerance."""
    try:
        samples = rigid.orthonormalise(motion, times)
    except InputError as error:
        raise InputError(f"{path}: {error}: write csv or json") from None
    far = samples.deviations > tolerance
    if far.any():
        time = times[np.argmax(far)]
        raise InputError(f"{path}: the motion is not rigid at time {time}: orthonormalise, or write csv or json")
    return samples.keyframes


def _write_table(path: FilePath, header: Sequence[Sequence[str]], values: np.ndarray, delimiter: str) -> None:
    with whole_file(path) as handle:
        writer = csv.writer(handle, delimiter=delimiter, lineterminator="\n")
        writer.writerows([*header, *values.tolist()])


def _write_json(path: FilePath, document: dict[str, Any]) -> None:
    with whole_file(path) as handle:
        handle.write(json.dumps(document, default=np.ndarray.tolist) + "\n")
