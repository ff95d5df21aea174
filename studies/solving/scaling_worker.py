"""One method on one size in a process of its own, with a budget of time and memory; what it took."""

import os
import pickle
import re
import signal
import subprocess
import sys
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from queue import Empty, SimpleQueue
from statistics import median
from tempfile import TemporaryDirectory
from threading import Thread
from time import perf_counter
from typing import Any, NoReturn

import symmotion as sm
from studies.solving.scaling_alternatives import judge
from symmotion.report import Run
from symmotion.solvers import Seconds

LOOK = 0.02  # seconds between looks at a running process
# What takes less than BRIEF seconds at first is timed again, until the repetitions take ENOUGH or are REPEATS.
BRIEF, ENOUGH, REPEATS = 0.3, 0.1, 9
ANGLE, SEED = 40, 0  # of the random keyframes
# Not -m, under which the classes here would be others than those of this process.
START = "import sys; from studies.solving.scaling_worker import {0}; {0}(*sys.argv[1:])"


@dataclass(frozen=True)
class Budget:
    """Seconds of build and solve, and megabytes of the whole process, at which a method is stopped."""

    seconds: float
    megabytes: float


@dataclass(frozen=True)
class Measurement:
    """A method at a size.

    run: its row, with median times; first: seconds of the first solve in its process, caches empty;
    memory, before: megabytes of the process at most and after its imports, None where unknown;
    stopped: why it was stopped, empty where it was not; unknowns: of its own formulation; repeated: seconds of the
    repetitions, of which `run` has the one next to the median.
    """

    method: str
    keyframes: int
    run: Run
    first: float | None = None
    memory: float | None = None
    before: float | None = None
    stopped: str = ""
    unknowns: int | None = None
    repeated: tuple[float, ...] = ()

    @property
    def beyond(self) -> float | None:
        """Megabytes beyond those of the imports."""
        return None if self.memory is None or self.before is None else self.memory - self.before

    @property
    def seconds(self) -> float | None:
        """Build and solve, where the result is certified."""
        return self.run.seconds.total if self.run.certified else None


def case(keyframes: int) -> str:
    return f"R, {ANGLE}°, {keyframes} keyframes"


class Nursery:
    """A process that has done the imports and nothing else, and starts others, one at a time, from there."""

    def __init__(self):
        # Not multiprocessing: a study may itself run in a worker that is not allowed children of that kind.
        self._process = subprocess.Popen(
            [sys.executable, "-c", START.format("serve")],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            text=True,
            env={**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))},
        )
        self._said: SimpleQueue[int | None] = SimpleQueue()
        Thread(target=self._listen, daemon=True).start()
        self._running: int | None = None

    def __enter__(self) -> "Nursery":
        return self

    def __exit__(self, *_: object) -> None:
        self.kill()
        self._process.kill()
        self._process.communicate()

    def start(self, directory: str) -> int:
        """The number of a new process that runs `work` on a directory."""
        assert self._process.stdin is not None
        print(directory, file=self._process.stdin, flush=True)
        self._running = self._heard(None)
        return self._running

    def ended(self, seconds: float) -> int | None:
        """The exit code of the process that was started last, if it ends within some seconds."""
        try:
            code = self._heard(seconds)
        except Empty:
            return None
        self._running = None
        return code

    def kill(self) -> None:
        """End the process that was started last, if it has not ended."""
        if self._running is not None:
            with suppress(ProcessLookupError):  # it has ended by itself just now
                os.kill(self._running, signal.SIGKILL if hasattr(signal, "SIGKILL") else signal.SIGTERM)
            self._running = None
            self._heard(None)

    def _heard(self, seconds: float | None) -> int:
        number = self._said.get(timeout=seconds)
        if number is None:
            self._said.put(None)
            raise RuntimeError("the process that starts others has ended")
        return number

    def _listen(self) -> None:
        assert self._process.stdout is not None
        for line in self._process.stdout:
            self._said.put(int(line))
        self._said.put(None)


def serve() -> None:
    """What the nursery does: a process for each line of the input, whose number and exit code it says."""
    for line in sys.stdin:
        directory = line.rstrip("\n")
        if hasattr(os, "fork"):
            number = os.fork()
            if not number:
                alone(directory)
            print(number, flush=True)
            print(os.waitstatus_to_exitcode(os.waitpid(number, 0)[1]), flush=True)
        else:
            with subprocess.Popen([sys.executable, "-c", START.format("alone"), directory]) as process:
                print(process.pid, flush=True)
                print(process.wait(), flush=True)


def alone(directory: str) -> NoReturn:
    """Work with nothing to read, and nothing said: solvers print banners whatever they are told."""
    nothing = os.open(os.devnull, os.O_RDWR)
    for standard in (0, 1):
        os.dup2(nothing, standard)
    work(Path(directory))
    os._exit(0)


