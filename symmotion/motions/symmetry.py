"""Symmetry of a body: positions that look alike, and which of them lies nearest to its neighbours."""

from typing import TYPE_CHECKING, TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from symmotion.checks import numbers, told
from symmotion.errors import InputError
from symmotion.motions.quaternions.algebra import product

if TYPE_CHECKING:
    from scipy.spatial.transform import Rotation

# The rotations of the crystals' eleven Laue groups: SciPy's names by those of Hermann and Mauguin.
POINT_GROUPS = {
    "1": "C1", "2": "C2", "222": "D2", "4": "C4", "422": "D4", "3": "C3", "32": "D3", "6": "C6", "622": "D6", "23": "T",
    "432": "O",
}  # fmt: skip
Symmetry: TypeAlias = "str | Rotation | ArrayLike"
# How far a product of two rotations of a group may be from one of them.
CLOSED = 1e-6


def symmetry_group(symmetry: Symmetry) -> np.ndarray:
    """(K, 4) the unit quaternions of a group of rotations, the identity first.

    symmetry: a point group by Hermann and Mauguin's name ("432") or Schoenflies' ("O", "D6"), a SciPy `Rotation`, or
    quaternions (K, 4), scalar-first. Raises InputError for rotations that are no group.

    >>> len(sm.motions.symmetry_group("432"))
    24
    """
    from scipy.spatial.transform import Rotation  # here: see as_rotations

    group: Rotation
    if isinstance(symmetry, str):
        try:
            group = Rotation.create_group(POINT_GROUPS.get(symmetry, symmetry))
        except ValueError:
            raise InputError(f"symmetry {symmetry!r} is unknown; there are {', '.join(POINT_GROUPS)}") from None
    elif isinstance(symmetry, Rotation):
        group = symmetry
    else:
        given = numbers(symmetry, "symmetry")
        if given.ndim != 2 or given.shape[1] != 4 or not (np.linalg.norm(given, axis=1) > 0).all():
            raise InputError(f"symmetry {told(symmetry)}: a name, a Rotation or quaternions (K, 4) are needed")
        group = Rotation.from_quat(given[:, [1, 2, 3, 0]])
    q = np.atleast_2d(group.as_quat())[:, [3, 0, 1, 2]]
    q = q[np.argsort(-np.abs(q[:, 0]), kind="stable")]
    products = product(q[:, None], q).reshape(-1, 4)
    nearest = np.abs(products @ q.T).max(axis=1)
    if not (nearest > 1 - CLOSED).all() or abs(q[0, 0]) < 1 - CLOSED:
        raise InputError(f"symmetry: {len(q)} rotations that are no group: the product of two of them is none of them")
    return q


def reduced(real: np.ndarray, dual: np.ndarray, group: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Displacements (…, 4), (…, 4) D S with S of a group (K, 4), each the nearest to one before it along an axis.

    Lines along the last axis are gone through in order, those along the others from line to line by their first
    entries: what is joined by small turns comes out joined.
    """
    shape = real.shape[:-1]
    real, dual = real.copy(), dual.copy()
    for index in np.ndindex(*shape):
        axis = max((k for k, i in enumerate(index) if i), default=None)
        if axis is None:
            continue
        before = tuple(i - (k == axis) for k, i in enumerate(index))
        turned = product(real[index], group)
        best = int(np.argmax(np.abs(turned @ real[before])))
        real[index], dual[index] = turned[best], product(dual[index], group[best])
    return real, dual
