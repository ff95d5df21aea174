"""The questions a user asks, as programs."""

from symmotion.design.affine import AffineDesign, affine_program
from symmotion.design.curve import CurveDesign, curve_program
from symmotion.design.fitting import FitDesign, fit_program
from symmotion.design.free_times import FreeTimesDesign, free_times_program
from symmotion.design.joined import JoinedDesign, join
from symmotion.design.measure import measure
from symmotion.design.orientation import OrientationDesign, orientation_program
from symmotion.design.pose import PoseDesign, pose_program

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
