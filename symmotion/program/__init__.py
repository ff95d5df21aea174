"""Programs of small symbolic kernels: structure and evaluation. It knows no motions."""

from symmotion.program.block import Block, BlockEvaluator
from symmotion.program.evaluate import Evaluator, Pattern
from symmotion.program.program import Constraint, Design, Program

__all__ = [
    "Block",
    "BlockEvaluator",
    "Constraint",
    "Design",
    "Evaluator",
    "Pattern",
    "Program",
]
