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
from symmotion.design.curve import CurveDesign, curve_program
from symmotion.design.curve_conditions import CurveCondition
from symmotion.design.fitting import fit_program
from symmotion.design.free_times import free_times_program
from symmotion.design.jets import measure
from symmotion.design.orientation import Limits, measure_torque, orientation_program
from symmotion.design.pose import pose_program
from symmotion.design.sampled import measure_sampled

__all__ = [
    "AffineDesign",
    "AngularRate",
    "CurveCondition",
    "CurveDesign",
    "Limits",
    "MotionConstraint",
    "NoInversion",
    "OnLine",
    "Periodic",
    "SpeedBound",
    "Tolerance",
    "UnitVolume",
    "Velocity",
    "affine_program",
    "curve_program",
    "fit_program",
    "free_times_program",
    "measure",
    "measure_sampled",
    "measure_torque",
    "orientation_program",
    "pose_program",
]
