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
            return exact if len(exact) <= 10 else f"{content:.9g}"
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
    return f"[{', '.join(_numbers(np.asarray(part)) for part in array)}]"


def _times(shape: tuple[int, ...]) -> str:
    return " × ".join(map(str, shape))


def _listed(shown: list[str], count: int) -> str:
    text = ", ".join(shown)
    return text if count <= ENTRIES and len(text) <= 2 * LETTERS else f"{count} entries"


def _tuple(shown: list[str], count: int) -> str:
    return f"({_listed(shown, count)}{',' * (count == 1)})"
