"""Kernels: the small symbolic functions that programs are made of, interpreted or as machine code."""

from symmotion.kernels.arrays import ArrayFunction
from symmotion.kernels.kernel import Kernel
from symmotion.kernels.mapped import (
    Kernels,
    Mapped,
    available_processors,
    default_threads,
    expect,
    is_compilable,
    kernel_function,
)

__all__ = [
    "ArrayFunction",
    "Kernel",
    "Kernels",
    "Mapped",
    "available_processors",
    "default_threads",
    "expect",
    "is_compilable",
    "kernel_function",
]
