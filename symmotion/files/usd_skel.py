"""Skeletons of USD (UsdSkel): joints as prims below the skeleton, placed by the arrays of an animation."""

from collections.abc import Mapping, Sequence
from functools import partial

import numpy as np

from symmotion.errors import InputError
from symmotion.files.formats import FilePath
from symmotion.files.usd_ops import Operation, Samples, local
from symmotion.files.usd_scene import Prim

# By what an animation has of each joint, the operation that it is, in the order in which these place a prim, and how
# many numbers it takes.
PARTS = {"translations": ("translate", 3), "rotations": ("orient", 4), "scales": ("scale", 3)}


def joint_prims(
    path: FilePath,
    skeleton: str,
    place: tuple[int, int],
    joints: Sequence[str],
    rest: np.ndarray | None,
    animated: Sequence[str],
    parts: Mapping[str, Samples],
) -> list[Prim]:
    """The joints of a skeleton as prims, those that an animation leaves out at rest.

    skeleton: its path; place: its index among the prims, and that of the first joint. joints: by their paths from the
    root, hip/knee; rest: (J, 16) their matrices, of rows; animated: the joints of the animation, by the same paths;
    parts: by `PARTS`, values (K, A · c) at codes (K,). Raises InputError for arrays that are not of so many joints.
    """
    above, first = place
    index = {joint: first + i for i, joint in enumerate(joints)}
    moved = {joint: i for i, joint in enumerate(animated)}
    rows = np.tile(np.eye(4).ravel(), (len(joints), 1)) if rest is None or not len(rest) else rest
    if len(rows) != len(joints):
        raise InputError(f"{path}, prim {skeleton}: {len(rows)} restTransforms for {len(joints)} joints")
    for part, samples in parts.items():
        if samples.values.shape[1] != len(animated) * PARTS[part][1]:
            raise InputError(
                f"{path}, prim {skeleton}: its animation has {part} of {samples.values.shape[1]} numbers for "
                f"{len(animated)} joints"
            )
    prims = []
    for i, joint in enumerate(joints):
        operations = [Operation("transform", Samples(np.zeros(0), rows[i : i + 1]))]
        if joint in moved and parts:
            operations = _operations(moved[joint], parts, rows[i].reshape(4, 4))
        name, parent = f"{skeleton}/{joint}", joint.rpartition("/")[0]
        while parent and parent not in index:
            parent = parent.rpartition("/")[0]
        codes = np.unique(np.concatenate([o.samples.codes for o in operations]))
        prims.append(Prim(name, index.get(parent, above), codes, False, partial(local, path, name, operations)))
    return prims


def _operations(k: int, parts: Mapping[str, Samples], rest: np.ndarray) -> list[Operation]:
    """What places the k-th joint of an animation; what this does not have is as at rest."""
    sizes = np.linalg.norm(rest[:3, :3], axis=1)
    found = []
    for part, (kind, width) in PARTS.items():
        if part in parts:
            codes, values = parts[part]
            found.append(Operation(kind, Samples(codes, values[:, width * k : width * (k + 1)])))
        elif kind == "orient":
            turn = np.eye(4)
            turn[:3, :3] = rest[:3, :3] / np.where(sizes > 0, sizes, 1.0)[:, None]
            found.append(Operation("transform", Samples(np.zeros(0), turn.reshape(1, 16))))
        else:
            still = rest[3, :3] if kind == "translate" else sizes
            found.append(Operation(kind, Samples(np.zeros(0), still[None])))
    return found
