"""The symbolic jet of an orientation or a pose: a unit quaternion with its rates, and the origin's path."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike

from symmotion.errors import InputError
from symmotion.jets import rotation
from symmotion.jets.inertia import as_inertia
from symmotion.jets.jet import body_point, column, of_kind


@dataclass(frozen=True, eq=False)
class RigidJet:
    """A rigid body's orientation, its rates in the body frame, and the path of its origin, as CasADi expressions.

    turn, rates, path: make the quaternion, Ω with Ω̇, and the derivatives 0 … 3 of the origin when they are asked for,
    since products of exponentials are long; path is None for an orientation alone, whose origin rests at zero.
    t: the time. A body point p is at v + R p; by name the origin and its derivatives are v, dv, ddv, dddv (3, 1).

    Raises InputError where the origin or a point at the origin of an orientation alone is asked for.

    >>> keys = sm.examples.random_keyframes(3, 40, seed=1)
    >>> slow = sm.JetEnergy(lambda jet: jet.rate, squares=True, label="turn")
    >>> sm.measure(sm.quaternions.interpolate_quaternions(keys), slow) > 0
    True
    """

    turn: Callable[[], ca.SX]
    rates: Callable[[], tuple[ca.SX, ca.SX]]
    path: Callable[[], tuple[ca.SX, ...]] | None
    t: ca.SX

    __repr__ = of_kind

    @cached_property
    def quaternion(self) -> ca.SX:
        """q (4, 1), scalar first."""
        return self.turn()

    @cached_property
    def _rates(self) -> tuple[ca.SX, ca.SX]:
        return self.rates()

    @property
    def rate(self) -> ca.SX:
        """Ω (3, 1) in the body frame, rad per unit of time."""
        return self._rates[0]

    @property
    def acceleration(self) -> ca.SX:
        """Ω̇ (3, 1) in the body frame, rad per unit of time²."""
        return self._rates[1]

    @cached_property
    def translation(self) -> tuple[ca.SX, ...]:
        """The derivatives 0 … 3 of the origin (3, 1), empty for an orientation alone."""
        return self.path() if self.path else ()

    @property
    def kind(self) -> str:
        """Which jet it is, in words: "pose", or "orientation" where it has no translation."""
        return "pose" if self.path else "orientation"

    @property
    def entries(self) -> ca.SX:
        """(23, 1) quaternion, rate, acceleration, v, dv, ddv, dddv, time; (11, 1) of an orientation."""
        return column([self.quaternion, self.rate, self.acceleration, *self.translation, self.t])

    @property
    def dimension(self) -> int:
        """Of the space that the body is in: 3."""
        return 3

    @cached_property
    def A(self) -> ca.SX:
        """R (3, 3), the rotation matrix."""
        return ca.horzcat(*(rotation.rotate(self.quaternion, ca.DM.eye(3)[:, k]) for k in range(3)))

    @property
    def dA(self) -> ca.SX:
        """(3, 3) Ṙ = R [Ω]."""
        return self.A @ ca.skew(self.rate)

    @property
    def ddA(self) -> ca.SX:
        """(3, 3) R̈ = R ([Ω]² + [Ω̇])."""
        return self.A @ self._bend

    @property
    def v(self) -> ca.SX:
        """(3, 1) the translation: where the body's origin is. An orientation has none: InputError."""
        return self._origin(0)

    @property
    def dv(self) -> ca.SX:
        """(3, 1) v̇, the velocity of the body's origin. An orientation has none: InputError."""
        return self._origin(1)

    @property
    def ddv(self) -> ca.SX:
        """(3, 1) v̈, the acceleration of the body's origin. An orientation has none: InputError."""
        return self._origin(2)

    @property
    def dddv(self) -> ca.SX:
        """(3, 1) the third derivative of v, the origin's jerk. An orientation has none: InputError."""
        return self._origin(3)

    def _origin(self, order: int) -> ca.SX:
        if self.path is None:
            raise InputError("an orientation has no translation: make a pose_program")
        return self.translation[order]

    @property
    def world_rate(self) -> ca.SX:
        """(3, 1) R Ω, about the fixed axes."""
        return rotation.rotate(self.quaternion, self.rate)

    def torque(self, inertia: ArrayLike) -> ca.SX:
        """τ = J Ω̇ + Ω × JΩ (3, 1), what turns a body of inertia J (3, 3) about its centre of mass."""
        moments = ca.DM(as_inertia(inertia))
        return moments @ self.acceleration + ca.cross(self.rate, moments @ self.rate)

    @cached_property
    def _bend(self) -> ca.SX:
        spin = ca.skew(self.rate)
        return spin @ spin + ca.skew(self.acceleration)

    def _moved(self, order: int, arm: ca.SX) -> ca.SX:
        turned = rotation.rotate(self.quaternion, arm)
        return turned + self.translation[order] if self.path else turned

    def place(self, point: ArrayLike) -> ca.SX:
        """(3, 1) v + R p."""
        return self._moved(0, ca.SX(body_point(point, 3)))

    def velocity(self, point: ArrayLike) -> ca.SX:
        """(3, 1) v̇ + R (Ω × p)."""
        return self._moved(1, ca.cross(self.rate, ca.SX(body_point(point, 3))))

    def acceleration_of(self, point: ArrayLike) -> ca.SX:
        """(3, 1) v̈ + R (Ω × (Ω × p) + Ω̇ × p)."""
        return self._moved(2, self._bend @ ca.SX(body_point(point, 3)))

    def bending(self, points: np.ndarray, masses: np.ndarray) -> ca.SX:
        """Residuals whose squares add up to Σ m_i ‖acceleration of p_i‖², points (P, 3), masses (P,)."""
        # Σ m ‖v̈ + R B p‖² with B = [Ω]×² + [Ω̇]×, whatever the number of points: the moments of the body
        # are m, Σ m p, Σ m p pᵀ = L Lᵀ about the centre of mass c, and ‖R x‖ = ‖x‖.
        mass = masses.sum()
        centre = masses @ points / mass
        spread = np.transpose(np.linalg.qr(np.sqrt(masses)[:, None] * (points - centre), mode="r"))
        whole = []
        if self.path:
            travel = self.ddv
            if centre.any():
                travel = travel + rotation.rotate(self.quaternion, self._bend @ ca.DM(centre))
            whole.append(np.sqrt(mass) * travel)
        elif centre.any():
            whole.append(np.sqrt(mass) * self._bend @ ca.DM(centre))
        if np.abs(spread).max() > 0:
            whole.append(ca.vec(self._bend @ ca.DM(spread)))
        if not whole:
            raise InputError("the body points of an orientation are all at its origin: they do not move")
        return ca.vertcat(*whole)


def rigid_jet(entries: ca.SX, pose: bool) -> RigidJet:
    """The jet of entries in the order of `RigidJet.entries`."""
    path = (lambda: tuple(entries[10 + 3 * k : 13 + 3 * k] for k in range(4))) if pose else None
    rates = entries[4:7], entries[7:10]
    return RigidJet(lambda: entries[:4], lambda: rates, path, entries[22 if pose else 10])
