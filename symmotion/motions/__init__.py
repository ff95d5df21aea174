"""Keyframes and motions: numbers in, numbers out."""

from typing import TYPE_CHECKING

from symmotion.motions import examples
from symmotion.motions.affine import AffineMotion
from symmotion.motions.derived import (
    PointPath,
    RelativeMotion,
    RetimedMotion,
    SequentialMotion,
    concatenate,
    part,
    reverse,
)
from symmotion.motions.dual import DualQuaternions
from symmotion.motions.keyframes import PARAMETRISATIONS, Keyframe, Keyframes, as_keyframes
from symmotion.motions.morphing import copy_deviations, keyframes_from_copies
from symmotion.motions.motion import Motion, Moving
from symmotion.motions.nets import noisy_net, smooth_net
from symmotion.motions.pose import PoseMotion
from symmotion.motions.position import Affine
from symmotion.motions.rational import CurveMotion, RationalMotion
from symmotion.motions.rigid import RigidSamples, orthonormalise, polar_factors
from symmotion.motions.rotations import as_rotations
from symmotion.motions.symmetry import POINT_GROUPS, symmetry_group
from symmotion.motions.two_parameter import TwoParameterMotion
from symmotion.renamed import moved

__all__ = [
    "PARAMETRISATIONS",
    "POINT_GROUPS",
    "Affine",
    "AffineMotion",
    "CurveMotion",
    "DualQuaternions",
    "Keyframe",
    "Keyframes",
    "Motion",
    "Moving",
    "PointPath",
    "PoseMotion",
    "RationalMotion",
    "RelativeMotion",
    "RetimedMotion",
    "RigidSamples",
    "SequentialMotion",
    "TwoParameterMotion",
    "as_keyframes",
    "as_rotations",
    "concatenate",
    "copy_deviations",
    "examples",
    "keyframes_from_copies",
    "noisy_net",
    "orthonormalise",
    "part",
    "polar_factors",
    "reverse",
    "smooth_net",
    "symmetry_group",
]

if not TYPE_CHECKING:
    # Names of 0.1.0.
    __getattr__ = moved(
        __name__,
        {
            "quaternions": "QuaternionMotion interpolate_quaternions",
            "interpolants": """
                component_cubic log_blend polar_blend shoemake_bezier shoemake_interpolant slerp slerp_curve squad
                steady_morph
            """,
        },
    )
