"""Figures in one style, as SVGs that follow the page from light to dark."""

import io
import math
import re
import textwrap
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import matplotlib
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Canvas
from matplotlib.rcsetup import cycler
from matplotlib.ticker import MaxNLocator

from symmotion.report.svg_paths import shortened
from symmotion.report.values import Figure, Run

# Each has a contrast of 3 or more on white and on the dark page, and all pairs stay apart in normal,
# deuteranopic, protanopic and tritanopic sight; the last is ink, which turns light on the dark page.
COLOURS = ("#0072b2", "#d55e00", "#18a77a", "#9b7efc", "#a34c6e", "#000000")
METHODS = {
    "newton": (COLOURS[0], "o"),
    "ipopt": (COLOURS[1], "s"),
    "elimination": (COLOURS[2], "^"),
    "newton-sparse": (COLOURS[3], "v"),
    "ipopt-plain": (COLOURS[4], "D"),
}
STYLE: dict[Any, Any] = {
    "axes.prop_cycle": cycler(color=COLOURS),
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.linewidth": 0.7,
    "axes.titlesize": 10,
    "axes.titlelocation": "left",
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": "black",
    "grid.alpha": 0.12,
    "grid.linewidth": 0.7,
    "xtick.major.width": 0.7,
    "ytick.major.width": 0.7,
    "legend.frameon": False,
    "lines.linewidth": 1.6,
    "lines.markersize": 4.5,
    # Glyphs as outlines: the same in the page, in a viewer and in print, whatever fonts are there.
    "svg.fonttype": "path",
}


def method_style(method: str) -> tuple[str, str]:
    """Colour and marker of a solver method, the same in all figures."""
    return METHODS.get(method, (COLOURS[-1], "x"))


@contextmanager
def new_figure(width: float = 7.0, height: float = 3.2) -> Iterator[Canvas]:
    """An empty figure, width × height in inches, and the style in force while it is drawn and exported.

    Black is ink: it follows the text colour of the page.
    """
    with matplotlib.rc_context():
        matplotlib.rcdefaults()
        matplotlib.rcParams.update(STYLE)
        yield Canvas(figsize=(width, height), layout="constrained")


def to_figure(figure: Canvas, name: str, caption: str, alt: str = "") -> Figure:
    """A drawn figure as an SVG, the same text for the same drawing; alt: as in `Figure`."""
    text = io.StringIO()
    with matplotlib.rc_context({"svg.hashsalt": name}):
        metadata = dict.fromkeys(("Creator", "Date", "Format", "Type"))
        figure.savefig(text, format="svg", transparent=True, metadata=metadata)
    return Figure(name, _themed(text.getvalue()), caption, alt)


def convergence_figure(runs: Sequence[Run], name: str, caption: str, alt: str = "") -> Figure:
    """Stationarity over iterations, a line per run that logged any, a panel per case."""
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


def draw_convergence(axes: Axes, runs: Sequence[Run]) -> None:
    axes.set_yscale("log")
    axes.minorticks_off()
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    for run in runs:
        colour, marker = method_style(run.method)
        values = [i.stationarity if i.stationarity > 0 else math.nan for i in run.log]
        axes.plot(values, color=colour, marker=marker, label=run.method)


def _themed(svg: str) -> str:
    """The SVG element alone, in the ink of its surroundings and without rules that would reach beyond it."""
    svg = re.sub(r"<!--.*?-->\s*", "", svg[svg.index("<svg") :], flags=re.DOTALL)
    svg = re.sub(r"<defs>\s*<style.*?</style>\s*</defs>\s*", "", svg, count=1, flags=re.DOTALL)
    svg = re.sub(r' d="([^"]*)"', lambda path: f' d="{shortened(path[1])}"', svg)
    # What is black by default has no fill of its own and takes the root's.
    svg = svg.replace("<svg ", '<svg fill="currentColor" stroke-linejoin="round" ', 1)
    return svg.replace("#000000", "currentColor")
