"""What there is to show of a solution, whatever question its program asks."""

from typing import Protocol, runtime_checkable

import numpy as np
from matplotlib.axes import Axes

from symmotion.design.affine import AffineDesign
from symmotion.design.free_times import FreeTimesDesign
from symmotion.design.pose import PoseDesign
from symmotion.errors import InputError
from symmotion.motions import Affine, Keyframes
from symmotion.motions.quaternions.algebra import to_rotation
from symmotion.solvers import Solution
from symmotion.splines import Spline


@runtime_checkable
class Drawn(Protocol):
    """What has a picture of its own."""

    def plot(self, axes: Axes | None = None) -> Axes: ...


def motion_or_none(solution: Solution) -> Spline | Drawn | None:
    """The solution's motion or curve, None where it has no picture: it is not finite, or of a kind not drawn."""
    if not np.isfinite(solution.x).all() or not hasattr(solution.program.design, "motion"):
        return None
    try:
        motion = solution.motion
    except InputError:
        # Where a solver stopped half-way, control quaternions may be zero.
        return None
    return motion if isinstance(motion, Spline | Drawn) else None


def keyframes_of(solution: Solution) -> Keyframes | None:
    """The keyframes that a body takes in a solution, at the times it has there; None where there are none."""
    design = solution.program.design
    if isinstance(design, FreeTimesDesign):
        return design.keyframes_at(solution.x)
    if isinstance(design, AffineDesign):
        return design.keyframes
    if isinstance(design, PoseDesign):
        keys = design.turning.keys
        return Keyframes.from_rotations(keys.times, to_rotation(keys.quaternions), design.translation)
    return None


def keyframe_multipliers(solution: Solution) -> dict[str, np.ndarray]:
    """‖λᵢ‖ (M,) of every keyframe by part: "linear part" and "translation", or "turn"; empty where there are none.

    In units of the objective per unit of an entry, per unit of length, per radian.
    """
    # Its translations may be a group of their own, "keyframes, translation".
    keyed = any(c.name.startswith("keyframes") for c in solution.program.constraints)
    prices = solution.multipliers.get("keyframes") if keyed else None
    if isinstance(prices, Affine):
        sizes = {
            "linear part": np.linalg.norm(prices.linear, axis=(1, 2)),
            "translation": np.linalg.norm(prices.translation, axis=1),
        }
        # Of an objective that does not see the translation there is nothing to tell.
        return {name: size for name, size in sizes.items() if size.any()} or sizes
    if prices is None:
        return {}
    sizes = {"turn": np.linalg.norm(prices, axis=1)}
    if isinstance(solution.program.design, PoseDesign):
        sizes["translation"] = np.linalg.norm(solution.multipliers["translation"], axis=1)
    return sizes
