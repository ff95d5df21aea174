"""Old names that say the new one."""

import sys
from collections.abc import Callable, Mapping
from functools import wraps
from typing import NoReturn, ParamSpec, TypeVar

from symmotion.errors import InputError

P = ParamSpec("P")
R = TypeVar("R")


def renamed(**names: str) -> Callable[[Callable[P, R]], Callable[P, R]]:
    """A function whose old arguments raise an InputError that says what to write instead: `renamed(old="new")`."""

    def decorate(function: Callable[P, R]) -> Callable[P, R]:
        @wraps(function)
        def called(*args: P.args, **kwargs: P.kwargs) -> R:
            for old in names.keys() & kwargs.keys():
                raise InputError(f"{function.__name__}: {old} is {names[old]} from 0.2.0 on")
            return function(*args, **kwargs)

        return called

    return decorate


def moved(room: str, groups: Mapping[str, str], gone: Mapping[str, str] | None = None) -> Callable[[str], NoReturn]:
    """The `__getattr__` of a package: an old name raises an error that says what it is now.

    groups: by name, separated by spaces, the old names that are in that group of symmotion; gone: by old name what
    to write in its place.
    """
    short = "sm" if room == "symmotion" else room.removeprefix("symmotion.")
    now = {name: f"sm.{group}.{name}" for group, names in groups.items() for name in names.split()} | dict(gone or {})

    def missing(name: str) -> NoReturn:
        if name not in now:
            raise AttributeError(f"module {room!r} has no attribute {name!r}")
        told = f"{short}.{name} is {now[name]} from 0.2.0 on"
        asking = sys._getframe(1)
        importing = any(f is not None and f.f_code.co_name == "_handle_fromlist" for f in (asking, asking.f_back))
        # Of an AttributeError `from … import` would take no words.
        raise (ImportError if importing else AttributeError)(told)

    return missing
