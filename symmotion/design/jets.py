"""Energies and conditions on a motion's jet as kernels, and as blocks over a spline space."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache

import casadi as ca
import numpy as np
from scipy import sparse

from symmotion.energies import Energy
from symmotion.errors import InputError
from symmotion.jets import HIGHEST_ORDER, Jet
from symmotion.kernels import Kernel
from symmotion.motions import AffineMotion
from symmotion.program import Block, BlockEvaluator
from symmotion.splines import BSplineBasis, gauss

UNKNOWN = "controls"
# Relative change of an integral between a node count and twice as many that counts as none.
QUADRATURE = 1e-10
MOST_NODES = 40


@dataclass(frozen=True, eq=False)
class JetKernel:
    """An expression of a motion's jet as a kernel of the entries that it uses.

    orders: the derivative orders that are the kernel's rows.
    """

    kernel: Kernel
    orders: tuple[int, ...]

    @staticmethod
    @lru_cache(maxsize=64)
    def of(energy: Energy, d: int) -> "JetKernel":
        """The kernel of an energy's integrand in dimension d."""
        jet, _ = jet_symbols(d)
        residuals = energy.residuals(jet)
        out = ca.SX(energy.integrand(jet)) if residuals is None else residuals
        return JetKernel.from_expression(out, d, f"the integrand of {energy.name}", squares=residuals is not None)

    @staticmethod
    def from_expression(
        out: ca.SX, d: int, what: str, data: ca.SX | None = None, squares: bool = False, channels: int | None = None
    ) -> "JetKernel":
        """The kernel of an expression of `jet_symbols(d)`; data: further symbols beside the time; `what` names it."""
        jet, names = jet_symbols(d)
        used = [names[s.name()] for s in ca.symvar(out) if s.name() in names]
        if not used:
            raise InputError(f"{what} does not depend on the motion")
        orders = tuple(sorted({order for order, _ in used}))
        if channels is None:
            channels = d * d + d if max(channel for _, channel in used) >= d * d else d * d
        z = [ca.vertcat(ca.vec(jet.linear[o].T), jet.translation[o])[:channels] for o in orders]
        numbers = jet.t if data is None else ca.vertcat(jet.t, data)
        return JetKernel(Kernel(ca.vertcat(*z), numbers, out, channels, squares), orders)

    def at(
        self,
        name: str,
        basis: BSplineBasis,
        times: np.ndarray,
        data: np.ndarray | None = None,
        nodes: int = 1,
        weights: np.ndarray | None = None,
    ) -> Block:
        """The kernel at given times (N,), `nodes` to an element; data: (N, …) beside the times."""
        local = [basis.local(times, order) for order in self.orders]
        rows = len(self.orders)
        columns = np.stack([indices for indices, _ in local], axis=1)
        values = np.stack([v for _, v in local], axis=1)
        pointers = np.arange(times.size * rows + 1) * columns.shape[2]
        operator = sparse.csr_array((values.ravel(), columns.ravel(), pointers), shape=(times.size * rows, basis.n))
        numbers = times[:, None] if data is None else np.column_stack([times, data])
        channels = slice(0, self.kernel.channels)
        weights = np.ones(times.size) if weights is None else weights
        return Block(name, self.kernel, UNKNOWN, channels, operator, nodes, weights, numbers)

    def reads(self, order: int, channels: slice) -> bool:
        """Whether it depends on the derivative of this order in one of these coordinates of [A, v]."""
        if order not in self.orders:
            return False
        row = self.orders.index(order) * self.kernel.channels
        local = self.kernel.z[row : row + self.kernel.channels][channels]
        return bool(local.numel()) and bool(ca.depends_on(self.kernel.out, local))

    def integral(self, name: str, basis: BSplineBasis, nodes: int, weight: float) -> Block:
        """The integral over the spans of a basis, by `nodes` Gauss nodes each."""
        points, weights = gauss(basis, nodes)
        return self.at(name, basis, points.ravel(), nodes=nodes, weights=weight * weights.ravel())


def nodes_for(energy: Energy, motion: AffineMotion) -> int:
    """Gauss nodes per span for an energy: the exact number, or enough at this motion to 1e-10."""
    nodes = energy.nodes(motion.degree)
    while not energy.exact and nodes < MOST_NODES:
        value, finer = integrate(motion, energy, nodes), integrate(motion, energy, 2 * nodes)
        if not abs(finer - value) > QUADRATURE * abs(finer):  # not a number counts as enough: nothing to refine
            break
        nodes = min(MOST_NODES, nodes + motion.degree + 1)
    return nodes


def integrate(motion: AffineMotion, energy: Energy, nodes: int) -> float:
    """One energy of a motion by `nodes` Gauss nodes per span."""
    block = JetKernel.of(energy, motion.dimension).integral(energy.name, motion.basis, nodes, 1.0)
    return BlockEvaluator(block).value(block.rows(motion.spline.control_points))


def measure(motion: AffineMotion, energy: Energy) -> float:
    """The value of an energy for a motion, to about ten digits where it is no polynomial."""
    return sum(weight * integrate(motion, part, nodes_for(part, motion)) for weight, part in energy.parts)


@lru_cache(maxsize=4)
def jet_symbols(d: int) -> tuple[Jet, Mapping[str, tuple[int, int]]]:
    """The symbols of a jet, and for the name of each its derivative order and channel."""
    linear, translation, names = [], [], {}
    for order in range(HIGHEST_ORDER + 1):
        entries = [ca.SX.sym(f"jet_{order}_{channel}") for channel in range(d * d + d)]
        names |= {s.name(): (order, channel) for channel, s in enumerate(entries)}
        linear.append(ca.reshape(ca.vertcat(*entries[: d * d]), d, d).T)
        translation.append(ca.vertcat(*entries[d * d :]))
    return Jet(tuple(linear), tuple(translation), ca.SX.sym("t")), names
