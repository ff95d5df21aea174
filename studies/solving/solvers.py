"""All solvers over the frozen problem set at equal budgets: success, best value, cost, and what they claim."""

from collections.abc import Sequence
from dataclasses import replace

import symmotion as sm
from studies.shares import ends, shifted_mean, with_interval
from studies.solving.contest import tables
from studies.solving.contest.attempts import PATIENCE, Budget, Contender, Contest, Task, contend
from studies.solving.contest.profiles import figure
from studies.solving.problem_set.tasks import quick, tasks
from symmotion.report import Column, Run, Study, StudyOptions, StudyResult, Table, convergence_figure


def contenders(full: bool) -> tuple[Contender, ...]:
    """The same functions for all: machine code, or in the quick form, which need not wait for a compiler, not.

    And the same starts: what ExactNewton tries beside them, `ways`, has a line of its own.
    """
    kernels: sm.kernels.Kernels = "compiled" if full else "interpreted"
    return (
        Contender("newton", sm.ExactNewton(kernels=kernels, time_limit=PATIENCE, ways=0)),
        Contender("newton, one descent", sm.ExactNewton(kernels=kernels, time_limit=PATIENCE, steps="blend")),
        Contender("newton, other ways too", sm.ExactNewton(kernels=kernels, time_limit=PATIENCE)),
        Contender("ipopt", sm.Ipopt(kernels=kernels, time_limit=PATIENCE)),
        Contender("elimination", sm.Elimination(time_limit=PATIENCE)),
    )


QUICK, FULL = Budget(2, 0.0, 2), Budget(5, 0.2, 12)
ACCURACIES = (1e-4, 1e-6, 1e-10)  # beside the 1e-8 of the contest itself


def run(options: StudyOptions) -> StudyResult:
    budget = FULL if options.full else QUICK
    chosen = list(tasks()) if options.full else quick(2)
    contest = contend(chosen, contenders(options.full), budget, options.progress, keep=True)
    some = chosen if options.full else chosen[:4]
    exact = [accuracy(t, some, options) for t in (ACCURACIES if options.full else ACCURACIES[:1])]
    exact = sorted([*exact, (1e-8, contest)], key=lambda pair: -pair[0])
    runs = [replace(Run.of(problem, s), method=method) for problem, method, s in contest.solutions]
    example = [r for r in runs if r.case == chosen[0].name]
    figures = (
        figure(contest, "profiles", PROFILES.format(len(contest.problems))),
        convergence_figure(example, "convergence", f"Stationarity by iteration, {example[0].case}."),
    )
    starts = tuple(dict.fromkeys((1, 2, budget.starts)))
    shown = (
        tables.results(contest, starts),
        tables.differences(contest, "newton", starts),
        tables.differences(contest, "newton, one descent", starts, ("ipopt", "elimination")),
        tables.by_family(contest),
        tables.claims(contest),
        timed(contest, (0.02, 0.05, 0.2) if options.full else (0.1,)),
        _accuracies(exact),
    )
    shown = (*shown[:2], replace(shown[2], name="differences of single descents"), *shown[3:])
    answer = (
        f"ExactNewton certifies {_passed(contest, 'newton')} problems from one start, IPOPT "
        f"{_passed(contest, 'ipopt')}, "
        f"which takes {tables.speedup(contest, 'newton', 'ipopt')} times the CPU where both do."
    )
    quiet = (
        () if options.full else (f"The quick form: {len(chosen)} of the set's problems, and {budget.starts} starts.",)
    )
    slim = tuple(replace(r, log=()) if r.case != chosen[0].name else r for r in runs)
    return StudyResult(shown, figures, slim, _conclusion(contest, budget), (*quiet, *tables.LIMITS), answer=answer)


PROFILES = (
    "Shares of {} problems on which a method has reached the best value known, certified, from one start after the "
    "other. Above: by the ratio of the cost to that of the cheapest method (Dolan and Moré 2002); below: by the cost "
    "(data profiles, Moré and Wild 2009). Left: CPU time; right: evaluations of functions and derivatives."
)


def _passed(contest: Contest, method: str, starts: int = 1) -> str:
    return tables.passed(contest, method, starts, tables.certified)


def _pace(contest: Contest, method: str) -> str:
    """How many problems a method certifies in a second of CPU, from its own starts."""
    found = [a for attempts in contest.of(method).values() for a in attempts]
    return f"{method} {sum(a.certified for a in found) / sum(a.seconds for a in found):.3g}"


