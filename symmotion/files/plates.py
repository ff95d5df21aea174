"""Finite rotations of tectonic plates (.rot), as GPlates and PALEOMAP have them."""

import numpy as np
from numpy.typing import ArrayLike

from symmotion.errors import InputError
from symmotion.files.formats import FilePath
from symmotion.files.numbers import finite
from symmotion.files.positions import Positions, Repeated
from symmotion.files.recording import Recording
from symmotion.opening import readable

LINE = "plate, age, latitude, longitude, angle and fixed plate are needed"


def read_rot(
    path: FilePath, *, times: ArrayLike | None = None, node: str | int | None = None, repeated: Repeated | None = None
) -> Recording:
    """The rotations of one plate against a fixed one, in order of age, about the middle of the earth.

    A line: plate, age [Ma], latitude and longitude of the pole [°], angle [°], fixed plate, then a comment from "!" on.

    node: the plate, 801, or with the fixed one, "801/000"; the only one when left out. repeated: as for tables.
    Raises InputError that names the file and the line at fault, or the plates that there are.
    """
    rows: dict[tuple[int, int], list[tuple[float, ...]]] = {}
    with readable(path) as handle:
        for line, text in enumerate(handle, 1):
            words = text.split("!")[0].split()
            if not words:
                continue
            if len(words) < 6 or not (words[0] + words[5]).isdecimal():
                raise InputError(f"{path}, line {line}: {LINE}")
            try:
                numbers = [finite(word) for word in words[1:5]]
            except InputError as error:
                raise InputError(f"{path}, line {line}: {error}: {LINE}") from None
            rows.setdefault((int(words[0]), int(words[5])), []).append((numbers[0], *np.deg2rad(numbers[1:]), line))
    chosen = _chosen(path, list(rows), node)
    found = np.array(sorted(rows[chosen], key=lambda row: (row[0], row[-1])))
    age, latitude, longitude, angle, lines = found.T
    pole = np.stack([np.cos(latitude) * np.cos(longitude), np.cos(latitude) * np.sin(longitude), np.sin(latitude)], 1)
    from scipy.spatial.transform import Rotation  # here: see as_rotations

    linear = Rotation.from_rotvec(angle[:, None] * pole).as_matrix()
    notes = (f"plate {chosen[0]:03d} against {chosen[1]:03d}, ages in Ma",)
    made = Positions(linear, np.zeros((len(age), 3)), age, lambda i: f"line {lines[i]:.0f}", notes)
    return made.recording(path, times, repeated)


def _chosen(path: FilePath, there: list[tuple[int, int]], node: str | int | None) -> tuple[int, int]:
    """The plate and the fixed one that are asked for."""
    wanted = [] if node is None else str(node).split("/")
    if len(wanted) > 2 or not all(word.isdecimal() for word in wanted):
        raise InputError(f"{path}: node {node!r:.60}: a plate as 801, or with the fixed one as 801/000, is needed")
    numbers = [int(word) for word in wanted]
    found = [pair for pair in there if list(pair[: len(numbers)]) == numbers]
    if len(found) == 1:
        return found[0]
    if not there:
        raise InputError(f"{path}: holds no rotations")
    shown = ", ".join(f"{plate:03d}/{fixed:03d}" for plate, fixed in (found or there)[:12])
    more = " …" if len(found or there) > 12 else ""
    asked = "" if node is None else f" {node}"
    raise InputError(f"{path}: {len(found)} series of rotations fit plate{asked}; there are {shown}{more}")
