"""Hard keyframes by the hundred: how surely does each solver end at a minimum, and how often at the best one?"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import count, islice
from statistics import median

import numpy as np

import symmotion as sm
from studies.shares import share
from studies.solving.hard_keyframes import KINDS, Problem, problem
from symmotion.report import Column, Figure, Run, Study, StudyOptions, StudyResult, Table, to_figure
from symmotion.views import method_style, new_figure

SOLVERS = (sm.ExactNewton(), sm.Ipopt(), sm.Elimination())
SAME = 1e-6  # relative difference up to which two values are the same optimum
QUICK, FULL = 30, 300  # problems
QUICK_UNKNOWNS = 200  # the most that a problem of the quick form has
# Starts beside the program's own from which the full form looks for better minima, and their spread.
SEARCHES, SPREAD = 4, 0.3


@dataclass(frozen=True)
class Outcome:
    """One solver on one problem.

    certified: the certificate holds to the solver's tolerance and the Hessian is positive
    definite, whatever the solver says of itself; said: whether it says solved.
    """

    kind: str
    case: str
    method: str
    certified: bool
    said: bool
    objective: float
    iterations: int
    seconds: float

    @staticmethod
    def of(task: Problem, solution: sm.Solution) -> "Outcome":
        certified = solution.certificate.holds(solution.tolerance) and solution.inertia == "positive"
        return Outcome(
            task.kind,
            task.name,
            solution.method,
            certified,
            solution.status == "solved",
            solution.objective,
            solution.iterations,
            solution.seconds.total,
        )


def run(options: StudyOptions) -> StudyResult:
    outcomes: list[Outcome] = []
    searched: dict[str, list[float]] = {}
    runs: list[Run] = []
    for seed, task in _tasks(options.full):
        options.progress(task.name)
        for solution in sm.compare(task.program, SOLVERS).solutions:
            outcomes.append(Outcome.of(task, solution))
            runs.append(replace(Run.of(task.name, solution), log=()))
        if options.full:
            searched[task.name] = _search(task, seed)
    optima = {
        case: distinct([o.objective for o in outcomes if o.case == case and o.certified] + searched.get(case, []))
        for case in dict.fromkeys(o.case for o in outcomes)
    }
    tables = (_by_kind(outcomes, optima), _minima(outcomes, optima))
    figures = (_profile(outcomes, optima), _shares(outcomes, optima))
    quick = f"The quick form: {len(optima)} problems of at most {QUICK_UNKNOWNS} unknowns; the long one takes {FULL}."
    conclusion, notes = _conclusion(outcomes, optima, options.full), () if options.full else (quick,)
    good = "; ".join(f"{m} certifies {counted(outcomes, m, lambda o: o.certified)}" for m in _methods(outcomes))
    most = counted(outcomes, "newton", lambda o: _best(o, optima))
    answer = f"Of hard problems {good}; newton ends at the best value known in {most}."
    return StudyResult(tables, figures, tuple(runs), conclusion, notes, answer=answer)


def _tasks(full: bool) -> Iterator[tuple[int, Problem]]:
    """Problems with their seeds: all, or as many of every kind that are small."""
    if full:
        yield from ((seed, problem(seed)) for seed in range(FULL))
        return
    for kind in range(len(KINDS)):
        made = ((seed, problem(seed)) for seed in count(kind, len(KINDS)))
        small = (pair for pair in made if pair[1].program.unknowns <= QUICK_UNKNOWNS)
        yield from islice(small, QUICK // len(KINDS))


def _search(task: Problem, seed: int) -> list[float]:
    """The certified minima that ExactNewton finds from starts about the program's own."""
    rng, x = np.random.default_rng([seed, 1]), task.program.x0
    found = []
    for _ in range(SEARCHES):
        solution = sm.ExactNewton().solve(task.program, start=x + SPREAD * np.std(x) * rng.normal(size=len(x)))
        if solution.status == "solved" and solution.inertia == "positive":
            found.append(solution.objective)
    return found


def distinct(values: Sequence[float]) -> list[float]:
    """The values in increasing order, those alike to SAME counting once."""
    kept: list[float] = []
    for value in sorted(values):
        if not kept or not _same(value, kept[-1]):
            kept.append(value)
    return kept


def _same(value: float, least: float) -> bool:
    return value <= least + SAME * abs(least) + 1e-12


def _best(outcome: Outcome, optima: dict[str, list[float]]) -> bool:
    return outcome.certified and _same(outcome.objective, optima[outcome.case][0])


def _methods(outcomes: Sequence[Outcome]) -> list[str]:
    return list(dict.fromkeys(o.method for o in outcomes))


def _by_kind(outcomes: list[Outcome], optima: dict[str, list[float]]) -> Table:
    rows = []
    for kind in (*KINDS, "all"):
        for method in _methods(outcomes):
            mine = [o for o in outcomes if o.method == method and kind in (o.kind, "all")]
            certified = [o for o in mine if o.certified]
            rows.append(
                (
                    kind,
                    method,
                    len(mine),
                    100 * len(certified) / len(mine),
                    100 * sum(o.said for o in mine) / len(mine),
                    100 * sum(_best(o, optima) for o in mine) / len(mine),
                    median(o.iterations for o in certified) if certified else None,
                    1e3 * median(o.seconds for o in mine),
                    1e3 * max(o.seconds for o in mine),
                )
            )
    columns = (
        Column("keyframes"),
        Column("solver"),
        Column("problems"),
        Column("certified", "%"),
        Column("says solved", "%"),
        Column("best known", "%"),
        Column("iterations"),
        Column("time", "ms"),
        Column("longest", "ms"),
    )
    caption = (
        "Certified: a strict local minimum to 1e-8 by symmotion's certificate at the returned point, whatever the "
        "solver says of itself (Ipopt's own test is absolute, and out of reach where the objective is large). Best "
        "known: certified, and within 1e-6 of the least certified value that anyone found. Iterations, of all "
        "descents together, are medians over the certified runs; times are medians, build and failed runs included."
    )
    return Table("robustness", columns, tuple(rows), caption)


