"""The options that solvers share, refused where they are given."""

from typing import get_args

from symmotion.checks import choice, positive, whole
from symmotion.errors import InputError
from symmotion.kernels import Kernels
from symmotion.solvers.journal import Callback


def require_kernels(kernels: Kernels, threads: int | None) -> None:
    """Raise InputError that names the option, unless these two are what an `Evaluator` takes."""
    choice(kernels, get_args(Kernels), "kernels")
    if threads is not None:
        whole(threads, 1, "threads")


def require_limits(tolerance: float, max_iterations: int, time_limit: float | None, callback: Callback | None) -> None:
    """Raise InputError that names the option, unless these four are what every solver takes.

    tolerance: positive; max_iterations: 1 or more; time_limit: in seconds, or None; callback: of an Iteration, or None.

    >>> sm.solvers.require_limits(1e-8, 100, None, None)
    """
    positive(tolerance, "tolerance")
    whole(max_iterations, 0, "max_iterations")
    if time_limit is not None:
        positive(time_limit, "time_limit")
    if callback is not None and not callable(callback):
        raise InputError(f"callback {callback!r}: a function of an Iteration is needed")
