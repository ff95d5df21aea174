"""What the machine could do at best, and where the time goes instead."""

import os
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter
from types import CodeType, FrameType
from typing import Any

import casadi as ca
import numpy as np

import symmotion as sm
from symmotion.program import Block
from symmotion.report import Cell, Column, Table
from symmotion.systems import Condensed

DOUBLE = 8  # bytes
SIZE = 768  # of the matrices whose product shows the arithmetic rate; 14 MB, more than most caches
STREAM = 8_000_000  # numbers in each array of the stream, far more than a cache
TRIALS = 5  # the best of them counts: others use the machine, too

# What belongs to which part of the method, by the file that the code is in …
PHASES = {
    "kernels": ("kernels/kernel.py", "kernels/mapped.py", "kernels/compiled.py", "kernels/source.py"),
    "assembly": ("program/block.py", "program/evaluate.py"),
    "factorisation": ("systems/condensed.py",),
}
# … but for what is made once for a program, wherever it is made.
ONCE = ("LocalTables.", "Condensed.__init__", "Condensed._pattern", "_condense", "shared_conditions")
STRUCTURE, REST = "structure, once", "all else"


@dataclass(frozen=True)
class Rates:
    """One core of this machine: flops, operations per second in products of matrices; bandwidth, bytes per second."""

    flops: float
    bandwidth: float


def rates() -> Rates:
    """Measured now: products of large matrices and the triad a = b + s c, the best of several trials."""
    rng = np.random.default_rng(0)
    a, b = rng.normal(size=(2, SIZE, SIZE))
    out = np.empty_like(a)
    product = _best(lambda: np.matmul(a, b, out=out))
    x, y, z = rng.normal(size=(3, STREAM))

    def triad() -> None:
        np.multiply(y, 3.0, out=z)
        np.add(z, x, out=z)

    # NumPy takes two passes: one array read and one written, two read and one written.
    return Rates(2 * SIZE**3 / product, 5 * STREAM * DOUBLE / _best(triad))


def _best(task: Callable[[], Any]) -> float:
    task()
    seconds = []
    for _ in range(TRIALS):
        began = perf_counter()
        task()
        seconds.append(perf_counter() - began)
    return min(seconds)


def load_note() -> str:
    """How busy the machine is with others' work before a study begins: timings follow it."""
    if not hasattr(os, "getloadavg"):
        return f"{os.cpu_count()} processors, load unknown."
    busy = f"{os.getloadavg()[0]:.2g} processes were running or waiting to"
    return f"{os.cpu_count()} processors; when the study began, {busy}."


@dataclass(frozen=True)
class Work:
    """What one evaluation of gradient and Hessian, and one factorisation, take at least: by phase.

    operations: floating-point ones; bytes: read or written where they do not fit a cache.
    """

    operations: Mapping[str, float]
    bytes: Mapping[str, float]

    def seconds(self, machine: Rates) -> dict[str, float]:
        """By phase the larger of arithmetic and memory traffic at the machine's rates."""
        return {p: max(self.operations[p] / machine.flops, self.bytes[p] / machine.bandwidth) for p in self.operations}


def work(program: sm.Program) -> Work:
    """The work of a program with a condensed system, counted from its kernels and tables."""
    system = Condensed.of(program)
    if system is None:
        raise sm.InputError("the work is counted for programs with a condensed system: insert a knot per segment")
    kernels = assembly = tables = 0.0
    for block, local in zip(program.terms, system.pattern.tables, strict=True):
        kernels += block.count * operations(block)
        # Each pair of the controls that an element reads sums its nodes' Hessians, weighted by basis products.
        controls = local.columns.shape[1]
        pairs, inner = controls * (controls + 1) // 2, block.nodes * block.kernel.rows**2
        assembly += 2 * block.elements * pairs * inner * block.kernel.channels**2
        tables += block.elements * pairs * (inner + block.kernel.channels**2)
    bands = system.size * (system.band + 1)
    return Work(
        {"kernels": kernels, "assembly": assembly, "factorisation": system.size * float(system.band) ** 2},
        {"kernels": 0.0, "assembly": DOUBLE * tables, "factorisation": 2 * DOUBLE * bands},
    )


def operations(block: Block) -> int:
    """Arithmetic operations of a term's gradient and Hessian at one node."""
    function = block.kernel.function("hessian")
    moves = (ca.OP_CONST, ca.OP_INPUT, ca.OP_OUTPUT, ca.OP_PARAMETER)
    return sum(function.instruction_id(k) not in moves for k in range(function.n_instructions()))


def evaluations(solution: sm.Solution) -> int:
    """How often gradient and Hessian were evaluated at least: at every iterate, and for the certificate."""
    return len(solution.log) + 1


