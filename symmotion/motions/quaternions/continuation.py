"""Newton's method for curves through keyframes, and a path to them from keyframes that are all alike.

Source of the path: Allgower and Georg 1990 (pseudo-arclength continuation).
"""

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import SuperLU, splu

from symmotion.motions.quaternions.passing import Passing, Point

# The first step along the path, and the shortest one; how it grows and shrinks.
STEP, SHORTEST, GROWTH, FALL = 0.1, 1e-7, 1.6, 1 / 3
# Cosine of the turn between tangents that is too much for a step, and the one up to which steps grow.
TURNED, STRAIGHT = 0.7, 0.95
# Corrections after a step, those up to which steps grow, and what is missed by then, in rad.
CORRECTIONS, EASY, NEAR = 4, 2, 2e-8


def newton(system: Passing, point: Point, tolerance: float, most: int) -> tuple[Point, float, int]:
    """Newton's method with step control: the point, what it misses by in rad, the steps taken."""
    residual = system.residual(point)
    for taken in range(most):
        size, miss = np.linalg.norm(residual), system.miss(residual)
        if miss <= 1e-3 * tolerance:
            return point, miss, taken
        try:
            step = splu(system.jacobian(point)).solve(-residual)
        except RuntimeError:  # singular
            return point, miss, taken + 1
        length = 1.0
        while True:
            moved = system.moved(point, length * step)
            fresh = system.residual(moved)
            if np.linalg.norm(fresh) <= (1 - 1e-4 * length) * size or length < 0.05:
                break
            length /= 2
        if np.linalg.norm(fresh) >= size:
            # At the rounding level the norm no longer falls.
            return point, miss, taken + 1
        point, residual = moved, fresh
    return point, system.miss(residual), most


def followed(system: Passing, tolerance: float, most: int) -> tuple[Point, float]:
    """The curve at the end of the path along which the ways between keyframes grow from nothing to their length.

    The path is followed by its length: the share of the ways may fall for a while where it turns back. It ends at the
    keyframes unless it leads to infinity. most: factorisations; returns the point, and what it misses by in rad.
    """
    point, share, length = system.start(), 0.0, STEP
    system.shorten(share)
    size = 3 * (len(point[0]) + len(point[1]))
    # The share counts as much as the root mean square of all turns and increments.
    scale = np.append(np.full(size, size**-0.5), 1.0)
    upward = np.append(np.zeros(size), 1.0)
    tangent = _unit(_bordered(system, point, upward).solve(upward), scale)
    used = 1
    while used < most and length > SHORTEST:
        if share + length * tangent[-1] >= 1.0:
            system.shorten(1.0)
            last = system.moved(point, (1.0 - share) / tangent[-1] * tangent[:-1])
            last, miss, taken = newton(system, last, tolerance, 8)
            used += taken
            if miss <= tolerance:
                return last, miss
            length *= FALL
            continue
        row = scale**2 * tangent
        fresh, there = system.moved(point, length * tangent[:-1]), share + length * tangent[-1]
        try:
            fresh, there, corrections = _corrected(system, fresh, there, row, scale, length)
            ahead = None if corrections < 0 else _unit(_bordered(system, fresh, row).solve(upward), scale)
        except RuntimeError:  # singular, where paths cross
            corrections, ahead = 0, None
        used += abs(corrections) + 1
        if ahead is None:
            length *= FALL
            continue
        cosine = float((scale * ahead) @ (scale * tangent))
        if cosine < TURNED:
            length *= FALL
            continue
        point, share, tangent = fresh, there, ahead
        if corrections <= EASY and cosine > STRAIGHT:
            length *= GROWTH
    system.shorten(1.0)
    return point, system.miss(system.residual(point))


def _corrected(
    system: Passing, point: Point, share: float, row: np.ndarray, scale: np.ndarray, length: float
) -> tuple[Point, float, int]:
    """The point and share on the path across from a guess, and the factorisations; fewer than none where it is lost."""
    first = np.inf
    for k in range(CORRECTIONS + 1):
        system.shorten(share)
        residual = system.residual(point)
        miss = system.miss(residual)
        if miss < NEAR:
            return point, share, k
        if miss > 2 * first or k == CORRECTIONS:
            break
        first = min(first, miss)
        step = _bordered(system, point, row).solve(np.append(-residual, 0.0))
        if np.linalg.norm(scale * step) > length:
            break
        point, share = system.moved(point, step[:-1]), share + step[-1]
    return point, share, -CORRECTIONS


def _bordered(system: Passing, point: Point, row: np.ndarray) -> SuperLU:
    """The Jacobian by the unknowns and the share, with a row below."""
    drift = sparse.csc_array(system.drift(point)[:, None])
    below = [sparse.csr_array(row[None, :-1]), sparse.csr_array(row[None, -1:])]
    return splu(sparse.csc_array(sparse.block_array([[system.jacobian(point), drift], below])))


def _unit(tangent: np.ndarray, scale: np.ndarray) -> np.ndarray:
    return tangent / np.linalg.norm(scale * tangent)
