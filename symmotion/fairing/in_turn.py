"""Keyframes of a net whose real part and translation are faired: one after the other, each of which is linear."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from symmotion.errors import InputError
from symmotion.fairing.coordinates import AnyMotion, Coordinates
from symmotion.fairing.keyframes import Asked, NetKeyframe, NetPlace
from symmotion.fairing.result import FairingResult, FairingStatus

# What goes with both parts alike, and with one noise, or one for each.
SHARED = ("weight", "region", "length", "borders", "weights")


def in_turn(
    fair: Callable[..., FairingResult[AnyMotion]],
    motion: AnyMotion,
    keyframes: Sequence[Asked],
    options: Mapping[str, object],
    noise: float | Sequence[float] | None,
) -> FairingResult[AnyMotion]:
    """The least squares of the real part under the keyframes' rotations, then of the translation under the keyframes.

    ΣL and Σ|d − d⁰|² are sums over the two: without keyframes this is the least squares of both. With them the
    translation pays for rotations that were chosen without it.
    """
    for name, given in options.items():
        if given is not None and name not in SHARED:
            raise InputError(
                f"keyframes with parts 'real+translation' are met by least squares with a weight or noise, not with "
                f"{name}: fair real+dual, or the real part first and then the translation"
            )
    if isinstance(keyframes, NetKeyframe | NetPlace) or not isinstance(keyframes, Sequence):
        raise InputError("keyframes: a list of ((u, v), displacement), NetKeyframe or NetPlace is needed")
    # Whatever is no keyframe is refused by name with the translation too, before anything moves.
    turns = [replace(k, hold="rotation") if isinstance(k, NetKeyframe) else k for k in map(_named, keyframes)]
    shared = {name: options[name] for name in SHARED}
    sigma = [None, None] if noise is None else np.broadcast_to(np.atleast_1d(noise), (2,)).tolist()
    first = fair(motion, "least-squares", parts="real", noise=sigma[0], keyframes=_rotations(turns), **shared)
    second = fair(first.motion, "least-squares", parts="translation", noise=sigma[1], keyframes=keyframes, **shared)
    prices = np.zeros((len(keyframes), 8))
    which = [i for i, k in enumerate(turns) if not isinstance(k, NetPlace)]
    if which:
        prices[which] += first.multipliers["keyframes"]
    prices += second.multipliers["keyframes"]
    weights = np.full(len(keyframes), np.nan)
    weights[which] = first.keyframe_weights
    before, after = first.before + second.before, first.after + second.after
    return FairingResult(
        motion=second.motion,
        start=motion,
        method="least-squares",
        status=FairingStatus.SOLVED,
        history=np.array([before.sum(), after.sum()]),
        before=before,
        after=after,
        displacement=np.hypot(first.displacement, second.displacement),
        multipliers={
            "jumps": np.concatenate([first.multipliers["jumps"], second.multipliers["jumps"]], axis=-1),
            "keyframes": prices,
        },
        certificate=None,
        steps=1,
        best_step=1,
        seconds=first.seconds + second.seconds,
        weight=first.weight if first.weight == second.weight else None,
        keyframe_weights=weights,
    )


def _named(asked: Asked) -> Asked:
    if isinstance(asked, tuple | list) and len(asked) == 2:
        return NetKeyframe(*asked)
    return asked


def _rotations(keyframes: Sequence[Asked]) -> list[Asked]:
    """Those that say something about the real part: a place is met by the translation."""
    return [k for k in keyframes if not isinstance(k, NetPlace)]


def both_parts(coordinates: Coordinates) -> bool:
    """Whether the real part and the translation of a rational motion are faired together."""
    return coordinates.parts == "real+translation" and not coordinates.normalised
