"""The symbolic jet of a motion curve."""

from dataclasses import dataclass

import casadi as ca

from symmotion.errors import InputError
from symmotion.jets.affine import HIGHEST_ORDER
from symmotion.jets.jet import column, of_kind


@dataclass(frozen=True, eq=False)
class CurveJet:
    """A curve and its derivatives at one parameter, as CasADi expressions.

    derivatives: orders 0 … 3 of x, a column (D, 1) for points, a matrix where the curve's values are; t: the parameter.
    By name they are x, dx, ddx, dddx.

    >>> steep = sm.JetEnergy(lambda jet: jet.ddx, squares=True, label="bending")
    >>> round(sm.measure(sm.curves.bezier([[0.0], [1.0], [0.0]]), steep), 6)
    16.0
    """

    derivatives: tuple[ca.SX, ...]
    t: ca.SX

    __repr__ = of_kind

    @property
    def kind(self) -> str:
        """Which jet it is, in words: "curve", and the shape of a value."""
        rows, columns = self.x.shape
        return f"curve {rows} × {columns}"

    @property
    def entries(self) -> ca.SX:
        """(4 C + 1, 1) x, dx, ddx, dddx column by column, C numbers each, and the parameter."""
        return column([*self.derivatives, self.t])

    @property
    def x(self) -> ca.SX:
        """The value x(t), a matrix of the curve's shape; a column (C, 1) where that is (C,)."""
        return self.derivatives[0]

    @property
    def dx(self) -> ca.SX:
        """The first derivative by the parameter, in the shape of x."""
        return self.derivatives[1]

    @property
    def ddx(self) -> ca.SX:
        """The second derivative by the parameter, in the shape of x."""
        return self.derivatives[2]

    @property
    def dddx(self) -> ca.SX:
        """The third derivative by the parameter, in the shape of x."""
        return self.derivatives[3]


def curve_jet(entries: ca.SX, shape: tuple[int, int]) -> CurveJet:
    """The jet of entries in the order of `CurveJet.entries`."""
    size, orders = shape[0] * shape[1], HIGHEST_ORDER + 1
    parts = tuple(ca.reshape(entries[k * size : (k + 1) * size], *shape) for k in range(orders))
    return CurveJet(parts, entries[orders * size])


NET_ORDERS = tuple((u, v) for total in range(4) for u in range(total, -1, -1) for v in [total - u])


@dataclass(frozen=True, eq=False)
class NetJet:
    """A two-parameter net of coordinates and its partial derivatives at one (u, v), as CasADi expressions.

    derivatives: (C, 1) each, by order: d, du, dv, duu, duv, dvv, duuu, …, dvvv. parameters: 2, or 1 of a net that is
    a curve, which has no derivative by v.

    t: () a symbol of its own, as other jets have one.

    Raises InputError for a derivative that it does not have.

    >>> low = sm.JetConstraint(lambda jet: jet.d[0], lower=0.0, upper=np.inf, at=[(4.5, 4.5)], name="scalar part")
    >>> sm.fairing.fairing_program(sm.motions.smooth_net(6), constraints=[low]).constraint("scalar part").is_equality
    False
    """

    derivatives: tuple[ca.SX, ...]
    t: ca.SX
    parameters: int = 2

    __repr__ = of_kind

    @property
    def kind(self) -> str:
        """Which jet it is, in words: "net", and how many coordinates it has."""
        return f"net {self.d.numel()}" if self.parameters == 2 else f"net {self.d.numel()} of a curve"

    @property
    def entries(self) -> ca.SX:
        """(10 C + 1, 1) the derivatives by order, C numbers each, and the symbol t."""
        return column([*self.derivatives, self.t])

    def partial(self, u: int, v: int) -> ca.SX:
        """(C, 1) ∂ᵘ⁺ᵛ d/∂uᵘ∂vᵛ, u + v ≤ 3."""
        if v and self.parameters == 1:
            raise InputError("a net of one parameter u has no derivative by v: du, duu and partial(3, 0) are its own")
        return self.derivatives[NET_ORDERS.index((u, v))]

    @property
    def d(self) -> ca.SX:
        """(C, 1) the value d(u, v)."""
        return self.partial(0, 0)

    @property
    def du(self) -> ca.SX:
        """(C, 1) ∂d/∂u."""
        return self.partial(1, 0)

    @property
    def dv(self) -> ca.SX:
        """(C, 1) ∂d/∂v, of a net of two parameters."""
        return self.partial(0, 1)

    @property
    def duu(self) -> ca.SX:
        """(C, 1) ∂²d/∂u²."""
        return self.partial(2, 0)

    @property
    def duv(self) -> ca.SX:
        """(C, 1) ∂²d/∂u∂v, of a net of two parameters."""
        return self.partial(1, 1)

    @property
    def dvv(self) -> ca.SX:
        """(C, 1) ∂²d/∂v², of a net of two parameters."""
        return self.partial(0, 2)


def net_jet(entries: ca.SX, channels: int, parameters: int) -> NetJet:
    """The jet of entries in the order of `NetJet.entries`."""
    count = len(NET_ORDERS)
    parts = tuple(entries[k * channels : (k + 1) * channels] for k in range(count))
    return NetJet(parts, entries[count * channels :], parameters)
