"""Time and memory by number of keyframes: symmotion, what a user would pick instead, and the machine's limit."""

from collections.abc import Sequence
from dataclasses import dataclass

import symmotion as sm
from studies.solving.scaling_figure import cost_figure, phases_figure
from studies.solving.scaling_limit import Division, divide, division_table, load_note, machine_table, rates
from studies.solving.scaling_tables import (
    METHODS,
    OTHERS,
    OURS,
    Method,
    certified,
    long_table,
    methods_table,
    of_method,
    repeated_table,
    slope,
    times_table,
    why_not,
)
from studies.solving.scaling_worker import ANGLE, SEED, Budget, Measurement, Nursery, case, measure
from symmotion.report import Run, Study, StudyOptions, StudyResult

NOISE = 0.1  # of a time: less growth between two sizes cannot be told from none


@dataclass(frozen=True)
class Extent:
    """How far a form of the study goes.

    sizes: for all methods; ours: further ones for ExactNewton; profiled: where the time is divided up;
    left_out: methods.
    """

    sizes: tuple[int, ...]
    ours: tuple[int, ...]
    profiled: int
    budget: Budget
    left_out: tuple[str, ...] = ()


QUICK = Extent((4, 20, 100), (1000,), 1000, Budget(1.5, 2048), ("ipopt-plain",))
FULL = Extent((4, 10, 30, 100, 300, 1000, 3000, 10_000), (30_000, 100_000), 1000, Budget(60.0, 8192))


def run(options: StudyOptions) -> StudyResult:
    return compare_scaling(FULL if options.full else QUICK, options)


def compare_scaling(extent: Extent, options: StudyOptions) -> StudyResult:
    """The study to the extent asked for."""
    methods = tuple(m for m in METHODS if m.name not in extent.left_out)
    measured: list[Measurement] = []
    load = load_note()
    with Nursery() as nursery:
        for method in methods:
            sizes = extent.sizes + (extent.ours if method in OURS else ())
            measured += _grow(method, sizes, extent.budget, options, nursery)
    options.progress("the machine's limit")
    machine = rates()
    limit, division = divide(sm.examples.random_keyframes(extent.profiled, ANGLE, SEED), machine)
    figures = (cost_figure(measured, [m.name for m in methods], limit, extent.budget), phases_figure(division))
    tables = (
        methods_table(measured, methods),
        times_table(measured, methods),
        repeated_table(measured),
        long_table(measured),
        division_table(division, limit),
        machine_table(machine, limit),
    )
    runs = tuple(m.run for m in measured)
    text, notes = _conclusion(measured, division), (_note(extent), load)
    return StudyResult(tables, figures, runs, text, notes, answer=_answer(measured, division))


def _grow(
    method: Method, sizes: Sequence[int], budget: Budget, options: StudyOptions, nursery: Nursery
) -> list[Measurement]:
    """The measurements of one method up to the size at which it is stopped, or is bound to be."""
    found: list[Measurement] = []
    for size in sizes:
        expected = _expected(found[-2:], size)
        if expected is not None and expected > budget.seconds:
            last = found[-1]
            why = f"not tried: {last.run.seconds.total:.2g} s for {last.keyframes:,} keyframes"
            row = Run.failed(case(size), method.name, repr(method.solver), "skipped", why)
            return [*found, Measurement(method.name, size, row, stopped=why)]
        options.progress(f"{method.name}, {size} keyframes")
        found.append(measure(method.name, method.solver, size, budget, nursery))
        if found[-1].stopped:
            break
    return found


def _expected(pair: Sequence[Measurement], size: int) -> float | None:
    """Seconds at a size if they grow no faster than they did between two smaller ones; None for fewer than two."""
    if len(pair) < 2:
        return None
    (few, brief), (many, long) = ((m.keyframes, m.run.seconds.total) for m in pair)
    return long + (size - many) * max(long - brief, NOISE * long) / (many - few)


