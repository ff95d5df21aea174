"""What every jet has, whatever the motion: the entries that it is made of, and body points where there are."""

from collections.abc import Callable, Sequence
from typing import Protocol, TypeVar, runtime_checkable

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike

from symmotion import checks
from symmotion.errors import InputError


class AnyJet(Protocol):
    """A motion and its derivatives at one parameter, as CasADi expressions.

    kind: which jet it is, the same for jets of the same entries. entries: (N, 1), all that it is made of; the
    time is the last.
    """

    @property
    def kind(self) -> str: ...

    @property
    def entries(self) -> ca.SX: ...


@runtime_checkable
class BodyJet(AnyJet, Protocol):
    """A jet of a moving body: affine, orientation or pose."""

    @property
    def dimension(self) -> int: ...

    def place(self, point: ArrayLike) -> ca.SX:
        """(d, 1) where a body point (d,) is."""
        ...

    def velocity(self, point: ArrayLike) -> ca.SX:
        """(d, 1) its velocity."""
        ...

    def acceleration_of(self, point: ArrayLike) -> ca.SX:
        """(d, 1) its acceleration."""
        ...

    def bending(self, points: np.ndarray, masses: np.ndarray) -> ca.SX:
        """Residuals whose squares add up to Σ m_i ‖acceleration of p_i‖², however many points (P, d) there are."""
        ...


T = TypeVar("T")


def expressed(failing: str, jets: Sequence[AnyJet], say: Callable[[], T]) -> T:
    """What `say` says of jets; an InputError `failing` with the kinds of the jets where it cannot."""
    try:
        return say()
    except InputError:
        raise
    except (AttributeError, TypeError, NotImplementedError, RuntimeError, IndexError) as error:
        kinds = " and ".join(jet.kind for jet in jets)
        said = str(error).splitlines()[0] if str(error) else type(error).__name__
        raise InputError(f"{failing} jets of kind {kinds}: {said[:300]}") from error


def body_point(point: ArrayLike, dimension: int) -> ca.DM | ca.SX:
    """A body point as a column; symbols pass, numbers are checked."""
    if isinstance(point, ca.SX | ca.DM):
        column = ca.vec(point)
        if column.numel() != dimension:
            raise InputError(f"a body point of {column.numel()} coordinates: {dimension} are needed")
        return column
    numbers = checks.numbers(point, "body point")
    if numbers.shape != (dimension,) or not np.isfinite(numbers).all():
        raise InputError(f"body point of shape {numbers.shape}: finite, ({dimension},), is needed")
    return ca.DM(numbers)


def column(parts: Sequence[ca.SX]) -> ca.SX:
    """All entries of matrices (column by column) in one column."""
    return ca.vertcat(*(ca.vec(p) for p in parts))
