"""Fairing over seeds and knot spacings: steps to PCG's target, forms of the step, and G at equal displacement."""

from collections.abc import Callable
from dataclasses import dataclass
from time import process_time

import numpy as np

from studies.fairing.fairing_nets import counts_table, fairness, quartiles, rms
from studies.fairing.pareto import at_displacement
from studies.shares import paired, ratio, spread
from symmotion.fairing import FairingResult, Method, fair
from symmotion.motions import TwoParameterMotion, noisy_net, smooth_net
from symmotion.report import Column, Figure, Table, to_figure
from symmotion.splines import BSplineBasis
from symmotion.views import COLOURS, new_figure

N = 15  # controls in each direction, as PCG's
INITIAL, TARGET, PCG_STEPS = 7.84, 0.002, 1930
SPACINGS = ("uniform", "graded 1 : 4", "random ½ to 3/2")
# Of the noise: RMS displacements at which methods are compared, how close they are met, and halvings of a bound.
LEVELS, MET, HALVINGS = (0.5, 0.75, 1.0), 0.05, 6
LOCAL: tuple[Method, ...] = ("greedy", "orthogonal")


@dataclass(frozen=True)
class Extent:
    """How much is done: seeds, of which some at equal displacement, or with bounds; steps as programs, and all."""

    seeds: int
    equal: int
    levels: tuple[float, ...]
    bounded: int
    steps: int
    whole: bool


QUICK, FULL = Extent(8, 2, LEVELS[1:2], 0, 5, False), Extent(24, 24, LEVELS, 8, 100, True)


@dataclass(frozen=True, eq=False)
class Case:
    """A noisy net whose G is PCG's, and its smooth original."""

    spacing: str
    seed: int
    smooth: TwoParameterMotion
    net: TwoParameterMotion

    @property
    def noise(self) -> float:
        """The RMS displacement between the two."""
        return rms(np.linalg.norm(self.net.real - self.smooth.real, axis=-1))


def case(spacing: str, seed: int) -> Case:
    """The net of a spacing and a seed, of the knots as of the noise."""
    count = N + 3
    steps = {
        SPACINGS[0]: np.ones(count),
        SPACINGS[1]: np.geomspace(1.0, 4.0, count),
        SPACINGS[2]: np.random.default_rng([seed, 1]).uniform(0.5, 1.5, count),
    }[spacing]
    knots = BSplineBasis(np.concatenate([[0.0], np.cumsum(steps / steps.mean())]), 3)
    smooth, sigma = smooth_net(N, knots=knots), 0.01
    for _ in range(3):  # the smooth net's own jumps are a small part of G
        sigma *= np.sqrt(INITIAL / fairness(noisy_net(smooth, sigma, seed=seed)))
    return Case(spacing, seed, smooth, noisy_net(smooth, sigma, seed=seed))


@dataclass(frozen=True, eq=False)
class Seeds:
    """What was found.

    steps: by spacing and method the steps to the target (seeds,), ∞ where it was not reached; forms: by spacing, CPU
    seconds of program and closed form over as many steps, and how far their nets are apart; equal: by spacing, level
    and method G (seeds,) at that displacement, nan where a method cannot have it; whole: of one run by programs.
    """

    extent: Extent
    steps: dict[tuple[str, str], np.ndarray]
    forms: dict[str, list[tuple[float, float, float]]]
    equal: dict[tuple[str, float, str], np.ndarray]
    whole: tuple[FairingResult, FairingResult] | None


