"""How objects read at the prompt: in a line, whatever is in them."""

from collections.abc import Mapping
from dataclasses import MISSING, fields, is_dataclass
from functools import partial
from typing import Any

import casadi as ca
import numpy as np
from scipy import sparse

from symmotion.values import same

NUMBERS = 18  # of an array that is written out
ENTRIES = 6  # of a list that is written out
LETTERS = 120
# A time is far from 0 where it is so many times as large as the span of all: seconds from 1970 are.
FAR = 100.0
LARGE = 1e6
SAME = 1e-12  # numbers that differ by less, relative to their size, differ by rounding


def in_a_line(self: Any) -> str:  # Any: a dataclass, for which typing has no name
    """The `__repr__` of a dataclass: its fields but for those that are as left out, what is large by its shape."""
    parts = []
    for f in fields(self) if is_dataclass(self) else ():
        default = f.default_factory() if f.default_factory is not MISSING else f.default
        value = getattr(self, f.name)
        if f.repr and not f.name.startswith("_") and not same(value, default):
            parts.append(f"{f.name}={brief(value)}")
    return f"{type(self).__name__}({', '.join(parts)})"


def brief(content: object) -> str:
    """A content in a few words: numbers as they are where they are few, else their shape; functions by name."""
    match content:
        case np.ndarray():
            return _numbers(content)
        case sparse.sparray() | sparse.spmatrix():
            return f"sparse {_times(content.shape)}"
        case ca.SX() | ca.MX() | ca.DM():
            return f"{type(content).__name__} {_times(content.shape)}"
        case bool() | np.bool_() | None:
            return str(content)
        case float():
            exact = repr(float(content))
            return (
                exact if len(exact) <= 10 else instant(content) if LARGE < abs(content) < 1 / SAME else f"{content:.9g}"
            )
        case str():
            return repr(content if len(content) <= LETTERS else f"{content[: LETTERS - 1]}…")
        case Mapping():
            shown = [f"{brief(key)}: {brief(value)}" for key, value in list(content.items())[: ENTRIES + 1]]
            return f"{{{_listed(shown, len(content))}}}"
        case tuple() | list() if type(content).__repr__ in (tuple.__repr__, list.__repr__):
            shown = [brief(value) for value in content[: ENTRIES + 1]]
            return f"[{_listed(shown, len(content))}]" if isinstance(content, list) else _tuple(shown, len(content))
        case partial():
            return brief(content.func)
    name = getattr(content, "__name__", None)
    if isinstance(name, str):
        return name.strip("<>")
    lines = repr(content).splitlines() or [""]
    return lines[0] if len(lines[0]) <= LETTERS else f"{lines[0][: LETTERS - 1]}…"


def _numbers(array: np.ndarray) -> str:
    """An array as lists of numbers to six digits, a large one, or one of anything else, by its shape."""
    if array.size > NUMBERS or array.dtype.kind not in "biuf":
        return f"array {_times(array.shape)}"
    if not array.ndim:
        return f"{array[()] + 0:.6g}"
    if array.ndim == 1 and array.size and start_of(array) != 0 and np.ptp(array) > SAME * abs(array[0]):
        return f"[{', '.join(map(instant, array))}]"
    return f"[{', '.join(_numbers(np.asarray(part)) for part in array)}]"


def _times(shape: tuple[int, ...]) -> str:
    return " × ".join(map(str, shape))


def _listed(shown: list[str], count: int) -> str:
    text = ", ".join(shown)
    return text if count <= ENTRIES and len(text) <= 2 * LETTERS else f"{count} entries"


def _tuple(shown: list[str], count: int) -> str:
    return f"({_listed(shown, count)}{',' * (count == 1)})"


def start_of(times: np.ndarray) -> float:
    """What times are told from: the first one where 0 is far away, as from recordings in seconds from 1970, else 0."""
    return float(times[0]) if abs(times[0]) > FAR * abs(times[-1] - times[0]) > 0 else 0.0


def instant(time: float, digits: int = 6) -> str:
    """A time to so many digits, a large one to as many decimals: seconds from 1970 are alike in their first digits."""
    return f"{time:.{digits}g}" if abs(time) < 1e3 else f"{round(float(time), digits):.{max(digits, 15)}g}"


def instants(*times: float) -> tuple[str, ...]:
    """Times with as many digits, six at least, as tell those apart that differ: for messages that compare them."""
    shown = ()
    for digits in range(6, 18):
        shown = tuple(instant(time, digits) for time in times)
        if len(set(shown)) == len(set(times)):
            break
    return shown


def between(first: float, last: float) -> str:
    """The times from one to another, from the first where 0 is far away: 0 to 12.5 after 1700000000."""
    start = start_of(np.array([first, last]))
    return f"{first:g} to {last:g}" if start == 0 else f"0 to {last - first:g} after {instant(start)}"
