"""C² quaternion curves through keyframes: Newton on control quaternions and increments together."""

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from symmotion.checks import choice, numbers
from symmotion.errors import InputError, SolveError
from symmotion.motions.keyframes import Keyframes
from symmotion.motions.quaternions.algebra import Signs, exp, product
from symmotion.motions.quaternions.continuation import followed, newton
from symmotion.motions.quaternions.curve import QuaternionMotion
from symmotion.motions.quaternions.keys import OrientationKeys
from symmotion.motions.quaternions.passing import Passing
from symmotion.splines import BSplineBasis, cubic_interpolant, from_origin

if TYPE_CHECKING:
    from symmotion.motions.rotations import Rotations

ENDS = ("natural", "clamped", "periodic")
# Steps of Newton's method from the curve of turns that commute, before the path from nothing is followed.
DIRECT = 15
# Intervals of a ratio, and turns between neighbours in degrees, up to which a curve is found in all cases tried.
UNEVEN, FAR = 10.0, 180.0


def interpolate_quaternions(
    times: ArrayLike | Keyframes,
    quaternions: "Rotations | None" = None,
    ends: str = "natural",
    end_rates: ArrayLike | None = None,
    turns: ArrayLike | None = None,
    *,
    signs: Signs = "align",
    scalar_first: bool = True,
    norms: float | None = None,
    tolerance: float = 1e-12,
    max_iterations: int = 3000,
) -> QuaternionMotion:
    """The C² cubic B-spline quaternion curve through keyframes (KKS 6.2, figure 10), to `tolerance` in rad.

    times: (M,) increasing; quaternions: (M, 4) scalar first unless `scalar_first` says else, or a
        SciPy `Rotation`; or rigid `Keyframes` alone.
    ends: "natural" (no angular acceleration there, M ≥ 2), "clamped" with `end_rates` (2, 3),
        body rates in rad/s, or "periodic" (M ≥ 4, the last keyframe equal to the first).
    turns: (M − 1,) whole turns added between neighbours, each about its own axis; negative
        ones go the other way round. signs: how those of neighbours are read, see `aligned`.
    norms: how far lengths of quaternions may be from 1; 1e-6 when left out.

    max_iterations: of Newton.

    Where neighbouring intervals are of very different length it overshoots, by whole turns as well, which `extra_turns`
    tells; `interpolants.monotone_curve` does not, and is C¹.

    Raises InputError for what cannot be, SolveError where Newton does not converge, which says whether times or turns
    are at fault.

    >>> keys = sm.examples.random_keyframes(4, 60, seed=1)
    >>> curve = sm.quaternions.interpolate_quaternions(keys.times, keys.rotations())
    >>> bool(np.allclose(curve.rotation(keys.times).as_matrix(), keys.linear))
    True
    """
    keys = OrientationKeys.of(times, quaternions, turns, signs, scalar_first=scalar_first, norms=norms)
    return interpolate_keys(keys, ends, end_rates, tolerance=tolerance, max_iterations=max_iterations)


def interpolate_keys(
    keys: OrientationKeys,
    ends: str,
    end_rates: ArrayLike | None = None,
    *,
    tolerance: float = 1e-12,
    max_iterations: int = 3000,
) -> QuaternionMotion:
    """The curve of `interpolate_quaternions` through checked keyframes."""
    choice(ends, ENDS, "end condition")
    origin, since = from_origin(keys.times)
    if origin:
        # In times from the origin on; the curve alone knows it.
        there = interpolate_keys(
            replace(keys, times=since), ends, end_rates, tolerance=tolerance, max_iterations=max_iterations
        )
        return replace(there, basis=replace(there.basis, origin=origin))
    rates = _end_rates(ends, end_rates)
    if ends == "periodic":
        if len(keys) < 4:
            raise InputError(f"{len(keys)} keyframes are too few for periodic ends: at least 4 are needed")
        keys.require_closed()
        basis = BSplineBasis.closed(keys.times, 3)
    else:
        basis = BSplineBasis.clamped(keys.times, 3)
    system = Passing(keys, basis, rates)
    point, miss, used = newton(system, _start(keys, ends, rates), tolerance, min(max_iterations, DIRECT))
    if not miss <= tolerance and used < max_iterations:
        point, miss = followed(system, tolerance, max_iterations - used)
    if not miss <= tolerance:
        raise SolveError(
            f"no quaternion curve found through the keyframes: {miss:.2g} rad off after {max_iterations} iterations "
            f"(tolerance {tolerance:g}). {_fault(keys)}"
        )
    # The chain of increments decides; the controls follow it to rounding.
    return QuaternionMotion(basis, *point)


def _fault(keys: OrientationKeys) -> str:
    """What makes it hard, the times or the turns, and what serves."""
    steps, turns = np.diff(keys.times), 2 * np.degrees(np.linalg.norm(keys.ways, axis=1))
    far = int(turns.argmax())
    if steps.max() > UNEVEN * steps.min():
        k = int(np.abs(np.diff(np.log(steps))).argmax())
        told = (
            f"intervals of {steps[k]:.3g} and {steps[k + 1]:.3g} stand beside each other at keyframe {k + 1}: "
            "C² curves overshoot there"
        )
    elif turns[far] > FAR:
        told = f"keyframes {far} and {far + 1} are {turns[far]:.0f}° apart: add keyframes between"
    else:
        told = "lower the end rates, or add keyframes where neighbours turn far"
    return (
        f"{told}; interpolants.monotone_curve goes through them, C¹ and without turning back, slerp_curve and squad too"
    )


def _end_rates(ends: str, end_rates: ArrayLike | None) -> np.ndarray | None:
    if (ends == "clamped") != (end_rates is not None):
        raise InputError("end_rates go with clamped ends, and clamped ends need them")
    if end_rates is None:
        return None
    rates = numbers(end_rates, "end_rates")
    if rates.shape != (2, 3) or not np.isfinite(rates).all():
        raise InputError(f"end_rates of shape {rates.shape}: finite body rates, (2, 3) in rad/s, are needed")
    return rates


def _start(keys: OrientationKeys, ends: str, rates: np.ndarray | None) -> tuple[np.ndarray, np.ndarray]:
    """Control quaternions and increments as if turns commuted, which is exact about one axis."""
    unrolled = keys.unrolled
    drift = np.zeros(3)
    if ends == "periodic":
        # Turns that do not sum to zero are carried by a straight part, which has no bend.
        drift = unrolled[-1] / (keys.times[-1] - keys.times[0])
        flat = unrolled - drift * (keys.times - keys.times[0])[:, None]
        spline = cubic_interpolant(keys.times, flat, "periodic")
        where = spline.basis.greville
        points = spline.control_points + drift * (where - keys.times[0])[:, None]
        closing = points[0] + unrolled[-1] - points[-1]
        increments = np.concatenate([np.diff(points, axis=0), closing[None]])
    else:
        spline = cubic_interpolant(keys.times, unrolled, ends, None if rates is None else rates / 2)
        points, where = spline.control_points, spline.basis.greville
        increments = np.diff(points, axis=0)
    near = _nearest(keys.times, where)
    return product(keys.quaternions[near], exp(points - unrolled[near])), increments


def _nearest(times: np.ndarray, where: np.ndarray) -> np.ndarray:
    """The index of the time next to each place."""
    return np.searchsorted(0.5 * (times[1:] + times[:-1]), where)