def timed(contest: Contest, seconds: Sequence[float]) -> Table:
    """What is reached from as many starts as fit a CPU time on each problem."""
    rows = []
    for limit in seconds:
        for method in contest.methods:
            counts, tried = [0, 0], []
            found = contest.of(method, starts=len(contest.attempts))
            for attempts in found.values():
                within, spent = [], 0.0
                for attempt in attempts:
                    spent += attempt.seconds
                    within += [attempt] if spent <= limit else []
                tried.append(len(within))
                counts[0] += any(map(tables.certified, within))
                counts[1] += any(map(contest.reached, within))
            shares = [end for n in counts for end in with_interval(n, len(found))]
            rows.append((limit, method, len(found), sum(tried) / len(tried), *shares))
    columns = (
        Column("CPU", "s"),
        Column("solver"),
        Column("problems"),
        Column("starts that fit"),
        Column("certified", "%"),
        *ends("certified"),
        Column("best known", "%"),
        *ends("best known"),
    )
    caption = "Starts one after the other on every problem, as many as end within the time, and as were tried."
    return Table("equal times", columns, tuple(rows), caption)


def accuracy(tolerance: float, chosen: Sequence[Task], options: StudyOptions) -> tuple[float, Contest]:
    """All contenders asked for a tolerance, and judged to it."""
    asked = [
        replace(c, solver=replace(c.solver, tolerance=tolerance)) for c in contenders(options.full) if c.name in MAIN
    ]
    return tolerance, contend(chosen, asked, Budget(), lambda name: options.progress(f"to {tolerance:g}: {name}"))


MAIN = ("newton", "ipopt", "elimination")


def _accuracies(found: Sequence[tuple[float, Contest]]) -> Table:
    rows = []
    for tolerance, contest in found:
        for method in MAIN:
            mine = [a for attempts in contest.of(method).values() for a in attempts]
            share = with_interval(sum(a.certified for a in mine), len(mine))
            means = (
                1e3 * shifted_mean((a.seconds for a in mine), tables.SHIFT),
                shifted_mean((float(a.evaluations) for a in mine), 1.0),
            )
            rows.append((tolerance, method, len(mine), *share, *means))
    columns = (
        Column("tolerance"),
        Column("solver"),
        Column("problems"),
        Column("certified", "%"),
        *ends("certified"),
        Column("CPU", "ms"),
        Column("evaluations"),
    )
    caption = "Each asked for a tolerance, and certified to it, from one start: decrement ≤ tolerance² · |f| and so on."
    return Table("accuracies", columns, tuple(rows), caption)


def _conclusion(contest: Contest, budget: Budget) -> str:
    lines = [
        f"{m}: certified {_passed(contest, m)}, best value known {tables.passed(contest, m, 1, contest.reached)}"
        for m in contest.methods
    ]
    told = []
    for count in dict.fromkeys((1, budget.starts)):
        one, two, p = tables.outdone(contest, "newton", "ipopt", count, contest.reached)
        a, b, q = tables.outdone(contest, "newton", "ipopt", count, tables.certified)
        told.append(
            f"from {count} start{'s' * (count > 1)} only ExactNewton reaches the best value known on {one}, only IPOPT "
            f"on {two} (p = {p:.2g}), and only ExactNewton is certified on {a}, only IPOPT on {b} (p = {q:.2g})"
        )
    worst = [
        f"{family} ({sum(a.certified for a in mine)} of {len(mine)})"
        for family in contest.families
        for mine in [[a for found in contest.of("newton", 1, family).values() for a in found]]
        if sum(a.certified for a in mine) < 0.8 * len(mine)
    ]
    weak = f" ExactNewton is weakest on the families {', '.join(worst)}." if worst else ""
    return (
        f"Over {len(contest.problems)} problems from one start each, with 95 % intervals: {'; '.join(lines)}.\n\n"
        f"Problem by problem, {'; '.join(told)}.{weak}\n\n"
        f"Certified per CPU second: {'; '.join(_pace(contest, m) for m in contest.methods)}. Where both are certified "
        f"IPOPT takes {tables.speedup(contest, 'newton', 'ipopt')} times as long as ExactNewton."
    )


STUDY = Study(
    "solvers",
    "Which solver reaches which minimum, how surely and at what cost?",
    "HJK 4.3, 4.4, against IPOPT and an exact Newton method on the same programs; Dolan and Moré 2002, Moré and Wild "
    "2009",
    run,
    order=5,
    effort=8.0,
)
