"""The symbolic jet of an affine motion: its value and derivatives at one parameter."""

from dataclasses import dataclass

import casadi as ca

HIGHEST_ORDER = 3


@dataclass(frozen=True, eq=False)
class Jet:
    """A motion and its time derivatives at one parameter, as CasADi symbols; what an energy is written in.

    linear, translation: the derivatives 0 … 3 of A (d, d) and v (d, 1); t: the time.
    """

    linear: tuple[ca.SX, ...]
    translation: tuple[ca.SX, ...]
    t: ca.SX

    @property
    def dimension(self) -> int:
        return self.A.shape[0]

    @property
    def A(self) -> ca.SX:
        return self.linear[0]

    @property
    def dA(self) -> ca.SX:
        return self.linear[1]

    @property
    def ddA(self) -> ca.SX:
        return self.linear[2]

    @property
    def dddA(self) -> ca.SX:
        return self.linear[3]

    @property
    def v(self) -> ca.SX:
        return self.translation[0]

    @property
    def dv(self) -> ca.SX:
        return self.translation[1]

    @property
    def ddv(self) -> ca.SX:
        return self.translation[2]

    @property
    def dddv(self) -> ca.SX:
        return self.translation[3]

    @property
    def gram_rate(self) -> ca.SX:
        """Ġ = ȦᵀA + AᵀȦ."""
        product = self.A.T @ self.dA
        return product + product.T

    @property
    def gram_acceleration(self) -> ca.SX:
        """G̈ = ÄᵀA + 2ȦᵀȦ + AᵀÄ."""
        product = self.A.T @ self.ddA
        return product + product.T + 2 * self.dA.T @ self.dA
