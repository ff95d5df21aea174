"""Drawn figures as the text of SVGs that follow the page from light to dark."""

import io
import re

import matplotlib
from matplotlib.figure import Figure

from symmotion.views.svg_paths import shortened


def as_svg(figure: Figure, salt: str) -> str:
    """A drawn figure from `<svg` on, the same text for the same drawing; salt: what its ids are made of."""
    text = io.StringIO()
    with matplotlib.rc_context({"svg.hashsalt": salt}):
        metadata = dict.fromkeys(("Creator", "Date", "Format", "Type"))
        figure.savefig(text, format="svg", transparent=True, metadata=metadata)
    return _themed(text.getvalue())


def _themed(svg: str) -> str:
    """The SVG element alone, in the ink of its surroundings and without rules that would reach beyond it."""
    svg = re.sub(r"<!--.*?-->\s*", "", svg[svg.index("<svg") :], flags=re.DOTALL)
    svg = re.sub(r"<defs>\s*<style.*?</style>\s*</defs>\s*", "", svg, count=1, flags=re.DOTALL)
    svg = re.sub(r' d="([^"]*)"', lambda path: f' d="{shortened(path[1])}"', svg)
    # What is black by default has no fill of its own and takes the root's.
    svg = svg.replace("<svg ", '<svg fill="currentColor" stroke-linejoin="round" ', 1)
    return svg.replace("#000000", "currentColor")
