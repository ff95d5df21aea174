"""Interpolants of affine keyframes that need no optimisation: what the optimum is compared with.

Values and derivatives are exact up to rounding: every one of these motions is made of
exponentials of polynomials, whose Taylor coefficients at t are the blocks of one larger
exponential. At a keyframe derivatives are those of the segment that begins there.
"""

from collections.abc import Callable
from dataclasses import replace
from functools import cached_property
from math import factorial
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import ArrayLike
from scipy import linalg as la

from symmotion.brief import in_a_line
from symmotion.checks import choice, numbers
from symmotion.errors import InputError
from symmotion.motions.affine import AffineMotion
from symmotion.motions.keyframes import Keyframes
from symmotion.motions.motion import matrix, trajectory
from symmotion.motions.position import Affine
from symmotion.motions.rigid import polar_factors
from symmotion.pictures import as_html, plot_positions
from symmotion.saving import save
from symmotion.splines import BSplineBasis, Spline, cubic_interpolant
from symmotion.splines.instants import put_inside
from symmotion.values import read_only, value

if TYPE_CHECKING:
    from scipy.spatial.transform import RotationSpline

TURN_2D = np.array([[0.0, -1.0], [1.0, 0.0]])
# (3, 3, 3): the skew matrix of a vector w is TURN_3D @ w.
TURN_3D = np.array(
    [[[0, 0, 0], [0, 0, -1], [0, 1, 0]], [[0, 0, 1], [0, 0, 0], [-1, 0, 0]], [[0, -1, 0], [1, 0, 0], [0, 0, 0]]]
).transpose(1, 2, 0)
# Turned by 180° up to this, relative, an eigenvalue counts as negative: its logarithm has no direction.
NEGATIVE = 1e-9

# Taylor coefficients of matrices at times (N,) up to an order: (order + 1, N, n, n).
Series = Callable[[np.ndarray, int], np.ndarray]

# Padé's coefficients of degree 13 for exp, and the largest norm for which they serve.
PADE = tuple(factorial(26 - k) * factorial(13) / (factorial(13 - k) * factorial(k) * factorial(26)) for k in range(14))
PADE_REACH = 5.37


@value
class Interpolant:
    """An affine motion given by the Taylor series of its homogeneous matrix ((A, v), (0, 1)).

    name: what it is; keyframes: what it passes through; series: its coefficients, of a function of
    your own too, but then it cannot be saved; highest: the highest derivative that it has, None for any.
    """

    name: str
    keyframes: Keyframes
    series: Series
    highest: int | None = None

    @property
    def dimension(self) -> int:
        return self.keyframes.dimension

    @property
    def domain(self) -> tuple[float, float]:
        return float(self.keyframes.times[0]), float(self.keyframes.times[-1])

    @property
    def breakpoints(self) -> np.ndarray:
        """The times of the keyframes, between which it is smooth."""
        return self.keyframes.times

    def __repr__(self) -> str:
        return f"Interpolant({self.name}, {self.keyframes!r})"

    def __call__(self, t: ArrayLike, nu: int = 0) -> Affine:
        """The nu-th derivative at times t: linear t.shape + (d, d), translation t.shape + (d,).

        Raises InputError outside the domain and for a derivative that is not to be had.
        """
        d = self.dimension
        if nu < 0 or (self.highest is not None and nu > self.highest):
            raise InputError(f"derivative order {nu} of {self.name}: 0 to {self.highest or 'any'} can be had")
        t = put_inside(t, self.domain, "time", f" of {self.name}")
        moved = factorial(nu) * self.series(t.ravel(), nu)[nu].reshape(*t.shape, d + 1, d + 1)
        return Affine(moved[..., :d, :d], moved[..., :d, d])

    @property
    def relative(self) -> "Interpolant":
        """The same motion with its time counted from its beginning, where times have all their digits."""
        begin = self.domain[0]
        if begin == 0.0 or not isinstance(self.series, BLENDS):
            return self
        keys = self.keyframes
        return replace(self, keyframes=keys.with_times(keys.times - begin), series=self.series.since(begin))

    matrix = matrix
    trajectory = trajectory
    save = save
    plot = plot_positions
    _repr_html_ = as_html


