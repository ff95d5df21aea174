"""Saddle systems of programs, condensed or sparse, and the certificate of a point."""

from symmotion.systems.certificate import Certificate, Inspection, certify, system_of
from symmotion.systems.condensed import Condensed
from symmotion.systems.conflicts import conflict, conflicting
from symmotion.systems.curvature import Curvature
from symmotion.systems.response import AnyReading, Response, response_of
from symmotion.systems.saddle import HessianTriangle, Saddle, kkt_pattern
from symmotion.systems.system import (
    AnyFactor,
    AnySystem,
    System,
    gram_factor,
    largest,
    own_size,
    reach,
    shifted,
    solved,
    tenfold,
)

__all__ = [
    "AnyFactor",
    "AnyReading",
    "AnySystem",
    "Certificate",
    "Condensed",
    "Curvature",
    "HessianTriangle",
    "Inspection",
    "Response",
    "Saddle",
    "System",
    "certify",
    "conflict",
    "conflicting",
    "gram_factor",
    "kkt_pattern",
    "largest",
    "own_size",
    "reach",
    "response_of",
    "shifted",
    "solved",
    "system_of",
    "tenfold",
]
