"""Dual quaternions: rotations and translations as homogeneous coordinates, scalar-first."""

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from symmotion.checks import floats, held
from symmotion.errors import InputError
from symmotion.motions.position import Affine
from symmotion.motions.quaternions.algebra import conjugate, product
from symmotion.motions.rotations import as_rotations
from symmotion.motions.symmetry import Symmetry, reduced, symmetry_group
from symmotion.values import read_only, value

if TYPE_CHECKING:
    from scipy.spatial.transform import Rotation


def as_quaternion(vector: np.ndarray) -> np.ndarray:
    """(…, 4) vectors (…, 3) as quaternions without scalar part."""
    return np.concatenate([np.zeros((*vector.shape[:-1], 1)), vector], axis=-1)


@value
class DualQuaternions:
    """Displacements x ↦ Q x Q⁻¹ + d as pairs Q + ε Q⁰ with Q⁰ = ½ d Q (PCG (7), (8)).

    real: (…, 4) Q, scalar-first, of any norm but zero; dual: (…, 4) Q⁰, in units of length,
    zero when left out. A common factor of Q and Q⁰ changes nothing; the Plücker condition
    Q · Q⁰ = 0 need not hold.

    Raises InputError for other shapes and names the first entry that is zero or not finite.

    >>> from scipy.spatial.transform import Rotation
    >>> quarter = sm.motions.DualQuaternions.from_rotations(Rotation.from_euler("z", 90, degrees=True), [1, 0, 0])
    >>> quarter.translation
    array([1., 0., 0.])
    """

    real: np.ndarray
    # None only on the way in: zero is put in its place.
    dual: np.ndarray = None  # pyright: ignore[reportAssignmentType]

    def __post_init__(self):
        real = held(self.real, "quaternions")
        if real.ndim == 0 or real.shape[-1] != 4:
            raise InputError(f"quaternions of shape {real.shape}: (…, 4) is needed, scalar first")
        dual = np.zeros_like(real) if self.dual is None else held(self.dual, "dual parts")
        if dual.shape != real.shape:
            raise InputError(f"dual parts of shape {dual.shape}: {real.shape}, that of the real parts, is needed")
        for bad, word in (
            (~(np.isfinite(real) & np.isfinite(dual)).all(axis=-1), "is not finite"),
            ((real == 0).all(axis=-1), "is zero, which is no rotation"),
        ):
            if bad.any():
                raise InputError(f"quaternion {_place(bad)} {word}")
        object.__setattr__(self, "real", read_only(real))
        object.__setattr__(self, "dual", read_only(dual))

    def __repr__(self) -> str:
        kind = "spatial" if self.dual.any() else "spherical"
        return f"DualQuaternions({kind}, {' × '.join(map(str, self.shape)) or 'one'})"

    @staticmethod
    def of(real: ArrayLike, dual: ArrayLike | None) -> "DualQuaternions":
        """The pairs with these parts; no dual part is zero."""
        real = floats(real, "quaternions")
        return DualQuaternions(real) if dual is None else DualQuaternions(real, floats(dual, "dual parts"))

    @staticmethod
    def from_parts(
        real: ArrayLike, translation: ArrayLike | None = None, *, scalar_first: bool = True
    ) -> "DualQuaternions":
        """Rotations as quaternions (…, 4) of any norm with translations d (…, 3), zero when left out.

        scalar_first: whether the quaternions have their scalar part first or last.
        """
        real = floats(real, "quaternions")
        real = real if scalar_first or real.ndim == 0 else np.roll(real, 1, axis=-1)
        if translation is None:
            return DualQuaternions(real)
        d = floats(translation, "translations")
        if d.ndim == 0 or d.shape[-1] != 3 or d.shape[:-1] != real.shape[:-1]:
            raise InputError(f"translations of shape {d.shape}: {(*real.shape[:-1], 3)} is needed")
        return DualQuaternions(real, 0.5 * product(as_quaternion(d), real))

    @staticmethod
    def from_axis_angle(axis: ArrayLike, angle: ArrayLike, translation: ArrayLike | None = None) -> "DualQuaternions":
        """Rotations by an angle (…) in rad about an axis (…, 3) of any length, then translations (…, 3).

        Q = (cos θ/2, s sin θ/2), PCG (2). Raises InputError where an axis is zero.
        """
        axis, angle = floats(axis, "axes"), floats(angle, "angles")
        if axis.ndim == 0 or axis.shape[-1] != 3 or axis.shape[:-1] != angle.shape:
            raise InputError(f"axes of shape {axis.shape} for angles of shape {angle.shape}: (…, 3) and (…) are needed")
        lengths = np.linalg.norm(axis, axis=-1)
        if (lengths == 0).any():
            raise InputError(f"axis {_place(lengths == 0)} is zero")
        direction = axis / lengths[..., None]
        half = 0.5 * angle[..., None]
        real = np.concatenate([np.cos(half), np.sin(half) * direction], axis=-1)
        return DualQuaternions.from_parts(real, translation)

    @staticmethod
    def from_rotations(rotations: "Rotation", translation: ArrayLike | None = None) -> "DualQuaternions":
        """SciPy rotations, one or N, with translations (3,) or (N, 3)."""
        return DualQuaternions.from_parts(rotations.as_quat()[..., [3, 0, 1, 2]], translation)

    @staticmethod
    def from_matrices(linear: ArrayLike, translation: ArrayLike | None = None) -> "DualQuaternions":
        """Rotation matrices (…, 3, 3) with translations (…, 3), or (…, 4, 4) homogeneous matrices alone.

        Raises InputError that names the first matrix that is no rotation.
        """
        matrices = floats(linear, "matrices")
        if matrices.ndim >= 2 and matrices.shape[-2:] == (4, 4) and translation is None:
            if not (matrices[..., 3, :] == [0, 0, 0, 1]).all():
                raise InputError("homogeneous matrices must have 0, 0, 0, 1 as their last row")
            matrices, translation = matrices[..., :3, :3], matrices[..., :3, 3]
        if matrices.ndim < 2 or matrices.shape[-2:] != (3, 3):
            raise InputError(f"matrices of shape {matrices.shape}: (…, 3, 3), or (…, 4, 4) without translation")
        if not np.isfinite(matrices).all():
            raise InputError(f"matrix {_place(~np.isfinite(matrices).all(axis=(-1, -2)))} is not finite")
        real = as_rotations(matrices.reshape(-1, 3, 3)).as_quat()[:, [3, 0, 1, 2]]
        return DualQuaternions.from_parts(real.reshape(*matrices.shape[:-2], 4), translation)

    @property
    def shape(self) -> tuple[int, ...]:
        """The shape of the array of displacements."""
        return self.real.shape[:-1]

    @property
    def translation(self) -> np.ndarray:
        """(…, 3) d = (Q⁰Q* − QQ⁰*) / S², with S² = |Q|²: PCG (9), whose sign is lost in print."""
        products = product(self.dual, conjugate(self.real))
        return 2 * products[..., 1:] / np.sum(self.real**2, axis=-1, keepdims=True)

    @property
    def rotations(self) -> "Rotation":
        """The rotations as a SciPy object of all displacements in a row (one displacement: a single rotation)."""
        from scipy.spatial.transform import Rotation  # here: see as_rotations

        flat = self.real[..., [1, 2, 3, 0]]
        return Rotation.from_quat(flat if flat.ndim <= 2 else flat.reshape(-1, 4))

    @property
    def matrices(self) -> Affine:
        """Rotation matrices (…, 3, 3), PCG (4), and translations (…, 3)."""
        return Affine(self.rotations.as_matrix().reshape(*self.shape, 3, 3), self.translation)

    @property
    def plucker(self) -> np.ndarray:
        """(…) Q · Q⁰ / S², zero for proper displacements (PCG (10))."""
        return np.sum(self.real * self.dual, axis=-1) / np.sum(self.real**2, axis=-1)

    def __matmul__(self, other: "DualQuaternions") -> "DualQuaternions":
        """The displacement `other` followed by this one: (P + εP⁰)(Q + εQ⁰), broadcast."""
        real = product(self.real, other.real)
        return DualQuaternions(real, product(self.real, other.dual) + product(self.dual, other.real))

    def seen_from(
        self, fixed: "DualQuaternions | None" = None, moving: "DualQuaternions | None" = None
    ) -> "DualQuaternions":
        """The same displacements in other frames, F D M⁻¹.

        fixed: F takes coordinates in the old fixed frame to those in the new one; moving: M the
        same for the frame of the body. The identity when left out.
        """
        result = self if fixed is None else fixed @ self
        return result if moving is None else result @ moving.inverse()

    def inverse(self) -> "DualQuaternions":
        """The inverse displacements x ↦ Q⁻¹ (x − d) Q, as pairs of the same norm."""
        back = conjugate(self.real)
        return DualQuaternions(back, -0.5 * product(back, as_quaternion(self.translation)))

    def aligned(self, symmetry: "Symmetry | None" = None) -> "DualQuaternions":
        """The same displacements with neighbours along every axis in one hemisphere, Q · Q' ≥ 0.

        symmetry: the rotations of the body that leave it as it is, of a crystal those of its point group ("432",
        "O", …, a SciPy `Rotation` or quaternions): of each displacement D S the one nearest to its neighbours.

        Raises InputError that names two neighbours where no choice of signs does that: the
        displacements around a cell turn too far for what lies between them to be clear.
        """
        if symmetry is not None:
            turned = reduced(self.real, self.dual, symmetry_group(symmetry))
            return DualQuaternions(*turned).aligned()
        signs, axes = np.ones(self.shape), len(self.shape)
        for axis in reversed(range(axes)):
            # Lines along the last axis first; along the others, whole slices follow their first entries.
            first = (self.real * signs[..., None])[(slice(None),) * (axis + 1) + (0,) * (axes - 1 - axis)]
            opposed = np.sum(first[..., 1:, :] * first[..., :-1, :], axis=-1) < 0
            flips = np.cumprod(np.where(opposed, -1.0, 1.0), axis=-1)
            flips = np.concatenate([np.ones((*flips.shape[:-1], 1)), flips], axis=-1)
            signs = signs * flips.reshape(flips.shape + (1,) * (axes - 1 - axis))
        aligned = DualQuaternions(self.real * signs[..., None], self.dual * signs[..., None])
        aligned.require_aligned()
        return aligned

    def require_aligned(self) -> None:
        """Raise InputError that names the first two neighbours in different hemispheres, Q · Q' < 0."""
        for axis in range(len(self.shape)):
            lines = np.moveaxis(self.real, axis, 0)
            opposed = np.moveaxis(np.sum(lines[1:] * lines[:-1], axis=-1) < 0, 0, axis)
            if opposed.any():
                one = np.argwhere(opposed)[0]
                other = one + (np.arange(len(one)) == axis)
                raise InputError(
                    f"quaternions {_name(one)} and {_name(other)} are in different hemispheres: align the net, and "
                    "where that cannot help, since it turns too far around a cell, give more displacements; where they "
                    "are orientations of crystals, their symmetry is the likely cause: give it"
                )


def _place(bad: ArrayLike) -> str:
    """The index of the first True, as text."""
    return _name(np.argwhere(bad)[0])


def _name(index: np.ndarray) -> str:
    return "(" + ", ".join(str(int(i)) for i in index) + ")" if len(index) != 1 else str(int(index[0]))
