"""Jets of tensor-product nets, at pairs of parameters."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import casadi as ca
import numpy as np
from scipy import sparse

from symmotion.brief import instants
from symmotion.errors import InputError
from symmotion.jets.curve import NET_ORDERS, NetJet, net_jet
from symmotion.jets.space import UNKNOWN, Reading, interleaved
from symmotion.splines import BSplineBasis
from symmotion.splines.instants import unified


@dataclass(frozen=True, eq=False)
class NetSpace:
    """A tensor-product net of coordinates over bases u and v (or u alone), as jets at parameter pairs. A `JetSpace`.

    Its controls are those of the net row by row; `times` are the pairs (u, v). shift: (channels,) what was subtracted
    from each of them, None for nothing.
    """

    bases: tuple[BSplineBasis, ...]
    channels: int
    variable: str = UNKNOWN
    shift: np.ndarray | None = None

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
        if self.shift is None or not self.shift.any():
            return self.symbols(slot)
        symbols, c = _net_symbols(self.channels), self.channels
        return net_jet(ca.vertcat(symbols[:c] + ca.DM(self.shift), symbols[c:]), c, len(self.bases))

    def symbols(self, slot: int = 0) -> NetJet:
        return net_jet(_net_symbols(self.channels), self.channels, len(self.bases))

    def _orders(self, out: ca.SX) -> list[int]:
        symbols, c = _net_symbols(self.channels), self.channels
        return [k for k in range(len(NET_ORDERS)) if ca.depends_on(out, symbols[k * c : (k + 1) * c])]

    def placed(self, pairs: np.ndarray, name: str) -> np.ndarray:
        """Parameters (N, 2), of a curve (N, 1), put on knots that they agree with up to rounding.

        InputError that names what asks for parameters which the net has not.
        """
        if pairs.shape[1:] != (len(self.bases),):
            raise InputError(f"{name}: parameters of shape {pairs.shape}: (N, {len(self.bases)}) is needed on this net")
        found = np.empty(pairs.shape)
        for k, basis in enumerate(self.bases):
            a, b = basis.domain
            found[:, k] = unified(pairs[:, k], basis.breakpoints)
            outside = ~((found[:, k] >= a) & (found[:, k] <= b))
            if outside.any():
                t, a, b = instants(pairs[outside, k][0], a, b)
                raise InputError(f"{name}: parameter {'uv'[k]} = {t} is outside [{a}, {b}]")
        return found

    def needed(self, slot: int, out: ca.SX) -> int:
        return self.channels if slot == 0 and self._orders(out) else 0

    def read(self, slot: int, out: ca.SX, times: np.ndarray, sides: np.ndarray | None, width: int) -> Reading:
        symbols, c, found = _net_symbols(self.channels), self.channels, self._orders(out)
        pairs, operators = times.reshape(len(times), -1), []
        for k in found:
            factors = [basis.matrix(pairs[:, i], NET_ORDERS[k][i]) for i, basis in enumerate(self.bases)]
            operators.append(_row_products(factors))
        z = ca.vertcat(*(symbols[k * c : (k + 1) * c] for k in found))
        return Reading(z, interleaved(operators, len(pairs)), ca.SX(0, 1), np.empty((len(pairs), 0)))


@lru_cache(maxsize=8)
def _net_symbols(channels: int) -> ca.SX:
    return ca.SX.sym("net", len(NET_ORDERS) * channels + 1)


def _row_products(factors: Sequence[sparse.csr_array]) -> sparse.csr_array:
    """(N, n m) the products of the rows of (N, n) and (N, m), entry by entry."""
    if len(factors) == 1:
        return factors[0]
    rows = [sparse.kron(factors[0][[i]], factors[1][[i]]) for i in range(factors[0].shape[0])]
    return sparse.csr_array(sparse.vstack(rows))
