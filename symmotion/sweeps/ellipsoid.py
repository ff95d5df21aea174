"""A moving ellipsoid: where it is, how fast its surface moves outwards, and which points it visits."""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from symmotion.brief import instant
from symmotion.checks import floats, numbers
from symmotion.errors import InputError
from symmotion.motions.affine import AffineMotion
from symmotion.motions.motion import Moving
from symmotion.motions.position import Affine
from symmotion.splines import Spline
from symmotion.splines.continuity import first_jump
from symmotion.values import read_only, value

# Smallest over largest semi-axis: below it the ellipsoid counts as flat.
FLAT = 1e-9
# Points by times that are looked at at once.
CHUNK = 2_000_000


class Placement(NamedTuple):
    """Ellipsoids {w + B s : |s| ≤ 1}: B (…, 3, 3), w (…, 3)."""

    matrix: np.ndarray
    centre: np.ndarray


class SurfaceSpeed(NamedTuple):
    """The quadratic form g(s) = sᵀ H s + b · s on the unit sphere, in 1 / time: H (…, 3, 3) symmetric, b (…, 3)."""

    quadratic: np.ndarray
    linear: np.ndarray

    def __call__(self, s: np.ndarray) -> np.ndarray:
        """g at points s (…, 3), which broadcast with the leading axes of H and b."""
        return np.einsum("...i,...ij,...j->...", s, self.quadratic, s) + np.einsum("...i,...i->...", self.linear, s)


