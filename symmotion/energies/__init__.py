"""Energies: integrands of a motion's jet, as CasADi expressions that add and scale."""

from symmotion.energies.affine import Rigidity, TrajectoryEnergy
from symmotion.energies.curve import Bending
from symmotion.energies.energy import Energy, EnergySum, JetEnergy
from symmotion.energies.strain import StrainAcceleration, StrainRate
from symmotion.energies.torque import Torque, as_inertia

__all__ = [
    "Bending",
    "Energy",
    "EnergySum",
    "JetEnergy",
    "Rigidity",
    "StrainAcceleration",
    "StrainRate",
    "Torque",
    "TrajectoryEnergy",
    "as_inertia",
]
