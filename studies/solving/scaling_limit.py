"""What the machine could do at best, and where the time goes instead."""

import os
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from time import perf_counter
from types import FrameType

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

# The groups of symmotion that do each part of the method; all else: the solver's loop, and what it leaves to others.
PHASES = {"evaluation": ("symmotion.kernels", "symmotion.program"), "factorisation": ("symmotion.systems",)}
ONCE, REST = "build and structure, once", "all else"


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


def _best(task: Callable[[], object]) -> float:
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


def work(program: sm.program.Program) -> Work:
    """The work of a program with a condensed system, counted from its kernels and tables."""
    system = Condensed.of(program)
    if system is None:
        raise sm.InputError("the work is counted for programs with a condensed system: insert a knot per segment")
    kernels = assembly = tables = 0.0
    for block, local in zip(program.terms, system.pattern.tables, strict=True):
        kernels += block.count * operations(block)
        # Each pair of the controls that an element reads sums its nodes' Hessians, weighted by basis products:
        # counted as products of matrices, of which the passes do half, since Hessians are symmetric.
        controls = local.columns.shape[1]
        pairs, inner = controls * (controls + 1) // 2, block.nodes * block.kernel.rows**2
        assembly += 2 * block.elements * pairs * inner * block.kernel.channels**2
        tables += block.elements * pairs * (inner + block.kernel.channels**2)
    bands = system.size * (system.band + 1)
    return Work(
        {"evaluation": kernels + assembly, "factorisation": system.size * float(system.band) ** 2},
        {"evaluation": DOUBLE * tables, "factorisation": 2 * DOUBLE * bands},
    )


def operations(block: Block) -> int:
    """Arithmetic operations of a term's gradient and Hessian at one node."""
    function = block.kernel.function("hessian")
    moves = (ca.OP_CONST, ca.OP_INPUT, ca.OP_OUTPUT, ca.OP_PARAMETER)
    return sum(function.instruction_id(k) not in moves for k in range(function.n_instructions()))


def evaluations(solution: sm.Solution) -> int:
    """How often gradient and Hessian were evaluated at least: at every iterate, and for the certificate."""
    return len(solution.log) + 1


def spent(task: Callable[[], object]) -> dict[str, float]:
    """Seconds of a task by phase, by the group of symmotion whose function is the innermost one that runs.

    Of one thread, under a profiler.
    """
    totals = dict.fromkeys((*PHASES, REST), 0.0)
    stack, last = [REST], perf_counter()

    def note(frame: FrameType, event: str, _: object) -> None:
        nonlocal last
        totals[stack[-1]] += perf_counter() - last
        if event == "call":
            # What others' code does counts to who called it.
            stack.append(_phase(frame.f_globals.get("__name__", "")) or stack[-1])
        elif event == "return" and len(stack) > 1:
            stack.pop()
        last = perf_counter()

    sys.setprofile(note)
    try:
        task()
    finally:
        sys.setprofile(None)
    return totals


@cache
def _phase(module: str) -> str | None:
    """The phase of a module of symmotion, None for others."""
    if not module.startswith("symmotion."):
        return None
    room = ".".join(module.split(".")[:2])
    return next((phase for phase, rooms in PHASES.items() if room in rooms), REST)


def prepared(keys: sm.Keyframes) -> sm.program.Program:
    """A program with what its solves share: the condensed system, and what is made of the constant Jacobian."""
    program = sm.affine_program(keys)
    Condensed.of(program)
    sm.certify(program, program.x0, np.zeros(program.conditions))
    return program


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
    program, runs = prepared(keys), {}
    once = min(sum(spent(lambda: prepared(keys)).values()) for _ in range(TRIALS))
    for kernels in ("interpreted", "compiled"):
        solver = sm.ExactNewton(kernels=kernels, threads=1)
        solution = solver.solve(program)  # compiles, too, where that was not done before
        parts = spent(lambda solver=solver: solver.solve(program))
        runs[kernels] = {**{p: parts[p] for p in PHASES}, ONCE: once, REST: parts[REST]}
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
    groups = ", ".join(f"{phase} {' and '.join(rooms)}" for phase, rooms in PHASES.items())
    caption = (
        f"Build and solve of {division.keyframes:,} keyframes on one thread under a profiler, by the group of "
        f"symmotion whose function is the innermost one that runs: {groups}. What is made once, the program and what "
        "its solves share, is measured apart. The limit counts the arithmetic operations and bytes of "
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
