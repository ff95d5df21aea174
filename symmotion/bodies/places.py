"""Where motions take bodies, and how large a body suits a motion."""

from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from symmotion.bodies.body import Body, Shape
from symmotion.bodies.shapes import Up
from symmotion.brief import instant
from symmotion.errors import InputError
from symmotion.motions import Affine, PoseMotion
from symmotion.motions.interpolants import SegmentCurve
from symmotion.motions.motion import Moving
from symmotion.motions.quaternions import ProductMotion, QuaternionMotion
from symmotion.motions.quaternions.turning import turning
from symmotion.splines import Spline

SAMPLES = 257

# Curves of orientations alone.
Oriented: TypeAlias = QuaternionMotion | ProductMotion | SegmentCurve


@dataclass(frozen=True, eq=False)
class Turned:
    """A curve of orientations that is no spline, as the motion that turns about the origin."""

    curve: SegmentCurve

    @property
    def dimension(self) -> int:
        return self.curve.dimension

    @property
    def domain(self) -> tuple[float, float]:
        return self.curve.domain

    @property
    def breakpoints(self) -> np.ndarray:
        return self.curve.breakpoints

    def __call__(self, t: ArrayLike, nu: int = 0) -> Affine:
        return turning(self.curve, t, nu)


def placed(motion: "Moving | Oriented") -> Moving:
    """The motion as it is, an orientation alone as the motion that turns about the origin; InputError for no motion."""
    if isinstance(motion, QuaternionMotion | ProductMotion):
        return PoseMotion(motion, Spline(motion.basis, np.zeros((motion.basis.n, 3))))
    if isinstance(motion, SegmentCurve):
        return Turned(motion)
    domain: Any = getattr(motion, "domain", ())  # Any: of whatever was given
    if not callable(motion) or np.shape(domain) != (2,) or not isinstance(motion(domain[0]), Affine):
        raise InputError(f"a {type(motion).__name__} is no motion over one time, with linear part and translation")
    return motion


def dimension_of(motion: Moving) -> int:
    """2 or 3; asked of the motion's positions, since not all kinds of motion say it."""
    return int(np.shape(motion(motion.domain[0]).translation)[-1])


def body_size(path: Affine, copies: int | None = None) -> tuple[float, bool]:
    """How large a body, in its own coordinates, suits positions (N,); whether its origin stays in place.

    A fifth of the way across them; to show so many copies as large as the distance between them,
    within a tenth and three tenths of the way across. The largest copy counts.
    """
    stretch = float(np.linalg.svd(path.linear, compute_uv=False).max()) or 1.0
    v = path.translation
    extent = float(np.linalg.norm(np.ptp(v, axis=0)))
    # Below this the way is rounding: of where it lies, or of what the linear part does.
    if extent <= 1e-9 * max(float(np.abs(v).max()), stretch):
        return 1.0 / stretch, True
    if copies is None:
        return 0.2 * extent / stretch, False
    spacing = float(np.linalg.norm(np.diff(v, axis=0), axis=1).sum()) / max(copies - 1, 1)
    return float(np.clip(1.1 * spacing, 0.1 * extent, 0.3 * extent)) / stretch, False


def fitting_body(shape: Shape | None, motion: Moving, *, dimension: int | None = None, up: Up = "z") -> Body:
    """The body that is meant, as by `Body.of`, or a letter F a fifth as high as what the motion's origin crosses."""
    if shape is not None:
        return Body.of(shape, dimension)
    with np.errstate(invalid="ignore"):
        path = motion(np.linspace(*motion.domain, SAMPLES))
    # What is not finite is told by who carries the body, with the time.
    size = body_size(path)[0] if np.isfinite(path.linear).all() and np.isfinite(path.translation).all() else 1.0
    return Body.of(None, dimension_of(motion), size=size, up=up)


def in_space(linear: np.ndarray, translation: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Linear parts (…, d, d) and translations (…, d) as (…, 3, 3) and (…, 3): planar ones in the plane z = 0."""
    if linear.shape[-1] == 3:
        return linear, translation
    wide = np.zeros((*linear.shape[:-2], 3, 3))
    wide[..., :2, :2], wide[..., 2, 2] = linear, 1.0
    return wide, np.concatenate([translation, np.zeros((*translation.shape[:-1], 1))], axis=-1)


def carried(motion: Moving, points: np.ndarray, t: np.ndarray) -> np.ndarray:
    """(N, P, 3) body points (P, 3) at times t (N,), of planar motions too."""
    linear, translation = in_space(*motion(t))
    return translation[:, None] + points @ np.swapaxes(linear, -1, -2)


def extent(motion: Moving, points: np.ndarray) -> float:
    """The diagonal of the box about all places (N, P, 3) that body points (P, 3) come to: what errors are relative to.

    Raises InputError that names a time where the motion is not finite.
    """
    t = np.linspace(*motion.domain, SAMPLES)
    with np.errstate(invalid="ignore"):
        places = carried(motion, points, t)
    finite = np.isfinite(places).all(axis=(1, 2))
    if not finite.all():
        raise InputError(f"the motion is not finite at time {instant(t[np.argmin(finite)])}")
    size = float(np.linalg.norm(np.ptp(places.reshape(-1, 3), axis=0)))
    if size == 0:
        raise InputError("the body is one point that stands still: there is no motion to write")
    return size
