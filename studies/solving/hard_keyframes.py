"""Seeded keyframe problems that are hard in one way each; what the study of robustness draws from."""

import numpy as np
from scipy.spatial.transform import Rotation

import symmotion as sm
from studies.solving.problem_set.problem import Problem

COUNTS = (3, 4, 5, 6, 8, 10, 12)
DEGREES = (3, 4, 5, 6, 7)
WIDE, OPPOSITE, SHEARED, SCALED, FAR = KINDS = (
    "turned by 30° to 180°",
    "turned by 180°",
    "turned and sheared",
    "sizes 1 to 1,000",
    "1e-3 apart at 1e6",
)


def problem(seed: int) -> Problem:
    """The problem of a seed; the kinds take turns, the rest is drawn.

    3 to 12 keyframes in the plane or in space at times 0, 1, …; degree 3 to 7 with one or two
    knots per segment; R or R*, in half of the problems with a trajectory energy beside it.
    """
    rng = np.random.default_rng(seed)
    kind = KINDS[seed % len(KINDS)]
    d, count, degree = int(rng.integers(2, 4)), int(rng.choice(COUNTS)), int(rng.choice(DEGREES))
    objective: sm.energies.Energy = sm.Rigidity(int(rng.integers(1, 3)))
    # Without E the translation is no part of the program, and its distance no difficulty.
    if rng.integers(2) or kind == FAR:
        points = np.concatenate([np.eye(d), -np.eye(d)])
        objective = objective + round(float(10.0 ** rng.uniform(-3, 0)), 4) * sm.TrajectoryEnergy(points)
    degrees = np.full(count, 180.0) if kind == OPPOSITE else rng.uniform(30, 180, count)
    linear, translation = _turned(rng, degrees, d), rng.normal(size=(count, d))
    if kind == SHEARED:
        linear = linear @ (np.eye(d) + 0.4 * rng.normal(size=(count, d, d)))
    elif kind == SCALED:
        linear = linear * 10.0 ** rng.uniform(0, 3, size=(count, 1, 1))
    elif kind == FAR:
        translation = 1e6 + 1e-3 * translation
    keys = sm.Keyframes(np.arange(count, dtype=float), linear, translation)
    refine = int(rng.integers(1, 3))
    program = sm.affine_program(keys, degree=degree, refine=refine, objective=objective)
    name = f"{seed}: {kind}, {d}D, {count} keyframes, degree {degree}, {refine} per segment, {objective.name}"
    return Problem(kind, name, program)


def _turned(rng: np.random.Generator, degrees: np.ndarray, d: int) -> np.ndarray:
    """(M, d, d) rotations, each turned against the one before by an angle about a random axis or to a random side."""
    if d == 2:
        return np.stack([sm.examples.rotation_2d(a) for a in np.cumsum(rng.choice([-1, 1], len(degrees)) * degrees)])
    axes = rng.normal(size=(len(degrees), 3))
    axes /= np.linalg.norm(axes, axis=1, keepdims=True)
    linear = Rotation.from_rotvec(np.deg2rad(degrees)[:, None] * axes).as_matrix()
    for i in range(1, len(linear)):
        linear[i] = linear[i - 1] @ linear[i]
    return linear
