"""Affine splines that turn rigidly from keyframe to keyframe, one way round or the other: starts of programs."""

import numpy as np

from symmotion.errors import InputError
from symmotion.motions import Keyframes
from symmotion.motions.quaternions.algebra import exp, product
from symmotion.motions.quaternions.keys import OrientationKeys
from symmotion.motions.rigid import polar_factors
from symmotion.motions.rotations import as_rotations, from_rotation, to_rotation
from symmotion.splines import Spline, cubic_interpolant

FINE = 8  # points of the path to a segment


def turns_between(keys: Keyframes) -> np.ndarray:
    """(M − 1,) the angles θ in rad, 0 to π, between the polar factors of neighbours; none where some reflect others.

    ‖M_{i+1} − M_i‖ = √8 sin(θ/2), in the plane and in space.
    """
    factors, _, _ = polar_factors(keys.linear)
    if len(np.unique(np.linalg.det(factors) < 0)) > 1:
        return np.empty(0)
    apart = np.sqrt(np.sum(np.diff(factors, axis=0) ** 2, axis=(1, 2)) / 8)
    return 2 * np.arcsin(np.minimum(1.0, apart))


def rigid_spline(keys: Keyframes, turns: np.ndarray | None = None) -> Spline:
    """A_t = M(t) S(t), the polar factors of the keyframes: M turns at constant rates, S and v are C² cubic splines.

    turns: (M − 1,) whole turns added, −1
    for the other way round. The spline (n, d² + d) is the cubic through FINE points to a segment. InputError where
    some keyframes reflect others.
    """
    rotations = _rotations(keys)
    if rotations is None:
        raise InputError("some keyframes reflect others: no rotations lead from one to the next")
    d, m = keys.dimension, len(keys)
    given = OrientationKeys.of(keys.times, rotations, turns, "keep")
    share = np.arange(FINE) / FINE
    times = np.append((keys.times[:-1, None] + np.diff(keys.times)[:, None] * share).ravel(), keys.times[-1])
    steps = product(given.quaternions[:-1, None], exp(given.ways[:, None] * share[:, None]))
    path = np.concatenate([steps.reshape(-1, 4), given.quaternions[-1:]])
    turned = to_rotation(path).as_matrix()[:, :d, :d]
    linear = to_rotation(given.quaternions).as_matrix()[:, :d, :d]
    stretches = np.swapaxes(linear, 1, 2) @ keys.linear
    columns = np.concatenate([stretches.reshape(m, -1), keys.translation], axis=1)
    between = cubic_interpolant(keys.times, columns)(times)
    along = turned @ between[:, : d * d].reshape(-1, d, d)
    values = np.concatenate([along.reshape(len(times), -1), between[:, d * d :]], axis=1)
    return cubic_interpolant(times, values)


def other_way(linear: np.ndarray, shares: np.ndarray) -> np.ndarray:
    """(N, d, d) from one linear part to another (2, d, d), at shares (N,) of the longer way; neither or both reflect.

    M₀ exp(s ω (1 − 2π/|ω|)) ((1 − s) S₀ + s S₁) with the polar factors M S and exp(ω) = M₀ᵀM₁.
    """
    d = linear.shape[1]
    (first, second), stretches, _ = polar_factors(linear)
    whole = np.eye(3)
    whole[:d, :d] = first.T @ second
    way = as_rotations(whole[None]).as_rotvec()[0]
    size = float(np.linalg.norm(way))
    if size > 0:
        way = way * (1 - 2 * np.pi / size)
    turns = to_rotation(exp(0.5 * shares[:, None] * way)).as_matrix()[:, :d, :d]
    s = shares[:, None, None]
    return first @ turns @ ((1 - s) * stretches[0] + s * stretches[1])


def _rotations(keys: Keyframes) -> np.ndarray | None:
    """(M, 4) the polar factors as quaternions, each with the sign that is nearer to the one before.

    Reflected keyframes are all reflected back; None where only some are.
    """
    d = keys.dimension
    factors, _, _ = polar_factors(keys.linear)
    mirrored = np.linalg.det(factors) < 0
    if mirrored.any():
        if not mirrored.all():
            return None
        factors = factors * np.r_[-1.0, np.ones(d - 1)]
    if d == 2:
        whole = np.tile(np.eye(3), (len(factors), 1, 1))
        whole[:, :2, :2] = factors
        factors = whole
    q = from_rotation(as_rotations(factors))
    # Half a turn apart both signs are as near, and one is as good as the other.
    nearer = np.where(np.sum(q[:-1] * q[1:], axis=1) < 0, -1.0, 1.0)
    return q * np.cumprod(np.r_[1.0, nearer])[:, None]
