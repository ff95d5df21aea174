"""The classical interpolants of keyframes that need no optimisation."""

from symmotion.motions.interpolants.blends import component_cubic, log_blend, polar_blend, steady_morph
from symmotion.motions.interpolants.monotone import monotone_curve
from symmotion.motions.interpolants.rational import rational_spline
from symmotion.motions.interpolants.slerps import (
    SegmentCurve,
    barry_goldman,
    shoemake_bezier,
    shoemake_interpolant,
    slerp,
    slerp_bspline,
    slerp_curve,
    squad,
)

__all__ = [
    "SegmentCurve",
    "barry_goldman",
    "component_cubic",
    "log_blend",
    "monotone_curve",
    "polar_blend",
    "rational_spline",
    "shoemake_bezier",
    "shoemake_interpolant",
    "slerp",
    "slerp_bspline",
    "slerp_curve",
    "squad",
    "steady_morph",
]
