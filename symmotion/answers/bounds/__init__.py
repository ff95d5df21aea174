"""Bounds below every minimum: polynomials, their relaxation, what it proves, and the minimisers it shows."""

from symmotion.answers.bounds.bound import LowerBound, lower_bound
from symmotion.answers.bounds.proof import Proof

__all__ = ["LowerBound", "Proof", "lower_bound"]
