"""The report of several solvers on a user's own keyframes."""

from collections.abc import Mapping, Sequence

import numpy as np

from symmotion.bodies.shapes import Up
from symmotion.design import affine_program, measure
from symmotion.energies import Energy
from symmotion.errors import InputError, SolveError
from symmotion.motions import Keyframes
from symmotion.report.figures import convergence_figure, to_figure
from symmotion.report.players import player
from symmotion.report.values import Figure, Player, Run, StudyResult
from symmotion.solvers import Comparison, Solution, Solver, compare
from symmotion.tables import Column, Table
from symmotion.views.canvas import told
from symmotion.views.drawing import draw_deviation, draw_inner_products, nearly_rigid
from symmotion.views.style import new_figure

MOST_PRICES = 20  # rows of the table of multipliers
PLAYED = 16  # keyframes from the first on that a player shows


def compared(
    keyframes: Keyframes, objectives: Sequence[Energy], degree: int, refine: int, solvers: Sequence[Solver]
) -> dict[str, Comparison]:
    """Solvers on one set of keyframes, by the name of the objective."""
    return {
        objective.name: compare(affine_program(keyframes, degree=degree, refine=refine, objective=objective), solvers)
        for objective in objectives
    }


def comparison_result(
    keyframes: Keyframes, objectives: Sequence[Energy], comparisons: Mapping[str, Comparison], *, up: Up = "z"
) -> StudyResult:
    """Comparisons of solvers on one set of keyframes; tables, figures and what they come to, as data.

    up: the axis that is upright in players.
    """
    runs = tuple(Run.of(name, s) for name, c in comparisons.items() for s in c.found)
    figures: list[Figure] = [convergence_figure(runs, "convergence", "Stationarity by iteration.")]
    tables, players = [_agreement(comparisons)], list[Player]()
    sentences = []
    for k, (name, comparison) in enumerate(comparisons.items()):
        best = comparison.best
        if best is None:
            sentences.append(f"{name}: {comparison.verdict} The table of runs says where each ended.")
            continue
        try:
            before = f"{measure(best.program.design.motion(best.program.start), objectives[k]):.6g}"
        except (InputError, SolveError):  # S of a spline that is singular on its way
            before = "no value"
        sentences.append(
            f"{name}: {before} for the interpolating spline, {best.objective:.6g} at the lowest minimum found, of "
            f"{len(comparison.minima)}, by {best.method}."
        )
        figures.append(_inner_products(keyframes, name, f"inner-products-{k + 1}", best))
        tables.append(_prices(keyframes, name, best))
        players.append(_before_and_after(keyframes, name, f"motion-{k + 1}", best, up))
    text = "\n\n".join(sentences)
    return StudyResult(tuple(tables), tuple(figures), runs, text, players=tuple(players), answer=answer_of(comparisons))


def answer_of(comparisons: Mapping[str, Comparison]) -> str:
    """Who won, who failed and by how much, of all objectives in one sentence."""
    parts = [f"for {name}, {comparison.verdict.removesuffix('.')}" for name, comparison in comparisons.items()]
    return f"F{'; '.join(parts)[1:]}."


def _agreement(comparisons: Mapping[str, Comparison]) -> Table:
    rows = []
    for name, comparison in comparisons.items():
        for solution in comparison.found:
            agreement = comparison.agreement(solution) or (None, None)
            rows.append((name, solution.method, solution.ended, solution.seconds.total * 1e3, *agreement))
    columns = ("objective", "solver", "status"), ("minimiser", "multipliers")
    return Table(
        "agreement",
        (*map(Column, columns[0]), Column("time", "ms"), *map(Column, columns[1])),
        tuple(rows),
        "Largest difference from the best solution, relative to its largest entry.",
    )


def _prices(keyframes: Keyframes, name: str, best: Solution) -> Table:
    price = best.multipliers["keyframes"]
    flat = np.concatenate([price.linear.reshape(len(keyframes), -1), price.translation], axis=1)
    sizes = np.linalg.norm(flat, axis=1)
    order = np.argsort(-sizes)[:MOST_PRICES]
    times, clock = told(keyframes.times)
    return Table(
        f"keyframe multipliers, {name}",
        (Column("keyframe"), Column(clock), Column("‖λ‖"), Column("largest entry")),
        tuple((int(i), float(times[i]), float(sizes[i]), float(np.abs(flat[i]).max())) for i in order),
        "How fast the minimum changes with a keyframe: ∂f*/∂A*ᵢ = −λᵢ. The most expensive first"
        + (f", {MOST_PRICES} of {len(keyframes)}." if len(keyframes) > MOST_PRICES else "."),
    )


def _before_and_after(keyframes: Keyframes, name: str, slug: str, best: Solution, up: Up) -> Player:
    start = best.program.design.motion(best.program.start)
    shown = keyframes[:PLAYED]
    which = "keyframes" if len(shown) == len(keyframes) else f"first {PLAYED} of {len(keyframes)} keyframes"
    return player(
        slug,
        {"interpolating spline": start, "minimum": best.motion},
        None,
        f"A body under the interpolating spline and at the lowest minimum found, {name}. Grey: the {which}.",
        shown,
        span=(float(shown.times[0]), float(shown.times[-1])),
        up=up,
    )


def _inner_products(keyframes: Keyframes, name: str, slug: str, best: Solution) -> Figure:
    motions = {"interpolating spline": best.program.design.motion(best.program.start), "minimum": best.motion}
    with new_figure(7.0, 3.0) as figure:
        if nearly_rigid(keyframes):
            draw_deviation(figure.subplots(), motions)
            figure.legend(loc="outside upper left", ncols=2)
            return to_figure(figure, slug, f"How far the motions are from rigid, {name}: the keyframes are rigid.")
        panels = figure.subplots(1, 2, sharey=True)
        for axes, (title, motion) in zip(panels, motions.items(), strict=True):
            draw_inner_products(axes, motion, keyframes)
            axes.set_title(title)
        panels[0].set_ylabel("inner product")
        figure.legend(*panels[0].get_legend_handles_labels(), loc="outside upper left", ncols=6)
        return to_figure(figure, slug, f"Inner products of the moving unit vectors, {name}; dots: at the keyframes.")
