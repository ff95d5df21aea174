"""HJK figures 1 and 2: two planar keyframes, Bézier motions of growing degree."""

from collections.abc import Sequence

import numpy as np

import symmotion as sm
from symmotion.bodies import letter_k
from symmotion.report import Column, Figure, Player, Run, Study, StudyOptions, StudyResult, Table, player, to_figure
from symmotion.views import draw_body, draw_deviation, draw_inner_products, nearly_rigid, new_figure

KEYFRAMES = {"orthogonal": sm.examples.quarter_turn(), "general": sm.examples.sheared_turn()}
DRAWN = (1, 2, 3)


def run(options: StudyOptions) -> StudyResult:
    runs: list[Run] = []
    rows: list[tuple[str, str, int, float, float, float]] = []
    figures: list[Figure] = []
    players: list[Player] = []
    highest = 7 if options.full else 5
    for name, keys in KEYFRAMES.items():
        for order in (1, 2):
            objective = sm.Rigidity(order)
            options.progress(f"{name}, {objective.name}")
            motions: list[sm.AffineMotion] = []
            for degree in range(1, highest + 1):
                program = sm.affine_program(keys, degree=degree, refine=0, objective=objective)
                # HJK raise the degree step by step; every solver starts from the optimum one degree below.
                comparison = sm.compare(program, start=motions[-1] if motions else None)
                case = f"{name}, {objective.name}, degree {degree}"
                runs += [Run.of(case, s) for s in comparison.solutions]
                best = comparison.best
                if best is None:
                    raise sm.SolveError(f"no solver solved {case}")
                at_once = sm.ExactNewton().solve(program)
                motions.append(best.motion)
                rows.append((name, objective.name, degree, best.objective, at_once.objective, _distortion(best.motion)))
            if order == 2:
                figures.append(_pictures(name, motions))
                shown = {f"degree {degree}": motions[degree - 1] for degree in DRAWN}
                caption = f"A letter K under the least distorted motions (R*) between two {name} keyframes, grey."
                players.append(player(f"{name}-motions", shown, letter_k(), caption, keys, picture=figures[-1]))
                figures.append(_products(name, keys, motions))
    table = Table(
        "optima by degree",
        (
            Column("keyframes"),
            Column("objective"),
            Column("degree"),
            Column("minimum by stages"),
            Column("minimum at once"),
            Column("bend of the inner products"),
        ),
        tuple(rows),
        "Least value for Bézier motions, each degree started from the optimum one below, and by ExactNewton at once "
        "from the straight blend. Bend: largest distance of an inner product from the straight line between its ends.",
    )
    values = {(r[0], r[1], r[2]): r[3] for r in rows}
    conclusion = (
        f"For orthogonal keyframes a quarter turn apart the least R* falls from {values['orthogonal', 'R*', 1]:.6g} "
        f"(degree 1) over {values['orthogonal', 'R*', 2]:.6g} to {values['orthogonal', 'R*', 3]:.6g} (degree 3): the "
        f"cubic is nearly rigid, as HJK figure 1 shows. Degree 4 reaches {values['orthogonal', 'R*', 4]:.3g} and "
        f"degree 5 {values['orthogonal', 'R*', 5]:.3g}.\n\n"
        "For general keyframes R* measures only how far the inner products are from changing linearly, so it falls "
        f"to {values['general', 'R*', 3]:.3g} at degree 3 as well, while R stays at {values['general', 'R', 3]:.3g}: "
        "the change of shape itself has to happen. HJK, whose keyframes are not printed, report a rigidity value that "
        "stays large here and name R*; with these keyframes that holds for R."
    )
    worse = [f"{r[0]}, {r[1]}, degree {r[2]}" for r in rows if r[4] > 1.01 * r[3] + 1e-10]
    if worse:
        conclusion += (
            f"\n\nThe gradual way pays: at once, from the straight blend, ExactNewton ends at a worse local minimum "
            f"in {len(worse)} of {len(rows)} cases ({'; '.join(worse)})."
        )
    bends = [f"{r[5]:.2g} at degree {r[2]}" for r in rows if r[:2] == ("orthogonal", "R*") and r[2] in DRAWN]
    answer = (
        "Between rigid keyframes a quarter turn apart, the inner products of the body's axes are off by "
        f"{', '.join(bends)} when R* is least."
    )
    return StudyResult((table,), tuple(figures), tuple(runs), conclusion, players=tuple(players), answer=answer)


def _distortion(motion: sm.AffineMotion) -> float:
    t = np.linspace(0, 1, 201)
    gram = motion.gram(t)
    straight = (1 - t)[:, None, None] * gram[0] + t[:, None, None] * gram[-1]
    return float(np.abs(gram - straight).max())


def _pictures(name: str, motions: Sequence[sm.AffineMotion]) -> Figure:
    with new_figure(7.0, 2.0) as figure:
        for axes, degree in zip(figure.subplots(1, len(DRAWN), sharex=True, sharey=True), DRAWN, strict=True):
            draw_body(axes, motions[degree - 1], letter_k(), np.linspace(0, 1, 6))
            axes.set_title(f"degree {degree}")
        return to_figure(
            figure,
            f"{name}-motions",
            f"A letter K under the least distorted motions (R*) between two {name} keyframes, at six times.",
            f"Six copies of a letter K moving and turning, for degrees 1, 2 and 3; {name} keyframes.",
        )


def _products(name: str, keys: sm.Keyframes, motions: Sequence[sm.AffineMotion]) -> Figure:
    if nearly_rigid(keys):
        with new_figure(7.0, 2.6) as figure:
            axes = figure.subplots()
            draw_deviation(axes, {f"degree {degree}": motions[degree - 1] for degree in DRAWN})
            figure.legend(loc="outside upper left", ncols=3)
            caption = f"How far these motions are from rigid between the {name} keyframes, which are rigid."
            return to_figure(figure, f"{name}-inner-products", caption)
    with new_figure(7.0, 2.6) as figure:
        panels = figure.subplots(1, len(DRAWN), sharey=True)
        for axes, degree in zip(panels, DRAWN, strict=True):
            draw_inner_products(axes, motions[degree - 1], keys)
            axes.set_title(f"degree {degree}")
        panels[0].set_ylabel("inner product")
        figure.legend(*panels[0].get_legend_handles_labels(), loc="outside upper left", ncols=3)
        return to_figure(
            figure,
            f"{name}-inner-products",
            f"Inner products of the two test vectors under these motions; {name} keyframes. Straight lines between "
            "the end values (dots) would be ideal for R*.",
        )


STUDY = Study(
    "two_keyframes",
    "How little must a body be distorted between two planar keyframes, by the degree of the motion?",
    "HJK 5.1, figures 1 and 2",
    run,
    order=1,
)
