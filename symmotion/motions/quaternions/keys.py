"""Keyframes of orientation: unit quaternions at increasing times, and the ways between them."""

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from symmotion.brief import between
from symmotion.checks import numbers
from symmotion.errors import InputError
from symmotion.motions.keyframes import Keyframes, require_no_path
from symmotion.motions.quaternions.algebra import (
    Signs,
    aligned,
    as_quaternions,
    exp,
    increments_between,
    product,
    ways_like,
)
from symmotion.splines import check_times
from symmotion.values import read_only, value

if TYPE_CHECKING:
    from symmotion.motions.rotations import Rotations


@value
class OrientationKeys:
    """M orientations at increasing times, and the way from each to the next.

    times: (M,); quaternions: (M, 4) with the signs that the ways lead to; ways: (M − 1, 3)
    half-angle vectors, longer than π/2 where the long way round or whole turns were asked for.

    Raises InputError that names the keyframe at fault.

    >>> keys = sm.examples.random_keyframes(3, 40, seed=1)
    >>> sm.orientation_program(keys).design.keys.ways.shape
    (2, 3)
    """

    times: np.ndarray
    quaternions: np.ndarray
    ways: np.ndarray

    def __post_init__(self):
        for name in ("times", "quaternions", "ways"):
            object.__setattr__(self, name, read_only(numbers(getattr(self, name), name)))

    @staticmethod
    def of(
        times: ArrayLike | Keyframes,
        quaternions: "Rotations | None" = None,
        turns: ArrayLike | None = None,
        signs: Signs = "align",
        *,
        scalar_first: bool = True,
        norms: float | None = None,
    ) -> "OrientationKeys":
        """Checked keyframes; turns, signs: as in `aligned`.

        quaternions: (M, 4), scalar first unless it is said that it is last; or rotation matrices
        (M, 3, 3), or a SciPy `Rotation`; norms: as in `Keyframes.of`. Rigid
        `Keyframes` in space stand for times and quaternions both.
        """
        require_no_path(times, "keys")
        if isinstance(times, Keyframes) != (quaternions is None):
            raise InputError("times and quaternions are needed, or Keyframes alone")
        if isinstance(times, Keyframes):
            times, quaternions = times.times, times.rotations()
        assert quaternions is not None
        q = as_quaternions(quaternions, "keyframe", 2, scalar_first=scalar_first, norms=norms)
        times = check_times(times)
        if len(times) != len(q):
            raise InputError(f"{len(times)} times for {len(q)} quaternions: one of each per keyframe is needed")
        q = aligned(q, signs)
        ways = increments_between(q, turns)
        if turns is not None:
            # Every whole turn takes q to the other side.
            q = q * np.concatenate([[1.0], (-1.0) ** np.cumsum(np.asarray(turns))])[:, None]
        return OrientationKeys(times, q, ways)

    def __repr__(self) -> str:
        return f"OrientationKeys({len(self)}, times {between(*self.times[[0, -1]])})"

    def __len__(self) -> int:
        return len(self.times)

    def scaled(self, share: float) -> "OrientationKeys":
        """Keyframes from the same first one on by the same ways, each shortened to a share of its length."""
        ways = share * self.ways
        q = [self.quaternions[0]]
        for way in exp(ways):
            q.append(product(q[-1], way))
        return OrientationKeys(self.times, np.array(q), ways)

    def turned(self, quaternions: "Rotations") -> "OrientationKeys":
        """Other orientations (M, 4) at the same times; of the ways between them, those nearest to the old ones."""
        q = as_quaternions(quaternions, "keyframe", 2)
        if len(q) != len(self):
            raise InputError(f"{len(q)} quaternions for {len(self)} times: as many are needed")
        ways = ways_like(self.ways, q[:-1], q[1:])
        first = q[0] if q[0] @ self.quaternions[0] >= 0 else -q[0]
        signs = [1.0]
        for k, way in enumerate(exp(ways)):
            signs.append(1.0 if product(signs[-1] * q[k], way) @ q[k + 1] >= 0 else -1.0)
        q = q * np.array(signs)[:, None]
        return OrientationKeys(self.times, q if q[0] @ first >= 0 else -q, ways)

    def require_closed(self) -> None:
        """Raise InputError unless the last keyframe is the first."""
        if 1 - abs(self.quaternions[0] @ self.quaternions[-1]) > 1e-12:
            raise InputError("periodic ends need the last keyframe equal to the first")

    @property
    def unrolled(self) -> np.ndarray:
        """(M, 3) the ways summed up, as if they commuted."""
        return np.concatenate([np.zeros((1, 3)), np.cumsum(self.ways, axis=0)])
