"""Skeletons out of BVH files: joints with offsets and channels, then a line of numbers for each frame."""

from array import array
from collections import deque
from collections.abc import Iterator
from dataclasses import replace
from typing import NoReturn, TextIO

import numpy as np
from numpy.typing import ArrayLike

from symmotion import checks
from symmotion.errors import InputError
from symmotion.files.formats import FilePath
from symmotion.files.numbers import finite
from symmotion.files.posed import MOST_POSITIONS, PosedSkeleton
from symmotion.files.recording import Recording
from symmotion.files.skeleton import AXES, CHANNELS, OFFSETS, Joint, Skeleton, detected_offsets
from symmotion.motions import Keyframes
from symmotion.opening import readable

FRAMES = ("found", "claimed")
LONGEST_LINE = 10**6
MOST_JOINTS = 100_000


def read_bvh(
    path: FilePath, *, offsets: str | None = None, frames: str | None = None, encoding: str | None = None
) -> Skeleton:
    """The skeleton and its frames of a .bvh file of at most 512 MB.

    The ends of limbs (`End Site`) become joints without channels, named after their parents. A frame may go on over
    several lines.

    offsets: whether a joint's position channels "replace" its OFFSET, as most programs have it, or "add" to it;
    when left out what the first frame tells, else "replace". frames: of a file that claims another number of frames
    than it has those "found" or those "claimed", as far as there are so many. encoding: of the names, as "shift_jis".

    path: of the file.

    Raises InputError that names the file and the line at fault: also where the frames are not
    as many, or not as long, as the file claims.

    >>> from pathlib import Path
    >>> lines = ["HIERARCHY", "ROOT Hips", "{", "OFFSET 0 0 0", "CHANNELS 3 Zrotation Xrotation Yrotation", "End Site"]
    >>> lines += ["{", "OFFSET 0 1 0", "}", "}", "MOTION", "Frames: 2", "Frame Time: 0.5", "0 0 0", "90 0 0"]
    >>> Path("hips.bvh").write_text("\\n".join(lines)) > 0
    True
    >>> [joint.name for joint in sm.files.read_bvh("hips.bvh").joints][0]
    'Hips'
    """
    return _read(path, offsets, frames, encoding)[0]


def _read(
    path: FilePath, offsets: str | None, frames: str | None, encoding: str | None
) -> tuple[Skeleton, tuple[str, ...]]:
    if offsets is not None:
        checks.choice(offsets, OFFSETS, "offsets")
    if frames is not None:
        checks.choice(frames, FRAMES, "frames")
    read_as = "utf-8-sig" if encoding is None else checked_encoding(encoding)
    with readable(path, encoding=read_as, remedy=", or name its encoding, as encoding='shift_jis'") as handle:
        reader = _Reader(path, handle)
        joints = _read_hierarchy(reader)
        channels = sum(len(j.channels) for j in joints)
        if not channels:
            reader.fail("the joints have no channels: nothing moves")
        skeleton = _read_motion(reader, joints, channels, frames)
    if offsets is None:
        offsets, told = detected_offsets(joints, skeleton.motion[0])
        if told:
            reader.notes.append(
                f"position channels {offsets} to offsets" if offsets == "add" else "position channels replace offsets"
            )
            reader.notes[-1] += f", as {told} joint{'s' * (told > 1)} in the first frame tell{'s' * (told == 1)}"
    return replace(skeleton, offsets=offsets), tuple(reader.notes)


def checked_encoding(name: str, what: str = "encoding") -> str:
    """The name of an encoding of text; InputError for any other."""
    try:
        "".encode(name)
    except (LookupError, TypeError, ValueError):
        raise InputError(f"{what} {checks.told(name)} is unknown; there are utf-8, shift_jis, latin-1, …") from None
    return name


def read_bvh_keyframes(
    path: FilePath,
    *,
    times: ArrayLike | None = None,
    node: str | int = 0,
    offsets: str | None = None,
    frames: str | None = None,
    encoding: str | None = None,
) -> Recording:
    """The positions of a joint of a .bvh file in the world, by name or index, at its frames or the times given."""
    skeleton, notes = _read(path, offsets, frames, encoding)
    try:
        keyframes = skeleton.keyframes(node)
        keyframes = keyframes if times is None else Keyframes(times, keyframes.linear, keyframes.translation)
    except InputError as error:  # which knows no file
        raise InputError(f"{path}: {error}") from None
    return Recording(keyframes, notes, "y")


def read_bvh_skeleton(
    path: FilePath, *, offsets: str | None = None, frames: str | None = None, encoding: str | None = None
) -> PosedSkeleton:
    """All joints of a .bvh file in all frames."""
    return read_bvh(path, offsets=offsets, frames=frames, encoding=encoding).posed()


