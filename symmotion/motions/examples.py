"""Example keyframes made by the project, for first steps, studies and tests."""

import numpy as np

from symmotion.errors import InputError
from symmotion.motions.keyframes import Keyframes


def rotation_2d(degrees: float) -> np.ndarray:
    """(2, 2) the planar rotation by an angle in degrees."""
    c, s = np.cos(np.deg2rad(degrees)), np.sin(np.deg2rad(degrees))
    return np.array([[c, -s], [s, c]])


def quarter_turn() -> Keyframes:
    """Two planar keyframes at times 0 and 1, the second turned by 90°: orthogonal, as in HJK figure 1."""
    linear = np.stack([np.eye(2), rotation_2d(90)])
    return Keyframes(np.array([0.0, 1.0]), linear, np.array([[0.0, 0.0], [3.0, 0.0]]))


def sheared_turn() -> Keyframes:
    """Two planar keyframes at times 0 and 1, the first sheared and stretched: general, as in HJK figure 2."""
    linear = np.stack([[[1.2, 0.5], [0.0, 0.8]], rotation_2d(80) * 0.9])
    return Keyframes(np.array([0.0, 1.0]), linear, np.array([[0.0, 0.0], [3.0, 0.5]]))


def planar_keyframes() -> Keyframes:
    """Four affine positions in the plane with growing turn and changing size, as in HJK figure 3."""
    sizes = ([1.0, 1.0], [1.4, 0.8], [0.8, 1.3], [1.1, 0.9])
    linear = [rotation_2d(angle) @ np.diag(size) for angle, size in zip((0, 70, 150, 240), sizes, strict=True)]
    return Keyframes.parametrised(linear, [[0.0, 0.0], [4.0, 2.5], [8.5, 2.0], [12.0, -1.0]], "centripetal")


def spatial_keyframes() -> Keyframes:
    """Four affine positions in space without shear, for an ellipsoid, as in HJK figure 4."""
    from scipy.spatial.transform import Rotation  # here: see as_rotations

    turns = Rotation.from_euler("ZYX", [[0, 0, 0], [60, 30, 10], [110, -20, 70], [190, 25, 95]], degrees=True)
    sizes = np.array([[1.0, 1.0, 1.0], [1.3, 0.8, 1.0], [0.9, 1.2, 0.8], [1.0, 0.9, 1.2]])
    linear = turns.as_matrix() * sizes[:, None, :]
    translation = [[0.0, 0.0, 0.0], [3.0, 2.0, 1.0], [6.5, 1.0, 2.5], [10.0, 2.5, 1.0]]
    return Keyframes.parametrised(linear, translation, "centripetal")


def uneven_turns() -> Keyframes:
    """Seven planar keyframes at times 0 to 6 that hardly turn, but for two quick turns between them."""
    angles = (0, 5, 10, 120, 125, 130, 280)
    path = np.column_stack([np.arange(7.0), np.zeros(7)])
    return Keyframes(np.arange(7.0), np.stack([rotation_2d(a) for a in angles]), path)


def random_keyframes(count: int, angle: float, seed: int) -> Keyframes:
    """Rigid keyframes in space, each turned against the one before by `angle` degrees about a random axis.

    Times 0, 1, …, count − 1; translations are normally distributed about the origin.
    """
    from scipy.spatial.transform import Rotation  # here: see as_rotations

    if count < 2:
        raise InputError(f"{count} random keyframes: at least 2 are needed")
    rng = np.random.default_rng(seed)
    axes = rng.normal(size=(count, 3))
    axes /= np.linalg.norm(axes, axis=1, keepdims=True)
    steps = Rotation.from_rotvec(np.deg2rad(angle) * axes).as_matrix()
    linear = np.empty((count, 3, 3))
    linear[0] = Rotation.from_rotvec(rng.uniform(0, np.pi) * axes[0]).as_matrix()
    for i in range(1, count):
        linear[i] = linear[i - 1] @ steps[i]
    return Keyframes(np.arange(count, dtype=float), linear, rng.normal(size=(count, 3)))


def recorded_tour(count: int = 601, seed: int = 7, noise: float = 1.0) -> Keyframes:
    """A made-up recording of `count` rigid poses, 20 s: a camera circles a table, looks around and trembles.

    noise: times 1 mm and 2 mrad (standard deviation per axis), independent from pose to pose; 0 gives the truth.
    """
    from scipy.spatial.transform import Rotation  # here: see as_rotations

    t = np.linspace(0.0, 20.0, count)
    rng = np.random.default_rng(seed)
    angles = [0.35 * t, 0.3 * np.sin(0.9 * t), 0.2 * np.sin(0.55 * t + 1.0)]
    rotations = Rotation.from_euler("ZYX", np.transpose(angles)) * Rotation.from_rotvec(
        2e-3 * noise * rng.normal(size=(count, 3))
    )
    translation = np.column_stack([np.cos(0.35 * t), np.sin(0.35 * t), 0.6 + 0.2 * np.sin(0.7 * t)])
    return Keyframes.from_rotations(t, rotations, translation + 1e-3 * noise * rng.normal(size=(count, 3)))
