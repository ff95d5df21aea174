"""Hard keyframes by the hundred: how surely does each solver end at a minimum, and how often at the best one?"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cache, partial
from itertools import count, islice
from statistics import median

import numpy as np

import symmotion as sm
from studies.shares import ends, with_interval
from studies.solving.contest import tables
from studies.solving.contest.attempts import SAME, Budget, Contest, Task, alike, contend, start_of
from studies.solving.contest.profiles import colour_of, figure
from studies.solving.hard_keyframes import KINDS, Problem, problem
from studies.solving.solvers import contenders
from symmotion.report import Column, Figure, Run, Study, StudyOptions, StudyResult, Table, to_figure
from symmotion.views import new_figure

QUICK, FULL = 5, 300  # problems
QUICK_UNKNOWNS, SMALL = 200, 110  # the most that a problem of the quick form of the study of minima has, and of this
STARTS = 2  # of each method: ExactNewton's own start has two descents
SEARCHES = 4  # further starts from which the full form looks for better minima


def run(options: StudyOptions) -> StudyResult:
    searched: dict[str, list[float]] = {}
    chosen = list(_tasks(options.full))
    for task in chosen if options.full else ():
        options.progress(f"{task.name}, further starts")
        searched[task.name] = _search(task)
    known = [replace(t, best=min(searched.get(t.name, []), default=np.inf)) for t in chosen]
    contest = contend(known, contenders(options.full), Budget(STARTS, 0.0, STARTS), options.progress, keep=True)
    minima = {
        name: distinct(
            [a.objective for a in contest.attempts if a.problem == name and a.certified] + searched.get(name, [])
        )
        for name in contest.problems
    }
    shown = (
        tables.by_family(contest),
        _minima(contest, minima),
        tables.results(contest, range(1, STARTS + 1)),
        tables.differences(contest, "newton", (1,)),
        replace(tables.differences(contest, "newton, one descent", (1, STARTS)), name="differences of single descents"),
        tables.claims(contest),
    )
    figures = (
        figure(contest, "profile", PROFILE.format(STARTS)),
        _shares(contest),
    )
    quick = f"The quick form: {len(chosen)} problems of at most {SMALL} unknowns; the long one takes {FULL}."
    notes = tables.LIMITS if options.full else (quick, *tables.LIMITS)
    good = "; ".join(f"{m} certifies {tables.passed(contest, m, 1, tables.certified)}" for m in MAIN)
    most = tables.passed(contest, "newton", 1, contest.reached)
    answer = f"Of hard problems {good}; newton ends at the best value known in {most}."
    runs = tuple(replace(Run.of(name, s), method=method, log=()) for name, method, s in contest.solutions)
    return StudyResult(shown, figures, runs, _conclusion(contest, minima, options.full), notes, answer=answer)


MAIN = ("newton", "ipopt", "elimination")
PROFILE = (
    "Shares of problems on which a method has reached the best value known, certified, from up to {} starts: by the "
    "ratio to the cheapest method above, by the cost below; left CPU time, right evaluations."
)


def _tasks(full: bool) -> Iterator[Task]:
    """All problems, or as many of every kind that are small."""
    if full:
        yield from map(_task, range(FULL))
        return
    for kind in range(len(KINDS)):
        small = (seed for seed in count(kind, len(KINDS)) if problem(seed).program.unknowns <= SMALL)
        yield from map(_task, islice(small, QUICK // len(KINDS)))


def _task(seed: int) -> Task:
    made: Problem = problem(seed)
    return Task(made.name, made.kind, seed, partial(_program, seed))


@cache
def _program(seed: int) -> sm.program.Program:
    return problem(seed).program


def _search(task: Task) -> list[float]:
    """The certified minima that ExactNewton finds from starts about the program's own, beyond those of all."""
    program, found = task.make(), []
    for number in range(STARTS, STARTS + SEARCHES):
        solution = sm.ExactNewton().solve(program, start_of(program, task.seed, number))
        found += [solution.objective] if solution.certified else []
    return found


def distinct(values: Sequence[float]) -> list[float]:
    """The values in increasing order, those alike to SAME counting once."""
    kept: list[float] = []
    for value in sorted(values):
        if not kept or not alike(value, kept[-1]):
            kept.append(value)
    return kept


