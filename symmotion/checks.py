"""What is refused, in one voice: InputErrors that name the argument, what was given and what is needed."""

import math
import os
from collections.abc import Hashable, Iterable
from numbers import Real
from typing import Any, TypeGuard, TypeVar

import numpy as np

from symmotion.errors import InputError
from symmotion.values import fixed

Kind = TypeVar("Kind")
# Whole numbers that the libraries behind take.
MOST = 2**31 - 1


# Any: it is tried whether it can be compared with a whole number.
def whole(value: Any, least: int, what: str, of: str = "", most: int = MOST) -> int:
    """The value as an int; InputError unless it is a whole number from `least` to `most`. of: " of knots", say."""
    try:
        good = not isinstance(value, bool | np.bool_) and int(value) == value and value >= least
    except (TypeError, ValueError, OverflowError):
        good = False
    if not good:
        raise InputError(f"{what} {told(value)}: a whole number{of}, {least} or more, is needed")
    if value > most:
        raise InputError(f"{what} {told(value)}: a whole number{of}, at most {most}, is needed")
    return int(value)


def number(value: object, what: str) -> float:
    """The value as a float; InputError unless it is a finite number."""
    if not (_is_number(value) and _is_finite(value)):
        raise InputError(f"{what} {told(value)}: a finite number is needed")
    return float(value)


def positive(value: object, what: str) -> float:
    """The value as a float; InputError unless it is a positive finite number."""
    if not (_is_number(value) and _is_finite(value) and value > 0):
        raise InputError(f"{what} {told(value)}: a positive number is needed")
    return float(value)


def not_negative(value: object, what: str) -> float:
    """The value as a float; InputError unless it is a finite number, 0 or more."""
    if not (_is_number(value) and _is_finite(value) and value >= 0):
        raise InputError(f"{what} {told(value)}: a finite number, 0 or more, is needed")
    return float(value)


def choice(value: Kind, known: Iterable[object], what: str) -> Kind:
    """The value; InputError that lists what there is unless it is one of them."""
    known = tuple(known)
    if not isinstance(value, Hashable) or value not in known:  # an array has no single answer to ==
        raise InputError(f"{what} {told(value)} is unknown; there are {', '.join(map(str, known))}")
    return value


def text(value: object, what: str) -> str:
    """The value; InputError unless it is a text that is not empty."""
    if not isinstance(value, str) or not value:
        raise InputError(f"{what} {value!r}: a text is needed")
    return value


def file_path(value: object, what: str = "path") -> str | os.PathLike[str]:
    """The value; InputError unless it is a path: text or a path object, no bytes and no open file."""
    if not isinstance(value, str | os.PathLike) or isinstance(os.fspath(value), bytes):
        raise InputError(f"{what} of type {type(value).__name__}: a str or a pathlib.Path is needed")
    return value


def array(value: object, shape: tuple[int | str, ...], what: str, *, finite: bool = True) -> np.ndarray:
    """A copy of the value as an array of floats; InputError unless it has the shape, its numbers real and finite.

    shape: of sizes, a letter where any will do (the same letter twice: the same size): ("M", 3).
    """
    given = numbers(value, what)
    sizes: dict[str, int] = {}
    fits = given.ndim == len(shape) and all(
        size == (sizes.setdefault(wanted, size) if isinstance(wanted, str) else wanted)
        for size, wanted in zip(given.shape, shape, strict=True)
    )
    if not fits or (finite and not np.isfinite(given).all()):
        word = "finite, " if finite else ""
        raise InputError(f"{what} of shape {given.shape}: {word}{shown(shape)}, is needed")
    return given


def numbers(value: object, what: str) -> np.ndarray:
    """A copy of the value as an array of floats; InputError where it is masked, complex, or no array of numbers.

    Text, dates and a lone truth value are no numbers, though they could be read as such.
    """
    if _masked(value):
        raise InputError(f"{what}: entries are masked; leave them out or fill them in")
    nothing = InputError(f"{what}: a {type(value).__name__} is no array of numbers")
    try:
        given = np.asarray(value)
        plain = given.dtype.kind in "biuf" or not any(isinstance(x, str | bytes) for x in given.flat)
        floats = np.array(given, dtype=float) if plain and given.dtype.kind in "biufO" else None
    except (TypeError, ValueError, OverflowError):  # of whole numbers that no float can be
        raise nothing from None
    if given.dtype.kind == "c":
        raise InputError(f"{what}: complex numbers; real ones are needed")
    if given.dtype.kind in "mM":
        raise InputError(f"{what}: dates or durations; numbers are needed")
    if floats is None or value is None or (given.dtype.kind == "b" and not given.ndim):
        raise nothing
    return floats


def floats(value: object, what: str) -> np.ndarray:
    """As `numbers`, but an array of floats itself: for what is read and not kept."""
    return value if type(value) is np.ndarray and value.dtype == np.float64 else numbers(value, what)


def held(value: object, what: str) -> np.ndarray:
    """As `numbers`, but an array of floats itself that nobody can ever write to: for what keeps it."""
    return value if type(value) is np.ndarray and value.dtype == np.float64 and fixed(value) else numbers(value, what)


def index(value: object, count: int, what: str) -> int:
    """The value as a place among `count`, counted from the end where negative; InputError where there is none such."""
    if isinstance(value, bool) or not isinstance(value, int | np.integer) or not -count <= value < count:
        raise InputError(f"{what} {told(value)} does not exist: there are {count}")
    return int(value) % count


def indices(value: object, count: int, what: str) -> list[int]:
    """The places among `count` that a sequence names, as `index`, each once and in order."""
    if isinstance(value, str | bytes) or not isinstance(value, Iterable):
        raise InputError(f"{what} {told(value)}: a list of whole numbers is needed")
    return sorted({index(i, count, what) for i in value})


def times(value: object, what: str = "times", least: int = 1) -> np.ndarray:
    """A copy of times (M,), M ≥ least; InputError unless they are finite and increasing."""
    given = np.atleast_1d(numbers(value, what))
    if given.ndim != 1 or len(given) < least:
        raise InputError(f"{what} of shape {given.shape}: (M,), M ≥ {least}, is needed")
    if not np.isfinite(given).all():
        raise InputError(f"{what}: number {int(np.argmin(np.isfinite(given)))} is not finite")
    late = np.diff(given) <= 0
    if late.any():
        i = int(np.argmax(late))
        raise InputError(
            f"{what}: number {i + 1} ({given[i + 1]:.17g}) does not come after number {i} ({given[i]:.17g})"
        )
    return given


def told(value: object) -> str:
    """A value as messages show it, in one line of at most eighty characters."""
    text = " ".join(repr(value).split())
    return text if len(text) <= 80 else f"{text[:79]}…"


def shown(shape: tuple[int | str, ...]) -> str:
    """A shape as messages show it: (M, 3), (4,)."""
    return f"({', '.join(map(str, shape))}{',' * (len(shape) == 1)})"


def _masked(value: object) -> bool:
    """Whether entries are masked, in lists too, of which NumPy would make plain arrays."""
    if isinstance(value, list | tuple):
        return any(_masked(part) for part in value if isinstance(part, list | tuple | np.ma.MaskedArray))
    return isinstance(value, np.ma.MaskedArray) and bool(np.ma.getmaskarray(value).any())


def _is_number(value: object) -> TypeGuard[float]:
    return isinstance(value, Real) and not isinstance(value, bool | np.bool_)


def _is_finite(value: float) -> bool:
    try:
        return math.isfinite(value)
    except OverflowError:  # a whole number that no float can be
        return False
