"""Fairing of two-parameter and one-parameter rational B-spline motions (PCG, after Hahmann)."""

from symmotion.fairing.borders import Continued
from symmotion.fairing.coordinates import Coordinates
from symmotion.fairing.fair import METHODS, Method, fair
from symmotion.fairing.jumps import Jumps, StepTables
from symmotion.fairing.keyframes import NetKeyframe, NetPlace
from symmotion.fairing.metrics import Metric
from symmotion.fairing.path import FairingPath, fairing_path
from symmotion.fairing.programs import fairing_program, local_step_program
from symmotion.fairing.result import FairingResult, FairingStatus

__all__ = [
    "METHODS",
    "Continued",
    "Coordinates",
    "FairingPath",
    "FairingResult",
    "FairingStatus",
    "Jumps",
    "Method",
    "Metric",
    "NetKeyframe",
    "NetPlace",
    "StepTables",
    "fair",
    "fairing_path",
    "fairing_program",
    "local_step_program",
]
