"""The one style of all pictures: colours, the look of axes, and figures to draw on."""

from collections.abc import Iterator
from contextlib import contextmanager

import matplotlib
from matplotlib.figure import Figure
from matplotlib.rcsetup import cycler
from matplotlib.typing import RcKeyType

# Each has a contrast of 3 or more on white and on the dark page, and all pairs stay apart in normal,
# deuteranopic, protanopic and tritanopic sight; the last is ink, which turns light on the dark page.
COLOURS = ("#0072b2", "#d55e00", "#18a77a", "#9b7efc", "#a34c6e", "#000000")
INK = COLOURS[5]  # of axes, text and keyframes
STYLES = ("-", "--", "-.")
METHODS = {
    "newton": (COLOURS[0], "o"),
    "ipopt": (COLOURS[1], "s"),
    "elimination": (COLOURS[2], "^"),
    "newton-sparse": (COLOURS[3], "v"),
    "ipopt-plain": (COLOURS[4], "D"),
}
STYLE: dict[RcKeyType, object] = {
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
    """Colour and marker of a solver method, the same in all figures.

    >>> colour, marker = sm.views.method_style("newton")
    """
    return METHODS.get(method, (COLOURS[-1], "x"))


@contextmanager
def new_figure(width: float = 7.0, height: float = 3.2) -> Iterator[Figure]:
    """An empty figure, width × height in inches, and the style in force while it is drawn and exported.

    Black is ink: it follows the text colour of the page.

    >>> with sm.views.new_figure(6.0, 3.0) as figure:
    ...     lines = figure.add_subplot().plot([0, 1], [0, 1])
    >>> drawn = sm.report.to_figure(figure, "line", "A line.")
    """
    with matplotlib.rc_context():
        matplotlib.rcdefaults()
        matplotlib.rcParams.update(STYLE)
        yield Figure(figsize=(width, height), layout="constrained")
