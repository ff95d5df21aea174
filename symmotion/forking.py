"""What a forked child finds of the locks that other threads held: those threads are not there to open them."""

import os
import sys
from collections.abc import Callable
from functools import cached_property
from threading import Lock, RLock, get_ident
from time import monotonic, sleep

from symmotion.errors import InputError

PAUSE = 1e-4  # seconds between two looks at whether a section is empty


class ForkedLock:
    """A lock that is open in a forked child, whichever thread held it in the parent.

    check: called every `look` seconds while the lock is waited for; what it raises ends the wait.
    """

    def __init__(self, look: float = -1, check: Callable[[], None] = lambda: None):
        self._lock, self._look, self._check = Lock(), look, check
        _in_child(self._renew)

    def _renew(self) -> None:
        self._lock = Lock()

    def __enter__(self) -> None:
        while not self._lock.acquire(timeout=self._look):
            self._check()

    def __exit__(self, *_: object) -> None:
        if self._lock.locked():  # else the thread that took it has forked meanwhile
            self._lock.release()


class Section:
    """Code that a fork must not cut: of libraries with locks of their own, which stay closed in the child.

    patience: seconds that a fork waits for other threads to leave, while none enters. Entered by `with`, by any number
    of threads. In a child that was forked while other threads were inside all the same, entering raises InputError: it
    would wait for ever. Not a generator: those of other threads are closed in the child.
    """

    def __init__(self, what: str, patience: float = 0.0):
        self._what, self._patience, self._cut = what, patience, False
        self._depth: dict[int, int] = {}
        self._forking: set[int] = set()
        if patience and hasattr(os, "register_at_fork"):
            os.register_at_fork(before=self._wait, after_in_parent=self._done)
        _in_child(self._forked)

    def _others(self) -> bool:
        me = get_ident()
        return any(thread != me for thread in tuple(self._depth))

    def _wait(self) -> None:
        self._forking.add(get_ident())
        end = monotonic() + self._patience
        while self._others() and monotonic() < end:
            sleep(PAUSE)

    def _done(self) -> None:
        self._forking.discard(get_ident())

    def _forked(self) -> None:
        me = get_ident()
        self._cut = self._cut or self._others()
        self._depth = {me: self._depth[me]} if me in self._depth else {}
        self._forking.clear()

    def __enter__(self) -> None:
        if self._cut:
            raise InputError(
                f"this process was forked while other threads were in {self._what}, whose locks stay closed here: fork "
                'before threads solve, or start processes by multiprocessing.get_context("spawn")'
            )
        me = get_ident()
        inside = self._depth.get(me, 0)
        # Inside first, then the look at who forks, who says so first and then looks at who is inside.
        self._depth[me] = inside + 1
        while self._forking and not inside and self._forking != {me}:
            del self._depth[me]
            sleep(PAUSE)
            self._depth[me] = 1

    def __exit__(self, *_: object) -> None:
        me = get_ident()
        if self._depth[me] == 1:
            del self._depth[me]
        else:
            self._depth[me] -= 1

    def pause(self) -> None:
        """Between two calls of the library: let a fork that waits come in."""
        if self._forking and get_ident() in self._depth:
            with self.left():
                pass

    def left(self) -> "_Left":
        """A time, inside or not, during which this thread is not: while code of the caller's runs."""
        return _Left(self)


class _Left:
    """See `Section.left`."""

    def __init__(self, section: Section):
        self._section = section

    def __enter__(self) -> None:
        self._before = self._section._depth.pop(get_ident(), 0)

    def __exit__(self, *_: object) -> None:
        if self._before:
            self._section.__enter__()
            self._section._depth[get_ident()] = self._before


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

# CasADi, BLAS and what factorises lock what their threads share. Solvers are inside from the first step to the last one
# and pause between steps, so that a fork waits for less than it can.
LIBRARIES = Section("CasADi, BLAS or LAPACK", patience=10.0)