def _answer(measured: Sequence[Measurement], division: Division) -> str:
    ours = [m for method in OURS for m in certified(measured, method.name)]
    last = max(ours, key=lambda m: m.keyframes, default=None)
    reach = (
        f"ExactNewton builds and solves {last.keyframes:,} keyframes in {last.seconds:.3g} s and {last.memory:.4g} MB"
        if last
        else f"ExactNewton is certified in 0 of {len(measured)} measurements"
    )
    return (
        f"{reach}; at {division.keyframes:,} a solve takes {division.factor('compiled'):.3g} times the limit of one "
        f"core with compiled kernels, {division.factor('interpreted'):.3g} times with interpreted ones."
    )


def _conclusion(measured: Sequence[Measurement], division: Division) -> str:
    return "\n\n".join((_reach(measured), _growth(measured), _remaining(division)))


def _reach(measured: Sequence[Measurement]) -> str:
    """How far ExactNewton gets, and how much longer the others take where they stop."""
    grown, lines = [], []
    for method in OURS:
        for m in certified(measured, method.name)[-1:]:
            grown.append(f"{m.seconds:.3g} s and {m.memory:.4g} MB for {m.keyframes:,} keyframes with {method.short}")
    for method in OTHERS:
        done = certified(measured, method.name)
        if not done:
            continue
        last = done[-1]
        same = [next((m for m in certified(measured, o.name) if m.keyframes == last.keyframes), None) for o in OURS]
        times = [last.seconds / m.seconds for m in same if m and m.seconds and last.seconds]
        ratios = " and ".join(f"{t:.3g}" if t < 100 else f"{t:,.0f}" for t in times)
        lines.append(f"{method.name} {ratios} at {last.keyframes:,}")
    return (
        f"ExactNewton takes {' and '.join(grown)}. How many times as long the others take at the largest size that "
        f"each gets to, beside {' and '.join(m.short for m in OURS)}: {'; '.join(lines)}."
    )


def _growth(measured: Sequence[Measurement]) -> str:
    slopes = [f"{m.name} {v:.2f}" for m in METHODS if (v := slope(of_method(measured, m.name), "seconds")) is not None]
    wrong = [f"{m.method} at {m.keyframes:,}, {why_not(m)}" for m in measured if not m.stopped and not m.seconds]
    return (
        f"The time grows with the number of keyframes to the power: {', '.join(slopes)}. Runs that ended by "
        f"themselves without a certified minimum: {'; '.join(wrong) or 'none'}."
    )


def _remaining(division: Division) -> str:
    """Where the factor to the limit goes."""
    most = max(division.compiled, key=division.excess)
    least = f" where {1e3 * division.limit[most]:.3g} ms are the least" if most in division.limit else ""
    return (
        f"At {division.keyframes:,} keyframes one thread takes {division.factor('interpreted'):.3g} times the "
        f"limit of one core with interpreted kernels and {division.factor('compiled'):.3g} times with compiled ones. "
        f"With these the largest part of the excess is {most}, {division.excess(most):.3g} %: it takes "
        f"{1e3 * division.compiled[most]:.3g} ms{least}."
    )


def _note(extent: Extent) -> str:
    left_out = f" The quick form leaves out {', '.join(extent.left_out)}." if extent.left_out else ""
    return (
        f"R, cubic, in space, one knot per segment, neighbours turned by {ANGLE}°, tolerance 1e-8, all from the same "
        f"start. Every method and size in a process of its own, stopped after {extent.budget.seconds:g} s or at "
        f"{extent.budget.megabytes:g} MB; larger sizes are not tried then, nor where a straight line through the two "
        f"before exceeds the budget. All multipliers are the methods' own, all certificates are symmotion's.{left_out}"
    )


STUDY = Study(
    "scaling",
    "How do time and memory grow with the number of keyframes, and what would other tools take?",
    "HJK 4, against CasADi's and SciPy's solvers as their users write the problem",
    run,
    alone=True,
    order=6,
)
