"""Poses out of the columns of a table: units, ways to write a turn, rows of lost tracking."""

import re
from array import array
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from symmotion import checks
from symmotion.errors import InputError
from symmotion.files.columns import Chosen, Told
from symmotion.files.formats import FilePath
from symmotion.files.names import DEGREE, METRES, NO_UNIT, RADIANS, SECONDS
from symmotion.files.positions import Positions
from symmotion.files.tables import Columns, Growing, Table, number, number_parts

NORM_TOLERANCE = 1e-3
FAR = 0.5  # from a norm of 1: other columns
AFFINE_TOLERANCE = 1e-6
NANO = 10**9
WHOLE = re.compile(r"\s*\d{1,30}\s*")
# Whole numbers of this size count fractions of seconds since 1970: as seconds they would be in the year 5138.
STAMPS = ((1e17, "ns"), (1e14, "us"), (1e11, "ms"))
TURN = 2 * np.pi


class Telling(NamedTuple):
    """What a reader of tables is told: roles of columns, the unit of angles, what becomes of lost rows, norms."""

    columns: Told | str | None = None
    angles: str | None = None
    lost: str | None = None
    norms: float | None = None


@dataclass
class Seen:
    """What is said once of all rows: how many are dropped, and where first; how many normalised, and how far off."""

    dropped: int = 0
    first: int = 0
    normalised: int = 0
    furthest: float = 0.0

    def notes(self) -> Iterator[str]:
        if self.dropped:
            yield f"{self.dropped} rows of lost tracking are dropped, the first in line {self.first}"
        if self.normalised:
            yield f"{self.normalised} quaternions are normalised, norms up to {self.furthest:.3g} from 1"


def positions_of(path: FilePath, table: Table, header: Columns, chosen: Chosen, telling: Telling) -> Positions:
    """The positions in a table's rows, in seconds, metres and radians where units are named."""
    notes, seen, d = list(chosen.notes), Seen(), chosen.dimension
    stamp, unit = _stamps(path, table, chosen, notes)
    columns = [*(() if stamp else chosen.time), *chosen.place, *chosen.turn]
    metres = _scales(path, header, chosen, chosen.place, METRES, "metres", notes)
    radians = _radians(path, header, chosen, telling, notes)
    counted = 1 if chosen.time else 0
    times, linear, translation, lines = Growing(), Growing(d, d), Growing(d), array("q")
    # Part by part: the numbers of all rows, beside what is made of them, would take twice the memory.
    for numbers, places in number_parts(path, table.rows, columns, len(header), telling.lost == "drop", stamp):
        if telling.lost == "drop":
            numbers, places = _tracked(numbers, places, chosen, seen)
            if not len(places):
                continue
        t, v, a = np.split(numbers, np.cumsum([counted, len(chosen.place)]), axis=1)
        turned, inside = _linear(path, chosen, a * radians, places, telling, seen)
        linear.add(turned.reshape(-1, d, d))
        translation.add(v * metres if chosen.place else np.zeros((len(t), d)) if inside is None else inside)
        times.add(t[:, 0] * unit if counted else np.empty(0))
        lines.frombytes(places.tobytes())
    if not lines:
        raise InputError(f"{path}: holds no keyframes: tracking is lost in all rows")
    found = (linear.whole(), translation.whole(), times.whole() if counted else None)
    return Positions(*found, lambda i: f"line {lines[i]}", (*notes, *seen.notes()))


def _tracked(numbers: np.ndarray, lines: np.ndarray, chosen: Chosen, seen: Seen) -> tuple[np.ndarray, np.ndarray]:
    """The rows that hold a pose, and their lines: all finite, and a quaternion that is not zero."""
    kept = np.isfinite(numbers).all(axis=1)
    if chosen.kind == "quaternion":
        kept &= (numbers[:, -4:] != 0).any(axis=1)
    if not kept.all():
        seen.first = seen.first or int(lines[np.argmin(kept)])
        seen.dropped += int((~kept).sum())
    return numbers[kept], lines[kept]


def _stamps(
    path: FilePath, table: Table, chosen: Chosen, notes: list[str]
) -> tuple[Callable[[list[str]], float] | None, float]:
    """What makes a time in seconds of a row's fields, None where a column is a number; and its unit in seconds."""
    if len(chosen.time) == 2:
        sec, nsec = chosen.time
        return lambda fields: (_count(fields[sec]) * NANO + _count(fields[nsec])) / NANO, 1.0
    if not chosen.time or chosen.time[0] >= len(table.first):
        return None, 1.0
    (column,) = chosen.time
    unit, first = chosen.units.get(column), table.first[column]
    if unit is not None and unit not in (*SECONDS, *NO_UNIT):
        raise InputError(f"{path}: times in {unit!r:.40}: one of {', '.join(SECONDS)} is known")
    if unit is None and WHOLE.fullmatch(first):
        unit = next((name for least, name in STAMPS if int(first) >= least), None)
        if unit is not None:
            notes.append(f"times like {first.strip()} are taken as {unit}: they are in seconds now")
    if unit in ("ns", "us", "µs", "ms") and WHOLE.fullmatch(first):
        parts = round(1 / SECONDS[unit])
        return lambda fields: _count(fields[column]) / parts, 1.0
    return None, SECONDS.get(unit or "", 1.0)


