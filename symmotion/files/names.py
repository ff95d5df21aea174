"""What the names of columns mean, as programs that record poses write them."""

import re
from dataclasses import dataclass

# What a unit in brackets, or at the end of a name, makes of a number: seconds, metres, radians.
SECONDS = {"s": 1.0, "sec": 1.0, "seconds": 1.0, "ms": 1e-3, "us": 1e-6, "µs": 1e-6, "ns": 1e-9}
METRES = {"m": 1.0, "meters": 1.0, "metres": 1.0, "cm": 1e-2, "mm": 1e-3, "km": 1e3}
DEGREE = 3.141592653589793 / 180
RADIANS = {"rad": 1.0, "radians": 1.0, "deg": DEGREE, "degrees": DEGREE, "°": DEGREE}
UNITS = {**dict.fromkeys(SECONDS, "time"), **dict.fromkeys(METRES, "length"), **dict.fromkeys(RADIANS, "angle")}
NO_UNIT = ("", "-", "1")

BRACKETS = re.compile(r"[\[(]([^\])]*)[\])]")
MATRIX = re.compile(r"(?:(.*)_)?([amrth]|rot|mat|matrix|transform)_?([0-4])_?([0-4])")
SHORT = re.compile(r"(q|quat|p|pos|t)([xyzw])")
NUMBERED = re.compile(r"v([123])")
AXES = "xyz"
TIMES = {"t", "time", "stamp", "timestamp", "times"}
WHOLE_SECONDS = {"sec", "secs", "seconds"}
NANOSECONDS = {"nsec", "nsecs", "nanosec", "nanosecs", "nanoseconds"}
PLACES = {"p", "t", "pos", "position", "trans", "translation", "location", "loc", "origin", "place"}
TURNS = {"q", "quat", "quaternion", "orientation", "rotation", "rot", "attitude", "att", "ori"}
VECTORS = {"rotvec", "rvec", "rotationvector", "axisangle", "rodrigues"}
IMAGINARY = re.compile(r"(?:q|quat|quaternion)_?([ijkr])")  # with r for the real part
EULER = ("roll", "pitch", "yaw")
ANGLES = {"theta", "heading"}
# Words of columns that are no part of a pose: numbering, labels, rates, what else is measured.
OTHERS = {
    *("index", "idx", "id", "seq", "frame", "frames", "number", "no", "count", "row", "name", "label", "note", "notes"),
    *("comment", "comments", "camera", "file", "image", "status", "quality", "confidence", "valid", "error"),
    *("covariance", "cov", "velocity", "vel", "twist", "acceleration", "acc", "accel", "omega", "bias", "gyro"),
    *("rate", "angular", "linear", "child", "parent", "marker", "speed", "tracked", "dt"),
}
RATES = {"v", "a", "b", "w"}  # as the first of several words


@dataclass(frozen=True)
class Meaning:
    """What a column is: kind, as "place", its part, as "x", of whom (the words before), and the unit in its name.

    kind: time, place, quaternion, rotvec, euler, angle, matrix, or other, which is no part of a pose.
    """

    kind: str
    part: str
    owner: str
    unit: str | None = None


def meaning(name: str) -> Meaning | None:
    """What a column of that name is; None where nothing is known of it."""
    words, unit = _words(name)
    if not words:
        return Meaning("other", "", "")
    if len(words) > 1 and unit is None and UNITS.get(words[-1]) and words[-1] not in WHOLE_SECONDS:
        unit = words.pop()
    found = _pose(words) or _time(words)
    if found is None and ((len(words) > 1 and words[0] in RATES) or OTHERS & set(words) or _is_rate(words)):
        found = "other", "", words
    if found is None:
        return None
    kind, part, owner = found
    return Meaning(kind, part, ".".join(owner), unit)


def _words(name: str) -> tuple[list[str], str | None]:
    """The words of a name, lower case, and the unit in brackets, which may be empty; None without brackets."""
    text = name.strip().lstrip("#%").strip()
    brackets = BRACKETS.search(text)
    text = re.sub(r"(?<=[a-z])(?=[A-Z])", "_", BRACKETS.sub("", text))
    unit = None if brackets is None else brackets[1].strip().lower()
    return [word for word in re.split(r"[^a-z0-9]+", text.lower()) if word], unit


Found = tuple[str, str, list[str]] | None


def _time(words: list[str]) -> Found:
    for kinds, part in ((TIMES, ""), (WHOLE_SECONDS, "sec"), (NANOSECONDS, "nsec")):
        if words[-1] in kinds:
            return "time", part, words[:-1]
    return None


def _pose(words: list[str]) -> Found:
    last = words[-1]
    if matched := MATRIX.fullmatch("_".join(words)):
        return "matrix", matched[3] + matched[4], [matched[1] or "", matched[2]]
    if matched := NUMBERED.fullmatch(last):
        return "place", AXES[int(matched[1]) - 1], [*words[:-1], "v"]
    if last in EULER:
        return "euler", last, words[:-1]
    if last in ANGLES:
        return "angle", "", words[:-1]
    if matched := IMAGINARY.fullmatch(last) or IMAGINARY.fullmatch("_".join(words[-2:])):
        return "quaternion", "xyzw"["ijkr".index(matched[1])], [w for w in words[:-1] if w not in ("q", "quat")]
    if matched := SHORT.fullmatch(last):
        return _kind([*words[:-1], matched[1]], matched[2])
    return _kind(words[:-1], last) if last in (*AXES, "w") else None


def _kind(owner: list[str], axis: str) -> Found:
    """Place or turn, by the last long word that says which, else by the first one if it is a letter."""
    said = [word for word in reversed(owner) if len(word) > 1] + owner[:1]
    if len(owner) > 1:
        said.append(owner[-1])
    for word in said:
        turning = word in ("vector", "vec") and {"rotation", "rot"} & set(owner)
        if turning or (word == "angle" and "axis" in owner) or word in VECTORS:
            return "rotvec", axis, owner
        if word in OTHERS or (word in RATES and len(owner) >= 1):
            return "other", "", owner
        if word in TURNS:
            return "quaternion", axis, owner
        if word in PLACES:
            return ("place", axis, owner) if axis in AXES else None
    if not owner or owner == ["pose"]:
        return ("place", axis, owner) if axis in AXES else ("quaternion", axis, owner)
    return None


def _is_rate(words: list[str]) -> bool:
    return bool(re.fullmatch(r"[vwab][xyz]|cov\w*\d+", words[-1]))
