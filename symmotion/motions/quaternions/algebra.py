"""Quaternion algebra on arrays (…, 4), scalar first (w, x, y, z), Hamilton product; SciPy `Rotation` at the border."""

from typing import Literal, get_args

import numpy as np
from numpy.typing import ArrayLike

from symmotion.checks import choice, floats, numbers
from symmotion.errors import InputError
from symmotion.motions.rotations import UNIT_TOLERANCE as UNIT_TOLERANCE
from symmotion.motions.rotations import as_quaternions as as_quaternions
from symmotion.motions.rotations import from_rotation as from_rotation
from symmotion.motions.rotations import to_rotation as to_rotation

# Neighbours whose scalar product is smaller are half a turn apart: both ways round are equally long.
HALF_TURN = 1e-9

Signs = Literal["align", "keep", "check"]


def product(p: ArrayLike, q: ArrayLike) -> np.ndarray:
    """p q, shapes (…, 4) that broadcast.

    p, q: scalar first, of any length. Raises InputError for numbers that are not real.

    >>> sm.quaternions.product([0, 1, 0, 0], [0, 0, 1, 0])
    array([0., 0., 0., 1.])
    """
    p, q = floats(p, "quaternions"), floats(q, "quaternions")
    pw, px, py, pz = p[..., 0], p[..., 1], p[..., 2], p[..., 3]
    qw, qx, qy, qz = q[..., 0], q[..., 1], q[..., 2], q[..., 3]
    return np.stack(
        [
            pw * qw - px * qx - py * qy - pz * qz,
            pw * qx + px * qw + py * qz - pz * qy,
            pw * qy - px * qz + py * qw + pz * qx,
            pw * qz + px * qy - py * qx + pz * qw,
        ],
        axis=-1,
    )


def conjugate(q: ArrayLike) -> np.ndarray:
    """(w, −x, −y, −z), of a unit quaternion the inverse.

    q: (…, 4), scalar first. Returns as many.

    Raises InputError for numbers that are not real.

    >>> sm.quaternions.conjugate([0.0, 1.0, 0.0, 0.0])
    array([ 0., -1., -0., -0.])
    """
    return floats(q, "quaternions") * [1.0, -1.0, -1.0, -1.0]


def exp(v: ArrayLike) -> np.ndarray:
    """exp(v) = (cos |v|, sin |v| v/|v|) of vectors (…, 3): the turn by 2|v| about v (KKS 2.2).

    v: half the rotation vector, in rad. Raises InputError for numbers that are not real.

    >>> sm.quaternions.exp([0.0, 0.0, np.pi / 2]).round(9)
    array([0., 0., 0., 1.])
    """
    v = floats(v, "vectors")
    angle = np.linalg.norm(v, axis=-1, keepdims=True)
    # sinc is smooth through zero.
    return np.concatenate([np.cos(angle), np.sinc(angle / np.pi) * v], axis=-1)


def log(q: ArrayLike) -> np.ndarray:
    """The v (…, 3) of least length with exp(v) = q for unit quaternions (…, 4); |v| ≤ π, at q = −1 along x.

    q: scalar first. Raises InputError for numbers that are not real.

    >>> sm.quaternions.log([0.0, 0.0, 0.0, 1.0]) / np.pi
    array([0. , 0. , 0.5])
    """
    q = floats(q, "quaternions")
    w, v = q[..., :1], q[..., 1:]
    sine = np.linalg.norm(v, axis=-1, keepdims=True)
    angle = np.arctan2(sine, w)
    tiny = sine < 1e-150
    ratio = np.where(tiny, 1.0, angle / np.where(tiny, 1.0, sine))
    return np.where(tiny & (w < 0), np.pi * np.array([1.0, 0.0, 0.0]), ratio * v)


def short_log(q: np.ndarray) -> np.ndarray:
    """The logarithm of q or −q, whichever is shorter."""
    return log(q * np.where(q[:, :1] < 0, -1.0, 1.0))


def rotate(q: ArrayLike, v: ArrayLike) -> np.ndarray:
    """q v q⁻¹ for unit quaternions (…, 4) and vectors (…, 3).

    q: scalar first; v: in any unit. Raises InputError for numbers that are not real.

    >>> sm.quaternions.rotate([np.sqrt(0.5), 0, 0, np.sqrt(0.5)], [1.0, 0.0, 0.0]).round(9)
    array([-0.,  1.,  0.])
    """
    q, v = floats(q, "quaternions"), floats(v, "vectors")
    twice = 2.0 * np.cross(q[..., 1:], v)
    return v + q[..., :1] * twice + np.cross(q[..., 1:], twice)


