"""Ratios of CPU times that a change of the code should leave as they are: `python .ci/benchmark.py [--store]`.

A time depends on the machine; the ratio of two times on one machine hardly does. Each ratio is the median of
several, its two sides measured in turn, so that what else the machine does meets both. Exit status 1 where one
is more than `FACTOR` times the stored ratio or less than the `FACTOR`-th part of it. If the change is meant,
`--store` writes down the new ones, which belong into the same commit as the change.
"""

import argparse
import json
import os
import shutil
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from statistics import median
from time import process_time
from typing import Literal

# Before NumPy is imported: with threads of BLAS, the CPU time would depend on how many there are.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import symmotion as sm
from symmotion.kernels import Kernels
from symmotion.program import Program

STORED = Path(__file__).with_name("ratios.json")
FACTOR = 2.0
REPEATS = 7

Work = Callable[[], object]
Solver = sm.ExactNewton | sm.Ipopt


@dataclass(frozen=True)
class Case:
    """A ratio: the CPU time of one piece of work over that of another, `scale` times as much.

    prepare: makes both and does them once, so that structure and kernels are there. compiles: it needs a C compiler.
    """

    name: str
    prepare: Callable[[], tuple[Work, Work]]
    scale: float = 1.0
    compiles: bool = False


def affine(count: int) -> Program:
    return sm.affine_program(sm.examples.random_keyframes(count, 40, 0))


def orientation(count: int) -> Program:
    return sm.orientation_program(sm.examples.random_keyframes(count, 40, 0))


def solving(solver: Solver, program: Program) -> Work:
    """The work of solving a program whose structure and kernels are there already."""
    solver.solve(program).require()
    return lambda: solver.solve(program).require()


def newton(kernels: Kernels = "interpreted", system: Literal["auto", "condensed", "sparse"] = "auto") -> sm.ExactNewton:
    return sm.ExactNewton(kernels=kernels, system=system, threads=1)


def ipopt() -> sm.Ipopt:
    return sm.Ipopt(kernels="interpreted", threads=1)


def sides(upper: Solver, program: Program, lower: Solver, other: Program | None = None) -> tuple[Work, Work]:
    return solving(upper, program), solving(lower, program if other is None else other)


CASES = (
    Case("Newton to Ipopt, affine, 100 keyframes", lambda: sides(newton(), affine(100), ipopt())),
    Case("Newton to Ipopt, orientation, 12 keyframes", lambda: sides(newton(), orientation(12), ipopt())),
    # The width of the machine's vectors decides: 0.14 and 0.34 were seen on two machines, and 0.22 is stored.
    Case(
        "compiled to interpreted, 100 keyframes",
        lambda: sides(newton("compiled"), affine(100), newton()),
        compiles=True,
    ),
    Case(
        "sparse to condensed system, 100 keyframes",
        lambda: sides(newton(system="sparse"), affine(100), newton(system="condensed")),
    ),
    Case(
        "1,000 to 100 keyframes, of each",
        lambda: sides(newton(), affine(1000), newton(), affine(100)),
        scale=10.0,
    ),
)


def ratio(case: Case, repeats: int = REPEATS, clock: Callable[[], float] = process_time) -> float:
    """The median of the ratios of a case, measured `repeats` times."""
    upper, lower = case.prepare()
    return median(_seconds(upper, clock) / _seconds(lower, clock) for _ in range(repeats)) / case.scale


def _seconds(work: Work, clock: Callable[[], float]) -> float:
    began = clock()
    work()
    return clock() - began


def changes(stored: Mapping[str, float], measured: Mapping[str, float], factor: float = FACTOR) -> list[str]:
    """A line for every ratio that is not what it was, within the factor; for one that was never stored, too."""
    lines = []
    for name, now in measured.items():
        if name not in stored:
            lines.append(f"{name}: {now:.3g}, and none is stored")
        elif not stored[name] / factor <= now <= stored[name] * factor:
            lines.append(f"{name}: {now:.3g} instead of {stored[name]:.3g}")
    return lines + [f"{name}: stored, but not measured" for name in stored if name not in measured]


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--store", action="store_true", help=f"write what is measured to {STORED.name}")
    options = parser.parse_args(arguments)
    stored = json.loads(STORED.read_text(encoding="utf-8"))
    measured = {}
    for case in CASES:
        if case.compiles and not any(map(shutil.which, (os.environ.get("CC", ""), "cc", "gcc", "clang"))):
            print(f"no C compiler{'':23}{case.name}")
            stored.pop(case.name, None)
            continue
        measured[case.name] = ratio(case)
        print(f"{measured[case.name]:8.3f}  {stored.get(case.name, float('nan')):8.3f} stored  {case.name}", flush=True)
    if options.store:
        STORED.write_text(json.dumps({n: float(f"{r:.3g}") for n, r in measured.items()}, indent=1) + "\n")
        return 0
    found = changes(stored, measured)
    print(*found or [f"all within a factor of {FACTOR:g}"], sep="\n")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
