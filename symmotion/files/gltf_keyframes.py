"""Keyframes out of the node animations of glTF files."""

from dataclasses import dataclass, replace
from itertools import groupby
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from symmotion.errors import InputError
from symmotion.files.formats import FilePath
from symmotion.files.gltf_nodes import (
    PATHS,
    Channels,
    ancestry,
    animation_of,
    chosen,
    default_node,
    listed,
    named,
    parents_of,
    shown,
)
from symmotion.files.gltf_reading import GltfFile, Place, open_gltf
from symmotion.files.gltf_skins import bound_corners, own_skin
from symmotion.files.keys import HermiteKeys
from symmotion.files.recording import Recording
from symmotion.motions import Keyframes
from symmotion.motions.interpolants import slerp
from symmotion.motions.quaternions.algebra import rotate

AT_REST = {"translation": (0.0, 0.0, 0.0), "rotation": (0.0, 0.0, 0.0, 1.0), "scale": (1.0, 1.0, 1.0)}
SINGLE = 4 * float(np.finfo(np.float32).eps)  # of the largest time: what clocks of single precision differ by
LEAST_NORM = 0.5  # quaternions of 8 bits are off by up to a hundredth; far smaller ones are no rotations
MOST_KEYS = 5_000_000
MOST_PLACES = 50_000_000  # keys times nodes that move


@dataclass(frozen=True, eq=False)
class Channel:
    """One animated property.

    times: (K,); values: (K, c), of CUBICSPLINE (K, 3, c): slope before, value, slope behind.
    """

    interpolation: str
    times: np.ndarray
    values: np.ndarray

    def __call__(self, t: np.ndarray, turning: bool) -> np.ndarray:
        """The values (N, c) at times t (N,), held before the first and behind the last key; `turning`: quaternions."""
        times, values = self.times, self.values
        t = np.clip(t, times[0], times[-1])
        if len(times) == 1:
            values = values[:, 1] if self.interpolation == "CUBICSPLINE" else values
            return np.repeat(values, len(t), axis=0)
        if self.interpolation == "CUBICSPLINE":
            return HermiteKeys(times, values[:, 1], values[:, 0], values[:, 2])(t)
        if self.interpolation == "STEP":
            return values[np.searchsorted(times, t, side="right") - 1]
        k = np.clip(np.searchsorted(times, t, side="right") - 1, 0, len(times) - 2)
        u = (t - times[k]) / (times[k + 1] - times[k])
        if not turning:
            return (1 - u[:, None]) * values[k] + u[:, None] * values[k + 1]
        following = values[k + 1] * np.where(np.sum(values[k] * values[k + 1], axis=1) < 0, -1.0, 1.0)[:, None]
        return np.roll(slerp(np.roll(values[k], 1, axis=1), np.roll(following, 1, axis=1), u), -1, axis=1)


def read_gltf_keyframes(
    path: FilePath, node: str | int | None = None, animation: str | int | None = None, *, times: ArrayLike | None = None
) -> Keyframes:
    """The positions of an animated node of a .glb or .gltf file in the scene, at its key times.

    Translation, rotation and scale of the node and of the nodes above it, each by its sampler
    (LINEAR, with slerp for rotations, STEP or CUBICSPLINE) or where that is missing by the node
    itself, at all times that any of them has a key at; a file's clock is in seconds. The linear
    part is the product of the R diag(s) on the way down.

    node: name or index; left out: the only animated one, or the one that all other animated
    nodes hang from, as the root of a skeleton. animation: name or index; when left out the first that
    moves the node. times: (M,), in place of the keys' own. Keys that agree in single precision, which clocks have, are
    one. A file that `write_gltf` made of an affine motion gives the keyframes of its body.

    Read are embedded buffers and files in the same directory or below; not: data of animations under compression.
    Raises InputError that names the file and the entry or byte at fault.
    """
    return read_gltf(path, node=node, animation=animation, times=times).keyframes


def read_gltf(
    path: FilePath,
    *,
    node: str | int | None = None,
    animation: str | int | None = None,
    times: ArrayLike | None = None,
) -> Recording:
    """As `read_gltf_keyframes`, with notes on which animation and node are read where there are several."""
    file, where = open_gltf(path), Path(path)
    nodes, animations = file.items("nodes"), file.items("animations")
    parents = parents_of(nodes)
    index = None if node is None else nodes.index(chosen(nodes, node, "node", where))
    skin = own_skin(file, nodes, index)
    chain = [] if index is None else ancestry(parents, index)
    played, channels = animation_of(animations, nodes, animation, index, skin or chain, where)
    notes = []
    if len(animations) > 1:
        notes.append(f"animation {named(played)} is read, of {shown(animations)}")
    if skin:
        keys, linear, translation = _skinned(file, nodes, parents, channels, skin, where)
    else:
        index = default_node(nodes, parents, channels, where) if index is None else index
        if len(channels) > 1 and node is None:
            notes.append(f"node {named(nodes[index])} is read, from which the others hang")
        keys, linear, translation = _moved(file, nodes, channels, ancestry(parents, index), index, where)
    try:
        return Recording(Keyframes(keys if times is None else times, linear, translation), tuple(notes))
    except InputError as error:
        raise InputError(f"{path}, node {named(nodes[index or 0])}: {error}") from None


