"""The symbolic jet of an affine motion: its value and derivatives at one parameter."""

from dataclasses import dataclass
from functools import cached_property

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike

from symmotion.jets.inertia import as_inertia
from symmotion.jets.jet import body_point, column, of_kind

HIGHEST_ORDER = 3  # of the derivatives that a jet has


@dataclass(frozen=True, eq=False)
class Jet:
    """An affine motion and its time derivatives at one parameter, as CasADi expressions: what energies are written in.

    linear, translation: the derivatives 0 … 3 of A (d, d) and v (d, 1); t: the time. A body point p is at
    v + A p. Where A is rigid, `rate`, `acceleration` and `torque` are those of the body, in its own frame.
    By name the derivatives are A, dA, ddA, dddA and v, dv, ddv, dddv; dimension: d.

    Its places raise InputError for points that are not (d,).

    >>> stretch = sm.JetEnergy(lambda jet: jet.gram_rate[0, 0], squares=True, label="stretch of the first axis")
    >>> round(sm.measure(sm.interpolants.component_cubic(sm.examples.quarter_turn()), stretch), 6)
    1.333333
    """

    linear: tuple[ca.SX, ...]
    translation: tuple[ca.SX, ...]
    t: ca.SX

    __repr__ = of_kind

    @property
    def kind(self) -> str:
        """Which jet it is, in words: "affine 2D" or "affine 3D"."""
        return f"affine {self.dimension}D"

    @property
    def entries(self) -> ca.SX:
        """(4 d² + 4 d + 1, 1) A, dA, ddA, dddA column by column, v, dv, ddv, dddv, and the time."""
        return column([*self.linear, *self.translation, self.t])

    @property
    def dimension(self) -> int:
        """Of the space that the body is in, d."""
        return self.A.shape[0]

    @property
    def A(self) -> ca.SX:
        """(d, d) the linear part: a body point p is at v + A p."""
        return self.linear[0]

    @property
    def dA(self) -> ca.SX:
        """(d, d) Ȧ, per unit of time."""
        return self.linear[1]

    @property
    def ddA(self) -> ca.SX:
        """(d, d) Ä, per unit of time squared."""
        return self.linear[2]

    @property
    def dddA(self) -> ca.SX:
        """(d, d) the third derivative of A, per unit of time cubed."""
        return self.linear[3]

    @property
    def v(self) -> ca.SX:
        """(d, 1) the translation: where the body's origin is, in units of length."""
        return self.translation[0]

    @property
    def dv(self) -> ca.SX:
        """(d, 1) v̇, the velocity of the body's origin."""
        return self.translation[1]

    @property
    def ddv(self) -> ca.SX:
        """(d, 1) v̈, the acceleration of the body's origin."""
        return self.translation[2]

    @property
    def dddv(self) -> ca.SX:
        """(d, 1) the third derivative of v, the jerk of the body's origin."""
        return self.translation[3]

    @property
    def gram_rate(self) -> ca.SX:
        """(d, d) Ġ = ȦᵀA + AᵀȦ."""
        product = self.A.T @ self.dA
        return product + product.T

    @property
    def gram_acceleration(self) -> ca.SX:
        """(d, d) G̈ = ÄᵀA + 2ȦᵀȦ + AᵀÄ."""
        product = self.A.T @ self.ddA
        return product + product.T + 2 * self.dA.T @ self.dA

    @cached_property
    def _inverse(self) -> ca.SX:
        return ca.inv_minor(self.A)

    @property
    def rate(self) -> ca.SX:
        """The spin of A⁻¹Ȧ, its skew part: Ω (3, 1) in the body frame where A is rigid; a number in the plane."""
        return _axial(self._inverse @ self.dA)

    @property
    def world_rate(self) -> ca.SX:
        """The spin of ȦA⁻¹, (3, 1) or a number: the angular rate about the fixed axes where A is rigid."""
        return _axial(self.dA @ self._inverse)

    @property
    def acceleration(self) -> ca.SX:
        """The derivative of `rate`, (3, 1) or a number: the spin of A⁻¹Ä − (A⁻¹Ȧ)²."""
        turning = self._inverse @ self.dA
        return _axial(self._inverse @ self.ddA - turning @ turning)

    def torque(self, inertia: ArrayLike) -> ca.SX:
        """τ = J Ω̇ + Ω × JΩ (3, 1) of `rate` and `acceleration`, in space."""
        moments = ca.DM(as_inertia(inertia))
        return moments @ self.acceleration + ca.cross(self.rate, moments @ self.rate)

    def place(self, point: ArrayLike) -> ca.SX:
        """(d, 1) v + A p."""
        return self.v + self.A @ body_point(point, self.dimension)

    def velocity(self, point: ArrayLike) -> ca.SX:
        """(d, 1) v̇ + Ȧ p."""
        return self.dv + self.dA @ body_point(point, self.dimension)

    def acceleration_of(self, point: ArrayLike) -> ca.SX:
        """(d, 1) v̈ + Ä p."""
        return self.ddv + self.ddA @ body_point(point, self.dimension)

    def bending(self, points: np.ndarray, masses: np.ndarray) -> ca.SX:
        """At most d (d + 1) residuals whose squares add up to Σ m_i ‖acceleration of p_i‖²; (P, d), (P,)."""
        # Σ m ‖v̈ + Ä p‖² needs d residuals per point, or d (d + 1) for any number of points: with
        # homogeneous points it is tr(X C Xᵀ), X = (Ä v̈), C = Σ m p pᵀ = L Lᵀ.
        homogeneous = np.column_stack([points, np.ones(len(points))]) * np.sqrt(masses)[:, None]
        root = np.transpose(np.linalg.qr(homogeneous, mode="r"))
        return ca.vec(ca.horzcat(self.ddA, self.ddv) @ ca.DM(root))


def affine_jet(entries: ca.SX, d: int) -> Jet:
    """The jet of entries in the order of `Jet.entries`."""
    size, orders = d * d, HIGHEST_ORDER + 1
    linear = tuple(ca.reshape(entries[k * size : (k + 1) * size], d, d) for k in range(orders))
    rest = entries[orders * size :]
    return Jet(linear, tuple(rest[k * d : (k + 1) * d] for k in range(orders)), rest[orders * d])


def _axial(matrix: ca.SX) -> ca.SX:
    """The axial vector of the skew part of (3, 3), the number of (2, 2)."""
    half = (matrix - matrix.T) / 2
    if matrix.shape[0] == 2:
        return half[1, 0]
    return ca.vertcat(half[2, 1], half[0, 2], half[1, 0])
