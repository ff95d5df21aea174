"""Jets of an affine spline whose knots are unknowns too: controls and knot widths about a span, in symbols."""

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import casadi as ca
import numpy as np
from scipy import sparse

from symmotion.errors import InputError
from symmotion.jets import HIGHEST_ORDER, Jet
from symmotion.jets.affine import affine_jet
from symmotion.jets.space import UNKNOWN, Reading
from symmotion.kernels import Kernel
from symmotion.program import Block
from symmotion.splines.symbolic import local_basis


@dataclass(frozen=True, eq=False)
class MovingSpace:
    """The space of an affine spline whose knots are unknowns: jets by shares of the spans. A `JetSpace`.

    ends: (spans + 1,) where the knots of the start lie, from the origin in time on, by which times are told; channels:
    of the motion, one less than of the unknowns; dimension: of the body. shift: (channels,) what the unknowns are
    short of the coordinates.
    """

    degree: int
    channels: int
    dimension: int
    ends: np.ndarray
    unit: float
    origin: float = 0.0
    shift: np.ndarray | None = None
    variable: str = UNKNOWN
    _slots: dict[int, tuple[ca.SX, ca.SX, ca.SX, Jet]] = field(default_factory=dict, repr=False)

    def __getstate__(self) -> dict[str, object]:
        return {**self.__dict__, "_slots": {}}  # symbols do not pickle, and are made again

    @property
    def n(self) -> int:
        return len(self.ends) - 1 + self.degree

    @property
    def unshifted(self) -> "MovingSpace":
        return replace(self, shift=None, _slots={})

    @property
    def domain(self) -> tuple[float, float]:
        return float(self.origin + self.ends[0]), float(self.origin + self.ends[-1])

    @property
    def breakpoints(self) -> np.ndarray:
        return self.origin + self.ends

    def _slot(self, slot: int) -> tuple[ca.SX, ca.SX, ca.SX, Jet]:
        if slot not in self._slots:
            z, share, told = local_symbols(self.degree, self.channels), ca.SX.sym("share"), self._told()
            self._slots[slot] = z, share, told, self.jet_at(z, share, told)
        return self._slots[slot]

    def _told(self) -> ca.SX:
        """Symbols for the unit of time, and for the shift where there is one."""
        return ca.SX.sym("unit", 1 if self.shift is None else 1 + self.channels)

    @property
    def _numbers(self) -> np.ndarray:
        """What is `_told`, as numbers."""
        return np.append(self.unit, [] if self.shift is None else self.shift)

    def jet_at(self, z: ca.SX, share: ca.SX, told: ca.SX) -> Jet:
        """The jet at a share of the span whose controls and widths are z."""
        unit = told[0]
        d, c = self.dimension, self.channels
        values = [local_derivative(z, self.degree, order, share) / unit**order for order in range(HIGHEST_ORDER + 1)]
        if self.shift is not None:
            values[0] = values[0] + told[1:] * ca.DM((self.shift != 0).astype(float))
        linear = tuple(ca.reshape(v[: d * d], d, d).T for v in values)
        still = ca.SX.zeros(d)
        return Jet(linear, tuple(v[d * d :] if c > d * d else still for v in values), ca.SX.sym("t"))

    def jet(self, slot: int = 0) -> Jet:
        return self._slot(slot)[3]

    def symbols(self, slot: int = 0) -> Jet:
        d = self.dimension
        return affine_jet(ca.SX.sym("jet", (HIGHEST_ORDER + 1) * (d * d + d) + 1), d)

    def needed(self, slot: int, out: ca.SX) -> int:
        z, _, _, jet = self._slot(slot)
        if ca.depends_on(out, jet.t):
            raise InputError("an expression depends on the time itself: its times cannot be unknowns")
        return self.channels + 1 if ca.depends_on(out, ca.vec(z)) else 0

    def read(self, slot: int, out: ca.SX, times: np.ndarray, sides: np.ndarray | None, width: int) -> Reading:
        z, share, told, _ = self._slot(slot)
        times = times - self.origin
        span = np.clip(np.searchsorted(self.ends, times, side="right") - 1, 0, len(self.ends) - 2)
        shares = (times - self.ends[span]) / np.diff(self.ends)[span]
        data = np.column_stack([shares, np.broadcast_to(self._numbers, (len(times), told.numel()))])
        return Reading(ca.vec(z.T), self.selection(span), ca.vertcat(share, told), data)

    def selection(self, span: np.ndarray) -> sparse.csr_array:
        """(N · 2p, n) picks what is read in each of the spans (N,): rows m − p + 1 … m + p, none before the first.

        Those before row m bring the knots to the left, the p + 1 others the controls and the rest of the knots.
        """
        rows = (span[:, None] + np.arange(1 - self.degree, self.degree + 1)).ravel()
        there = rows >= 0
        place = (np.flatnonzero(there), rows[there])
        return sparse.csr_array((np.ones(there.sum()), place), shape=(rows.size, self.n))

    def integral(
        self, name: str, expression: Callable[[Jet], ca.SX], squares: bool, nodes: int, weight: float
    ) -> Block:
        """weight ∫ φ dt over the spans: at the share ξ of a span of width w unit φ(jet) · w unit, Gauss nodes in ξ."""
        z, share, told = local_symbols(self.degree, self.channels), ca.SX.sym("share"), self._told()
        jet = self.jet_at(z, share, told)
        out, spans = expression(jet), len(self.ends) - 1
        if ca.depends_on(out, jet.t):
            raise InputError(f"{name} depends on the time itself: its times cannot be unknowns")
        width = _widths(z, self.degree)[self.degree - 1] * told[0]
        out = out * (ca.sqrt(width) if squares else width)
        kernel = Kernel(ca.vec(z.T), ca.vertcat(share, told), out, self.channels + 1, squares=squares)
        points, weights = np.polynomial.legendre.leggauss(nodes)
        numbers = np.broadcast_to(self._numbers, (nodes * spans, told.numel()))
        data = np.column_stack([np.tile(0.5 + 0.5 * points, spans), numbers])
        weights = np.tile(0.5 * weight * weights, spans)
        operator = self.selection(np.repeat(np.arange(spans), nodes))
        return Block(name, kernel, UNKNOWN, slice(0, self.channels + 1), operator, nodes, weights, data)


def local_symbols(p: int, channels: int) -> ca.SX:
    """(2p, channels + 1) symbols for the rows m − p + 1 … m + p that span m reads."""
    return ca.SX.sym("z", 2 * p, channels + 1)


def _widths(z: ca.SX, p: int) -> list[ca.SX]:
    """The 2p − 1 knot widths about a span, its own in the middle, at p − 1."""
    return [z[k, -1] for k in range(2 * p - 1)]


def local_derivative(z: ca.SX, p: int, order: int, share: ca.SX) -> ca.SX:
    """(channels,) a derivative at a share of the span, in units of the widths."""
    widths = _widths(z, p)
    knots = {0: ca.SX(0)}
    for k in range(1, p + 1):
        knots[k] = knots[k - 1] + widths[p - 2 + k]
        if k < p:
            knots[-k] = knots[1 - k] - widths[p - 1 - k]
    about = [knots[k] for k in range(1 - p, p + 1)]
    return z[p - 1 :, :-1].T @ ca.vertcat(*local_basis(about, p, share * widths[p - 1], order))
