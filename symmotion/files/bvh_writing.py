"""Skeletons and rigid motions into BVH files."""

from collections.abc import Iterator, Mapping

import numpy as np

from symmotion import checks
from symmotion.bodies.places import Oriented, body_size, placed
from symmotion.errors import InputError
from symmotion.files.formats import FilePath, format_of
from symmotion.files.samples import rigid_samples, sample_times
from symmotion.files.skeleton import AXES, Joint, Skeleton
from symmotion.motions import Affine, Keyframes, as_rotations
from symmotion.motions.motion import Moving
from symmotion.splines import same_times
from symmotion.whole import whole_file

BODY, ROOT = "Body", "Bodies"
FREE = ("Xposition", "Yposition", "Zposition", "Zrotation", "Xrotation", "Yrotation")
DEEPEST = 32  # levels that are indented


def write_bvh(
    motion: Skeleton | Keyframes | Mapping[str, Keyframes] | Moving | Oriented,
    path: FilePath,
    *,
    rate: float | None = None,
    orthonormalise: bool = False,
) -> None:
    """Write a .bvh file of a skeleton, or of bodies by their rigid keyframes, or of one by the samples of a motion.

    Numbers are printed so that `read_bvh` has each of them back. A body is a root with six channels, its rotation in
    degrees about z, x, y, and an end a fifth as far as its path is wide; keyframes are a frame each, at equal steps,
    whose first is at time 0 in the file. Several, by name and at the same times, hang from a root that stands still.
    Position channels of a skeleton replace offsets, as most programs read them;
    where its first frame would tell otherwise, read it with offsets="replace".

    rate: frames per unit of time of a motion, 200 in all when left out; orthonormalise: the closest rotations, rigid
    or not.

    Raises InputError for times that are not equally spaced, what is not rigid or not in space, options that a skeleton
    and keyframes do not take, and a path that cannot be written.

    >>> keys = sm.examples.random_keyframes(4, 40, seed=1)
    >>> sm.files.write_bvh(keys, "body.bvh")
    >>> bool(np.allclose(sm.read_keyframes("body.bvh").linear, keys.linear))
    True
    """
    format_of(path, None, ("bvh",))
    if isinstance(motion, Skeleton | Keyframes | Mapping):
        if rate is not None or orthonormalise:
            raise InputError(f"{path}: rate and orthonormalise are of motions: leave them out")
        skeleton = motion if isinstance(motion, Skeleton) else _of_keyframes(motion, path)
    else:
        moving = placed(motion)
        samples = rigid_samples(moving, sample_times(moving, None, rate), path, orthonormalise)
        skeleton = _of_keyframes(samples, path)
    with whole_file(path) as handle:
        handle.writelines(f"{line}\n" for line in _lines(skeleton, path))


def write_bvh_keyframes(keyframes: Keyframes, path: FilePath) -> None:
    """Write rigid keyframes at equal steps of time, a frame each."""
    write_bvh(keyframes, path)


def _of_keyframes(keyframes: Keyframes | Mapping[str, Keyframes], path: FilePath) -> Skeleton:
    """A skeleton of one body, or of several below a root."""
    one = isinstance(keyframes, Keyframes)
    bodies = {BODY: keyframes} if one else dict(keyframes)
    if not bodies or not all(isinstance(keys, Keyframes) for keys in bodies.values()):
        raise InputError(f"{path}: keyframes, or keyframes by the names of bodies, are needed")
    times = next(iter(bodies.values())).times
    joints = [] if one else [Joint(ROOT, -1, np.zeros(3), FREE)]
    columns = [] if one else [np.zeros((len(times), len(FREE)))]
    for name, keys in bodies.items():
        where = f"{path}" if one else f"{path}, {name}"
        _require_frames(keys.times, times, where)
        try:
            rotations = as_rotations(keys.linear)
        except InputError as error:
            raise InputError(f"{where}: bvh holds rigid 3D keyframes: {error}; write csv or json") from None
        columns += [keys.translation, np.unwrap(_angles(rotations.as_matrix()), period=360.0, axis=0)]
        size = body_size(Affine(keys.linear, keys.translation))[0]
        joints += [
            Joint(name, -1 if one else 0, np.zeros(3), FREE),
            Joint(f"{name} end", len(joints), np.array([0.0, size, 0.0]), ()),
        ]
    step = float(times[-1] - times[0]) / (len(times) - 1)
    return Skeleton(tuple(joints), np.concatenate(columns, axis=1), step)


