"""Unit quaternion curves: algebra, evaluation, interpolation."""

from symmotion.motions.quaternions.curve import QuaternionMotion
from symmotion.motions.quaternions.interpolation import interpolate_quaternions
from symmotion.motions.quaternions.keys import OrientationKeys

__all__ = [
    "OrientationKeys",
    "QuaternionMotion",
    "interpolate_quaternions",
]
