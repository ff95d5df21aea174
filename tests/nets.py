"""Nets with keyframes near them, for the tests of fairing."""

from typing import Any

import numpy as np

from symmotion.motions import Affine, DualQuaternions, TwoParameterMotion


def keyframes_near(
    motion: TwoParameterMotion, count: int, *, turn: float = 0.02, move: float = 0.05, seed: int = 0
) -> list[tuple[Any, Affine]]:
    """Displacements a little away from a motion at random parameters."""
    rng, (u, v) = np.random.default_rng(seed), motion.domain
    found = []
    for _ in range(count):
        at = float(rng.uniform(u[0], u[1])), float(rng.uniform(v[0], v[1]))
        there = motion(*at)
        place = np.zeros(3) if motion.spherical else there.translation + move * rng.normal(size=3)
        near = DualQuaternions.from_matrices(there.linear) @ DualQuaternions.from_axis_angle(rng.normal(size=3), turn)
        found.append((at, Affine(near.matrices.linear, place)))
    return found


def missed(motion: TwoParameterMotion, keyframes: list[tuple[Any, Affine]]) -> float:
    """How far the motion is from keyframes, entry by entry of matrices and places."""
    errors = [motion(*at).linear - k.linear for at, k in keyframes]
    errors += [motion(*at).translation - k.translation for at, k in keyframes]
    return float(max(np.abs(e).max() for e in errors))
