"""What the studies of HJK figures 3 and 4 share: a motion through several keyframes before and after optimisation."""

from collections.abc import Callable

from matplotlib.axes import Axes

import symmotion as sm
from symmotion.bodies import Shape
from symmotion.report import (
    Column,
    Figure,
    Run,
    StudyOptions,
    StudyResult,
    Table,
    convergence_figure,
    player,
    to_figure,
)
from symmotion.views import draw_inner_products, new_figure

Draw = Callable[[Axes, sm.AffineMotion], None]
ROTATIONAL_ENERGY = sm.JetEnergy(lambda jet: jet.ddA, squares=True, label="rotational energy")


def before_and_after(keys: sm.Keyframes, draw: Draw, body: Shape, name: str, options: StudyOptions) -> StudyResult:
    """Optimise cubics with one and more knots per segment under R and R*; draw the R* optimum beside its start."""
    runs: list[Run] = []
    rows = []
    optima: dict[tuple[str, int], sm.Solution] = {}
    refinements = (1, 2, 3, 5) if options.full else (1, 2)
    start = start_of(sm.affine_program(keys))
    for objective in (sm.Rigidity(), sm.Rigidity(2)):
        for refine in refinements:
            case = f"{objective.name}, knots per segment: {refine}"
            options.progress(case)
            comparison = sm.compare(sm.affine_program(keys, objective=objective, refine=refine))
            runs += [Run.of(case, s) for s in comparison.solutions]
            best = comparison.best
            if best is None:
                raise sm.SolveError(f"no solver solved {case}")
            optima[objective.name, refine] = best
            before, energy = sm.measure(start, objective), sm.measure(best.motion, ROTATIONAL_ENERGY)
            rows.append((objective.name, refine, before, best.objective, before / best.objective, energy))
    before = sm.measure(start, ROTATIONAL_ENERGY)
    table = Table(
        "before and after",
        (
            Column("objective"),
            Column("knots per segment"),
            Column("interpolating spline"),
            Column("optimum"),
            Column("ratio"),
            Column("∫ ‖Ä‖² at the optimum"),
        ),
        tuple(rows),
        "The objective for the C² cubic interpolant, which is the start, and at the optimum. "
        f"∫ ‖Ä‖² of the interpolant is {before:.4g}.",
    )
    best = optima["R*", 1]
    after = sm.measure(best.motion, ROTATIONAL_ENERGY)
    conclusion = (
        f"One inserted knot per segment lowers R* from {sm.measure(start, sm.Rigidity(2)):.4g} to "
        f"{best.objective:.4g}, a second one to {optima['R*', 2].objective:.4g}.\n\n"
        f"∫ ‖Ä‖² goes from {before:.4g} to {after:.4g}. It cannot fall, since the natural cubic interpolant has the "
        "least of all interpolants; the energy of the rotational part that HJK see drop must be the rigidity.\n\n"
        "Between the keyframes the squared lengths of the test vectors change smoothly after the optimisation, and "
        "their mixed products stay near zero where the keyframes have no shear."
    )
    first = [r for r in runs if r.case.endswith(": 1")]
    pictures = draw_both(draw, name, start, best.motion)
    shown = {"interpolating spline": start, "least R*": best.motion}
    caption = "Before and after: the C² cubic interpolant and the motion of least R*. Grey: the keyframes."
    moving = player("motions", shown, body, caption, keys, picture=pictures)
    figures = (
        pictures,
        _products(keys, start, best.motion),
        convergence_figure(first, "convergence", "Stationarity by iteration, one knot per segment."),
    )
    once, twice = (rows[len(refinements) + k][4] for k in (0, 1))
    answer = (
        f"{'In the plane' if keys.dimension == 2 else 'In space'} optimisation divides the distortion R* of the "
        f"interpolating spline by {once:.3g} with one inserted knot per segment, by {twice:.3g} with two."
    )
    return StudyResult((table,), figures, tuple(runs), conclusion, players=(moving,), answer=answer)


def start_of(program: sm.program.Program) -> sm.AffineMotion:
    """The motion that a program starts from."""
    return program.design.motion(program.start)


def draw_both(draw: Draw, body: str, start: sm.AffineMotion, best: sm.AffineMotion) -> Figure:
    """A body under the interpolating spline, and below it under the optimum."""
    with new_figure(7.0, 4.6) as figure:
        for axes, motion, title in zip(
            figure.subplots(2, 1), (start, best), ("interpolating spline", "least R*"), strict=True
        ):
            draw(axes, motion)
            axes.set_title(title)
        return to_figure(
            figure,
            "motions",
            f"{body} under the C² cubic interpolant and under the motion of least R* with one inserted knot per "
            "segment. In ink: the keyframes.",
        )


def _products(keys: sm.Keyframes, start: sm.AffineMotion, best: sm.AffineMotion) -> Figure:
    with new_figure(7.0, 3.0) as figure:
        panels = figure.subplots(1, 2, sharey=True)
        for axes, motion, title in zip(panels, (start, best), ("interpolating spline", "least R*"), strict=True):
            draw_inner_products(axes, motion, keys)
            axes.set_title(title)
        panels[0].set_ylabel("inner product")
        figure.legend(*panels[0].get_legend_handles_labels(), loc="outside upper left", ncols=6)
        return to_figure(
            figure, "inner-products", "Inner products of the test vectors over time; dots: at the keyframes."
        )
