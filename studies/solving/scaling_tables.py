"""The tables of the study `scaling`, and the methods that it compares."""

from collections.abc import Sequence
from dataclasses import dataclass
from statistics import median
from typing import Any

import numpy as np

import symmotion as sm
from studies.solving.scaling_alternatives import OptiIpopt, Sqpmethod, TrustConstr
from studies.solving.scaling_fatrop import Fatrop
from studies.solving.scaling_worker import Measurement
from symmotion.report import Column, Table


@dataclass(frozen=True)
class Method:
    """A competitor: its name, what it is, the solver or alternative that does it, and its kernels in prose."""

    name: str
    what: str
    solver: Any
    short: str = ""


OURS = (
    Method(
        "newton",
        "ExactNewton, interpreted kernels, one thread",
        sm.ExactNewton(kernels="interpreted", threads=1),
        "interpreted kernels on one thread",
    ),
    Method(
        "newton-compiled",
        "ExactNewton, compiled kernels, two threads",
        sm.ExactNewton(kernels="compiled", threads=2),
        "compiled ones on two",
    ),
)
OTHERS = (
    Method("ipopt", "IPOPT with symmotion's batched derivatives", sm.Ipopt(kernels="compiled")),
    Method("elimination", "interpolation conditions eliminated, damped Newton (HJK 4)", sm.Elimination()),
    Method("opti-mx", "CasADi: Opti, matrix symbols, IPOPT", OptiIpopt("MX")),
    Method("opti-sx", "CasADi: Opti, expanded to scalars, IPOPT", OptiIpopt("SX")),
    Method("ipopt-plain", "CasADi: Opti, a loop over the nodes, expanded, IPOPT", sm.solvers.PlainIpopt()),
    Method("sqpmethod", "CasADi: sqpmethod, exact Hessian, qrqp", Sqpmethod()),
    Method("fatrop", "CasADi: fatrop, put as optimal control", Fatrop()),
    Method("trust-constr", "SciPy: trust-constr, CasADi's derivatives", TrustConstr()),
)
METHODS = (*OURS, *OTHERS)


def slope(measured: Sequence[Measurement], of: str) -> float | None:
    """The exponent of keyframes in "seconds" or "beyond", over the largest decade reached; None for a single point."""
    points = [(m.keyframes, getattr(m, of)) for m in measured if m.seconds and getattr(m, of)]
    largest = max((k for k, _ in points), default=0)
    decade = [(k, v) for k, v in points if 10 * k >= largest]
    if len(decade) < 2:
        return None
    counts, values = np.log(np.array(decade, dtype=float)).T
    return float(np.polyfit(counts, values, 1)[0])


def of_method(measured: Sequence[Measurement], name: str) -> list[Measurement]:
    return [m for m in measured if m.method == name]


def certified(measured: Sequence[Measurement], name: str) -> list[Measurement]:
    """The certified measurements of a method, smallest first."""
    return [m for m in of_method(measured, name) if m.seconds]


def why_not(m: Measurement) -> str:
    """Why a measurement is not certified."""
    if m.run.inertia == "indefinite":
        return "a saddle point"
    return m.stopped or m.run.message or f"{m.run.status}, inertia {m.run.inertia}"


def methods_table(measured: Sequence[Measurement], methods: Sequence[Method]) -> Table:
    rows = []
    for method in methods:
        mine, done = of_method(measured, method.name), certified(measured, method.name)
        last = done[-1] if done else None
        rows.append(
            (
                method.name,
                method.what,
                last.keyframes if last else None,
                last.seconds if last else None,
                last.memory if last else None,
                slope(mine, "seconds"),
                slope(mine, "beyond"),
                done[0].first if done else None,
                "; ".join(f"{m.keyframes:,}: {why_not(m)}" for m in mine if not m.seconds),
            )
        )
    columns = (
        Column("method"),
        Column("what it is"),
        Column("reaches", "keyframes"),
        Column("time", "s"),
        Column("memory", "MB"),
        Column("slope, time"),
        Column("slope, memory"),
        Column("first solve", "s"),
        Column("not certified"),
    )
    caption = (
        "The largest size at which each method returned a certified minimum within the budget, and time and memory of "
        "the whole process there. Slopes are exponents of the number of keyframes, fitted over the largest decade "
        "reached, that of memory beyond what imports take. The first solve, of the smallest problem, pays for what a "
        "process or a kernel needs once; the other times are medians where a solve is quick."
    )
    return Table("methods", columns, tuple(rows), caption)


def times_table(measured: Sequence[Measurement], methods: Sequence[Method]) -> Table:
    at = {(m.method, m.keyframes): m.seconds for m in measured}
    sizes = sorted({m.keyframes for m in measured})
    rows = tuple((size, *(at.get((m.name, size)) for m in methods)) for size in sizes)
    columns = (Column("keyframes"), *(Column(m.name, "s") for m in methods))
    return Table("build and solve", columns, rows, "Missing: stopped, not tried or not certified; the runs say which.")


def repeated_table(measured: Sequence[Measurement]) -> Table:
    """How far repetitions of the same solve are apart, where it is quick enough to be repeated."""
    rows = [
        (m.keyframes, m.method, len(m.repeated), 1e3 * median(m.repeated), 1e3 * min(m.repeated), 1e3 * max(m.repeated))
        for m in sorted(measured, key=lambda m: m.keyframes)
        if m.seconds and len(m.repeated) > 1
    ]
    columns = (
        Column("keyframes"),
        Column("method"),
        Column("repetitions"),
        Column("median", "ms"),
        Column("least", "ms", end=True),
        Column("most", "ms", end=True),
    )
    caption = "The other tables have the solve next to the median; times that are not here are those of one solve."
    return Table("repetitions", columns, tuple(rows), caption)


def long_table(measured: Sequence[Measurement]) -> Table:
    rows = []
    for method in OURS:
        done = [m for m in certified(measured, method.name) if m.keyframes >= 100]
        base = next((m for m in done if m.keyframes == 1000), None)
        for m in done:
            each = (m.seconds or 0.0) / m.keyframes
            ratio = each / ((base.seconds or 0.0) / base.keyframes) if base else None
            rows.append((method.name, m.keyframes, m.seconds, 1e6 * each, ratio, m.memory, m.run.iterations))
    columns = (
        Column("method"),
        Column("keyframes"),
        Column("build and solve", "s"),
        Column("per keyframe", "µs"),
        Column("relative to 1,000"),
        Column("memory", "MB"),
        Column("iterations"),
    )
    return Table("long motions", columns, tuple(rows), "ExactNewton, R, cubic, in space, one knot per segment.")
