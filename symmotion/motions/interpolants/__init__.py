"""The classical interpolants of keyframes that need no optimisation."""

from symmotion.motions.interpolants.blends import component_cubic, log_blend, polar_blend, steady_morph
from symmotion.motions.interpolants.slerps import (
    SegmentCurve,
    shoemake_bezier,
    shoemake_interpolant,
    slerp,
    slerp_curve,
    squad,
)

__all__ = [
    "SegmentCurve",
    "component_cubic",
    "log_blend",
    "polar_blend",
    "shoemake_bezier",
    "shoemake_interpolant",
    "slerp",
    "slerp_curve",
    "squad",
    "steady_morph",
]
