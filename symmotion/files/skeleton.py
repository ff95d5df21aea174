"""Skeletons with recorded joint angles: where their joints go, and keyframes of it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from symmotion import checks
from symmotion.brief import in_a_line
from symmotion.errors import InputError
from symmotion.files.posed import AffineFit, PosedSkeleton, index_of
from symmotion.motions import Keyframes

AXES = "XYZ"
NEAR = 0.1  # of an offset, within which a first frame tells what channels mean
OFFSETS = ("replace", "add")
CHANNELS = tuple(f"{axis}{what}" for what in ("position", "rotation") for axis in AXES)


@dataclass(frozen=True, eq=False)
class Joint:
    """A joint; parent: its index, −1 for a root; offset: (3,) from the parent at rest; channels: as `Xrotation`.

    The ends of limbs are joints without channels.
    """

    name: str
    parent: int
    offset: np.ndarray
    channels: tuple[str, ...]

    __repr__ = in_a_line


@dataclass(frozen=True, eq=False)
class Skeleton:
    """J joints, parents before children, and F frames of their channels.

    joints: (J,); motion: (F, C) the channels of all joints in order, angles in degrees;
    frame_time: seconds from one frame to the next; offsets: whether a joint's position channels "replace" its
    offset, as most programs write and read them, or "add" to it.

    Raises InputError that names the joint whose parent does not come before it, for frames of
    another length, and for numbers that are not finite.

    >>> lines = ["HIERARCHY", "ROOT Hips", "{", "OFFSET 0 0 0", "CHANNELS 3 Zrotation Xrotation Yrotation", "End Site"]
    >>> lines += ["{", "OFFSET 0 1 0", "}", "}", "MOTION", "Frames: 2", "Frame Time: 0.5", "0 0 0", "90 0 0"]
    >>> from pathlib import Path
    >>> Path("hips.bvh").write_text("\\n".join(lines)) > 0
    True
    >>> sm.files.read_bvh("hips.bvh")
    Skeleton(2 joints, 2 frames of 0.5 s)
    """

    joints: tuple[Joint, ...]
    motion: np.ndarray
    frame_time: float
    offsets: str = "replace"

    def __post_init__(self):
        checks.choice(self.offsets, OFFSETS, "offsets")
        motion = checks.numbers(self.motion, "motion")
        for i, joint in enumerate(self.joints):
            if not -1 <= joint.parent < i:
                raise InputError(f"joint {i}, {joint.name}: its parent {joint.parent} does not come before it")
            if not set(joint.channels) <= set(CHANNELS) or np.shape(joint.offset) != (3,):
                raise InputError(f"joint {i}, {joint.name}: an offset (3,) and channels like {CHANNELS[0]} are needed")
        channels = sum(len(joint.channels) for joint in self.joints)
        if motion.ndim != 2 or motion.shape[1] != channels or not len(motion) or not np.isfinite(motion).all():
            raise InputError(f"frames of shape {motion.shape}: finite, shape (F, {channels}), F ≥ 1, are needed")
        checks.positive(self.frame_time, "frame_time")
        object.__setattr__(self, "motion", motion)

    def __repr__(self) -> str:
        return f"Skeleton({len(self.joints)} joints, {len(self.motion)} frames of {self.frame_time:g} s)"

    @property
    def names(self) -> tuple[str, ...]:
        """(J,) the joints' names."""
        return tuple(joint.name for joint in self.joints)

    @property
    def times(self) -> np.ndarray:
        """(F,) the frames' times in seconds, from 0 on."""
        return self.frame_time * np.arange(len(self.motion))

    def index(self, joint: str | int) -> int:
        """The index of a joint by its name; InputError where there is no such, or more than one."""
        return index_of(self.names, joint)

    @property
    def rest(self) -> np.ndarray:
        """(J, 3) the joints at rest: all channels zero."""
        places = np.zeros((len(self.joints), 3))
        for i, joint in enumerate(self.joints):
            places[i] = joint.offset + (places[joint.parent] if joint.parent >= 0 else 0.0)
        return places

    def keyframes(self, joint: str | int = 0) -> Keyframes:
        """The rigid positions of a joint in the world, one per frame: its rotation and where it is."""
        i = self.index(joint)
        rotations, places = joint_positions(self, [i])
        return Keyframes(self.times, rotations[:, 0], places[:, 0])

    def affine_keyframes(
        self, joints: Sequence[str | int] | None = None, *, reference: int | None = None, rigid: bool = False
    ) -> AffineFit:
        """The affine maps that carry joints as they are in a reference closest to where they are, frame by frame.

        See `PosedSkeleton.affine_keyframes`.
        """
        return self.posed(joints).affine_keyframes(reference=reference, rigid=rigid)

    def posed(self, joints: Sequence[str | int] | None = None) -> PosedSkeleton:
        """Where joints, all when left out, are in all frames, and how they are turned."""
        every = range(len(self.joints)) if joints is None else joints
        chosen = [self.index(j) for j in every]
        rotations, places = joint_positions(self, chosen)
        names, among = tuple(self.names[i] for i in chosen), {i: k for k, i in enumerate(chosen)}
        above = [self._above(i, among) for i in chosen]
        return PosedSkeleton(names, above, self.times, rotations, places, self.rest[chosen])

    def _above(self, i: int, among: Mapping[int, int]) -> int:
        """The place of the next joint above one that has a place; −1 where none has."""
        while (i := self.joints[i].parent) >= 0:
            if i in among:
                return among[i]
        return -1


