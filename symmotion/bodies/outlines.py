"""Outlines of bodies for pictures by one call: those that a user gives, and one that suits the motion."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from symmotion.errors import InputError
from symmotion.motions import Affine
from symmotion.views.drawing import letter_k

Body = ArrayLike | Sequence[ArrayLike]


def body_size(path: Affine, count: int) -> tuple[float, bool]:
    """How large a body, in its own coordinates, suits `count` copies along a path; whether its origin stays in place.

    About as large as the distance between copies, within a share of the whole; the largest copy counts.
    """
    stretch = float(np.linalg.svd(path.linear, compute_uv=False).max()) or 1.0
    v = path.translation
    extent = float(np.linalg.norm(np.ptp(v, axis=0)))
    # Below this the way is rounding: of where it lies, or of what the linear part does.
    if extent <= 1e-9 * max(float(np.abs(v).max()), stretch):
        return 1.0 / stretch, True
    spacing = float(np.linalg.norm(np.diff(v, axis=0), axis=1).sum()) / max(count - 1, 1)
    return float(np.clip(1.1 * spacing, 0.1 * extent, 0.3 * extent)) / stretch, False


def default_body(dimension: int, size: float) -> list[np.ndarray]:
    """A letter K of a size, in space a slab of that shape, as closed polygons (P, d)."""
    flat = letter_k()[0]
    flat = flat * size / np.ptp(flat, axis=0).max()
    if dimension == 2:
        return [flat]
    # Upright: the letter is read from −y.
    low, high = (np.column_stack([flat[:, 0], np.full(len(flat), y * size), flat[:, 1]]) for y in (-0.15, 0.15))
    sides = [np.stack([low[i - 1], low[i], high[i], high[i - 1]]) for i in range(len(flat))]
    return [low, high, *sides]


def as_outlines(body: Body, dimension: int) -> list[np.ndarray]:
    """The outlines (P, d) of a body, checked; one polygon alone is a body too."""
    try:
        whole = np.asarray(body, dtype=float)
        outlines = [whole] if whole.ndim == 2 else list(whole)
    except ValueError:
        # Polygons of different lengths.
        outlines = []
        for outline in body:  # pyright: ignore[reportGeneralTypeIssues] - what has no length is no array either
            try:
                outlines.append(np.asarray(outline, dtype=float))
            except (TypeError, ValueError):
                raise InputError("body: outlines are arrays of numbers (P, d)") from None
    except TypeError:
        raise InputError(f"body: a {type(body).__name__} is no outline; closed polygons (P, d) are needed") from None
    if not outlines:
        raise InputError("body: one outline or more is needed")
    for i, outline in enumerate(outlines):
        if outline.ndim != 2 or outline.shape[1] != dimension or len(outline) < 2:
            raise InputError(f"body, outline {i}: shape {outline.shape}; (P, {dimension}), P ≥ 2, is needed")
        if not np.isfinite(outline).all():
            raise InputError(f"body, outline {i}: a point is not finite")
    return outlines