@value
class MovingEllipsoid:
    """The ellipsoid {c + E s : |s| ≤ 1} of the moving frame under a motion in space.

    shape: the radius of a ball, semi-axes (3,) along the axes of the moving frame, or the
    matrix E (3, 3), in units of length; centre: c (3,), the origin when left out. With
    B = A E and w = v + A c the ellipsoid at time t is {w + B s : |s| ≤ 1}.

    Raises InputError for a motion in the plane and for a shape that is flat or not finite.

    >>> motion = sm.interpolants.component_cubic(sm.examples.spatial_keyframes())
    >>> sm.sweeps.MovingEllipsoid(motion, [1.0, 0.7, 0.5]).points(np.array([1.0, 0.0, 0.0]), 0.0).shape
    (3,)
    """

    motion: Moving
    shape: ArrayLike = 1.0
    centre: ArrayLike = (0.0, 0.0, 0.0)

    def __post_init__(self):
        dimension = getattr(self.motion, "dimension", None)
        place = self.motion(self.motion.domain[0]) if dimension == 3 else None
        if not isinstance(place, Affine):  # orientations alone are quaternions
            what = f"motion in {dimension}D" if dimension == 2 else type(self.motion).__name__
            raise InputError(f"a {what}: an ellipsoid moves in space, with a linear part and a translation")
        shape = numbers(self.shape, "shape")
        if shape.shape not in ((), (3,), (3, 3)):
            raise InputError(f"shape of {shape.shape}: a radius, semi-axes (3,) or a matrix (3, 3) is needed")
        if shape.ndim < 2:
            if not (shape > 0).all():
                raise InputError(f"semi-axes {self.shape}: positive ones are needed")
            shape = np.diag(np.broadcast_to(shape, 3))
        centre = numbers(self.centre, "centre")
        if centre.shape != (3,) or not np.isfinite(centre).all():
            raise InputError(f"centre {self.centre}: three finite coordinates are needed")
        if not np.isfinite(shape).all() or np.linalg.cond(shape) > 1 / FLAT:
            raise InputError("the ellipsoid is flat or not finite: semi-axes of similar size are needed")
        # The same ellipsoid with its surface coordinates turned inside out: det B is then positive.
        if np.linalg.det(shape) * np.linalg.det(place.linear) < 0:
            shape = -shape
        object.__setattr__(self, "shape", read_only(shape))
        object.__setattr__(self, "centre", read_only(centre))

    def __repr__(self) -> str:
        sizes = np.linalg.svd(np.asarray(self.shape), compute_uv=False)
        return f"MovingEllipsoid(semi-axes {', '.join(f'{s:g}' for s in sizes)}, {self.motion!r})"

    @property
    def domain(self) -> tuple[float, float]:
        """First and last time, those of the motion."""
        return self.motion.domain

    def __call__(self, t: ArrayLike, nu: int = 0) -> Placement:
        """B and w at times t, or their nu-th derivatives."""
        linear, translation = self.motion(t, nu)
        return Placement(linear @ self.shape, translation + linear @ self.centre)

    def require_solid(self, times: np.ndarray) -> None:
        """Raise InputError that names the first of the times (N,) where the ellipsoid is flat or turned inside out."""
        matrices = self(times).matrix
        for bad, how in (
            (~np.isfinite(matrices).all(axis=(1, 2)), "is not finite"),
            (np.linalg.cond(np.where(np.isfinite(matrices), matrices, 0)) > 1 / FLAT, "flattens the ellipsoid"),
            (np.linalg.det(matrices) < 0, "has turned the ellipsoid inside out, through a flat one,"),
        ):
            if bad.any():
                raise InputError(
                    f"the motion {how} at time {instant(times[np.argmax(bad)])}: keep its matrices nonsingular"
                )

    def require_continuous(self) -> None:
        """Raise InputError that names the first time at which a spline motion jumps, and so leaves out a way."""
        motion = self.motion
        spline = getattr(motion, "spline" if isinstance(motion, AffineMotion) else "translation", None)
        if isinstance(spline, Spline) and (time := first_jump(spline)) is not None:
            raise InputError(
                f"the motion jumps at time {instant(time)}: sweep the parts before and behind on their own"
            )

    def points(self, s: np.ndarray, t: ArrayLike) -> np.ndarray:
        """(…, 3) the points w + B s of the ellipsoid's surface, s (…, 3) on the unit sphere and t (…) broadcasting."""
        matrix, centre = self(t)
        return centre + np.einsum("...ij,...j->...i", matrix, s)

    def surface_speed(self, t: ArrayLike) -> SurfaceSpeed:
        """The form g whose sign says whether the surface moves outwards, g > 0, or inwards at w + B s.

        g(s) = sᵀ sym(B⁻¹Ḃ) s + (B⁻¹ẇ) · s is the speed along the outward normal B⁻ᵀs, times
        ‖B⁻ᵀs‖; HJK 5.4 print det(ẋ, x_u, x_v) = 0, which is g = 0, without the translation.
        """
        matrix, _ = self(t)
        matrix_rate, centre_rate = self(t, 1)
        rates = np.linalg.solve(matrix, np.concatenate([matrix_rate, centre_rate[..., None]], axis=-1))
        h = rates[..., :3]
        return SurfaceSpeed(0.5 * (h + np.swapaxes(h, -1, -2)), rates[..., 3])

    def box(self, times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The lowest and highest coordinates (3,) of the ellipsoids at the times (N,) and, roughly, between them."""
        matrix, centre = self(times)
        half = np.linalg.norm(matrix, axis=2)
        low, high = centre - half, centre + half
        # Between two times an extreme coordinate can go beyond both by a fraction of what it moves.
        spare = max(np.abs(np.diff(x, axis=0)).max(initial=0.0) for x in (low, high))
        return low.min(axis=0) - spare, high.max(axis=0) + spare

    def distances(self, points: np.ndarray, times: np.ndarray) -> np.ndarray:
        """(P, N) |B⁻¹(x − w)| for points (P, 3) and times (N,): below one inside."""
        matrix, centre = self(times)
        inverse = np.linalg.inv(matrix)
        offset = np.einsum("nij,nj->ni", inverse, centre)
        square = np.zeros((len(points), len(times)))
        for i in range(3):
            square += (points @ inverse[:, i].T - offset[:, i]) ** 2
        return np.sqrt(square)

    def closest(self, points: np.ndarray, times: np.ndarray) -> np.ndarray:
        """(P,) the least of the distances over time, a parabola through the three lowest neighbours of times (N,)."""
        found = np.empty(len(points))
        for part in _chunks(len(points), len(times)):
            square = self.distances(points[part], times) ** 2
            least, (point, _, value) = square.min(axis=1), _turns(square)
            np.minimum.at(least, point, value.clip(0))
            found[part] = np.sqrt(least)
        return found

    def visits(self, points: ArrayLike, times: np.ndarray, closed: bool = False) -> np.ndarray:
        """(P,) how many separate stretches of time each point (P, 3) spends in the ellipsoid.

        times: (N,) increasing, at which it is looked for; between them parabolas tell short
        stretches. closed: whether the last time is followed by the first.
        """
        points = np.atleast_2d(floats(points, "points"))
        count = np.empty(len(points), dtype=int)
        for part in _chunks(len(points), len(times)):
            square = self.distances(points[part], times) ** 2
            inside = square < 1
            entries = (inside[:, 1:] & ~inside[:, :-1]).sum(axis=1)
            # A dip below one between two times outside is a visit of its own, a bump above one between two inside
            # splits a visit.
            point, k, value = _turns(square)
            apart = (value < 1) != inside[point, k]
            apart &= (inside[point, k - 1] == inside[point, k]) & (inside[point, k + 1] == inside[point, k])
            entries += np.bincount(point[apart], minlength=len(square))
            always = inside.all(axis=1) & (entries == 0)
            started = inside[:, 0] & ~inside[:, -1] if closed else inside[:, 0]
            count[part] = np.where(always, 1, entries + started)
        return count


def _turns(square: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The local extremes over the columns of (P, N): row, column, and the value of the parabola's vertex there."""
    rising = square[:, 1:] > square[:, :-1]
    row, column = np.nonzero(rising[:, 1:] != rising[:, :-1])
    column += 1
    before, here, after = (square[row, column + k] for k in (-1, 0, 1))
    return row, column, here - (after - before) ** 2 / (8 * (after - 2 * here + before))


def _chunks(points: int, times: int):
    size = max(1, CHUNK // times)
    return [slice(k, k + size) for k in range(0, points, size)]