def component_cubic(keyframes: Keyframes, ends: str = "natural") -> AffineMotion:
    """Every entry of A and v by a C² cubic spline with simple knots at the keyframe times (HJK 2.2).

    keyframes: affine; ends: as in `affine_program`.

    Raises InputError for ends that are none, and keyframes that do not close where they should.

    >>> motion = sm.interpolants.component_cubic(sm.examples.planar_keyframes())
    >>> motion
    AffineMotion(2D, degree 3, 6 controls, times 0 to 1)
    """
    values = keyframes.coordinates
    return AffineMotion.from_spline(cubic_interpolant(keyframes.times, values, ends), keyframes.dimension)


def polar_blend(keyframes: Keyframes, rotation: Literal["spline", "slerp"] = "spline") -> Interpolant:
    """A(t) = M(t) S(t): rotations and stretches A_i = M_i S_i, polar factors, interpolated apart.

    S and v by natural cubic splines. M by "slerp" (steady turns, continuous only) or "spline",
    C²: in the plane the cubic spline of the angle, in space SciPy's `RotationSpline`, which has
    two derivatives to offer. Either way a turn goes the shorter way round; one by exactly 180°
    goes either way.

    Raises InputError that names a keyframe that is singular or reflected. Source: Shoemake and Duff 1992.

    keyframes: affine, of one orientation; rotation: how the rotations are interpolated.

    >>> keys = sm.examples.quarter_turn()
    >>> sm.interpolants.polar_blend(keys)(0.5).linear.round(6)
    array([[ 0.707107, -0.707107],
           [ 0.707107,  0.707107]])
    """
    choice(rotation, ("spline", "slerp"), "rotation")
    keyframes.require_orientation("the polar decomposition")
    turns, stretches, _ = polar_factors(keyframes.linear)
    sizes = cubic_interpolant(keyframes.times, stretches)
    path = cubic_interpolant(keyframes.times, keyframes.translation)
    turning = (_planar_turns if keyframes.dimension == 2 else _spatial_turns)(keyframes.times, turns, rotation)
    highest = 2 if rotation == "spline" and keyframes.dimension == 3 else None
    return Interpolant(f"polar decomposition, {rotation}", keyframes, Polar(turning, sizes, path), highest)


def log_blend(keyframes: Keyframes, degree: Literal[1, 3] = 1) -> Interpolant:
    """H(t) = exp(L(t)) with L through the logarithms log H_i of the homogeneous matrices.

    degree: of L: 1 for exp((1 − s) log H_i + s log H_{i+1}) in every segment, continuous only;
    3 for the natural cubic spline, C². The logarithms are principal ones, of the keyframes as
    they are: those of keyframes that are turned by nearly 180° to one and to the other side lie
    far apart, and the motion between such goes the long way round.

    Raises InputError that names a keyframe with no real principal logarithm: one that is
    singular, reflected or turned by 180°. Source: Alexa 2002.

    >>> keys = sm.Keyframes([0.0, 1.0], [np.eye(2), 4 * np.eye(2)])
    >>> sm.interpolants.log_blend(keys)(0.5).linear.round(9) + 0.0
    array([[2., 0.],
           [0., 2.]])
    """
    if degree not in (1, 3):
        raise InputError(f"degree {degree!r} of the logarithm: 1 or 3 is needed")
    matrices = _matrices(keyframes)
    unit = _unit(matrices)
    logs = unit * np.stack([_logarithm(m, f"keyframe {i}") for i, m in enumerate(matrices / unit)])
    times = keyframes.times
    generator = cubic_interpolant(times, logs) if degree == 3 else Spline(BSplineBasis.clamped(times, 1), logs)
    name = f"logarithm blending, {'linear' if degree == 1 else 'cubic'}"
    return Interpolant(name, keyframes, Exponential(generator))


