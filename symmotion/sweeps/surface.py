"""Sweep surfaces of affine motions: exact tensor-product splines (HJK 5.4, (18))."""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from symmotion.bodies.mesh import Mesh, compact
from symmotion.brief import between, instant
from symmotion.checks import floats, numbers
from symmotion.errors import InputError
from symmotion.motions.affine import AffineMotion
from symmotion.splines import BSplineBasis, Spline
from symmotion.values import read_only, value

# Points closer than this times the size of the control net, or than some rounding of where it lies, are the same.
COINCIDENT = 1e-9
ROUNDING = 16 * np.finfo(float).eps


@value
class SweepSurface:
    """The tensor-product spline surface Σ M_i(u) N_j(t) p_ij.

    u, t: the B-splines M_i of the profile and N_j of the motion; control_points: (n, m, d),
    d = 2 or 3, in units of length.

    Raises InputError for controls of another shape or not finite, and parameters outside of its domain.

    >>> motion = sm.interpolants.component_cubic(sm.examples.spatial_keyframes())
    >>> surface = sm.sweeps.sweep_surface(motion, sm.curves.bezier([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]]))
    >>> surface(0.5, 0.5).shape
    (3,)
    """

    u: BSplineBasis
    t: BSplineBasis
    control_points: np.ndarray

    def __post_init__(self):
        controls = numbers(self.control_points, "the control net")
        if controls.ndim != 3 or controls.shape[:2] != (self.u.n, self.t.n) or controls.shape[2] not in (2, 3):
            raise InputError(f"a control net of shape {controls.shape}: ({self.u.n}, {self.t.n}, 2 or 3) is needed")
        if not np.isfinite(controls).all():
            i, j = np.argwhere(~np.isfinite(controls).all(axis=2))[0]
            raise InputError(f"control point ({i}, {j}) of the net is not finite")
        object.__setattr__(self, "control_points", read_only(controls))

    @property
    def dimension(self) -> int:
        """Of the space that the surface is in."""
        return self.control_points.shape[2]

    @property
    def domain(self) -> tuple[tuple[float, float], tuple[float, float]]:
        """The intervals of u and of t."""
        return self.u.domain, self.t.domain

    def __repr__(self) -> str:
        (a, b), (c, d) = self.domain
        net = f"{self.u.n} × {self.t.n} controls of degrees {self.u.degree} and {self.t.degree}"
        return f"SweepSurface({self.dimension}D, {net}, u {between(a, b)}, t {between(c, d)})"

    def __call__(self, u: ArrayLike, t: ArrayLike, nu: tuple[int, int] = (0, 0)) -> np.ndarray:
        """Partial derivatives of order nu by (u, t); u and t broadcast, + (d,). InputError outside the domain."""
        if len(nu) != 2 or min(nu) < 0:
            raise InputError(f"derivative orders {nu!r}: two, 0 or more, are needed")
        u, t = np.broadcast_arrays(floats(u, "u"), floats(t, "times"))
        local = []
        for basis, x, order, name in ((self.u, u, nu[0], "u"), (self.t, t, nu[1], "t")):
            try:
                local.append(basis.local(x.ravel(), order))
            except InputError as error:
                raise InputError(f"{name}: {error}") from None
        (i, along), (j, across) = local
        net = self.control_points[i[:, :, None], j[:, None, :]]
        return np.einsum("xi,xj,xijk->xk", along, across, net).reshape(*u.shape, self.dimension)

    def normals(self, u: ArrayLike, t: ArrayLike) -> np.ndarray:
        """(…, 3) unit normals S_u × S_t / ‖S_u × S_t‖; nan where the surface is singular. InputError in the plane."""
        if self.dimension != 3:
            raise InputError("a sweep in the plane has no normals: they need a motion in space")
        normal = np.cross(self(u, t, (1, 0)), self(u, t, (0, 1)))
        size = np.linalg.norm(normal, axis=-1, keepdims=True)
        with np.errstate(invalid="ignore"):
            return np.where(size > 0, normal / size, np.nan)

    def mesh(self, nu: int = 48, nt: int = 48, caps: bool = False) -> Mesh:
        """A mesh of nu × nt quadrilaterals, equally spaced in u and t, each cut into two triangles.

        Where the profile or the motion is closed the ends are one, and where an end of the
        surface is one point, it is one vertex. caps: close the first and the last section of a
        closed profile by triangles from their centroids. A closed mesh faces outwards, an open
        one along S_u × S_t.

        Raises InputError in the plane, and where a section has no such cap, naming its time.
        """
        if self.dimension != 3:
            raise InputError("a sweep in the plane has no mesh: append a zero to its points and widen its matrices")
        if nu < 3 or nt < 1:
            raise InputError(f"{nu} × {nt} pieces are too few for a mesh: at least 3 × 1 are needed")
        times = np.linspace(*self.t.domain, nt + 1)
        points = self(np.linspace(*self.u.domain, nu + 1)[:, None], times)
        net = self.control_points.reshape(-1, 3)
        tolerance = max(COINCIDENT * float(np.ptp(net, axis=0).max()), ROUNDING * float(np.abs(net).max()))
        index, joined = _joined(points, tolerance)
        triangles, vertices = [_quads(index)], points.reshape(-1, 3)
        if caps and not joined.profile:
            raise InputError("caps close the ends of closed profiles, and the first and last point of this one differ")
        if caps and not joined.motion:
            for end, ring in ((0, index[:, 0]), (-1, index[:, -1])):
                if (ring == ring[0]).all():
                    continue  # one point is closed as it is
                centre = _cap_centre(points[:-1, end], float(times[end]))
                fan = np.column_stack([ring[1:], ring[:-1], np.full(nu, len(vertices))])
                triangles.append(fan[:, ::-1] if end else fan)
                vertices = np.vstack([vertices, centre])
        mesh = compact(vertices, np.concatenate(triangles))
        return mesh.outward() if mesh.closed else mesh


