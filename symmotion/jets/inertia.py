"""The inertia of a body: which matrices are one."""

import numpy as np
from numpy.typing import ArrayLike

from symmotion import checks
from symmotion.errors import InputError

# Of a plate one moment is the sum of the others, up to the digits that are told.
PLATE = 1e-6


def as_inertia(inertia: ArrayLike | None) -> np.ndarray:
    """(3, 3) the inertia from a matrix, principal moments (3,) or None; InputError unless a body can have it.

    >>> sm.energies.as_inertia([1.0, 2.0, 2.5])
    array([[1. , 0. , 0. ],
           [0. , 2. , 0. ],
           [0. , 0. , 2.5]])
    """
    if inertia is None:
        return np.eye(3)
    moments = checks.numbers(inertia, "inertia")
    moments = np.diag(moments) if moments.shape == (3,) else moments
    if moments.shape != (3, 3) or not np.isfinite(moments).all():
        raise InputError(f"inertia of shape {np.shape(inertia)}: finite, (3, 3) or (3,), is needed")
    if not np.allclose(moments, moments.T, rtol=1e-9, atol=0):
        raise InputError("inertia must be symmetric")
    least, middle, largest = np.linalg.eigvalsh(moments)
    if least <= 1e-12 * max(largest, 0.0) or largest <= 0:
        raise InputError(
            f"inertia is singular or not positive (least moment {least:.3g}): a body needs extent about every axis"
        )
    if largest > (1 + PLATE) * (least + middle):
        raise InputError(
            f"inertia of moments {least:.6g}, {middle:.6g} and {largest:.6g}: no body has one that exceeds the sum of "
            "the other two"
        )
    return moments