def measure(method: str, solver: Any, keyframes: int, budget: Budget, nursery: Nursery | None = None) -> Measurement:
    """Build and solve with a solver or an alternative, in a fresh process; a failure is a row, too."""
    if nursery is None:
        with Nursery() as one:
            return measure(method, solver, keyframes, budget, one)
    with TemporaryDirectory() as directory:
        task, ready, result = (Path(directory) / name for name in ("task", "ready", "result"))
        task.write_bytes(pickle.dumps((method, solver, keyframes)))
        number, began, memory = nursery.start(directory), None, None
        try:
            while (code := nursery.ended(LOOK)) is None:
                if began is None and ready.exists():
                    began = perf_counter()
                memory = _peak(number) or memory
                if why := _exceeded(budget, began, memory):
                    break
            else:
                why = f"the process ended with code {code}"
        finally:
            nursery.kill()
        before = pickle.loads(ready.read_bytes()) if ready.exists() else None
        if result.exists():
            return replace(pickle.loads(result.read_bytes()), before=before)
        return _stopped(method, solver, keyframes, why, memory, before)


def _exceeded(budget: Budget, began: float | None, memory: float | None) -> str:
    if began is not None and perf_counter() - began > budget.seconds:
        return f"more than {budget.seconds:g} s"
    if memory is not None and memory > budget.megabytes:
        return f"more than {budget.megabytes:g} MB"
    return ""


def _stopped(
    method: str, solver: Any, keyframes: int, why: str, memory: float | None, before: float | None
) -> Measurement:
    row = Run.failed(case(keyframes), method, repr(solver), "stopped", why)
    return Measurement(method, keyframes, row, None, memory, before, why)


def work(directory: Path) -> None:
    """What the process does; imports are done when it starts on its task."""
    for name in dir(sm):
        getattr(sm, name)
    method, solver, keyframes = pickle.loads((directory / "task").read_bytes())
    _put(_peak(os.getpid()), directory / "ready")
    try:
        found = timed(method, solver, keyframes)
    except Exception as error:
        row = Run.failed(case(keyframes), method, repr(solver), "failed", " ".join(str(error).split())[:300])
        found = Measurement(method, keyframes, row, None, _peak(os.getpid()))
    _put(found, directory / "result")


def _put(value: Any, path: Path) -> None:
    """Pickled, and there as a whole or not at all."""
    part = path.with_suffix(".part")
    part.write_bytes(pickle.dumps(value))
    part.replace(path)


def timed(method: str, solver: Any, keyframes: int) -> Measurement:
    """Build and solve in this process: memory and time of the first, and the median time of repetitions if brief."""
    keys = sm.examples.random_keyframes(keyframes, ANGLE, SEED)
    attempts: list[Seconds] = []
    solution, unknowns, memory = None, None, None
    while _again(attempts):
        program = sm.affine_program(keys)
        if hasattr(solver, "attempt"):
            answer = solver.attempt(program)
            # Before the certificate, which is ours.
            memory = memory or _peak(os.getpid())
            solution, unknowns = judge(program, solver, answer), answer.unknowns
        else:
            solution = solver.solve(program)
            memory, unknowns = memory or _peak(os.getpid()), program.unknowns
        attempts.append(solution.seconds)
    assert solution is not None
    row = replace(Run.of(case(keyframes), solution), method=method, log=(), seconds=_middle(attempts[1:] or attempts))
    repeated = tuple(s.total for s in attempts[1:])
    return Measurement(method, keyframes, row, attempts[0].total, memory, unknowns=unknowns, repeated=repeated)


def _again(attempts: list[Seconds]) -> bool:
    if not attempts:
        return True
    repeated = sum(s.total for s in attempts[1:])
    return attempts[0].total < BRIEF and len(attempts) <= REPEATS and repeated < ENOUGH


def _middle(attempts: list[Seconds]) -> Seconds:
    """The attempt next to the median total."""
    middle = median(s.total for s in attempts)
    return min(attempts, key=lambda s: abs(s.total - middle))


def _peak(pid: int | None) -> float | None:
    """Megabytes that a process has had at most; None where the system does not tell of another process.

    Linux's figure starts with the process; that of getrusage starts from the peak of who started it.
    """
    status = Path(f"/proc/{pid}/status")
    try:
        found = re.search(r"VmHWM:\s*(\d+)", status.read_text())
    except OSError:
        found = None
    if found:
        return int(found[1]) / 1024
    if pid != os.getpid() or sys.platform == "win32":
        return None
    import resource

    # Bytes on macOS, kilobytes elsewhere.
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / (2**20 if sys.platform == "darwin" else 2**10)
