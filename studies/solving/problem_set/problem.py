"""What a problem is, and what of it was measured on a motion without bounds."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

import symmotion as sm


@dataclass(frozen=True, eq=False)
class Problem:
    """A program; kind: what makes it hard, or what is bounded; name: its seed and make.

    measured: what went into it that a solve has found, such as the speed of the motion without the bound.
    """

    kind: str
    name: str
    program: sm.program.Program
    measured: tuple[float, ...] = ()


class Measured:
    """Numbers that a solve finds, or that are known from when it was made: with these a problem is always the same.

    known: those of before that are left, in their order; None to find them. numbers: what was handed out.
    """

    def __init__(self, known: Sequence[float] | None = None):
        self.known = None if known is None else list(known)
        self.numbers: tuple[float, ...] = ()

    def __call__(self, find: Callable[[], float]) -> float:
        """The next number, which `find` finds where it is not known."""
        return float(self.all(find, 1)[0])

    def all(self, find: Callable[[], ArrayLike], count: int) -> np.ndarray:
        """(count,) the next numbers, which `find` finds where they are not known."""
        if self.known is None:
            found = np.asarray(find(), dtype=float).reshape(count)
        else:
            found, self.known = np.array(self.known[:count]), self.known[count:]
            if len(found) < count:
                raise sm.InputError(f"known: {count - len(found)} numbers are missing")
        self.numbers += tuple(found.tolist())
        return found
