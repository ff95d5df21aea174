"""Where the jets of a program's motion come from: expressions of them as kernels over the unknowns."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Protocol

import casadi as ca
import numpy as np
from scipy import sparse

from symmotion.errors import InputError
from symmotion.jets.affine import HIGHEST_ORDER, Jet
from symmotion.jets.curve import NET_ORDERS, CurveJet, NetJet, net_jet
from symmotion.jets.jet import AnyJet
from symmotion.kernels import Kernel
from symmotion.program import WHOLE, Block
from symmotion.splines import BSplineBasis, gauss

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
    needed = [space.needed(slot, out) for slot, space in enumerate(spaces)]
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
        operator = _interleaved([r.operator for r in readings], count)
    elif places is None:
        raise InputError(f"{name} couples motions of different programs: join them first")
    else:
        # Unknowns of different kinds have the vector of all unknowns in common, and nothing else.
        variable, channels = WHOLE, 1
        flat = [
            _flat(r, w, *places.of[s.variable], places.size) for r, w, s in zip(readings, widths, spaces, strict=True)
        ]
        operator = _interleaved(flat, count)
    return Block(
        name, Kernel(z, symbols, out, channels, squares), variable, slice(0, channels), operator, nodes, weights, table
    )


def _flat(reading: Reading, width: int, first: int, stride: int, size: int) -> sparse.csr_array:
    """A reading's operator on the vector of all unknowns, a row for every coordinate."""
    rows = sparse.coo_array(sparse.kron(reading.operator, sparse.eye_array(width)))
    control, coordinate = np.divmod(rows.coords[1], width) if width else (rows.coords[1], rows.coords[1])
    columns = first + control * stride + coordinate
    return sparse.csr_array((rows.data, (rows.coords[0], columns)), shape=(rows.shape[0], size))


def _interleaved(operators: Sequence[sparse.csr_array], count: int) -> sparse.csr_array:
    """The rows of several operators (count · rows each), node by node instead of operator by operator."""
    if len(operators) == 1:
        return operators[0]
    first, places = 0, []
    for operator in operators:
        rows = operator.shape[0] // count
        places.append(first + np.arange(count * rows).reshape(count, rows))
        first += count * rows
    return sparse.csr_array(sparse.vstack(operators, format="csr")[np.concatenate(places, axis=1).ravel()])


def sided(basis: BSplineBasis, t: np.ndarray, order: int, side: int) -> sparse.csr_array:
    """(N, n) derivatives of the B-splines at t, from the left (−1) or the right (1) at a knot."""
    if side > 0:
        return basis.matrix(t, order)
    # From the left is from the right in the mirror, where functions and knots come in the opposite order.
    mirror = BSplineBasis(-basis.knots[::-1], basis.degree)
    return sparse.csr_array((-1) ** order * mirror.matrix(-t, order)[:, ::-1])


def _rows(basis: BSplineBasis, times: np.ndarray, orders: Sequence[int], sides: np.ndarray | None) -> sparse.csr_array:
    """(N · rows, n) the derivatives of these orders at times (N,), time by time."""
    if sides is None or (sides > 0).all():
        local = [basis.local(times, order) for order in orders]
        columns = np.stack([indices for indices, _ in local], axis=1)
        values = np.stack([v for _, v in local], axis=1)
        pointers = np.arange(times.size * len(orders) + 1) * columns.shape[2]
        shape = (times.size * len(orders), basis.n)
        return sparse.csr_array((values.ravel(), columns.ravel(), pointers), shape=shape)
    left = np.flatnonzero(sides < 0)
    operators = []
    for order in orders:
        whole = basis.matrix(times, order).tolil()
        whole[left] = sided(basis, times[left], order, -1).tolil()
        operators.append(sparse.csr_array(whole))
    return _interleaved(operators, times.size)


