"""Conditions beside the keyframes, on the same footing: each named, each with its multipliers."""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, replace

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike
from scipy import sparse

from symmotion.design.jets import UNKNOWN, JetKernel, jet_symbols
from symmotion.errors import InputError
from symmotion.kernels import Kernel
from symmotion.motions import Keyframes
from symmotion.program import Block, Constraint
from symmotion.splines import BSplineBasis


@dataclass(frozen=True)
class Space:
    """What a condition needs to know of a program: its keyframes, its splines, its coordinates per control."""

    keyframes: Keyframes
    basis: BSplineBasis
    channels: int

    @property
    def d(self) -> int:
        return self.keyframes.dimension

    @property
    def moves(self) -> bool:
        """Whether the translation is part of the program."""
        return self.channels > self.d**2

    def keyframe(self, i: int, name: str) -> int:
        """The number of keyframe i, counted from the end where negative."""
        m = len(self.keyframes)
        if not -m <= i < m:
            raise InputError(f"{name}: keyframe {i} does not exist, there are {m}")
        return i % m

    def require_translation(self, name: str) -> None:
        if not self.moves:
            raise InputError(
                f"{name} is a condition on the translation, which the objective does not see: add a TrajectoryEnergy"
            )

    def block(self, name: str, out: ca.SX, times: np.ndarray, symbols: ca.SX | None = None, data=None) -> Block:
        """An expression of the jet at times (N,), with the numbers `data` (N, …) for `symbols`."""
        kernel = JetKernel.from_expression(out, self.d, name, symbols)
        return kernel.at(name, self.basis, np.asarray(times, dtype=float), data)


class MotionConstraint(ABC):
    """A condition on a motion. A subclass says which keyframes it frees and builds its part of the program."""

    name: str

    def named(self, name: str) -> "MotionConstraint":
        """The same condition under another name."""
        return replace(self, name=name)  # pyright: ignore[reportArgumentType] every subclass is a dataclass

    def frees(self, space: Space) -> tuple[set[int], set[int]]:
        """The keyframes whose linear part, and whose translation, are no longer interpolated."""
        return set(), set()

    @abstractmethod
    def build(self, space: Space) -> Constraint:
        """The condition as part of a program over this space."""


@dataclass(frozen=True)
class Velocity(MotionConstraint):
    """v̇(tᵢ) = velocity (d,) at keyframe i."""

    keyframe: int
    velocity: ArrayLike
    name: str = "velocity"

    def build(self, space: Space) -> Constraint:
        space.require_translation(self.name)
        i = space.keyframe(self.keyframe, self.name)
        jet, _ = jet_symbols(space.d)
        given = _vector(self.velocity, space.d, f"{self.name}: velocity")
        return Constraint.equality(space.block(self.name, jet.dv - given, space.keyframes.times[[i]]))


@dataclass(frozen=True)
class AngularRate(MotionConstraint):
    """Ȧ(tᵢ) = [ω] A(tᵢ) at keyframe i: there the body turns as a rigid one with the rate ω.

    rate: rad per unit of time about the fixed axes, (3,) in space, a number in the plane.
    """

    keyframe: int
    rate: ArrayLike
    name: str = "angular rate"

    def build(self, space: Space) -> Constraint:
        i = space.keyframe(self.keyframe, self.name)
        jet, _ = jet_symbols(space.d)
        w = _vector(np.atleast_1d(self.rate), 3 if space.d == 3 else 1, f"{self.name}: rate")
        spin = ca.skew(ca.DM(w)) if space.d == 3 else ca.DM([[0, -w[0]], [w[0], 0]])
        return Constraint.equality(
            space.block(self.name, ca.vec((jet.dA - spin @ jet.A).T), space.keyframes.times[[i]])
        )


