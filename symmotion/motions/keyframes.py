"""Keyframes: the affine positions that a motion has to take, and when."""

import os
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, NamedTuple, overload

import numpy as np
from numpy.typing import ArrayLike

from symmotion import checks
from symmotion.brief import between, instant
from symmotion.errors import InputError
from symmotion.motions.crowding import close
from symmotion.motions.position import Affine, in_line
from symmotion.motions.rotations import as_quaternions, as_rotations, to_rotation
from symmotion.pictures import as_html, plot_keyframes
from symmotion.splines import check_times
from symmotion.values import content, read_only, same, value

if TYPE_CHECKING:
    from scipy.spatial.transform import RigidTransform, Rotation

    from symmotion.motions.rotations import Rotations

PARAMETRISATIONS = ("uniform", "chordal", "centripetal")  # ways to choose times (HJK 2.2)


class Keyframe(NamedTuple):
    """One affine position x ↦ v + A x, and when: it unpacks as (time, linear (d, d), translation (d,)).

    >>> time, linear, translation = sm.examples.planar_keyframes()[0]
    >>> time, translation
    (0.0, array([0., 0.]))
    """

    time: float
    linear: np.ndarray
    translation: np.ndarray

    @property
    def position(self) -> Affine:
        """The position without its time, which moves points and has a matrix."""
        return Affine(self.linear, self.translation)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Keyframe) and same(tuple(self), tuple(other))

    def __ne__(self, other: object) -> bool:
        return not self == other

    def __hash__(self) -> int:
        return hash(content(tuple(self)))

    def __repr__(self) -> str:
        linear, translation = in_line(self.linear), in_line(self.translation)
        return f"Keyframe(time {instant(self.time)}, linear {linear}, translation {translation})"


