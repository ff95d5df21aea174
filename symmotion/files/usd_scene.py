"""Scenes of USD as their readers find them: prims that move, and the keyframes of one of them."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from symmotion.errors import InputError
from symmotion.files.formats import FilePath
from symmotion.files.posed import PosedSkeleton
from symmotion.files.recording import Recording
from symmotion.motions import Affine, Keyframes

MOST_PLACES = 50_000_000  # time codes times prims that move


class Prim(NamedTuple):
    """A prim that places what is below it.

    path: as /World/Arm; parent: the index of the one above, −1 where there is none; codes: (K,) increasing, of its own
    time samples; reset: whether it leaves out what is above it; local: from time codes (N,) to its positions in the
    frame of its parent, linear (N, 3, 3) and translation (N, 3).
    """

    path: str
    parent: int
    codes: np.ndarray
    reset: bool
    local: Callable[[np.ndarray], Affine]

    @property
    def name(self) -> str:
        return self.path.rpartition("/")[2]


@dataclass(frozen=True, eq=False)
class Scene:
    """prims, parents before children; rate: time codes a second; up: the axis that shows upwards; unit: in metres."""

    prims: Sequence[Prim]
    rate: float
    up: str
    unit: float

    def chain(self, k: int) -> list[int]:
        """A prim and those above it that move it along, upwards."""
        found = [k]
        while not self.prims[found[-1]].reset and (above := self.prims[found[-1]].parent) >= 0:
            found.append(above)
        return found


def scene_keyframes(path: FilePath, scene: Scene, node: str | int | None, times: ArrayLike | None) -> Recording:
    """The positions of a prim in the scene, at all time samples of it and of those above it."""
    moving = [k for k, prim in enumerate(scene.prims) if len(prim.codes)]
    if not moving:
        raise InputError(f"{path}: holds no prim with time samples of its place, and so no keyframes")
    k = _default(path, scene, moving) if node is None else _chosen(path, scene, node)
    chain = scene.chain(k)
    prim = scene.prims[k]
    codes = np.unique(np.concatenate([scene.prims[i].codes for i in chain]))
    if not len(codes):
        raise InputError(f"{path}: prim {prim.path} does not move; those that do are {_listed(scene, moving)}")
    if len(codes) * len(chain) > MOST_PLACES:
        raise InputError(
            f"{path}: {len(codes)} times of {len(chain)} prims are too many: cut the animation into several"
        )
    found = _carried(scene, chain, codes)
    notes = [f"prim {prim.path} is read, from which the others hang"] if node is None and len(moving) > 1 else []
    notes.append(f"{scene.up.lower()} is up in this scene, a unit of length is {scene.unit:g} m")
    try:
        keyframes = Keyframes(codes / scene.rate if times is None else times, *found)
        return Recording(keyframes, tuple(notes), "y" if scene.up == "Y" else "z")
    except InputError as error:
        raise InputError(f"{path}, prim {prim.path}: {error}") from None


def scene_skeleton(path: FilePath, scene: Scene) -> PosedSkeleton:
    """The prims that move and those that they carry, at all time samples.

    At rest they are as at the first of these.
    """
    chosen: dict[int, None] = {}  # in order
    for k, prim in enumerate(scene.prims):
        if len(prim.codes) or (prim.parent in chosen and not prim.reset):
            chosen[k] = None
    if not chosen:
        raise InputError(f"{path}: holds no prim with time samples of its place, and so no skeleton")
    chains = [scene.chain(k) for k in chosen]
    codes = np.unique(np.concatenate([scene.prims[i].codes for chain in chains for i in chain]))
    if len(codes) * sum(map(len, chains)) > MOST_PLACES:
        raise InputError(
            f"{path}: {len(codes)} times of {len(chosen)} prims are too many: cut the animation in several"
        )
    moved = [_carried(scene, chain, codes) for chain in chains]
    place = {k: i for i, k in enumerate(chosen)}
    above = [-1 if scene.prims[k].reset else place.get(scene.prims[k].parent, -1) for k in chosen]
    linear, translation = (np.stack(part, axis=1) for part in zip(*moved, strict=True))
    names = tuple(scene.prims[k].path for k in chosen)
    return PosedSkeleton(names, above, codes / scene.rate, linear, translation, translation[0])


def _carried(scene: Scene, chain: list[int], codes: np.ndarray) -> Affine:
    """The positions of a prim in the scene, by those above it."""
    found = scene.prims[chain[0]].local(codes)
    for i in chain[1:]:
        found = scene.prims[i].local(codes) @ found
    return found


def _default(path: FilePath, scene: Scene, moving: list[int]) -> int:
    """The one prim with samples that all others with samples hang from."""
    top = [i for i in scene.chain(moving[0]) if i in set(moving)][-1]
    below = {top}
    for k in range(top + 1, len(scene.prims)):  # parents come first
        if scene.prims[k].parent in below and not scene.prims[k].reset:
            below.add(k)
    if not set(moving) <= below:
        raise InputError(f"{path}: several prims move, choose one as the node: {_listed(scene, moving)}")
    return top


def _chosen(path: FilePath, scene: Scene, node: str | int) -> int:
    if isinstance(node, str):
        found = [k for k, prim in enumerate(scene.prims) if node in (prim.path, prim.name)]
        if len(found) != 1:
            alike = found or range(len(scene.prims))
            raise InputError(f"{path}: {len(found)} prims are called {node!r:.60}; there are {_listed(scene, alike)}")
        return found[0]
    if not 0 <= node < len(scene.prims):
        raise InputError(f"{path}: prim {node} does not exist: there are {len(scene.prims)}")
    return node


def _listed(scene: Scene, which: Sequence[int]) -> str:
    return ", ".join(scene.prims[k].path for k in which[:12]) + (" …" if len(which) > 12 else "")
