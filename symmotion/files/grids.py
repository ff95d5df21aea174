"""Measured nets and tool paths as tables of named columns: orientations on a grid, poses at (u, v)."""

import csv
from dataclasses import dataclass
from textwrap import shorten

import numpy as np
from numpy.typing import ArrayLike

from symmotion import checks
from symmotion.brief import in_a_line
from symmotion.errors import InputError
from symmotion.files.formats import FilePath
from symmotion.files.tables import Columns, read_numbers, table_of
from symmotion.motions.dual import DualQuaternions
from symmotion.motions.position import Affine
from symmotion.motions.symmetry import Symmetry
from symmotion.motions.two_parameter import Knots, TwoParameterMotion
from symmotion.opening import readable
from symmotion.whole import whole_file

PLACES = (("row", "column"), ("i", "j"), ("y", "x"))
QUATERNION = ("qw", "qx", "qy", "qz")
EULER = (("phi1", "phi", "phi2"), ("e1", "e2", "e3"))
# SciPy's letters, capitals for turns about the axes of the body, by the names that angles go by.
CONVENTIONS = {"bunge": "ZXZ", "roe": "ZYZ", "matthies": "ZYZ", "roll-pitch-yaw": "xyz", "yaw-pitch-roll": "ZYX"}
PARAMETERS = ("u", "v")
TRANSLATION = ("x", "y", "z")


def read_orientation_grid(
    path: FilePath,
    *,
    convention: str = "bunge",
    degrees: bool = True,
    symmetry: "Symmetry | None" = None,
    knots: Knots = "uniform",
    delimiter: str | None = None,
) -> TwoParameterMotion:
    """The spherical net of orientations measured on a grid, one a line.

    Columns by name: `row column` (or `i j`, `y x`), and `qw qx qy qz` or Euler angles `phi1 Phi phi2` or `e1 e2 e3`;
    others are left alone. convention: "bunge", "roe", "roll-pitch-yaw", … or SciPy's letters, "ZXZ"; the rotations take
    coordinates of the crystal or body to those of the sample. symmetry: see `DualQuaternions.aligned`. knots: see
    `TwoParameterMotion.from_displacements`.

    path: of the file.

    Raises InputError that names the line, the first place without an orientation, and crystal symmetry where the
    orientations do not join without it.

    degrees: whether Euler angles are in degrees; delimiter: between columns.

    >>> from pathlib import Path
    >>> rows = [f"{i} {j} {10 * i} {5 * j} 0" for i in range(5) for j in range(5)]
    >>> Path("grid.txt").write_text("row column phi1 Phi phi2\\n" + "\\n".join(rows)) > 0
    True
    >>> sm.files.read_orientation_grid("grid.txt").real.shape
    (5, 5, 4)
    """
    with readable(path) as handle:
        table = table_of(path, handle, delimiter, False)
        header = _header(table.header or ())
        place = _present(path, header, "places on the grid", PLACES)
        turn = _present(path, header, "orientations", (QUATERNION, *EULER))
        numbers, lines = read_numbers(path, table.rows, [header.index(c) for c in (*place, *turn)], len(header))
    at, values = numbers[:, :2], numbers[:, 2:]
    real = values if turn == QUATERNION else _from_euler(path, values, convention, degrees)
    zero = np.linalg.norm(real, axis=1) == 0
    if zero.any():
        raise InputError(f"{path}, line {lines[int(np.argmax(zero))]}: the quaternion is zero")
    net = _on_grid(path, at, real, lines, place)
    try:
        return TwoParameterMotion.from_displacements(DualQuaternions(net), knots, knots, symmetry=symmetry)
    except InputError as error:
        raise InputError(f"{path}: {error}") from None


@dataclass(frozen=True, eq=False)
class ToolPath:
    """Poses of a tool at parameters of a surface: u, v (N,), and the displacements (N,) there.

    >>> net = sm.motions.smooth_net(6, spatial=True)
    >>> u, v = np.meshgrid(net.u.breakpoints, net.v.breakpoints, indexing="ij")
    >>> sm.files.write_tool_path(net, "tool.csv", u, v)
    >>> sm.files.read_tool_path("tool.csv").u.shape == (u.size,)
    True
    """

    u: np.ndarray
    v: np.ndarray
    displacements: DualQuaternions

    __repr__ = in_a_line

    def keyframes(self) -> list[tuple[tuple[float, float], Affine]]:
        """The poses as `fair` takes them."""
        there = self.displacements.matrices
        return [
            ((float(u), float(v)), Affine(a, d))
            for u, v, a, d in zip(self.u, self.v, there.linear, there.translation, strict=True)
        ]

    def net(self, knots: Knots = "uniform") -> TwoParameterMotion:
        """The motion whose controls are the poses, where u and v make a whole grid; InputError where they do not."""
        pair, at = self.displacements, np.column_stack([self.u, self.v])
        both = np.concatenate([pair.real, pair.dual], axis=1)
        net = _on_grid("tool path", at, both, range(len(at)), PARAMETERS)
        return TwoParameterMotion.from_displacements(DualQuaternions(net[..., :4], net[..., 4:]), knots, knots)


