"""Quaternion curves carried from one basis to another, as starts of programs, and read back from unknowns."""

import numpy as np

from symmotion.design.control_nodes import ControlSpace
from symmotion.motions.quaternions.algebra import exp, product
from symmotion.motions.quaternions.curve import QuaternionMotion
from symmotion.splines import BSplineBasis


def carried(motion: QuaternionMotion, basis: BSplineBasis, channels: int = 4) -> tuple[QuaternionMotion, ControlSpace]:
    """A quaternion curve over another basis, to high order in the knot spacing: q_j = q(τ_j) exp(Ω̇ e_2/…  + Ω̈ e_3/…).

    τ_j is the knot average; e_2, e_3 are symmetric functions of the knots about it: on a single
    axis that is the blossom, exact for cubics.
    """
    where = basis.greville
    p = basis.degree
    windows = np.lib.stride_tricks.sliding_window_view(basis.knots[1:-1], p)[: basis.n] - where[:, None]
    s2, s3 = (windows**2).sum(axis=1), (windows**3).sum(axis=1)
    # Newton's identities for deviations that sum to zero.
    e2, e3 = -s2 / 2, s3 / 3
    at = where
    a, b = motion.domain
    if basis.periodic:
        at = a + (where - a) % (b - a)
    jet = motion.jet(np.clip(at, a, b), 3)
    pairs, triples = p * (p - 1) / 2, p * (p - 1) * (p - 2) / 6
    shift = jet.acceleration / 4 * (e2 / pairs)[:, None]
    if p > 2:
        shift += jet.jerk / 12 * (e3 / triples)[:, None]
    controls = product(jet.quaternion, exp(shift))
    # The turn between knot averages, from the rate: it chooses the branch of the logarithm.
    nodes, weights = np.polynomial.legendre.leggauss(4)
    ends = np.append(where, where[:1] + (b - a)) if basis.periodic else where
    middle, half = (ends[1:] + ends[:-1]) / 2, np.diff(ends) / 2
    t = middle[:, None] + half[:, None] * nodes
    t = a + (t - a) % (b - a) if basis.periodic else np.clip(t, a, b)
    way = np.einsum("ekm,k,e->em", motion.rate(t), weights / 2, half)
    ways = np.zeros((basis.n, 3))
    if basis.periodic:
        ways = np.roll(way, 1, axis=0)
    else:
        ways[1:] = way
    cosine = np.sum(product(controls[:-1], exp(ways[1:])) * controls[1:], axis=1)
    controls = controls * np.concatenate([[1.0], np.cumprod(np.where(cosine < 0, -1.0, 1.0))])[:, None]
    space = ControlSpace.of(basis, controls, ways, channels)
    result = motion_of(space, controls)
    # The first control of a closed curve lies before its beginning, from where the sign may differ.
    if result(a) @ motion(a) < 0:
        result = QuaternionMotion(basis, -result.control_points, result.increments)
    return result, space


def motion_of(space: ControlSpace, controls: np.ndarray) -> QuaternionMotion:
    """The curve of control quaternions (n, 4) of any length in a space."""
    q = controls / np.linalg.norm(controls, axis=1, keepdims=True)
    ways = space.increments(q)
    ways = np.roll(ways, -1, axis=0) if space.basis.periodic else ways[1:]
    return QuaternionMotion(space.basis, q, ways)
