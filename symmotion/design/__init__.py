"""The questions a user asks, as programs."""

from typing import TYPE_CHECKING

from symmotion.design.affine import AffineDesign, affine_program
from symmotion.design.curve import CurveDesign, curve_program
from symmotion.design.fitting import FitDesign, fit_program
from symmotion.design.free_times import FreeTimesDesign, free_times_program
from symmotion.design.joined import JoinedDesign, join
from symmotion.design.measure import measure
from symmotion.design.orientation import OrientationDesign, orientation_program
from symmotion.design.pose import PoseDesign, pose_program
from symmotion.renamed import moved

__all__ = [
    "AffineDesign",
    "CurveDesign",
    "FitDesign",
    "FreeTimesDesign",
    "JoinedDesign",
    "OrientationDesign",
    "PoseDesign",
    "affine_program",
    "curve_program",
    "fit_program",
    "free_times_program",
    "join",
    "measure",
    "orientation_program",
    "pose_program",
]

if not TYPE_CHECKING:
    # Names of 0.1.0.
    __getattr__ = moved(
        __name__,
        {
            "constraints": """
                AngularRate CurveCondition MotionConstraint NoInversion OnLine Periodic SpeedBound Tolerance
                UnitVolume Velocity
            """,
            "answers": "KeyframePrices KnotSearch auto_knots auxiliary_keyframes keyframe_prices",
        },
        {
            "Limits": "constraints=[RateBound(…), AccelerationBound(…), TorqueBound(…)]",
            "measure_torque": "measure(motion, Torque(inertia))",
        },
    )
