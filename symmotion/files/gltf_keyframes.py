"""Keyframes out of the node animations of glTF files."""

from collections.abc import Callable
from functools import partial
from itertools import chain as joined
from itertools import groupby
from pathlib import Path
from typing import cast

import numpy as np
from numpy.typing import ArrayLike

from symmotion.errors import InputError
from symmotion.files.formats import FilePath
from symmotion.files.gltf_channels import (
    LEAST_NORM,
    Channel,
    Steps,
    channel_of,
    keys_of,
    merged_keys,
    put_on,
    require_turns,
    unit,
)
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
from symmotion.files.gltf_reading import GltfFile, Items, Place, open_gltf
from symmotion.files.gltf_skins import bound_corners, own_skin
from symmotion.files.recording import Recording
from symmotion.motions import Keyframes
from symmotion.motions.quaternions.algebra import rotate
from symmotion.values import read_only

AT_REST = {"translation": (0.0, 0.0, 0.0), "rotation": (0.0, 0.0, 0.0, 1.0), "scale": (1.0, 1.0, 1.0)}
PART = 2**12  # keys at which a node is placed at once, and nodes that are
MOST_KEYS = 5_000_000
MOST_PLACES = 50_000_000  # keys times nodes that move


def read_gltf_keyframes(
    path: FilePath,
    node: str | int | None = None,
    animation: str | int | None = None,
    *,
    times: ArrayLike | None = None,
    steps: Steps = "hold",
) -> Keyframes:
    """The positions of an animated node of a .glb or .gltf file in the scene, at its key times.

    Translation, rotation and scale of the node and of the nodes above it, each by its sampler
    (LINEAR, with slerp for rotations, STEP or CUBICSPLINE) or where that is missing by the node
    itself, at all times that any of them has a key at; a file's clock is in seconds. The linear
    part is the product of the R diag(s) on the way down.

    node: name or index; left out: the only animated one, or the one that all other animated
    nodes hang from, as the root of a skeleton. animation: name or index; when left out the first that
    moves the node. times: (M,), in place of the keys' own. steps: whether values of STEP keys "hold", by one more
    keyframe where a tenth of the step to the next is left, or "keys" are read alone. Keys that agree in single
    precision, which clocks have, are one. A file that `write_gltf` made of an affine motion gives the keyframes of its
    body.

    Read are embedded buffers and files in the same directory or below; not: data of animations under compression.
    Raises InputError that names the file and the entry or byte at fault.

    >>> keys = sm.examples.random_keyframes(3, 40, seed=1)
    >>> turning = sm.quaternions.interpolate_quaternions(keys)
    >>> path = sm.splines.cubic_interpolant(keys.times, keys.translation)
    >>> written = sm.files.write_gltf(sm.motions.PoseMotion(turning, path), "poses.glb")
    >>> sm.files.read_gltf_keyframes("poses.glb", node="body").dimension
    3
    """
    return read_gltf(path, node=node, animation=animation, times=times, steps=steps).keyframes


def read_gltf(
    path: FilePath,
    *,
    node: str | int | None = None,
    animation: str | int | None = None,
    times: ArrayLike | None = None,
    steps: Steps = "hold",
) -> Recording:
    """As `read_gltf_keyframes`, with notes on which animation and node are read where there are several."""
    (keys, linear, translation), body, notes = _found(path, node, animation, steps)
    try:
        return Recording(Keyframes(keys if times is None else times, linear, translation), notes, "y")
    except InputError as error:
        raise InputError(f"{path}, node {body}: {error}") from None


Moved = tuple[np.ndarray, np.ndarray, np.ndarray]  # times (K,), linear parts (K, 3, 3), translations (K, 3)