@dataclass(frozen=True)
class Periodic(MotionConstraint):
    """The motion closes: derivatives 1 … degree − 1 agree at both ends, where the keyframes are the same."""

    name: str = "periodic"

    def build(self, space: Space) -> Constraint:
        keys, basis = space.keyframes, space.basis
        scale = max(1.0, np.abs(keys.linear).max(), np.abs(keys.translation).max())
        apart = max(
            np.abs(keys.linear[0] - keys.linear[-1]).max(), np.abs(keys.translation[0] - keys.translation[-1]).max()
        )
        if apart > 1e-9 * scale:
            raise InputError(f"{self.name}: the first and the last keyframe differ by {apart:.2g}; make them the same")
        if basis.degree < 2:
            raise InputError(f"{self.name}: degree {basis.degree} has no derivative to close; degree 2 is needed")
        ends = np.array(basis.domain)
        rows = [basis.matrix(ends[1:], nu) - basis.matrix(ends[:1], nu) for nu in range(1, basis.degree)]
        # Derivatives grow with their order as the span shrinks; scaled they weigh alike.
        rows = [row / abs(row).max() for row in rows]
        z = ca.SX.sym("z", space.channels)
        kernel = Kernel(z, ca.SX.sym("none", 0), z, space.channels)
        operator = sparse.csr_array(sparse.vstack(rows))
        n = len(rows)
        return Constraint.equality(
            Block(self.name, kernel, UNKNOWN, slice(0, space.channels), operator, 1, np.ones(n), np.empty((n, 0)))
        )


@dataclass(frozen=True)
class UnitVolume(MotionConstraint):
    """det A(t) = 1 at given times, between the keyframes."""

    times: ArrayLike
    name: str = "unit volume"

    def build(self, space: Space) -> Constraint:
        jet, _ = jet_symbols(space.d)
        times = _times(self.times, space, self.name)
        on_keyframe = np.isin(times, space.keyframes.times)
        if on_keyframe.any():
            raise InputError(f"{self.name}: time {times[on_keyframe][0]:g} is a keyframe's, whose volume is given")
        return Constraint.equality(space.block(self.name, ca.det(jet.A) - 1, times))


@dataclass(frozen=True)
class OnLine(MotionConstraint):
    """v(tᵢ) lies on the line through keyframe i's translation along `direction` (d,), instead of being given."""

    keyframe: int
    direction: ArrayLike
    name: str = "line"

    def frees(self, space: Space) -> tuple[set[int], set[int]]:
        return set(), {space.keyframe(self.keyframe, self.name)}

    def build(self, space: Space) -> Constraint:
        space.require_translation(self.name)
        i = space.keyframe(self.keyframe, self.name)
        direction = _vector(self.direction, space.d, f"{self.name}: direction")
        if not direction.any():
            raise InputError(f"{self.name}: the direction is zero")
        jet, _ = jet_symbols(space.d)
        across = np.linalg.svd(direction[None])[2][1:]  # rows that span the directions across the line
        offset = ca.DM(across) @ (jet.v - space.keyframes.translation[i])
        return Constraint.equality(space.block(self.name, offset, space.keyframes.times[[i]]))


@dataclass(frozen=True)
class Tolerance(MotionConstraint):
    """Keyframes met to within ε instead of exactly: each entry |A(tᵢ) − A*ᵢ| ≤ ε, or the Frobenius norm, `norm`.

    linear, translation: the two ε, None for exact; keyframes: which, all when left out.
    """

    linear: float | None = None
    translation: float | None = None
    norm: bool = False
    keyframes: Sequence[int] | None = None
    name: str = "tolerance"

    def __post_init__(self):
        for what, value in (("linear", self.linear), ("translation", self.translation)):
            if value is not None and not (np.isfinite(value) and value > 0):
                raise InputError(f"{self.name}: {what} {value!r}: must be positive")
        if self.linear is None and self.translation is None:
            raise InputError(f"{self.name}: a tolerance on the linear part or the translation is needed")

    def _which(self, space: Space) -> list[int]:
        every = range(len(space.keyframes)) if self.keyframes is None else self.keyframes
        return sorted({space.keyframe(i, self.name) for i in every})

    def frees(self, space: Space) -> tuple[set[int], set[int]]:
        which = set(self._which(space))
        return (which if self.linear else set()), (which if self.translation else set())

    def build(self, space: Space) -> Constraint:
        if self.translation:
            space.require_translation(self.name)
        which, d = self._which(space), space.d
        keys, (jet, _) = space.keyframes, jet_symbols(d)
        target = ca.SX.sym("target", d * d + d)
        parts, limits = [], []
        for limit, off in (
            (self.linear, ca.vec(jet.A.T) - target[: d * d]),
            (self.translation, jet.v - target[d * d :]),
        ):
            if limit:
                parts.append(ca.sumsqr(off) if self.norm else off)
                limits.append(np.full(1, limit**2) if self.norm else np.full(off.numel(), limit))
        data = keys.coordinates[which]
        block = space.block(self.name, ca.vertcat(*parts), keys.times[which], target, data)
        upper = np.tile(np.concatenate(limits), (len(which), 1))
        return Constraint(block, np.full_like(upper, -np.inf) if self.norm else -upper, upper)


