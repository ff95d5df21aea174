"""Constraints: what must hold of a motion. `JetConstraint` says anything; the others are short forms of it."""

from symmotion.constraints.bounds import (
    AccelerationBound,
    NoInversion,
    RateBound,
    SpeedBound,
    TorqueBound,
    UnitVolume,
)
from symmotion.constraints.constraint import JetConstraint, MotionConstraint
from symmotion.constraints.curves import CurveCondition
from symmotion.constraints.exceeded import excess
from symmotion.constraints.keyframed import (
    AngularRate,
    EndAccelerations,
    EndRates,
    ExactSamples,
    OnLine,
    Periodic,
    Tolerance,
    Velocity,
)
from symmotion.constraints.setting import Setting, dense_times

__all__ = [
    "AccelerationBound",
    "AngularRate",
    "CurveCondition",
    "EndAccelerations",
    "EndRates",
    "ExactSamples",
    "JetConstraint",
    "MotionConstraint",
    "NoInversion",
    "OnLine",
    "Periodic",
    "RateBound",
    "Setting",
    "SpeedBound",
    "Tolerance",
    "TorqueBound",
    "UnitVolume",
    "Velocity",
    "dense_times",
    "excess",
]
