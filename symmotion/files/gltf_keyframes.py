"""Keyframes out of the node animations of glTF files."""

from dataclasses import dataclass, replace
from itertools import groupby
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from symmotion.errors import InputError
from symmotion.files.formats import FilePath
from symmotion.files.gltf_reading import GltfFile, Place, open_gltf
from symmotion.files.keys import HermiteKeys
from symmotion.motions import Keyframes
from symmotion.motions.interpolants import slerp
from symmotion.motions.quaternions.algebra import rotate
from symmotion.splines.instants import distinct, unified

PATHS = {"translation": 3, "rotation": 4, "scale": 3}
AT_REST = {"translation": (0.0, 0.0, 0.0), "rotation": (0.0, 0.0, 0.0, 1.0), "scale": (1.0, 1.0, 1.0)}
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


# By node and property, the sampler's entry: only those asked for are read.
Channels = dict[int, dict[str, Place]]


def read_gltf_keyframes(
    path: FilePath, node: str | int | None = None, animation: str | int = 0, *, times: ArrayLike | None = None
) -> Keyframes:
    """The positions of an animated node of a .glb or .gltf file in the scene, at its key times.

    Translation, rotation and scale of the node and of the nodes above it, each by its sampler
    (LINEAR, with slerp for rotations, STEP or CUBICSPLINE) or where that is missing by the node
    itself, at all times that any of them has a key at; a file's clock is in seconds. The linear
    part is the product of the R diag(s) on the way down.

    node: name or index; left out: the only animated one, or the one that all other animated
    nodes hang from, as the root of a skeleton. animation: name or index, the first when left out. times: (M,), in
    place of the keys' own.

    Read are embedded buffers and files in the same directory; not: sparse accessors and meshes
    or animations under compression. Raises InputError that names the file and the entry or byte at fault.
    """
    file = open_gltf(path)
    nodes = file.items("nodes")
    parents = _parents(nodes)
    channels = _channels(nodes, _chosen(file.items("animations"), animation, "animation", Path(path)))
    if node is None:
        index = _default_node(nodes, parents, channels, Path(path))
    else:
        index = nodes.index(_chosen(nodes, node, "node", Path(path)))
    chain = _ancestry(parents, index)
    if not any(k in channels for k in chain):
        raise InputError(f"{path}: node {_name(nodes[index])} does not move; animated are {_listed(nodes, channels)}")
    read = _read(file, channels, chain, nodes[index])
    keys = distinct(np.concatenate([c.times for part in read.values() for c in part.values()]))
    moving = sum(map(bool, read.values()))
    if len(keys) * moving > MOST_PLACES:
        raise InputError(
            f"{path}: {len(keys)} keys of {moving} nodes that move {_name(nodes[index])} are more than {MOST_PLACES:g} "
            "places: cut the animation into several"
        )
    read = {k: {name: _put_on(c, keys) for name, c in part.items()} for k, part in read.items()}
    linear, translation = _carried(nodes, read, keys)
    try:
        return Keyframes(keys if times is None else times, linear, translation)
    except InputError as error:
        raise InputError(f"{path}, node {_name(nodes[index])}: {error}") from None


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
                raise sampler.fault(f"more than {MOST_KEYS:g} keys in all move node {_name(node)}")
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
    """The channel with its keys at those of the whole animation that they agree with up to rounding."""
    times = unified(channel.times, keys)
    return replace(channel, times=times) if (np.diff(times) > 0).all() else channel


def _name(node: Place) -> str:
    name = node.get("name")
    return repr(name.text())[:60] if name is not None else node.way


def _listed(nodes: list[Place], channels: Channels) -> str:
    names = [_name(nodes[k]) for k in channels]
    return ", ".join(names[:20]) + (" …" if len(names) > 20 else "") if names else "none"


def _chosen(items: list[Place], which: str | int, what: str, path: Path) -> Place:
    """The item of a name or an index."""
    if isinstance(which, str):
        named = [item for item in items if (name := item.get("name")) is not None and name.value == which]
        if len(named) == 1:
            return named[0]
        raise InputError(f"{path}: {len(named)} {what}s are called {which!r}: give one's index, 0 to {len(items) - 1}")
    if not items:
        raise InputError(f"{path}: holds no {what}s, and so no keyframes")
    if not 0 <= which < len(items):
        raise InputError(f"{path}: {what} {which} does not exist: there are {len(items)}")
    return items[which]


def _parents(nodes: list[Place]) -> dict[int, int]:
    """The parent of every node that has one; InputError where a node has two or is its own ancestor."""
    parents: dict[int, int] = {}
    for k, node in enumerate(nodes):
        for child in node.items("children"):
            c = child.whole(0, len(nodes) - 1)
            if c in parents:
                raise child.fault(f"node {c} has two parents")
            parents[c] = k
    done: set[int] = set()
    for k in range(len(nodes)):
        way: set[int] = set()
        above: int | None = k
        while above is not None and above not in done:
            if above in way:
                raise nodes[k].fault("is its own ancestor")
            way.add(above)
            above = parents.get(above)
        done |= way
    return parents


def _ancestry(parents: dict[int, int], k: int) -> list[int]:
    """A node and those above it, upwards."""
    chain = [k]
    while (above := parents.get(chain[-1])) is not None:
        chain.append(above)
    return chain


def _default_node(nodes: list[Place], parents: dict[int, int], channels: Channels, path: Path) -> int:
    """The one animated node that all others hang from."""
    if not channels:
        raise InputError(f"{path}: the animation moves no node; translation, rotation or scale of one is needed")
    top = [k for k in _ancestry(parents, next(iter(channels))) if k in channels][-1]
    below, open_ = {top}, [top]
    children: dict[int, list[int]] = {}
    for child, parent in parents.items():
        children.setdefault(parent, []).append(child)
    while open_:
        new = children.get(open_.pop(), [])
        below.update(new)
        open_.extend(new)
    if not channels.keys() <= below:
        raise InputError(f"{path}: several nodes are animated, choose one: {_listed(nodes, channels)}")
    return top


def _channels(nodes: list[Place], animation: Place) -> Channels:
    samplers = animation.items("samplers")
    found: Channels = {}
    for channel in animation.items("channels"):
        target = channel["target"]
        name, index = target["path"].text(), target.get("node")
        if name in PATHS and index is not None:
            k = index.whole(0, len(nodes) - 1)
            if name in found.setdefault(k, {}):
                raise channel.fault(f"the {name} of node {k} is animated twice")
            found[k][name] = channel["sampler"].of(samplers)
    return found


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
        values = values if per_key == 3 else _unit(values, sampler["output"])
    return Channel(interpolation, times, values)


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
