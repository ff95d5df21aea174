"""Formulas as MathML that browsers set as TeX does: what Docutils makes of them, put right in three places."""

import re
from xml.etree import ElementTree

from docutils.utils.math.latex2mathml import tex2mathml

SPACE = "http://www.w3.org/1998/Math/MathML"
APPLY = "\u2061"
THIN = "0.1667em"


def apart(tex: str) -> list[str]:
    """The formulas that stand side by side, a quad between them: on a narrow screen one goes below the other."""
    parts, depth = [""], 0
    for piece in re.split(r"(\\q?quad(?![a-zA-Z])|\\begin|\\end|\\left(?![a-zA-Z])|\\right(?![a-zA-Z])|\\?[{}])", tex):
        depth += (piece in ("{", "\\begin", "\\left")) - (piece in ("}", "\\end", "\\right"))
        if depth == 0 and piece in ("\\quad", "\\qquad"):
            parts.append("")
        else:
            parts[-1] += piece
    return [part.strip() for part in parts if part.strip()]


def mathml(tex: str, block: bool) -> str:
    """The formula; MathError where Docutils does not understand it."""
    made = tex2mathml(tex, as_block=block).replace("&ApplyFunction;", APPLY)
    ElementTree.register_namespace("", SPACE)
    tree = ElementTree.fromstring(made)
    for element in list(tree.iter()):
        _accent(element)
        _bars(element)
        _functions(element)
    return ElementTree.tostring(tree, encoding="unicode", short_empty_elements=False)


def _name(element: ElementTree.Element) -> str:
    return element.tag.removeprefix(f"{{{SPACE}}}")


def _make(name: str, *children: ElementTree.Element, **attributes: str) -> ElementTree.Element:
    made = ElementTree.Element(f"{{{SPACE}}}{name}", attributes)
    made.extend(children)
    return made


def _accent(element: ElementTree.Element) -> None:
    """An index of an accented letter stands beside it, not below: B̃ᵢ."""
    parts = list(element)
    if _name(element) != "munderover" or _name(parts[0]) != "mi":
        return
    base, index, accent = parts
    element.clear()
    element.tag = f"{{{SPACE}}}msub"
    element.extend([_make("mover", base, accent, accent="true"), index])


def _bars(element: ElementTree.Element) -> None:
    """Bars of a norm are as high as one another and stand close: that they open and close, their sign does not say."""
    fixed = element.text == "|" and element.get("stretchy") == "false"
    if _name(element) == "mo" and (fixed or (element.text == "‖" and "minsize" not in element.attrib)):
        element.attrib |= {"stretchy": "false", "lspace": "0", "rspace": "0"}


def _functions(element: ElementTree.Element) -> None:
    """Names of functions stand apart from the letters beside them: a exp v."""
    parts = list(element)
    for place in reversed(range(len(parts))):
        if parts[place].text != APPLY:
            continue
        after = parts[place + 1] if place + 1 < len(parts) else None
        if after is not None and not (_name(after) == "mo" and after.text == "("):
            element.insert(place + 1, _make("mspace", width=THIN))
        if place >= 2 and (_name(parts[place - 2]) != "mo" or parts[place - 2].text == ")"):
            element.insert(place - 1, _make("mspace", width=THIN))
