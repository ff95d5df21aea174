"""JSON documents: objects with the entries expected, and lists of numbers as arrays."""

import json
from collections.abc import Callable, Sequence

import numpy as np

from symmotion.documents import Document, read_document
from symmotion.errors import InputError
from symmotion.files.formats import FilePath
from symmotion.opening import readable_bytes
from symmotion.whole import whole_file

PART = 4096  # items of a list that are made an array at once


def write_object(path: FilePath, document: Document) -> None:
    """Write a JSON object, arrays as nested lists, numbers so that they come back exactly."""
    with whole_file(path) as handle:
        handle.write(json.dumps(document, default=np.ndarray.tolist) + "\n")


def entries_of(path: FilePath) -> Document:
    """The JSON object in a file of that name, its numbers as floats, long lists of them as arrays."""
    with readable_bytes(path) as handle:
        return read_document(path, handle.read())


def outline_of(path: FilePath) -> Document:
    """What `entries_of` returns, with nothing in the place of long lists of numbers."""
    with readable_bytes(path) as handle:
        return read_document(path, handle.read(), outline=True)


def require_entries(path: FilePath, document: Document, needed: Sequence[str], optional: Sequence[str] = ()) -> None:
    """Raise InputError unless all `needed` entries are there and none is unknown, since that may be one misspelt."""
    missing = [name for name in needed if name not in document]
    unknown = [name for name in document if name not in (*needed, *optional)]
    if missing or unknown:
        faults = [f"{word} {', '.join(names)}" for word, names in (("missing", missing), ("unknown", unknown)) if names]
        raise InputError(f"{path}: {'; '.join(faults)} (the entries are {', '.join((*needed, *optional))})")


def read_list(path: FilePath, document: Document, name: str) -> np.ndarray:
    """An entry that lists M numbers, or M nested lists of one shape, as (M, …); InputError names the item at fault."""
    items = document[name]
    if isinstance(items, np.ndarray):
        return _floats(f"{path}, {name}", items)
    if not isinstance(items, list) or not items:
        raise InputError(f"{path}, {name}: a list is needed")
    return stacked(items, lambda i: f"{path}, {name}[{i}]")


def stacked(items: list, place: Callable[[int], str]) -> np.ndarray:
    """(M, …) of M numbers, or M nested lists of one shape; InputError names the place of the item at fault."""
    shape = _floats(place(0), items[0]).shape
    parts = []
    for begin in range(0, len(items), PART):
        part = items[begin : begin + PART]
        try:
            parts.append(_floats("", part, (len(part), *shape)))
        except InputError:  # which item it is, is told below
            parts += [_floats(place(begin + i), item, shape)[None] for i, item in enumerate(part)]
    return np.concatenate(parts)


def _floats(where: str, value: object, shape: tuple[int, ...] | None = None) -> np.ndarray:
    try:
        numbers = np.asarray(value)
    except ValueError:  # lists of different lengths
        numbers = None
    if numbers is None or numbers.dtype != float:
        raise InputError(f"{where}: numbers are needed, in lists of equal lengths")
    if not np.isfinite(numbers).all():
        raise InputError(f"{where}: a number is not finite")
    if shape is not None and numbers.shape != shape:
        raise InputError(f"{where}: shape {numbers.shape} where {shape} is needed")
    return numbers
