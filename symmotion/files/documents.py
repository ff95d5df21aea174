"""JSON documents: objects with the entries expected, and lists of numbers as arrays."""

import json
from collections.abc import Sequence
from typing import Any, TextIO, TypeAlias

import numpy as np

from symmotion.errors import InputError
from symmotion.files.formats import FilePath
from symmotion.opening import readable
from symmotion.whole import whole_file

Document: TypeAlias = dict[str, Any]  # of JSON


def read_object(path: FilePath, handle: TextIO) -> Document:
    """The JSON object in a file, its numbers as floats."""
    try:
        document = json.load(handle, parse_int=float)
    except json.JSONDecodeError as error:
        raise InputError(f"{path}, line {error.lineno}, column {error.colno}: {error.msg}") from None
    except RecursionError:
        raise InputError(f"{path}: its lists are nested too deeply") from None
    if not isinstance(document, dict):
        raise InputError(f"{path}: a JSON object, {{…}}, is needed")
    return document


def write_object(path: FilePath, document: Document) -> None:
    """Write a JSON object, arrays as nested lists, numbers so that they come back exactly."""
    with whole_file(path) as handle:
        handle.write(json.dumps(document, default=np.ndarray.tolist) + "\n")


def entries_of(path: FilePath) -> Document:
    """The JSON object in a file of that name, its numbers as floats."""
    with readable(path) as handle:
        return read_object(path, handle)


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
    if not isinstance(items, list) or not items:
        raise InputError(f"{path}, {name}: a list is needed")
    try:
        return _floats(name, items)
    except InputError:
        pass  # which item it is, is told below: arrays of each would take several times the memory
    shape = _floats(f"{path}, {name}[0]", items[0]).shape
    return np.array([_floats(f"{path}, {name}[{i}]", item, shape) for i, item in enumerate(items)])


def _floats(where: str, value: object, shape: tuple[int, ...] | None = None) -> np.ndarray:
    try:
        numbers = np.array(value)
    except ValueError:  # lists of different lengths
        numbers = None
    if numbers is None or numbers.dtype != float:
        raise InputError(f"{where}: numbers are needed, in lists of equal lengths")
    if not np.isfinite(numbers).all():
        raise InputError(f"{where}: a number is not finite")
    if shape is not None and numbers.shape != shape:
        raise InputError(f"{where}: shape {numbers.shape} where {shape} is needed")
    return numbers
