"""Motions that are there, seen as jets: the entries of their jets as numbers at times, and on pieces as polynomials."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Protocol, runtime_checkable

import casadi as ca
import numpy as np

from symmotion.errors import InputError
from symmotion.jets.affine import HIGHEST_ORDER, affine_jet
from symmotion.jets.curve import curve_jet
from symmotion.jets.jet import AnyJet
from symmotion.jets.rigid import rigid_jet
from symmotion.jets.turned import turned_pieces
from symmotion.motions import AffineMotion, PoseMotion
from symmotion.motions.quaternions import ProductMotion, QuaternionMotion
from symmotion.motions.quaternions.turning import QuaternionJet
from symmotion.splines import Spline, SplineLike
from symmotion.splines.pieces import EPS, Poly, spline_pieces

ORDERS = HIGHEST_ORDER + 1


class Called(Protocol):
    """A motion or curve of any kind, of the user's own too: called with times and an order of derivative."""

    # Any: positions, unit quaternions or points, as its kind has it.
    def __call__(self, t: np.ndarray, nu: int = 0, /) -> Any: ...


@runtime_checkable
class Timed(Called, Protocol):
    """One that says when it begins and ends."""

    @property
    def domain(self) -> tuple[float, float]: ...


class Seen(Protocol):
    """A motion as jets of symbols, with what their entries are. It has what a `Setting` asks of a space."""

    @property
    def domain(self) -> tuple[float, float]: ...

    @property
    def breakpoints(self) -> np.ndarray: ...

    def symbols(self, slot: int = 0) -> AnyJet:
        """A jet whose entries are symbols."""
        ...

    def numbers(self, times: np.ndarray, needed: Sequence[int]) -> np.ndarray:
        """(N, entries) at times (N,); what is not needed may be zero."""
        ...

    def pieces(self, left: np.ndarray, right: np.ndarray, needed: Sequence[int]) -> dict[int, Poly] | None:
        """The entries needed on pieces from left to right (S,), each inside a span; None where there is no bound."""
        ...


@dataclass(frozen=True, eq=False)
class SeenSpline:
    """A spline of all coordinates: an affine motion's or a curve's.

    spline: controls (n, W), those of a body each matrix row by row, then the point; dimension: of the body, 0 of
    a curve; shape: (rows, columns) of a curve's values.
    """

    spline: Spline
    dimension: int = 0
    shape: tuple[int, int] = (0, 0)

    @property
    def domain(self) -> tuple[float, float]:
        return self.spline.domain

    @property
    def breakpoints(self) -> np.ndarray:
        return self.spline.breakpoints

    @property
    def width(self) -> int:
        return self.spline.control_points.shape[1]

    def symbols(self, slot: int = 0) -> AnyJet:
        symbols = ca.SX.sym("jet", ORDERS * self.width + 1)
        return affine_jet(symbols, self.dimension) if self.dimension else curve_jet(symbols, self.shape)

    @cached_property
    def places(self) -> list[tuple[int, int]]:
        """Of every entry but the time its order and coordinate."""
        d, (rows, columns) = self.dimension, self.shape
        if not d:
            order = np.arange(self.width).reshape(rows, columns).T.ravel().tolist()
            return [(k, c) for k in range(ORDERS) for c in order]
        linear = np.arange(d * d).reshape(d, d).T.ravel().tolist()
        return [(k, c) for k in range(ORDERS) for c in linear] + [
            (k, d * d + c) for k in range(ORDERS) for c in range(d)
        ]

    def numbers(self, times: np.ndarray, needed: Sequence[int]) -> np.ndarray:
        found = np.zeros((len(times), len(self.places) + 1))
        found[:, -1] = times
        orders = {self.places[i][0] for i in needed if i < len(self.places)}
        values = {k: self.spline(times, k) for k in orders}
        for i in needed:
            if i < len(self.places):
                order, coordinate = self.places[i]
                found[:, i] = values[order][:, coordinate]
        return found

    def pieces(self, left: np.ndarray, right: np.ndarray, needed: Sequence[int]) -> dict[int, Poly] | None:
        found = {i: time_pieces(left, right) for i in needed if i == len(self.places)}
        places = {i: self.places[i] for i in needed if i < len(self.places)}
        read = sorted({c for _, c in places.values()})
        part = Spline(self.spline.basis, self.spline.control_points[:, read])
        orders = spline_pieces(part, left, right, 1 + max((k for k, _ in places.values()), default=0))
        for i, (order, coordinate) in places.items():
            coefficients, error = orders[order]
            c = read.index(coordinate)
            found[i] = Poly.of(coefficients[:, c], error[c])
        return found


