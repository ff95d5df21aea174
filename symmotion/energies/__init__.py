"""Integrands of a motion's jet, as pure CasADi expressions."""

from symmotion.energies.affine import Rigidity, TrajectoryEnergy
from symmotion.energies.energy import Energy, EnergySum, JetEnergy
from symmotion.energies.strain import StrainAcceleration, StrainRate

__all__ = [
    "Energy",
    "EnergySum",
    "JetEnergy",
    "Rigidity",
    "StrainAcceleration",
    "StrainRate",
    "TrajectoryEnergy",
]
