"""A body that swings, noise put on it, and how far from the truth motions are."""

import numpy as np
from scipy.spatial.transform import Rotation

import symmotion as sm
from symmotion.motions import orthonormalise

PLACE, TURN = 0.005, 0.01


def swing(count: int) -> sm.Keyframes:
    """A body that swings along a curve."""
    t = np.linspace(0.0, 6.0, count)
    turns = Rotation.from_rotvec(np.stack([np.sin(t), 0.5 * np.cos(1.3 * t), 0.3 * t], axis=1))
    return sm.Keyframes(t, turns.as_matrix(), np.stack([np.cos(t), np.sin(0.7 * t), 0.2 * t], axis=1))


def noisy(truth: sm.Keyframes, seed: int, sizes: tuple[float, float] = (PLACE, TURN)) -> sm.Keyframes:
    rng = np.random.default_rng(seed)
    turned = truth.rotations() * Rotation.from_rotvec(rng.normal(size=(len(truth), 3)) * sizes[1])
    places = truth.translation + rng.normal(size=(len(truth), 3)) * sizes[0]
    return sm.Keyframes(truth.times, turned.as_matrix(), places)


def deviations(truth: sm.Keyframes, turns: Rotation, places: np.ndarray) -> np.ndarray:
    """Root mean square distance, and angle in rad."""
    angle = (truth.rotations(1e-3).inv() * turns).magnitude()
    return np.sqrt([((places - truth.translation) ** 2).sum(axis=1).mean(), (angle**2).mean()])


def of_motion(truth: sm.Keyframes, motion) -> np.ndarray:
    turns = Rotation.from_matrix(orthonormalise(motion, truth.times).rotations)
    return deviations(truth, turns, motion(truth.times).translation)
