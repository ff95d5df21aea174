"""Keyframes and motions: numbers in, numbers out."""

from symmotion.motions import examples
from symmotion.motions.affine import Affine, AffineMotion
from symmotion.motions.baselines import component_cubic, log_blend, polar_blend, steady_morph
from symmotion.motions.dual import DualQuaternions
from symmotion.motions.keyframes import Keyframes, as_rotations
from symmotion.motions.morphing import copy_deviations, keyframes_from_copies
from symmotion.motions.pose import PoseMotion
from symmotion.motions.quaternion import QuaternionMotion
from symmotion.motions.quaternion_interpolation import interpolate_quaternions
from symmotion.motions.rational import CurveMotion, RationalMotion
from symmotion.motions.rigid import RigidSamples, orthonormalise
from symmotion.motions.slerps import shoemake_bezier, shoemake_interpolant, slerp, slerp_curve, squad
from symmotion.motions.two_parameter import TwoParameterMotion

__all__ = [
    "Affine",
    "AffineMotion",
    "CurveMotion",
    "DualQuaternions",
    "Keyframes",
    "PoseMotion",
    "QuaternionMotion",
    "RationalMotion",
    "RigidSamples",
    "TwoParameterMotion",
    "as_rotations",
    "component_cubic",
    "copy_deviations",
    "examples",
    "interpolate_quaternions",
    "keyframes_from_copies",
    "log_blend",
    "orthonormalise",
    "polar_blend",
    "shoemake_bezier",
    "shoemake_interpolant",
    "slerp",
    "slerp_curve",
    "squad",
    "steady_morph",
]