def _count(word: str) -> int | float:
    """A stamp's number, whole ones exactly."""
    return int(word) if WHOLE.fullmatch(word) else number(word)


def _scales(
    path: FilePath,
    header: Columns,
    chosen: Chosen,
    columns: Sequence[int],
    known: dict[str, float],
    into: str,
    notes: list[str],
    default: float = 1.0,
) -> np.ndarray:
    """By which columns are multiplied for their units; default: of those without one."""
    found = []
    for i in columns:
        unit = chosen.units.get(i)
        if unit is not None and unit not in (*known, *NO_UNIT):
            raise InputError(f"{path}: {header[i].strip()!r:.60}: one of the units {', '.join(known)} is needed")
        found.append(default if unit is None or unit in NO_UNIT else known[unit])
    if any(scale != 1.0 for scale in found) and default == 1.0:
        notes.append(f"{', '.join(header[i].strip() for i in columns)} are in {into} now")
    return np.array(found)


def _radians(path: FilePath, header: Columns, chosen: Chosen, telling: Telling, notes: list[str]) -> np.ndarray:
    """By which columns of a turn are multiplied: ones where they are no angles."""
    if chosen.kind in ("quaternion", "matrix"):
        return np.ones(1)
    default = DEGREE if telling.angles == "deg" else 1.0
    found = _scales(path, header, chosen, chosen.turn, RADIANS, "radians", notes, default)
    if chosen.kind != "angle" and _silent(chosen, telling):
        notes.append("angles without a unit are taken as radians")
    if chosen.kind not in ("angle", "rotvec"):
        notes.append(f"Euler angles are taken as {chosen.kind}: {', '.join(header[i].strip() for i in chosen.turn)}")
    return found


def _silent(chosen: Chosen, telling: Telling) -> bool:
    """Whether nothing says what unit angles have."""
    return telling.angles is None and any(chosen.units.get(i) is None for i in chosen.turn)


def _linear(
    path: FilePath, chosen: Chosen, a: np.ndarray, lines: np.ndarray, telling: Telling, seen: Seen
) -> tuple[np.ndarray, np.ndarray | None]:
    """Linear parts, and the translations that matrices may have."""
    from scipy.spatial.transform import Rotation  # here: see as_rotations

    if chosen.kind == "quaternion":
        return Rotation.from_quat(_unit(path, a, lines, telling.norms, seen)).as_matrix(), None
    if chosen.kind == "matrix":
        return _split(path, a, chosen, lines)
    if chosen.kind == "angle":
        return np.hstack([np.cos(a), -np.sin(a), np.sin(a), np.cos(a)]), None
    if _silent(chosen, telling) and (wrong := np.abs(a).max(axis=1) > TURN).any():
        i = int(np.argmax(wrong))
        raise InputError(
            f"{path}, line {lines[i]}: an angle of {np.abs(a[i]).max():g}: degrees? say angles='deg' or angles='rad'"
        )
    if chosen.kind == "rotvec":
        return Rotation.from_rotvec(a).as_matrix(), None
    return Rotation.from_euler(chosen.kind, a).as_matrix(), None


def _split(path: FilePath, a: np.ndarray, chosen: Chosen, lines: np.ndarray) -> tuple[np.ndarray, np.ndarray | None]:
    """Linear parts and translations of matrices (M, rows · columns)."""
    if not chosen.whole:
        return a, None
    d = chosen.dimension
    matrices = a.reshape(len(a), chosen.rows, d + 1)
    if chosen.rows == d + 1:
        wrong = np.abs(matrices[:, d] - np.eye(d + 1)[d]).max(axis=1) > AFFINE_TOLERANCE
        if wrong.any():
            raise InputError(f"{path}, line {lines[int(np.argmax(wrong))]}: the last row of the matrix is not 0 … 0 1")
    return matrices[:, :d, :d], matrices[:, :d, d]


def _unit(
    path: FilePath, quaternions: np.ndarray, lines: np.ndarray, tolerance: float | None, seen: Seen
) -> np.ndarray:
    """The quaternions (M, 4), scalar-last; InputError where a norm is further from 1 than the tolerance."""
    within = NORM_TOLERANCE if tolerance is None else checks.positive(tolerance, "norms")
    norms = np.linalg.norm(quaternions, axis=1)
    wrong = ~(np.abs(norms - 1) <= within) | (norms == 0)
    if wrong.any():
        i = int(np.argmax(wrong))
        furthest = float(np.abs(norms[norms > 0] - 1).max(initial=0.0))
        # Two digits, rounded up.
        allowed = float(f"{1.05 * furthest:.1e}")
        remedy = f"norms={allowed:g} takes them all" if furthest < FAR else "are the columns those of a quaternion?"
        remedy = "lost='drop' leaves such rows out" if norms[i] == 0 else remedy
        raise InputError(
            f"{path}, line {lines[i]}: a quaternion of norm {norms[i]:.6g}: unit quaternions are needed; {remedy}"
        )
    if (off := np.abs(norms - 1)).max(initial=0.0) > NORM_TOLERANCE:
        seen.normalised += int((off > NORM_TOLERANCE).sum())
        seen.furthest = max(seen.furthest, float(off.max()))
    return quaternions
