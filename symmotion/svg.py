"""SVGs as elements of a page or a notebook."""

import re

from markupsafe import Markup, escape


def as_element(svg: str, label: str, prefix: str) -> Markup:
    """The text of an SVG as an element for readers and for those who listen: labelled, its ids behind a prefix.

    Ids of several figures on a page would else be one. Its own is the prefix.
    """
    svg = re.sub(r'(\bid="|href="#|url\(#)', rf"\g<1>{prefix}-", svg)
    return Markup(svg.replace("<svg ", f'<svg id="{prefix}" role="img" aria-label="{escape(label)}" ', 1))
