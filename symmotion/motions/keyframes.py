"""Keyframes: the affine positions that a motion has to take, and when."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from symmotion.errors import InputError
from symmotion.motions.pictures import as_html
from symmotion.splines import check_times

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from scipy.spatial.transform import Rotation

    from symmotion.bodies.outlines import Body

PARAMETRISATIONS = ("uniform", "chordal", "centripetal")


@dataclass(frozen=True, eq=False)
class Keyframes:
    """M affine positions x ↦ v_i + A_i x at times t_i, in dimension d = 2 or 3.

    times: (M,) increasing, M ≥ 2; linear: (M, d, d), row = output coordinate; translation:
    (M, d), zero when left out. Raises InputError that names the keyframe at fault.
    """

    times: np.ndarray
    linear: np.ndarray
    # None only on the way in: zero is put in its place.
    translation: np.ndarray = None  # pyright: ignore[reportAssignmentType]

    def __post_init__(self):
        linear, translation = _check_positions(self.linear, self.translation)
        times = np.array(check_times(self.times))
        if len(times) != len(linear):
            raise InputError(f"{len(times)} times for {len(linear)} linear parts: one of each per keyframe is needed")
        for name, value in (("times", times), ("linear", linear), ("translation", translation)):
            value.flags.writeable = False
            object.__setattr__(self, name, value)

    @staticmethod
    def parametrised(linear, translation=None, method: str = "centripetal", points=None, span=(0.0, 1.0)):
        """Keyframes without times of their own, given times over `span` (HJK 2.2).

        method: "uniform", "chordal" (steps in proportion to δ_i) or "centripetal" (√δ_i), where
        δ_i² is the mean of ‖(v_{i+1} + A_{i+1} p) − (v_i + A_i p)‖² over the body points p.
        points: (P, d); the unit vectors and their opposites when left out.
        """
        if method not in PARAMETRISATIONS:
            raise InputError(f"parametrisation {method!r} is unknown; there are {', '.join(PARAMETRISATIONS)}")
        linear, translation = _check_positions(linear, translation)
        d = linear.shape[-1]
        points = np.concatenate([np.eye(d), -np.eye(d)]) if points is None else np.asarray(points, dtype=float)
        if points.ndim != 2 or points.shape[1] != d or not len(points) or not np.isfinite(points).all():
            raise InputError(f"body points of shape {points.shape}: finite, shape (P, {d}), P ≥ 1, is needed")
        positions = translation[:, None] + points @ linear.transpose(0, 2, 1)
        distance = np.sqrt((np.diff(positions, axis=0) ** 2).sum(axis=2).mean(axis=1))
        if method != "uniform" and (distance == 0).any():
            i = int(np.argmin(distance))
            raise InputError(
                f"keyframes {i} and {i + 1} coincide on the body points: {method} times would repeat; "
                "drop one of them or use uniform times"
            )
        steps = {"uniform": np.ones_like(distance), "chordal": distance, "centripetal": np.sqrt(distance)}[method]
        share = np.concatenate([[0.0], np.cumsum(steps) / steps.sum()])
        return Keyframes(span[0] + (span[1] - span[0]) * share, linear, translation)

    @staticmethod
    def from_rotations(times, rotations: "Rotation", translation: Any = None) -> "Keyframes":
        """Rigid keyframes in 3D from a SciPy `Rotation` of M rotations and translations (M, 3)."""
        return Keyframes(times, rotations.as_matrix().reshape(-1, 3, 3), translation)

    @property
    def dimension(self) -> int:
        return self.linear.shape[-1]

    @property
    def coordinates(self) -> np.ndarray:
        """(M, d² + d) each linear part row by row, then the translation: the order of a motion's controls."""
        return np.concatenate([self.linear.reshape(len(self), -1), self.translation], axis=1)

    def __len__(self) -> int:
        return len(self.times)

    def __getitem__(self, index) -> "Keyframes":
        """The keyframes chosen by a slice or an array of indices; at least two."""
        index = np.arange(len(self))[index]
        return Keyframes(self.times[index], self.linear[index], self.translation[index])

    def __repr__(self) -> str:
        return f"Keyframes({len(self)} in {self.dimension}D, times {self.times[0]:g} to {self.times[-1]:g})"

    def with_times(self, method: str = "centripetal", points=None) -> "Keyframes":
        """The same positions with times by `method` over the same span; see `parametrised`."""
        return Keyframes.parametrised(self.linear, self.translation, method, points, (self.times[0], self.times[-1]))

    def moved(self, i: int, linear=None, translation=None) -> "Keyframes":
        """The same keyframes with number i given another linear part or translation."""
        if not -len(self) <= i < len(self):
            raise InputError(f"keyframe {i} does not exist: there are {len(self)}")
        a, v = self.linear.copy(), self.translation.copy()
        a[i] = a[i] if linear is None else linear
        v[i] = v[i] if translation is None else translation
        return Keyframes(self.times, a, v)

    def require_orientation(self, what: str) -> None:
        """Raise InputError where a keyframe is singular or reflected, naming it and `what` needs better."""
        sizes = np.linalg.norm(self.linear, axis=(1, 2)) / np.sqrt(self.dimension)
        determinants = np.linalg.det(self.linear)
        flat = np.abs(determinants) <= 1e-12 * sizes**self.dimension
        for bad, word in ((flat, "singular"), (determinants < 0, "reflected")):
            if bad.any():
                i = int(np.argmax(bad))
                raise InputError(
                    f"keyframe {i} is {word} (determinant {determinants[i]:.3g}): {what} needs orientation"
                )

    def rotations(self, tolerance: float = 1e-6) -> "Rotation":
        """The linear parts as a SciPy `Rotation`, in 3D; InputError unless they are orthogonal to `tolerance`."""
        return as_rotations(self.linear, tolerance)

    def plot(
        self,
        axes: "Axes | None" = None,
        *,
        body: "Body | None" = None,
        colour: str | None = None,
        label: str | None = None,
    ) -> "Axes":
        """A body at the keyframes; arguments as for `plot_keyframes`. Returns the axes."""
        from symmotion.views.body_plots import plot_keyframes  # here: matplotlib is for who draws

        return plot_keyframes(self, axes, body=body, colour=colour, label=label)

    _repr_html_ = as_html


def as_rotations(linear: np.ndarray, tolerance: float = 1e-6) -> "Rotation":
    """(N, 3, 3) rotation matrices as a SciPy `Rotation`; InputError names the first that is none."""
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


def _check_positions(linear, translation) -> tuple[np.ndarray, np.ndarray]:
    linear = np.array(linear, dtype=float)
    if linear.ndim != 3 or linear.shape[1] != linear.shape[2] or linear.shape[1] not in (2, 3):
        raise InputError(f"linear parts of shape {linear.shape}: (M, 2, 2) or (M, 3, 3) is needed")
    m, d = linear.shape[:2]
    if m < 2:
        raise InputError(f"{m} keyframe{'s' * (m != 1)}: a motion needs at least 2")
    translation = np.zeros((m, d)) if translation is None else np.array(translation, dtype=float)
    if translation.shape != (m, d):
        raise InputError(f"translations of shape {translation.shape} for {m} keyframes in {d}D: ({m}, {d}) is needed")
    finite = np.isfinite(linear).all(axis=(1, 2)) & np.isfinite(translation).all(axis=1)
    if not finite.all():
        raise InputError(f"keyframe {int(np.argmin(finite))} has an entry that is not finite")
    return linear, translation
