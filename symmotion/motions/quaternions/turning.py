"""What quaternion curves have in common: orientations and angular rates, and all that follows from these."""

from typing import TYPE_CHECKING, Literal, NamedTuple, Protocol, get_args

import numpy as np
from numpy.typing import ArrayLike

from symmotion.checks import choice, numbers
from symmotion.errors import InputError
from symmotion.motions.motion import as_points
from symmotion.motions.position import Affine, homogeneous
from symmotion.motions.quaternions.algebra import product, rotate, skew, to_rotation

if TYPE_CHECKING:
    from scipy.spatial.transform import Rotation

Frame = Literal["body", "world"]


class QuaternionJet(NamedTuple):
    """Orientations (…, 4) with angular rate, acceleration, jerk (…, 3), rad and s; None where not asked."""

    quaternion: np.ndarray
    rate: np.ndarray = None  # pyright: ignore[reportAssignmentType]
    acceleration: np.ndarray = None  # pyright: ignore[reportAssignmentType]
    jerk: np.ndarray = None  # pyright: ignore[reportAssignmentType]


class Turning(Protocol):
    """A curve that has orientations and angular rates."""

    def jet(self, t: ArrayLike, order: int = 2, frame: Frame = "body") -> QuaternionJet: ...


def derivative(self: Turning, t: ArrayLike, nu: int = 0) -> np.ndarray:
    """The nu-th derivative (0 to 3) of the unit quaternion at times t: t.shape + (4,).

    q̇ = q w, q̈ = q (w² + ẇ), d³q/dt³ = q (w³ + 2 w ẇ + ẇ w + ẅ) with w = Ω/2.
    """
    jet = self.jet(t, nu)
    if nu == 0:
        return jet.quaternion
    turns = [r for r in jet[1:] if r is not None]
    rates = [np.concatenate([np.zeros((*r.shape[:-1], 1)), r / 2], axis=-1) for r in turns]
    w = rates[0]
    if nu == 1:
        inner = w
    elif nu == 2:
        inner = product(w, w) + rates[1]
    else:
        inner = product(w, product(w, w)) + 2 * product(w, rates[1]) + product(rates[1], w) + rates[2]
    return product(jet.quaternion, inner)


def matrix(self: Turning, t: ArrayLike, nu: int = 0) -> np.ndarray:
    """The nu-th derivative of ((R, 0), (0, 1)), turning about the origin, at times t: t.shape + (4, 4).

    nu: as far as `jet` goes.
    """
    return homogeneous(turning(self, t, nu), float(nu == 0))


def trajectory(self: Turning, points: ArrayLike, t: ArrayLike, nu: int = 0) -> np.ndarray:
    """The nu-th derivative of the paths of body points (P, 3), P = 1 for one: t.shape + (P, 3).

    nu: as far as `jet` goes.
    """
    return turning(self, t, nu)(as_points(points))


def rotation(self: Turning, t: ArrayLike) -> "Rotation":
    """The orientations at times t (N,) as a SciPy `Rotation`."""
    return to_rotation(self.jet(t, 0).quaternion)


def rate(self: Turning, t: ArrayLike, frame: Frame = "body") -> np.ndarray:
    """The angular rate Ω = 2 q⁻¹ q̇ at times t, in rad/s: t.shape + (3,)."""
    return self.jet(t, 1, frame).rate


def acceleration(self: Turning, t: ArrayLike, frame: Frame = "body") -> np.ndarray:
    """The angular acceleration at times t, in rad/s²: t.shape + (3,)."""
    return self.jet(t, 2, frame).acceleration


def jerk(self: Turning, t: ArrayLike, frame: Frame = "body") -> np.ndarray:
    """The second derivative of the angular rate at times t, in rad/s³: t.shape + (3,)."""
    return self.jet(t, 3, frame).jerk


def turned(jet: QuaternionJet) -> np.ndarray:
    """(…, 3, 3) the derivative of the rotation matrix R of the highest order that the jet has rates for, in the body.

    Ṙ = R [Ω]×, R̈ = R ([Ω]×² + [Ω̇]×), d³R/dt³ = R ([Ω]×³ + 2 [Ω]× [Ω̇]× + [Ω̇]× [Ω]× + [Ω̈]×).
    """
    linear = np.swapaxes(rotate(jet.quaternion[..., None, :], np.eye(3)), -1, -2)
    w, *higher = (skew(r) for r in jet[1:] if r is not None) if jet.rate is not None else (None,)
    if w is None:
        return linear
    if not higher:
        return linear @ w
    if len(higher) == 1:
        return linear @ (w @ w + higher[0])
    return linear @ (w @ w @ w + 2 * w @ higher[0] + higher[0] @ w + higher[1])


def turning(curve: Turning, t: ArrayLike, nu: int) -> Affine:
    """The nu-th derivative of the positions of a body that turns about the origin."""
    linear = turned(curve.jet(t, nu))
    return Affine(linear, np.zeros(linear.shape[:-1]))


def asked(t: ArrayLike, order: int, frame: Frame) -> tuple[np.ndarray, bool]:
    """The times of a jet, and whether its rates are the world's; InputError for what cannot be asked."""
    if order not in (0, 1, 2, 3):
        raise InputError(f"order {order!r}: 0 to 3 is needed")
    t, world = numbers(t, "times"), checked_frame(frame) == "world"
    if not np.isfinite(t).all():
        raise InputError("times must be finite")
    return t, world


def checked_frame(frame: Frame) -> Frame:
    """The frame; InputError where it is unknown."""
    return choice(frame, get_args(Frame), "frame")
