"""Automatic knots and auxiliary keyframes against uniform refinement, at equal numbers of unknowns."""

import numpy as np

import symmotion as sm
from symmotion.report import Column, Figure, Run, Study, StudyOptions, StudyResult, Table, to_figure
from symmotion.views import COLOURS, new_figure

CASES = {
    "uneven turns": sm.examples.uneven_turns(),
    "affine, in the plane": sm.examples.planar_keyframes(),
    "rigid, neighbours 100°": sm.examples.random_keyframes(8, 100, 2),
}


def run(options: StudyOptions) -> StudyResult:
    objective = sm.Rigidity(2)
    runs, rows, drawn = [], [], {}
    for name, keys in CASES.items():
        segments = len(keys) - 1
        refinements = (0, 1, 2, 3, 5, 7) if options.full else (0, 1, 2, 3, 5)
        options.progress(f"{name}: uniform knots")
        uniform = []
        for refine in refinements:
            solution = sm.ExactNewton().solve(sm.affine_program(keys, objective=objective, refine=refine))
            runs.append(Run.of(f"{name}, uniform, {refine} per segment", solution))
            uniform.append((solution.program.unknowns, solution.objective))
        options.progress(f"{name}: automatic knots")
        search = sm.answers.auto_knots(keys, objective=objective, budget=refinements[-1] * segments, fall=0.0)
        runs += [Run.of(f"{name}, automatic, {s.program.unknowns} unknowns", s) for s in search.stages]
        drawn[name] = (uniform, search)
        for unknowns, value in uniform[1:]:
            best = min(v for u, v in search.history if u <= unknowns)
            rows.append((name, unknowns, value, best, value / best))
    columns = (
        Column("keyframes"),
        Column("unknowns"),
        Column("uniform knots"),
        Column("automatic knots"),
        Column("ratio"),
    )
    table = Table("knots", columns, tuple(rows), "Least R* with as many unknowns, or fewer for the automatic knots.")
    auxiliary = _auxiliary(options, runs)
    gains = [r for r in rows if r[4] > 1.05]
    losses = [r for r in rows if r[4] < 0.95]
    most = max(rows, key=lambda r: r[4])
    conclusion = (
        f"Knots where the integrand is largest do better than uniform ones in {len(gains)} of {len(rows)} comparisons, "
        f"by up to {most[4]:.3g} times ({most[0]}, {most[1]} unknowns), and worse in {len(losses)}. They pay where the "
        "distortion sits in a few segments and where there are several knots to give; with one knot per segment there "
        "is nothing to choose, and for keyframes that change shape everywhere uniform refinement is as good.\n\n"
        + _auxiliary_words(auxiliary)
    )
    answer = (
        f"Knots put where the distortion is beat uniform ones in R* by up to {most[4]:.3g} times, {len(gains)} to "
        f"{len(losses)} in {len(rows)} comparisons; {_auxiliary_words(auxiliary, True)}."
    )
    return StudyResult((table, auxiliary), (_figure(drawn),), tuple(runs), conclusion, answer=answer)


def _auxiliary(options: StudyOptions, runs: list[Run]) -> Table:
    """The classical elimination, plain and started through auxiliary keyframes (HJK 4.1), and ExactNewton beside it."""
    angles, seeds = ((60, 100, 140, 170), 20 if options.full else 6)
    rows = []
    for angle in angles:
        plain = helped = newton = 0
        for seed in range(seeds):
            options.progress(f"auxiliary keyframes, {angle}°, seed {seed}")
            keys = sm.examples.random_keyframes(6, angle, seed)
            program = sm.affine_program(keys, objective=sm.Rigidity(2), refine=3)
            case = f"{angle}°, seed {seed}"
            direct = Run.of(f"{case}, plain", sm.Elimination().solve(program))
            certain = Run.of(f"{case}, plain", sm.ExactNewton().solve(program))
            through = _through(f"{case}, auxiliary keyframes", keys, program)
            runs += [direct, certain, through]
            plain, helped, newton = plain + direct.certified, helped + through.certified, newton + certain.certified
        rows.append((angle, *(100 * n / seeds for n in (plain, helped, newton))))
    columns = (
        Column("neighbours turned by", "°"),
        Column("elimination", "% certified"),
        Column("elimination, auxiliary", "% certified"),
        Column("ExactNewton", "% certified"),
    )
    caption = "R*, six rigid keyframes, three knots per segment; one orthonormalised auxiliary keyframe per segment."
    return Table("auxiliary keyframes", columns, tuple(rows), caption)


def _through(case: str, keys: sm.Keyframes, program: sm.program.Program) -> Run:
    """The elimination started from its own optimum through auxiliary keyframes."""
    solver = sm.Elimination()
    try:
        more = sm.answers.auxiliary_keyframes(keys, rigid=True)
    except sm.InputError as error:
        return Run.failed(case, "elimination", repr(solver), sm.solvers.Status.FAILED, str(error))
    first = solver.solve(sm.affine_program(more, objective=sm.Rigidity(2)))
    if first.status != sm.solvers.Status.SOLVED:
        return Run.failed(case, "elimination", repr(solver), first.status, f"auxiliary program: {first.message}")
    return Run.of(case, solver.solve(program, start=first.motion))


def _auxiliary_words(table: Table, short: bool = False) -> str:
    plain, helped, newton = (float(np.mean([float(r[k] or 0) for r in table.rows])) for k in (1, 2, 3))
    if short:
        return f"auxiliary keyframes certify {helped:.0f} % of eliminations in place of {plain:.0f} %"
    return (
        f"Starting the classical elimination through auxiliary keyframes certifies {helped:.0f} % of the problems "
        f"instead of {plain:.0f} %; ExactNewton certifies {newton:.0f} % without."
    )


def _figure(drawn: dict) -> Figure:
    with new_figure(7.0, 2.8) as figure:
        for axes, (name, (uniform, search)) in zip(figure.subplots(1, len(drawn)), drawn.items(), strict=True):
            axes.semilogy(*zip(*uniform, strict=True), "s-", color=COLOURS[1], label="uniform")
            axes.semilogy(*zip(*search.history, strict=True), "o-", color=COLOURS[0], label="automatic", markersize=3)
            axes.set_title(name, fontsize=9)
            axes.set_xlabel("unknowns")
        figure.axes[0].set_ylabel("least R*")
        figure.legend(*figure.axes[0].get_legend_handles_labels(), loc="outside upper left", ncols=2)
        return to_figure(figure, "objective", "Least R* by number of unknowns, with uniform and with automatic knots.")


STUDY = Study(
    "knots",
    "Where should knots be inserted, and do auxiliary keyframes help?",
    "HJK 4.1, 4.2, which leave the placement of knots open",
    run,
    order=16,
)