def study(full: bool, progress: Callable[[str], None]) -> Seeds:
    """Every method on every net."""
    extent = FULL if full else QUICK
    steps: dict[tuple[str, str], np.ndarray] = {}
    forms: dict[str, list[tuple[float, float, float]]] = {}
    equal: dict[tuple[str, float, str], np.ndarray] = {}
    whole = None
    for spacing in SPACINGS:
        cases = [case(spacing, seed) for seed in range(extent.seeds)]
        found = {}
        for method in LOCAL:
            progress(f"{spacing} knots, {method}")
            found[method] = [fair(c.net, method, target=TARGET, max_steps=20_000) for c in cases]
            steps[spacing, method] = np.array([r.steps if r.final <= TARGET else np.inf for r in found[method]])
        progress(f"{spacing} knots, steps as programs")
        forms[spacing] = [_forms(c, extent.steps) for c in cases[: extent.seeds if full else 1]]
        for level in extent.levels:
            progress(f"{spacing} knots, displacement {level:g} of the noise")
            some = cases[: extent.equal]
            for method in LOCAL:
                ends = zip(some, found[method], strict=False)
                equal[spacing, level, method] = np.array(
                    [_stepped(c, method, level * c.noise, r.steps) for c, r in ends]
                )
            equal[spacing, level, "least squares"] = np.array([_least(c, level * c.noise) for c in some])
            bounded = [_bounded(c, level * c.noise) for c in cases[: extent.bounded]]
            equal[spacing, level, "bounded"] = np.array(bounded)
    if extent.whole:
        progress("all steps as programs")
        net = case(SPACINGS[0], 0).net
        whole = fair(net, "greedy", target=TARGET, form="program"), fair(net, "greedy", target=TARGET)
    return Seeds(extent, steps, forms, equal, whole)


def _forms(c: Case, steps: int) -> tuple[float, float, float]:
    """CPU seconds of as many greedy steps as programs and in closed form, and the largest difference of the nets."""
    seconds, nets = [], []
    for form in ("program", "closed"):
        began = process_time()
        r = fair(c.net, "greedy", max_steps=steps, form=form)
        seconds.append(process_time() - began)
        nets.append(r.motion.real)
    return seconds[0], seconds[1], float(np.abs(nets[0] - nets[1]).max())


def _stepped(c: Case, method: Method, wanted: float, most: int) -> float:
    """G after as many steps as displace by what is wanted; nan where no number of steps does."""
    found = at_displacement(c.net, method, wanted, 2 * most)
    moved = rms(np.linalg.norm(found.real - c.net.real, axis=-1))
    return fairness(found) if abs(moved - wanted) < MET * wanted else np.nan


def _least(c: Case, wanted: float) -> float:
    """The least G of all nets that are displaced by this: a point of the front between the two."""
    inner = 4 * (N - 2) ** 2
    return fair(c.net, "least-squares", noise=wanted * N / inner**0.5).final


def _bounded(c: Case, wanted: float) -> float:
    """G of the program with a bound for every control, such that all together are displaced by this."""
    low, high, nearest = wanted, 4 * wanted, (np.inf, np.nan)
    for _ in range(HALVINGS):
        bound = 0.5 * (low + high)
        r = fair(c.net, "bounded", tolerance=bound)
        moved = rms(r.displacement)
        if abs(moved - wanted) < abs(nearest[0] - wanted):
            nearest = moved, r.final
        low, high = (bound, high) if moved < wanted else (low, bound)
    return nearest[1] if abs(nearest[0] - wanted) < MET * wanted else np.nan


def tables(found: Seeds) -> tuple[Table, ...]:
    """Steps to the target, forms, and G at equal displacement."""
    return _steps_table(found), _forms_table(found), _equal_table(found)


def _steps_table(found: Seeds) -> Table:
    rows = []
    for (spacing, method), steps in found.steps.items():
        reached = steps[np.isfinite(steps)]
        rows.append((f"{spacing} knots, {method}", len(reached), len(steps), *quartiles(reached)))
    return counts_table(tuple(rows), PCG_STEPS)


def _forms_table(found: Seeds) -> Table:
    rows = []
    for spacing, values in found.forms.items():
        programs, closed, apart = (np.array(v) for v in zip(*values, strict=True))
        scaled = found.extent.steps, 1e6 * np.median(programs) / found.extent.steps, 1e6 * np.median(closed)
        rows.append((spacing, len(values), *scaled, *ratio(programs, closed), float(apart.max())))
    columns = (
        Column("knots"),
        Column("nets"),
        Column("steps"),
        Column("a step as a program", "µs"),
        Column("all steps, closed form", "µs"),
        Column("ratio of all"),
        Column("from", end=True),
        Column("to", end=True),
        Column("nets apart by"),
    )
    caption = (
        "The Lagrangian step with explicit multipliers as a program of symbols, solved by Newton's method, beside its "
        "closed form: the same steps. CPU; ratio: geometric mean with its 95 % interval over nets."
    )
    return Table("forms of the step", columns, tuple((*r[:3], float(r[3]), float(r[4]), *r[5:]) for r in rows), caption)


