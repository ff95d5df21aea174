"""Saddle systems of programs, condensed or sparse, and the certificate of a point."""

from symmotion.systems.certificate import Certificate, certify, system_of
from symmotion.systems.condensed import Condensed
from symmotion.systems.conflicts import conflict, conflicting
from symmotion.systems.curvature import Curvature
from symmotion.systems.saddle import HessianTriangle, Saddle, kkt_pattern
from symmotion.systems.system import AnyFactor, AnySystem, System, largest, reach, shifted, tenfold

__all__ = [
    "AnyFactor",
    "AnySystem",
    "Certificate",
    "Condensed",
    "Curvature",
    "HessianTriangle",
    "Saddle",
    "System",
    "certify",
    "conflict",
    "conflicting",
    "kkt_pattern",
    "largest",
    "reach",
    "shifted",
    "system_of",
    "tenfold",
]
