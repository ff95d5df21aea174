"""Text tables: rows that know their line, under names where the file has them."""

import csv
import re
from array import array
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import chain, islice
from typing import TextIO

import numpy as np

from symmotion.errors import InputError
from symmotion.files.formats import FilePath
from symmotion.files.names import NO_UNIT, UNITS
from symmotion.files.numbers import finite
from symmotion.values import read_only

Rows = Iterator[tuple[int, list[str]]]  # the number of the line and its fields
Columns = Sequence[str]
COMMENTS = "#", "//", "% ", "%%"  # but %time is a column of ROS
REMEMBERED = 100  # comments above the rows, of which the last may name the columns
PART = 2**12  # rows that are made numbers at once
LONGEST = 10**6  # characters of a line of the first ones
DECIMAL_COMMA = re.compile(r"[-+]?\d*,\d+([eE][-+]?\d+)?|[-+]?\d+,")
# What else columns may lie between.
MARKS = {",": "commas", ";": "semicolons", "\t": "tabs", "|": "bars", ":": "colons", "/": "slashes", "_": "underscores"}
NOTHING = {"", "nan", "inf", "+inf", "-inf", "null", "none", "na", "n/a", "-"}


@dataclass(frozen=True)
class Table:
    """The rows of a text, each `width` fields long at its first one.

    header: the names of the columns, from the row before them or a comment above; None where there is none.
    commented: whether they stand in a comment, which may be about something else.
    line: of the header, else of the first row.
    """

    header: Columns | None
    commented: bool
    line: int
    first: list[str]
    rows: Rows


def table_of(path: FilePath, handle: TextIO, delimiter: str | None, quoted: bool) -> Table:
    """The table in a text; without a delimiter columns lie between commas, semicolons, tabs or blanks.

    quoted: whether fields may be quoted, and what follows a `#` inside a row belongs to it.
    """
    lines, comments, line, content = enumerate(handle, 1), [], 0, ""
    for line, text in lines:
        content = _uncommented(text, quoted).strip("\r\n ")
        if content.strip():
            break
        if text.lstrip().startswith(COMMENTS):
            comments = [*comments[-REMEMBERED:], (line, text[:LONGEST].strip().lstrip("#/%").strip())]
        content = ""
    if not content:
        return Table(None, False, max(line, 1), [], iter(()))
    between = delimiter or _delimiter(content)
    rows = _fields(path, chain([(line, content)], lines), between, quoted)
    number, first = next(rows, (line, []))
    if _named(first):
        head, (number, first) = (number, first), next(rows, (number, []))
        if len(first) == len(head[1]) and set(UNITS) & set(first) and all(u in UNITS or u in NO_UNIT for u in first):
            named = [f"{name} [{unit}]" if unit else name for name, unit in zip(head[1], first, strict=True)]
            head, (number, first) = (head[0], named), next(rows, (number, []))
        again = chain([(number, first)] if first else [], rows)
        return Table(head[1], False, head[0], first, again)
    for above, text in reversed(comments):
        names = _split(text, between if between else _delimiter(text))
        if len(names) == len(first) and _named(names):
            return Table(names, True, above, first, chain([(number, first)], rows))
    return Table(None, False, number, first, chain([(number, first)], rows))


def _uncommented(text: str, quoted: bool) -> str:
    if text.lstrip().startswith(COMMENTS):
        return ""
    return text if quoted else text.partition("#")[0]


def _fields(path: FilePath, lines: Iterable[tuple[int, str]], delimiter: str | None, quoted: bool) -> Rows:
    """The fields of every line that has any; a quoted field may go on over several lines."""
    if delimiter is None:
        for number, text in lines:
            if fields := _uncommented(text, quoted).split():
                yield number, fields
        return
    place = 0

    def texts() -> Iterator[str]:
        nonlocal place
        for number, text in lines:
            place = number
            yield _uncommented(text, quoted)

    reader = csv.reader(texts(), delimiter=delimiter, skipinitialspace=delimiter != " ")
    while True:
        try:
            row = next(reader, None)
        except csv.Error as error:
            raise InputError(f"{path}, line {place}: {error}") from None
        if row is None:
            return
        if any(field.strip() for field in row):
            # A delimiter at the end of every line makes no column, nor do blanks around one.
            yield place, row


def _split(text: str, delimiter: str | None) -> list[str]:
    return [word.strip() for word in text.split(delimiter)]


