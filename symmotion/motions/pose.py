"""Pose motions: a quaternion curve for the orientation and a spline for the position."""

import numpy as np
from numpy.typing import ArrayLike

from symmotion.brief import between
from symmotion.errors import InputError
from symmotion.motions.motion import matrix, trajectory
from symmotion.motions.position import Affine
from symmotion.motions.quaternions.curve import QuaternionMotion
from symmotion.motions.quaternions.products import ProductMotion
from symmotion.motions.quaternions.turning import turned
from symmotion.pictures import as_html, plot_positions
from symmotion.saving import save
from symmotion.splines import Spline
from symmotion.splines.instants import distinct, same_times
from symmotion.values import value


@value
class PoseMotion:
    """The rigid motion x ↦ v(t) + q(t) x q(t)⁻¹.

    orientation: a quaternion curve, for programs and fairing one over B-splines.
    translation: a spline with control points (n, 3) over the same domain.

    Raises InputError where the parts have other domains, and for times outside.

    >>> keys = sm.examples.random_keyframes(4, 60, seed=1)
    >>> turning = sm.quaternions.interpolate_quaternions(keys)
    >>> motion = sm.motions.PoseMotion(turning, sm.splines.cubic_interpolant(keys.times, keys.translation))
    >>> motion(1.0).translation.shape
    (3,)
    """

    orientation: QuaternionMotion | ProductMotion
    translation: Spline

    def __post_init__(self):
        if self.translation.control_points.shape[1:] != (3,):
            raise InputError(
                f"control points of shape {self.translation.control_points.shape}: (n, 3) is needed for a pose"
            )
        if not same_times(self.orientation.domain, self.translation.domain):
            raise InputError(
                f"the orientation is defined on {self.orientation.domain}, the translation on "
                f"{self.translation.domain}: the same domain is needed"
            )

    @property
    def dimension(self) -> int:
        """Of the space that the body is in: 3."""
        return 3

    @property
    def domain(self) -> tuple[float, float]:
        """First and last time."""
        return self.orientation.domain

    @property
    def breakpoints(self) -> np.ndarray:
        """(K,) the borders of the pieces of orientation and translation, ends of the domain included."""
        turning = self.orientation.breakpoints
        return distinct([*turning, *self.translation.breakpoints], turning)

    def __repr__(self) -> str:
        a, b = self.domain
        return f"PoseMotion(times {between(a, b)})"

    def __call__(self, t: ArrayLike, nu: int = 0) -> Affine:
        """The nu-th derivative (0 to 2) at times t: linear t.shape + (3, 3), translation t.shape + (3,).

        Ṙ = R [Ω]×, R̈ = R ([Ω]× [Ω]× + [Ω̇]×) with the body rate Ω.
        """
        if nu not in (0, 1, 2):
            raise InputError(f"derivative order {nu}: 0 to 2 is needed")
        return Affine(turned(self.orientation.jet(t, nu)), self.translation(t, nu))

    matrix = matrix
    trajectory = trajectory
    save = save
    plot = plot_positions
    _repr_html_ = as_html