def read_tool_path(path: FilePath, *, delimiter: str | None = None) -> ToolPath:
    """A table of columns `u v x y z qw qx qy qz` by name, in any order; without `x y z` of turns about the origin.

    delimiter: between columns. Raises InputError that names the line at fault.

    path: of the file.

    >>> net = sm.motions.smooth_net(6, spatial=True)
    >>> u, v = np.meshgrid(net.u.breakpoints, net.v.breakpoints, indexing="ij")
    >>> sm.files.write_tool_path(net, "tool.csv", u, v)
    >>> sm.files.read_tool_path("tool.csv").displacements.shape
    (16,)
    """
    wanted = (*PARAMETERS, *QUATERNION, *TRANSLATION)
    with readable(path) as handle:
        table = table_of(path, handle, delimiter, False)
        header = _header(table.header or ())
        # A table with some of x y z only is not one of turns.
        turns = () if set(TRANSLATION) & set(header) else (wanted[:6],)
        chosen = _present(path, header, "tool path", (wanted, *turns))
        numbers, lines = read_numbers(path, table.rows, [header.index(c) for c in chosen], len(header))
    real = numbers[:, 2:6]
    zero = np.linalg.norm(real, axis=1) == 0
    if zero.any():
        raise InputError(f"{path}, line {lines[int(np.argmax(zero))]}: the quaternion is zero")
    place = numbers[:, 6:] if len(chosen) > 6 else np.zeros((len(numbers), 3))
    return ToolPath(numbers[:, 0], numbers[:, 1], DualQuaternions.from_parts(real, place))


def read_matrix(path: FilePath) -> np.ndarray:
    """(n, m) the numbers of a table without names, a line for each row; InputError that names the line at fault."""
    with readable(path) as handle:
        table = table_of(path, handle, None, False)
        if (table.header is not None and not table.commented) or not table.first:
            raise InputError(f"{path}: a table of numbers alone is needed")
        return read_numbers(path, table.rows, range(len(table.first)), len(table.first))[0]


def write_tool_path(motion: TwoParameterMotion, path: FilePath, u: ArrayLike, v: ArrayLike) -> None:
    """Write the poses of a motion at parameters u and v that broadcast, unit quaternions, numbers exactly.

    path: of the file, written whole or not at all.

    Raises InputError where it cannot write.

    >>> net = sm.motions.smooth_net(6, spatial=True)
    >>> u, v = np.meshgrid(net.u.breakpoints, net.v.breakpoints, indexing="ij")
    >>> sm.files.write_tool_path(net, "tool.csv", u, v)
    """
    u, v = (np.array(x) for x in np.broadcast_arrays(checks.numbers(u, "u"), checks.numbers(v, "v")))
    there = motion(u.ravel(), v.ravel())
    pair = DualQuaternions.from_matrices(*there)
    table = np.column_stack([u.ravel(), v.ravel(), there.translation, pair.real])
    with whole_file(path) as handle:
        writer = csv.writer(handle, lineterminator="\n")
        writer.writerow((*PARAMETERS, *TRANSLATION, *QUATERNION))
        writer.writerows(table.tolist())


def _header(fields: Columns) -> list[str]:
    return [name.strip().lower() for name in fields]


def _present(path: FilePath, header: list[str], what: str, groups: tuple[Columns, ...]) -> tuple[str, ...]:
    """The first group that a header has all of; InputError that lists what there is."""
    for group in groups:
        if set(group) <= set(header):
            return tuple(group)
    known = {name for group in groups for name in group}
    found = ", ".join(name for name in header if name in known) or "none"
    raise InputError(
        f"{path}: of the columns ({shorten(', '.join(header), 200, placeholder=' …')}) {found} would be the {what}: "
        f"it takes {', or '.join(' '.join(group) for group in groups)}"
    )


def _from_euler(path: FilePath, angles: np.ndarray, convention: str, degrees: bool) -> np.ndarray:
    from scipy.spatial.transform import Rotation  # here: see as_rotations

    letters = CONVENTIONS.get(convention.lower(), convention) if isinstance(convention, str) else convention
    try:
        return Rotation.from_euler(letters, angles, degrees=degrees).as_quat()[:, [3, 0, 1, 2]]
    except (ValueError, TypeError, AttributeError):
        known = ", ".join(CONVENTIONS)
        raise InputError(f"{path}: convention {convention!r}: {known} or three letters such as ZXZ are known") from None


def _on_grid(
    path: FilePath, at: np.ndarray, values: np.ndarray, lines: "range | list[int] | ArrayLike", names: Columns
) -> np.ndarray:
    """(n, m, C) values (N, C) at places (N, 2) that make a whole grid; InputError for what is missing or double."""
    (rows, i), (columns, j) = (np.unique(x, return_inverse=True) for x in at.T)
    n, m = len(rows), len(columns)
    place = i * m + j
    counts = np.bincount(place, minlength=n * m)
    if (counts > 1).any():
        twice = np.flatnonzero(place == int(np.argmax(counts > 1)))
        one, two = np.asarray(lines)[twice[:2]]
        raise InputError(f"{path}: lines {one} and {two} are at one place of the grid")
    if (counts == 0).any():
        k, l = divmod(int(np.argmin(counts)), m)  # noqa: E741
        missing = int((counts == 0).sum())
        raise InputError(
            f"{path}: the grid of {n} × {m} lacks {missing} place{'s' * (missing > 1)}, first {names[0]} {rows[k]:g}, "
            f"{names[1]} {columns[l]:g}: fill them in, or leave whole rows out"
        )
    net = np.empty((n * m, values.shape[1]))
    net[place] = values
    return net.reshape(n, m, -1)
