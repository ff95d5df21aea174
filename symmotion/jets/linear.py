"""Jets of splines whose controls are the unknowns: linear in them, of affine motions and of curves."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache, partial

import casadi as ca
import numpy as np
from scipy import sparse

from symmotion.brief import in_a_line
from symmotion.errors import InputError
from symmotion.jets.affine import HIGHEST_ORDER, Jet
from symmotion.jets.curve import CurveJet
from symmotion.jets.jet import AnyJet
from symmotion.jets.space import UNKNOWN, Reading, interleaved
from symmotion.kernels import Kernel
from symmotion.motions import AffineMotion
from symmotion.program import Block
from symmotion.splines import BSplineBasis, Spline, gauss


def sided(basis: BSplineBasis, t: np.ndarray, order: int, side: int) -> sparse.csr_array:
    """(N, n) derivatives of the B-splines at t, from the left (−1) or the right (1) at a knot."""
    if side > 0:
        return basis.matrix(t, order)
    # From the left is from the right in the mirror, where functions and knots come in the opposite order.
    mirror = BSplineBasis(-basis.knots[::-1], basis.degree, origin=-basis.origin)
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
    return interleaved(operators, times.size)


@dataclass(frozen=True, eq=False)
class LinearSpace:
    """A spline whose coordinates are the unknowns: the jet's entries are linear in the controls.

    kind: of its jets; width: coordinates per control that there are; channels: how many are unknowns, the first ones;
    make: a jet from the symbols of orders 0 … 3 of all coordinates, and of the time. shift: (width,) what the unknowns
    are short of the coordinates, None for nothing: of what is far from zero the distance is no unknown.
    """

    kind: str
    basis: BSplineBasis
    width: int
    make: Callable[[Sequence[ca.SX], ca.SX], AnyJet]
    channels: int = 0
    variable: str = UNKNOWN
    # The coordinates that an expression is taken to read: all up to the highest it names, rounded up to one of these.
    groups: tuple[int, ...] = field(default=())
    shift: np.ndarray | None = None

    __repr__ = in_a_line

    @property
    def unshifted(self) -> "LinearSpace":
        return replace(self, shift=None)

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
        if self.shift is None:
            return self.make(orders, t)
        shift = shift_symbols(self.width, slot) * ca.DM((self.shift != 0).astype(float))
        return self.make([orders[0] + shift, *orders[1:]], t)

    def symbols(self, slot: int = 0) -> AnyJet:
        orders, t, _ = entry_symbols(self.width, slot)
        return self.make(orders, t)

    def told(self, slot: int, out: ca.SX) -> ca.SX:
        """What an expression of the jet is told beside the unknowns: the time, and the shift where it reads that."""
        t, shift = entry_symbols(self.width, slot)[1], shift_symbols(self.width, slot)
        return ca.vertcat(t, shift) if self.shift is not None and ca.depends_on(out, shift) else t

    def numbers(self, told: ca.SX, times: np.ndarray) -> np.ndarray:
        """(N, D) the numbers of what is `told` at times (N,)."""
        if told.numel() == 1 or self.shift is None:
            return times[:, None]
        return np.column_stack([times, np.broadcast_to(self.shift, (len(times), self.width))])

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
        read = self.orders(out, slot)[1]
        if read > self.channels:
            raise InputError("depends on the translation, which the objective does not see: add a TrajectoryEnergy")
        return read

    def read(self, slot: int, out: ca.SX, times: np.ndarray, sides: np.ndarray | None, width: int) -> Reading:
        symbols, _, _ = entry_symbols(self.width, slot)
        found, _ = self.orders(out, slot)
        if not found:
            return Reading(ca.SX(0, 1), sparse.csr_array((0, self.n)), ca.SX(0, 1), np.empty((len(times), 0)))
        z = ca.vertcat(*(symbols[order][:width] for order in found))
        told = self.told(slot, out)
        return Reading(z, _rows(self.basis, times, found, sides), told, self.numbers(told, times))


@lru_cache(maxsize=64)
def entry_symbols(width: int, slot: int) -> tuple[list[ca.SX], ca.SX, dict[str, tuple[int, int]]]:
    """The symbols of orders 0 … 3 of `width` coordinates, of the time, and for each name its order and coordinate."""
    orders, names = [], {}
    for order in range(HIGHEST_ORDER + 1):
        entries = [ca.SX.sym(f"jet_{slot}_{order}_{channel}") for channel in range(width)]
        names |= {s.name(): (order, channel) for channel, s in enumerate(entries)}
        orders.append(ca.vertcat(*entries))
    return orders, ca.SX.sym(f"t_{slot}"), names


@lru_cache(maxsize=64)
def shift_symbols(width: int, slot: int) -> ca.SX:
    """The symbols (width, 1) of a space's shift."""
    return ca.SX.sym(f"shift_{slot}", width)


