"""What the options of each solver are worth: steps, systems, damping, barrier, Hessian, scaling, and a warm start."""

from collections.abc import Iterator
from dataclasses import replace
from statistics import median
from typing import Any

import numpy as np

import symmotion as sm
from studies.shares import ends, paired, ratio, share, with_interval
from studies.solving.contest import tables
from studies.solving.contest.attempts import PATIENCE, Budget, Contender, Contest, contend
from studies.solving.problem_set.families import BOUNDS, EQUALITIES, LONG, SCALED
from studies.solving.problem_set.tasks import program, quick, tasks
from symmotion.report import Column, Figure, Run, Study, StudyOptions, StudyResult, Table, to_figure
from symmotion.views import draw_kkt, new_figure


def newton(full: bool, **options: Any) -> sm.ExactNewton:  # Any: of the solver
    return sm.ExactNewton(kernels="compiled" if full else "interpreted", time_limit=PATIENCE, ways=0, **options)


def ipopt(full: bool, **options: str | float) -> sm.Ipopt:
    kernels: sm.kernels.Kernels = "compiled" if full else "interpreted"
    return sm.Ipopt(kernels=kernels, time_limit=PATIENCE, max_iterations=1000 if full else 150, options=options)


def variants(full: bool) -> Iterator[Contender]:
    """Each solver as it is, and with one option changed."""
    yield Contender("newton", newton(full))
    yield Contender("newton, one descent", newton(full, steps="blend"))
    yield Contender("newton, shifted exact", newton(full, steps="shifted"))
    yield Contender("newton, Gauss–Newton", newton(full, steps="gauss-newton"))
    yield Contender("newton, condensed", newton(full, system="condensed"))
    yield Contender("newton, sparse", newton(full, system="sparse"))
    yield Contender("ipopt", ipopt(full))
    yield Contender("ipopt, adaptive μ", ipopt(full, mu_strategy="adaptive"))
    yield Contender("ipopt, L-BFGS", ipopt(full, hessian_approximation="limited-memory"))
    yield Contender("ipopt, no scaling", ipopt(full, nlp_scaling_method="none"))
    yield Contender("ipopt, bounds not relaxed", ipopt(full, bound_relax_factor=0.0))
    yield Contender("elimination", sm.Elimination(time_limit=PATIENCE))
    yield Contender("elimination, damped by ½", sm.Elimination(time_limit=PATIENCE, damping=0.5))
    yield Contender("elimination, staged by knots", sm.Elimination(time_limit=PATIENCE, stages="knots"))
    yield Contender("elimination, staged by degree", sm.Elimination(time_limit=PATIENCE, stages="degree"))


MOVES = (1e-3, 1e-2, 1e-1)  # by how much a keyframe is moved and turned before the program is solved again
QUICK_MOVES = (1e-2,)
THIRD = 3  # every third problem of the set is taken in the long form


def run(options: StudyOptions) -> StudyResult:
    chosen = list(tasks())[::THIRD] if options.full else quick(1, 60)
    contest = contend(chosen, tuple(variants(options.full)), Budget(), options.progress, keep=True)
    affine = [t.name for t in chosen if t.family in (EQUALITIES, SCALED, LONG) and t.name.startswith(("keyf", "long"))]
    again = [e for name in affine for e in edits(name, MOVES if options.full else QUICK_MOVES, options)]
    runs = tuple(replace(Run.of(name, s), method=m, log=()) for name, m, s in contest.solutions)
    shown = (
        tables.results(contest, (1,), "variants"),
        against(contest),
        tables.by_family(contest, [m for m in contest.methods if m.startswith(("newton", "ipopt"))]),
        warm_table(again),
    )
    figures = (_kkt_figure(),)
    fewer = {m: _fewer(contest, m) for m in ("newton, one descent", "newton, Gauss–Newton", "ipopt, L-BFGS")}
    answer = (
        f"Against its default, ExactNewton takes {fewer['newton, one descent']} times the CPU with one descent, "
        f"{fewer['newton, Gauss–Newton']} by Gauss–Newton, IPOPT {fewer['ipopt, L-BFGS']} with L-BFGS."
    )
    note = (f"{len(chosen)} of the set's problems{', every third' if options.full else ': the quick form'}.",)
    return StudyResult(shown, figures, runs, _conclusion(contest, again), (*note, *tables.LIMITS), answer=answer)


def default_of(method: str) -> str:
    """The name of the solver without options."""
    return method.split(",")[0]


def against(contest: Contest) -> Table:
    """Each variant against its solver's default."""
    rows = []
    for method in contest.methods:
        base = default_of(method)
        if method == base:
            continue
        for what, test in (("certified", tables.certified), ("best known", contest.reached)):
            one, two = (tables.by_problem(contest, m, 1, test) for m in (method, base))
            both = [p for p in one if p in two]
            pairs = [one[p] for p in both], [two[p] for p in both]
            rows.append((method, what, len(both), *paired(*pairs), *_ratio(contest, method, base)))
    columns = (
        Column("variant"),
        Column("what"),
        Column("problems"),
        Column("only the variant"),
        Column("only the default"),
        Column("p"),
        Column("CPU, variant / default"),
        Column("from", end=True),
        Column("to", end=True),
    )
    caption = (
        "Each variant against the default of the same solver, on the problems that both take. p: exact test of "
        "McNemar, "
        f"one of {len(rows)} rows. CPU: geometric mean over problems that both certify, with the 95 % interval of the "
        "bootstrap."
    )
    return Table("against the default", columns, tuple(rows), caption)


