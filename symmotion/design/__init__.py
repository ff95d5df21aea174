"""The questions a user asks, as programs."""

from symmotion.design.affine import AffineDesign, affine_program

__all__ = ["AffineDesign", "affine_program"]
