"""Ctrl-C while a solver runs: what handlers of signals raise is kept, and raised at the solver's next step.

A step is whatever calls `check`: a step of a solver, an evaluation of a kernel, what else takes its time.

The interpreter runs handlers wherever it is: also in the callback of a weak reference, where a library converts an
argument, or where one is about to call back, all of which swallow what is raised in them.
"""

import os
import signal
from threading import current_thread, main_thread
from types import FrameType

from symmotion.forking import LIBRARIES

_SIGNALS = tuple(signal.valid_signals())


class _Kept:
    """Whether handlers, which run in the main thread alone, raise nothing now, and the first error of one meanwhile."""

    active = False
    error: BaseException | None = None


def _main() -> bool:
    return current_thread() is main_thread()


class kept:
    """A time during which handlers of signals raise nothing: `check` does, in the main thread, and the end of it.

    One inside another is a part of it.
    """

    # Not a generator: a forked child closes those of other threads, and this one would set their handlers.
    def __enter__(self) -> None:
        self._handlers = {}
        if _main() and not _Kept.active:
            _Kept.error = None
            self._handlers = {s: h for s in _SIGNALS if callable(h := signal.getsignal(s))}
            for number in self._handlers:
                signal.signal(number, self._handle)
            _Kept.active = True

    def _handle(self, number: int, frame: FrameType | None) -> None:
        try:
            self._handlers[signal.Signals(number)](number, frame)
        except BaseException as error:
            if not _Kept.active:
                raise
            _Kept.error = _Kept.error or error

    def __exit__(self, *_: object) -> None:
        if self._handlers:
            _Kept.active = False
        for number, handler in self._handlers.items():
            if signal.getsignal(number) != self._handle:  # a callback of the user's has set another
                continue
            try:
                signal.signal(number, handler)
            except BaseException as error:  # of one that is back already
                _Kept.error = _Kept.error or error
                signal.signal(number, handler)
        check()


class raised:
    """A time, inside of `kept`, during which handlers raise as ever: while a callback of the user's runs."""

    # Not a generator, see above.
    def __enter__(self) -> None:
        self._before, self._left = _Kept.active, LIBRARIES.left()
        self._left.__enter__()
        if _main():
            _Kept.active = False
        try:
            check()  # what came before, which a solve in the callback would not know of
        except BaseException:
            self.__exit__()
            raise

    def __exit__(self, *_: object) -> None:
        if _main():
            _Kept.active = self._before
        self._left.__exit__()


def pending() -> bool:
    """Whether `check` would raise."""
    return _Kept.error is not None and _main()


def step() -> None:
    """Between two steps of a solver, which holds no locks there: `check`, and let forks of other threads come in."""
    LIBRARIES.pause()
    check()


def check() -> None:
    """Raise what was kept, if anything was."""
    if _main() and (error := _Kept.error) is not None:
        if not _Kept.active:
            _Kept.error = None
        raise error


def _forget() -> None:
    _Kept.active, _Kept.error = False, None


if hasattr(os, "register_at_fork"):  # not on Windows
    os.register_at_fork(after_in_child=_forget)
