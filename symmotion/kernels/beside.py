"""Work that goes on beside what asked for it, in one thread: compilers, which nobody waits for."""

import atexit
import os
from collections.abc import Callable, Hashable
from contextlib import suppress
from queue import SimpleQueue
from threading import Event, Thread, current_thread

LEAVE = 2.0  # seconds that the end of the process waits for what is under way to clean up


class Beside:
    """Jobs of one kind, each done once, one after the other, in a thread that ends with the process.

    done: how many jobs have ended; over: whether the process is about to end, which jobs look at.
    A forked child begins anew: the thread is not there.
    """

    def __init__(self):
        self._renew()
        if hasattr(os, "register_at_fork"):  # not on Windows
            os.register_at_fork(after_in_child=self._renew)
        atexit.register(self._end)

    def _renew(self) -> None:
        self._begun: set[Hashable] = set()
        self._jobs: SimpleQueue[Callable[[], None]] = SimpleQueue()
        self._thread: Thread | None = None
        self.done, self.over = 0, False

    def __repr__(self) -> str:
        return f"Beside({self.done} of {len(self._begun)} jobs done)"

    @property
    def mine(self) -> bool:
        """Whether this is the thread of the jobs."""
        return current_thread() is self._thread

    def begun(self, name: Hashable) -> bool:
        """Whether a job of this name has been begun, whatever became of it."""
        return name in self._begun

    def begin(self, name: Hashable, job: Callable[[], None]) -> None:
        """Do a job when those before it are done, if none of this name was begun yet."""
        if name in self._begun:
            return
        self._begun.add(name)
        self._jobs.put(job)
        if self._thread is None:
            self._thread = Thread(target=self._work, name="symmotion compiler", daemon=True)
            self._thread.start()

    def _work(self) -> None:
        jobs = self._jobs
        while not self.over:
            job = jobs.get()
            # What a job has to tell of a failure it keeps itself.
            with suppress(Exception):
                job()
            self.done += 1

    def wait(self) -> None:
        """Until all jobs are done that were begun."""
        last = Event()
        self.begin(last, last.set)
        last.wait()

    def _end(self) -> None:
        self.over = True
        if self._thread is not None:
            self._jobs.put(lambda: None)
            self._thread.join(LEAVE)
