"""What a forked child finds of the locks that other threads held: those threads are not there to open them."""

import os
import sys
from collections.abc import Callable
from functools import cached_property
from threading import Lock, RLock, get_ident

from symmotion.errors import InputError


class ForkedLock:
    """A lock that is open in a forked child, whichever thread held it in the parent."""

    def __init__(self):
        self._lock = Lock()
        _in_child(self._renew)

    def _renew(self) -> None:
        self._lock = Lock()

    def __enter__(self) -> None:
        self._lock.acquire()

    def __exit__(self, *_: object) -> None:
        if self._lock.locked():  # else the thread that took it has forked meanwhile
            self._lock.release()


class Section:
    """Code that a fork must not cut: of libraries with locks of their own, which stay closed in the child.

    Entered by `with`, by any number of threads. In a child that was forked while other threads were inside, entering
    raises InputError: it would wait for ever. Not a generator: those of other threads are closed in the child.
    """

    def __init__(self, what: str):
        self._what, self._cut = what, False
        self._depth: dict[int, int] = {}
        _in_child(self._forked)

    def _forked(self) -> None:
        me = get_ident()
        self._cut = self._cut or any(thread != me for thread in self._depth)
        self._depth = {me: self._depth[me]} if me in self._depth else {}

    def __enter__(self) -> None:
        if self._cut:
            raise InputError(
                f"this process was forked while other threads were in {self._what}, whose locks stay closed here: fork "
                'before threads solve, or start processes by multiprocessing.get_context("spawn")'
            )
        self._depth[get_ident()] = self._depth.get(get_ident(), 0) + 1

    def __exit__(self, *_: object) -> None:
        self._depth[get_ident()] -= 1
        if not self._depth[get_ident()]:
            del self._depth[get_ident()]


def _in_child(renew: Callable[[], None]) -> None:
    if hasattr(os, "register_at_fork"):  # not on Windows, where nothing is forked
        os.register_at_fork(after_in_child=renew)


def _open_properties() -> None:
    """Open the locks that cached properties have before Python 3.12, one for all objects of a class."""
    for name, module in list(sys.modules.items()):
        if name.partition(".")[0] == __name__.partition(".")[0]:
            for made in [entry for entry in vars(module).values() if isinstance(entry, type)]:
                for entry in vars(made).values():
                    if isinstance(entry, cached_property) and hasattr(entry, "lock"):
                        entry.lock = RLock()  # pyright: ignore[reportAttributeAccessIssue]


_in_child(_open_properties)
