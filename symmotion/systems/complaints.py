"""What CasADi says on stderr, heard by the thread that made it speak."""

import sys
from contextlib import redirect_stderr
from threading import get_ident
from typing import Any, TextIO

from symmotion.forking import LIBRARIES, ForkedLock

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


class overheard:
    """The pieces of text that this thread writes to stderr meanwhile, kept from it; other threads write as ever."""

    # Not a generator: a forked child closes those of other threads, and this one would put back their stderr.
    def __enter__(self) -> list[str]:
        LIBRARIES.__enter__()
        _REPLACED.__enter__()
        listener: Any = _Listener(sys.stderr)  # Any: a stream by what it answers to
        self._redirected = redirect_stderr(listener)
        self._redirected.__enter__()
        return listener.heard

    def __exit__(self, *_: object) -> None:
        self._redirected.__exit__(None, None, None)
        _REPLACED.__exit__()
        LIBRARIES.__exit__()