def aligned(q: np.ndarray, signs: Signs = "align", what: str = "keyframe") -> np.ndarray:
    """(M, 4) the quaternions with signs such that neighbours turn the short way; q and −q are one orientation.

    signs: "align"; "keep" takes them as they are, so that a negative scalar product of neighbours
    means the long way round; "check" raises InputError there. Raises InputError where neighbours
    leave no direction to turn in.
    """
    choice(signs, get_args(Signs), "signs")
    cosine = np.sum(q[1:] * q[:-1], axis=1)
    if signs == "align":
        level = np.abs(cosine) < HALF_TURN
        if level.any():
            i = int(np.argmax(level))
            raise InputError(
                f"{what}s {i} and {i + 1} are half a turn apart, and both ways round are equally long: choose one by "
                f'their signs with signs="keep", or put a {what} between them'
            )
        return q * np.concatenate([[1.0], np.cumprod(np.sign(cosine))])[:, None]
    if signs == "check" and (cosine < 0).any():
        i = int(np.argmax(cosine < 0))
        long = 360 - np.rad2deg(2 * np.arccos(min(1.0, -cosine[i])))
        raise InputError(
            f"{what}s {i} and {i + 1} have mixed signs (scalar product {cosine[i]:.3g}): q and −q are one orientation, "
            f'but the curve would turn the long way, {long:.4g}°. signs="align" turns the short way, "keep" the long'
        )
    antipodal = cosine < -1 + 0.5 * HALF_TURN**2 + 1e-15
    if antipodal.any():
        i = int(np.argmax(antipodal))
        raise InputError(
            f"{what}s {i} and {i + 1} are antipodal, q and −q: a whole turn about an axis that nothing tells. "
            f'Use signs="align" for none, or put a {what} between them'
        )
    return q


def increments_between(q: np.ndarray, turns: ArrayLike | None = None, what: str = "keyframe") -> np.ndarray:
    """(M − 1, 3) half-angle vectors ω_i with q_i = ± q_{i−1} exp(ω_i), longer by whole turns where asked for.

    turns: (M − 1,) whole numbers of physical turns added along each one's own direction; negative
    ones go the other way round. A turn is π in half-angle units and flips the sign of q (KKS 5.2).
    """
    plain = log(product(conjugate(q[:-1]), q[1:]))
    if turns is None:
        return plain
    turns = numbers(turns, "turns")
    if turns.shape != (len(q) - 1,) or (turns != np.round(turns)).any():
        raise InputError(f"turns of shape {turns.shape}: a whole number per interval, ({len(q) - 1},), is needed")
    size = np.linalg.norm(plain, axis=1)
    still = (turns != 0) & (size < 1e-9)
    if still.any():
        i = int(np.argmax(still))
        raise InputError(
            f"{what}s {i} and {i + 1} are alike: extra turns between them need an axis; put a {what} between them"
        )
    return plain * (1 + np.pi * turns / np.where(size > 0, size, 1.0))[:, None]


def ways_like(old: np.ndarray, start: np.ndarray, end: np.ndarray) -> np.ndarray:
    """(N, 3) half-angle vectors that lead from unit quaternions to ± others (N, 4): those nearest to old ways."""
    plain = short_log(product(conjugate(start), end))
    size, long = np.linalg.norm(plain, axis=1), np.linalg.norm(old, axis=1)
    # Where the orientations are alike, the old way tells the axis.
    axis = np.where((size > 1e-9)[:, None], plain, old) / np.where(size > 1e-9, size, long + (long == 0))[:, None]
    turns = np.round((np.sum(old * axis, axis=1) - size) / np.pi)
    return axis * (size + np.pi * turns)[:, None]


def skew(v: ArrayLike) -> np.ndarray:
    """(…, 3, 3) the matrix of v ×."""
    v = floats(v, "vectors")
    zero = np.zeros_like(v[..., 0])
    x, y, z = v[..., 0], v[..., 1], v[..., 2]
    return np.stack([zero, -z, y, z, zero, -x, -y, x, zero], axis=-1).reshape(*v.shape[:-1], 3, 3)


def right_jacobian(v: ArrayLike) -> np.ndarray:
    """(…, 3, 3) the J with exp(v + dv) = exp(v) exp(J dv) to first order, for half-angle vectors (…, 3).

    J = I − (1 − cos θ)/θ² [2v]× + (θ − sin θ)/θ³ [2v]×², θ = 2|v|.
    """
    v = 2 * floats(v, "vectors")
    angle = np.linalg.norm(v, axis=-1)[..., None, None]
    small = angle < 1e-2
    safe = np.where(small, 1.0, angle)
    s = angle**2
    first = np.where(small, 0.5 - s / 24 + s**2 / 720, 2 * np.sin(safe / 2) ** 2 / safe**2)
    second = np.where(small, 1 / 6 - s / 120 + s**2 / 5040, (safe - np.sin(safe)) / safe**3)
    cross = skew(v)
    return np.eye(3) - first * cross + second * (cross @ cross)