class _Reader:
    """The words of a file, and the line that they are on."""

    def __init__(self, path: FilePath, handle: TextIO):
        self.path, self.line = path, 0
        self._handle = handle
        self._words: deque[str] = deque()
        self.notes: list[str] = []

    def fail(self, message: str) -> NoReturn:
        raise InputError(f"{self.path}, line {max(self.line, 1)}: {message}")

    def lines(self) -> Iterator[list[str]]:
        """The words of each line that has any."""
        while line := self._handle.readline(LONGEST_LINE + 1):
            self.line += 1
            if len(line) > LONGEST_LINE:
                self.fail(f"is longer than {LONGEST_LINE} characters")
            if (words := line.split()) and not words[0].startswith("#"):
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

    def back(self, word: str) -> None:
        """Let a word be the next one again."""
        self._words.appendleft(word)

    def title(self, *words: str) -> None:
        """Words that end in a colon, which may stand apart from them and touch what follows."""
        for word in words:
            self._part(word)
        self._part(":")

    def _part(self, wanted: str) -> None:
        found = self.word(f"{wanted}")
        if not found.upper().startswith(wanted.upper()):
            self.fail(f"{found[:40]!r} where {wanted} is needed")
        if len(found) > len(wanted):
            self.back(found[len(wanted) :])

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
            if "{" not in (words := reader.rest()):  # a name of its own, or nothing
                words = []
            for word in reversed(words[words.index("{") :] if words else []):
                reader.back(word)
            joints.append(_read_joint(reader, f"{joints[open_[-1]].name} end", open_[-1], end=True))
            open_.append(len(joints) - 1)
        else:
            reader.fail(f"{word[:40]!r} where {'JOINT, End Site or }' if open_ else 'ROOT or MOTION'} is needed")


def _read_joint(reader: _Reader, name: str, parent: int, end: bool = False) -> Joint:
    """A joint from its opening brace to its channels."""
    reader.expect("{")
    reader.expect("OFFSET")
    offset = np.array([reader.number("an offset") for _ in AXES])
    if (word := reader.word("CHANNELS, JOINT, End Site or }")).upper() != "CHANNELS":
        reader.back(word)
        return Joint(name, parent, offset, ())
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
    if end and channels:
        reader.fail("an End Site has channels: it is the end of a limb, which its joint moves")
    if len(set(channels)) < len(channels):
        reader.fail("a channel occurs twice")
    return Joint(name, parent, offset, tuple(channels))


def _read_motion(reader: _Reader, joints: tuple[Joint, ...], channels: int, which: str | None) -> Skeleton:
    reader.title("Frames")
    frames = reader.number("the number of frames")
    if frames < 1 or not frames.is_integer():
        reader.fail(f"{frames:g} frames: a whole number, 1 or more, is needed")
    reader.title("Frame", "Time")
    frame_time = reader.number("the frame time")
    if frame_time <= 0:
        reader.fail(f"a frame time of {frame_time:g}: a positive number of seconds is needed")
    if reader.rest():
        reader.fail("more than the frame time")
    numbers, count = array("d"), 0  # grows with what the file holds, not with what it claims
    for words in _frames(reader, channels):
        if count == frames and which == "claimed":
            reader.notes.append(f"frames beyond the {frames:g} that the file claims are left out")
            break
        if count == frames and which is None:
            reader.fail(
                f"more than the {frames:g} frames that the file claims: frames='found' reads them, frames='claimed' not"
            )
        numbers.extend(reader.as_number(word, "a channel") for word in words)
        count += 1
        if count * len(joints) > MOST_POSITIONS:
            reader.fail(f"more than {MOST_POSITIONS:g} positions of joints: cut the file into several")
    if count < frames and which is None:
        reader.fail(
            f"the file ends after {count} of the {frames:g} frames that it claims: frames='found' reads what is there"
        )
    if not count:
        reader.fail("the file has no frames")
    if count != frames:
        reader.notes.append(f"{count} frames are read where the file claims {frames:g}")
    return Skeleton(joints, np.array(numbers).reshape(count, channels), frame_time)


def _frames(reader: _Reader, channels: int) -> Iterator[list[str]]:
    """The words of each frame, which may go on over several lines."""
    begun: list[str] = []
    for words in reader.lines():
        if begun and len(begun) + len(words) > channels:
            reader.fail(f"{len(begun)} numbers for {channels} channels in the frame that ends before this line")
        begun = [*begun, *words] if begun else words
        if len(begun) > channels:
            reader.fail(f"{len(begun)} numbers for {channels} channels")
        if len(begun) == channels:
            yield begun
            begun = []
    if begun:
        reader.fail(f"{len(begun)} numbers for {channels} channels")
