"""The unknowns of a quaternion curve as the symbols of kernels: what a node reads, and what it can say.

Beside the control quaternions the increments between them are unknowns (lifted, Albersmeyer and Diehl 2010). What a
node reads is smooth in them wherever they are, also where neighbouring controls are a whole turn apart, where a
logarithm of the two is not; and it is shorter.
"""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from itertools import pairwise

import casadi as ca
import numpy as np
from scipy import sparse

from symmotion.brief import in_a_line
from symmotion.jets import HIGHEST_ORDER, RigidJet, rotation
from symmotion.jets.rigid import rigid_jet
from symmotion.jets.space import UNKNOWN, Reading
from symmotion.kernels import Kernel
from symmotion.program import Block, Constraint
from symmotion.splines import BSplineBasis, gauss
from symmotion.splines.cumulative import cumulative

# The coordinates of a control: the increment that leads to it, the quaternion, and the point of a pose.
WAY, TURN, POINT = slice(0, 3), slice(3, 7), slice(7, 10)


@dataclass(frozen=True, eq=False)
class NodeSymbols:
    """What a span's jet is made of: its degree + 1 controls, and what tells the parameter.

    controls: (10, p + 1), a column each; weights: B̃, B̃′, B̃″, B̃‴, each (p,); t: the time; shift: (3,) what the control
    points are short of the places, zero where they are not.
    """

    controls: ca.SX
    weights: tuple[ca.SX, ...]
    t: ca.SX
    shift: ca.SX

    @staticmethod
    def of(p: int, slot: int = 0, shifted: bool = False) -> "NodeSymbols":
        return NodeSymbols(
            ca.SX.sym(f"z_{slot}", POINT.stop, p + 1),
            tuple(ca.SX.sym(f"weights_{slot}_{order}", p) for order in range(HIGHEST_ORDER + 1)),
            ca.SX.sym(f"t_{slot}"),
            ca.SX.sym(f"shift_{slot}", 3) if shifted else ca.SX(3, 1),
        )

    def width(self, out: ca.SX) -> int:
        """How many coordinates of each control an expression reads."""
        parts = (part for part in (POINT, TURN, WAY) if ca.depends_on(out, ca.vec(self.controls[part, :])))
        return next((part.stop for part in parts), 0)

    def jet(self, pose: bool) -> RigidJet:
        """The jet at the parameter: KKS (7) and its derivatives, the origin v_0 + Σ (v_l − v_{l−1}) B̃_l."""
        ways = ca.horzsplit(self.controls[WAY, 1:])

        def path() -> tuple[ca.SX, ...]:
            points = ca.horzsplit(self.controls[POINT, :])
            derivatives = []
            for weights in self.weights:
                steps = enumerate(pairwise(points))
                derivatives.append(sum(((b - a) * weights[k] for k, (a, b) in steps), ca.SX(3, 1)))
            return (derivatives[0] + points[0] + self.shift, *derivatives[1:])

        return RigidJet(
            lambda: rotation.orientation(self.controls[TURN, 0], ways, self.weights[0]),
            lambda: rotation.rates(ways, *self.weights[:3]),
            path if pose else None,
            self.t,
        )