def _ratio(contest: Contest, first: str, second: str) -> tuple[float, float, float]:
    one, two = (contest.of(m) for m in (first, second))
    both = [p for p in one if p in two and one[p][0].certified and two[p][0].certified]
    return ratio(*([found[p][0].seconds for p in both] for found in (one, two)))


def _fewer(contest: Contest, method: str) -> str:
    middle, low, high = _ratio(contest, method, default_of(method))
    return f"{middle:.2g} ({low:.2g}–{high:.2g})" if np.isfinite(middle) else "–"


def edits(name: str, sizes: tuple[float, ...], options: StudyOptions) -> list[tuple[str, float, dict[str, tuple]]]:
    """A keyframe of a problem moved and turned: iterations and success of each way to solve it again."""
    options.progress(f"{name}, edited")
    base = program(name)
    exact, interior = newton(options.full), ipopt(options.full)
    solved = {"newton": exact.solve(base), "ipopt": interior.solve(base)}
    if not all(s.certified for s in solved.values()):
        return []
    keys, rng, found = base.design.keyframes, np.random.default_rng(len(base.x0)), []
    for size in sizes:
        k = len(keys) // 2
        turn = np.eye(keys.dimension) + size * rng.normal(size=(keys.dimension, keys.dimension))
        place = keys.translation[k] + size * base.unit.max() * rng.normal(size=keys.dimension)
        other = base.with_keyframes(keys.moved(k, keys.linear[k] @ turn, place))
        ways = {
            "newton": exact.solve(other),
            "newton, warm": exact.solve(other, solved["newton"]),
            "ipopt": interior.solve(other),
            "ipopt, from the point": interior.solve(other, solved["ipopt"].x + other.x0 - base.x0),
            "ipopt, warm": interior.solve(other, solved["ipopt"]),
        }
        found.append((name, size, {way: (s.certified, s.iterations, s.objective) for way, s in ways.items()}))
    return found


def warm_table(found: list[tuple[str, float, dict[str, tuple]]]) -> Table:
    """Iterations of the ways to solve an edited program."""
    rows = []
    for size in dict.fromkeys(e[1] for e in found):
        mine = [e[2] for e in found if e[1] == size]
        for way in mine[0]:
            good = [e[way][1] for e in mine if e[way][0]]
            told = with_interval(len(good), len(mine))
            rows.append((size, way, len(mine), *told, *_quartiles(good)))
    columns = (
        Column("moved by"),
        Column("way"),
        Column("edits"),
        Column("certified", "%"),
        *ends("certified"),
        Column("iterations"),
        Column("quarter below", end=True),
        Column("quarter above", end=True),
    )
    caption = (
        "The middle keyframe moved and turned, relative to the motion's size, and the program solved again: from its "
        "own "
        "start, and from the solution of before. Warm: with its multipliers; IPOPT then starts with a small barrier."
    )
    return Table("warm starts", columns, tuple(rows), caption)


def _quartiles(values: list[int]) -> tuple[float | None, ...]:
    return (median(values), *np.quantile(values, (0.25, 0.75)).tolist()) if values else (None, None, None)


def _kkt_figure() -> Figure:
    keys = sm.examples.random_keyframes(6, 40, 0)
    energies = {"R": sm.Rigidity(), "E": sm.Rigidity() + sm.TrajectoryEnergy(np.eye(3))}
    with new_figure(7.0, 3.9) as figure:
        for axes, energy in zip(figure.subplots(1, 2), energies.values(), strict=True):
            draw_kkt(axes, sm.affine_program(keys, objective=energy))
            axes.set_xlabel(f"objective {energy.name}")
        return to_figure(
            figure,
            "kkt",
            "Saddle matrix of 6 keyframes with one knot per segment, as the sparse system has it; the condensed one "
            "has "
            "the conditions eliminated. R in the 9 entries of each control matrix, and R + E with the 3 of each "
            "control "
            "point. Below and right of the lines: the multipliers.",
        )


def _conclusion(contest: Contest, again: list[tuple[str, float, dict[str, tuple]]]) -> str:
    said = []
    for base in dict.fromkeys(map(default_of, contest.methods)):
        mine = [m for m in contest.methods if m != base and default_of(m) == base]
        tests = {m: tables.outdone(contest, m, base, 1, contest.reached) for m in mine}
        told = [
            f"{_option(m)} {tests[m][0]} : {tests[m][1]}, p = {tests[m][2]:.2g}" for m in mine if tests[m][2] < 0.05
        ]
        said.append(
            f"{base}, relative CPU time where both are certified: "
            f"{', '.join(f'{_option(m)} {_fewer(contest, m)}' for m in mine)}. Best values that only the variant or "
            f"only the default reaches: {'; '.join([*told, 'the others do not differ beyond chance (p ≥ 0.05)'])}."
        )
    warm = {way: share(sum(e[2][way][0] for e in again), len(again)) for way in (again[0][2] if again else ())}
    if warm:
        said.append(f"Edited programs certified: {'; '.join(f'{way} {told}' for way, told in warm.items())}.")
    said.append(
        f"Inequalities ({BOUNDS}) and curved conditions are taken by the default, Gauss–Newton and sparse variants "
        "of ExactNewton and by IPOPT; elimination and the condensed system take linear equalities, and the table "
        "counts each on what it takes."
    )
    return "\n\n".join(said)


def _option(method: str) -> str:
    return method.split(", ")[1]


STUDY = Study(
    "variants",
    "What are the solvers' options worth: steps, systems, damping, barrier, scaling, warm starts?",
    "the options of ExactNewton, IPOPT and HJK 4.3 to 4.4, over the frozen problem set",
    run,
    order=6,
    effort=8.0,
)