@value
class Keyframes:
    """M affine positions x ↦ v_i + A_i x at times t_i, in dimension d = 2 or 3.

    times: (M,) increasing, M ≥ 2; linear: (M, d, d), row = output coordinate; translation:
    (M, d), zero when left out. Raises InputError that names the keyframe at fault.

    >>> keys = sm.Keyframes([0.0, 1.0], [np.eye(2), sm.examples.rotation_2d(90)], [[0.0, 0.0], [3.0, 0.0]])
    >>> keys
    Keyframes(2 in 2D, times 0 to 1)
    """

    times: np.ndarray
    linear: np.ndarray
    # None only on the way in: zero is put in its place.
    translation: np.ndarray = None  # pyright: ignore[reportAssignmentType]

    if TYPE_CHECKING:
        # Whatever is like an array goes in; the fields are arrays.
        def __init__(self, times: ArrayLike, linear: ArrayLike, translation: ArrayLike | None = None) -> None: ...

    def __post_init__(self):
        linear, translation = _check_positions(self.linear, self.translation)
        times = check_times(self.times)
        if len(times) != len(linear):
            raise InputError(f"{len(times)} times for {len(linear)} linear parts: one of each per keyframe is needed")
        for name, array in (("times", times), ("linear", linear), ("translation", translation)):
            object.__setattr__(self, name, read_only(array))

    @staticmethod
    def of(
        times: ArrayLike,
        positions: "Rotations | Affine | RigidTransform",
        translation: ArrayLike | None = None,
        *,
        scalar_first: bool = True,
        norms: float | None = None,
    ) -> "Keyframes":
        """Keyframes of positions in any of their forms.

        times: (M,) numbers, or dates or durations of NumPy, Python or an index of pandas, which
            become seconds since the first.
        positions: linear parts (M, d, d); unit quaternions (M, 4), scalar first unless it is said
            that it is last; a SciPy `Rotation` or `RigidTransform` of M; homogeneous matrices (M, 4, 4) or an
            `Affine` of M positions. translation: (M, d), where they have none of their own; zero when left out.
        norms: how far lengths of quaternions, which are divided by them, may be from 1; 1e-6 when left out.
        """
        linear, own = _positions(positions, scalar_first, norms)
        if translation is None:
            return Keyframes(check_times(times), linear, own)
        if np.any(own):
            raise InputError("the positions have translations of their own: leave translation out")
        return Keyframes(check_times(times), linear, translation)

    @staticmethod
    def parametrised(
        linear: ArrayLike,
        translation: ArrayLike | None = None,
        method: str = "centripetal",
        points: ArrayLike | None = None,
        span: tuple[float, float] = (0.0, 1.0),
    ) -> "Keyframes":
        """Keyframes without times of their own, given times over `span` (HJK 2.2).

        method: "uniform", "chordal" (steps in proportion to δ_i) or "centripetal" (√δ_i), where
        δ_i² is the mean of ‖(v_{i+1} + A_{i+1} p) − (v_i + A_i p)‖² over the body points p.
        points: (P, d); the unit vectors and their opposites when left out.
        """
        checks.choice(method, PARAMETRISATIONS, "parametrisation")
        linear, translation = _check_positions(linear, translation)
        d = linear.shape[-1]
        points = np.concatenate([np.eye(d), -np.eye(d)]) if points is None else checks.numbers(points, "body points")
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
    def from_rotations(times: ArrayLike, rotations: "Rotation", translation: ArrayLike | None = None) -> "Keyframes":
        """Rigid keyframes in 3D from a SciPy `Rotation` of M rotations and translations (M, 3)."""
        return Keyframes.of(times, rotations, translation)

    @property
    def dimension(self) -> int:
        """Of the space that the body is in, d = 2 or 3."""
        return self.linear.shape[-1]

    @property
    def coordinates(self) -> np.ndarray:
        """(M, d² + d) each linear part row by row, then the translation: the order of a motion's controls."""
        return np.concatenate([self.linear.reshape(len(self), -1), self.translation], axis=1)

    def __len__(self) -> int:
        return len(self.times)

    @overload
    def __getitem__(self, index: int | np.integer) -> Keyframe: ...
    @overload
    def __getitem__(self, index: slice | np.ndarray | Sequence[int]) -> "Keyframes": ...
    def __getitem__(self, index: int | np.integer | slice | np.ndarray | Sequence[int]) -> "Keyframe | Keyframes":
        """The keyframe at an index; those chosen by a slice or an array of indices or truths, at least two."""
        chosen = np.arange(len(self))[index]
        if np.ndim(chosen) == 0:
            return Keyframe(float(self.times[chosen]), self.linear[chosen], self.translation[chosen])
        return Keyframes(self.times[chosen], self.linear[chosen], self.translation[chosen])

    def __iter__(self) -> Iterator[Keyframe]:
        return (self[i] for i in range(len(self)))

    def __repr__(self) -> str:
        return f"Keyframes({len(self)} in {self.dimension}D, times {between(*self.times[[0, -1]])})"

    def with_times(self, method: str | ArrayLike = "centripetal", points: ArrayLike | None = None) -> "Keyframes":
        """The same positions at other times: (M,) increasing, or by a method over the same span; see `parametrised`."""
        if not isinstance(method, str):
            if points is not None:
                raise InputError("points go with a method, not with times: leave one of them out")
            return Keyframes(method, self.linear, self.translation)
        return Keyframes.parametrised(self.linear, self.translation, method, points, (self.times[0], self.times[-1]))

    def moved(
        self, i: int, linear: "ArrayLike | Rotation | None" = None, translation: ArrayLike | None = None
    ) -> "Keyframes":
        """The same keyframes with number i given another linear part (d, d), or `Rotation`, or translation (d,)."""
        i, d = checks.index(i, len(self), "keyframe"), self.dimension
        a, v = self.linear.copy(), self.translation.copy()
        if linear is not None:
            matrix = linear.as_matrix() if hasattr(linear, "as_matrix") else linear  # pyright: ignore[reportAttributeAccessIssue]
            a[i] = checks.array(matrix, (d, d), "linear")
        if translation is not None:
            v[i] = checks.array(translation, (d,), "translation")
        return Keyframes(self.times, a, v)

    def merged(self, within: float | None = None) -> "Keyframes":
        """The keyframes without those that follow another by at most `within`: what programs take of crowded ones.

        Of a crowd the first stays, at the end the last, so that the motion begins and ends when it did.
        within: in the unit of time; when left out a thousandth of the median step, or the rounding of the times.

            Keyframes([0.0, 1.0, 1.0 + 1e-9, 2.0, 3.0], np.tile(np.eye(2), (5, 1, 1))).merged().times  # 0, 1, 2, 3
        """
        reach = close(self.times) if within is None else checks.positive(within, "within")
        kept = [0]
        for i in range(1, len(self) - 1):
            if self.times[i] - self.times[kept[-1]] > reach:
                kept.append(i)
        while len(kept) > 1 and self.times[-1] - self.times[kept[-1]] <= reach:
            kept.pop()
        return self[[*kept, len(self) - 1]]

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

    plot = plot_keyframes
    _repr_html_ = as_html