@dataclass(frozen=True, eq=False)
class ControlSpace:
    """The space of a quaternion curve. A `JetSpace`.

    basis: of the curve; pose: whether it has a translation too; closing: 1, or −1 where a closed curve comes back to
    −q_0. shift: (3,) what the unknown control points are short of the places.
    """

    basis: BSplineBasis
    pose: bool = False
    closing: float = 1.0
    variable: str = UNKNOWN
    shift: np.ndarray = field(default_factory=lambda: np.zeros(3))
    _slots: dict[int, tuple[NodeSymbols, RigidJet]] = field(default_factory=dict, repr=False)

    __repr__ = in_a_line

    @property
    def unshifted(self) -> "ControlSpace":
        return replace(self, shift=np.zeros(3), _slots={})

    def __getstate__(self) -> dict[str, object]:
        return {**self.__dict__, "_slots": {}}  # symbols do not pickle, and are made again

    @property
    def channels(self) -> int:
        """How many coordinates a control has."""
        return POINT.stop if self.pose else TURN.stop

    @property
    def n(self) -> int:
        return self.basis.n

    @property
    def domain(self) -> tuple[float, float]:
        return self.basis.domain

    @property
    def breakpoints(self) -> np.ndarray:
        return self.basis.breakpoints

    def jet(self, slot: int = 0) -> RigidJet:
        return self._slot(slot)[1]

    def _slot(self, slot: int) -> tuple[NodeSymbols, RigidJet]:
        if slot not in self._slots:
            symbols = NodeSymbols.of(self.basis.degree, slot, bool(self.shift.any()))
            self._slots[slot] = symbols, symbols.jet(self.pose)
        return self._slots[slot]

    def symbols(self, slot: int = 0) -> RigidJet:
        return rigid_jet(ca.SX.sym("jet", 23 if self.pose else 11), self.pose)

    def needed(self, slot: int, out: ca.SX) -> int:
        return self._slot(slot)[0].width(out)

    def read(self, slot: int, out: ca.SX, times: np.ndarray, sides: np.ndarray | None, width: int) -> Reading:
        node = self._slot(slot)[0]
        highest = HIGHEST_ORDER if ca.depends_on(out, node.weights[HIGHEST_ORDER]) else HIGHEST_ORDER - 1
        columns, tables = self._tables(self.basis, times[:, None], highest)
        data, numbers = list(node.weights[: highest + 1]), [tables[:, 0]]
        if ca.depends_on(out, node.t):
            data, numbers = [*data, node.t], [*numbers, times[:, None]]
        if self.shift.any() and ca.depends_on(out, node.shift):
            data, numbers = [*data, node.shift], [*numbers, np.broadcast_to(self.shift, (len(times), 3))]
        z = ca.vec(node.controls[:width, :])
        return Reading(z, self._picked(columns), ca.vertcat(*data), np.concatenate(numbers, axis=1))

    def _tables(self, basis: BSplineBasis, times: np.ndarray, highest: int) -> tuple[np.ndarray, np.ndarray]:
        """The controls (E, p + 1) of the spans of parameters (E, Q), and the weights (E, Q, (highest + 1) p) there.

        basis: this one, or its relative one for times from the origin on.
        """
        e, q = times.shape
        p = self.basis.degree
        spans, weights = cumulative(basis, times.ravel(), highest)
        columns = (spans.reshape(e, q)[:, :1] - p + np.arange(p + 1)) % self.basis.n
        tables = np.stack([np.stack(w, axis=1) for w in weights], axis=1).reshape(e, q, (highest + 1) * p)
        return columns, tables

    def _picked(self, columns: np.ndarray) -> sparse.csr_array:
        """(E (p + 1), n) picks the controls (E, p + 1)."""
        pointers = np.arange(columns.size + 1)
        shape = (columns.size, self.basis.n)
        return sparse.csr_array((np.ones(columns.size), columns.ravel(), pointers), shape=shape)

    def integral(
        self, name: str, expression: Callable[[RigidJet], ca.SX], squares: bool, nodes: int, weight: float, whole: bool
    ) -> Block:
        """weight ∫ φ dt by Gauss nodes on the spans; φ the expression, or with `squares` its sum of squares.

        whole: whether a span is one element, whose controls are read once for its nodes. With all nodes of a span
        in one, a large kernel takes long to derive.
        """
        basis = self.basis.relative
        points, weights = gauss(basis, nodes)
        shares = np.sqrt(weight * weights) if squares else weight * weights
        if not whole:
            points, shares = points.reshape(-1, 1), shares.reshape(-1, 1)
        e, q = points.shape
        columns, tables = self._tables(basis, points, 2)
        shared = NodeSymbols.of(self.basis.degree)
        out, data = [], []
        # Asked of a jet of symbols: a node's own is a long expression to search.
        plain = self.symbols()
        timed = bool(ca.depends_on(expression(plain), plain.t))
        placed = self.shift.any() and bool(ca.depends_on(expression(plain), plain.v))
        if placed:
            shared = replace(shared, shift=ca.SX.sym("shift", 3))
            data.append(shared.shift)
        for k in range(q):
            here = NodeSymbols.of(self.basis.degree, k)
            share = ca.SX.sym("share")
            node = replace(here, controls=shared.controls, shift=shared.shift)
            out.append(share * expression(node.jet(self.pose)))
            data += [*here.weights[:3], share, *([here.t] if timed else [])]
        extra = np.stack([shares, self.basis.origin + points], axis=2) if timed else shares[..., None]
        shift = [np.broadcast_to(self.shift, (e, 3))] if placed else []
        table = np.concatenate([*shift, np.concatenate([tables, extra], axis=2).reshape(e, -1)], axis=1)
        width = shared.width(ca.vertcat(*out))
        kernel = Kernel(ca.vec(shared.controls[:width, :]), ca.vertcat(*data), ca.vertcat(*out), width, squares)
        return Block(name, kernel, self.variable, slice(0, width), self._picked(columns), 1, np.ones(e), table)

    def given(self) -> list[Constraint]:
        """|q_j|² = 1 for every control quaternion, and 2 Im(exp(−ω_j) q_{j−1}⁻¹ q_j) = 0 for every increment.

        That to the first control of an open curve is zero: it is the way from there.
        """
        n, no = self.basis.n, ca.SX.sym("data", 0)
        z, sign = ca.SX.sym("z", TURN.stop, 2), ca.SX.sym("sign")
        norm = Kernel(z[:, 0], no, ca.sumsqr(z[TURN, 0]) - 1, TURN.stop)
        ratio = sign * rotation.product(rotation.conjugate(z[TURN, 0]), z[TURN, 1])
        missed = 2 * rotation.product(rotation.exp(-z[WAY, 1]), ratio)[1:]
        way = Kernel(ca.vec(z), sign, missed, TURN.stop)
        every, signs = np.arange(n), np.ones((n, 1))
        before = every - 1
        before[0], signs[0] = (n - 1, self.closing) if self.basis.periodic else (0, 1.0)
        return [
            self._constraint("unit norms", norm, every[:, None], np.empty((n, 0))),
            self._constraint("increments", way, np.stack([before, every], axis=1), signs),
        ]

    def _constraint(self, name: str, kernel: Kernel, columns: np.ndarray, data: np.ndarray) -> Constraint:
        n, channels = self.basis.n, slice(0, kernel.channels)
        return Constraint.equality(
            Block(name, kernel, self.variable, channels, self._picked(columns), 1, np.ones(n), data)
        )
