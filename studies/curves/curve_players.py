"""What the studies of motion curves share: dots that travel, as players."""

from collections.abc import Mapping
from typing import Any

import numpy as np

import symmotion as sm
from symmotion.bodies import ellipse
from symmotion.report import Player, Travelling, player


def dot_player(
    name: str,
    curves: Mapping[str, Travelling],
    radius: float,
    caption: str,
    keys: tuple[np.ndarray, np.ndarray] | None = None,
    unit: str = "",
) -> Player:
    """A dot under planar curves; keys: times (M,) and places (M, 2) that stay in sight."""
    dot = [ellipse([0, 0], [radius, radius], points=20)]
    keyframes = None if keys is None else sm.Keyframes(keys[0], np.tile(np.eye(2), (len(keys[0]), 1, 1)), keys[1])
    return player(name, curves, dot, caption, keyframes, unit=unit)


def thrown(height: Any, speed: float) -> Travelling:
    """Heights over time, a curve with breakpoints, as a path in the plane that goes to the right at a speed."""

    def place(t: Any, nu: int) -> np.ndarray:
        return np.stack([speed * np.asarray(t) if nu == 0 else np.full_like(t, speed), height(t, nu)], axis=-1)

    return Travelling(place, (height.breakpoints[0], height.breakpoints[-1]))
