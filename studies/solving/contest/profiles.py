"""Profiles of Dolan and Moré and data profiles of Moré and Wild, by CPU time and by evaluations."""

from collections.abc import Callable, Sequence

import numpy as np

from studies.solving.contest.attempts import Attempt, Contest
from symmotion.report import Figure, to_figure
from symmotion.views import COLOURS, method_style, new_figure

STYLES = ("-", "--", "-.", ":")
# What an attempt costs.
Cost = Callable[[Attempt], float]
COSTS: dict[str, tuple[Cost, str]] = {
    "time": (lambda a: 1e3 * a.seconds, "CPU time [ms]"),
    "evaluations": (lambda a: float(a.evaluations), "evaluations"),
}


def costs(contest: Contest, test: Callable[[Attempt], bool], cost: Cost, methods: Sequence[str]) -> np.ndarray:
    """(problems, methods) what a method has spent on its starts when one passes the test first, ∞ where none does."""
    table = np.full((len(contest.problems), len(methods)), np.inf)
    row = {name: k for k, name in enumerate(contest.problems)}
    for column, method in enumerate(methods):
        for problem, attempts in contest.of(method, starts=len(contest.attempts)).items():
            spent = 0.0
            for attempt in attempts:
                spent += cost(attempt)
                if test(attempt):
                    table[row[problem], column] = spent
                    break
    return table


def ratios(table: np.ndarray) -> np.ndarray:
    """(problems, methods) each cost over the least of the same problem: r of Dolan and Moré; ∞ where unsolved."""
    least = table.min(axis=1, keepdims=True)
    with np.errstate(invalid="ignore"):
        return np.where(np.isfinite(table), table / least, np.inf)


def share_within(values: np.ndarray, limits: np.ndarray) -> np.ndarray:
    """(limits,) the share of values (problems,) that are at most each limit."""
    return np.mean(values[None, :] <= limits[:, None], axis=1)


def colour_of(method: str) -> str:
    """The colour of a solver in all figures, and another one of its single descents."""
    return COLOURS[3] if "," in method else method_style(method)[0]


def figure(contest: Contest, name: str, caption: str, methods: Sequence[str] | None = None) -> Figure:
    """Four panels: the ratio to the fastest, and the cost itself, by time and by evaluations."""
    methods = contest.methods if methods is None else methods
    with new_figure(7.0, 5.2) as drawn:
        panels = drawn.subplots(2, 2, sharey=True)
        for column, (cost, label) in enumerate(COSTS.values()):
            table = costs(contest, contest.reached, cost, methods)
            for axes, values, what in (
                (panels[0, column], ratios(table), "ratio to the least"),
                (panels[1, column], table, ""),
            ):
                finite = values[np.isfinite(values)]
                limits = np.geomspace(max(finite.min(initial=1.0), 1e-3), max(finite.max(initial=2.0), 2.0), 200)
                for k, method in enumerate(methods):
                    shares = 100 * share_within(values[:, k], limits)
                    style = STYLES[k % len(STYLES)]
                    axes.step(limits, shares, style, where="post", color=colour_of(method), label=method)
                axes.set_xscale("log")
                axes.set_ylim(0, 102)
                axes.set_xlabel(f"{label.split(' [')[0]}, {what}" if what else label)
        for axes in panels[:, 0]:
            axes.set_ylabel("problems [%]")
        drawn.legend(*panels[0, 0].get_legend_handles_labels(), loc="outside upper left", ncols=3)
        return to_figure(drawn, name, caption)
