"""Drawn figures as those of a report."""

import math
import textwrap
from collections.abc import Sequence

from matplotlib.figure import Figure as Canvas

from symmotion.report.values import Figure, Run
from symmotion.views.convergence import draw_convergence
from symmotion.views.style import new_figure
from symmotion.views.svg import as_svg


def to_figure(figure: Canvas, name: str, caption: str, alt: str = "") -> Figure:
    """A drawn figure as an SVG, the same text for the same drawing; alt: as in `Figure`.

    name, caption: as in `Figure`.

    Raises InputError for a name that a file cannot have.

    >>> with sm.views.new_figure() as figure:
    ...     lines = figure.add_subplot().plot([0, 1], [0, 1])
    >>> sm.report.to_figure(figure, "line", "A line.").name
    'line'
    """
    return Figure(name, as_svg(figure, name), caption, alt)


def convergence_figure(runs: Sequence[Run], name: str, caption: str, alt: str = "") -> Figure:
    """Stationarity over iterations, a line per run that logged any, a panel per case.

    runs: with logs; name, caption, alt: as in `Figure`.

    Raises InputError for a name that a file cannot have.

    >>> solution = sm.ExactNewton().solve(sm.affine_program(sm.examples.planar_keyframes()))
    >>> run = sm.report.Run.of("four keyframes", solution)
    >>> sm.report.convergence_figure([run], "convergence", "Stationarity.").name
    'convergence'
    """
    logged = [run for run in runs if run.log]
    cases = list(dict.fromkeys(run.case for run in logged)) or [""]
    columns = {1: 1, 2: 2, 4: 2}.get(len(cases), 3)
    rows = math.ceil(len(cases) / columns)
    with new_figure(7.0, 3.2 if len(cases) == 1 else 0.5 + 2.1 * rows) as figure:
        panels = figure.subplots(rows, columns, sharey=True, squeeze=False)
        for axes in panels.flat[len(cases) :]:
            axes.remove()
        for axes, case in zip(panels.flat, cases, strict=False):
            draw_convergence(axes, [run for run in logged if run.case == case])
            if len(cases) > 1:
                # Cases are named by users: a dollar sign is no formula.
                axes.set_title(textwrap.fill(case, 69 // columns), fontsize=9, parse_math=False)
        figure.supxlabel("iteration", fontsize="medium")
        figure.supylabel("stationarity", fontsize="medium")
        lines = {str(line.get_label()): line for axes in figure.axes for line in axes.lines}
        figure.legend(lines.values(), lines.keys(), loc="outside upper left", ncols=5)
        return to_figure(figure, name, caption, alt)
