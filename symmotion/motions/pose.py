"""Pose motions: a quaternion curve for the orientation and a spline for the position."""

from dataclasses import dataclass

import numpy as np

from symmotion.errors import InputError
from symmotion.motions.affine import Affine
from symmotion.motions.pictures import as_html, plot_positions
from symmotion.motions.quaternions.algebra import rotate, skew
from symmotion.motions.quaternions.curve import QuaternionMotion
from symmotion.splines import Spline


@dataclass(frozen=True, eq=False)
class PoseMotion:
    """The rigid motion x ↦ v(t) + q(t) x q(t)⁻¹.

    orientation: a quaternion curve; translation: a spline with control points (n, 3) over the same domain.
    """

    orientation: QuaternionMotion
    translation: Spline

    def __post_init__(self):
        if self.translation.control_points.shape[1:] != (3,):
            raise InputError(
                f"control points of shape {self.translation.control_points.shape}: (n, 3) is needed for a pose"
            )
        if not np.allclose(self.orientation.domain, self.translation.domain, rtol=1e-12):
            raise InputError(
                f"the orientation is defined on {self.orientation.domain}, the translation on "
                f"{self.translation.domain}: the same domain is needed"
            )

    @property
    def dimension(self) -> int:
        return 3

    @property
    def domain(self) -> tuple[float, float]:
        return self.orientation.domain

    def __repr__(self) -> str:
        a, b = self.domain
        return f"PoseMotion(times {a:g} to {b:g})"

    def __call__(self, t, nu: int = 0) -> Affine:
        """The nu-th derivative (0 to 2) at times t: linear t.shape + (3, 3), translation t.shape + (3,).

        Ṙ = R [Ω]×, R̈ = R ([Ω]× [Ω]× + [Ω̇]×) with the body rate Ω.
        """
        if nu not in (0, 1, 2):
            raise InputError(f"derivative order {nu}: 0 to 2 is needed")
        jet = self.orientation.jet(t, nu)
        linear = np.swapaxes(rotate(jet.quaternion[..., None, :], np.eye(3)), -1, -2)
        if jet.rate is not None:
            spin = skew(jet.rate)
            linear = linear @ (spin if jet.acceleration is None else spin @ spin + skew(jet.acceleration))
        return Affine(linear, self.translation(t, nu))

    def trajectory(self, points, t, nu: int = 0) -> np.ndarray:
        """The nu-th derivative of the paths of body points (P, 3) at times t: shape t.shape + (P, 3)."""
        points = np.atleast_2d(np.asarray(points, dtype=float))
        if points.shape[-1] != 3:
            raise InputError(f"body points of shape {points.shape}: (P, 3) is needed")
        linear, translation = self(t, nu)
        return translation[..., None, :] + points @ np.swapaxes(linear, -1, -2)

    plot = plot_positions
    _repr_html_ = as_html
