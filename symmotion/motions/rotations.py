"""Rotations as they come in: matrices, quaternions, SciPy's `Rotation`; checked, as the one that is wanted."""

from typing import TYPE_CHECKING, TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from symmotion.checks import floats, numbers, positive
from symmotion.errors import InputError

if TYPE_CHECKING:
    from scipy.spatial.transform import Rotation

    Rotations: TypeAlias = ArrayLike | Rotation

UNIT_TOLERANCE = 1e-6
# A length that differs from 1 by less is rounding: dividing by it would only change the last bit, each time.
ROUNDING = 8 * np.finfo(float).eps


def as_rotations(linear: np.ndarray, tolerance: float = 1e-6) -> "Rotation":
    """(N, 3, 3) rotation matrices as a SciPy `Rotation`; InputError names the first that is none.

    tolerance: by how much ‖AᵀA − I‖ may differ from zero.

    linear: (N, 3, 3), orthogonal and of determinant 1.

    >>> sm.motions.as_rotations(np.eye(3)[None]).as_quat(scalar_first=True)
    array([[1., 0., 0., 0.]])
    """
    from scipy.spatial.transform import Rotation  # here, since it is a fifth of the time of `import symmotion`

    if linear.shape[-1] != 3:
        raise InputError("a rotation as a quaternion needs three dimensions")
    error = np.abs(linear.transpose(0, 2, 1) @ linear - np.eye(3)).max(axis=(1, 2))
    if (error > tolerance).any():
        i = int(np.argmax(error > tolerance))
        raise InputError(
            f"position {i} is not rigid: its linear part differs from an orthogonal matrix by {error[i]:.2g} "
            f"(tolerance {tolerance:g})"
        )
    if (np.linalg.det(linear) < 0).any():
        i = int(np.argmax(np.linalg.det(linear) < 0))
        raise InputError(f"position {i} is reflected (determinant −1): it is no rotation")
    return Rotation.from_matrix(np.array(linear))  # a copy: older SciPy takes no read-only arrays


def from_rotation(rotation: "Rotation") -> np.ndarray:
    """Scalar-first unit quaternions (…, 4) of a SciPy `Rotation`.

    rotation: one, or an array of them.

    >>> from scipy.spatial.transform import Rotation
    >>> sm.quaternions.from_rotation(Rotation.from_rotvec([0, 0, np.pi])).round(9)
    array([0., 0., 0., 1.])
    """
    return np.roll(np.asarray(rotation.as_quat()), 1, axis=-1)


def to_rotation(q: ArrayLike) -> "Rotation":
    """The SciPy `Rotation` of scalar-first unit quaternions (…, 4).

    q: scalar first; lengths are divided out.

    Raises InputError for numbers that are not real.

    >>> sm.quaternions.to_rotation([[1.0, 0.0, 0.0, 0.0]]).as_rotvec()
    array([[0., 0., 0.]])
    """
    from scipy.spatial.transform import Rotation  # here, since it is a fifth of the time of `import symmotion`

    q = floats(q, "quaternions")
    return Rotation.from_quat(np.roll(q, -1, axis=-1).reshape(-1, 4) if q.ndim > 2 else np.roll(q, -1, axis=-1))


def as_quaternions(
    values: "Rotations",
    what: str = "quaternion",
    least: int = 1,
    *,
    scalar_first: bool = True,
    norms: float | None = None,
) -> np.ndarray:
    """(M, 4) unit quaternions, scalar first, from such an array, rotation matrices (M, 3, 3) or a SciPy `Rotation`.

    They are normalised to rounding. scalar_first: whether an array (M, 4) has its scalar part first or last.

    norms: how far their lengths may be from 1, 1e-6 when left out.

    Raises InputError that names the first that is not finite, zero, or of another length.
    """
    turning = getattr(values, "rotation", values)  # of a RigidTransform
    if hasattr(turning, "as_quat"):
        turning, scalar_first = from_rotation(turning), True
    q = numbers(turning, f"{what}s")
    if q.ndim == 3 and q.shape[1:] == (3, 3):
        q, scalar_first = from_rotation(as_rotations(q)), True
    if q.ndim != 2 or q.shape[1] != 4:
        raise InputError(f"{what}s of shape {q.shape}: (M, 4), scalar first, is needed")
    q = q if scalar_first else np.roll(q, 1, axis=1)
    if len(q) < least:
        raise InputError(f"{len(q)} {what}{'s' * (len(q) != 1)} are too few: at least {least} are needed")
    if not np.isfinite(q).all():
        raise InputError(f"{what} {int(np.argmin(np.isfinite(q).all(axis=1)))} is not finite")
    size = np.linalg.norm(q, axis=1)
    tolerance = UNIT_TOLERANCE if norms is None else positive(norms, "norms")
    wrong = (np.abs(size - 1) > tolerance) | (size < UNIT_TOLERANCE)
    if wrong.any():
        i = int(np.argmax(wrong))
        if size[i] < UNIT_TOLERANCE:
            raise InputError(f"{what} {i} is zero: it is no orientation")
        raise InputError(
            f"{what} {i} has length {size[i]:.9g}, not 1 (tolerance {tolerance:g}): check that its scalar part comes "
            "first, and divide it by its length, or allow for it with norms="
        )
    return q / np.where(np.abs(size - 1) <= ROUNDING, 1.0, size)[:, None]
