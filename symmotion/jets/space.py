"""Where the jets of a program's motion come from: expressions of them as kernels over the unknowns."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import casadi as ca
import numpy as np
from scipy import sparse

from symmotion.errors import InputError
from symmotion.jets.jet import AnyJet
from symmotion.kernels import Kernel
from symmotion.program import WHOLE, Block

UNKNOWN = "controls"


@dataclass(frozen=True, eq=False)
class Reading:
    """What an expression of a jet reads at N times.

    z: (rows · channels, 1) symbols, row by row; operator: (N · rows, n) makes them of the controls; data, numbers:
    (D, 1) symbols and (N, D) their values at each time.
    """

    z: ca.SX
    operator: sparse.csr_array
    data: ca.SX
    numbers: np.ndarray


class JetSpace(Protocol):
    """The unknowns of one motion, as jets.

    variable: its unknowns in the program; n: how many controls; channels: coordinates of each.
    domain: the times that there are; breakpoints: where the spans meet.
    """

    @property
    def variable(self) -> str: ...

    @property
    def n(self) -> int: ...

    @property
    def channels(self) -> int: ...

    @property
    def domain(self) -> tuple[float, float]: ...

    @property
    def breakpoints(self) -> np.ndarray: ...

    def jet(self, slot: int = 0) -> AnyJet:
        """The jet at the slot-th of the times that an expression couples."""
        ...

    def symbols(self, slot: int = 0) -> AnyJet:
        """A jet of this kind whose entries are symbols."""
        ...

    def needed(self, slot: int, out: ca.SX) -> int:
        """How many coordinates of each control `out` reads of the jet at a slot; 0 where it does not read it."""
        ...

    def read(self, slot: int, out: ca.SX, times: np.ndarray, sides: np.ndarray | None, width: int) -> Reading:
        """What `out` reads of that jet at times (N,), `width` coordinates of each control.

        sides: (N,), −1 from the left and 1 from the right at a knot, None for all from the right.
        """
        ...


@runtime_checkable
class Shifted(Protocol):
    """A space whose unknowns may be short of the coordinates, the last of which are places, by a shift."""

    @property
    def shift(self) -> np.ndarray | None: ...

    @property
    def unshifted(self) -> JetSpace:
        """The space of what the unknowns are themselves."""
        ...


@dataclass(frozen=True)
class Places:
    """Where variables lie in a vector of all unknowns: its size, and by variable the first place and the stride."""

    size: int
    of: Mapping[str, tuple[int, int]]


def block_of(
    name: str,
    out: ca.SX,
    spaces: Sequence[JetSpace],
    times: np.ndarray,
    *,
    sides: np.ndarray | None = None,
    data: ca.SX | None = None,
    numbers: np.ndarray | None = None,
    squares: bool = False,
    nodes: int = 1,
    weights: np.ndarray | None = None,
    width: int = 0,
    places: Places | None = None,
) -> Block:
    """An expression of one jet or several as a block: `out` at each row of times (N, s).

    spaces: (s,) where each of the s jets comes from; data, numbers: further symbols and their values (N, D).
    width: coordinates per control that are read at least; places: needed where the spaces are of different variables.
    """
    count = len(times)
    try:
        needed = [space.needed(slot, out) for slot, space in enumerate(spaces)]
    except InputError as error:
        raise InputError(f"{name}: {error}") from error
    if not any(needed):
        raise InputError(f"{name} does not depend on the motion")
    alone = len({space.variable for space in spaces}) == 1
    widths = [max(*needed, width)] * len(spaces) if alone else needed
    readings = [
        space.read(slot, out, times[:, slot], None if sides is None else sides[:, slot], widths[slot])
        for slot, space in enumerate(spaces)
    ]
    z = ca.vertcat(*(r.z for r in readings))
    symbols = ca.vertcat(*(r.data for r in readings), *([] if data is None else [data]))
    table = np.concatenate([r.numbers for r in readings] + ([] if numbers is None else [numbers]), axis=1)
    weights = np.ones(count) if weights is None else weights
    if alone:
        variable, channels = spaces[0].variable, widths[0]
        operator = interleaved([r.operator for r in readings], count)
    elif places is None:
        raise InputError(f"{name} couples motions of different programs: join them first")
    else:
        # Unknowns of different kinds have the vector of all unknowns in common, and nothing else.
        variable, channels = WHOLE, 1
        flat = [
            _flat(r, w, *places.of[s.variable], places.size) for r, w, s in zip(readings, widths, spaces, strict=True)
        ]
        operator = interleaved(flat, count)
    return Block(
        name, Kernel(z, symbols, out, channels, squares), variable, slice(0, channels), operator, nodes, weights, table
    )


def _flat(reading: Reading, width: int, first: int, stride: int, size: int) -> sparse.csr_array:
    """A reading's operator on the vector of all unknowns, a row for every coordinate."""
    rows = sparse.coo_array(sparse.kron(reading.operator, sparse.eye_array(width)))
    control, coordinate = np.divmod(rows.coords[1], width) if width else (rows.coords[1], rows.coords[1])
    columns = first + control * stride + coordinate
    return sparse.csr_array((rows.data, (rows.coords[0], columns)), shape=(rows.shape[0], size))


def interleaved(operators: Sequence[sparse.csr_array], count: int) -> sparse.csr_array:
    """The rows of several operators (count · rows each), node by node instead of operator by operator."""
    if len(operators) == 1:
        return operators[0]
    first, places = 0, []
    for operator in operators:
        rows = operator.shape[0] // count
        places.append(first + np.arange(count * rows).reshape(count, rows))
        first += count * rows
    return sparse.csr_array(sparse.vstack(operators, format="csr")[np.concatenate(places, axis=1).ravel()])
