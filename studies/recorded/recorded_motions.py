"""Recordings of several kinds, SciPy's splines of them, and how far paths are apart. Material for studies, no study."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from scipy.interpolate import CubicSpline, make_smoothing_spline
from scipy.spatial.transform import Rotation, RotationSpline

import symmotion as sm
from studies.recorded.recorded_pair import ESTIMATE
from studies.recorded.recorded_poses import RECORDING
from studies.runner.recordings import recorded
from symmotion.motions import polar_factors

ODOMETRY, SKELETON = recorded("reconstruction_odometry.csv"), recorded("test_freebvh.bvh")
JOINTS = {"foot": "LeftFoot", "hand": "RightHand", "hips": "Hips", "head": "Head", "other foot": "RightFoot"}
# Times (N,) to the turns and places (N, d) there.
Path: TypeAlias = Callable[[np.ndarray], tuple[Rotation, np.ndarray]]
ERRORS = ("place", "turn", "velocity", "turn rate", "acceleration")
STEP = 0.01  # of differences, in median steps


@dataclass(frozen=True, eq=False)
class Recorded:
    """A recording from 0 s on; noisy: the poses that noise is put on; spacings: poses from keyframe to keyframe."""

    name: str
    poses: sm.Keyframes
    noisy: slice | None
    spacings: tuple[int, ...]

    @property
    def extent(self) -> float:
        """Root mean square distance of the places from their centre."""
        places = self.poses.translation
        return float(np.sqrt(((places - places.mean(axis=0)) ** 2).sum(axis=1).mean()))


def load(full: bool) -> tuple[list[Recorded], str]:
    """The recordings beside the checkout, else one made by the project, and where they are from."""
    files = (RECORDING, ESTIMATE, ODOMETRY, SKELETON)
    if not all(path.is_file() for path in files):
        tour = Recorded("tour", sm.examples.recorded_tour(201, noise=0.0), slice(None, None, 2), (4, 8, 16))
        missing = next(path.name for path in files if not path.is_file())
        return [tour], f"Ran on an example made by the project: {missing} is not beside the checkout."
    camera, estimate, odometry = (_from_zero(sm.read_keyframes(path)) for path in files[:3])
    found = [
        Recorded("camera", camera, slice(0, None if full else 600, 6), (10, 25, 50)),
        # What SLAM estimates is noisy as it is.
        Recorded("camera by SLAM", estimate, None, (3, 8, 16)),
        Recorded("odometry", odometry, slice(0, None, 5 if full else 8), (3, 6, 12)),
    ]
    for name, joint in list(JOINTS.items())[: None if full else 2]:
        walk = _from_zero(sm.read_keyframes(SKELETON, node=f"mixamorig:{joint}"))
        found.append(Recorded(name, walk, slice(None), (2, 4, 8)))
    source = (
        "Recordings: a hand-held camera by motion capture, and by SLAM (TUM RGB-D benchmark, CC BY 4.0), a camera's "
        "odometry (pytransform3d, BSD-3-Clause), joints of a walk (bvh-python, MIT)."
    )
    return found, source


def _from_zero(poses: sm.Keyframes) -> sm.Keyframes:
    turns = poses.rotations(1e-3).as_matrix()
    return sm.Keyframes(poses.times - poses.times[0], turns, poses.translation - poses.translation[0])


def noisy(poses: sm.Keyframes, place: float, turn: float, seed: int) -> sm.Keyframes:
    """Poses with independent noise about each axis: σ of places, in the unit of length, and of turns, in rad."""
    rng = np.random.default_rng(seed)
    turned = poses.rotations() * Rotation.from_rotvec(turn * rng.normal(size=(len(poses), 3)))
    return sm.Keyframes(poses.times, turned.as_matrix(), poses.translation + place * rng.normal(size=(len(poses), 3)))


def of_motion(motion: sm.AffineMotion) -> Path:
    """A motion as turns and places, the former by polar factors."""

    def path(t: np.ndarray) -> tuple[Rotation, np.ndarray]:
        linear, places = motion(t)
        return Rotation.from_matrix(polar_factors(linear)[0]), places

    return path


def through(poses: sm.Keyframes, ends: str = "not-a-knot") -> Path:
    """SciPy's interpolating splines: `CubicSpline` of the places, `RotationSpline` of the turns."""
    places = CubicSpline(poses.times, poses.translation, bc_type=ends)
    turns = RotationSpline(poses.times, poses.rotations(1e-3))
    return lambda t: (turns(t), places(t))


def smoothed(poses: sm.Keyframes) -> Path:
    """SciPy's `make_smoothing_spline` of each coordinate of places and quaternions, by cross-validation."""
    q = sm.quaternions.from_rotation(poses.rotations(1e-3))
    q = q * np.cumprod(np.concatenate([[1.0], np.where((q[1:] * q[:-1]).sum(axis=1) < 0, -1.0, 1.0)]))[:, None]
    parts = [[make_smoothing_spline(poses.times, x) for x in values.T] for values in (q, poses.translation)]

    def path(t: np.ndarray) -> tuple[Rotation, np.ndarray]:
        turns, places = (np.stack([spline(t) for spline in part], axis=1) for part in parts)
        return sm.quaternions.to_rotation(turns / np.linalg.norm(turns, axis=1, keepdims=True)), places

    return path


def apart(path: Path, truth: Path, times: np.ndarray) -> np.ndarray:
    """(5,) root mean squares at times, ends left out, of what ERRORS names; rates by differences about each time."""
    t, h = times[1:-1], STEP * float(np.median(np.diff(times)))
    seen = []
    for one in (path, truth):
        (before, back), (here, at), (after, ahead) = (one(t + shift) for shift in (-h, 0.0, h))
        rate = (after * before.inv()).as_rotvec() / (2 * h)
        seen.append((here, at, (ahead - back) / (2 * h), rate, (ahead - 2 * at + back) / h**2))
    mine, true = seen
    off = [(true[0].inv() * mine[0]).as_rotvec(), *(a - b for a, b in zip(mine[1:], true[1:], strict=True))]
    place, turn = off[1], off[0]
    return np.array([np.sqrt((e**2).sum(axis=1).mean()) for e in (place, turn, off[2], off[3], off[4])])
