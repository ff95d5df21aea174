"""Text tables: rows that know their line, and named columns."""

import csv
from array import array
from collections.abc import Iterator, Sequence
from textwrap import shorten
from typing import TextIO

import numpy as np

from symmotion.errors import InputError
from symmotion.files.formats import FilePath
from symmotion.files.numbers import finite

Rows = Iterator[tuple[int, list[str]]]  # the number of the line and its fields
Columns = Sequence[str]


def plain_rows(handle: TextIO, delimiter: str | None) -> Rows:
    """Every line that is not blank or a `#` comment, split at the delimiter or, without one, at whitespace."""
    for number, line in enumerate(handle, 1):
        if content := line.partition("#")[0].strip():
            yield number, content.split(delimiter)


def csv_rows(path: FilePath, handle: TextIO, delimiter: str | None) -> Rows:
    """Every row; without a delimiter, of comma, semicolon and tab the one that the first line has most of."""
    delimiter = delimiter or max(",;\t", key=handle.readline().count)
    handle.seek(0)
    reader = csv.reader(handle, delimiter=delimiter)
    try:
        for row in reader:
            if row:
                yield reader.line_num, row
    except csv.Error as error:
        raise InputError(f"{path}, line {reader.line_num}: {error}") from None


def choose_columns(
    path: FilePath, header: Columns, what: str, groups: Sequence[Columns], family: Sequence[Columns] = ()
) -> Columns:
    """The one of `groups` that the header has; InputError if it has another column of them, or of `family`, too."""
    known = {name for group in (*groups, *family) for name in group}
    present = [name for name in header if name in known]
    for group in groups:
        if sorted(group) == sorted(present):
            return group
    raise InputError(
        f"{path}: of the columns ({shorten(', '.join(header), 200, placeholder=' …')}) "
        f"{', '.join(present) or 'none'} would be the {what}: "
        f"it takes exactly {', or '.join(' '.join(group) or 'none' for group in groups)}"
    )


def read_numbers(path: FilePath, rows: Rows, columns: Sequence[int], width: int) -> tuple[np.ndarray, Sequence[int]]:
    """The chosen columns of all rows, each `width` fields long, as (M, C), and the line of each, (M,)."""
    numbers, lines = array("d"), array("q")
    for line, fields in rows:
        if len(fields) != width:
            raise InputError(f"{path}, line {line}: {len(fields)} columns, not {width}")
        try:
            numbers.extend(finite(fields[column]) for column in columns)
        except InputError as error:
            raise InputError(f"{path}, line {line}: {error}") from None
        lines.append(line)
    if not lines:
        raise InputError(f"{path}: holds no keyframes")
    return np.frombuffer(numbers).reshape(-1, len(columns)), lines
