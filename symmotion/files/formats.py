"""What a file format is: a row with its endings, what it holds, what reads and writes it, and with which options."""

import os
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any, Literal, TypeVar, get_args

from symmotion import checks
from symmotion.brief import in_a_line
from symmotion.errors import InputError
from symmotion.files.recording import Recording
from symmotion.motions import Keyframes
from symmotion.whole import whole_files

FilePath = str | os.PathLike[str]
Holds = Literal["keyframes", "motion", "scene", "film", "mesh", "net", "skeleton"]
Way = Literal["read", "write"]


@dataclass(frozen=True)
class Option:
    """What a reader or writer can be told; name: of its keyword; meaning: one line.

    of_text: makes its value of a word, for the command line, bool where it is a flag without one,
    None where words cannot say it; default: what leaving it out means, None where the format
    decides; check: from a value and its name to the value, or an InputError.

    >>> row = next(row for row in sm.files.FORMATS if row.name == "tum" and row.holds == "keyframes")
    >>> "lost" in [option.name for option in row.reading]
    True
    """

    name: str
    meaning: str
    of_text: Callable[[str], object] | None = None
    default: object = None
    check: Callable[[Any, str], object] | None = None  # Any: a value of the option's own kind

    __repr__ = in_a_line


@dataclass(frozen=True)
class Format:
    """A row of the table of formats.

    name; endings: without the dot; holds: what a file of it is, "keyframes", "motion" (exactly or
    in samples), "scene" and "film" (a motion to be looked at), "mesh", "net" (a two-parameter
    motion) or "skeleton"; help: one line.
    read: from a path to that; write: from that and a path, to what is to be said of the file or
    None; each takes its options, `reading` and `writing`, as keywords, and is None where the format
    is not read or written.
    claims: of formats that share an ending, whether the file at a path is of this one.
    check: what can be refused before there is anything to write, from a path and the options of `write`.
    whole: whether `write` itself leaves a whole file or none; of others what they write is moved in place at the end.

    Raises InputError for an ending or a content that it cannot have.

    >>> rows = [row for row in sm.files.FORMATS if "tum" in row.endings]
    >>> [row.holds for row in rows]
    ['keyframes', 'motion']
    """

    name: str
    endings: tuple[str, ...]
    holds: Holds
    help: str
    read: Callable[..., object] | None = None
    write: Callable[..., object] | None = None
    reading: tuple[Option, ...] = ()
    writing: tuple[Option, ...] = ()
    claims: Callable[[FilePath], bool] | None = None
    check: Callable[..., object] | None = None
    whole: bool = False

    __repr__ = in_a_line

    def __post_init__(self):
        checks.choice(self.holds, get_args(Holds), f"format {self.name}: holds")
        endings = self.endings
        if not isinstance(endings, tuple) or not endings or any(e != e.lower() or "." in e or not e for e in endings):
            raise InputError(f"format {self.name}: endings {endings!r}: a tuple as ('tum',), without dots, is needed")
        if not all(f is None or callable(f) for f in (self.read, self.write)) or self.read is self.write is None:
            raise InputError(f"format {self.name}: a function that reads it, or one that writes it, is needed")

    def options(self, way: Way) -> tuple[Option, ...]:
        """What can be said when a file is read, or written."""
        return self.reading if way == "read" else self.writing


def rows(formats: Iterable[Format], way: Way, *holds: Holds) -> tuple[Format, ...]:
    """The rows that can be read, or written, and hold one of these; InputError unless they are rows."""
    table = tuple(formats) if isinstance(formats, Iterable) else ()
    if not isinstance(formats, Iterable) or not all(isinstance(row, Format) for row in table):
        raise InputError(f"formats {checks.told(formats)}: a table is needed, (*symmotion.files.FORMATS, mine)")
    return tuple(row for row in table if row.holds in holds and getattr(row, way) is not None)


def endings(among: Iterable[Format]) -> tuple[str, ...]:
    """The endings of these rows, each once."""
    return tuple(dict.fromkeys(ending for row in among for ending in row.endings))


def takers(option: str, way: Way, among: Iterable[Format]) -> tuple[str, ...]:
    """The endings of the rows that take an option."""
    return endings(row for row in among if any(option == known.name for known in row.options(way)))


def format_of(path: FilePath, format: str | None, formats: Sequence[str]) -> str:
    """The format given, else the one that the ending of `path` names; InputError unless it is one of `formats`.

    An ending .gz is of what is packed: the one before it counts.
    """
    named = Path(checks.file_path(path))
    ending = (Path(named.stem) if named.suffix.lower() == ".gz" else named).suffix.lower().removeprefix(".")
    chosen = ending if format is None else format
    if chosen not in formats:
        if format is None and Path(path).is_dir():
            raise InputError(f"{path}: is a directory; name a file in it")
        raise InputError(f"{path}: format {chosen!r} is unknown; there are {', '.join(formats)}")
    return chosen


