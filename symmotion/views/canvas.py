"""Where pictures by one call are drawn: the caller's axes, or new ones in the house style."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Literal

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import is_color_like
from matplotlib.figure import Figure
from matplotlib.typing import RcKeyType

from symmotion.brief import start_of
from symmotion.errors import InputError
from symmotion.views.style import STYLE

# Markers beyond this many would run together, and fill a file.
MOST_MARKERS = 60
# Parts of a line of which each is narrower than the line.
MOST_BINS = 400

# Inches. Set at the width of a column, 3.3 inches, the smallest letters are still 6 points high.
WIDTH = 4.5
HEIGHT = 2.9  # inches
# In points.
FONT: dict[RcKeyType, object] = {"font.size": 10, "axes.labelsize": 10, "xtick.labelsize": 9, "ytick.labelsize": 9}


def require_axes(axes: object) -> None:
    """Raise InputError unless axes are None or ordinary matplotlib Axes."""
    if axes is not None and (not isinstance(axes, Axes) or axes.name != "rectilinear"):
        kind = f"{axes.name} axes" if isinstance(axes, Axes) else f"a {type(axes).__name__}"
        raise InputError(f"axes: {kind} cannot be drawn on; ordinary matplotlib Axes are needed, as of plt.subplots()")


@contextmanager
def on_axes(axes: Axes | None) -> Iterator[Axes]:
    """The axes, or those of a new pyplot figure in the house style, which goes again where drawing fails.

    The user's settings of matplotlib are as before afterwards.
    """
    require_axes(axes)
    if axes is not None:
        yield axes
        return
    # Of pyplot, so that notebooks and plt.show() find the figure.
    import matplotlib.pyplot as plt

    with matplotlib.rc_context({**STYLE, **FONT}):
        figure = plt.figure(figsize=(WIDTH, HEIGHT), layout="constrained")
        try:
            axes = figure.add_subplot()
            # Ticks and grid lines are made when the figure is shown, and would be in the style of then.
            axes.grid(True, color=STYLE["grid.color"], alpha=STYLE["grid.alpha"], linewidth=STYLE["grid.linewidth"])
            axes.tick_params(width=STYLE["xtick.major.width"], labelsize=FONT["xtick.labelsize"])
            in_powers(axes, "x")
            yield axes
        except BaseException:
            plt.close(figure)
            raise


def in_powers(axes: Axes, axis: Literal["x", "both"] = "both") -> None:
    """Large and small numbers at ticks with their power of ten beside the axis: written out they run together.

    That of the y axis is where `legend_above` puts a legend.
    """
    axes.ticklabel_format(axis=axis, scilimits=(-3, 4), useMathText=True)


def fit_height(axes: Axes) -> None:
    """Make a figure as high as its only axes need where their units are of equal length.

    >>> with sm.views.new_figure() as figure:
    ...     axes = figure.add_subplot(aspect=1.0)
    ...     lines = axes.plot([0, 4], [0, 1])
    ...     sm.views.fit_height(axes)
    """
    figure = axes.figure
    if isinstance(figure, Figure) and axes.get_aspect() == 1.0 and axes.dataLim.width > 0:
        share = axes.dataLim.height / axes.dataLim.width
        figure.set_size_inches(WIDTH, float(min(max(0.85 * WIDTH * share + 0.6, 1.4), WIDTH)))


def legend_above(axes: Axes) -> None:
    """A legend over the axes, where it covers nothing; none where nothing has a label."""
    labels = axes.get_legend_handles_labels()[1]
    if not labels:
        return
    size = 0.83 * float(matplotlib.rcParams["font.size"])
    # A sample of the line takes the room of five letters, a formula that of three; letters are 0.6 of their height.
    widths = [0.6 * size * (6 + (3 if label.startswith("$") else len(label))) for label in labels]
    inches = axes.get_window_extent().width / axes.figure.dpi
    columns = len(labels)
    while columns > 1 and sum(max(part) for part in np.array_split(widths, columns)) > 1.1 * 72 * inches:
        columns -= 1
    legend = axes.legend(
        loc="lower left",
        bbox_to_anchor=(0, 1),
        ncols=columns,
        frameon=False,
        borderaxespad=0.2,
        columnspacing=1.2,
        handlelength=1.8,
        fontsize=size,
    )
    for text in legend.get_texts():
        # Names are given by users: a dollar sign is no formula, unless we put it there.
        text.set_parse_math(text.get_text().startswith("$"))


def require_kind(kind: str, known: tuple[str, ...]) -> None:
    """Raise InputError unless there is a picture of this kind."""
    if kind not in known:
        raise InputError(f"kind {kind!r} is unknown; there are {', '.join(known)}")


def require_colour(colour: object) -> None:
    """Raise InputError unless matplotlib knows the colour."""
    if not is_color_like(colour):
        raise InputError(f"colour {colour!r}: a colour of matplotlib such as '#0072b2' or 'black' is needed")


def told(times: np.ndarray) -> tuple[np.ndarray, str]:
    """Times as an axis shows them, and what the axis is called: from the first one where 0 is far away."""
    start = start_of(times)
    return times - start, "time" if start == 0 else "time from the start"


def thinned(times: np.ndarray, values: np.ndarray, bins: int = MOST_BINS) -> tuple[np.ndarray, np.ndarray]:
    """A line through many samples by few that look alike: of each of so many parts the least and the largest value."""
    if len(times) <= 2 * bins:
        return times, values
    parts = np.array_split(np.arange(len(times)), bins)
    kept = {0, len(times) - 1}
    for part in parts:
        kept |= {int(part[np.argmin(values[part])]), int(part[np.argmax(values[part])])}
    chosen = np.array(sorted(kept))
    return times[chosen], values[chosen]


def as_numbers(values: object, what: str) -> np.ndarray:
    """Values as an array of finite floats; InputError with `what` where they are none."""
    try:
        numbers = np.asarray(values, dtype=float)
    except (TypeError, ValueError):
        raise InputError(f"{what}: finite numbers are needed") from None
    if not np.isfinite(numbers).all():
        raise InputError(f"{what}: finite numbers are needed")
    return numbers


def bears(axes: Axes, label: str) -> bool:
    """Whether axes bear a text of this label, which nobody sees: an id would be written into SVGs, twice."""
    return any(text.get_label() == label for text in axes.texts)


def stamps(times: np.ndarray, digits: int = 4) -> list[str]:
    """Times as texts of few digits, of more where two would read alike: recordings count seconds from 1970."""
    for some in range(digits, 17):
        texts = [f"{t:.{some}g}" for t in times]
        if len(set(texts)) == len(set(times)):
            return texts
    return [repr(float(t)) for t in times]