def _require_frames(times: np.ndarray, first: np.ndarray, where: str) -> None:
    """Raise InputError for times that are not those of the first body, or are not equally spaced."""
    if not same_times(times, first):
        raise InputError(f"{where}: bodies of one file have the same times, and these are others")
    if not same_times(np.linspace(times[0], times[-1], len(times)), times):
        raise InputError(
            f"{where}: bvh has frames at equal steps of time, and these are not: `symmotion smooth` makes a motion of "
            "them, which is sampled at any rate; or write csv"
        )


def _angles(rotations: np.ndarray) -> np.ndarray:
    """(F, 3) degrees about z, x, y with R = Rz Rx Ry, for which SciPy warns where x is ±90°: there y is 0."""
    r = rotations
    x = np.arctan2(r[:, 2, 1], np.hypot(r[:, 2, 0], r[:, 2, 2]))
    free = np.hypot(r[:, 2, 0], r[:, 2, 2]) > 1e-12
    z = np.where(free, np.arctan2(-r[:, 0, 1], r[:, 1, 1]), np.arctan2(r[:, 1, 0], r[:, 0, 0]))
    y = np.where(free, np.arctan2(-r[:, 2, 0], r[:, 2, 2]), 0.0)
    return np.degrees(np.stack([z, x, y], axis=1))


def _lines(skeleton: Skeleton, path: FilePath) -> Iterator[str]:
    joints = skeleton.joints
    below: list[list[int]] = [[] for _ in joints]
    for i, joint in enumerate(joints):
        _require_name(joint.name, i, path)
        if joint.parent >= 0:
            below[joint.parent].append(i)
    yield "HIERARCHY"
    order: list[int] = []
    roots = [i for i, joint in enumerate(joints) if joint.parent < 0]
    open_ = [(i, 0, False) for i in reversed(roots)]  # joint, depth, whether its braces close
    while open_:
        i, depth, closes = open_.pop()
        space = "  " * min(depth, DEEPEST)
        if closes:
            yield f"{space}}}"
            continue
        order.append(i)
        yield from _opened(skeleton, i, bool(below[i]), space)
        open_.append((i, depth, True))
        open_ += [(k, depth + 1, False) for k in reversed(below[i])]
    yield "MOTION"
    yield f"Frames: {len(skeleton.motion)}"
    yield f"Frame Time: {float(skeleton.frame_time)!r}"
    for frame in _replacing(skeleton)[:, _columns(skeleton, order)].tolist():
        yield " ".join(map(repr, frame))


def _opened(skeleton: Skeleton, i: int, carries: bool, space: str) -> Iterator[str]:
    """A joint up to its channels."""
    joint = skeleton.joints[i]
    ends = joint.parent >= 0 and not carries and not joint.channels
    if ends and joint.name == f"{skeleton.joints[joint.parent].name} end":
        yield f"{space}End Site"
    else:
        yield f"{space}{'ROOT' if joint.parent < 0 else 'JOINT'} {joint.name}"
        ends = False
    yield f"{space}{{"
    yield f"{space}  OFFSET {' '.join(map(repr, np.asarray(joint.offset, dtype=float).tolist()))}"
    if not ends:
        yield f"{space}  CHANNELS {' '.join([str(len(joint.channels)), *joint.channels])}"


def _require_name(name: str, i: int, path: FilePath) -> None:
    checks.text(name, f"name of joint {i}")
    if not name.isprintable() or not name.split() or set(name) & set("{}"):
        raise InputError(f"{path}: joint {i} is called {name!r:.60}: a name in one line, without braces, is needed")


def _columns(skeleton: Skeleton, order: list[int]) -> list[int]:
    """The channels in an order of the joints."""
    first = np.concatenate([[0], np.cumsum([len(joint.channels) for joint in skeleton.joints])])
    return [int(k) for i in order for k in range(first[i], first[i + 1])]


def _replacing(skeleton: Skeleton) -> np.ndarray:
    """(F, C) the channels, positions such that they replace offsets."""
    if skeleton.offsets == "replace":
        return skeleton.motion
    added = [
        joint.offset[AXES.index(name[0])] if name.endswith("position") else 0.0
        for joint in skeleton.joints
        for name in joint.channels
    ]
    return skeleton.motion + np.array(added)
