"""Two-parameter motions: tensor-product B-spline surfaces of (dual) quaternions."""

from functools import cached_property
from typing import TYPE_CHECKING, Literal, get_args

import numpy as np
from numpy.typing import ArrayLike

from symmotion.brief import between
from symmotion.checks import array, choice, floats, numbers
from symmotion.errors import InputError
from symmotion.motions.dual import DualQuaternions
from symmotion.motions.motion import as_points
from symmotion.motions.position import Affine
from symmotion.motions.quaternions.algebra import conjugate, product
from symmotion.motions.rational import CurveMotion, Pair, RationalMotion, positions, quotient
from symmotion.motions.symmetry import Symmetry
from symmotion.pictures import as_html, plot_net
from symmotion.saving import save
from symmotion.splines import BSplineBasis, Spline
from symmotion.values import value

if TYPE_CHECKING:
    from scipy.interpolate import NdBSpline

Knots = Literal["uniform", "clamped", "chordal", "centripetal"] | BSplineBasis
Side = Literal["u0", "u1", "v0", "v1"]


@value
class TwoParameterMotion:
    """The motion Σ N_i(u) N_j(v) (Q_ij + εQ⁰_ij): PCG (11), (12).

    u, v: the B-spline bases, n and m functions; real: (n, m, 4) control quaternions Q_ij,
    scalar-first, of any norm; dual: (n, m, 4) their dual parts, in units of length, None for a
    spherical motion, which is about the origin. Controls are taken as they are: see
    `from_displacements` for ones whose signs are open.

    Raises InputError for other shapes, periodic bases, and quaternions that are zero or not finite.

    >>> net = sm.motions.smooth_net(6, spatial=True)
    >>> net(4.5, 5.0).linear.shape
    (3, 3)
    """

    u: BSplineBasis
    v: BSplineBasis
    real: np.ndarray
    dual: np.ndarray | None = None

    def __post_init__(self):
        for basis, name in ((self.u, "u"), (self.v, "v")):
            if basis.periodic:
                raise InputError(f"the basis in {name} is periodic: a two-parameter motion takes open ones")
            object.__setattr__(self, name, basis.about(0.0))  # parameters are no times
        pair = DualQuaternions.of(self.real, self.dual)
        if pair.shape != (self.u.n, self.v.n):
            raise InputError(f"control quaternions of shape {pair.real.shape}: ({self.u.n}, {self.v.n}, 4) is needed")
        object.__setattr__(self, "real", pair.real)
        object.__setattr__(self, "dual", None if self.dual is None else pair.dual)

    @staticmethod
    def from_displacements(
        displacements: DualQuaternions,
        u: Knots = "uniform",
        v: Knots = "uniform",
        *,
        degree: int = 3,
        spherical: bool | None = None,
        points: ArrayLike | None = None,
        symmetry: "Symmetry | None" = None,
    ) -> "TwoParameterMotion":
        """The motion with these control displacements (n, m), put in one hemisphere first.

        u, v: a basis, or simple knots at distance 1, "uniform" (from 0 on, the domain beginning
        at knot `degree`) or "clamped" (from 0 on, with repeated end knots: the boundary motions
        are those of the boundary controls), or "chordal" and "centripetal", simple knots at distances
        on average 1 that follow how far the `points` (P, 3) of the body move between neighbouring
        controls, or the square root of that, on average over the other direction; the ends of the
        axes when left out. Equal distances make them the uniform ones. spherical: whether to drop
        the dual parts; when left out, if they are all zero. symmetry: of the body, as for
        `DualQuaternions.aligned`.
        """
        if len(displacements.shape) != 2:
            raise InputError(f"control displacements of shape {displacements.shape}: a net (n, m) is needed")
        aligned = displacements.aligned(symmetry)
        n, m = displacements.shape
        bases = [
            simple_knots(aligned, axis, degree, knots == "centripetal", points)
            if isinstance(knots, str) and knots in ("chordal", "centripetal")
            else as_basis(knots, count, degree, "uv"[axis])
            for axis, (knots, count) in enumerate(zip((u, v), (n, m), strict=True))
        ]
        dropped = not aligned.dual.any() if spherical is None else spherical
        return TwoParameterMotion(bases[0], bases[1], aligned.real, None if dropped else aligned.dual)

    @property
    def spherical(self) -> bool:
        """Whether it only turns: there is no dual part."""
        return self.dual is None

    @property
    def bases(self) -> tuple[BSplineBasis, ...]:
        """The bases in u and v."""
        return self.u, self.v

    @property
    def domain(self) -> tuple[tuple[float, float], tuple[float, float]]:
        """The intervals of u and of v."""
        return self.u.domain, self.v.domain

    @property
    def control_displacements(self) -> DualQuaternions:
        """The controls as displacements (n, m)."""
        return DualQuaternions.of(self.real, self.dual)

    def with_controls(self, real: np.ndarray, dual: np.ndarray | None) -> "TwoParameterMotion":
        """The motion with other control quaternions over the same knots."""
        return TwoParameterMotion(self.u, self.v, real, dual)

    def seen_from(
        self, fixed: DualQuaternions | None = None, moving: DualQuaternions | None = None
    ) -> "TwoParameterMotion":
        """The same motion in other frames, as `DualQuaternions.seen_from`; its trajectory surfaces move rigidly."""
        moved = self.control_displacements.seen_from(fixed, moving)
        return self.with_controls(moved.real, None if self.spherical and not moved.dual.any() else moved.dual)

    def __repr__(self) -> str:
        (a, b), (c, d) = self.domain
        kind = "spherical" if self.spherical else "spatial"
        net = f"{self.u.n} × {self.v.n} controls of degrees {self.u.degree} and {self.v.degree}"
        return f"TwoParameterMotion({kind}, {net}, u {between(a, b)}, v {between(c, d)})"

    @cached_property
    def _scipy(self) -> "NdBSpline":
        from scipy.interpolate import NdBSpline  # here: see Spline

        dual = np.zeros_like(self.real) if self.dual is None else self.dual
        controls = np.concatenate([self.real, dual], axis=-1)
        return NdBSpline((self.u.knots, self.v.knots), controls, (self.u.degree, self.v.degree))

    def pair(self, u: ArrayLike, v: ArrayLike, nu: tuple[int, int] = (0, 0)) -> Pair:
        """Partial derivatives of real and dual part, of order nu by (u, v); u and v broadcast, + (4,) each.

        Raises InputError outside the domain.
        """
        if len(nu) != 2 or min(nu) < 0:
            raise InputError(f"derivative orders {nu!r}: two, 0 or more, are needed")
        u, v = numbers(u, "u"), numbers(v, "v")
        for basis, x, name in ((self.u, u, "u"), (self.v, v, "v")):
            try:
                basis.spans(x)
            except InputError as error:
                raise InputError(f"{name}: {error}") from None
        points = np.stack(np.broadcast_arrays(u, v), axis=-1)
        if nu[0] > self.u.degree or nu[1] > self.v.degree:
            zero = np.zeros((*points.shape[:-1], 4))
            return zero, zero
        values = self._scipy(points, nu=nu)
        return values[..., :4], values[..., 4:]

    def __call__(self, u: ArrayLike, v: ArrayLike, nu: tuple[int, int] = (0, 0)) -> Affine:
        """Rotation matrices (…, 3, 3) and translations (…, 3), or their partial derivatives; u and v broadcast."""
        return positions(lambda k: self.pair(u, v, (k[0], k[1])), tuple(nu))

    def trajectory(self, points: ArrayLike, u: ArrayLike, v: ArrayLike, nu: tuple[int, int] = (0, 0)) -> np.ndarray:
        """Trajectory surfaces of body points (P, 3), or their partial derivatives: … + (P, 3), P = 1 for a point (3,).

        PCG (13); u and v broadcast.
        """
        return self(u, v, nu)(as_points(points))

    def rodrigues(
        self, u: ArrayLike, v: ArrayLike, nu: tuple[int, int] = (0, 0), reference: ArrayLike | None = None
    ) -> np.ndarray:
        """(…, 3) the quaternion surface in E³, Rodrigues vectors tan(θ/2) s of M⁻¹Q, or its partial derivatives.

        The central projection of the image space whose centre of view is the origin and whose
        plane touches at M: a rational B-spline surface, as smooth as the motion, the same for
        all scales of Q. reference: M (4,), the mean rotation of the controls when left out.
        """
        mean = conjugate(self.mean_rotation if reference is None else floats(reference, "reference"))

        def parts(k):
            q = product(mean, self.pair(u, v, k)[0])
            return q[..., 1:], q[..., 0]

        return quotient(parts, tuple(nu))

    @cached_property
    def mean_rotation(self) -> np.ndarray:
        """(4,) the unit quaternion closest to all controls, with their sign."""
        flat = self.real.reshape(-1, 4)
        flat = flat / np.linalg.norm(flat, axis=1, keepdims=True)
        mean = np.linalg.eigh(flat.T @ flat)[1][:, -1]
        return mean if (flat @ mean).sum() >= 0 else -mean

    def dual_image(self, u: ArrayLike, v: ArrayLike, nu: tuple[int, int] = (0, 0)) -> np.ndarray:
        """(…, 3) the surface of the dual part in E³, 2 vec(Q⁰M*) with M the mean rotation, or partial derivatives.

        A B-spline surface, linear in the dual parts; where Q is M it is the translation.
        """
        return 2 * product(self.pair(u, v, nu)[1], conjugate(self.mean_rotation))[..., 1:]

    def isoparametric(self, *, u: float | None = None, v: float | None = None) -> RationalMotion:
        """The one-parameter motion of one parameter where the other is fixed, exactly."""
        if (u is None) == (v is None):
            raise InputError("one of u and v must be given")
        basis, where = (self.u, u) if v is None else (self.v, v)
        assert where is not None
        row = basis(where)[0]
        other = self.v if v is None else self.u
        subscripts = "i,ijk->jk" if v is None else "j,ijk->ik"
        dual = None if self.dual is None else np.einsum(subscripts, row, self.dual)
        return RationalMotion(other, np.einsum(subscripts, row, self.real), dual)

    def boundary(self, side: Side) -> RationalMotion:
        """A boundary motion: where u begins, "u0", or ends, "u1", or v, "v0", "v1"."""
        choice(side, get_args(Side), "side")
        end = self.domain["uv".index(side[0])][int(side[1])]
        return self.isoparametric(u=end) if side[0] == "u" else self.isoparametric(v=end)

    def along(self, curve: Spline) -> CurveMotion:
        """The one-parameter motion along a curve (u(t), v(t)) in the domain, a spline of points (2,)."""
        return CurveMotion(self, curve)

    plot = plot_net
    save = save
    _repr_html_ = as_html


