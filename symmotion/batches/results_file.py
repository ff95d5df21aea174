"""Solutions in a file that only grows, so that a batch goes on where it was killed."""

import json
import math
from base64 import b64decode, b64encode
from binascii import crc32
from dataclasses import asdict, astuple
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np

from symmotion.errors import InputError
from symmotion.program import Excess, Program
from symmotion.solvers.solution import Course, Iteration, Round, Seconds, Solution, Status
from symmotion.systems import Certificate

Parsed: TypeAlias = Any  # of JSON

HEADER = b'{"symmotion results": 1}\n'
# Every line is JSON: the record, and before it, at fixed places, the checksum of its bytes.
OPENING, BETWEEN, CLOSING = b'{"crc32": "', b'", "record": ', b"}\n"
BEGIN = len(OPENING) + 8 + len(BETWEEN)


class ResultsFile:
    """The solutions of a batch by the fingerprints of their programs; one process at a time writes to it.

    A line of JSON for each, written as soon as there is one, with a checksum. What a kill left of
    the last line is cut off. Plain numbers only, the arrays as base64 of little-endian doubles: nothing of
    it is executed. Raises InputError that names the file and the line where it is damaged.

    path: of the file, which is made where it is not there.

    >>> program = sm.affine_program(sm.examples.quarter_turn())
    >>> solutions = sm.solve_many([program], results="batch.results")
    >>> again = sm.solve_many([program], results="batch.results", progress=lambda tally: print(tally.found))
    1
    """

    def __init__(self, path: str | Path):
        self.path = Path(path)
        self._places: dict[str, tuple[int, int]] = {}
        if self.path.exists() and not self.path.is_file():
            raise InputError(f"{self.path}: cannot write a results file there: it is no ordinary file")
        try:
            self._file = open(self.path, "a+b", buffering=0)  # noqa: SIM115 - closed by `close`
        except OSError as error:
            raise InputError(f"{self.path}: cannot write a results file there: {error.strerror}") from error
        try:
            self._lock(True)
            self._read()
        except BaseException:
            self._file.close()
            raise

    def __enter__(self) -> "ResultsFile":
        return self

    def __exit__(self, *_: object) -> None:
        # Not left to closing: processes forked meanwhile have the file open too, and would keep it locked.
        self._lock(False)
        self._file.close()

    def __repr__(self) -> str:
        return f"ResultsFile({str(self.path)!r}: {len(self)} solutions)"

    def __len__(self) -> int:
        """Solutions in it."""
        return len(self._places)

    def _lock(self, on: bool) -> None:
        """Keep others from writing to the file, where system and file system know locks."""
        try:
            import fcntl
        except ImportError:  # Windows
            return
        try:
            fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB if on else fcntl.LOCK_UN)
        except BlockingIOError as error:
            raise InputError(
                f"{self.path}: another batch is writing to it; where that was killed, end its worker processes"
            ) from error
        except OSError:
            return

    def _read(self) -> None:
        """Find the records; cut off a last line that is torn."""
        end = 0
        with open(self.path, "rb") as lines:
            for number, line in enumerate(lines, 1):
                if not self._take(number, line, end):
                    if next(lines, b""):
                        raise InputError(
                            f"{self.path}, line {number}: damaged; delete this line, and its program is solved again"
                        )
                    break
                end += len(line)
        self._file.truncate(end)
        if not end:
            self._write(HEADER)

    def _take(self, number: int, line: bytes, begin: int) -> bool:
        """Note where a line's record is; False where the line is not whole."""
        if number == 1:
            if not HEADER.startswith(line):
                raise InputError(f"{self.path}, line 1: this is no results file of symmotion: name another")
            return line == HEADER
        name = _name(line)
        if name is None:
            return False
        self._places[name] = (begin, len(line))
        return True

    def find(self, name: str, program: Program) -> Solution | None:
        """The solution of the program with this fingerprint, None where there is none."""
        if name not in self._places:
            return None
        begin, length = self._places[name]
        self._file.seek(begin)
        return _solution(json.loads(self._file.read(length))["record"], program)

    def add(self, name: str, solution: Solution) -> None:
        """Append a solution, which counts in place of an older one; it is with the operating system when this returns.

        Not one that was interrupted: another time it may end elsewhere, which the question's fingerprint cannot tell.
        """
        if solution.interrupted:
            return
        record = json.dumps(_record(name, solution)).encode()
        self._write(OPENING + b"%08x" % crc32(record) + BETWEEN + record + CLOSING)

    def _write(self, line: bytes) -> None:
        try:
            written = self._file.write(line)
        except OSError as error:
            raise InputError(f"{self.path}: cannot write: {error.strerror}") from error
        if written != len(line):
            raise InputError(f"{self.path}: cannot write: the disk is full")


