"""Energies: integrands of a motion's jet, as CasADi expressions that add and scale."""

from typing import TYPE_CHECKING

from symmotion.energies.affine import Rigidity, TrajectoryEnergy
from symmotion.energies.curve import Bending
from symmotion.energies.energy import Energy, EnergySum, JetEnergy
from symmotion.energies.roughness import Roughness
from symmotion.energies.slip import SideSlip
from symmotion.energies.strain import StrainAcceleration, StrainRate
from symmotion.energies.torque import Torque, as_inertia
from symmotion.renamed import moved

__all__ = [
    "Bending",
    "Energy",
    "EnergySum",
    "JetEnergy",
    "Rigidity",
    "Roughness",
    "SideSlip",
    "StrainAcceleration",
    "StrainRate",
    "Torque",
    "TrajectoryEnergy",
    "as_inertia",
]

if not TYPE_CHECKING:
    # Names of 0.1.0.
    __getattr__ = moved(
        __name__,
        {
            "jets": "HIGHEST_ORDER Jet",
        },
    )
