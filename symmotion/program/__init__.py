"""Programs of small symbolic kernels: structure and evaluation. It knows no motions."""

from typing import TYPE_CHECKING

from symmotion.program.block import WHOLE, Block
from symmotion.program.bounded import Bounded
from symmotion.program.evaluate import Evaluator, Pattern
from symmotion.program.everywhere import Everywhere, Excess, excess_at
from symmotion.program.nodes import BlockEvaluator
from symmotion.program.program import (
    Constraint,
    Design,
    DesignT,
    Integrated,
    MotionT,
    Multipliers,
    ParameterPlace,
    Program,
    Rekeyed,
    Staged,
    Target,
    Targeted,
    Targets,
    Turning,
)
from symmotion.program.quadrature import QUADRATURE, Quadrature
from symmotion.renamed import moved

__all__ = [
    "QUADRATURE",
    "WHOLE",
    "Block",
    "BlockEvaluator",
    "Bounded",
    "Constraint",
    "Design",
    "DesignT",
    "Evaluator",
    "Everywhere",
    "Excess",
    "Integrated",
    "MotionT",
    "Multipliers",
    "ParameterPlace",
    "Pattern",
    "Program",
    "Quadrature",
    "Rekeyed",
    "Staged",
    "Target",
    "Targeted",
    "Targets",
    "Turning",
    "excess_at",
]

if not TYPE_CHECKING:
    # Names of 0.1.0.
    __getattr__ = moved(
        __name__,
        {
            "systems": "Certificate Condensed HessianTriangle Saddle certify kkt_pattern system_of",
            "kernels": "Kernel Kernels available_processors",
        },
        {
            "gradient_scale": "certificate.decrement, which needs no scale",
        },
    )