def _name(line: bytes) -> str | None:
    """The fingerprint in a line, None where the line is not whole."""
    record = line[BEGIN : -len(CLOSING)]
    frame = OPENING + b"%08x" % crc32(record) + BETWEEN
    if not (line.startswith(frame) and line.endswith(CLOSING)):
        return None
    return json.loads(record)["program"]


def _record(name: str, solution: Solution) -> dict[str, object]:
    return {
        "program": name,
        "solver": solution.solver,
        "method": solution.method,
        "status": str(solution.status),
        "x": _packed(solution.x),
        "multipliers": _packed(solution.multiplier_vector),
        "certificate": {key: _plain(value) for key, value in asdict(solution.certificate).items()},
        "tolerance": solution.tolerance,
        "log": [[_plain(value) for value in astuple(row)] for row in solution.log],
        "seconds": asdict(solution.seconds),
        "message": solution.message,
        "evaluations": dict(solution.evaluations),
        **({} if solution.exchange is None else {"exchange": _course(solution, solution.exchange)}),
    }


def _course(solution: Solution, course: Course) -> dict[str, object]:
    """What an exchange took, and the times at its end."""
    times = {c.name: c.times for c in solution.program.constraints if c.everywhere is not None and c.times is not None}
    rounds = [
        {
            "times": dict(r.times),
            "excess": {name: [_plain(value) for value in astuple(e)] for name, e in r.excess.items()},
            "objective": _plain(r.objective),
            "iterations": r.iterations,
        }
        for r in course.rounds
    ]
    held = {name: [_packed(t), list(t.shape)] for name, t in times.items()}
    return {"tolerance": course.tolerance, "rounds": rounds, "times": held}


def _exchanged(record: dict[str, Parsed], program: Program) -> tuple[Program, Course]:
    """The program with the times at the end of an exchange, and what that took."""
    times = {name: _unpacked(text).reshape(shape) for name, (text, shape) in record["times"].items()}
    rounds = tuple(
        Round(
            r["times"],
            {name: Excess(_number(e[0]), _number(e[1]), e[2]) for name, e in r["excess"].items()},
            _number(r["objective"]),
            r["iterations"],
        )
        for r in record["rounds"]
    )
    return program.with_times(times), Course(record["tolerance"], rounds)


def _solution(record: dict[str, Parsed], program: Program) -> Solution:
    x, course = _unpacked(record["x"]), None
    if "exchange" in record:
        program, course = _exchanged(record["exchange"], program)
    return Solution(
        program,
        record["solver"],
        record["method"],
        Status(record["status"]),
        x,
        _unpacked(record["multipliers"]),
        _certificate(record["certificate"]).at(program, x),
        record["tolerance"],
        tuple(Iteration(*map(_number, row)) for row in record["log"]),
        Seconds(**record["seconds"]),
        record["message"],
        evaluations=record.get("evaluations", {}),
        exchange=course,
    )


def _certificate(record: dict[str, Parsed]) -> Certificate:
    texts = {key: tuple(record.get(key, ())) for key in ("weak", "unresolved")}
    return Certificate(**{**{key: _number(value) for key, value in record.items()}, **texts})


def _plain(value: object) -> object:
    """A number that JSON has: those that are not finite as text."""
    return str(value) if isinstance(value, float) and not math.isfinite(value) else value


def _number(value: Parsed) -> Parsed:
    """What `_plain` was given."""
    return float(value) if isinstance(value, str) and value in ("nan", "inf", "-inf") else value


def _packed(array: np.ndarray) -> str:
    return b64encode(np.ascontiguousarray(array, dtype="<f8").tobytes()).decode()


def _unpacked(text: str) -> np.ndarray:
    return np.frombuffer(b64decode(text), dtype="<f8").astype(float)