def steady_morph(keyframes: Keyframes) -> Interpolant:
    """H(t) = H_i (H_i⁻¹ H_{i+1})ˢ in every segment, s from 0 to 1, with the homogeneous matrices H_i.

    Every segment has a constant velocity in the body's frame; at the keyframes it jumps.
    Keyframes of constant ratio, H_i = H_0 Xⁱ at equal steps, give H_0 Xᵗ throughout.

    Raises InputError that names neighbours whose ratio has no real principal logarithm: one of
    them is singular or reflected, or they are turned by 180°. Source: Rossignac and Vinacua 2011.

    >>> keys = sm.Keyframes([0.0, 1.0], [np.eye(2), 4 * np.eye(2)])
    >>> sm.interpolants.steady_morph(keys)(0.5).linear.round(9) + 0.0
    array([[2., 0.],
           [0., 2.]])
    """
    matrices, linear = _matrices(keyframes), keyframes.linear
    for i, one in enumerate(linear):
        if np.linalg.cond(one) > 1 / np.finfo(float).eps:
            raise InputError(f"keyframe {i} is singular: a steady morph from or to it does not exist")
    # By the differences of the translations, which do not know where the origin is.
    travel = np.diff(keyframes.translation, axis=0)[..., None]
    moved = np.linalg.solve(linear[:-1], np.concatenate([linear[1:], travel], axis=2))
    ratios = _homogeneous(moved[None, ..., :-1], moved[None, ..., -1])[0]
    unit = _unit(ratios)
    logs = [unit * _logarithm(r, f"keyframe {i + 1} against keyframe {i}") for i, r in enumerate(ratios / unit)]
    return Interpolant("steady affine morph", keyframes, Steady(keyframes.times, matrices[:-1], np.stack(logs)))


def _matrices(keyframes: Keyframes) -> np.ndarray:
    """(M, d + 1, d + 1) the homogeneous matrices."""
    return _homogeneous(keyframes.linear[None], keyframes.translation[None])[0]


def _unit(matrices: np.ndarray) -> np.ndarray:
    """(n, n) what entries of homogeneous matrices are divided by so that translations are of order one.

    H → D⁻¹ H D entry by entry, with D = diag(u, …, u, 1): it passes through logarithm and exponential. A power of two.
    """
    size = float(np.abs(matrices[..., :-1, -1]).max(initial=0.0))
    unit = np.ones(matrices.shape[-2:])
    unit[:-1, -1] = 2.0 ** np.round(np.log2(size)) if size > 0 else 1.0
    unit[-1, :-1] = 1 / unit[:-1, -1]
    return unit


def _logarithm(matrix: np.ndarray, whose: str) -> np.ndarray:
    """The real principal logarithm; InputError with `whose` where there is none."""
    eigenvalues = np.linalg.eigvals(matrix)
    sizes = np.abs(eigenvalues)
    none = (eigenvalues.real <= 0) & (np.abs(eigenvalues.imag) <= NEGATIVE * sizes)
    none |= sizes <= np.finfo(float).eps * sizes.max()
    if none.any():
        value = eigenvalues[np.argmax(none)].real
        raise InputError(
            f"{whose} has no real principal logarithm (eigenvalue {value:.3g}): it is turned by 180°, reflected or "
            "singular; put a keyframe between or use polar_blend"
        )
    return np.real(la.logm(matrix))


def _segment(times: np.ndarray, t: np.ndarray) -> np.ndarray:
    """(N,) the segment of each time, of those that begin with a keyframe the one after it."""
    return np.clip(np.searchsorted(times, t, side="right") - 1, 0, len(times) - 2)


