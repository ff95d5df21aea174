"""Control quaternions as the symbols of kernels: what a node of a quaternion curve reads, and what it can say."""

from collections.abc import Callable, Sequence
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
from symmotion.motions.quaternions.algebra import conjugate, log, product
from symmotion.program import Block, Constraint
from symmotion.splines import BSplineBasis, gauss
from symmotion.splines.cumulative import cumulative


@dataclass(frozen=True, eq=False)
class NodeSymbols:
    """What a span's jet is made of: z, its degree + 1 controls one after the other, and what tells the parameter.

    signs, turns: (p,) of the logarithms, empty where all are principal; weights: B̃, B̃′, B̃″, B̃‴, each (p,); t: the time;
    shift: (3,) what the control points are short of the places, zero where they are not.
    """

    z: ca.SX
    signs: ca.SX
    turns: ca.SX
    weights: tuple[ca.SX, ...]
    t: ca.SX
    shift: ca.SX

    @staticmethod
    def of(channels: int, p: int, plain: bool, slot: int = 0, shifted: bool = False) -> "NodeSymbols":
        branch = 0 if plain else p
        return NodeSymbols(
            ca.SX.sym(f"z_{slot}", channels * (p + 1)),
            ca.SX.sym(f"signs_{slot}", branch),
            ca.SX.sym(f"turns_{slot}", branch),
            tuple(ca.SX.sym(f"weights_{slot}_{order}", p) for order in range(HIGHEST_ORDER + 1)),
            ca.SX.sym(f"t_{slot}"),
            ca.SX.sym(f"shift_{slot}", 3) if shifted else ca.SX(3, 1),
        )

    def ways(self, channels: int) -> list[ca.SX]:
        """The increments ω_l between the controls."""
        controls = [self.z[k : k + 4] for k in range(0, self.z.numel(), channels)]
        ratios = [rotation.product(rotation.conjugate(a), b) for a, b in pairwise(controls)]
        if not self.signs.numel():
            return [rotation.log(ratio) for ratio in ratios]
        return [rotation.log(self.signs[k] * ratio, self.turns[k]) for k, ratio in enumerate(ratios)]

    def jet(self, channels: int, ways: Sequence[ca.SX]) -> RigidJet:
        """The jet at the parameter: KKS (7) and its derivatives, the origin v_0 + Σ (v_l − v_{l−1}) B̃_l."""

        def path() -> tuple[ca.SX, ...]:
            points = [self.z[k + 4 : k + 7] for k in range(0, self.z.numel(), channels)]
            derivatives = []
            for weights in self.weights:
                steps = enumerate(pairwise(points))
                derivatives.append(sum(((b - a) * weights[k] for k, (a, b) in steps), ca.SX(3, 1)))
            return (derivatives[0] + points[0] + self.shift, *derivatives[1:])

        return RigidJet(
            lambda: rotation.orientation(self.z[:4], ways, self.weights[0]),
            lambda: rotation.rates(ways, *self.weights[:3]),
            path if channels > 4 else None,
            self.t,
        )


