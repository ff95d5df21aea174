"""Old names that say the new one."""

from collections.abc import Callable
from functools import wraps
from typing import ParamSpec, TypeVar

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
