"""Rigid output: the rotations closest to an affine motion (HJK 2.3, application 3)."""

import numpy as np
from numpy.typing import ArrayLike

from symmotion.brief import between, instant
from symmotion.checks import numbers
from symmotion.errors import InputError
from symmotion.motions.keyframes import Keyframes
from symmotion.motions.motion import Moving
from symmotion.pictures import as_html, plot_deviations
from symmotion.values import read_only, value

# Smallest over largest singular value: below it the polar factor is rounding.
SINGULAR = 1e-12
# Keyframes are rigid up to the first; between them singular values off by more than the second are told.
RIGID, SQUEEZED = 1e-6, 0.1
SQUEEZED_AT = 8  # parts of a segment, at whose borders it is looked at


def squeezed_note(keyframes: Keyframes, motion: Moving) -> str | None:
    """What there is to say of a motion through rigid keyframes that is far from rigid between them; None of others."""
    linear, d = keyframes.linear, keyframes.dimension
    if np.abs(np.swapaxes(linear, 1, 2) @ linear - np.eye(d)).max() > RIGID or (np.linalg.det(linear) < 0).any():
        return None
    times = keyframes.times
    share = np.arange(1, SQUEEZED_AT) / SQUEEZED_AT
    inside = (times[:-1, None] + np.diff(times)[:, None] * share).ravel()
    found = motion(inside).linear
    sizes, volumes = np.linalg.svd(found, compute_uv=False), np.linalg.det(found)
    off = np.abs(sizes - 1).max(axis=1)
    worst, least = int(np.argmax(off)), int(np.argmin(volumes))
    if not off[worst] > SQUEEZED:
        return None
    return (
        f"between rigid keyframes the body is squeezed: singular values of A are off by up to {off[worst]:.2g} (time "
        f"{instant(inside[worst])}), det A falls to {volumes[least]:.2g} (time {instant(inside[least])}); keyframes "
        "between, more R, R* or a pose program keep it rigid"
    )


def polar_factors(linear: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The polar decomposition A = M S of matrices (N, d, d): M orthogonal, the closest to A, S positive semidefinite.

    Returns M (N, d, d), S (N, d, d) and the singular values of A (N, d), in decreasing order.
    Where A reflects, M has determinant −1; where A is singular, M is not determined.

    linear: the matrices A, (N, d, d).

    >>> rotation, stretch, sizes = sm.motions.polar_factors(np.array([[[0.0, -2.0], [1.0, 0.0]]]))
    >>> rotation[0].round(9) + 0.0, sizes[0]
    (array([[ 0., -1.],
           [ 1.,  0.]]), array([2., 1.]))
    """
    left, sizes, right = np.linalg.svd(linear)
    return left @ right, np.swapaxes(right, -1, -2) @ (sizes[..., None] * right), sizes


@value
class RigidSamples:
    """A motion made rigid at some times.

    times: (N,); rotations: (N, d, d), determinant +1; translation: (N, d), the motion's own.
    deviations: (N,) the Frobenius norm ‖A(t) − polar(A(t))‖, how much was given up at each time.

    Its `keyframes` raises InputError for fewer than two times.

    >>> motion = sm.interpolants.component_cubic(sm.examples.random_keyframes(3, 40, seed=1))
    >>> sm.motions.orthonormalise(motion, [0.0, 0.5, 1.0]).rotations.shape
    (3, 3, 3)
    """

    times: np.ndarray
    rotations: np.ndarray
    translation: np.ndarray
    deviations: np.ndarray

    def __post_init__(self):
        for name in ("times", "rotations", "translation", "deviations"):
            object.__setattr__(self, name, read_only(numbers(getattr(self, name), name)))

    def __repr__(self) -> str:
        count, d = len(self.times), self.translation.shape[-1]
        return f"RigidSamples({count} in {d}D, times {between(*self.times[[0, -1]])}, deviation {self.deviation:.3g})"

    @property
    def deviation(self) -> float:
        """The largest ‖A(t) − polar(A(t))‖ over the times."""
        return float(self.deviations.max())

    @property
    def keyframes(self) -> Keyframes:
        """The samples as keyframes; at least two increasing times are needed."""
        return Keyframes(self.times, self.rotations, self.translation)

    plot = plot_deviations
    _repr_html_ = as_html


def orthonormalise(motion: Moving, t: ArrayLike) -> RigidSamples:
    """The rigid positions closest to a motion at times t: polar factors of A(t) beside v(t).

    polar(A) = U Vᵀ with A = U Σ Vᵀ is the rotation of least ‖A − M‖ (Frobenius). t: (N,) times
    in the motion's domain, or one time. The deviation is reported at these times, not between.

    Raises InputError that names the first time where A is singular or reflected: no rotation is
    closest there. Source: HJK 2.3; Shoemake and Duff 1992.

    >>> motion = sm.interpolants.component_cubic(sm.examples.random_keyframes(3, 40, seed=1))
    >>> sm.motions.orthonormalise(motion, np.linspace(0, 2, 20)).deviation < 0.2
    True
    """
    times = np.atleast_1d(numbers(t, "times"))
    if times.ndim != 1 or not len(times):
        raise InputError(f"times of shape {times.shape}: shape (N,), N ≥ 1, is needed")
    linear, translation = motion(times)
    finite = np.isfinite(linear).all(axis=(1, 2))
    if not finite.all():
        raise InputError(f"the motion is not finite at time {times[np.argmin(finite)]}")
    rotations, _, sizes = polar_factors(linear)
    singular = sizes[:, -1] <= SINGULAR * sizes[:, 0]
    for fault, wrong in (("singular", singular), ("reflected", np.linalg.det(rotations) < 0)):
        if wrong.any():
            raise InputError(f"the motion is {fault} at time {times[np.argmax(wrong)]}: no rotation is closest to it")
    return RigidSamples(times, rotations, translation, np.linalg.norm(sizes - 1, axis=1))
