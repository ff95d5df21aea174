"""How solvers converge, on axes that the caller brings."""

import math
from collections.abc import Sequence
from typing import Protocol

from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator

from symmotion.solvers.solution import Iteration
from symmotion.views.canvas import MOST_MARKERS
from symmotion.views.style import method_style


class Logged(Protocol):
    """What is drawn of a solver's run: a solution, or the row of a report."""

    @property
    def method(self) -> str: ...

    @property
    def log(self) -> Sequence[Iteration]: ...


def draw_convergence(axes: Axes, runs: Sequence[Logged]) -> None:
    """Stationarity over iterations, a line per run, on a logarithmic scale."""
    axes.set_yscale("log")
    axes.minorticks_off()
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    for run in runs:
        colour, marker = method_style(run.method)
        values = [i.stationarity if i.stationarity > 0 else math.nan for i in run.log]
        every = max(1, len(values) // MOST_MARKERS)
        axes.plot(values, color=colour, marker=marker, markevery=every, label=run.method)
