"""The channels of glTF animations: a property of a node at key times, and between."""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Literal, get_args

import numpy as np

from symmotion import checks
from symmotion.files.gltf_nodes import PATHS
from symmotion.files.gltf_reading import GltfFile, Place
from symmotion.files.keys import HermiteKeys
from symmotion.motions.interpolants import slerp

SINGLE = 4 * float(np.finfo(np.float32).eps)  # of the largest time: what clocks of single precision differ by
Steps = Literal["hold", "keys"]
STEPS = get_args(Steps)
JUMP = 0.1  # of a step, in which what is held changes
LEAST_NORM = 0.5  # quaternions of 8 bits are off by up to a hundredth; far smaller ones are no rotations


@dataclass(frozen=True, eq=False)
class Channel:
    """One animated property.

    times: (K,); values: (K, c), of CUBICSPLINE (K, 3, c): slope before, value, slope behind; quaternions of any norm.
    """

    interpolation: str
    times: np.ndarray
    values: np.ndarray

    def __call__(self, t: np.ndarray, turning: bool) -> np.ndarray:
        """The values (N, c) at times t (N,), held before the first and behind the last key; `turning`: quaternions."""
        times, values = self.times, self.values
        t = np.clip(t, times[0], times[-1])
        if self.interpolation == "CUBICSPLINE":
            if len(times) == 1:
                return np.repeat(values[:, 1], len(t), axis=0)
            return HermiteKeys(times, values[:, 1], values[:, 0], values[:, 2])(t)
        k = np.searchsorted(times, t, side="right") - 1
        if len(times) == 1 or self.interpolation == "STEP":
            return self._of(k, turning)
        k = np.clip(k, 0, len(times) - 2)
        before, behind = self._of(k, turning), self._of(k + 1, turning)
        u = (t - times[k]) / (times[k + 1] - times[k])
        if not turning:
            return (1 - u[:, None]) * before + u[:, None] * behind
        behind *= np.where(np.sum(before * behind, axis=1) < 0, -1.0, 1.0)[:, None]
        return np.roll(slerp(np.roll(before, 1, axis=1), np.roll(behind, 1, axis=1), u), -1, axis=1)

    def _of(self, keys: np.ndarray, turning: bool) -> np.ndarray:
        """(N, c) the values of keys (N,), quaternions of norm one."""
        found = self.values[keys].astype(float)
        return found / np.linalg.norm(found, axis=1, keepdims=True) if turning else found


def keys_of(channels: Iterable[Channel], steps: Steps = "hold") -> np.ndarray:
    """The times at which any of the channels has a key, and where STEP keys "hold", those until which they do.

    A value that a key changes is held until the last tenth of the step to it, in which motions through the keys change.
    """
    times = []
    for channel in channels:
        times.append(channel.times)
        if checks.choice(steps, STEPS, "steps") == "hold" and channel.interpolation == "STEP":
            jumps = np.flatnonzero((channel.values[1:] != channel.values[:-1]).any(axis=1)) + 1
            times.append(channel.times[jumps] - JUMP * (channel.times[jumps] - channel.times[jumps - 1]))
    return merged_keys(np.concatenate(times))


def merged_keys(times: np.ndarray) -> np.ndarray:
    """The times of all keys, those that single precision hardly tells apart made one: the first of them."""
    along = np.unique(times)
    within = SINGLE * max(abs(along[0]), abs(along[-1]))
    return along[np.concatenate([[True], np.diff(along) > within])]


def put_on(channel: Channel, keys: np.ndarray) -> Channel:
    """The channel with its keys at those of the whole animation that they agree with."""
    near = keys[np.clip(np.searchsorted(keys, channel.times, side="right") - 1, 0, len(keys) - 1)]
    close = np.abs(channel.times - near) <= SINGLE * max(abs(keys[0]), abs(keys[-1]))
    times = np.where(close, near, channel.times)
    if np.array_equal(times, keys):
        times = keys  # which there is already
    return replace(channel, times=times) if (np.diff(times) > 0).all() else channel


def channel_of(file: GltfFile, sampler: Place, name: str) -> Channel:
    interpolation = "LINEAR" if (place := sampler.get("interpolation")) is None else place.text()
    if interpolation not in ("LINEAR", "STEP", "CUBICSPLINE"):
        raise sampler["interpolation"].fault(f"{interpolation!r:.40}: LINEAR, STEP or CUBICSPLINE is needed")
    times = file.accessor(sampler["input"], ("SCALAR",))[:, 0].astype(float)
    if (np.diff(times) <= 0).any():
        raise sampler["input"].fault(f"key {int(np.argmax(np.diff(times) <= 0)) + 1}: times must increase")
    width = PATHS[name]
    values = file.accessor(sampler["output"], (f"VEC{width}",))
    per_key = 3 if interpolation == "CUBICSPLINE" else 1
    if len(values) != per_key * len(times):
        raise sampler["output"].fault(f"{len(values)} values for {len(times)} keys: {per_key * len(times)} are needed")
    if per_key == 3:
        values = values.reshape(-1, 3, width)
    if name == "rotation":
        require_turns(values[:, 1] if per_key == 3 else values, sampler["output"])
        values = _aligned(values) if per_key == 3 else values
    return Channel(interpolation, times, values)


def _aligned(triples: np.ndarray) -> np.ndarray:
    """Cubic keys (K, 3, 4) of rotations, each with its slopes on the side of the one before.

    q and −q are the same rotation, and what lies between a key and one of the other sign is none.
    """
    turned = np.where(np.sum(triples[1:, 1] * triples[:-1, 1], axis=1) < 0, -1.0, 1.0)
    return triples * np.cumprod(np.concatenate([[1.0], turned]))[:, None, None]


def unit(quaternions: np.ndarray, place: Place) -> np.ndarray:
    """Quaternions (K, 4) of norm one; InputError that names the place where one is too short to be a rotation."""
    require_turns(quaternions, place)
    return quaternions / np.linalg.norm(quaternions, axis=1, keepdims=True)


def require_turns(quaternions: np.ndarray, place: Place) -> None:
    """Raise InputError that names the first of the quaternions (K, 4) that is too short to be a rotation."""
    norms = np.sqrt(np.einsum("kc,kc->k", quaternions, quaternions, dtype=float))
    if (norms < LEAST_NORM).any():
        k = int(np.argmax(norms < LEAST_NORM))
        raise place.fault(f"rotation {k} has norm {norms[k]:.3g}: unit ones are needed")
