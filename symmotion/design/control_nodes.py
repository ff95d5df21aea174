"""Control quaternions as the symbols of kernels: what a node of a quaternion curve reads, and what it can say."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import casadi as ca
import numpy as np
from scipy import sparse

from symmotion.jets import rotation
from symmotion.kernels import Kernel
from symmotion.motions.quaternions.algebra import conjugate, log, product
from symmotion.program import Block, Constraint
from symmotion.splines import BSplineBasis, gauss
from symmotion.splines.cumulative import cumulative

UNKNOWN = "controls"


@dataclass(frozen=True, eq=False)
class Node:
    """A pose curve at one parameter, in symbols: its control quaternions and points on the span, and weights.

    controls: the degree + 1 control quaternions; points: the control points, empty without
    translation; ways: the increments ω_l; weights: B̃, B̃′, B̃″, each (degree,); extra: the
    node's own data.
    """

    controls: Sequence[ca.SX]
    points: Sequence[ca.SX]
    ways: Sequence[ca.SX]
    weights: tuple[ca.SX, ca.SX, ca.SX]
    extra: ca.SX

    @cached_property
    def quaternion(self) -> ca.SX:
        """q (4, 1)."""
        return rotation.orientation(self.controls[0], self.ways, self.weights[0])

    @cached_property
    def jet(self) -> rotation.RotationJet:
        return rotation.rates(self.ways, *self.weights)

    def translation(self, nu: int) -> ca.SX:
        """The nu-th derivative, nu ≤ 2, of the translation (3, 1), v_0 + Σ (v_l − v_{l−1}) B̃_l."""
        steps = pairwise(self.points)
        moved = sum(((b - a) * self.weights[nu][k] for k, (a, b) in enumerate(steps)), ca.SX(3, 1))
        return moved + self.points[0] if nu == 0 else moved


@dataclass(frozen=True, eq=False)
class ControlSpace:
    """The space of a quaternion curve: its basis, and what tells a logarithm its branch.

    signs, turns: (n,) by the control that an increment leads to, q_{l−1}⁻¹ q_l · signs = exp(ω_l) with
    ω_l by 2π · turns longer than the principal logarithm. channels: 4, or 7 with a translation.
    """

    basis: BSplineBasis
    signs: np.ndarray
    turns: np.ndarray
    channels: int = 4

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

    def gauss(self, nodes: int) -> tuple[np.ndarray, np.ndarray]:
        """Gauss points and weights (S, nodes) on the spans."""
        return gauss(self.basis, nodes)

    def block(
        self,
        name: str,
        times: np.ndarray,
        expression: Callable[[Node], ca.SX],
        extra: np.ndarray | None = None,
        squares: bool = False,
    ) -> Block:
        """`expression` at times (E, Q), the Q of an element on one span: out is what it says at all of them.

        extra: (E, Q, D) data for each time. The logarithms of an element are taken once for its Q times.
        """
        e, q = times.shape
        extra = np.empty((e, q, 0)) if extra is None else extra
        spans, weights = cumulative(self.basis, times.ravel(), 2)
        p = self.basis.degree
        base = spans.reshape(e, q)[:, :1] - p
        columns = (base + np.arange(p + 1)) % self.basis.n
        tables = np.stack([np.stack(w, axis=1) for w in weights], axis=1).reshape(e, q, 3 * p)
        branches = [] if self.plain else [self.signs[columns[:, 1:]], self.turns[columns[:, 1:]]]
        data = np.concatenate([*branches, np.concatenate([tables, extra], axis=2).reshape(e, -1)], axis=1)
        pointers = np.arange(e * (p + 1) + 1)
        operator = sparse.csr_array(
            (np.ones(e * (p + 1)), columns.ravel(), pointers), shape=(e * (p + 1), self.basis.n)
        )
        kernel = self._kernel(q, extra.shape[2], expression, squares)
        return Block(name, kernel, UNKNOWN, slice(0, self.channels), operator, 1, np.ones(e), data)

    def at(self, name: str, times, expression: Callable[[Node], ca.SX], extra: np.ndarray | None = None) -> Constraint:
        """`expression` = 0 at each of the times (N,); extra: (N, D)."""
        return Constraint.equality(self.block_at(name, times, expression, extra))

    def block_at(self, name: str, times, expression, extra: np.ndarray | None = None) -> Block:
        """`expression` at each of the times (N,); extra: (N, D)."""
        times = np.asarray(times, dtype=float)
        return self.block(name, times[:, None], expression, None if extra is None else extra[:, None])

    def norms(self) -> Constraint:
        """|q_j|² = 1 for every control quaternion."""
        z = ca.SX.sym("z", self.channels)
        kernel = Kernel(z, ca.SX.sym("data", 0), ca.sumsqr(z[:4]) - 1, self.channels)
        n = self.basis.n
        operator = sparse.eye_array(n, format="csr")
        channels = slice(0, self.channels)
        return Constraint.equality(
            Block("unit norms", kernel, UNKNOWN, channels, sparse.csr_array(operator), 1, np.ones(n), np.empty((n, 0)))
        )

    def _kernel(self, count: int, extra: int, expression: Callable[[Node], ca.SX], squares: bool) -> Kernel:
        p, c = self.basis.degree, self.channels
        z = ca.SX.sym("z", c * (p + 1))
        branch = 0 if self.plain else 2 * p
        width = 3 * p + extra
        data = ca.SX.sym("data", branch + count * width)
        controls = [z[c * i : c * i + 4] for i in range(p + 1)]
        points = [z[c * i + 4 : c * i + 7] for i in range(p + 1)] if c > 4 else []
        ways = []
        for k, (a, b) in enumerate(pairwise(controls)):
            ratio = rotation.product(rotation.conjugate(a), b)
            ways.append(rotation.log(data[k] * ratio, data[p + k]) if branch else rotation.log(ratio))
        out = []
        for k in range(count):
            d = data[branch + k * width : branch + (k + 1) * width]
            out.append(expression(Node(controls, points, ways, (d[:p], d[p : 2 * p], d[2 * p : 3 * p]), d[3 * p :])))
        return Kernel(z, data, ca.vertcat(*out), c, squares)
