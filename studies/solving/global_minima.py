"""Which minima are global: bounds below them that are proved."""

from importlib.util import find_spec

import numpy as np

import symmotion as sm
from studies.shares import share
from symmotion.report import Column, Figure, Run, Study, StudyOptions, StudyResult, Table, to_figure
from symmotion.views import COLOURS, new_figure

QUICK, FULL = 6, 33  # planar problems
HIGHER = tuple((degree, seed) for degree in (4, 5) for seed in range(4))  # degrees and seeds
HIDDEN = 10  # the seed of one whose lowest minimum local searches miss
MISSING = 'Clarabel, which solves the semidefinite programs, is not installed: pip install "symmotion[global]".'


def drawn(seed: int) -> sm.Keyframes:
    """3 to 8 keyframes in the plane, each turned by 60° to 180° against the one before, to a random side."""
    rng = np.random.default_rng(seed)
    count = int(rng.integers(3, 9))
    return turned(np.cumsum(rng.choice([-1, 1], count) * rng.uniform(60, 180, count)))


def turned(degrees: np.ndarray) -> sm.Keyframes:
    """Planar keyframes at times 0, 1, … turned to these angles."""
    linear = np.stack([sm.examples.rotation_2d(a) for a in degrees])
    return sm.Keyframes(np.arange(float(len(degrees))), linear, np.zeros((len(degrees), 2)))


def cases(full: bool) -> dict[str, sm.program.Program]:
    """Programs by name."""
    found = {}
    pairs = {"quarter turn": sm.examples.quarter_turn(), "sheared": sm.examples.sheared_turn()}
    for name, keys in (pairs | {"half turn": turned(np.array([0.0, 180.0]))}).items():
        for order in (1, 2):
            found[f"{name}, {sm.Rigidity(order).name}"] = sm.affine_program(
                keys, refine=0, objective=sm.Rigidity(order)
            )
    for seed in range(HIDDEN, HIDDEN + (FULL if full else QUICK)):
        keys = drawn(seed)
        found[f"{len(keys)} keyframes, seed {seed}"] = sm.affine_program(keys, refine=0)
    for degree, seed in HIGHER if full else HIGHER[:1]:
        keys = drawn(seed)
        found[f"{len(keys)} keyframes, degree {degree}, seed {seed}"] = sm.affine_program(keys, degree=degree, refine=0)
    if full:
        found["8 keyframes, degree 2, by cliques"] = sm.affine_program(
            turned(np.cumsum([0, 100, 130, -90, 140, 70, -110, 160])), degree=2, refine=1
        )
    return found


def run(options: StudyOptions) -> StudyResult:
    if find_spec("clarabel") is None:
        asked = f"Of {len(cases(options.full))} programs 0 were asked: {MISSING}"
        return StudyResult(conclusion=f"Not asked: {MISSING}", notes=(MISSING,), answer=asked)
    rows, runs = [], []
    for name, program in cases(options.full).items():
        options.progress(name)
        own, ways = sm.ExactNewton(ways=0).solve(program), sm.ExactNewton().solve(program)
        bound = sm.lower_bound(program)
        best = bound.best.objective
        runs.append(Run.of(name, bound.best))
        kind = "proved" if bound.proof.valid else "numerical"
        found = own.objective, ways.objective, best, bound.value, bound.gap / best
        rows.append((name, *found, bound.rank, len(bound.minimisers), kind))
    columns = (
        Column("keyframes"),
        Column("own start"),
        Column("other ways too"),
        Column("lowest known"),
        Column("bound"),
        Column("relative gap"),
        Column("rank"),
        Column("minimisers"),
        Column("bound is"),
    )
    caption = (
        "Own start: where ExactNewton ends from there alone; other ways too: where it ends by default, having tried "
        "segments the other way round. Bound: no motion of the program has a lower value. Rank: of the moment "
        "matrix; with one, one minimiser is left."
    )
    table = Table("bounds", columns, tuple(rows), caption)
    certain = sum(r[8] == "proved" and r[5] <= 1e-6 for r in rows)
    missed = [r for r in rows if r[1] > r[3] * (1 + 1e-6)]
    still = [r for r in rows if r[2] > r[3] * (1 + 1e-6)]
    several = [r[0] for r in rows if r[6] > 1]
    conclusion = (
        f"Of {len(rows)} programs in the plane {certain} have a lowest minimum that is proved to be global to a "
        f"millionth of its value or better. More than one minimiser is left for {len(several)} "
        f"({'; '.join(several)}).\n\n"
        f"ExactNewton's own start misses the global minimum in {len(missed)}"
        + "".join(f"; {r[0]}: {r[1]:.6g} in place of {r[3]:.7g}" for r in missed)
        + f". With other ways round it misses {len(still)}. The relaxation finds it without any start."
    )
    answer = (
        f"The lowest minimum is proved to be global, to a millionth of its value, in {share(certain, len(rows))} "
        f"programs; ExactNewton's own start misses it in {len(missed)} of them, with other ways round {len(still)}."
    )
    return StudyResult((table,), (_gaps(rows),), tuple(runs), conclusion, answer=answer)


def _gaps(rows: list[tuple]) -> Figure:
    with new_figure(7.0, 0.6 + 0.22 * len(rows)) as figure:
        axes = figure.subplots()
        place = np.arange(len(rows))
        axes.barh(
            place, [max(r[5], 1e-16) for r in rows], color=[COLOURS[0] if r[6] == 1 else COLOURS[1] for r in rows]
        )
        axes.axvline(1e-6, color=COLOURS[5], linewidth=0.8)
        axes.set_xscale("log")
        axes.set_yticks(place, [r[0] for r in rows], fontsize=7)
        axes.invert_yaxis()
        axes.set_xlabel("(lowest known − bound)/lowest known")
        return to_figure(figure, "gaps", "What is left between bound and minimum; the other colour where several tie.")


STUDY = Study(
    "global",
    "Which minima are global?",
    "Lasserre 2001; Henrion and Lasserre 2005; HJK figures 1 and 2",
    run,
    order=14,
)
