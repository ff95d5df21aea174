"""The questions a user asks, as programs."""

from symmotion.design.affine import AffineDesign, affine_program, measure

__all__ = ["AffineDesign", "affine_program", "measure"]
