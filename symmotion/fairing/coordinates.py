"""What of a motion's controls is faired: which coordinates, over which knots, and how they become a motion again."""

from dataclasses import dataclass
from typing import Literal, TypeVar, cast

import numpy as np

from symmotion import checks
from symmotion.errors import InputError
from symmotion.fairing.jumps import Jumps
from symmotion.motions.dual import DualQuaternions
from symmotion.motions.rational import RationalMotion
from symmotion.motions.two_parameter import TwoParameterMotion
from symmotion.splines import unified

Motion = TwoParameterMotion | RationalMotion
AnyMotion = TypeVar("AnyMotion", TwoParameterMotion, RationalMotion)
Parts = Literal["real", "dual", "translation", "real+dual", "real+translation"]
PARTS = ("real", "dual", "translation", "real+dual", "real+translation")


@dataclass(frozen=True, eq=False)
class Coordinates:
    """The coordinates of a motion's controls that are faired.

    parts: "real" (of a spatial motion: translations stay), "dual" or "translation" (the real
    part stays), or the real part together with one of them (PCG 6).
    length: the unit that dual parts and translations are divided by, so that they can be added
    to quaternions; G and displacements are in the result's units.
    """

    motion: Motion
    parts: str
    length: float

    @staticmethod
    def of(motion: Motion, parts: str | None = None, length: float = 1.0) -> "Coordinates":
        """The coordinates, those of everything that moves when `parts` is left out; InputError for what cannot be."""
        if not isinstance(motion, TwoParameterMotion | RationalMotion):
            kind = type(motion).__name__
            raise InputError(f"{kind} cannot be faired; a TwoParameterMotion or RationalMotion is needed")
        if parts is None:
            parts = "real" if motion.spherical else "real+dual"
        if not isinstance(parts, str) or parts not in PARTS:
            raise InputError(f"parts {checks.told(parts)} are unknown; there are {', '.join(PARTS)}")
        if motion.spherical and parts != "real":
            raise InputError(f"parts {parts!r}: a spherical motion has real parts only")
        length = checks.positive(length, "length")
        motion.control_displacements.require_aligned()
        return Coordinates(motion, parts, length)

    @property
    def net(self) -> np.ndarray:
        """(n, m, C) the controls; of a curve m = 1."""
        pair = self.motion.control_displacements
        columns = {"real": pair.real, "dual": pair.dual / self.length, "translation": pair.translation / self.length}
        net = np.concatenate([columns[name] for name in self.parts.split("+")], axis=-1)
        return net if net.ndim == 3 else net[:, None]

    def motion_of(self, net: np.ndarray) -> Motion:
        """The motion with these coordinates (n, m, C); what is not among them stays."""
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


@dataclass(frozen=True)
class Box:
    """A region: a box of knots (half-open index ranges) and the box of controls that steps there move."""

    u: tuple[int, int]
    v: tuple[int, int]

    @staticmethod
    def of(jumps: Jumps, motion: Motion, region: object = None) -> "Box":
        """The knots in a closed interval (a, b) of a curve, or in ((a, b), (c, d)) of u and v; all for None.

        Raises InputError for an interval outside the domain or without an interior knot.
        """
        if region is None:
            return Box((0, jumps.u.count), (0, jumps.v.count))
        try:
            intervals = checks.numbers(region, "region").reshape(len(motion.bases), 2)
        except (TypeError, ValueError, OverflowError):
            needed = "(a, b)" if len(motion.bases) == 1 else "((a, b), (c, d)), intervals of u and v"
            raise InputError(f"region {checks.told(region)}: {needed} is needed") from None
        ranges = [(0, jumps.v.count)] * 2
        for k, ((a, b), direction, basis) in enumerate(zip(intervals, (jumps.u, jumps.v), motion.bases, strict=False)):
            low, high = basis.domain
            a, b = unified([a, b], [low, high])
            if not low <= a <= b <= high:
                raise InputError(f"region {'uv'[k]} from {a:g} to {b:g}: must increase within {low:g} to {high:g}")
            a, b = unified(np.array([a, b]) - basis.origin, direction.knots, basis.origin)
            first = int(np.searchsorted(direction.knots, a))
            last = int(np.searchsorted(direction.knots, b, side="right"))
            if first == last:
                raise InputError(f"region {'uv'[k]} from {a:g} to {b:g} holds no interior knot")
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


def same_kind(motion: AnyMotion, other: Motion) -> AnyMotion:
    """`other`, known to be of the class of `motion`."""
    return cast(AnyMotion, other)
