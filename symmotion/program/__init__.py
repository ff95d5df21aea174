"""Programs of small symbolic kernels: structure and evaluation. It knows no motions."""

from symmotion.program.block import WHOLE, Block, BlockEvaluator
from symmotion.program.evaluate import Evaluator, Pattern
from symmotion.program.everywhere import Everywhere, Excess, excess_at
from symmotion.program.program import (
    Constraint,
    Design,
    DesignT,
    MotionT,
    Multipliers,
    ParameterPlace,
    Program,
    Rekeyed,
    Staged,
)

__all__ = [
    "WHOLE",
    "Block",
    "BlockEvaluator",
    "Constraint",
    "Design",
    "DesignT",
    "Evaluator",
    "Everywhere",
    "Excess",
    "MotionT",
    "Multipliers",
    "ParameterPlace",
    "Pattern",
    "Program",
    "Rekeyed",
    "Staged",
    "excess_at",
]
