"""Which columns of a table are time, place and turn: found by their names, or as they are told."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from difflib import get_close_matches
from itertools import product
from textwrap import shorten
from typing import NoReturn

from symmotion.errors import InputError
from symmotion.files.formats import FilePath
from symmotion.files.names import AXES, EULER, Meaning, meaning
from symmotion.files.tables import advice

# What can be told of a table: a role and its columns, by name or number; None for a role that no column has.
Told = Mapping[str, str | int | Sequence[str | int] | None]
ROLES = {
    "time": (1,),
    "translation": (2, 3),
    "quaternion": (4,),
    "rotvec": (3,),
    "angle": (1,),
    "matrix": (4, 9, 12, 16),
}
SEQUENCES = tuple(
    "".join(axes) for letters in ("xyz", "XYZ") for axes in product(letters, repeat=3)
    if axes[0] != axes[1] != axes[2]
)  # fmt: skip
USUAL = ("time", "x", "y", "z", "qx", "qy", "qz", "qw", "roll", "pitch", "yaw", "theta", "position", "orientation")
TAKES = {
    "time": "t, or time, or timestamp, or sec nsec",
    "linear part": "qx qy qz qw, or theta, or a11 a12 a21 a22, or a11 a12 … a33, or roll pitch yaw, or rotvec_x … _z",
    2: "x y, or tx ty, or v1 v2, or position.x …, or none",
    3: "x y z, or tx ty tz, or v1 v2 v3, or position.x …, or none",
}


@dataclass(frozen=True)
class Chosen:
    """The columns of a pose: time, two of them for seconds and nanoseconds; place; turn, and how it is written.

    kind: quaternion (scalar last), rotvec, angle, matrix (row by row; with the place in it where `whole`), or the
    sequence of Euler angles. rows: of the matrix. units: by column, those that names say.
    """

    time: tuple[int, ...]
    place: tuple[int, ...]
    kind: str
    turn: tuple[int, ...]
    rows: int = 0
    whole: bool = False
    units: Mapping[int, str | None] = field(default_factory=dict)
    notes: tuple[str, ...] = ()

    @property
    def dimension(self) -> int:
        planar = self.kind == "angle" or (self.kind == "matrix" and len(self.turn) - 2 * self.whole == 4)
        return 2 if planar else 3


def parsed(text: str) -> dict[str, list[str] | None]:
    """What is told of columns as a line has it: `time=stamp; translation=a,b,c; quaternion=`."""
    told: dict[str, list[str] | None] = {}
    for part in filter(str.strip, text.split(";")):
        role, equals, names = part.partition("=")
        if not equals:
            raise InputError(
                f"columns {part.strip()!r:.60}: ROLE=NAME,NAME,… is needed, as time=stamp;translation=a,b,c"
            )
        told[role.strip()] = [n.strip() for n in names.split(",")] if names.strip() else None
    return told


def checked_columns(told: Told | str, what: str = "columns") -> Told | str:
    """What is told of columns; InputError where a text does not say roles."""
    if isinstance(told, str):
        try:
            parsed(told)
        except InputError as error:
            raise InputError(str(error).replace("columns", what, 1)) from None
    return told


def choose(path: FilePath, header: Sequence[str], told: Told | None = None) -> Chosen:
    """The columns of the pose that a header names; InputError lists what was understood, what was not, likely names."""
    return _Header(path, header, told or {}).chosen()


class _Header:
    def __init__(self, path: FilePath, header: Sequence[str], told: Told):
        self.path, self.header = path, header
        self.told = {role: self._numbers(role, names) for role, names in told.items()}
        taken = {i for numbers in self.told.values() for i in numbers}
        self.meanings: list[Meaning | None] = [
            Meaning("told", "", "") if i in taken else meaning(name) for i, name in enumerate(header)
        ]
        self.units = {i: m.unit for i, m in enumerate(map(meaning, header)) if m is not None}

    def _numbers(self, role: str, names: str | int | Sequence[str | int] | None) -> tuple[int, ...]:
        if role not in ROLES and role not in SEQUENCES:
            raise InputError(
                f"columns: {role!r:.60} is no role; there are {', '.join(ROLES)} and sequences of Euler angles, as ZYX"
            )
        if names is None:
            return ()
        given = [names] if isinstance(names, str | int) else list(names)
        counts = ROLES.get(role, (3,))
        if len(given) not in counts:
            raise InputError(f"columns: {role} of {len(given)} columns: {' or '.join(map(str, counts))} are needed")
        return tuple(self._number(name) for name in given)

    def _number(self, name: str | int) -> int:
        known = [text.strip().lower() for text in self.header]
        wanted = str(name).strip().lower()
        if isinstance(name, str) and known.count(wanted) == 1:
            return known.index(wanted)
        if wanted.isdecimal() and int(wanted) < len(known) and wanted not in known:
            return int(wanted)
        raise InputError(
            f"{self.path}: {known.count(wanted)} columns are called {name!r:.60}; there are {self._shown()}"
        )

    def _shown(self, numbers: Iterable[int] | None = None) -> str:
        names = self.header if numbers is None else [self.header[i] for i in numbers]
        return shorten(", ".join(name.strip() for name in names), 200, placeholder=" …")

    def _of(self, *kinds: str) -> list[int]:
        return [i for i, m in enumerate(self.meanings) if m is not None and m.kind in kinds]

    def _refuse(self, what: str, present: Sequence[int], takes: str) -> NoReturn:
        unknown = [i for i, m in enumerate(self.meanings) if m is None]
        known = {text.strip().lower() for text in self.header}
        new = [name for name in USUAL if name not in known]
        guesses = ((self.header[i].strip(), get_close_matches(self.header[i].strip().lower(), new, 1)) for i in unknown)
        likely = [f"{name} ({found[0]}?)" for name, found in guesses if found]
        read = [i for i, m in enumerate(self.meanings) if m is not None and m.kind != "other"]
        role = {"linear part": "quaternion"}.get(what, what)
        parts = [f"understood were {self._shown(read) or 'none'}"]
        if unknown:
            parts.append(f"not understood {self._shown(unknown)}")
        if likely:
            parts.append(f"likely {shorten(', '.join(likely), 200, placeholder=' …')}")
        raise InputError(
            f"{self.path}: of the columns ({self._shown()}) {self._shown(present) or 'none'} would be the {what}: it "
            f"takes exactly {takes}; {'; '.join(parts)}: say which with columns={{{role!r}: …}}, None for none"
            f"{advice(self.header)}"
        )

    def chosen(self) -> Chosen:
        kind, turn, rows = self._turn()
        whole = kind == "matrix" and rows > 0 and len(turn) in (6, 12, 16)
        found = Chosen((), (), kind, turn, rows, whole)
        if whole and (clash := self._of("place") + list(self.told.get("translation", ()))):
            self._refuse("translation", clash, "the last column of the matrix, or places, not both")
        place = () if whole else self._place(found.dimension)
        time, notes = self._time()
        unknown = [i for i, m in enumerate(self.meanings) if m is None]
        for what, missing, takes in (
            ("time", not time and "time" not in self.told, TAKES["time"]),
            ("translation", not (place or whole) and "translation" not in self.told, TAKES[found.dimension]),
        ):
            if missing and unknown:
                self._refuse(what, (), takes)
        rest = [i for i in range(len(self.header)) if i not in (*time, *place, *turn)]
        if rest:
            notes.append(f"columns that are no part of a pose are left out: {self._shown(rest)}")
        return Chosen(time, place, kind, turn, rows, whole, self.units, tuple(notes))

    def _groups(self, kind: str) -> dict[str, dict[str, list[int]]]:
        """By owner and part, the columns of a kind."""
        groups: dict[str, dict[str, list[int]]] = {}
        for i in self._of(kind):
            m = self.meanings[i]
            assert m is not None
            groups.setdefault(m.owner, {}).setdefault(m.part, []).append(i)
        return groups

    def _time(self) -> tuple[tuple[int, ...], list[str]]:
        if "time" in self.told:
            return self.told["time"], []
        ways: list[tuple[int, tuple[int, ...]]] = []
        for owner, parts in self._groups("time").items():
            depth = len(owner.split(".")) if owner else 0
            if "sec" in parts and "nsec" in parts:
                ways += [(depth, pair) for pair in product(parts["sec"], parts["nsec"])]
            else:
                ways += [(depth, (i,)) for part in ("", "sec", "nsec") for i in parts.get(part, [])]
        if not ways:
            return (), []
        least = min(depth for depth, _ in ways)
        nearest = [columns for depth, columns in ways if depth == least]
        if len(nearest) > 1:
            self._refuse("time", [i for columns in nearest for i in columns], TAKES["time"])
        notes = [f"of several times {self._shown(nearest[0])} is taken"] if len(ways) > 1 else []
        return nearest[0], notes

    def _place(self, d: int) -> tuple[int, ...]:
        if "translation" in self.told:
            told = self.told["translation"]
            if told and len(told) != d:
                raise InputError(f"columns: translation of {len(told)} columns: {d} are needed")
            return told
        present, groups = self._of("place"), self._groups("place")
        axes = AXES[:d]
        if not present:
            return ()
        (parts, *others) = groups.values()
        if others or sorted(parts) != sorted(axes) or any(len(numbers) > 1 for numbers in parts.values()):
            self._refuse("translation", present, TAKES[d])
        return tuple(parts[axis][0] for axis in axes)

    def _turn(self) -> tuple[str, tuple[int, ...], int]:
        told = [role for role in self.told if role not in ("time", "translation") and self.told[role]]
        if len(told) > 1:
            raise InputError(f"columns: {' and '.join(told)} are two ways to say the linear part: give one")
        if told:
            numbers = self.told[told[0]]
            return told[0], numbers, {4: 2, 9: 3, 12: 3, 16: 4}[len(numbers)] if told[0] == "matrix" else 0
        present = self._of("quaternion", "rotvec", "euler", "angle", "matrix")
        ways = [way for kind in ("quaternion", "rotvec", "euler", "angle", "matrix") for way in self._complete(kind)]
        used = {i for _, turn, _ in ways for i in turn}
        # A heading without roll and pitch is the angle in the plane, where there is no third coordinate.
        yaws = [i for i in self._of("euler")]
        if not ways and len(yaws) == len(present) == 1 and self.header[yaws[0]].strip().lower().startswith("yaw"):
            return "angle", (yaws[0],), 0
        if len(ways) != 1 or used != set(present):
            self._refuse("linear part", present, TAKES["linear part"])
        return ways[0]

    def _complete(self, kind: str) -> list[tuple[str, tuple[int, ...], int]]:
        needed = {"quaternion": "xyzw", "rotvec": AXES, "euler": EULER[::-1], "angle": ("",)}
        ways = []
        for parts in self._groups(kind).values():
            if any(len(numbers) > 1 for numbers in parts.values()):
                continue
            if kind == "matrix":
                ways += _matrix({part: numbers[0] for part, numbers in parts.items()})
            elif sorted(parts) == sorted(needed[kind]):
                columns = tuple(parts[part][0] for part in needed[kind])
                ways.append(("ZYX" if kind == "euler" else kind, columns, 0))
        return ways


def _matrix(parts: Mapping[str, int]) -> list[tuple[str, tuple[int, ...], int]]:
    """The matrix whose entries are counted from 0 or 1, row by row; none where some are missing."""
    first = "0" if any("0" in part for part in parts) else "1"
    for rows, columns in ((2, 2), (2, 3), (3, 3), (3, 4), (4, 4)):
        wanted = [f"{int(first) + i}{int(first) + j}" for i in range(rows) for j in range(columns)]
        if sorted(wanted) == sorted(parts):
            return [("matrix", tuple(parts[part] for part in wanted), rows)]
    return []