@dataclass(frozen=True, eq=False)
class LinearSpace:
    """A spline whose coordinates are the unknowns: the jet's entries are linear in the controls.

    width: coordinates per control that there are; channels: how many of them are unknowns, the first ones;
    make: a jet from the symbols of orders 0 … 3 of all coordinates, and of the time.
    """

    basis: BSplineBasis
    width: int
    make: Callable[[Sequence[ca.SX], ca.SX], AnyJet]
    channels: int = 0
    variable: str = UNKNOWN
    # The coordinates that an expression is taken to read: all up to the highest it names, rounded up to one of these.
    groups: tuple[int, ...] = field(default=())

    @property
    def n(self) -> int:
        return self.basis.n

    @property
    def domain(self) -> tuple[float, float]:
        return self.basis.domain

    @property
    def breakpoints(self) -> np.ndarray:
        return self.basis.breakpoints

    def jet(self, slot: int = 0) -> AnyJet:
        orders, t, _ = entry_symbols(self.width, slot)
        return self.make(orders, t)

    def symbols(self, slot: int = 0) -> AnyJet:
        return self.jet(slot)

    def orders(self, out: ca.SX, slot: int = 0) -> tuple[tuple[int, ...], int]:
        """The derivative orders of the jet that an expression reads, and how many coordinates of each."""
        _, _, names = entry_symbols(self.width, slot)
        used = [names[s.name()] for s in ca.symvar(out) if s.name() in names]
        if not used:
            return (), 0
        highest = max(channel for _, channel in used) + 1
        groups = self.groups or (self.width,)
        return tuple(sorted({order for order, _ in used})), next(g for g in groups if g >= highest)

    def needed(self, slot: int, out: ca.SX) -> int:
        return self.orders(out, slot)[1]

    def read(self, slot: int, out: ca.SX, times: np.ndarray, sides: np.ndarray | None, width: int) -> Reading:
        symbols, t, _ = entry_symbols(self.width, slot)
        found, _ = self.orders(out, slot)
        if not found:
            return Reading(ca.SX(0, 1), sparse.csr_array((0, self.n)), ca.SX(0, 1), np.empty((len(times), 0)))
        z = ca.vertcat(*(symbols[order][:width] for order in found))
        return Reading(z, _rows(self.basis, times, found, sides), t, times[:, None])


@lru_cache(maxsize=64)
def entry_symbols(width: int, slot: int) -> tuple[list[ca.SX], ca.SX, dict[str, tuple[int, int]]]:
    """The symbols of orders 0 … 3 of `width` coordinates, of the time, and for each name its order and coordinate."""
    orders, names = [], {}
    for order in range(HIGHEST_ORDER + 1):
        entries = [ca.SX.sym(f"jet_{slot}_{order}_{channel}") for channel in range(width)]
        names |= {s.name(): (order, channel) for channel, s in enumerate(entries)}
        orders.append(ca.vertcat(*entries))
    return orders, ca.SX.sym(f"t_{slot}"), names


def affine_space(basis: BSplineBasis, d: int, channels: int) -> LinearSpace:
    """The space of an affine spline motion in dimension d: controls are rows of A, then v."""

    def make(orders: Sequence[ca.SX], t: ca.SX) -> Jet:
        linear = tuple(ca.reshape(o[: d * d], d, d).T for o in orders)
        return Jet(linear, tuple(o[d * d :] for o in orders), t)

    return LinearSpace(basis, d * d + d, make, channels, groups=(d * d, d * d + d))


def curve_space(basis: BSplineBasis, shape: tuple[int, ...]) -> LinearSpace:
    """The space of a spline curve with values of a shape, row by row."""
    width = int(np.prod(shape))

    def make(orders: Sequence[ca.SX], t: ca.SX) -> CurveJet:
        if len(shape) < 2:
            return CurveJet(tuple(orders), t)
        return CurveJet(tuple(ca.reshape(o, shape[1], shape[0]).T for o in orders), t)

    return LinearSpace(basis, width, make, width)


