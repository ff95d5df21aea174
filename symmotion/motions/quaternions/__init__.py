"""Unit quaternion curves: algebra, evaluation, interpolation."""

from symmotion.motions.quaternions.algebra import conjugate, exp, from_rotation, log, product, rotate, to_rotation
from symmotion.motions.quaternions.curve import QuaternionMotion
from symmotion.motions.quaternions.interpolation import interpolate_quaternions
from symmotion.motions.quaternions.keys import OrientationKeys

__all__ = [
    "OrientationKeys",
    "QuaternionMotion",
    "conjugate",
    "exp",
    "from_rotation",
    "interpolate_quaternions",
    "log",
    "product",
    "rotate",
    "to_rotation",
]
