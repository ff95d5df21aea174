"""Frozen dataclasses as values: equal where their contents are, hashed by them, pickled without what they derived."""

from collections.abc import Callable, Hashable, Mapping
from dataclasses import dataclass, fields, is_dataclass
from functools import wraps
from numbers import Real
from typing import Any, TypeVar, dataclass_transform

import numpy as np

Made = TypeVar("Made")


@dataclass_transform(frozen_default=True, eq_default=False)
def value(cls: type[Made]) -> type[Made]:
    """The class as a frozen dataclass whose instances are values.

    Two are equal where they are of one class and their fields are, arrays entry by entry and
    exactly, with NaN equal to NaN. The hash is made of arrays, numbers, texts and other values;
    of anything else, an object of the user's say, only of its type: it is never hashed itself.
    A pickle holds the fields alone, and arrays that come out of it refuse writes.
    """
    made: Any = dataclass(frozen=True, eq=False)(cls)  # Any: methods are set on it, which no type allows
    made.__eq__, made.__hash__ = _equal, _hash
    made.__getstate__, made.__setstate__ = _state, restore
    made.__is_value__ = True
    return made


def same(a: object, b: object) -> bool:
    """Whether two contents are equal, arrays entry by entry."""
    if a is b:
        return True
    if isinstance(a, np.ndarray) or isinstance(b, np.ndarray):
        x, y = np.asarray(a), np.asarray(b)
        return x.shape == y.shape and bool(np.array_equal(x, y, equal_nan=x.dtype.kind == y.dtype.kind == "f"))
    if isinstance(a, tuple | list) and isinstance(b, tuple | list):
        return len(a) == len(b) and all(same(x, y) for x, y in zip(a, b, strict=True))
    if isinstance(a, Mapping) and isinstance(b, Mapping):
        return a.keys() == b.keys() and all(same(a[key], b[key]) for key in a)
    # The == that a dataclass makes of its own compares tuples, in which arrays have no truth value.
    parameters = getattr(type(a), "__dataclass_params__", None)
    return same_fields(a, b) if parameters is not None and parameters.eq else (a == b) is True


class _Kept:
    """Keeps the memory of an array for others to read: what NumPy makes of it cannot be made writeable."""

    __slots__ = ("__array_interface__", "array")

    def __init__(self, array: np.ndarray):
        self.array = array
        interface = array.__array_interface__
        interface["data"] = interface["data"][0], True
        self.__array_interface__ = interface


def fixed(a: np.ndarray) -> bool:
    """Whether an array refuses writes for good.

    A flag alone does not tell: who owns a read-only array, or what it is a view of, can let writes in again.
    """
    part: object = a
    while isinstance(part, np.ndarray):
        part = part.base
    return isinstance(part, _Kept)


def read_only(a: np.ndarray) -> np.ndarray:
    """The array such that it refuses writes for good, without a copy: for whoever made it and keeps no other hold."""
    if fixed(a):
        return a
    if type(a) is np.ndarray and not a.dtype.hasobject:
        return np.asarray(_Kept(a))
    a.flags.writeable = False
    return a


def settled(a: object) -> object:
    """A content as frozen classes hold it: arrays refuse writes for good, lists of numbers as tuples."""
    if isinstance(a, np.ndarray):
        return a if fixed(a) else read_only(a.copy())
    if isinstance(a, tuple):
        return getattr(a, "_make", tuple)(settled(x) for x in a)
    if isinstance(a, list) and a and all(isinstance(x, Real | np.ndarray | list | tuple) for x in a):
        return settled(tuple(a))
    return a


# Any: a dataclass, for which typing has no name.
def settle(made: Any) -> None:
    """Settles the fields of a dataclass: what the caller does to the arrays that it was made of does not change it."""
    for f in fields(made):
        object.__setattr__(made, f.name, settled(getattr(made, f.name)))


def adopt(cls: Any, finish: Callable[[Any], None]) -> None:  # Any: methods are set on it, which no type allows
    """Makes a subclass that users write, a dataclass, keep what its base promises, however it is written.

    `finish` follows a `__post_init__` of its own, which may not call that of its base; and the == that `dataclass`
    would make, which compares arrays in tuples, is the base's, as is how it reads.
    """
    for name in ("__eq__", "__repr__"):
        if name not in cls.__dict__:
            setattr(cls, name, getattr(cls, name))
    own = cls.__dict__.get("__post_init__")
    if own is None:
        return

    # Any: the class's own instances, and what its `InitVar`s hand over.
    @wraps(own)
    def both(self: Any, *given: Any) -> None:
        own(self, *given)
        finish(self)

    cls.__post_init__ = both


def same_fields(a: object, b: object, but: str = "") -> bool:
    """Whether two values of one class have the same fields, but for one, arrays compared entry by entry."""
    if a is b:
        return True
    if type(a) is not type(b) or not is_dataclass(a) or isinstance(a, type):
        return False
    return all(same(getattr(a, f.name), getattr(b, f.name)) for f in fields(a) if f.name != but)


def content(a: object) -> Hashable:
    """What of an object its hash is made of: equal for objects that are the same."""
    if isinstance(a, np.ndarray):
        # Minus zero equals zero, and one NaN the other.
        plain = np.where(np.isnan(a), np.nan, a + 0.0) if a.dtype.kind == "f" else a
        return a.shape, plain.tobytes()
    if isinstance(a, tuple):
        return tuple(content(x) for x in a)
    if a is None or isinstance(a, str | bool | int | float) or hasattr(type(a), "__is_value__"):
        return hash(a)
    return type(a).__qualname__


# Any: a dataclass, for which typing has no name.
def _contents(self: Any) -> tuple[object, ...]:
    return tuple(getattr(self, f.name) for f in fields(self))


def _equal(self: object, other: object) -> bool:
    if type(self) is not type(other):
        return NotImplemented
    return same(_contents(self), _contents(other))


def _hash(self: object) -> int:
    return hash((type(self).__qualname__, content(_contents(self))))


def _state(self: Any) -> dict[str, object]:  # Any: as above
    return {f.name: getattr(self, f.name) for f in fields(self)}


def restore(self: object, state: dict[str, object]) -> None:
    """What comes out of a pickle, its arrays again such that they refuse writes."""
    for name, entry in state.items():
        object.__setattr__(self, name, settled(entry))