def _found(
    path: FilePath, node: str | int | None, animation: str | int | None, steps: Steps
) -> tuple[Moved, str, tuple[str, ...]]:
    """How a node of a file moves, its name, and notes."""
    file, where = open_gltf(path), Path(path)
    nodes, animations = file.items("nodes"), file.items("animations")
    parents = parents_of(nodes)
    index = None if node is None else chosen(nodes, node, "node", where)
    skin = own_skin(file, nodes, index)
    above = [] if index is None else ancestry(parents, index)
    played, channels = animation_of(animations, nodes, animation, index, skin or above, where)
    notes = [] if len(animations) == 1 else [f"animation {named(played)} is read, of {shown(animations)}"]
    if skin:
        return _skinned(file, nodes, parents, channels, skin, where), named(nodes[index or 0]), tuple(notes)
    index = default_node(nodes, parents, channels, where) if index is None else index
    if len(channels) > 1 and node is None:
        notes.append(f"node {named(nodes[index])} is read, from which the others hang")
    read = _read_moving(file, nodes, channels, ancestry(parents, index), index, where)
    every = [channel for part in read.values() for channel in part.values()]
    keys = keys_of(every, steps)
    if len(keys) > len(keys_of(every, "keys")):
        notes.append("STEP keys are held until a tenth of their step is left; steps='keys' reads the keys alone")
    return (keys, *_moved(nodes, read, keys, index, where)), named(nodes[index]), tuple(notes)


def _read_moving(
    file: GltfFile, nodes: Items, channels: Channels, chain: list[int], index: int, path: Path
) -> dict[int, dict[str, Channel]]:
    """The channels of a node and of those above it, of which one has some."""
    if not any(k in channels for k in chain):
        raise InputError(f"{path}: node {named(nodes[index])} does not move; animated are {listed(nodes, channels)}")
    return read_channels(file, channels, chain, nodes[index])


def _moved(
    nodes: Items, read: dict[int, dict[str, Channel]], keys: np.ndarray, index: int, path: Path
) -> tuple[np.ndarray, np.ndarray]:
    """Where a node is at keys of itself and of those above it: linear parts and translations."""
    read = on_all(read, keys)
    moving = sum(map(bool, read.values()))
    if len(keys) * moving > MOST_PLACES:
        raise InputError(
            f"{path}: {len(keys)} keys of {moving} nodes that move {named(nodes[index])} are more than {MOST_PLACES:g} "
            "places: cut the animation into several"
        )
    return _carried(_steps(nodes, read), keys)


def _skinned(
    file: GltfFile, nodes: Items, parents: dict[int, int], channels: Channels, joints: list[int], path: Path
) -> Moved:
    """The affine positions of a body that four joints carry: A c_j + v = p_j, bound at the corners c_j."""
    corners = bound_corners(file)
    chains = [ancestry(parents, j) for j in joints]
    reads = [read_channels(file, channels, chain, nodes[j]) for j, chain in zip(joints, chains, strict=True)]
    stamps = [c.times for read in reads for part in read.values() for c in part.values()]
    if not stamps:
        raise InputError(f"{path}: the corners of the body do not move; animated are {listed(nodes, channels)}")
    keys = merged_keys(np.concatenate(stamps))
    places = np.stack([_carried(_steps(nodes, on_all(read, keys)), keys)[1] for read in reads], axis=1)
    inverse = np.linalg.inv(np.column_stack([corners, np.ones(4)]))
    maps = np.swapaxes(inverse @ places, 1, 2)
    return keys, maps[:, :, :3], maps[:, :, 3]


def on_all(read: dict[int, dict[str, Channel]], keys: np.ndarray) -> dict[int, dict[str, Channel]]:
    return {
        k: {name: put_on(channel, keys) for name, channel in part.items()} if part else part for k, part in read.items()
    }


def read_channels(file: GltfFile, channels: Channels, chain: list[int], node: Place) -> dict[int, dict[str, Channel]]:
    """The channels of a node and of those above it, upwards."""
    read: dict[int, dict[str, Channel]] = {}
    count = 0
    still: dict[str, Channel] = {}  # one for all nodes that have none
    for k in chain:
        read[k] = {} if k in channels else still
        for name, sampler in channels.get(k, {}).items():
            read[k][name] = channel_of(file, sampler, name)
            count += len(read[k][name].times)
            # Samplers may share their data, so that a small file can ask for much.
            if count > MOST_KEYS:
                raise sampler.fault(f"more than {MOST_KEYS:g} keys in all move node {named(node)}")
    return read


