"""What CasADi says on stderr, heard by the thread that made it speak."""

import sys
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stderr
from threading import get_ident
from typing import Any, TextIO

from symmotion.forking import ForkedLock

# There is one sys.stderr: two threads that replaced it at the same time would put back each other's.
_REPLACED = ForkedLock()


class _Listener:
    """A stream that keeps what one thread writes; everything else is the stream's behind it."""

    def __init__(self, stream: TextIO):
        self._stream, self._thread = stream, get_ident()
        self.heard: list[str] = []

    def write(self, text: str) -> int:
        if get_ident() == self._thread:
            self.heard.append(text)
            return len(text)
        return self._stream.write(text)

    def __getattr__(self, name: str) -> object:
        return getattr(self._stream, name)


@contextmanager
def overheard() -> Iterator[list[str]]:
    """The pieces of text that this thread writes to stderr meanwhile, kept from it; other threads write as ever."""
    with _REPLACED:
        listener: Any = _Listener(sys.stderr)  # Any: a stream by what it answers to
        with redirect_stderr(listener):
            yield listener.heard
