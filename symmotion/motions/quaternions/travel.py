"""How far quaternion curves turn between times, and by how many whole turns more than their keyframes ask for."""

from typing import TYPE_CHECKING, Protocol

import numpy as np
from numpy.typing import ArrayLike

from symmotion.errors import InputError
from symmotion.motions.keyframes import Keyframes
from symmotion.motions.quaternions.algebra import Signs
from symmotion.motions.quaternions.keys import OrientationKeys
from symmotion.motions.quaternions.turning import Turning
from symmotion.splines import check_times, integrate

if TYPE_CHECKING:
    from symmotion.motions.rotations import Rotations

# Relative, of angles travelled: the rate has kinks where a body comes to rest.
TOLERANCE = 1e-7


class TurningCurve(Turning, Protocol):
    """A curve that has orientations and angular rates over a domain: all quaternion curves of this library."""

    @property
    def breakpoints(self) -> np.ndarray: ...


def angles_travelled(curve: TurningCurve, times: ArrayLike | None = None) -> np.ndarray:
    """∫ ‖Ω‖ dt between neighbouring times (M,), in rad: (M − 1,), to seven digits.

    curve: a quaternion curve; times: increasing, its breakpoints when left out.

    Raises InputError for times that do not increase or lie outside.

    >>> turn = sm.quaternions.QuaternionMotion.hermite([1, 0, 0, 0], [1, 0, 0, 0.0], [0, 0, 6], [0, 0, 6], turns=0)
    >>> sm.quaternions.angles_travelled(turn, [0.0, 1.0]).round(3)
    array([6.283])
    """
    ends = curve.breakpoints
    times = ends if times is None else check_times(times, "angle")
    inner = ends[(ends > times[0]) & (ends < times[-1])]
    joints = np.unique(np.concatenate([times, inner]))
    found = integrate(lambda t: np.linalg.norm(curve.jet(t, 1).rate, axis=-1), joints[:-1], joints[1:], TOLERANCE)
    return np.add.reduceat(found.parts, np.searchsorted(joints, times[:-1]))


def extra_turns(
    curve: TurningCurve,
    times: ArrayLike | Keyframes,
    quaternions: "Rotations | None" = None,
    turns: ArrayLike | None = None,
    *,
    signs: Signs = "align",
    scalar_first: bool = True,
    norms: float | None = None,
) -> np.ndarray:
    """Whole turns that a curve makes between neighbouring keyframes beyond those asked for: (M − 1,).

    The angle travelled less that of the way from keyframe to keyframe, in whole turns, rounded down. C² curves make
    such turns where neighbouring intervals are of very different length: `interpolants.monotone_curve` makes none.

    curve: a quaternion curve; times, quaternions, turns, signs, scalar_first, norms: the keyframes, as for
    `interpolate_quaternions`.

    Raises InputError for keyframes that are none, and where the curve does not go through them.

    >>> times, keys = [0.0, 1.0, 1.02, 2.0], sm.examples.random_keyframes(4, 120, seed=2)
    >>> curve = sm.quaternions.interpolate_quaternions(times, keys.rotations())
    >>> sm.quaternions.extra_turns(curve, times, keys.rotations())
    array([6, 0, 7])
    """
    keys = OrientationKeys.of(times, quaternions, turns, signs, scalar_first=scalar_first, norms=norms)
    off = np.abs(np.sum(curve.jet(keys.times, 0).quaternion * keys.quaternions, axis=1)) < 1 - 1e-6
    if off.any():
        raise InputError(f"the curve does not go through keyframe {int(np.argmax(off))}")
    beyond = angles_travelled(curve, keys.times) - 2 * np.linalg.norm(keys.ways, axis=1)
    return np.maximum(np.floor(beyond / (2 * np.pi) + 1e-6), 0).astype(int)