Moved = tuple[np.ndarray, np.ndarray, np.ndarray]  # times (K,), linear parts (K, 3, 3), translations (K, 3)


def _moved(file: GltfFile, nodes: list[Place], channels: Channels, chain: list[int], index: int, path: Path) -> Moved:
    """Where a node is at the keys of itself and of those above it."""
    if not any(k in channels for k in chain):
        raise InputError(f"{path}: node {named(nodes[index])} does not move; animated are {listed(nodes, channels)}")
    read = _read(file, channels, chain, nodes[index])
    keys = _keys(np.concatenate([c.times for part in read.values() for c in part.values()]))
    moving = sum(map(bool, read.values()))
    if len(keys) * moving > MOST_PLACES:
        raise InputError(
            f"{path}: {len(keys)} keys of {moving} nodes that move {named(nodes[index])} are more than {MOST_PLACES:g} "
            "places: cut the animation into several"
        )
    return keys, *_carried(nodes, _put_on_all(read, keys), keys)


def _skinned(
    file: GltfFile, nodes: list[Place], parents: dict[int, int], channels: Channels, joints: list[int], path: Path
) -> Moved:
    """The affine positions of a body that four joints carry: A c_j + v = p_j, bound at the corners c_j."""
    corners = bound_corners(file)
    chains = [ancestry(parents, j) for j in joints]
    reads = [_read(file, channels, chain, nodes[j]) for j, chain in zip(joints, chains, strict=True)]
    stamps = [c.times for read in reads for part in read.values() for c in part.values()]
    if not stamps:
        raise InputError(f"{path}: the corners of the body do not move; animated are {listed(nodes, channels)}")
    keys = _keys(np.concatenate(stamps))
    places = np.stack([_carried(nodes, _put_on_all(read, keys), keys)[1] for read in reads], axis=1)
    inverse = np.linalg.inv(np.column_stack([corners, np.ones(4)]))
    maps = np.swapaxes(inverse @ places, 1, 2)
    return keys, maps[:, :, :3], maps[:, :, 3]


def _keys(times: np.ndarray) -> np.ndarray:
    """The times of all keys, those that single precision hardly tells apart made one: the first of them."""
    along = np.unique(times)
    within = SINGLE * max(abs(along[0]), abs(along[-1]))
    return along[np.concatenate([[True], np.diff(along) > within])]


def _put_on_all(read: dict[int, dict[str, Channel]], keys: np.ndarray) -> dict[int, dict[str, Channel]]:
    return {k: {name: _put_on(channel, keys) for name, channel in part.items()} for k, part in read.items()}


def _read(file: GltfFile, channels: Channels, chain: list[int], node: Place) -> dict[int, dict[str, Channel]]:
    """The channels of a node and of those above it, upwards."""
    read: dict[int, dict[str, Channel]] = {}
    count = 0
    for k in chain:
        read[k] = {}
        for name, sampler in channels.get(k, {}).items():
            read[k][name] = _channel(file, sampler, name)
            count += len(read[k][name].times)
            # Samplers may share their data, so that a small file can ask for much.
            if count > MOST_KEYS:
                raise sampler.fault(f"more than {MOST_KEYS:g} keys in all move node {named(node)}")
    return read


