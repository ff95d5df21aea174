"""Batches of small programs, and the memory of a process that solves them."""

from collections.abc import Iterator
from itertools import islice
from multiprocessing import current_process
from pathlib import Path

import numpy as np

import symmotion as sm
from symmotion.batches import own_processes, solve_each

TIMES = np.linspace(0.0, 1.0, 4)
STATM = Path("/proc/self/statm")  # Linux: sizes of this process in pages
CHECKS = 10  # measurements of memory over a batch


def keyframes(count: int) -> Iterator[sm.Keyframes]:
    """Batches of four keyframes at the same times, neighbours turned by up to 40°."""
    for seed in range(count):
        keys = sm.examples.random_keyframes(len(TIMES), 40, seed=seed)
        yield sm.Keyframes(TIMES, keys.linear, keys.translation)


def new_programs(count: int) -> Iterator[sm.program.Program]:
    """Each made from scratch."""
    return (sm.affine_program(keys) for keys in keyframes(count))


def moved_programs(count: int) -> Iterator[sm.program.Program]:
    """The first one, with other and other keyframes."""
    first = next(new_programs(1))
    return (first.with_keyframes(keys) for keys in keyframes(count))


MAKERS = {"new": new_programs, "moved": moved_programs}


def memory_over(count: int) -> dict[str, list[tuple[int, float]]]:
    """By kind of programs, resident memory in MB over solves whose solutions are not kept; empty where unknown."""
    if not STATM.exists():
        return {}
    if current_process().daemon:
        return {kind: _memory_of(kind, count) for kind in MAKERS}
    found = {}
    for kind in MAKERS:
        # In a fresh process: in this one, what has been freed before would hide a leak.
        with own_processes(1) as process:
            found[kind] = process.submit(_memory_of, kind, count).result()
    return found


def _memory_of(kind: str, count: int) -> list[tuple[int, float]]:
    import resource

    answers, rows, done = solve_each(MAKERS[kind](count)), [], 0
    for _ in range(CHECKS):
        done += sum(1 for _ in islice(answers, count // CHECKS))
        rows.append((done, int(STATM.read_text().split()[1]) * resource.getpagesize() / 1e6))
    return rows


def growth(rows: list[tuple[int, float]]) -> float:
    """Bytes per solve after the first tenth, by least squares, to a tenth of one."""
    solves, sizes = np.transpose(rows[1:])
    return round(float(np.polyfit(solves, 1e6 * sizes, 1)[0]), 1) + 0.0
