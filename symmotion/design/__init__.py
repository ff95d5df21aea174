"""The questions a user asks, as programs."""

from symmotion.design.affine import AffineDesign, affine_program
from symmotion.design.constraints import (
    AngularRate,
    MotionConstraint,
    NoInversion,
    OnLine,
    Periodic,
    SpeedBound,
    Tolerance,
    UnitVolume,
    Velocity,
)
from symmotion.design.jets import measure
from symmotion.design.knots import KnotSearch, auto_knots, auxiliary_keyframes
from symmotion.design.prices import KeyframePrices, keyframe_prices

__all__ = [
    "AffineDesign",
    "AngularRate",
    "KeyframePrices",
    "KnotSearch",
    "MotionConstraint",
    "NoInversion",
    "OnLine",
    "Periodic",
    "SpeedBound",
    "Tolerance",
    "UnitVolume",
    "Velocity",
    "affine_program",
    "auto_knots",
    "auxiliary_keyframes",
    "keyframe_prices",
    "measure",
]
