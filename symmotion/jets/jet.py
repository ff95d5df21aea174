"""What every jet has, whatever the motion: the entries that it is made of, and body points where there are."""

from collections.abc import Callable, Sequence
from typing import Any, Protocol, TypeVar, runtime_checkable

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike

from symmotion import checks
from symmotion.errors import InputError


class AnyJet(Protocol):
    """A motion and its derivatives at one parameter, as CasADi expressions.

    kind: which jet it is, the same for jets of the same entries. entries: (N, 1), all that it is made of; the
    time is the last.

    >>> seen = []
    >>> energy = sm.JetEnergy(lambda jet: (seen.append(jet.kind), jet.dx)[1], squares=True, label="speed")
    >>> round(sm.measure(sm.curves.bezier([[0.0], [2.0]]), energy), 6)
    4.0
    >>> set(seen)
    {'curve 1 × 1'}
    """

    @property
    def kind(self) -> str:
        """Which jet it is, in words: the same for jets of the same entries."""
        ...

    @property
    def entries(self) -> ca.SX:
        """(N, 1) all that it is made of; the time is the last."""
        ...


@runtime_checkable
class BodyJet(AnyJet, Protocol):
    """A jet of a moving body: affine, orientation or pose.

    >>> tip = sm.JetConstraint(lambda jet: jet.place([1.0, 0.0])[1], lower=-10.0, upper=np.inf, name="floor")
    >>> sm.excess(sm.interpolants.component_cubic(sm.examples.planar_keyframes()), tip).value
    0.0
    """

    @property
    def dimension(self) -> int:
        """Of the space that the body is in, d."""
        ...

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


def of_kind(self: AnyJet) -> str:
    """The `__repr__` of jets."""
    return f"{type(self).__name__}({self.kind})"


T = TypeVar("T")
COMPARISONS = (ca.OP_LT, ca.OP_LE, ca.OP_EQ, ca.OP_NE, ca.OP_NOT, ca.OP_AND, ca.OP_OR)


def said(name: str, part: str, what: str, say: Callable[[], T]) -> T:
    """What a function of the user's own returns; what it raises as an InputError that names the owner of the function.

    name: of the constraint or energy; part: of it, "" for the whole; what: on which it fails.
    """
    try:
        return say()
    except InputError as error:
        if str(error).startswith(tuple(f"{name}{word}" for word in (": ", " is ", " returns ", " states "))):
            raise
        raise InputError(f"{name}: {error}") from error
    except Exception as error:
        line = (str(error).strip() or "no message").splitlines()[0]
        who = f"{name}: {part}" if part else name
        raise InputError(f"{who} fails on {what}: {type(error).__name__}: {line[:300]}") from error


def of_jets(jets: Sequence[AnyJet]) -> str:
    """How messages call them."""
    return f"jets of kind {' and '.join(jet.kind for jet in jets)}"


# Any: whatever a function returned.
def as_expression(who: str, found: Any) -> ca.SX:
    """What a function of the user's own returned as an expression; InputError where it is none that can be used."""
    try:
        given = isinstance(found, ca.SX) or (isinstance(found, np.ndarray) and found.dtype.kind == "O")
        out = ca.SX(found) if given else None
    except (NotImplementedError, TypeError):
        out = None
    if out is None:
        kind = "None" if found is None else f"something of type {type(found).__name__}"
        raise InputError(
            f"{who} returns {kind}: a CasADi expression of the jet is needed; ca.vertcat(…) makes a column of several"
        )
    if not out.numel():
        raise InputError(f"{who} returns an empty expression")
    entries: list[Any] = out.nonzeros()  # Any: CasADi's stubs leave out what its elements can do
    if any(not entry.is_leaf() and entry.op() in COMPARISONS for entry in entries):
        raise InputError(f"{who} returns a comparison: give the expression itself, its bounds as lower= and upper=")
    return out


def require_closed(who: str, out: ca.SX, jets: Sequence[AnyJet], more: Sequence[ca.SX] = ()) -> None:
    """InputError unless an expression is one of the motion, of no other symbols, and of numbers that are finite.

    jets: made of symbols; more: further symbols that it may hold.
    """
    entries = [jet.entries for jet in jets]
    inputs = [*(e[:-1] for e in entries), *(e[-1] for e in entries), *more]
    function = ca.Function("closed", inputs, [out], {"allow_free": True})
    if function.has_free():
        raise InputError(f"{who} holds the symbol {function.get_free()[0]}, which is neither the jet's nor a parameter")
    constants = (k for k in range(function.n_instructions()) if function.instruction_id(k) == ca.OP_CONST)
    for value in map(function.instruction_constant, constants):
        if not np.isfinite(value):
            raise InputError(f"{who} holds the number {value}: finite ones are needed")
    if not any(function.jac_sparsity(0, k).nnz() for k in range(len(jets))):
        raise InputError(f"{who} does not depend on the motion")


def body_point(point: ArrayLike, dimension: int) -> ca.DM | ca.SX:
    """A body point as a column; symbols pass, numbers are checked."""
    if isinstance(point, ca.SX | ca.DM):
        column = ca.vec(point)
        if column.numel() != dimension:
            raise InputError(f"a body point of {column.numel()} coordinates: {dimension} are needed")
        return column
    return ca.DM(checks.array(point, (dimension,), "body point"))


def column(parts: Sequence[ca.SX]) -> ca.SX:
    """All entries of matrices (column by column) in one column."""
    return ca.vertcat(*(ca.vec(p) for p in parts))
