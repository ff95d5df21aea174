"""Batches of small programs and solvers for the tests of many motions; importable by worker processes."""

import ctypes
import gc
import os
import signal
import sys
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import symmotion as sm
from symmotion.batches.many import solve_many

TIMES = np.array([0.0, 0.3, 0.6, 1.0])


def keyframes(seed: int) -> sm.Keyframes:
    keys = sm.examples.random_keyframes(4, 40, seed=seed)
    return sm.Keyframes(TIMES, keys.linear, keys.translation)


def small_programs(count: int, first: int = 0):
    """Programs of their own, with a term from a lambda in every third."""
    for k in range(first, first + count):
        gentle = sm.JetEnergy(lambda jet: jet.ddv, squares=True, label="bends")
        objective = sm.Rigidity() + 0.1 * gentle if k % 3 == 0 else sm.Rigidity()
        yield sm.affine_program(keyframes(k), objective=objective)


def moved_programs(count: int):
    """One program for other and other keyframes: what is derived is shared."""
    base = sm.affine_program(keyframes(0))
    for k in range(count):
        yield base.with_keyframes(keyframes(k))


def numbers(answers) -> list:
    """What has to be the same bit for bit whoever solved."""
    return [
        (a.status, a.x.tobytes(), a.multiplier_vector.tobytes(), a.certificate, [i.stationarity for i in a.log])
        for a in answers
    ]


@dataclass(frozen=True)
class Stubborn:
    """ExactNewton, except that it raises for programs whose last time is `refused`, and dies for `deadly`."""

    refused: float = -1.0
    deadly: float = -1.0
    tolerance: float = 1e-8
    max_iterations: int = 200

    def solve(self, program: sm.program.Program, start=None) -> sm.Solution:
        last = program.design.keyframes.times[-1]
        if last == self.refused:
            raise ValueError("not this one")
        if last == self.deadly:
            os.kill(os.getpid(), signal.SIGKILL)
        return sm.ExactNewton().solve(program, start)


@dataclass(frozen=True)
class Counting:
    """ExactNewton that leaves a line in a file for every solve."""

    path: str
    tolerance: float = 1e-8
    max_iterations: int = 200

    def solve(self, program: sm.program.Program, start=None) -> sm.Solution:
        with open(self.path, "a") as file:
            file.write("solve\n")
        return sm.ExactNewton().solve(program, start)


def counts(path: Path) -> int:
    return len(path.read_text().splitlines()) if path.exists() else 0


def lasting(duration: float, seed: int = 0) -> sm.program.Program:
    """A small program of its own total time."""
    keys = keyframes(seed)
    return sm.affine_program(sm.Keyframes(TIMES * duration, keys.linear, keys.translation))


class Allocated(ctypes.Structure):
    """What glibc tells of its allocator, in all threads: `mallinfo2`, bytes."""

    names = "arena ordblks smblks hblks hblkhd usmblks fsmblks uordblks fordblks keepcost"
    _fields_ = tuple((name, ctypes.c_size_t) for name in names.split())


def allocated() -> float:
    """Bytes in use, which what was freed before does not hide: those of C, and some for each object of Python's own."""
    told = ctypes.CDLL(None).mallinfo2
    told.restype = Allocated
    found = told()
    return float(found.uordblks + found.hblkhd + 64 * sys.getallocatedblocks())


def growth(kind: str, count: int) -> float:
    """Bytes that stay behind from a solve in every one of five batches."""
    kept, sizes = [], []
    make = moved_programs if kind in ("moved", "threads", "ipopt") else small_programs
    solver = sm.Ipopt() if kind == "ipopt" else sm.ExactNewton()
    for _ in range(6):
        if kind == "threads":
            with ThreadPoolExecutor(2) as threads:
                solve_many(make(count), solver, threads, chunk=count // 2)
        else:
            answers = solve_many(make(count), solver)
            kept += answers if kind == "kept" else []
            del answers
        gc.collect()
        sizes.append(allocated())
    # The least of them: now and then a table of the interpreter grows, a leak does so in every batch.
    return float(np.diff(sizes).min()) / count