def affine_space(basis: BSplineBasis, d: int, channels: int, shift: np.ndarray | None = None) -> LinearSpace:
    """The space of an affine spline motion in dimension d: controls are rows of A, then v.

    shift: (d² + d,) see `LinearSpace`; zeros count as none.
    """
    make, shift = partial(_affine, d), shift if shift is not None and shift.any() else None
    return LinearSpace(f"affine {d}D", basis, d * d + d, make, channels, groups=(d * d, d * d + d), shift=shift)


def _affine(d: int, orders: Sequence[ca.SX], t: ca.SX) -> Jet:
    linear = tuple(ca.reshape(o[: d * d], d, d).T for o in orders)
    return Jet(linear, tuple(o[d * d :] for o in orders), t)


def curve_space(basis: BSplineBasis, shape: tuple[int, ...], shift: np.ndarray | None = None) -> LinearSpace:
    """The space of a spline curve with values of a shape, row by row; shift: (width,), as of `affine_space`."""
    width, shift = int(np.prod(shape)), shift if shift is not None and shift.any() else None
    return LinearSpace(f"curve {shape}", basis, width, partial(_curve, shape), width, shift=shift)


def _curve(shape: tuple[int, ...], orders: Sequence[ca.SX], t: ca.SX) -> CurveJet:
    if len(shape) < 2:
        return CurveJet(tuple(orders), t)
    return CurveJet(tuple(ca.reshape(o, shape[1], shape[0]).T for o in orders), t)


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
        symbols, _, _ = entry_symbols(space.width, 0)
        z = ca.vertcat(*(symbols[order][:channels] for order in orders))
        return JetKernel(Kernel(z, space.told(0, out), out, channels, squares), orders)

    @property
    def channels(self) -> int:
        return self.kernel.channels

    def rows(self, space: LinearSpace, since: np.ndarray) -> sparse.csr_array:
        """(N · rows, n) what the kernel reads of the controls at times (N,) from the origin of the basis on."""
        return _rows(space.basis.relative, since, self.orders, None)

    def integral(self, name: str, space: LinearSpace, nodes: int, weight: float) -> Block:
        """The integral over the spans, by `nodes` Gauss nodes each."""
        points, weights = gauss(space.basis.relative, nodes)
        since = points.ravel()
        operator = self.rows(space, since)
        channels = slice(0, self.channels)
        data = space.numbers(self.kernel.data, space.basis.origin + since)
        return Block(name, self.kernel, space.variable, channels, operator, nodes, weight * weights.ravel(), data)


def space_of(motion: AffineMotion | Spline) -> tuple[LinearSpace, np.ndarray]:
    """The space of a spline, and its controls (n, width) there."""
    if isinstance(motion, AffineMotion):
        d = motion.dimension
        return affine_space(motion.basis, d, d * d + d), motion.spline.control_points
    shape = motion.control_points.shape[1:]
    return curve_space(motion.basis, shape), motion.control_points.reshape(motion.basis.n, -1)
