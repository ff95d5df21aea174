"""Keyframes and motions: numbers in, numbers out."""

from symmotion.motions import examples
from symmotion.motions.affine import Affine, AffineMotion
from symmotion.motions.dual import DualQuaternions
from symmotion.motions.keyframes import PARAMETRISATIONS, Keyframes, as_rotations
from symmotion.motions.morphing import copy_deviations, keyframes_from_copies
from symmotion.motions.motion import Motion
from symmotion.motions.nets import noisy_net, smooth_net
from symmotion.motions.pose import PoseMotion
from symmotion.motions.rational import CurveMotion, RationalMotion
from symmotion.motions.rigid import RigidSamples, orthonormalise, polar_factors
from symmotion.motions.two_parameter import TwoParameterMotion

__all__ = [
    "PARAMETRISATIONS",
    "Affine",
    "AffineMotion",
    "CurveMotion",
    "DualQuaternions",
    "Keyframes",
    "Motion",
    "PoseMotion",
    "RationalMotion",
    "RigidSamples",
    "TwoParameterMotion",
    "as_rotations",
    "copy_deviations",
    "examples",
    "keyframes_from_copies",
    "noisy_net",
    "orthonormalise",
    "polar_factors",
    "smooth_net",
]
