"""Random unit quaternions for tests."""

import numpy as np

from symmotion.motions.quaternions.algebra import exp, product

AXIS = np.array([1.0, 2.0, 2.0]) / 3


def units(count, seed=0, angle=None):
    """Random unit quaternions, or a chain of turns by `angle` (rad) about random axes."""
    rng = np.random.default_rng(seed)
    if angle is None:
        q = rng.normal(size=(count, 4))
        return q / np.linalg.norm(q, axis=1, keepdims=True)
    chain = [units(1, seed)[0]]
    for _ in range(count - 1):
        axis = rng.normal(size=3)
        chain.append(product(chain[-1], exp(angle / 2 * axis / np.linalg.norm(axis))))
    return np.array(chain)
