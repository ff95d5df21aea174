"""Unit quaternion curves: algebra, evaluation, interpolation."""

from symmotion.motions.quaternions.algebra import conjugate, exp, from_rotation, log, product, rotate, to_rotation
from symmotion.motions.quaternions.curve import QuaternionMotion
from symmotion.motions.quaternions.interpolation import interpolate_quaternions
from symmotion.motions.quaternions.keys import OrientationKeys
from symmotion.motions.quaternions.products import ProductMotion
from symmotion.motions.quaternions.travel import angles_travelled, extra_turns

__all__ = [
    "OrientationKeys",
    "ProductMotion",
    "QuaternionMotion",
    "angles_travelled",
    "conjugate",
    "exp",
    "extra_turns",
    "from_rotation",
    "interpolate_quaternions",
    "log",
    "product",
    "rotate",
    "to_rotation",
]
