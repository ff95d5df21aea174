"""What a forked child may do with CasADi: other threads that were in the midst of it are not there to leave it."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from threading import Lock, get_ident

from symmotion.errors import InputError


class ForkedLock:
    """A lock that is open in a forked child, whichever thread held it in the parent."""

    def __init__(self):
        self._lock = Lock()
        _in_child(self._renew)

    def _renew(self) -> None:
        self._lock = Lock()

    def __enter__(self) -> None:
        # The one that is released is the one that was taken, also where the holder itself forks in between.
        self._lock.acquire()

    def __exit__(self, *_: object) -> None:
        if self._lock.locked():
            self._lock.release()


class Sections:
    """Where threads are in code that a fork must not cut: solvers of CasADi, which keep locks of their own.

    A child forked while other threads were in there would wait for these locks for ever: it refuses instead.
    """

    def __init__(self):
        self._depth: dict[int, int] = {}
        self._cut = False
        _in_child(self._forked)

    def _forked(self) -> None:
        me = get_ident()
        self._cut = self._cut or any(thread != me for thread in self._depth)
        self._depth = {me: self._depth[me]} if me in self._depth else {}

    @contextmanager
    def inside(self) -> Iterator[None]:
        """A time in such code; InputError in a process that was forked while other threads were there."""
        if self._cut:
            raise InputError(
                "this process was forked while other threads were solving, and what they hold is lost: fork before "
                'threads solve, or start processes by multiprocessing.get_context("spawn")'
            )
        me = get_ident()
        self._depth[me] = self._depth.get(me, 0) + 1
        try:
            yield
        finally:
            self._depth[me] -= 1
            if not self._depth[me]:
                del self._depth[me]


def _in_child(renew) -> None:
    if hasattr(os, "register_at_fork"):
        os.register_at_fork(after_in_child=renew)


CASADI = Sections()
