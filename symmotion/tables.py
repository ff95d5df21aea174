"""Tables as plain data that pickles, and their cells as a reader wants them."""

import math
import re
from dataclasses import dataclass

import numpy as np

from symmotion.brief import in_a_line
from symmotion.errors import InputError

Cell = str | int | float | bool | None
# A time is far from 0 where it is so many times as large as the span of all: seconds from 1970 are.
FAR = 100.0
MEASURED = ("ms", "µs", "ns", "kB", "MB")  # seconds may be a motion's times


@dataclass(frozen=True)
class Column:
    """A table column's heading and the unit of its numbers.

    >>> sm.report.Column("height", "mm")
    Column(name='height', unit='mm')
    """

    name: str
    unit: str = ""

    __repr__ = in_a_line

    @property
    def digits(self) -> int:
        """How many significant digits a reader is shown: times and memory that were measured have three."""
        return 3 if self.unit in MEASURED else 5


@dataclass(frozen=True)
class Table:
    """Rows of text, numbers, truth values or None (missing), one cell per column; NumPy scalars become plain ones.

    Raises InputError for rows of other lengths than the columns.

    >>> from symmotion.report import Column, Table
    >>> Table("heights", (Column("name"), Column("h", "mm")), (("a", 1.5), ("b", None))).numeric
    (False, True)
    """

    name: str
    columns: tuple[Column, ...]
    rows: tuple[tuple[Cell, ...], ...]
    caption: str = ""

    def __repr__(self) -> str:
        return f"Table({self.name!r}, {len(self.rows)} rows of {', '.join(c.name for c in self.columns)})"

    def __post_init__(self):
        rows = tuple(tuple(c.item() if isinstance(c, np.generic) else c for c in row) for row in self.rows)
        for i, row in enumerate(rows):
            if len(row) != len(self.columns):
                raise InputError(f"table {self.name!r}, row {i}: {len(row)} cells for {len(self.columns)} columns")
            for cell in row:
                if not isinstance(cell, str | int | float | None):
                    raise InputError(f"table {self.name!r}, row {i}: a cell cannot be a {type(cell).__name__}")
        object.__setattr__(self, "columns", tuple(self.columns))
        object.__setattr__(self, "rows", rows)

    @property
    def numeric(self) -> tuple[bool, ...]:
        """Per column, whether it holds numbers only, missing ones aside."""
        cells = ([row[k] for row in self.rows if row[k] is not None] for k in range(len(self.columns)))
        return tuple(all(isinstance(c, int | float) and not isinstance(c, bool) for c in column) for column in cells)


def start_of(times: np.ndarray) -> float:
    """What times are told from: the first one where 0 is far away, as from recordings in seconds from 1970, else 0."""
    return float(times[0]) if abs(times[0]) > FAR * abs(times[-1] - times[0]) > 0 else 0.0


def shown(value: Cell, digits: int = 5) -> str:
    """A table cell as a reader wants it: numbers to some significant digits, a dash for what is missing."""
    if value is None or (isinstance(value, float) and not math.isfinite(value)):
        return "–"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if not isinstance(value, float):
        return str(value)
    whole = 10**digits <= abs(value) < 10 ** (digits + 3)
    return re.sub(r"e([+-])0*", lambda e: "e" + e[1].strip("+"), f"{value:.0f}" if whole else f"{value:.{digits}g}")
