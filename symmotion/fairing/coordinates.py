"""What of a motion's controls is faired: which coordinates, over which knots, and how they become a motion again."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, TypeVar, cast

import numpy as np

from symmotion import checks
from symmotion.brief import in_a_line, instants
from symmotion.errors import InputError
from symmotion.fairing.jumps import Jumps
from symmotion.motions.dual import DualQuaternions
from symmotion.motions.pose import PoseMotion
from symmotion.motions.quaternions import QuaternionMotion
from symmotion.motions.rational import RationalMotion
from symmotion.motions.two_parameter import TwoParameterMotion
from symmotion.splines import BSplineBasis, Spline, amid, unified

Rational = TwoParameterMotion | RationalMotion
Fairable = Rational | QuaternionMotion | PoseMotion
AnyMotion = TypeVar("AnyMotion", TwoParameterMotion, RationalMotion, QuaternionMotion, PoseMotion)
Parts = Literal["real", "dual", "translation", "real+dual", "real+translation"]
PARTS = ("real", "dual", "translation", "real+dual", "real+translation")


@dataclass(frozen=True, eq=False)
class Coordinates:
    """The coordinates of a motion's controls that are faired.

    parts: "real" (of a spatial motion: translations stay), "dual" or "translation" (the real
    part stays), or the real part together with one of them (PCG 6).
    length: the unit that dual parts and translations are divided by, so that they can be added
    to quaternions; G and displacements are in the result's units.

    Quaternion curves and pose motions are faired through their control polygons: the unit control
    quaternions as points of R⁴, of length 1 again afterwards, and the controls of the translation.

    Raises InputError for parts that the motion does not have, and a length that is not positive.

    >>> sm.fairing.Coordinates.of(sm.motions.smooth_net(6, spatial=True), None, 1.0).net.shape
    (6, 6, 8)
    """

    motion: Fairable
    parts: str
    length: float

    __repr__ = in_a_line

    @staticmethod
    def of(motion: Fairable, parts: str | None = None, length: float = 1.0) -> "Coordinates":
        """The coordinates, those of everything that moves when `parts` is left out; InputError for what cannot be."""
        if not isinstance(motion, Fairable):
            kind = type(motion).__name__
            raise InputError(
                f"{kind} cannot be faired; a TwoParameterMotion, RationalMotion, QuaternionMotion or PoseMotion can"
            )
        spherical = isinstance(motion, QuaternionMotion) or (isinstance(motion, Rational) and motion.spherical)
        pose = isinstance(motion, PoseMotion)
        if parts is None:
            parts = "real" if spherical else "real+translation" if pose else "real+dual"
        if not isinstance(parts, str) or parts not in PARTS:
            raise InputError(f"parts {checks.told(parts)} are unknown; there are {', '.join(PARTS)}")
        if spherical and parts != "real":
            raise InputError(f"parts {parts!r}: a spherical motion has real parts only")
        length = checks.positive(length, "length")
        if isinstance(motion, Rational):
            motion.control_displacements.require_aligned()
        else:
            _require_polygon(motion, parts)
        return Coordinates(motion, parts, length)

    @property
    def bases(self) -> tuple[BSplineBasis, ...]:
        """The bases of the coordinates, one of a curve, two of a net."""
        if isinstance(self.motion, QuaternionMotion):
            return (self.motion.basis,)
        if isinstance(self.motion, PoseMotion):
            pose = self.motion
            return (pose.translation.basis if self.parts == "translation" else pose.orientation.basis,)
        return self.motion.bases

    @property
    def spherical(self) -> bool:
        """Whether the motion turns about the origin only."""
        return not isinstance(self.motion, PoseMotion) and (self.normalised or self.rational.spherical)

    @property
    def normalised(self) -> bool:
        """Whether the control quaternions are of length 1, and what moves is not linear in them."""
        return not isinstance(self.motion, Rational)

    @property
    def rational(self) -> Rational:
        """The motion, of dual quaternions."""
        assert isinstance(self.motion, Rational)
        return self.motion

    @property
    def linear(self) -> bool:
        """Whether the motion's dual quaternions are the same combinations of the coordinates as of its controls."""
        return not self.normalised and (self.spherical or self.parts in ("dual", "real+dual"))

    @property
    def channels(self) -> int:
        """C, how many coordinates a control has."""
        return sum({"real": 4, "dual": 4, "translation": 3}[part] for part in self.parts.split("+"))

    @property
    def lengths(self) -> slice:
        """Which coordinates are lengths, of which the real part has none."""
        return slice(4 if self.parts.startswith("real") else 0, self.channels)

    def shift(self, net: np.ndarray) -> np.ndarray:
        """(C,) a point amid translations (n, m, C) that are far from zero: jumps and moves do not see it."""
        found = np.zeros(self.channels)
        if self.parts.endswith("translation"):
            found[-3:] = amid(net[..., -3:].reshape(-1, 3))
        return found

    @property
    def net(self) -> np.ndarray:
        """(n, m, C) the controls; of a curve m = 1."""
        names = self.parts.split("+")
        if isinstance(self.motion, Rational):
            pair = self.motion.control_displacements
            columns = {"real": pair.real}
            if "dual" in names:
                columns["dual"] = pair.dual / self.length
            if "translation" in names:
                columns["translation"] = pair.translation / self.length
        elif isinstance(self.motion, QuaternionMotion):
            columns = {"real": self.motion.control_points}
        else:
            pose = self.motion
            columns = {"translation": pose.translation.control_points / self.length}
            if isinstance(pose.orientation, QuaternionMotion):
                columns["real"] = pose.orientation.control_points
        net = np.concatenate([columns[name] for name in names], axis=-1)
        return net if net.ndim == 3 else net[:, None]

    def motion_of(self, net: np.ndarray) -> Fairable:
        """The motion with these coordinates (n, m, C); what is not among them stays."""
        if isinstance(self.motion, QuaternionMotion):
            return QuaternionMotion(self.motion.basis, _unit(net[:, 0]))
        if isinstance(self.motion, PoseMotion):
            turns, moves = self.motion.orientation, self.motion.translation
            if self.parts.startswith("real"):
                turns = QuaternionMotion(turns.basis, _unit(net[:, 0, :4]))
            if self.parts.endswith("translation"):
                moves = Spline(moves.basis, self.length * net[:, 0, -3:])
            return PoseMotion(turns, moves)
        pair = self.motion.control_displacements
        net = net.reshape(*pair.shape, -1)
        real = net[..., :4] if self.parts.startswith("real") else pair.real
        if self.parts.endswith("dual"):
            return self.motion.with_controls(real, self.length * net[..., -4:])
        if self.motion.spherical:
            return self.motion.with_controls(real, None)
        moved = self.parts.endswith("translation")
        place = self.length * net[..., -3:] if moved else pair.translation
        # The part of Q⁰ along Q carries no displacement and stays what it is per Q.
        dual = DualQuaternions.from_parts(real, place).dual + pair.plucker[..., None] * real
        return self.motion.with_controls(real, dual)


