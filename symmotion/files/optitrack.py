"""Rigid bodies out of the CSV files that Motive writes: rows on what is recorded, then names, then frames."""

import csv
from collections.abc import Iterator
from itertools import islice
from typing import NamedTuple

from numpy.typing import ArrayLike

from symmotion.errors import InputError
from symmotion.files.columns import Chosen
from symmotion.files.formats import FilePath
from symmotion.files.poses import Telling, positions_of
from symmotion.files.positions import Repeated
from symmotion.files.recording import Recording
from symmotion.files.tables import Table, beginning
from symmotion.opening import readable

MARK = "format version"
HEAD = 20  # rows within which the names of the columns stand
BODIES = ("rigid body", "bone")
UNITS = {"meters": "m", "centimeters": "cm", "millimeters": "mm"}


class Head(NamedTuple):
    """What stands above the frames: the entries of the first row, and each column's words from above down."""

    said: dict[str, str]
    columns: list[list[str]]


def is_optitrack(path: FilePath) -> bool:
    """Whether a CSV file begins as Motive's do."""
    with readable(path) as handle:
        return any(line.strip().lower().lstrip('"').startswith(MARK) for line in beginning(handle, 1))


def read_optitrack(
    path: FilePath,
    *,
    times: ArrayLike | None = None,
    node: str | int | None = None,
    lost: str | None = None,
    repeated: Repeated | None = None,
    norms: float | None = None,
) -> Recording:
    """The positions of a rigid body of a Motive CSV file, in metres at times in seconds.

    node: the body, by name or number; may be left out where there is one. Frames in which it was not seen are rows
    of lost tracking. Raises InputError for rotations that are not quaternions.
    """
    with readable(path) as handle:
        rows = _rows(path, handle)
        head, line = _head(path, rows)
        turn, place, time = _columns(path, head, node)
        unit = UNITS.get(head.said.get("length units", "meters").lower())
        chosen = Chosen((time,), place, "quaternion", turn, units=dict.fromkeys(place, unit))
        header = [".".join(words) for words in head.columns]
        table = Table(header, False, line, [], rows)
        return positions_of(path, table, header, chosen, Telling(None, None, lost, norms)).recording(
            path, times, repeated
        )


def _rows(path: FilePath, handle) -> Iterator[tuple[int, list[str]]]:
    reader = csv.reader(handle)
    try:
        for row in reader:
            if row:
                yield reader.line_num, row
    except csv.Error as error:
        raise InputError(f"{path}, line {reader.line_num}: {error}") from None


def _head(path: FilePath, rows: Iterator[tuple[int, list[str]]]) -> tuple[Head, int]:
    above: list[list[str]] = []
    for line, row in islice(rows, HEAD):
        row = [field.strip() for field in row]
        if row[0].lower() == "frame":
            said = dict(zip([k.lower() for k in above[0][::2]], above[0][1::2], strict=False)) if above else {}
            levels = [r for r in above[1:] if any(r)]
            return Head(said, [[r[min(i, len(r) - 1)] for r in levels] + [name] for i, name in enumerate(row)]), line
        above.append(row)
    raise InputError(f"{path}: no row that begins with Frame is among the first {HEAD}: is it a CSV export of Motive?")


def _columns(path: FilePath, head: Head, node: str | int | None) -> tuple[tuple[int, ...], tuple[int, ...], int]:
    """The columns of the turn, scalar last, of the place and of the time."""
    times = [i for i, words in enumerate(head.columns) if words[-1].lower().startswith("time")]
    bodies: dict[str, list[int]] = {}
    for i, words in enumerate(head.columns):
        if words[0].lower() in BODIES:
            bodies.setdefault(words[1] if len(words) > 2 else words[0], []).append(i)
    if not times or not bodies:
        raise InputError(f"{path}: a column of times and those of a rigid body are needed")
    names = list(bodies)
    if node is None and len(names) > 1:
        raise InputError(f"{path}: several bodies were recorded, name one as node: {', '.join(names[:20])}")
    if isinstance(node, int) and not 0 <= node < len(names):
        raise InputError(f"{path}: body {node} does not exist: there are {len(names)}")
    name = names[0] if node is None else names[node] if isinstance(node, int) else node
    if name not in bodies:
        raise InputError(f"{path}: no body is called {name!r:.60}; there are {', '.join(names[:20])}")
    found: dict[str, dict[str, int]] = {"rotation": {}, "position": {}}
    for i in bodies[name]:
        words = [word.lower() for word in head.columns[i]]
        # Without a row that says which, the rotation comes first, and is as long as has a W.
        said = [w for w in words[:-1] if w in found]
        kind = said[-1] if said else "rotation" if len(found["rotation"]) < 4 else "position"
        found[kind].setdefault(words[-1], i)
    turn, place = found["rotation"], found["position"]
    if not set("xyzw") <= set(turn) or not set("xyz") <= set(place):
        raise InputError(f"{path}: body {name!r:.60} needs columns X Y Z W of a rotation as quaternion and X Y Z")
    return tuple(turn[a] for a in "xyzw"), tuple(place[a] for a in "xyz"), times[0]
