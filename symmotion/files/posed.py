"""Skeletons as they move: where all joints are, and keyframes of joints and of the whole."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from symmotion import checks
from symmotion.brief import between
from symmotion.errors import InputError
from symmotion.motions import Keyframes, copy_deviations, keyframes_from_copies
from symmotion.values import read_only

# Frames × joints × 12 doubles are worked on at once: 1 GB.
MOST_POSITIONS = 10**7
FLAT = 0.1  # of the largest determinant, below which joints have left their reference so far that it is told


class AffineFit(NamedTuple):
    """Affine keyframes of joints; deviations: (F,) the root mean square distance that each leaves.

    size: the root mean square distance of the joints from their middle, in the reference.

    >>> turns, rest = np.tile(np.eye(3), (2, 4, 1, 1)), np.vstack([np.eye(3), np.zeros(3)])
    >>> names, parents = ("a", "b", "c", "d"), [-1, 0, 0, 0]
    >>> flattens = sm.files.PosedSkeleton(names, parents, [0.0, 1.0], turns, [rest, rest * [1.0, 1.0, 0.05]], rest)
    >>> flattens.affine_keyframes().notes[1][:46]
    'det A is 0.05 to 1, the whole flat at keyframe'
    """

    keyframes: Keyframes
    deviations: np.ndarray
    size: float

    @property
    def determinants(self) -> np.ndarray:
        """(F,) det A: 1 where the joints keep the volume that they have in the reference."""
        return np.linalg.det(self.keyframes.linear)

    @property
    def notes(self) -> tuple[str, ...]:
        """What there is to say of how well it fits, and of keyframes at which the whole is flat or reflected."""
        worst, volumes = int(np.argmax(self.deviations)), self.determinants
        share = self.deviations[worst] / self.size
        notes = [f"joints are up to {self.deviations[worst]:.3g} from where it has them, {share:.0%} of their size"]
        notes[0] += f" (rms, keyframe {worst})"
        i = int(np.argmin(volumes))
        if volumes[i] < FLAT * volumes.max():
            state = "reflected" if volumes[i] < 0 else "flat"
            notes.append(
                f"det A is {volumes[i]:.3g} to {volumes.max():.3g}, the whole {state} at keyframe {i}: another "
                "reference frame, fewer joints, or rigid=True, keep it from that"
            )
        return tuple(notes)

    def __repr__(self) -> str:
        volumes = self.determinants
        return (
            f"AffineFit({self.keyframes!r}, deviations up to {self.deviations.max():.3g}, det A {volumes.min():.3g} to "
            f"{volumes.max():.3g})"
        )


@dataclass(frozen=True, eq=False)
class PosedSkeleton:
    """J joints at F times, of a skeleton of whatever file.

    names: (J,); parents: (J,) indices, −1 for a root; times: (F,); linear (F, J, 3, 3) and translation (F, J, 3): their
    positions in the world, rigid ones where nothing scales them; rest: (J, 3) where they are at rest.

    Raises InputError for shapes that do not go together.

    >>> turns = np.tile(np.eye(3), (2, 1, 1, 1))
    >>> walk = sm.files.PosedSkeleton(("hip",), (-1,), [0.0, 1.0], turns, [[[0.0, 0, 0]], [[1.0, 0, 0]]], [[0.0, 0, 0]])
    >>> walk.keyframes("hip").translation
    array([[0., 0., 0.],
           [1., 0., 0.]])
    """

    names: tuple[str, ...]
    parents: Sequence[int]
    times: np.ndarray
    linear: np.ndarray
    translation: np.ndarray
    rest: np.ndarray

    def __post_init__(self):
        count = len(self.names)
        times = checks.numbers(self.times, "times")
        linear, translation = checks.numbers(self.linear, "linear"), checks.numbers(self.translation, "translation")
        rest = checks.numbers(self.rest, "rest")
        shapes = (times.shape[:1], linear.shape, translation.shape, rest.shape)
        frames = len(times) if times.ndim == 1 else 0
        if not frames or shapes != ((frames,), (frames, count, 3, 3), (frames, count, 3), (count, 3)):
            raise InputError(f"times, linear, translation, rest of shapes {shapes}: they are not of {count} joints")
        if len(self.parents) != count:
            raise InputError(f"{len(self.parents)} parents for {count} joints")
        arrays = {"times": times, "linear": linear, "translation": translation, "rest": rest}
        for name, array in arrays.items():
            object.__setattr__(self, name, read_only(array))

    def __len__(self) -> int:
        return len(self.names)

    def __repr__(self) -> str:
        a, b = self.times[[0, -1]]
        return f"PosedSkeleton({len(self)} joints, {len(self.times)} frames, times {between(a, b)})"

    def index(self, joint: str | int) -> int:
        """The index of a joint by its name; InputError where there is no such, or more than one."""
        return index_of(self.names, joint)

    def keyframes(self, joint: str | int) -> Keyframes:
        """The positions of a joint in the world, one per frame."""
        i = self.index(joint)
        return Keyframes(self.times, self.linear[:, i], self.translation[:, i])

    def items(self) -> Iterator[tuple[str, Keyframes]]:
        """Every joint's name and keyframes."""
        return ((name, self.keyframes(i)) for i, name in enumerate(self.names))

    def affine_keyframes(
        self, joints: Sequence[str | int] | None = None, *, reference: int | None = None, rigid: bool = False
    ) -> AffineFit:
        """The affine maps that carry joints as they are in a reference closest to where they are, frame by frame.

        Least Σ_j ‖v_i + A_i p_j − p_j(t_i)‖² over the joints, all when left out; p_j where they are in the frame
        `reference`, at rest when left out. rigid: rotations only. Joints that move far against each other leave a whole
        that is nearly flat or reflected: the fit's `determinants`, `deviations` and `notes` tell.

        Raises InputError where the joints lie in a plane, in the reference or in a frame (which it names as a copy):
        they fix no affine map, and where they lie in a line no rotation.
        """
        chosen = list(range(len(self))) if joints is None else [self.index(j) for j in joints]
        copies = self.translation[:, chosen]
        if reference is None:
            shape = self.rest[chosen]
        else:
            shape = copies[checks.index(reference, len(copies), "reference frame")]
        keyframes = keyframes_from_copies(shape, copies, times=self.times, rigid=rigid)
        size = float(np.sqrt(((shape - shape.mean(axis=0)) ** 2).sum(axis=1).mean()))
        return AffineFit(keyframes, copy_deviations(keyframes, shape, copies), size)


def index_of(names: Sequence[str], joint: str | int) -> int:
    """The index of a joint by its name; InputError where there is no such, or more than one."""
    if isinstance(joint, str):
        found = [i for i, name in enumerate(names) if name == joint]
        if len(found) != 1:
            few = ", ".join(names[:12]) + (" …" if len(names) > 12 else "")
            remedy = f"give an index: {', '.join(map(str, found[:12]))}" if found else f"there are {few}"
            raise InputError(f"{len(found)} joints are called {joint!r:.60}; {remedy}")
        return found[0]
    if not 0 <= joint < len(names):
        raise InputError(f"joint {joint} does not exist: there are {len(names)}")
    return joint
