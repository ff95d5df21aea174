"""Motions and curves as JSON, exactly: the half that writes, which every class has as its method `save`."""

import json
import os
from collections.abc import Mapping
from dataclasses import fields, is_dataclass

import numpy as np

from symmotion.errors import InputError
from symmotion.whole import whole_file

# What makes a file one of ours, and the version of how its entries are laid out.
MARK = {"symmotion": "value", "version": 1}
# What is told of a motion, beside its fields.
TOLD = "solution"

Entry = str | bool | int | float | list | dict | None


def save(self: object, path: str | os.PathLike[str]) -> None:
    """Write this as JSON, from which `load` makes one that is equal to it, bit for bit.

    {"symmotion": "value", "version": 1, "class": …} and the fields by name: arrays as nested lists,
    what is itself made of fields as such an object. The file appears whole or not at all.

    Raises InputError that names a field which is not finite, or no data, and a path that cannot be written.
    """
    save_beside(self, path, {})


def save_beside(value: object, path: str | os.PathLike[str], beside: Mapping[str, object]) -> None:
    """Write a motion or curve as `save` does, and beside it what is told of it, which `load` leaves alone.

    beside: under TOLD; of numbers, texts, arrays, and lists and mappings of them. What is not finite becomes null.
    """
    document = {**MARK, **_fields(value, type(value).__name__, str(path))}
    told = {TOLD: _told(beside)} if beside else {}
    with whole_file(path) as handle:
        handle.write(json.dumps({**document, **told}, allow_nan=False) + "\n")


def _told(value: object) -> object:
    if isinstance(value, np.ndarray | np.generic):
        return _told(value.tolist())
    if isinstance(value, Mapping):
        return {str(name): _told(entry) for name, entry in value.items()}
    if isinstance(value, tuple) and hasattr(value, "_asdict"):
        return _told(value._asdict())  # pyright: ignore[reportAttributeAccessIssue]
    if isinstance(value, list | tuple):
        return [_told(entry) for entry in value]
    return None if isinstance(value, float) and not np.isfinite(value) else value


def _fields(value: object, where: str, path: str) -> dict[str, Entry]:
    if not is_dataclass(value):
        raise InputError(f"{path}: {where} is a {type(value).__name__}: code and data of your own cannot be saved")
    entries = {f.name: _entry(getattr(value, f.name), f"{where}.{f.name}", path) for f in fields(value)}
    return {"class": type(value).__name__, **entries}


def _entry(value: object, where: str, path: str) -> Entry:
    if isinstance(value, np.ndarray):
        if not np.isfinite(value).all():
            raise InputError(f"{path}: {where} has an entry that is not finite")
        return value.tolist()
    if isinstance(value, tuple):
        return [_entry(v, f"{where}[{i}]", path) for i, v in enumerate(value)]
    if isinstance(value, float) and not np.isfinite(value):
        raise InputError(f"{path}: {where} is not finite")
    if value is None or isinstance(value, str | bool | int | float):
        return value
    return _fields(value, where, path)