@value
class Steady:
    """B_i exp(s L_i) with s from 0 to 1 in segment i.

    times: (M,); matrices, logs: (M − 1, n, n) B_i and L_i.
    """

    times: np.ndarray
    matrices: np.ndarray
    logs: np.ndarray

    __repr__ = in_a_line

    def __post_init__(self):
        for name in ("times", "matrices", "logs"):
            object.__setattr__(self, name, read_only(numbers(getattr(self, name), name)))

    def since(self, begin: float) -> "Steady":
        """The same with times counted from a beginning."""
        return replace(self, times=self.times - begin)

    def __call__(self, t: np.ndarray, order: int) -> np.ndarray:
        i = _segment(self.times, t)
        step = np.diff(self.times)[i]
        generator = np.zeros((order + 1, len(t), *self.logs.shape[1:]))
        generator[0] = ((t - self.times[i]) / step)[:, None, None] * self.logs[i]
        if order:
            generator[1] = self.logs[i] / step[:, None, None]
        unit = _unit(self.logs)
        return self.matrices[i] @ (unit * _exponential(generator / unit))


@value
class Exponential:
    """exp(L(t)) with a spline L of matrices."""

    generator: Spline

    __repr__ = in_a_line

    def since(self, begin: float) -> "Exponential":
        """The same with times counted from a beginning."""
        return Exponential(self.generator.about(begin).relative)

    def __call__(self, t: np.ndarray, order: int) -> np.ndarray:
        unit = _unit(self.generator.control_points)
        return unit * _exponential(_of_spline(self.generator, t, order) / unit)


@value
class PlanarTurns:
    """Planar rotations by a spline of angles."""

    angle: Spline

    __repr__ = in_a_line

    def since(self, begin: float) -> "PlanarTurns":
        """The same with times counted from a beginning."""
        return PlanarTurns(self.angle.about(begin).relative)

    def __call__(self, t: np.ndarray, order: int) -> np.ndarray:
        return _exponential(_of_spline(self.angle, t, order)[..., None, None] * TURN_2D)


@value
class SpatialTurns:
    """SciPy's `RotationSpline` through rotation matrices (M, 3, 3) at times (M,), up to order 2."""

    times: np.ndarray
    rotations: np.ndarray

    __repr__ = in_a_line

    def __post_init__(self):
        for name in ("times", "rotations"):
            object.__setattr__(self, name, read_only(numbers(getattr(self, name), name)))

    def since(self, begin: float) -> "SpatialTurns":
        """The same with times counted from a beginning."""
        return replace(self, times=self.times - begin)

    @cached_property
    def _scipy(self) -> "RotationSpline":
        from scipy.spatial.transform import Rotation, RotationSpline  # here: see as_rotations

        # In steps of order one: SciPy ends its iterations by a change of rates, whatever their unit.
        steps = (self.times - self.times[0]) / self._step
        return RotationSpline(steps, Rotation.from_matrix(self.rotations.copy()))

    @property
    def _step(self) -> float:
        """The mean time between the rotations."""
        return float(self.times[-1] - self.times[0]) / (len(self.times) - 1)

    def __call__(self, t: np.ndarray, order: int) -> np.ndarray:
        # Ṁ = M ω̂ and M̈ = M (ω̂² + α̂) with SciPy's rates, which are those in the body's frame.
        spline, step = self._scipy, self._step
        s = np.clip((t - self.times[0]) / step, 0.0, float(len(self.times) - 1))
        turn, rate, acceleration = spline(s).as_matrix(), _skew(spline(s, 1) / step), _skew(spline(s, 2) / step**2)
        return np.stack([turn, turn @ rate, 0.5 * turn @ (rate @ rate + acceleration)])[: order + 1]


@value
class Polar:
    """M(t) S(t) beside v(t): rotations, and splines of stretches and translations."""

    turning: Steady | PlanarTurns | SpatialTurns
    sizes: Spline
    path: Spline

    __repr__ = in_a_line

    def since(self, begin: float) -> "Polar":
        """The same with times counted from a beginning."""
        sizes, path = (part.about(begin).relative for part in (self.sizes, self.path))
        return Polar(self.turning.since(begin), sizes, path)

    def __call__(self, t: np.ndarray, order: int) -> np.ndarray:
        linear = _product(self.turning(t, order), _of_spline(self.sizes, t, order))
        return _homogeneous(linear, _of_spline(self.path, t, order))


BLENDS = (Steady, Exponential, Polar)