def as_basis(knots: Knots, n: int, degree: int, name: str) -> BSplineBasis:
    """The basis of n functions that `knots` says; InputError where it has another number of them."""
    if isinstance(knots, BSplineBasis):
        if knots.n != n:
            raise InputError(f"the basis in {name} has {knots.n} functions for {n} controls")
        return knots
    if n <= degree:
        raise InputError(f"{n} controls in {name} are too few for degree {degree}: at least {degree + 1} are needed")
    if knots == "uniform":
        return BSplineBasis(np.arange(n + degree + 1.0), degree)
    if knots == "clamped":
        return BSplineBasis.clamped(np.arange(n - degree + 1.0), degree)
    raise InputError(
        f"knots in {name}: {knots!r} is unknown; uniform, clamped, chordal, centripetal or a BSplineBasis is needed"
    )


def simple_knots(
    net: DualQuaternions, axis: int, degree: int, root: bool, points: ArrayLike | None = None
) -> BSplineBasis:
    """The basis whose knots are as far apart as the body points of a net (n, m) move along an axis.

    Control i belongs to the parameter t_i, the average over the lines of the (root of the) distances before it, and a
    knot to that half-way through the degree + 2 that its function has; beyond the ends the last distance is repeated.
    Raises InputError where neighbouring lines of controls coincide.
    """
    body = np.eye(3) if points is None else array(points, ("P", 3), "points")
    count = net.shape[axis]
    if count <= degree:
        raise InputError(f"{count} controls in {'uv'[axis]} are too few for degree {degree}")
    places = np.moveaxis(net.matrices(body), axis, 0)
    far = np.sqrt(np.mean(np.sum(np.diff(places, axis=0) ** 2, axis=-1), axis=-1))
    steps = np.mean(np.sqrt(far) if root else far, axis=tuple(range(1, far.ndim)))
    if not (steps > 0).all():
        i = int(np.argmin(steps))
        raise InputError(f"controls {i} and {i + 1} in {'uv'[axis]} are the same everywhere: no distance lies between")
    steps = steps / steps.mean()
    beyond = degree
    steps = np.concatenate([np.full(beyond, steps[0]), steps, np.full(beyond, steps[-1])])
    t = np.concatenate([[0.0], np.cumsum(steps)])
    middles = np.arange(count + degree + 1) - (degree + 1) / 2 + beyond
    knots = np.interp(middles, np.arange(len(t)), t)
    return BSplineBasis(knots - knots[0], degree)
