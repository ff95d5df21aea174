"""Keyframes and motions: numbers in, numbers out."""

from symmotion.motions import examples
from symmotion.motions.affine import Affine, AffineMotion
from symmotion.motions.keyframes import Keyframes, as_rotations

__all__ = ["Affine", "AffineMotion", "Keyframes", "as_rotations", "examples"]
