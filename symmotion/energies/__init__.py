"""Integrands of a motion's jet, as pure CasADi expressions."""

from symmotion.energies.affine import Rigidity, TrajectoryEnergy
from symmotion.energies.energy import Energy, EnergySum, JetEnergy
from symmotion.energies.jet import HIGHEST_ORDER, Jet
from symmotion.energies.strain import StrainAcceleration, StrainRate

__all__ = [
    "HIGHEST_ORDER",
    "Energy",
    "EnergySum",
    "Jet",
    "JetEnergy",
    "Rigidity",
    "StrainAcceleration",
    "StrainRate",
    "TrajectoryEnergy",
]