# Linear parts and translations at times (N,), of one node in the next one's frame, or of several that stand still.
Step = Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]]


def _steps(nodes: Items, read: dict[int, dict[str, Channel]]) -> list[Step]:
    """The way of a node up into the scene."""
    steps: list[Step] = []
    for moves, part in groupby(read, lambda k: bool(read[k])):
        if moves:
            steps += [partial(local_of, nodes[k], read[k]) for k in part]
        else:
            still = standing(nodes, list(part))
            steps.append(lambda times, still=still: still)
    return steps


def _carried(steps: list[Step], times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Linear parts (N, 3, 3) and translations (N, 3) in the scene."""
    linear, translation = np.empty((len(times), 3, 3)), np.empty((len(times), 3))
    for begin in range(0, len(times), PART):
        part = slice(begin, begin + PART)
        a, v = np.eye(3)[None], np.zeros((1, 3))
        for step in steps:
            turned, moved = step(times[part])
            a, v = turned @ a, moved + (turned @ v[..., None])[..., 0]
        linear[part], translation[part] = a, v
    return read_only(linear), read_only(translation)


def local_of(node: Place, channels: dict[str, Channel], times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
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
    return _placed(unit(parts["rotation"], node), parts["scale"]), parts["translation"]


def _placed(rotation: np.ndarray, scale: np.ndarray) -> np.ndarray:
    """Linear parts (N, 3, 3) of unit quaternions, scalar-last, and scales."""
    turned = rotate(np.roll(rotation, 1, axis=1)[:, None], np.eye(3))
    return np.swapaxes(turned, 1, 2) * scale[:, None, :]


def _at_rest(nodes: Items, which: list[int], name: str) -> np.ndarray:
    """(K, count) a property of nodes themselves."""
    count, rest = PATHS[name], AT_REST[name]
    values = [v.get(name, rest) if isinstance(v := nodes.values[k], dict) else () for k in which]
    # At once; where one is at fault, one by one, which names it.
    if all(isinstance(v, list | tuple) and len(v) == count for v in values):
        found = np.array(values) if set(map(type, joined.from_iterable(values))) <= {float} else np.full(1, np.nan)
        if np.isfinite(found).all():
            return found
    return np.array([rest if (still := nodes[k].get(name)) is None else still.numbers(count) for k in which])


def standing(nodes: Items, which: list[int]) -> tuple[np.ndarray, np.ndarray]:
    """Linear part (1, 3, 3) and translation (1, 3) of nodes that stand still, each in the next one's frame."""
    linear, translation = np.eye(3)[None], np.zeros((1, 3))
    for begin in range(0, len(which), PART):
        a, v = _chained(nodes, which[begin : begin + PART])
        linear, translation = a @ linear, v + (a @ translation[..., None])[..., 0]
    return linear, translation


def _chained(nodes: Items, which: list[int]) -> tuple[np.ndarray, np.ndarray]:
    """As `standing`, of so few that there is memory for all of them at once."""
    parts = {name: _at_rest(nodes, which, name) for name in PATHS}
    given = [i for i, k in enumerate(which) if "matrix" in cast(dict, nodes.values[k])]
    matrices = {i: nodes[which[i]]["matrix"].numbers(16).reshape(4, 4).T for i in given}
    rotation = parts["rotation"]
    norms = np.linalg.norm(rotation, axis=1)
    if (norms < LEAST_NORM).any():
        i = int(np.argmax(norms < LEAST_NORM))
        require_turns(rotation[i : i + 1], nodes[which[i]])
    a, v = _placed(rotation / norms[:, None], parts["scale"]), parts["translation"]
    for k, matrix in matrices.items():
        a[k], v[k] = matrix[:3, :3], matrix[:3, 3]
    while len(a) > 1:  # in pairs: a chain may have a hundred thousand nodes
        low, high, odd = slice(0, len(a) - 1, 2), slice(1, None, 2), slice(len(a) - len(a) % 2, None)
        turned = v[high] + (a[high] @ v[low][..., None])[..., 0]
        a, v = np.concatenate([a[high] @ a[low], a[odd]]), np.concatenate([turned, v[odd]])
    return a, v
