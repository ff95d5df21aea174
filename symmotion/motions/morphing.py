"""Affine keyframes out of affine copies of a shape, to morph the copies into each other (HJK 2.3, application 1)."""

import numpy as np
from numpy.typing import ArrayLike

from symmotion.checks import numbers
from symmotion.errors import InputError
from symmotion.motions.keyframes import Keyframes
from symmotion.splines import check_times

# Smallest over largest singular value, below which a shape or a copy counts as flat.
FLAT = 1e-9


def keyframes_from_copies(
    shape: ArrayLike,
    copies: ArrayLike,
    *,
    times: ArrayLike | None = None,
    method: str = "centripetal",
    rigid: bool = False,
) -> Keyframes:
    """The affine keyframes that carry a shape closest to its copies: least Σ_p ‖v_i + A_i p − copy_i(p)‖².

    shape: (P, d) its points (of a polygon, or the control points of a Bézier outline), P ≥ d + 1;
    copies: (M, P, d) the same points in each copy.
    times: (M,), or by `method` over 0 to 1 with the shape's points as body points (HJK 2.2).
    rigid: of the rotations only, without reflections (Kabsch 1976); in space the shape may then lie in a plane.

    Raises InputError where the shape is flat, where a copy is (naming it), where a copy leaves the rotation open, and
    where shapes do not match. `copy_deviations` says how far from affine the copies are.

    >>> shape = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
    >>> sm.motions.keyframes_from_copies(shape, [shape, 2 * shape + 1]).linear[1].round(9) + 0.0
    array([[2., 0.],
           [0., 2.]])
    """
    shape, copies = _check(shape, copies, rigid)
    if rigid:
        return _keyframes(*_rotated(shape, copies), shape, times, method)
    homogeneous = np.column_stack([shape, np.ones(len(shape))])
    maps = np.stack([np.linalg.lstsq(homogeneous, copy)[0] for copy in copies])
    linear, translation = np.swapaxes(maps[:, :-1], 1, 2), maps[:, -1]
    # Of the points, not of the matrix alone: a copy may be small, but not thin beside its own extent.
    sizes = np.linalg.svd((shape - shape.mean(axis=0)) @ np.swapaxes(linear, 1, 2), compute_uv=False)
    flat = sizes[:, -1] <= FLAT * sizes[:, 0]
    if flat.any():
        i = int(np.argmax(flat))
        raise InputError(f"copy {i} is flat: its points lie in a line or plane, no motion through it keeps the shape")
    return _keyframes(linear, translation, shape, times, method)


def _rotated(shape: np.ndarray, copies: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Rotations (M, d, d) and translations (M, d): of Σ_p (copy(p) − mean)(p − mean)ᵀ = U Σ Vᵀ, U diag(1, …, ±1) Vᵀ."""
    middles = copies.mean(axis=1)
    spread = np.einsum("mpi,pj->mij", copies - middles[:, None], shape - shape.mean(axis=0))
    left, sizes, right = np.linalg.svd(spread)
    sign = np.sign(np.linalg.det(left @ right))
    # Where the two smallest, the last with its sign, add up to nothing, any turn about an axis is as close.
    open_ = sizes[:, -2] + sign * sizes[:, -1] <= FLAT * sizes[:, 0]
    if open_.any():
        i = int(np.argmax(open_))
        raise InputError(f"copy {i} leaves the rotation open: its points lie in a line, or mirror the shape")
    right[:, -1] *= sign[:, None]
    rotations = left @ right
    return rotations, middles - rotations @ shape.mean(axis=0)


def _keyframes(
    linear: np.ndarray, translation: np.ndarray, shape: np.ndarray, times: ArrayLike | None, method: str
) -> Keyframes:
    if times is None:
        return Keyframes.parametrised(linear, translation, method, shape)
    return Keyframes(check_times(times), linear, translation)


def copy_deviations(keyframes: Keyframes, shape: ArrayLike, copies: ArrayLike) -> np.ndarray:
    """(M,) root mean square distance of each copy's points from the shape as the keyframe carries it.

    keyframes: M; copies: (M, P, d). Raises InputError for shapes that do not go together.

    >>> shape = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
    >>> keys = sm.motions.keyframes_from_copies(shape, [shape, 2 * shape])
    >>> sm.motions.copy_deviations(keys, shape, [shape, 2 * shape]).round(9)
    array([0., 0.])
    """
    shape, copies = _check(shape, copies, rigid=True)
    if len(copies) != len(keyframes) or shape.shape[1] != keyframes.dimension:
        raise InputError(f"{len(copies)} copies in {shape.shape[1]}D for {keyframes!r}")
    carried = keyframes.translation[:, None] + shape @ np.swapaxes(keyframes.linear, 1, 2)
    return np.sqrt(((carried - copies) ** 2).sum(axis=2).mean(axis=1))


def _check(shape: ArrayLike, copies: ArrayLike, rigid: bool = False) -> tuple[np.ndarray, np.ndarray]:
    shape, copies = numbers(shape, "shape"), numbers(copies, "copies")
    if shape.ndim != 2 or shape.shape[1] not in (2, 3) or not np.isfinite(shape).all():
        raise InputError(f"a shape of {shape.shape}: finite points (P, 2) or (P, 3) are needed")
    if copies.ndim != 3 or copies.shape[1:] != shape.shape:
        raise InputError(f"copies of shape {copies.shape}: (M, {shape.shape[0]}, {shape.shape[1]}) is needed")
    finite = np.isfinite(copies).all(axis=(1, 2))
    if not finite.all():
        raise InputError(f"copy {int(np.argmin(finite))} has a point that is not finite")
    sizes = np.linalg.svd(shape - shape.mean(axis=0), compute_uv=False)
    needed = shape.shape[1] - rigid  # a reflection is no rotation
    if len(shape) <= needed or sizes[needed - 1] <= FLAT * sizes[0]:
        where = "one place" if needed == 1 else "a line" if rigid else "a line or plane"
        kind = "a rotation" if rigid else "an affine map"
        raise InputError(f"the shape's {len(shape)} points lie in {where}: they do not fix {kind}")
    return shape, copies