class Joined(NamedTuple):
    """Whether the profile, and whether the motion, ends where it begins."""

    profile: bool
    motion: bool


def sweep_surface(motion: AffineMotion, profile: Spline) -> SweepSurface:
    """The surface S(u, t) = v(t) + A(t) C(u) that a profile curve C sweeps, with control net p_ij = v_j + A_j c_i.

    profile: a spline of points (d,) in the moving frame, open, clamped or periodic. The net is
    exact since the B-splines of the profile sum to one. Raises InputError where motion and
    profile differ in dimension. Source: HJK 5.4, (18).

    >>> motion = sm.interpolants.component_cubic(sm.examples.spatial_keyframes())
    >>> surface = sm.sweeps.sweep_surface(motion, sm.curves.bezier([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]]))
    >>> bool(np.allclose(surface(0.0, 0.5), motion(0.5).translation))
    True
    """
    controls, d = profile.control_points, motion.dimension
    if d not in (2, 3):
        raise InputError(f"a motion in dimension {d}: a sweep surface needs 2 or 3")
    if controls.ndim != 2 or controls.shape[1] != d:
        raise InputError(
            f"profile points of shape {controls.shape[1:]} for a motion in {d}D: points ({d},) are needed"
            + ("; append a zero for a plane profile" if controls.shape[1:] == (2,) else "")
        )
    net = motion.translation + np.einsum("jkl,il->ijk", motion.linear, controls)
    return SweepSurface(profile.basis, motion.basis, net)


def _joined(points: np.ndarray, tolerance: float) -> tuple[np.ndarray, Joined]:
    """(U, T) the vertex of every point of a grid (U, T, 3), opposite borders and one-point borders being the same."""
    index = np.arange(points.shape[0] * points.shape[1]).reshape(points.shape[:2])
    joined = Joined(
        bool(np.abs(points[0] - points[-1]).max() <= tolerance),
        bool(np.abs(points[:, 0] - points[:, -1]).max() <= tolerance),
    )
    if joined.profile:
        index[-1] = index[0]
    if joined.motion:
        index[:, -1] = index[:, 0]
    for vertices, border in (
        (index[0], points[0]),
        (index[-1], points[-1]),
        (index[:, 0], points[:, 0]),
        (index[:, -1], points[:, -1]),
    ):
        if np.ptp(border, axis=0).max() <= tolerance:
            vertices[:] = vertices[0]
    return index, joined


def _quads(index: np.ndarray) -> np.ndarray:
    """(F, 3) the two triangles of every cell of a grid of vertices."""
    a, b, c, d = (x.ravel() for x in (index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]))
    return np.concatenate([np.column_stack([a, b, c]), np.column_stack([a, c, d])])


def _cap_centre(ring: np.ndarray, time: float) -> np.ndarray:
    """(3,) the centroid of a closed section (N, 3); InputError unless the triangles from it all face one way."""
    centre = ring.mean(axis=0)
    normals = np.cross(ring - centre, np.roll(ring, -1, axis=0) - centre)
    if (normals @ normals.sum(axis=0) <= 0).any():
        raise InputError(
            f"the section at time {instant(time)} is not star-shaped about its centroid: it has no cap; leave caps out"
        )
    return centre