@dataclass(frozen=True, eq=False)
class ControlSpace:
    """The space of a quaternion curve: its basis, and what tells a logarithm its branch. A `JetSpace`.

    signs, turns: (n,) by the control that an increment leads to, q_{l−1}⁻¹ q_l · signs = exp(ω_l) with
    ω_l by 2π · turns longer than the principal logarithm. channels: 4, or 7 with a translation. shift: (3,) what the
    unknown control points are short of the places.
    """

    basis: BSplineBasis
    signs: np.ndarray
    turns: np.ndarray
    channels: int = 4
    variable: str = UNKNOWN
    shift: np.ndarray = field(default_factory=lambda: np.zeros(3))
    _slots: dict[int, tuple[NodeSymbols, RigidJet]] = field(default_factory=dict, repr=False)

    __repr__ = in_a_line

    @property
    def unshifted(self) -> "ControlSpace":
        return replace(self, shift=np.zeros(3), _slots={})

    def __getstate__(self) -> dict[str, object]:
        return {**self.__dict__, "_slots": {}}  # symbols do not pickle, and are made again

    @staticmethod
    def of(basis: BSplineBasis, controls: np.ndarray, ways: np.ndarray, channels: int = 4) -> "ControlSpace":
        """The space of controls (n, 4) whose increments are nearest to `ways` (n, 3), by the control led to."""
        ratio = product(conjugate(np.roll(controls, 1, axis=0)), controls)
        # Along a chain the signs are chosen to fit; only where it closes one is left to read.
        signs = np.ones(len(controls))
        angle = np.linalg.norm(ways[0])
        closing = np.cos(angle) * ratio[0, 0] + np.sinc(angle / np.pi) * ratio[0, 1:] @ ways[0]
        signs[0] = -1.0 if basis.periodic and closing < 0 else 1.0
        plain = log(ratio * signs[:, None])
        size = np.linalg.norm(plain, axis=1)
        along = np.sum(plain * ways, axis=1) / np.where(size > 0, size, 1.0)
        turns = np.where(size > 0, np.round((along - size) / (2 * np.pi)), 0.0)
        if not basis.periodic:
            turns[0] = 0.0
        return ControlSpace(basis, signs, turns, channels)

    @property
    def plain(self) -> bool:
        """Whether all increments are principal logarithms."""
        return bool((self.signs == 1).all() and (self.turns == 0).all())

    def increments(self, controls: np.ndarray) -> np.ndarray:
        """(n, 3) the increments of controls (n, 4), by the control they lead to; the first only where periodic."""
        plain = log(product(conjugate(np.roll(controls, 1, axis=0)), controls) * self.signs[:, None])
        size = np.linalg.norm(plain, axis=1)
        return plain * (1 + 2 * np.pi * self.turns / np.where(size > 0, size, 1.0))[:, None]

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
            symbols = NodeSymbols.of(self.channels, self.basis.degree, self.plain, slot, bool(self.shift.any()))
            self._slots[slot] = symbols, symbols.jet(self.channels, symbols.ways(self.channels))
        return self._slots[slot]

    def symbols(self, slot: int = 0) -> RigidJet:
        pose = self.channels > 4
        return rigid_jet(ca.SX.sym("jet", 23 if pose else 11), pose)

    def needed(self, slot: int, out: ca.SX) -> int:
        return self.channels if ca.depends_on(out, self._slot(slot)[0].z) else 0

    def read(self, slot: int, out: ca.SX, times: np.ndarray, sides: np.ndarray | None, width: int) -> Reading:
        node = self._slot(slot)[0]
        highest = HIGHEST_ORDER if ca.depends_on(out, node.weights[HIGHEST_ORDER]) else HIGHEST_ORDER - 1
        columns, tables = self._tables(self.basis, times[:, None], highest)
        data = [node.signs, node.turns, *node.weights[: highest + 1]]
        numbers = [*self._branches(columns), tables[:, 0]]
        if ca.depends_on(out, node.t):
            data, numbers = [*data, node.t], [*numbers, times[:, None]]
        if self.shift.any() and ca.depends_on(out, node.shift):
            data, numbers = [*data, node.shift], [*numbers, np.broadcast_to(self.shift, (len(times), 3))]
        return Reading(node.z, self._picked(columns), ca.vertcat(*data), np.concatenate(numbers, axis=1))

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

    def _branches(self, columns: np.ndarray) -> list[np.ndarray]:
        return [] if self.plain else [self.signs[columns[:, 1:]], self.turns[columns[:, 1:]]]

    def _picked(self, columns: np.ndarray) -> sparse.csr_array:
        """(E (p + 1), n) picks the controls (E, p + 1)."""
        pointers = np.arange(columns.size + 1)
        shape = (columns.size, self.basis.n)
        return sparse.csr_array((np.ones(columns.size), columns.ravel(), pointers), shape=shape)

    def integral(
        self, name: str, expression: Callable[[RigidJet], ca.SX], squares: bool, nodes: int, weight: float, whole: bool
    ) -> Block:
        """weight ∫ φ dt by Gauss nodes on the spans; φ the expression, or with `squares` its sum of squares.

        whole: whether a span is one element, whose logarithms are taken once for its nodes. With all nodes of a span
        in one, a large kernel takes long to derive.
        """
        basis = self.basis.relative
        points, weights = gauss(basis, nodes)
        shares = np.sqrt(weight * weights) if squares else weight * weights
        if not whole:
            points, shares = points.reshape(-1, 1), shares.reshape(-1, 1)
        e, q = points.shape
        p, c = self.basis.degree, self.channels
        columns, tables = self._tables(basis, points, 2)
        symbols = NodeSymbols.of(c, p, self.plain)
        ways, out, data = symbols.ways(c), [], [symbols.signs, symbols.turns]
        # Asked of a jet of symbols: a node's own is a long expression to search.
        plain = self.symbols()
        timed = bool(ca.depends_on(expression(plain), plain.t))
        placed = self.shift.any() and bool(ca.depends_on(expression(plain), plain.v))
        if placed:
            symbols = replace(symbols, shift=ca.SX.sym("shift", 3))
            data.append(symbols.shift)
        for k in range(q):
            here = NodeSymbols.of(c, p, self.plain, k)
            share = ca.SX.sym("share")
            node = replace(here, z=symbols.z, signs=symbols.signs, turns=symbols.turns, shift=symbols.shift)
            out.append(share * expression(node.jet(c, ways)))
            data += [*here.weights[:3], share, *([here.t] if timed else [])]
        extra = np.stack([shares, self.basis.origin + points], axis=2) if timed else shares[..., None]
        shift = [np.broadcast_to(self.shift, (e, 3))] if placed else []
        numbers = [*self._branches(columns), *shift, np.concatenate([tables, extra], axis=2).reshape(e, -1)]
        kernel = Kernel(symbols.z, ca.vertcat(*data), ca.vertcat(*out), c, squares)
        table = np.concatenate(numbers, axis=1)
        return Block(name, kernel, self.variable, slice(0, c), self._picked(columns), 1, np.ones(e), table)

    def norms(self) -> Constraint:
        """|q_j|² = 1 for every control quaternion."""
        z = ca.SX.sym("z", self.channels)
        kernel = Kernel(z, ca.SX.sym("data", 0), ca.sumsqr(z[:4]) - 1, self.channels)
        n, every = self.basis.n, sparse.csr_array(sparse.eye_array(self.basis.n, format="csr"))
        channels = slice(0, self.channels)
        return Constraint.equality(
            Block("unit norms", kernel, self.variable, channels, every, 1, np.ones(n), np.empty((n, 0)))
        )
