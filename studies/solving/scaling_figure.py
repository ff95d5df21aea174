"""The figures of the study `scaling`."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.ticker import FuncFormatter, LogLocator, NullLocator

from studies.solving.scaling_limit import Division, Limit
from studies.solving.scaling_worker import Budget, Measurement
from symmotion.report import Figure, to_figure
from symmotion.views import COLOURS, method_style, new_figure

# Tools of one kind share a colour, formulations of it differ in marker and dashes.
STYLES = {
    "newton-compiled": (COLOURS[0], "D", "--"),
    "opti-mx": (COLOURS[4], "v", "-"),
    "opti-sx": (COLOURS[4], "s", "--"),
    "ipopt-plain": (COLOURS[4], "x", ":"),
    "sqpmethod": (COLOURS[3], "P", "-"),
    "fatrop": (COLOURS[3], "X", "--"),
    "trust-constr": (COLOURS[5], "*", "-"),
}


def cost_figure(measured: Sequence[Measurement], names: Sequence[str], limit: Limit, budget: Budget) -> Figure:
    """Time and memory over the number of keyframes, a line per method."""
    with new_figure(7.0, 4.6) as figure:
        time, memory = figure.subplots(1, 2)
        for name in names:
            done = [m for m in measured if m.method == name and m.seconds]
            colour, marker, line = STYLES.get(name) or (*method_style(name), "-")
            counts = [m.keyframes for m in done]
            style = {"color": colour, "marker": marker, "linestyle": line, "label": name}
            time.plot(counts, [m.seconds for m in done], **style)
            memory.plot(counts, [m.beyond for m in done], **style)
        sizes = sorted({m.keyframes for m in measured if m.seconds})
        time.plot(sizes, [limit.seconds(s) for s in sizes], color=COLOURS[5], linestyle=":", label="limit of one core")
        _level(time, budget.seconds, f"budget {budget.seconds:g} s")
        # On a machine that is busy nothing may keep within the budget, and no ticks are found on logarithmic axes.
        scale = "log" if sizes else "linear"
        for axes, what in ((time, "build and solve [s]"), (memory, "peak memory beyond imports [MB]")):
            axes.set(xscale=scale, yscale=scale, xlabel="keyframes", ylabel=what)
        if sizes:
            plain_ticks(memory.yaxis)
        figure.legend(*time.get_legend_handles_labels(), loc="outside upper left", ncols=4)
        caption = (
            "Time to build and solve, and peak memory of the process beyond what its imports take, by number of "
            "keyframes; certified minima only. The limit: arithmetic and memory traffic of the evaluations and "
            "factorisations at the rates of one core of this machine."
        )
        return to_figure(figure, "scaling", caption)


def plain_ticks(axis: Axis) -> None:
    """1, 2, 5, 10, … as plain numbers on a logarithmic axis."""
    axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0), numticks=20))
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axis.set_minor_locator(NullLocator())


def _level(axes: Axes, height: float, text: str) -> None:
    axes.axhline(height, color=COLOURS[5], linewidth=0.7, alpha=0.6)
    axes.annotate(
        text,
        (1, height),
        xycoords=("axes fraction", "data"),
        xytext=(0, 2),
        textcoords="offset points",
        ha="right",
        fontsize=8,
    )


def phases_figure(division: Division) -> Figure:
    """Where the time goes: a bar for each kind of kernels beside the limit, divided by phase."""
    bars = division.named
    with new_figure(7.0, 2.2) as figure:
        axes = figure.subplots()
        ends = np.zeros(len(bars))
        for phase, colour in zip(division.compiled, COLOURS, strict=False):
            widths = np.array([1e3 * parts.get(phase, 0.0) for parts in bars.values()])
            axes.barh(list(bars), widths, left=ends, color=colour, label=phase, height=0.6)
            ends = ends + widths
        for row, end in enumerate(ends):
            axes.annotate(
                f"{float(f'{end:.3g}'):g} ms",
                (end, row),
                xytext=(4, 0),
                textcoords="offset points",
                va="center",
                fontsize=8,
            )
        axes.invert_yaxis()
        axes.set_xlim(0, 1.12 * ends.max())
        axes.set_xlabel("build and solve on one thread [ms]")
        axes.grid(False, axis="y")
        figure.legend(loc="outside upper left", ncols=5)
        caption = f"Where the time of {division.keyframes:,} keyframes goes, and the machine's limit for the same work."
        return to_figure(figure, "phases", caption)