def _minima(outcomes: list[Outcome], optima: dict[str, list[float]]) -> Table:
    kinds = {o.case: o.kind for o in outcomes}
    rows = []
    for kind in (*KINDS, "all"):
        counts = [len(values) for case, values in optima.items() if kind in (kinds[case], "all")]
        several = [v for case, v in optima.items() if kind in (kinds[case], "all") and len(v) > 1]
        ratios = [v[1] / v[0] for v in several if v[0] > 0]
        shares = [sum(c == n for c in counts) for n in (0, 1, 2)]
        rows.append((kind, len(counts), *shares, sum(c > 2 for c in counts), median(ratios) if ratios else None))
    columns = (
        Column("keyframes"),
        Column("problems"),
        Column("no minimum found"),
        Column("one"),
        Column("two"),
        Column("more"),
        Column("second / best"),
    )
    caption = (
        "How many different local minima (certified values further apart than 1e-6) were found per problem, and the "
        "median ratio of the second lowest to the lowest where there are several. There may be more."
    )
    return Table("local minima", columns, tuple(rows), caption)


def _profile(outcomes: list[Outcome], optima: dict[str, list[float]]) -> Figure:
    with new_figure(7.0, 3.0) as figure:
        panels = figure.subplots(1, 2, sharey=True, sharex=True)
        tests = (lambda o: o.certified, lambda o: _best(o, optima))
        for axes, test, title in zip(panels, tests, ("certified", "best known value"), strict=True):
            for method in _methods(outcomes):
                mine = [o for o in outcomes if o.method == method]
                times = np.sort([1e3 * o.seconds for o in mine if test(o)])
                share = 100 * np.arange(1, len(times) + 1) / len(mine)
                axes.step(times, share, where="post", color=method_style(method)[0], label=method)
            axes.set_xscale("log")
            axes.set_ylim(0, 102)
            axes.set_title(title)
            axes.set_xlabel("time [ms]")
        panels[0].set_ylabel("problems [%]")
        figure.legend(*panels[0].get_legend_handles_labels(), loc="outside upper left", ncols=3)
        return to_figure(
            figure, "profile", "Share of the problems done within a time: a certified minimum, and the best one known."
        )


def _shares(outcomes: list[Outcome], optima: dict[str, list[float]]) -> Figure:
    methods = _methods(outcomes)
    with new_figure(7.0, 3.0) as figure:
        axes = figure.subplots()
        for k, method in enumerate(methods):
            for i, kind in enumerate(KINDS):
                mine = [o for o in outcomes if o.method == method and o.kind == kind]
                place, colour = i + 0.27 * (k - 1), method_style(method)[0]
                certified = 100 * sum(o.certified for o in mine) / len(mine)
                best = 100 * sum(_best(o, optima) for o in mine) / len(mine)
                axes.bar(place, certified, 0.25, color=colour, alpha=0.35)
                axes.bar(place, best, 0.25, color=colour, label=method if i == 0 else None)
        axes.set_xticks(range(len(KINDS)), [kind.replace(" ", "\n", 1) for kind in KINDS])
        axes.grid(False, axis="x")
        axes.set_ylabel("problems [%]")
        figure.legend(loc="outside upper left", ncols=3)
        return to_figure(
            figure,
            "shares",
            "Pale: share certified as a local minimum; full: share that reached the best value known, by what makes "
            "the keyframes hard.",
        )


def counted(outcomes: list[Outcome], method: str, test: Callable[[Outcome], bool]) -> str:
    """The share of a method's outcomes that pass a test."""
    mine = [o for o in outcomes if o.method == method]
    return share(sum(map(test, mine)), len(mine))


def _conclusion(outcomes: list[Outcome], optima: dict[str, list[float]], full: bool) -> str:
    lines = [
        f"{method}: certified {counted(outcomes, method, lambda o: o.certified)}, best value known "
        f"{counted(outcomes, method, lambda o: _best(o, optima))}"
        for method in _methods(outcomes)
    ]
    several = sum(len(v) > 1 for v in optima.values())
    seconds = {m: sum(o.seconds for o in outcomes if o.method == m) for m in _methods(outcomes)}
    failed = [o.case for o in outcomes if o.method == "newton" and not o.certified]
    text = (
        f"Over {len(optima)} problems, with 95 % confidence in brackets: {'; '.join(lines)}. "
        f"All together took ExactNewton {seconds['newton']:.3g} s, "
        f"Ipopt {seconds['ipopt']:.3g} s and the elimination {seconds['elimination']:.3g} s.\n\n"
        f"Local minima are the rule: {several} of {len(optima)} problems have more than one that was found"
        f"{', with further starts' if full else ''}. A certificate says that a point is a minimum, not that it is "
        "the lowest; no solver here can."
    )
    if failed:
        text += f"\n\nExactNewton is not certified on {len(failed)}: {'; '.join(failed[:5])}{' …' * (len(failed) > 5)}."
    return text


STUDY = Study(
    "robustness",
    "How surely do the solvers find a minimum where keyframes are hard, and is it the best one?",
    "HJK 4, on keyframes turned by up to 180°, sheared, of very different size, or far from the origin",
    run,
    order=14,
)