def spent(task: Callable[[], Any]) -> dict[str, float]:
    """Seconds of a task by phase, by the innermost function of symmotion that is running; one thread's."""
    totals = dict.fromkeys((*PHASES, STRUCTURE, REST), 0.0)
    stack, last = [REST], perf_counter()
    known: dict[CodeType, str | None] = {}

    def note(frame: FrameType, event: str, _: Any) -> None:
        nonlocal last
        now = perf_counter()
        totals[stack[-1]] += now - last
        if event == "call":
            code = frame.f_code
            if code not in known:
                known[code] = _phase(code)
            # What others' code does counts to who called it.
            stack.append(known[code] or stack[-1])
        elif event == "return" and len(stack) > 1:
            stack.pop()
        last = perf_counter()

    sys.setprofile(note)
    try:
        task()
    finally:
        sys.setprofile(None)
    return totals


def _phase(code: CodeType) -> str | None:
    """The phase of a function of symmotion, None for others."""
    name, home = Path(code.co_filename), Path(sm.__file__).parent
    if not name.is_relative_to(home):
        return None
    if code.co_qualname.startswith(ONCE):
        return STRUCTURE
    part = name.relative_to(home).as_posix()
    return next((phase for phase, files in PHASES.items() if part in files), REST)


@dataclass(frozen=True)
class Limit:
    """The least seconds of one evaluation and factorisation per segment, how often they are needed, on one core."""

    per_segment: float
    evaluations: int

    def seconds(self, keyframes: int) -> float:
        return self.per_segment * (keyframes - 1) * self.evaluations


@dataclass(frozen=True)
class Division:
    """A run divided up: seconds by phase of the limit, and of interpreted and compiled kernels on one thread."""

    keyframes: int
    limit: dict[str, float]
    interpreted: dict[str, float]
    compiled: dict[str, float]

    @property
    def named(self) -> dict[str, dict[str, float]]:
        return {"limit": self.limit, "interpreted": self.interpreted, "compiled": self.compiled}

    def factor(self, kernels: str) -> float:
        """How many times the limit all of it takes."""
        return sum(self.named[kernels].values()) / sum(self.limit.values())

    def excess(self, phase: str) -> float:
        """The phase's percentage of what the compiled run takes beyond the limit."""
        beyond = sum(self.compiled.values()) - sum(self.limit.values())
        return 100 * (self.compiled[phase] - self.limit.get(phase, 0.0)) / beyond


def divide(keys: sm.Keyframes, machine: Rates) -> tuple[Limit, Division]:
    """The limit of the problem through these keyframes, and where the time of its runs goes."""
    program, runs = sm.affine_program(keys), {}
    for kernels in ("interpreted", "compiled"):
        solver = sm.ExactNewton(kernels=kernels, threads=1)
        solution = solver.solve(program)  # compiles, too, where that was not done before
        runs[kernels] = spent(lambda solver=solver: solver.solve(sm.affine_program(keys)))
    times, least = evaluations(solution), work(program).seconds(machine)
    limit = Limit(sum(least.values()) / (len(keys) - 1), times)
    return limit, Division(len(keys), {p: times * s for p, s in least.items()}, **runs)


def division_table(division: Division, limit: Limit) -> Table:
    """The phases of a run against the limit."""
    rows: list[tuple[Cell, ...]] = []
    for phase in division.compiled:
        least, parts = division.limit.get(phase), (division.interpreted[phase], division.compiled[phase])
        factors = [part / least if least else None for part in parts]
        known = None if least is None else 1e3 * least
        rows.append((phase, known, *(1e3 * part for part in parts), *factors, division.excess(phase)))
    totals = [1e3 * sum(parts.values()) for parts in division.named.values()]
    rows.append(("all", *totals, division.factor("interpreted"), division.factor("compiled"), 100.0))
    columns = (
        Column("part"),
        Column("limit", "ms"),
        Column("interpreted", "ms"),
        Column("compiled", "ms"),
        Column("interpreted / limit"),
        Column("compiled / limit"),
        Column("of the compiled excess", "%"),
    )
    caption = (
        f"Build and solve of {division.keyframes:,} keyframes on one thread under a profiler, by the innermost "
        "function of symmotion that is running. The limit counts the arithmetic operations and bytes of "
        f"{limit.evaluations} evaluations and factorisations at the rates of one core."
    )
    return Table("where the time goes", columns, tuple(rows), caption)


def machine_table(machine: Rates, limit: Limit) -> Table:
    """What the limit is computed from."""
    rows = (
        ("products of matrices, one core", 1e-9 * machine.flops, "Gflop/s"),
        ("memory bandwidth, one core", 1e-9 * machine.bandwidth, "GB/s"),
        ("limit per segment and evaluation", 1e6 * limit.per_segment, "µs"),
        ("evaluations and factorisations", limit.evaluations, ""),
    )
    return Table("machine", (Column("what"), Column("measured"), Column("unit")), rows)
