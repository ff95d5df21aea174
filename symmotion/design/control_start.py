"""Quaternion curves carried from one basis to another, as starts of programs, and read back from unknowns."""

import numpy as np

from symmotion.design.control_nodes import TURN, WAY, ControlSpace
from symmotion.motions.quaternions.algebra import conjugate, exp, product
from symmotion.motions.quaternions.curve import QuaternionMotion
from symmotion.splines import BSplineBasis


def carried(motion: QuaternionMotion, basis: BSplineBasis, pose: bool = False) -> tuple[QuaternionMotion, ControlSpace]:
    """A quaternion curve over another basis, to high order in the knot spacing; see `blossomed`."""
    controls, ways = blossomed(motion, basis), ways_between(motion, basis)
    # Along the chain signs are chosen to fit the ways; only where it closes one is left to read.
    cosine = np.sum(product(controls[:-1], exp(ways[1:])) * controls[1:], axis=1)
    controls = controls * np.concatenate([[1.0], np.cumprod(np.where(cosine < 0, -1.0, 1.0))])[:, None]
    back = float(product(controls[-1], exp(ways[0])) @ controls[0])
    space = ControlSpace(basis, pose, -1.0 if basis.periodic and back < 0 else 1.0)
    result = motion_of(space, np.concatenate([ways, controls], axis=1))
    # The first control of a closed curve lies before its beginning, from where the sign may differ.
    start = motion.domain[0]
    if result(start) @ motion(start) < 0:
        result = QuaternionMotion(basis, -result.control_points, result.increments)
    return result, space


def blossomed(motion: QuaternionMotion, basis: BSplineBasis) -> np.ndarray:
    """(n, 4) controls q_j = q(τ_j) exp(Ω̇ e_2/… + Ω̈ e_3/…) with τ_j the knot averages.

    e_2, e_3 are symmetric functions of the knots about τ_j: on a single axis that is the blossom, exact for cubics.
    """
    motion, basis = motion.about(basis.origin).relative, basis.relative
    p, where = basis.degree, basis.greville
    windows = np.lib.stride_tricks.sliding_window_view(basis.knots[1:-1], p)[: basis.n] - where[:, None]
    s2, s3 = (windows**2).sum(axis=1), (windows**3).sum(axis=1)
    # Newton's identities for deviations that sum to zero.
    e2, e3 = -s2 / 2, s3 / 3
    jet = motion.jet(_within(motion, where, basis.periodic), 3)
    pairs, triples = p * (p - 1) / 2, p * (p - 1) * (p - 2) / 6
    shift = jet.acceleration / 4 * (e2 / pairs)[:, None]
    if p > 2:
        shift += jet.jerk / 12 * (e3 / triples)[:, None]
    return product(jet.quaternion, exp(shift))


def ways_between(motion: QuaternionMotion, basis: BSplineBasis) -> np.ndarray:
    """(n, 3) half-angle vectors of the turns to the knot averages from those before, by the rate; zero to the first."""
    motion, basis = motion.about(basis.origin).relative, basis.relative
    where = basis.greville
    a, b = motion.domain
    nodes, weights = np.polynomial.legendre.leggauss(4)
    ends = np.append(where, where[:1] + (b - a)) if basis.periodic else where
    middle, half = (ends[1:] + ends[:-1]) / 2, np.diff(ends) / 2
    t = _within(motion, middle[:, None] + half[:, None] * nodes, basis.periodic)
    way = np.einsum("ekm,k,e->em", motion.rate(t), weights / 2, half)
    return np.roll(way, 1, axis=0) if basis.periodic else np.concatenate([np.zeros((1, 3)), way])


def _within(motion: QuaternionMotion, t: np.ndarray, periodic: bool) -> np.ndarray:
    """Times brought into the domain: around it, or to its ends."""
    a, b = motion.domain
    return a + (t - a) % (b - a) if periodic else np.clip(t, a, b)


def unknowns_of(motion: QuaternionMotion) -> np.ndarray:
    """(n, 7) increments and control quaternions of a curve, as in `WAY` and `TURN`."""
    q, ways = motion.control_points, motion.increments
    ways = np.roll(ways, 1, axis=0) if motion.basis.periodic else np.concatenate([np.zeros((1, 3)), ways])
    return np.concatenate([ways, q], axis=1)


def motion_of(space: ControlSpace, controls: np.ndarray) -> QuaternionMotion:
    """The curve of controls (n, 7 or more) in a space, of quaternions of any length and increments near theirs."""
    q = controls[:, TURN] / np.linalg.norm(controls[:, TURN], axis=1, keepdims=True)
    ways = controls[:, WAY]
    ratio = product(conjugate(np.roll(q, 1, axis=0)), q)
    # The constraint "increments" holds for −q_j as well, the same orientation: the curve follows the increments.
    ratio *= np.where(np.sum(ratio * exp(ways), axis=1) < 0, -1.0, 1.0)[:, None]
    ways = nearest(ratio, ways)
    ways = np.roll(ways, -1, axis=0) if space.basis.periodic else ways[1:]
    return QuaternionMotion(space.basis, q, ways)


def nearest(quaternions: np.ndarray, ways: np.ndarray) -> np.ndarray:
    """(n, 3) the logarithms of unit quaternions (n, 4) that are nearest to given ones (n, 3)."""
    sine, size = np.linalg.norm(quaternions[:, 1:], axis=1), np.linalg.norm(ways, axis=1)
    angle = np.arctan2(sine, quaternions[:, 0])
    # Whole turns have any axis.
    axis = (
        np.where((sine > 0)[:, None], quaternions[:, 1:], ways)
        / np.where(sine > 0, sine, np.where(size > 0, size, 1.0))[:, None]
    )
    turns = np.round((np.sum(axis * ways, axis=1) - angle) / (2 * np.pi))
    return axis * (angle + 2 * np.pi * turns)[:, None]
