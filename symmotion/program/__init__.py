"""Programs of small symbolic kernels: structure, evaluation, saddle systems, certificates. It knows no motions."""

from symmotion.program.block import Block, BlockEvaluator
from symmotion.program.certificate import Certificate, certify, gradient_scale, system_of
from symmotion.program.condensed import Condensed
from symmotion.program.evaluate import Evaluator
from symmotion.program.kernel import Kernel
from symmotion.program.mapped import Kernels, available_processors
from symmotion.program.program import Constraint, Design, Program
from symmotion.program.saddle import HessianTriangle, Saddle, kkt_pattern

__all__ = [
    "Block",
    "BlockEvaluator",
    "Certificate",
    "Condensed",
    "Constraint",
    "Design",
    "Evaluator",
    "HessianTriangle",
    "Kernel",
    "Kernels",
    "Program",
    "Saddle",
    "available_processors",
    "certify",
    "gradient_scale",
    "kkt_pattern",
    "system_of",
]
