"""JSON documents, their long lists of numbers read as arrays: a number of Python's takes ten times its text."""

import json
import re
from collections.abc import Callable
from functools import lru_cache
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from symmotion.errors import InputError
from symmotion.opening import FilePath
from symmotion.values import read_only

Document: TypeAlias = dict[str, Any]  # of JSON

LONG = 4096  # bytes of a list of numbers that becomes an array
DEEPEST = 6
PART = 2**20  # bytes of a list that are made numbers at once
MARK = b"NaN"  # stands for an array in what is left of a text: the one constant that is told in order

# Possessive throughout: each is found, or not, in one pass.
BLANK = rb"[ \t\n\r]*+"
NUMBER = rb"-?+(?:0|[1-9][0-9]*+)(?:\.[0-9]++)?+(?:[eE][-+]?+[0-9]++)?+"
OUTSIDE = re.compile(rb'(?:[^"\[]++|"(?:[^"\\]++|\\.)*+")*+', re.DOTALL)  # up to a bracket that is in no string
NUMERIC = re.compile(rb"[-+.,0-9eE\[\] \t\n\r]++")
OPENING = re.compile(rb"(?:\[" + BLANK + rb")++")


class Cut(NamedTuple):
    """A list of numbers in a text: the bytes begin:end, and the shape of its array.

    shape: None of the items that are alike at the beginning of a list of which others are not.
    """

    begin: int
    end: int
    shape: tuple[int, ...] | None

    @property
    def mark(self) -> bytes:
        """What stands in its place."""
        return b"" if self.shape is None else MARK


def read_document(
    path: FilePath, data: bytes, *, whole: Callable[[str], float] = float, arrays: bool = True, outline: bool = False
) -> Document:
    """The JSON object in a text, its long lists of numbers as arrays that refuse writes.

    whole: makes whole numbers of their digits. arrays: whether lists become arrays. outline: leave them out, None in
    their place. Raises InputError that names the line at fault.
    """
    # Where the constant stands in the text itself, arrays could not be told from it.
    cuts = _long_lists(data) if arrays and MARK not in data else []
    document = _document(path, data, cuts, whole, outline)
    if any(cut.shape is None for cut in cuts):  # lists of unlike items, but no slip in the text
        document = _document(path, data, [cut for cut in cuts if cut.shape is not None], whole, outline)
    if not isinstance(document, dict):
        raise InputError(f"{path}: a JSON object, {{…}}, is needed")
    return document


def _document(path: FilePath, data: bytes, cuts: list[Cut], whole: Callable[[str], float], outline: bool) -> object:
    """What a text stands for, arrays in the place of what is cut out of it."""
    left = _without(data, cuts)
    made = (None if outline else _array(data, cut) for cut in cuts if cut.shape is not None)
    constant = (lambda _: next(made)) if MARK in left and MARK not in data else float
    number = lru_cache(LONG)(float)  # most of what is left is short, and repeats
    try:
        return json.loads(
            left.decode("utf-8-sig"),
            parse_int=number if whole is float else whole,
            parse_float=number,
            parse_constant=constant,
        )
    except json.JSONDecodeError as error:
        line, column = _place(data, left, cuts, error)
        raise InputError(f"{path}, line {line}, column {column}: {error.msg}") from None
    except RecursionError:
        raise InputError(f"{path}: its lists are nested too deeply") from None


def _without(data: bytes, cuts: list[Cut]) -> bytes:
    begin, left = 0, []
    for cut in cuts:
        left += data[begin : cut.begin], cut.mark
        begin = cut.end
    return b"".join([*left, data[begin:]])


def _long_lists(data: bytes) -> list[Cut]:
    """The lists of numbers of LONG bytes and more, nested ones of a shape; what is none of these is left alone."""
    found, at = [], 0
    while True:
        outside = OUTSIDE.match(data, at)
        at = len(data) if outside is None else outside.end()
        if data[at : at + 1] != b"[":
            return found
        numeric = NUMERIC.match(data, at)
        end = at + 1 if numeric is None else numeric.end()
        cut = _list_at(data, at) if end - at >= LONG else None
        if cut is not None and cut.end - cut.begin >= LONG:
            found.append(cut)
        at = end if cut is None else cut.end


def _list_at(data: bytes, at: int) -> Cut | None:
    """The list of numbers, or of lists of one shape, that begins at a bracket, else what it begins with; or None."""
    opening = OPENING.match(data, at)
    brackets = opening.group().count(b"[") if opening else 0
    if not 0 < brackets <= DEEPEST:
        return None
    begins = [at]
    while len(begins) < brackets:
        begins.append(data.index(b"[", begins[-1] + 1))
    item, size, shape, end = NUMBER, 1, [], at
    for begin in reversed(begins):
        found = re.compile(_list(item, b"*+")).match(data, begin)
        if found is None:
            alike = re.compile(BLANK + _followed(item) + b"*+").match(data, begin + 1)
            return None if alike is None else Cut(begin + 1, alike.end(), None)
        end = found.end()
        shape.insert(0, (data.count(b",", begin, end) + 1) // size)
        size *= shape[0]
        item = _list(item, b"{%d}+" % (shape[0] - 1))
    return Cut(at, end, tuple(shape))


def _list(item: bytes, times: bytes) -> bytes:
    """The expression for a list of an item, behind as many others."""
    return rb"\[" + BLANK + _followed(item) + times + item + BLANK + rb"\]"


def _followed(item: bytes) -> bytes:
    return rb"(?:" + item + BLANK + rb"," + BLANK + rb")"


def _array(data: bytes, cut: Cut) -> np.ndarray:
    assert cut.shape is not None
    numbers = np.empty(cut.shape)
    flat, begin, done = numbers.reshape(-1), cut.begin, 0
    while begin < cut.end:
        end = data.find(b",", begin + PART, cut.end)
        end = cut.end if end < 0 else end
        part = np.fromstring(data[begin:end].translate(None, b"[] \t\n\r"), sep=",")
        flat[done : done + len(part)] = part
        begin, done = end + 1, done + len(part)
    return read_only(numbers)


def _place(data: bytes, left: bytes, cuts: list[Cut], error: json.JSONDecodeError) -> tuple[int, int]:
    """Line and column in the text of an error in what is left of it."""
    at, shift = len(error.doc[: error.pos].encode()) + len(left) - len(error.doc.encode()), 0
    for cut in cuts:
        if cut.begin - shift + len(cut.mark) > at:
            break
        shift += cut.end - cut.begin - len(cut.mark)
    lines = re.split("\r\n?|\n", data[: at + shift].decode("utf-8-sig"))
    return len(lines), len(lines[-1]) + 1
