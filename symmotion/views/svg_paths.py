"""Paths in SVGs, made short: without the points that nobody would miss, and each told from the one before."""

import re

import numpy as np
from matplotlib.path import Path

# Points of 1/72 inch; a hundredth of one is the unit of what is written.
UNSEEN = 0.06
UNIT = 0.01


def shortened(data: str) -> str:
    """The data of a path in fewer letters; what is drawn moves by a few hundredths of a point at most.

    Paths of straight lines lose points that are nearly on the line of their neighbours; of curves
    only the numbers are cut.
    """
    if re.search(r"[^MLz\d.\s-]", data):
        return re.sub(r"(\.\d\d)\d+", r"\1", data)
    return "".join(_run(part) for part in data.split("M")[1:])


def _run(part: str) -> str:
    """Lines from one point on, back to it where z ends them."""
    points = np.array(re.findall(r"-?[\d.]+", part), dtype=float).reshape(-1, 2)
    end = "z" if "z" in part else ""
    if len(points) > 2:
        path = Path(points)
        path.should_simplify, path.simplify_threshold = True, UNSEEN
        kept = np.asarray(path.cleaned(simplify=True).vertices)[:-1]  # the last one only marks the end
        points = kept if len(kept) > 2 else points
    whole = np.rint(points / UNIT).astype(int)
    steps = np.diff(whole, axis=0)
    # What has no length at all may still be a dot.
    steps = steps[steps.any(axis=1)] if steps.any() else steps[:1]
    lines = "".join(map(_pair, steps.tolist()))
    return f"M{_pair(whole[0].tolist())}{'l' if lines else ''}{lines}{end}".replace("l ", "l").replace("M ", "M")


def _pair(numbers: list[int]) -> str:
    return "".join(_number(n) for n in numbers)


def _number(hundredths: int) -> str:
    """A number with what parts it from the one before: its sign, or a space."""
    whole, rest = divmod(abs(hundredths), 100)
    digits = f".{rest:02d}".rstrip("0").rstrip(".")
    text = f"{whole or ''}{digits}" or "0"
    return f"-{text}" if hundredths < 0 else f" {text}"