def as_keyframes(
    value: "Keyframes | RigidTransform | ArrayLike",
    positions: "Rotations | Affine | RigidTransform | None" = None,
    translation: ArrayLike | None = None,
    *,
    scalar_first: bool = True,
    what: str = "keys",
) -> Keyframes:
    """The keyframes themselves, or those of times beside positions: what programs take as their first arguments.

    value: Keyframes; or times, with positions and translation as in `Keyframes.of`. what: the name
    of the argument. Raises InputError for a path, saying how to read it, and for anything else.

    scalar_first: the order of the components of quaternions.

    >>> from scipy.spatial.transform import Rotation
    >>> sm.motions.as_keyframes([0.0, 1.0], Rotation.from_rotvec([[0, 0, 0], [0, 0, 1]]))
    Keyframes(2 in 3D, times 0 to 1)
    """
    require_no_path(value, what)
    if isinstance(value, Keyframes):
        if positions is not None or translation is not None:
            raise InputError(f"{what} are Keyframes, which have positions of their own: leave the others out")
        return value
    if positions is None:
        raise InputError(f"{what} of type {type(value).__name__}: Keyframes, or times beside positions, are needed")
    return Keyframes.of(value, positions, translation, scalar_first=scalar_first)


def require_no_path(value: object, what: str) -> None:
    """InputError where a path stands for keyframes."""
    if isinstance(value, str | os.PathLike):
        path = os.fspath(value)
        raise InputError(f"{what} {path!r} is a path: read_keyframes({path!r}) gives the keyframes in the file")


def _positions(positions: "Rotations | Affine | RigidTransform", scalar_first: bool, norms: float | None) -> Affine:
    """Linear parts (M, d, d) and translations (M, d) of positions in any of their forms; none where they turn only."""
    if isinstance(positions, Affine):
        return positions
    if hasattr(positions, "as_quat"):
        matrices = checks.numbers(positions.as_matrix(), "positions")  # pyright: ignore[reportAttributeAccessIssue]
        return Affine(matrices.reshape(-1, 3, 3), np.zeros((matrices.size // 9, 3)))
    if hasattr(positions, "as_matrix"):
        matrices = checks.numbers(positions.as_matrix(), "positions")  # pyright: ignore[reportAttributeAccessIssue]
        return Affine.of(matrices.reshape(-1, 4, 4))
    given = checks.numbers(positions, "positions")
    if given.ndim == 2 and given.shape[1] == 4:
        q = as_quaternions(given, "quaternion", scalar_first=scalar_first, norms=norms)
        return Affine(to_rotation(q).as_matrix(), np.zeros((len(q), 3)))
    if given.ndim == 3 and given.shape[1:] == (4, 4):
        return Affine.of(given)
    if given.ndim != 3 or given.shape[1:] not in ((2, 2), (3, 3)):
        raise InputError(
            f"positions of shape {given.shape}: (M, d, d), d = 2 or 3, quaternions (M, 4) or homogeneous matrices "
            "(M, 4, 4) are needed"
        )
    return Affine(given, np.zeros(given.shape[:2]))


def _check_positions(linear: ArrayLike, translation: ArrayLike | None) -> tuple[np.ndarray, np.ndarray]:
    linear = checks.held(linear, "linear parts")
    if linear.ndim != 3 or linear.shape[1] != linear.shape[2] or linear.shape[1] not in (2, 3):
        raise InputError(f"linear parts of shape {linear.shape}: (M, 2, 2) or (M, 3, 3) is needed")
    m, d = linear.shape[:2]
    if m < 2:
        raise InputError(f"{m} keyframe{'s' * (m != 1)}: a motion needs at least 2")
    translation = np.zeros((m, d)) if translation is None else checks.held(translation, "translations")
    if translation.shape != (m, d):
        raise InputError(f"translations of shape {translation.shape} for {m} keyframes in {d}D: ({m}, {d}) is needed")
    finite = np.isfinite(linear).all(axis=(1, 2)) & np.isfinite(translation).all(axis=1)
    if not finite.all():
        raise InputError(f"keyframe {int(np.argmin(finite))} has an entry that is not finite")
    return linear, translation
