"""The minima of a program: what they look like, and how many starts it takes to find the lowest."""

from itertools import count, islice

import numpy as np

import symmotion as sm
from studies.shares import ends, share, with_interval
from studies.solving.hard_keyframes import problem
from studies.solving.robustness import QUICK_UNKNOWNS, SAME
from symmotion.bodies import letter_k
from symmotion.report import Column, Figure, Run, Study, StudyOptions, StudyResult, Table, to_figure
from symmotion.views import COLOURS, draw_body, draw_path, new_figure

ANGLES = (0.0, 150.0, 320.0)  # of the keyframes whose minima are shown, in degrees
SHOWN, BUDGET = 6, 26
# Problems and unknowns of the most; starts of the search for the best value known, beside those that are counted.
QUICK, FULL = (3, 60, 26), (60, QUICK_UNKNOWNS, 150)


def run(options: StudyOptions) -> StudyResult:
    keys = keyframes()
    found = sm.explore(sm.affine_program(keys, refine=0), budget=BUDGET, unseen=0)
    runs = [Run.of(f"minimum {k}", s) for k, s in enumerate(found.minima)]
    problems, most, search = FULL if options.full else QUICK
    tried = []
    for seed in islice((s for s in count() if problem(s).program.unknowns <= most), problems):
        program = problem(seed).program
        options.progress(problem(seed).name)
        counted = sm.explore(program, budget=BUDGET, unseen=0).objectives
        more = sm.explore(program, budget=search, seed=1, unseen=0).objectives
        tried.append((counted, min(counted.min(), more.min())))
    reached = shares(tried)
    figures = (_motions(found, keys), _budget(reached))
    first, last = (share(round(reached[k] * len(tried)), len(tried)) for k in (0, -1))
    conclusion = (
        f"Three keyframes turned to 150° and 320° have {len(found.minima)} minima that {BUDGET} starts found, from "
        f"{found.best.objective:.5g} to {found.minima[-1].objective:.5g}: they go one way round or the other, or "
        f"through shapes that collapse. {found.drawn} of them were met by {found.draws} random starts, which leaves "
        f"{found.unseen:.2g} expected unseen.\n\n"
        f"Of hard problems the own start ends at the best value known in {first}, one of {BUDGET} starts of the "
        f"portfolio in {last}. The best value known is no proof: see the study global."
    )
    answer = (
        f"Three far turned keyframes have {len(found.minima)} minima, R from {found.best.objective:.3g} to "
        f"{found.minima[-1].objective:.3g}; one start finds the best value known in {first} hard problems, {BUDGET} in "
        f"{last}."
    )
    tables = (_table(found), _shares_table(reached, len(tried)))
    return StudyResult(tables, figures, tuple(runs), conclusion, answer=answer)


def keyframes() -> sm.Keyframes:
    """Three planar keyframes that are far turned."""
    linear = np.stack([sm.examples.rotation_2d(a) for a in ANGLES])
    return sm.Keyframes(np.arange(3.0), linear, 3.0 * np.array([[0.0, 0.0], [1.0, 0.4], [2.0, 0.0]]))


def shares(tried: list[tuple[np.ndarray, float]]) -> np.ndarray:
    """(BUDGET,) the share of problems of which the best value known was reached by the first 1, 2, … starts."""
    best = np.array([least for _, least in tried])[:, None]
    lowest = np.minimum.accumulate(np.stack([values for values, _ in tried]), axis=1)
    return np.mean(lowest <= best + SAME * np.abs(best) + 1e-12, axis=0)


def _table(found: sm.answers.Exploration) -> Table:
    rows = []
    for k, (solution, n) in enumerate(zip(found.minima, found.counts, strict=True)):
        kinds = dict.fromkeys(s.kind for s, to in zip(found.starts, found.led, strict=True) if to == k)
        rows.append((k, solution.objective, n, ", ".join(kinds)))
    columns = (Column("minimum"), Column("R"), Column("starts"), Column("kinds of starts"))
    return Table("minima", columns, tuple(rows), f"Where {BUDGET} starts led to, lowest first.")


def _shares_table(reached: np.ndarray, of: int) -> Table:
    rows = [(n, *with_interval(round(of * float(reached[n - 1])), of)) for n in (1, 2, 4, 8, 16, BUDGET)]
    columns = (Column("starts"), Column("problems", "%"), *ends("problems"))
    caption = (
        "Hard problems of which the best value known was reached by the first starts of the portfolio, with Wilson's "
        "95 % intervals."
    )
    return Table("best known", columns, tuple(rows), caption)


def _motions(found: sm.answers.Exploration, keys: sm.Keyframes) -> Figure:
    shown = found.minima[:SHOWN]
    with new_figure(7.0, 3.4) as figure:
        panels = figure.subplots(2, SHOWN // 2).ravel()
        for axes in panels[len(shown) :]:
            axes.set_visible(False)
        for k, (axes, solution) in enumerate(zip(panels, shown, strict=False)):
            draw_body(
                axes, solution.motion, letter_k(), np.linspace(keys.times[0], keys.times[-1], 17), COLOURS[0], 0.2
            )
            draw_body(axes, solution.motion, letter_k(), keys.times, COLOURS[5], 0.6)
            draw_path(axes, solution.motion)
            axes.set_title(f"{k}: R = {solution.objective:.4g}, {found.counts[k]} starts", fontsize=8)
        caption = "The lowest minima through the same three keyframes, with R and how many starts led there."
        return to_figure(figure, "motions", caption)


def _budget(reached: np.ndarray) -> Figure:
    with new_figure(6.0, 2.6) as figure:
        axes = figure.subplots()
        axes.step(np.arange(1, len(reached) + 1), 100 * reached, where="post", color=COLOURS[0])
        axes.set_ylim(0, 102)
        axes.set_xlabel("starts")
        axes.set_ylabel("best value known [%]")
        return to_figure(figure, "budget", "Share of hard problems whose best value known is reached, over the starts.")


STUDY = Study(
    "minima",
    "Which minima does a program have, and how many starts does it take to find the lowest?",
    "HJK 4.4 and 5.1 on starts; Boender and Rinnooy Kan 1987 on when to stop",
    run,
    order=14,
)