def joint_trajectories(skeleton: Skeleton) -> np.ndarray:
    """(F, J, 3) where all joints are in all frames: p_j = p_parent + R_parent m_j.

    m_j: the offset, with each of its coordinates that has a position channel replaced by that, or added to it.

    skeleton: as `read_bvh` gives it; the unit of length is the file's.

    >>> from pathlib import Path
    >>> lines = ["HIERARCHY", "ROOT Hips", "{", "OFFSET 0 0 0", "CHANNELS 3 Zrotation Xrotation Yrotation", "End Site"]
    >>> lines += ["{", "OFFSET 0 1 0", "}", "}", "MOTION", "Frames: 2", "Frame Time: 0.5", "0 0 0", "90 0 0"]
    >>> Path("hips.bvh").write_text("\\n".join(lines)) > 0
    True
    >>> sm.files.joint_trajectories(sm.files.read_bvh("hips.bvh"))[1, -1].round(9) + 0.0
    array([-1.,  0.,  0.])
    """
    return joint_positions(skeleton, range(len(skeleton.joints)))[1]


def joint_positions(skeleton: Skeleton, joints: Sequence[int]) -> tuple[np.ndarray, np.ndarray]:
    """World rotations (F, n, 3, 3) and positions (F, n, 3) of some joints.

    R_j = R_parent Π R(axis, angle) with a joint's rotation channels in their order, so that the
    last is applied to the body first.
    """
    frames = len(skeleton.motion)
    first = np.concatenate([[0], np.cumsum([len(j.channels) for j in skeleton.joints])])
    needed = _with_ancestors(skeleton, joints)
    rotations: dict[int, np.ndarray] = {-1: np.tile(np.eye(3), (frames, 1, 1))}
    places: dict[int, np.ndarray] = {-1: np.zeros((frames, 3))}
    for i in needed:
        joint = skeleton.joints[i]
        turn, move = _local(joint, skeleton.motion[:, first[i] : first[i + 1]], skeleton.offsets == "add")
        places[i] = places[joint.parent] + np.einsum("fij,fj->fi", rotations[joint.parent], move)
        rotations[i] = rotations[joint.parent] @ turn
    return np.stack([rotations[i] for i in joints], axis=1), np.stack([places[i] for i in joints], axis=1)


def _with_ancestors(skeleton: Skeleton, joints: Sequence[int]) -> list[int]:
    """The joints and all above them, parents first."""
    needed: set[int] = set()
    for i in joints:
        while i >= 0 and i not in needed:
            needed.add(i)
            i = skeleton.joints[i].parent
    return sorted(needed)


def detected_offsets(joints: Sequence[Joint], frame: np.ndarray) -> tuple[str, int]:
    """What position channels mean for offsets, as a first frame (C,) tells, and how many joints tell it.

    Of those with an offset and three position channels: where these are the offset they replace it, where they are
    nothing beside it they add to it. Exporters begin with, or near, the position at rest.
    """
    first, votes = 0, {"replace": 0, "add": 0}
    for joint in joints:
        values = dict(zip(joint.channels, frame[first : first + len(joint.channels)], strict=True))
        first += len(joint.channels)
        if joint.parent < 0 or not all(f"{axis}position" in values for axis in AXES):
            continue
        moved, size = np.array([values[f"{axis}position"] for axis in AXES]), np.linalg.norm(joint.offset)
        if size > 0:
            votes["replace"] += bool(np.linalg.norm(moved - joint.offset) < NEAR * size)
            votes["add"] += bool(np.linalg.norm(moved) < NEAR * size)
    chosen = "add" if votes["add"] > votes["replace"] else "replace"
    return chosen, votes[chosen]


def _local(joint: Joint, values: np.ndarray, add: bool) -> tuple[np.ndarray, np.ndarray]:
    """Rotations (F, 3, 3) and translations (F, 3) of a joint in its parent's frame, of its channels (F, c)."""
    from scipy.spatial.transform import Rotation  # here: see as_rotations

    move = np.tile(joint.offset, (len(values), 1))
    turn = Rotation.identity(len(values))
    for name, value in zip(joint.channels, values.T, strict=True):
        axis = AXES.index(name[0])
        if name.endswith("position"):
            move[:, axis] = value + (joint.offset[axis] if add else 0.0)
        else:
            turn = turn * Rotation.from_rotvec(np.outer(value, np.eye(3)[axis]), degrees=True)
    return turn.as_matrix(), move