def _require_polygon(motion: QuaternionMotion | PoseMotion, parts: str) -> None:
    """InputError where the control polygon does not say all of a curve, or cannot be faired."""
    if parts.endswith("dual"):
        raise InputError(f"parts {parts!r}: a pose motion has real, translation and real+translation")
    turns = motion.orientation if isinstance(motion, PoseMotion) else motion
    if parts.startswith("real"):
        if not isinstance(turns, QuaternionMotion):
            raise InputError("a product of turns has no control polygon to fair: parts='translation' can be")
        if turns.turns.any():
            raise InputError("a quaternion curve with whole extra turns is not that of its control quaternions alone")
    if isinstance(motion, PoseMotion) and parts == "real+translation":
        one, other = motion.orientation.basis, motion.translation.basis
        if one.degree != other.degree or not np.array_equal(one.knots, other.knots):
            raise InputError(
                "orientation and translation have other knots: fair parts='real' and parts='translation' one after "
                "the other"
            )


def _unit(quaternions: np.ndarray) -> np.ndarray:
    return quaternions / np.linalg.norm(quaternions, axis=-1, keepdims=True)


@dataclass(frozen=True)
class Box:
    """A region: a box of knots (half-open index ranges) and the box of controls that steps there move."""

    u: tuple[int, int]
    v: tuple[int, int]

    @staticmethod
    def of(jumps: Jumps, bases: Sequence[BSplineBasis], region: object = None) -> "Box":
        """The knots in a closed interval (a, b) of a curve, or in ((a, b), (c, d)) of u and v; all for None.

        Raises InputError for an interval outside the domain or without an interior knot.
        """
        if region is None:
            return Box((0, jumps.u.count), (0, jumps.v.count))
        try:
            intervals = checks.numbers(region, "region").reshape(len(bases), 2)
        except (TypeError, ValueError, OverflowError):
            needed = "(a, b)" if len(bases) == 1 else "((a, b), (c, d)), intervals of u and v"
            raise InputError(f"region {checks.told(region)}: {needed} is needed") from None
        ranges = [(0, jumps.v.count)] * 2
        for k, ((a, b), direction, basis) in enumerate(zip(intervals, (jumps.u, jumps.v), bases, strict=False)):
            low, high = basis.domain
            a, b = unified([a, b], [low, high])
            if not low <= a <= b <= high:
                a, b, low, high = instants(a, b, low, high)
                raise InputError(f"region {'uv'[k]} from {a} to {b}: must increase within {low} to {high}")
            a, b = unified(np.array([a, b]) - basis.origin, direction.knots, basis.origin)
            first = int(np.searchsorted(direction.knots, a))
            last = int(np.searchsorted(direction.knots, b, side="right"))
            if first == last:
                first, last = instants(*(np.array([a, b]) + basis.origin))
                raise InputError(f"region {'uv'[k]} from {first} to {last} holds no interior knot")
            ranges[k] = first, last
        return Box(*ranges)

    def knots(self, jumps: Jumps) -> np.ndarray | None:
        """(K, L) whether each knot is in the region; None for all."""
        if self == Box((0, jumps.u.count), (0, jumps.v.count)):
            return None
        inside = np.zeros(jumps.shape, dtype=bool)
        inside[slice(*self.u), slice(*self.v)] = True
        return inside

    def controls(self, jumps: Jumps) -> tuple[slice, slice]:
        """The inner controls of the region's knots, never one of the ring."""
        # The knot of row k reads the controls k … k + 4.
        u = slice(self.u[0] + 1, self.u[1] + 3)
        return u, slice(0, 1) if jumps.v.trivial else slice(self.v[0] + 1, self.v[1] + 3)


def same_kind(motion: AnyMotion, other: Fairable) -> AnyMotion:
    """`other`, known to be of the class of `motion`."""
    return cast(AnyMotion, other)