def rows_of(path: FilePath, among: Sequence[Format], format: str | None = None) -> list[Format]:
    """The rows of the format given, by name or ending, else of the path's ending; InputError where there is none."""
    named = [row for row in among if format is not None and row.name == format]
    if named:
        return named
    chosen = format_of(path, format, endings(among))
    return [row for row in among if chosen in row.endings]


def row_of(path: FilePath, among: Sequence[Format], format: str | None = None) -> Format:
    """The row of the format given, else of the path's ending; InputError where there is none, or more than one.

    Of several that share an ending the one that claims the file, else the one that claims none.
    """
    found = rows_of(path, among, format)
    if len(found) > 1 and any(row.claims is not None for row in found):
        there = Path(path).is_file()
        claiming = [row for row in found if there and row.claims is not None and row.claims(path)]
        found = claiming or [row for row in found if row.claims is None] or found[:1]
    if len(found) > 1:
        names = " and ".join(row.name for row in found)
        raise InputError(f"{path}: the formats {names} have the same ending: leave all but one of them out")
    return found[0]


def keywords(
    path: FilePath, row: Format, way: Way, given: Mapping[str, object], among: Sequence[Format]
) -> dict[str, object]:
    """The options that are given, neither None nor False, checked; InputError for one that the row does not take.

    among: the rows that could have been meant, of which the message names those that take it.
    """
    known = {option.name: option for option in row.options(way)}
    said = {name: value for name, value in given.items() if value is not None and value is not False}
    for name in said:
        if name not in known:
            others = ", ".join(takers(name, way, among))
            raise InputError(
                f"{path}: {row.name} has no {name}: " + (f"it goes with {others}" if others else "leave it out")
            )
    return {name: v if (check := known[name].check) is None else check(v, name) for name, v in said.items()}


def require_order(value: object, path: object, door: str, what: str, kind: type | None = None) -> None:
    """Raise InputError unless `value` is of the kind that the door takes, and the path behind it is one."""
    paths = (str, bytes, os.PathLike)
    if isinstance(value, paths) and not isinstance(path, paths):
        raise InputError(f"{door} takes {what} first and the path second: they are swapped")
    if kind is not None and not isinstance(value, kind):
        raise InputError(f"{door} takes {what} ({kind.__name__}): a {type(value).__name__} is none")
    checks.file_path(path, f"the path given to {door},")


Kind = TypeVar("Kind")


def read_file(
    path: FilePath,
    kind: type[Kind],
    formats: Iterable[Format],
    *holds: Holds,
    format: str | None = None,
    options: Mapping[str, object] = MappingProxyType({}),
) -> Kind:
    """What a file holds, one of these and of a kind, read by its row with those of the options that are given."""
    among = rows(formats, "read", *holds)
    row = row_of(path, among, format)
    assert row.read is not None
    with _named(path, f"cannot be read as {row.name}"):
        found = _asked(row.read(path, **keywords(path, row, "read", options, among)), kind)
    if not isinstance(found, kind):
        wanted = Keyframes if kind is Recording else kind
        raise InputError(f"{path}: {row.name} reads a {type(found).__name__}: {wanted.__name__} is needed")
    return found


def _asked(found: object, kind: type) -> object:
    """Keyframes may come with notes, which who asks for a Recording gets, and who asks for Keyframes does not."""
    if kind is Keyframes and isinstance(found, Recording):
        return found.keyframes
    return Recording(found) if kind is Recording and isinstance(found, Keyframes) else found


@contextmanager
def _named(path: FilePath, failing: str) -> Iterator[None]:
    """An InputError that names the file, of whatever a reader or writer of the user's own raises inside."""
    try:
        yield
    except InputError:
        raise
    except Exception as error:
        raise InputError(f"{path}: {failing}: {type(error).__name__}: {error}") from error


# Any: the doors, `write_motion` and its like, say of what type the answer is.
def write_file(
    value: object,
    path: FilePath,
    formats: Iterable[Format],
    *holds: Holds,
    format: str | None = None,
    options: Mapping[str, object] = MappingProxyType({}),
) -> Any:
    """Write a value by the row of a format that holds one of these; returns what the writer says of the file."""
    among = rows(formats, "write", *holds)
    row = row_of(path, among, format)
    assert row.write is not None
    given = keywords(path, row, "write", options, among)
    if row.whole:
        return row.write(value, path, **given)
    with _named(path, f"cannot be written as {row.name}"), whole_files(path) as part:
        return row.write(value, part, **given)