@dataclass(frozen=True, eq=False)
class SeenRigid:
    """A quaternion curve, or a pose with its path."""

    motion: QuaternionMotion | ProductMotion | PoseMotion

    @property
    def curve(self) -> QuaternionMotion | ProductMotion:
        return self.motion.orientation if isinstance(self.motion, PoseMotion) else self.motion

    @property
    def domain(self) -> tuple[float, float]:
        return self.motion.domain

    @property
    def breakpoints(self) -> np.ndarray:
        return self.motion.breakpoints

    @property
    def pose(self) -> bool:
        return isinstance(self.motion, PoseMotion)

    def symbols(self, slot: int = 0) -> AnyJet:
        return rigid_jet(ca.SX.sym("jet", 23 if self.pose else 11), self.pose)

    def numbers(self, times: np.ndarray, needed: Sequence[int]) -> np.ndarray:
        jet = self.curve.jet(times, 2)
        columns = [jet.quaternion, jet.rate, jet.acceleration]
        if isinstance(self.motion, PoseMotion):
            columns += [self.motion.translation(times, order) for order in range(ORDERS)]
        return np.column_stack([*columns, times])

    def pieces(self, left: np.ndarray, right: np.ndarray, needed: Sequence[int]) -> dict[int, Poly] | None:
        turned, curve, found = [i for i in needed if i < 10], self.curve, {}
        if turned:
            if not isinstance(curve, QuaternionMotion):
                return None
            found = turned_pieces(curve, left, right, turned)
        if isinstance(self.motion, PoseMotion):
            moved = SeenSpline(self.motion.translation, shape=(3, 1))
            path = [i - 10 for i in needed if 10 <= i < 22]
            found |= {i + 10: poly for i, poly in (moved.pieces(left, right, path) or {}).items()} if path else {}
            last = 22
        else:
            last = 10
        return found | ({last: time_pieces(left, right)} if last in needed else {})


@dataclass(frozen=True, eq=False)
class SeenSampled:
    """Any other motion, called with (times, order): known at times only."""

    motion: Called

    @property
    def domain(self) -> tuple[float, float]:
        assert isinstance(self.motion, Timed)
        return self.motion.domain

    @property
    def breakpoints(self) -> np.ndarray:
        marks = getattr(self.motion, "breakpoints", None)
        return np.array(self.domain) if marks is None else np.asarray(marks, dtype=float)

    @cached_property
    def _shape(self) -> tuple[int, int]:
        value = np.asarray(self.motion(np.array([self.domain[0]])))[0]
        return (value.size, 1) if value.ndim < 2 else value.shape

    @property
    def turns(self) -> Callable[[np.ndarray, int], QuaternionJet] | None:
        return getattr(self.motion, "jet", None)

    @property
    def dimension(self) -> int:
        return int(getattr(self.motion, "dimension", 0))

    def symbols(self, slot: int = 0) -> AnyJet:
        if self.turns is not None:
            return rigid_jet(ca.SX.sym("jet", 11), False)
        d = self.dimension
        if d:
            return affine_jet(ca.SX.sym("jet", ORDERS * (d * d + d) + 1), d)
        return curve_jet(ca.SX.sym("jet", ORDERS * int(np.prod(self._shape)) + 1), self._shape)

    def numbers(self, times: np.ndarray, needed: Sequence[int]) -> np.ndarray:
        if self.turns is not None:
            jet = self.turns(times, 2)
            return np.column_stack([jet.quaternion, jet.rate, jet.acceleration, times])
        d, n, columns = self.dimension, len(times), []
        size = d * d + d if d else int(np.prod(self._shape))
        read = {i // (d * d) if i < ORDERS * d * d else (i - ORDERS * d * d) // d for i in needed} if d else set()
        for k in range(ORDERS):
            # Only the derivatives that are read are asked for: not every motion has them all.
            if d and k in read:
                there = self.motion(times, k)
                columns.append((np.swapaxes(there.linear, 1, 2).reshape(n, -1), there.translation))
            elif d:
                columns.append((np.zeros((n, d * d)), np.zeros((n, d))))
            elif any(k * size <= i < (k + 1) * size for i in needed):
                there = np.asarray(self.motion(times, k)).reshape(n, *self._shape)
                columns.append(np.swapaxes(there, 1, 2).reshape(n, -1))
            else:
                columns.append(np.zeros((n, size)))
        parts = [c[0] for c in columns] + [c[1] for c in columns] if d else columns
        return np.column_stack([*parts, times])

    def pieces(self, left: np.ndarray, right: np.ndarray, needed: Sequence[int]) -> dict[int, Poly] | None:
        return None


def time_pieces(left: np.ndarray, right: np.ndarray) -> Poly:
    """The time itself."""
    return Poly.of(np.stack([left, right]), EPS * np.maximum(np.abs(left), np.abs(right)))


def seen(motion: object) -> Seen:
    """A motion or curve of any kind as jets; InputError where it is none."""
    if isinstance(motion, AffineMotion):
        return SeenSpline(motion.spline, motion.dimension)
    if isinstance(motion, QuaternionMotion | ProductMotion | PoseMotion):
        return SeenRigid(motion)
    spline = _as_spline(motion)
    if spline is not None:
        shape = spline.control_points.shape[1:]
        flat = Spline(spline.basis, spline.control_points.reshape(spline.basis.n, -1))
        return SeenSpline(flat, shape=shape if len(shape) == 2 else (flat.control_points.shape[1], 1))
    ends = getattr(motion, "domain", None)
    if not isinstance(motion, Timed) or not isinstance(ends, tuple | list) or np.shape(ends) != (2,):
        raise InputError(f"motion: a {type(motion).__name__} is no motion or curve with a domain (begin, end)")
    return SeenSampled(motion)


def _as_spline(curve: object) -> Spline | None:
    """The curve as a spline, None where it is none."""
    if not isinstance(curve, SplineLike):
        return None
    try:
        return curve.to_bspline()
    except InputError:  # one in another time, say
        return None