def _planar_turns(times: np.ndarray, turns: np.ndarray, rotation: str) -> PlanarTurns:
    angles = np.unwrap(np.arctan2(turns[:, 1, 0], turns[:, 0, 0]))
    angle = cubic_interpolant(times, angles) if rotation == "spline" else Spline(BSplineBasis.clamped(times, 1), angles)
    return PlanarTurns(angle)


def _spatial_turns(times: np.ndarray, turns: np.ndarray, rotation: str) -> Steady | SpatialTurns:
    if rotation == "spline":
        return SpatialTurns(times, turns)
    from scipy.spatial.transform import Rotation  # here: see as_rotations

    rotations = Rotation.from_matrix(turns)
    return Steady(times, turns[:-1], _skew((rotations[:-1].inv() * rotations[1:]).as_rotvec()))


def _skew(vectors: np.ndarray) -> np.ndarray:
    """(N, 3, 3) the matrices of w ×."""
    return np.einsum("ijk,nk->nij", TURN_3D, vectors)


def _of_spline(spline: Spline, t: np.ndarray, order: int) -> np.ndarray:
    """(order + 1, N, …) the Taylor coefficients of a spline."""
    return np.stack([spline(t, k) / factorial(k) for k in range(order + 1)])


def _product(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """The Taylor coefficients of a product of matrices."""
    return np.stack([sum(a[j] @ b[k - j] for j in range(k + 1)) for k in range(len(a))])


def _exponential(generator: np.ndarray) -> np.ndarray:
    """The Taylor coefficients of exp(L(t)) from those of L.

    The exponential of the block Toeplitz matrix with L's coefficients in its first row has
    those of exp(L) in its first row: both stand for the same polynomials in a nilpotent matrix.
    """
    orders, count, n, _ = generator.shape
    # In a unit of time in which the rates are of order one: each squaring of larger ones loses digits.
    rates = [np.abs(generator[k]).max(initial=0.0) ** (1 / k) for k in range(1, orders)]
    fastest = max(rates, default=0.0)
    unit = 2.0 ** -np.ceil(np.log2(fastest)) if fastest > 1 else 1.0
    powers = unit ** np.arange(orders)[:, None, None, None]
    generator = generator * powers
    blocks = np.zeros((count, orders, n, orders, n))
    for k in range(orders):
        for j in range(orders - k):
            blocks[:, j, :, j + k, :] = generator[k]
    result = _exponentials(blocks.reshape(count, orders * n, orders * n))
    return result.reshape(count, orders, n, orders, n)[:, 0].transpose(2, 0, 1, 3) / powers


def _exponentials(matrices: np.ndarray) -> np.ndarray:
    """(N, n, n) exp of each, by scaling, Padé's [13/13] and squaring (Higham 2005).

    SciPy's takes them one by one, which at thousands of times is most of a measurement.
    """
    size = float(np.abs(matrices).sum(axis=-2).max(initial=0.0))
    squarings = max(0, int(np.ceil(np.log2(size / PADE_REACH)))) if size > PADE_REACH else 0
    a = matrices / 2.0**squarings
    b, one = PADE, np.eye(a.shape[-1])
    a2 = a @ a
    a4 = a2 @ a2
    a6 = a4 @ a2
    odd = a @ (a6 @ (b[13] * a6 + b[11] * a4 + b[9] * a2) + b[7] * a6 + b[5] * a4 + b[3] * a2 + b[1] * one)
    even = a6 @ (b[12] * a6 + b[10] * a4 + b[8] * a2) + b[6] * a6 + b[4] * a4 + b[2] * a2 + b[0] * one
    result = np.linalg.solve(even - odd, even + odd)
    for _ in range(squarings):
        result = result @ result
    return result


def _homogeneous(linear: np.ndarray, translation: np.ndarray) -> np.ndarray:
    """(order + 1, N, d + 1, d + 1) from coefficients of A and v."""
    d = translation.shape[-1]
    matrix = np.zeros((*translation.shape[:-1], d + 1, d + 1))
    matrix[..., :d, :d], matrix[..., :d, d] = linear, translation
    matrix[0, ..., d, d] = 1.0
    return matrix
