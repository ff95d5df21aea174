"""Tables as plain data that pickles, and their cells as a reader wants them."""

import math
import re
from dataclasses import dataclass

import numpy as np

from symmotion.brief import in_a_line
from symmotion.errors import InputError

Cell = str | int | float | bool | None  # of a table; None is missing
MEASURED = ("ms", "µs", "ns", "kB", "MB")  # seconds may be a motion's times


@dataclass(frozen=True)
class Column:
    """A table column's heading and the unit of its numbers.

    end: whether these are the ends, lower or upper, of an interval around the column before them, where readers are
    shown them, in brackets.

    >>> sm.report.Column("height", "mm")
    Column(name='height', unit='mm')
    """

    name: str
    unit: str = ""
    end: bool = False

    __repr__ = in_a_line

    @property
    def digits(self) -> int:
        """How many significant digits a reader is shown: times and memory that were measured have three."""
        return 3 if self.unit in MEASURED else 5


@dataclass(frozen=True)
class Table:
    """Rows of text, numbers, truth values or None (missing), one cell per column; NumPy scalars become plain ones.

    name: one of its own in a study; caption: above it.

    Raises InputError for rows of other lengths than the columns, and for ends of intervals in the first one.

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
        if self.columns and self.columns[0].end:
            raise InputError(f"table {self.name!r}: its first column is the end of no interval")
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

    @property
    def parts(self) -> tuple[tuple[int, ...], ...]:
        """The columns as a reader is shown them: the place of each, with those of the ends of its interval."""
        first = [k for k, column in enumerate(self.columns) if not column.end]
        return tuple(tuple(range(a, b)) for a, b in zip(first, [*first[1:], len(self.columns)], strict=True))

    def shown(self, row: tuple[Cell, ...], part: tuple[int, ...]) -> str:
        """What stands in a row under one of the `parts`: "77.8 (45.3–93.7)"."""
        k, *ends = part
        if not ends or row[k] is None:
            return shown(row[k], self.columns[k].digits)
        value, *around = (shown(row[j], 3) for j in part)
        return f"{value} ({'–'.join(around)})"


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