@dataclass(frozen=True)
class NoInversion(MotionConstraint):
    """det A(t) ≥ ε along the motion, at `density` times per segment between the keyframes."""

    least: float
    density: int = 8
    name: str = "no inversion"

    def build(self, space: Space) -> Constraint:
        volumes = np.linalg.det(space.keyframes.linear)
        if (volumes < self.least).any():
            i = int(np.argmin(volumes))
            raise InputError(f"{self.name}: keyframe {i} has determinant {volumes[i]:.3g}, below {self.least:g}")
        jet, _ = jet_symbols(space.d)
        block = space.block(self.name, ca.det(jet.A), dense_times(space.keyframes, self.density, self.name))
        return Constraint(block, np.full((block.count, 1), float(self.least)), np.full((block.count, 1), np.inf))


@dataclass(frozen=True)
class SpeedBound(MotionConstraint):
    """‖v̇ + Ȧ p‖ ≤ limit for body points p (P, d) along the motion, at `density` times per segment and its ends."""

    points: ArrayLike
    limit: float
    density: int = 8
    name: str = "speed"

    def build(self, space: Space) -> Constraint:
        space.require_translation(self.name)
        if not (np.isfinite(self.limit) and self.limit > 0):
            raise InputError(f"{self.name}: limit {self.limit!r}: must be positive")
        points = np.atleast_2d(np.asarray(self.points, dtype=float))
        if points.ndim != 2 or points.shape[1] != space.d or not np.isfinite(points).all():
            raise InputError(f"{self.name}: body points of shape {points.shape}: finite, (P, {space.d}), is needed")
        jet, _ = jet_symbols(space.d)
        squares = ca.vertcat(*(ca.sumsqr(jet.dv + jet.dA @ p) for p in points))
        times = np.union1d(dense_times(space.keyframes, self.density, self.name), space.keyframes.times)
        block = space.block(self.name, squares, times)
        upper = np.full((block.count, len(points)), float(self.limit) ** 2)
        return Constraint(block, np.full_like(upper, -np.inf), upper)


def dense_times(keyframes: Keyframes, density: int, name: str) -> np.ndarray:
    """`density` times inside every segment, equally spaced."""
    if density < 1:
        raise InputError(f"{name}: density {density}: at least 1 time per segment is needed")
    share = np.arange(1, density + 1) / (density + 1)
    return (keyframes.times[:-1, None] + np.diff(keyframes.times)[:, None] * share).ravel()


def _vector(value: ArrayLike, size: int, what: str) -> np.ndarray:
    vector = np.asarray(value, dtype=float)
    if vector.shape != (size,) or not np.isfinite(vector).all():
        raise InputError(f"{what} of shape {vector.shape}: finite, ({size},) is needed")
    return vector


def _times(value: ArrayLike, space: Space, name: str) -> np.ndarray:
    times = np.atleast_1d(np.asarray(value, dtype=float))
    a, b = space.basis.domain
    outside = ~((times >= a) & (times <= b))
    if times.ndim != 1 or not times.size or outside.any():
        worst = times[outside][0] if outside.any() else times
        raise InputError(f"{name}: time {worst} is outside the motion's domain [{a:g}, {b:g}]")
    return times
