"""Invariant measures of distortion: they do not depend on test vectors or on the choice of the moving frame."""

from dataclasses import dataclass

import casadi as ca
import numpy as np

from symmotion.energies.energy import Energy
from symmotion.jets.affine import Jet


@dataclass(frozen=True, eq=False)
class StrainRate(Energy):
    """S = ∫ tr((G⁻¹Ġ)²) dt = 4 ∫ ‖sym(Ȧ A⁻¹)‖² dt, G = AᵀA: the integrated squared rate of strain.

    It is the same for U A(t) B with U orthogonal and B any nonsingular matrix, which answers
    the open question of HJK 3.1; in the affine-invariant metric of positive definite matrices it
    is the squared speed of G. Unit 1/time. A must stay nonsingular.

    >>> motion = sm.interpolants.component_cubic(sm.examples.sheared_turn())
    >>> other = sm.AffineMotion(motion.basis, motion.linear @ [[2.0, 1.0], [0.0, 1.0]], motion.translation)
    >>> round(sm.measure(motion, sm.StrainRate()) - sm.measure(other, sm.StrainRate()), 9) + 0.0
    0.0
    """

    @property
    def name(self) -> str:
        return "S"

    @property
    def divides_by_volume(self) -> bool:
        return True

    def residuals(self, jet: Jet) -> ca.SX:
        gradient = jet.dA @ ca.inv_minor(jet.A)
        return _independent(gradient + gradient.T)


@dataclass(frozen=True, eq=False)
class StrainAcceleration(Energy):
    """S* = ∫ tr((G⁻¹(G̈ − Ġ G⁻¹ Ġ))²) dt, the squared covariant acceleration of G = AᵀA.

    Zero where G moves along a geodesic of the affine-invariant metric; invariant like S. With
    B = Ȧ A⁻¹ and C = Ä A⁻¹ its residuals are C + Cᵀ + 2BᵀB − (B + Bᵀ)². Unit 1/time³. A must
    stay nonsingular.

    >>> motion = sm.interpolants.component_cubic(sm.examples.quarter_turn())
    >>> round(sm.measure(motion, sm.StrainAcceleration()), 6)
    46.466075
    """

    @property
    def name(self) -> str:
        return "S*"

    @property
    def divides_by_volume(self) -> bool:
        return True

    def residuals(self, jet: Jet) -> ca.SX:
        inverse = ca.inv_minor(jet.A)
        b, c = jet.dA @ inverse, jet.ddA @ inverse
        rate = b + b.T
        return _independent(c + c.T + 2 * b.T @ b - rate @ rate)


def _independent(symmetric: ca.SX) -> ca.SX:
    """The entries of a symmetric matrix that are not mirror images, weighted so that squares add to the norm."""
    d = symmetric.shape[0]
    return ca.vertcat(*((1 if i == j else np.sqrt(2)) * symmetric[i, j] for i in range(d) for j in range(i + 1)))
