"""Whole skeletons out of glTF files: all nodes that move, and those that they carry."""

from pathlib import Path

import numpy as np

from symmotion.errors import InputError
from symmotion.files.formats import FilePath
from symmotion.files.gltf_channels import Steps, keys_of
from symmotion.files.gltf_keyframes import local_of, on_all, read_channels, standing
from symmotion.files.gltf_nodes import Channels, animation_of, named, parents_of
from symmotion.files.gltf_reading import GltfFile, Items, open_gltf
from symmotion.files.posed import MOST_POSITIONS, PosedSkeleton


def read_gltf_skeleton(path: FilePath, *, animation: str | int | None = None, steps: Steps = "hold") -> PosedSkeleton:
    """The joints of all skins, and the nodes that an animation moves with those below, at all keys of the animation.

    Names are those of the nodes. At rest nodes are as they stand in the file, without an animation. animation: name
    or index; when left out the first that moves anything. steps, and what is refused: as in `read_gltf_keyframes`.
    """
    file = open_gltf(path)
    nodes = file.items("nodes")
    parents = parents_of(nodes)
    _, channels = animation_of(file.items("animations"), nodes, animation, None, [], Path(path))
    if not channels:
        raise InputError(f"{path}: the animation moves no node, and so there is no skeleton")
    order = _downwards(parents, len(nodes))
    joints = _joints(file, nodes, channels, parents, order)
    needed = set(joints)
    for k in reversed(order):
        if k in needed and k in parents:
            needed.add(parents[k])
    chain = [k for k in order if k in needed]
    read = read_channels(file, channels, chain, nodes[joints[0]])
    keys = keys_of((c for part in read.values() for c in part.values()), steps)
    if len(keys) * len(chain) > MOST_POSITIONS:
        raise InputError(f"{path}: more than {MOST_POSITIONS:g} positions of joints: cut the animation into several")
    read = on_all(read, keys)
    moved: dict[int, tuple[np.ndarray, np.ndarray]] = {}
    still: dict[int, tuple[np.ndarray, np.ndarray]] = {}
    for k in chain:
        rest = standing(nodes, [k])
        moved[k] = _below(moved.get(parents.get(k, -1)), local_of(nodes[k], read[k], keys) if read[k] else rest)
        still[k] = _below(still.get(parents.get(k, -1)), rest)
    place = {k: i for i, k in enumerate(joints)}
    frames = len(keys)
    linear = np.stack([np.broadcast_to(moved[k][0], (frames, 3, 3)) for k in joints], axis=1)
    translation = np.stack([np.broadcast_to(moved[k][1], (frames, 3)) for k in joints], axis=1)
    above = [place.get(parents.get(k, -1), -1) for k in joints]
    names = tuple(_name(nodes, k) for k in joints)
    return PosedSkeleton(names, above, keys, linear, translation, np.concatenate([still[k][1] for k in joints]))


def _below(
    above: tuple[np.ndarray, np.ndarray] | None, own: tuple[np.ndarray, np.ndarray]
) -> tuple[np.ndarray, np.ndarray]:
    """Positions in the scene of a node in the frame of the one above it."""
    if above is None:
        return own
    (a, v), (b, w) = above, own
    return a @ b, v + np.einsum("...ij,...j->...i", a, w)


def _downwards(parents: dict[int, int], count: int) -> list[int]:
    """All nodes, parents before children."""
    children: dict[int, list[int]] = {}
    for child, parent in parents.items():
        children.setdefault(parent, []).append(child)
    order = [k for k in range(count) if k not in parents]
    for k in order:  # which grows on the way
        order += children.get(k, [])
    return order


def _joints(file: GltfFile, nodes: Items, channels: Channels, parents: dict[int, int], order: list[int]) -> list[int]:
    """The joints of all skins, nodes that move and all below, parents first."""
    chosen = set(channels)
    for skin in file.items("skins"):
        chosen |= {joint.whole(0, len(nodes) - 1) for joint in skin.items("joints")}
    for k in order:
        if parents.get(k) in chosen:
            chosen.add(k)
    return [k for k in order if k in chosen]


def _name(nodes: Items, k: int) -> str:
    name = nodes[k].get("name")
    return named(nodes[k]) if name is None else name.text()