def _minima(contest: Contest, minima: Mapping[str, list[float]]) -> Table:
    families = {a.problem: a.family for a in contest.attempts}
    rows = []
    for kind in (*KINDS, "all"):
        found = [values for name, values in minima.items() if kind in (families[name], "all")]
        counts = [len(v) for v in found]
        ratios = [v[1] / v[0] for v in found if len(v) > 1 and v[0] > 0]
        several = with_interval(sum(c > 1 for c in counts), len(counts))
        shares = [sum(c == n for c in counts) for n in (0, 1, 2)]
        rows.append(
            (kind, len(counts), *shares, sum(c > 2 for c in counts), *several, median(ratios) if ratios else None)
        )
    columns = (
        Column("keyframes"),
        Column("problems"),
        Column("no minimum found"),
        Column("one"),
        Column("two"),
        Column("more"),
        Column("several", "%"),
        *ends("several"),
        Column("second / best"),
    )
    caption = (
        f"How many different local minima (certified values further apart than {SAME:g}) were found per problem, and "
        "the "
        "median ratio of the second lowest to the lowest where there are several. There may be more."
    )
    return Table("local minima", columns, tuple(rows), caption)


def _shares(contest: Contest) -> Figure:
    with new_figure(7.0, 3.0) as drawn:
        axes = drawn.subplots()
        width = 0.8 / len(contest.methods)
        for k, method in enumerate(contest.methods):
            for i, kind in enumerate(KINDS):
                mine = [a for found in contest.of(method, 1, kind).values() for a in found]
                place = i + width * (k - (len(contest.methods) - 1) / 2)
                certified = 100 * sum(a.certified for a in mine) / len(mine)
                best, low, high = with_interval(sum(map(contest.reached, mine)), len(mine))
                assert best is not None and low is not None and high is not None
                axes.bar(place, certified, 0.95 * width, color=colour_of(method), alpha=0.35)
                axes.bar(place, best, 0.95 * width, color=colour_of(method), label=method if i == 0 else None)
                axes.errorbar(place, best, [[best - low], [high - best]], color="#000000", linewidth=0.8)
        axes.set_xticks(range(len(KINDS)), [kind.replace(" ", "\n", 1) for kind in KINDS])
        axes.grid(False, axis="x")
        axes.set_ylabel("problems [%]")
        drawn.legend(loc="outside upper left", ncols=4)
        return to_figure(
            drawn,
            "shares",
            "Pale: share certified as a local minimum; full, with its 95 % interval: share that reached the best value "
            "known, by what makes the keyframes hard.",
        )


def _conclusion(contest: Contest, minima: Mapping[str, list[float]], full: bool) -> str:
    lines = [
        f"{m}: certified {tables.passed(contest, m, 1, tables.certified)}, best value known "
        f"{tables.passed(contest, m, 1, contest.reached)}"
        for m in contest.methods
    ]
    several = sum(len(v) > 1 for v in minima.values())
    found = {m: [a for attempts in contest.of(m).values() for a in attempts] for m in contest.methods}
    seconds = "; ".join(f"{m} {sum(a.seconds for a in mine):.3g} s" for m, mine in found.items())
    failed = [a.problem for a in found["newton"] if not a.certified]
    equal = []
    for what, first, starts in (
        ("with two descents against one", "newton", 1),
        ("with a descent each", "newton, one descent", 1),
        (f"with {STARTS} starts each", "newton, one descent", STARTS),
    ):
        one, two, p = tables.outdone(contest, first, "ipopt", starts, contest.reached)
        equal.append(f"{what} {one} : {two} (p = {p:.2g})")
    text = (
        f"Over {len(minima)} problems from one start each, with 95 % intervals: {'; '.join(lines)}. CPU: {seconds}.\n\n"
        f"Best values that only ExactNewton or only IPOPT reaches: {', '.join(equal)}. IPOPT takes "
        f"{tables.speedup(contest, 'newton', 'ipopt')} times the CPU of ExactNewton, and "
        f"{tables.speedup(contest, 'newton, one descent', 'ipopt')} times that of one descent.\n\n"
        f"Local minima are the rule: {several} of {len(minima)} problems have more than one that was found"
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