@dataclass(frozen=True, eq=False)
class NetSpace:
    """A tensor-product net of coordinates over bases u and v (or u alone), as jets at parameter pairs. A `JetSpace`.

    Its controls are those of the net row by row; `times` are the pairs (u, v).
    """

    bases: tuple[BSplineBasis, ...]
    channels: int
    variable: str = UNKNOWN

    @property
    def n(self) -> int:
        return int(np.prod([basis.n for basis in self.bases]))

    @property
    def domain(self) -> tuple[float, float]:
        return self.bases[0].domain

    @property
    def breakpoints(self) -> np.ndarray:
        return self.bases[0].breakpoints

    def jet(self, slot: int = 0) -> NetJet:
        return net_jet(_net_symbols(self.channels), self.channels)

    def symbols(self, slot: int = 0) -> NetJet:
        return self.jet(slot)

    def _orders(self, out: ca.SX) -> list[int]:
        symbols, c = _net_symbols(self.channels), self.channels
        return [k for k in range(len(NET_ORDERS)) if ca.depends_on(out, symbols[k * c : (k + 1) * c])]

    def needed(self, slot: int, out: ca.SX) -> int:
        return self.channels if slot == 0 and self._orders(out) else 0

    def read(self, slot: int, out: ca.SX, times: np.ndarray, sides: np.ndarray | None, width: int) -> Reading:
        symbols, c, found = _net_symbols(self.channels), self.channels, self._orders(out)
        pairs = times.reshape(len(times), -1)
        if pairs.shape[1] != len(self.bases):
            raise InputError(
                f"parameters of shape {pairs.shape} for a net of {len(self.bases)}: (N, {len(self.bases)})"
            )
        for k, basis in enumerate(self.bases):
            a, b = basis.domain
            outside = ~((pairs[:, k] >= a) & (pairs[:, k] <= b))
            if outside.any():
                raise InputError(f"parameter {'uv'[k]} = {pairs[outside, k][0]:g} is outside [{a:g}, {b:g}]")
        operators = []
        for k in found:
            factors = [basis.matrix(pairs[:, i], NET_ORDERS[k][i]) for i, basis in enumerate(self.bases)]
            operators.append(_row_products(factors))
        z = ca.vertcat(*(symbols[k * c : (k + 1) * c] for k in found))
        return Reading(z, _interleaved(operators, len(pairs)), ca.SX(0, 1), np.empty((len(pairs), 0)))


@lru_cache(maxsize=8)
def _net_symbols(channels: int) -> ca.SX:
    return ca.SX.sym("net", len(NET_ORDERS) * channels + 1)


def _row_products(factors: Sequence[sparse.csr_array]) -> sparse.csr_array:
    """(N, n m) the products of the rows of (N, n) and (N, m), entry by entry."""
    if len(factors) == 1:
        return factors[0]
    rows = [sparse.kron(factors[0][[i]], factors[1][[i]]) for i in range(factors[0].shape[0])]
    return sparse.csr_array(sparse.vstack(rows))


@dataclass(frozen=True, eq=False)
class JetKernel:
    """An expression of one jet of a linear space as a kernel of the entries that it reads.

    orders: the derivative orders that are the kernel's rows.
    """

    kernel: Kernel
    orders: tuple[int, ...]

    @staticmethod
    def of(space: LinearSpace, out: ca.SX, what: str, squares: bool = False) -> "JetKernel":
        """The kernel of an expression of `space.jet()`; `what` names it."""
        orders, channels = space.orders(out)
        if not orders:
            raise InputError(f"{what} does not depend on the motion")
        symbols, t, _ = entry_symbols(space.width, 0)
        z = ca.vertcat(*(symbols[order][:channels] for order in orders))
        return JetKernel(Kernel(z, t, out, channels, squares), orders)

    @property
    def channels(self) -> int:
        return self.kernel.channels

    def reads(self, order: int, coordinates: slice) -> bool:
        """Whether it depends on the derivative of this order in one of these coordinates."""
        if order not in self.orders:
            return False
        row = self.orders.index(order) * self.channels
        local = self.kernel.z[row : row + self.channels][coordinates]
        return bool(local.numel()) and bool(ca.depends_on(self.kernel.out, local))

    def integral(self, name: str, space: LinearSpace, nodes: int, weight: float) -> Block:
        """The integral over the spans, by `nodes` Gauss nodes each."""
        points, weights = gauss(space.basis, nodes)
        times = points.ravel()
        operator = _rows(space.basis, times, self.orders, None)
        channels = slice(0, self.channels)
        return Block(
            name, self.kernel, space.variable, channels, operator, nodes, weight * weights.ravel(), times[:, None]
        )