def _delimiter(line: str) -> str | None:
    """The one of semicolon, tab and comma that a line has most of; None, blanks, where it has none.

    Commas between digits are no delimiters beside blanks.
    """
    most = max(",;\t", key=line.count)
    if not line.count(most):
        return None
    if most == "," and line.count(";") == 0 and len(line.split()) > 1:
        words = line.split()
        if not any(word.endswith(",") or word.startswith(",") for word in words) and all(map(_is_number, words)):
            return None
    if ";" in line and most == "," and all(map(_is_number, filter(None, _split(line, ";")))):
        return ";"
    return most


def _named(fields: Sequence[str]) -> bool:
    """Whether fields are names: one that is no number to begin with, and few that are."""
    if not fields or _is_number(fields[0]):
        return False
    return 2 * sum(map(_is_number, fields)) < len(fields)


def _is_number(word: str) -> bool:
    word = word.strip()
    if DECIMAL_COMMA.fullmatch(word):
        return True
    try:
        float(word)
    except ValueError:
        return False
    return True


def number(word: str) -> float:
    """The number that a field is, with a decimal point or, where nothing else is between digits, comma."""
    try:
        return finite(word)
    except InputError:
        if DECIMAL_COMMA.fullmatch(word.strip()):
            return finite(word.strip().replace(",", "."))
        raise


def read_numbers(path: FilePath, rows: Rows, columns: Sequence[int], width: int) -> tuple[np.ndarray, np.ndarray]:
    """The chosen columns of all rows, each `width` fields long, as (M, C), and the line of each, (M,)."""
    numbers, lines = zip(*number_parts(path, rows, columns, width), strict=True)
    return np.concatenate(numbers), np.concatenate(lines)


def number_parts(
    path: FilePath,
    rows: Rows,
    columns: Sequence[int],
    width: int,
    lost: bool | None = None,
    special: Callable[[list[str]], float] | None = None,
) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """As `read_numbers`, PART rows at once.

    lost: whether fields that are empty or not finite become NaN; None where no such are known. special: makes a number
    in front, of a row's fields.
    """
    count = len(columns) + (special is not None)
    number = 0
    while True:
        numbers, lines = array("d"), array("q")
        for line, fields in islice(rows, PART):
            if len(fields) != width and not (len(fields) == width + 1 and not fields[-1].strip()):
                raise InputError(f"{path}, line {line}: {len(fields)} columns, not {width}{advice(fields)}")
            try:
                if special is not None:
                    numbers.append(special(fields))
                if lost:
                    numbers.extend(_or_nothing(fields[column]) for column in columns)
                else:
                    numbers.extend(_plainly(fields, columns))
            except InputError as error:
                void = lost is False and any(fields[column].strip().lower() in NOTHING for column in columns)
                remedy = "; lost='drop' leaves such rows out" if void else ""
                raise InputError(f"{path}, line {line}: {error}{remedy}") from None
            lines.append(line)
        if not lines:
            if number == 0:
                raise InputError(f"{path}: holds no keyframes")
            return
        number += len(lines)
        yield np.frombuffer(numbers).reshape(-1, count), np.frombuffer(lines, np.int64)


class Growing:
    """An array (N, …) to which parts are added in place: they are never there twice."""

    def __init__(self, *shape: int):
        self._rows, self._count = np.empty((PART, *shape)), 0

    def add(self, part: np.ndarray) -> None:
        count = self._count + len(part)
        if count > len(self._rows):
            self._rows.resize((count + count // 8, *self._rows.shape[1:]), refcheck=False)
        self._rows[self._count : count] = part
        self._count = count

    def whole(self) -> np.ndarray:
        """All that was added, writes refused; nothing is added any more."""
        self._rows.resize((self._count, *self._rows.shape[1:]), refcheck=False)
        return read_only(self._rows)


def _plainly(fields: Sequence[str], columns: Sequence[int]) -> list[float]:
    """The numbers of some fields: almost all have a point, and cost no more than that."""
    try:
        return [finite(fields[column]) for column in columns]
    except InputError:
        return [number(fields[column]) for column in columns]


def advice(fields: Sequence[str]) -> str:
    """What may be between the numbers of a row that is one field; nothing where it is more."""
    if len(fields) != 1:
        return ""
    most = max(MARKS, key=fields[0].count)
    return f"; are they between {MARKS[most]}? give delimiter={most!r}" if most in fields[0] else ""


def _or_nothing(word: str) -> float:
    return np.nan if word.strip().lower() in NOTHING else number(word)


def beginning(handle: TextIO, lines: int) -> list[str]:
    """The first lines of a text, which is then at its beginning again."""
    found = [line[:LONGEST] for line in islice(iter(lambda: handle.readline(LONGEST), ""), lines)]
    handle.seek(0)
    return found