def _carried(
    nodes: list[Place], read: dict[int, dict[str, Channel]], times: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Linear parts (N, 3, 3) and translations (N, 3) in the scene, of nodes each in the next one's frame."""
    linear, translation = np.eye(3)[None], np.zeros((1, 3))
    for moves, part in groupby(read, lambda k: bool(read[k])):
        still = [] if moves else [_standing([nodes[k] for k in part])]
        for a, v in still or (_local(nodes[k], read[k], times) for k in part):
            linear, translation = a @ linear, v + (a @ translation[..., None])[..., 0]
    return np.broadcast_to(linear, (len(times), 3, 3)), np.broadcast_to(translation, (len(times), 3))


def _put_on(channel: Channel, keys: np.ndarray) -> Channel:
    """The channel with its keys at those of the whole animation that they agree with."""
    near = keys[np.clip(np.searchsorted(keys, channel.times, side="right") - 1, 0, len(keys) - 1)]
    close = np.abs(channel.times - near) <= SINGLE * max(abs(keys[0]), abs(keys[-1]))
    times = np.where(close, near, channel.times)
    return replace(channel, times=times) if (np.diff(times) > 0).all() else channel


def _channel(file: GltfFile, sampler: Place, name: str) -> Channel:
    interpolation = "LINEAR" if (place := sampler.get("interpolation")) is None else place.text()
    if interpolation not in ("LINEAR", "STEP", "CUBICSPLINE"):
        raise sampler["interpolation"].fault(f"{interpolation!r:.40}: LINEAR, STEP or CUBICSPLINE is needed")
    times = file.accessor(sampler["input"], ("SCALAR",))[:, 0]
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
        values = _aligned(values, sampler["output"]) if per_key == 3 else _unit(values, sampler["output"])
    return Channel(interpolation, times, values)


def _aligned(triples: np.ndarray, place: Place) -> np.ndarray:
    """Cubic keys (K, 3, 4) of rotations, each with its slopes on the side of the one before.

    q and −q are the same rotation, and what lies between a key and one of the other sign is none.
    """
    norms = np.linalg.norm(triples[:, 1], axis=1)
    if (norms < LEAST_NORM).any():
        k = int(np.argmax(norms < LEAST_NORM))
        raise place.fault(f"rotation of key {k} has norm {norms[k]:.3g}: unit ones are needed")
    turned = np.where(np.sum(triples[1:, 1] * triples[:-1, 1], axis=1) < 0, -1.0, 1.0)
    return triples * np.cumprod(np.concatenate([[1.0], turned]))[:, None, None]


def _unit(quaternions: np.ndarray, place: Place) -> np.ndarray:
    norms = np.linalg.norm(quaternions, axis=1, keepdims=True)
    if (norms < LEAST_NORM).any():
        k = int(np.argmax(norms < LEAST_NORM))
        raise place.fault(f"rotation {k} has norm {norms.min():.3g}: unit ones are needed")
    return quaternions / norms


def _local(node: Place, channels: dict[str, Channel], times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Linear parts (N, 3, 3) and translations (N, 3) of a node in its parent's frame."""
    matrix = node.get("matrix")
    if matrix is not None:
        raise matrix.fault("a node that is animated has translation, rotation and scale instead")
    parts = {}
    for name, count in PATHS.items():
        if name in channels:
            parts[name] = channels[name](times, name == "rotation")
        else:
            still = node.get(name)
            parts[name] = np.tile(AT_REST[name] if still is None else still.numbers(count), (len(times), 1))
    return _placed(_unit(parts["rotation"], node), parts["scale"]), parts["translation"]


def _placed(rotation: np.ndarray, scale: np.ndarray) -> np.ndarray:
    """Linear parts (N, 3, 3) of unit quaternions, scalar-last, and scales."""
    turned = rotate(np.roll(rotation, 1, axis=1)[:, None], np.eye(3))
    return np.swapaxes(turned, 1, 2) * scale[:, None, :]


def _standing(nodes: list[Place]) -> tuple[np.ndarray, np.ndarray]:
    """Linear part (1, 3, 3) and translation (1, 3) of nodes that stand still, each in the next one's frame."""
    parts: dict[str, list] = {name: [] for name in PATHS}
    matrices = {}
    for k, node in enumerate(nodes):
        for name, count in PATHS.items():
            still = node.get(name)
            parts[name].append(AT_REST[name] if still is None else still.numbers(count))
        if (matrix := node.get("matrix")) is not None:
            matrices[k] = matrix.numbers(16).reshape(4, 4).T
    rotation = np.array(parts["rotation"])
    norms = np.linalg.norm(rotation, axis=1)
    if (norms < LEAST_NORM).any():
        k = int(np.argmax(norms < LEAST_NORM))
        _unit(rotation[k : k + 1], nodes[k])
    a, v = _placed(rotation / norms[:, None], np.array(parts["scale"])), np.array(parts["translation"])
    for k, matrix in matrices.items():
        a[k], v[k] = matrix[:3, :3], matrix[:3, 3]
    while len(a) > 1:  # in pairs: a chain may have a hundred thousand nodes
        low, high, odd = slice(0, len(a) - 1, 2), slice(1, None, 2), slice(len(a) - len(a) % 2, None)
        turned = v[high] + (a[high] @ v[low][..., None])[..., 0]
        a, v = np.concatenate([a[high] @ a[low], a[odd]]), np.concatenate([turned, v[odd]])
    return a, v
