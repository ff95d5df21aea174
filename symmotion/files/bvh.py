"""Skeletons out of BVH files: joints with offsets and channels, then a line of numbers for each frame."""

from array import array
from collections import deque
from collections.abc import Iterator
from typing import NoReturn, TextIO

import numpy as np
from numpy.typing import ArrayLike

from symmotion.errors import InputError
from symmotion.files.formats import FilePath
from symmotion.files.numbers import finite
from symmotion.files.skeleton import AXES, CHANNELS, Joint, Skeleton
from symmotion.motions import Keyframes
from symmotion.opening import readable

LONGEST_LINE = 10**6
MOST_JOINTS = 100_000
# FRAMES × joints × 12 doubles are worked on at once: 1 GB.
MOST_POSITIONS = 10**7


def read_bvh(path: FilePath) -> Skeleton:
    """The skeleton and its frames of a .bvh file of at most 512 MB.

    The ends of limbs (`End Site`) become joints without channels, named after their parents.
    Raises InputError that names the file and the line at fault: also where the frames are not
    as many, or not as long, as the file claims.
    """
    with readable(path) as handle:
        reader = _Reader(path, handle)
        joints = _read_hierarchy(reader)
        channels = sum(len(j.channels) for j in joints)
        if not channels:
            reader.fail("the joints have no channels: nothing moves")
        return _read_motion(reader, joints, channels)


def read_bvh_keyframes(path: FilePath, *, times: ArrayLike | None = None, node: str | int = 0) -> Keyframes:
    """The positions of a joint of a .bvh file in the world, by name or index, at its frames or the times given."""
    skeleton = read_bvh(path)
    try:
        keyframes = skeleton.keyframes(node)
        return keyframes if times is None else Keyframes(times, keyframes.linear, keyframes.translation)
    except InputError as error:  # which knows no file
        raise InputError(f"{path}: {error}") from None


class _Reader:
    """The words of a file, and the line that they are on."""

    def __init__(self, path: FilePath, handle: TextIO):
        self.path, self.line = path, 0
        self._handle = handle
        self._words: deque[str] = deque()

    def fail(self, message: str) -> NoReturn:
        raise InputError(f"{self.path}, line {max(self.line, 1)}: {message}")

    def lines(self) -> Iterator[list[str]]:
        """The words of each line that has any."""
        while line := self._handle.readline(LONGEST_LINE + 1):
            self.line += 1
            if len(line) > LONGEST_LINE:
                self.fail(f"is longer than {LONGEST_LINE} characters")
            if words := line.split():
                yield words

    def rest(self) -> list[str]:
        """What is left of the line begun."""
        words, self._words = list(self._words), deque()
        return words

    def word(self, what: str) -> str:
        """The next word; `what` tells what is missing at the end of the file."""
        while not self._words:
            self._words = deque(next(self.lines(), []))
            if not self._words:
                self.fail(f"the file ends where {what} is needed")
        return self._words.popleft()

    def expect(self, word: str) -> None:
        found = self.word(word)
        if found.upper() != word.upper():
            self.fail(f"{found[:40]!r} where {word} is needed")

    def number(self, what: str) -> float:
        return self.as_number(self.word(what), what)

    def as_number(self, word: str, what: str) -> float:
        try:
            return finite(word)
        except InputError as error:
            self.fail(f"{error} ({what})")

    def name(self) -> str:
        """What is left of the line, up to a brace: names may hold blanks."""
        words = self.rest()
        if "{" in words:
            k = words.index("{")
            words, self._words = words[:k], deque(words[k:])
        if not words:
            self.fail("a name is missing")
        return " ".join(words)


def _read_hierarchy(reader: _Reader) -> tuple[Joint, ...]:
    reader.expect("HIERARCHY")
    joints: list[Joint] = []
    open_: list[int] = []  # the joints whose braces are not closed yet
    while True:
        if len(joints) > MOST_JOINTS:
            reader.fail(f"more than {MOST_JOINTS} joints")
        word = reader.word("ROOT, JOINT, End Site, } or MOTION").upper()
        if word == "MOTION" and not open_:
            if not joints:
                reader.fail("MOTION where ROOT is needed")
            return tuple(joints)
        if word == "}" and open_:
            open_.pop()
        elif word == "ROOT" and not open_:
            joints.append(_read_joint(reader, reader.name(), -1))
            open_.append(len(joints) - 1)
        elif word == "JOINT" and open_:
            joints.append(_read_joint(reader, reader.name(), open_[-1]))
            open_.append(len(joints) - 1)
        elif word == "END" and open_:
            reader.expect("Site")
            joints.append(_read_joint(reader, f"{joints[open_[-1]].name} end", open_[-1], end=True))
            open_.append(len(joints) - 1)
        else:
            reader.fail(f"{word[:40]!r} where {'JOINT, End Site or }' if open_ else 'ROOT or MOTION'} is needed")


def _read_joint(reader: _Reader, name: str, parent: int, end: bool = False) -> Joint:
    """A joint from its opening brace to its channels."""
    reader.expect("{")
    reader.expect("OFFSET")
    offset = np.array([reader.number("an offset") for _ in AXES])
    if end:
        return Joint(name, parent, offset, ())
    reader.expect("CHANNELS")
    count = reader.number("the number of channels")
    if count not in range(len(CHANNELS) + 1):
        reader.fail(f"{count:g} channels: 0 to {len(CHANNELS)} are needed")
    known = {channel.upper(): channel for channel in CHANNELS}
    channels = []
    for _ in range(int(count)):
        word = reader.word("a channel")
        if word.upper() not in known:
            reader.fail(f"{word[:40]!r} is no channel; there are {', '.join(CHANNELS)}")
        channels.append(known[word.upper()])
    if len(set(channels)) < len(channels):
        reader.fail("a channel occurs twice")
    return Joint(name, parent, offset, tuple(channels))


def _read_motion(reader: _Reader, joints: tuple[Joint, ...], channels: int) -> Skeleton:
    reader.expect("Frames:")
    frames = reader.number("the number of frames")
    if frames < 1 or not frames.is_integer():
        reader.fail(f"{frames:g} frames: a whole number, 1 or more, is needed")
    reader.expect("Frame")
    reader.expect("Time:")
    frame_time = reader.number("the frame time")
    if frame_time <= 0:
        reader.fail(f"a frame time of {frame_time:g}: a positive number of seconds is needed")
    if reader.rest():
        reader.fail("more than the frame time")
    numbers, count = array("d"), 0  # grows with what the file holds, not with what it claims
    for words in reader.lines():
        if count == frames:
            reader.fail(f"more than the {frames:g} frames that the file claims")
        if len(words) != channels:
            reader.fail(f"{len(words)} numbers for {channels} channels")
        numbers.extend(reader.as_number(word, "a channel") for word in words)
        count += 1
        if count * len(joints) > MOST_POSITIONS:
            reader.fail(f"more than {MOST_POSITIONS:g} positions of joints: cut the file into several")
    if count < frames:
        reader.fail(f"the file ends after {count} of the {frames:g} frames that it claims")
    return Skeleton(joints, np.array(numbers).reshape(count, channels), frame_time)
