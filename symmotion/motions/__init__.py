"""Keyframes and motions: numbers in, numbers out."""

from symmotion.motions import examples
from symmotion.motions.affine import Affine, AffineMotion
from symmotion.motions.baselines import component_cubic, log_blend, polar_blend, steady_morph
from symmotion.motions.keyframes import Keyframes, as_rotations
from symmotion.motions.morphing import copy_deviations, keyframes_from_copies
from symmotion.motions.rigid import RigidSamples, orthonormalise

__all__ = [
    "Affine",
    "AffineMotion",
    "Keyframes",
    "RigidSamples",
    "as_rotations",
    "component_cubic",
    "copy_deviations",
    "examples",
    "keyframes_from_copies",
    "log_blend",
    "orthonormalise",
    "polar_blend",
    "steady_morph",
]