def _equal_table(found: Seeds) -> Table:
    rows = []
    for (spacing, level, method), values in found.equal.items():
        had = np.isfinite(values)
        if not had.any():
            continue
        least = found.equal[spacing, level, "least squares"][: len(values)]
        wins = paired((values < least * (1 - 1e-6))[had].tolist(), (least < values * (1 - 1e-6))[had].tolist())
        middle = np.quantile(values[had], (0.5, 0.25, 0.75)).tolist()
        rows.append((spacing, level, method, int(had.sum()), len(values), *middle, *_over(values, least, had), *wins))
    columns = (
        Column("knots"),
        Column("displacement / noise"),
        Column("method"),
        Column("nets"),
        Column("of"),
        Column("G, median"),
        Column("lower quartile"),
        Column("upper quartile"),
        Column("G / least squares'"),
        Column("from", end=True),
        Column("to", end=True),
        Column("fairer"),
        Column("less fair"),
        Column("p"),
    )
    caption = (
        "G where every method has displaced the controls by the same, RMS, met to 5 %: local steps stopped there, the "
        "weight and the bound chosen so. Least squares have the least G there is at a displacement. Ratio: geometric "
        "mean "
        "with its 95 % interval over nets; p: exact sign test."
    )
    return Table("equal displacement", columns, tuple(rows), caption)


def _over(values: np.ndarray, least: np.ndarray, had: np.ndarray) -> tuple[float, float, float]:
    return ratio(values[had], least[had])


def figure(found: Seeds) -> Figure:
    """How the steps to the target are distributed over seeds."""
    with new_figure(7.0, 3.0) as drawn:
        axes = drawn.subplots()
        for k, ((spacing, method), steps) in enumerate(found.steps.items()):
            reached = np.sort(steps)
            share = 100 * np.arange(1, len(reached) + 1) / len(reached)
            style = "-" if method == LOCAL[0] else "--"
            label = f"{method}, {spacing}"
            axes.step(reached, share, style, where="post", color=COLOURS[k // len(LOCAL)], label=label)
        axes.axvline(PCG_STEPS, color="#000000", linewidth=0.7, linestyle=":")
        axes.set_xlabel("steps")
        axes.set_ylabel("nets at the target [%]")
        axes.set_ylim(0, 102)
        drawn.legend(loc="outside upper left", ncols=3)
        caption = (
            f"Share of {found.extent.seeds} nets a spacing that are at PCG's target after some local steps; dotted: "
            "the "
            "1930 that PCG report."
        )
        return to_figure(drawn, "steps-to-the-target", caption)


def told(found: Seeds) -> str:
    """What was found, in a paragraph."""
    count = found.extent.seeds
    steps = [
        f"{method} {spread(values, 4).replace('inf', 'never')} with {spacing} knots"
        for (spacing, method), values in found.steps.items()
    ]

    def of_all(level: float, method: str) -> np.ndarray:
        return np.concatenate([found.equal[s, level, method] for s in SPACINGS])

    # The displacement that most nets have by every method.
    level = max(found.extent.levels, key=lambda v: sum(np.isfinite(of_all(v, m)).sum() for m in LOCAL))
    worse = []
    for method in LOCAL:
        values, least = of_all(level, method), of_all(level, "least squares")
        had = np.isfinite(values)
        middle, low, high = ratio(values[had], least[had])
        worse.append(
            f"{method} steps have {middle:.3g} ({low:.3g}–{high:.3g}) times the G of least squares on "
            f"{had.sum()} of {len(had)} nets"
        )
    text = (
        f"Over {count} seeds of noise and three knot spacings, median (least–most), the target takes "
        f"{'; '.join(steps)}."
        f"\n\nAt an equal displacement of {level:g} of the noise {', '.join(worse)}, which have the least there is. "
        "Each "
        "step as a program of symbols with its two multipliers ends at the net of the closed form, to "
        f"{max(v[2] for values in found.forms.values() for v in values):.1g}."
    )
    if found.whole is not None:
        program, closed = found.whole
        text += (
            f" All {program.steps} steps to the target as programs take {program.seconds:.3g} s, in closed form "
            f"{closed.seconds:.3g} s with {closed.steps} steps."
        )
    return text
