"""What is known of a bound between the times at which a program holds it."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal, Protocol, TypeVar

import numpy as np

Kind = Literal["certified", "sampled"]


@dataclass(frozen=True)
class Excess:
    """By how far a constraint is exceeded: `float(excess)` is the value.

    value: ≥ 0, relative to the limit, absolute where that is 0, of the quantity that is named (a speed, not its
        square); infinite where the quantity is.
    time: where it is worst, or nearest to its limit where it holds; NaN of conditions that have no time.
    kind: "certified", value is a bound, rounding included, and is attained to 1e-9 of the limit (of a condition at
        given times it is the value there, up to the rounding of the expression); or "sampled", the largest of many
        samples, refined by a search in one dimension, which may miss what is narrow.

    >>> motion = sm.interpolants.component_cubic(sm.examples.spatial_keyframes())
    >>> found = sm.excess(motion, sm.SpeedBound(np.zeros((1, 3)), 14.0))
    >>> round(float(found), 4), round(found.time, 3), found.kind
    (0.0086, 1.0, 'certified')
    """

    value: float
    time: float
    kind: Kind = "certified"

    def __float__(self) -> float:
        return self.value


def beyond(values: np.ndarray, limit: np.ndarray | float, sign: float, power: int) -> np.ndarray:
    """By how far values exceed a limit, upwards for sign 1, downwards for −1; below 0 inside.

    (q − l)/|l|, or q − l where the limit is 0, of the quantity q whose `power` the value is.
    """
    named, most = _quantity(values, power), _quantity(np.asarray(limit, dtype=float), power)
    return sign * (named - most) / np.where(most == 0, 1.0, np.abs(most))


def _quantity(values: np.ndarray, power: int) -> np.ndarray:
    # Odd: −‖v‖² ≥ −l² and v³ ≤ −l³ are broken as ‖v‖ ≤ l and v ≤ −l are.
    return values if power == 1 else np.sign(values) * np.abs(values) ** (1 / power)


def excess_at(values: np.ndarray, lower: np.ndarray, upper: np.ndarray, times: np.ndarray | None, power: int) -> Excess:
    """The excess of values (N, C) at times (N, s), with bounds (N, C).

    lower, upper: infinite where there is none; power: 2 of a quantity that is a square, else 1: the excess is told of
    the root.

    >>> values, zero = np.array([[0.5], [1.2]]), np.array([[-np.inf], [-np.inf]])
    >>> round(float(sm.program.excess_at(values, zero, np.ones((2, 1)), np.array([[0.0], [3.0]]), 1)), 9)
    0.2
    """
    worst = np.full(values.shape, -np.inf)
    for bound, sign in ((lower, -1.0), (upper, 1.0)):
        there = np.isfinite(bound)
        worst[there] = np.maximum(worst[there], beyond(values[there], bound[there], sign, power))
    worst[~np.isfinite(values)] = np.inf
    row = int(np.argmax(worst.max(axis=1)))
    return Excess(max(0.0, float(worst[row].max())), float("nan") if times is None else float(times[row, 0]))


# What a program holds of it: a `Constraint`, which has one of these.
Held = TypeVar("Held")


class Everywhere(Protocol[Held]):
    """A condition that is meant for all times, from which a program holds it at some of them.

    >>> keys = sm.examples.random_keyframes(4, 60, seed=1)
    >>> program = sm.orientation_program(keys, constraints=[sm.RateBound(1.2)])
    >>> program.constraint("rate bound").everywhere.breaks()
    array([0. , 0.5, 1. , 1.5, 2. , 2.5, 3. ])
    """

    def excess(self, motion: object, parameters: Mapping[str, np.ndarray]) -> Excess:
        """By how far a motion of the program exceeds it."""
        ...

    def peaks(self, motion: object, parameters: Mapping[str, np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
        """The times (K, s) of all local maxima of its excess, as the program tells times, and the excess there (K,).

        Of those that do not reach the limit only about.
        """
        ...

    def excesses(self, motion: object, parameters: Mapping[str, np.ndarray], times: np.ndarray) -> np.ndarray:
        """(N,) its excess at times (N, s), as the program tells them; below 0 inside."""
        ...

    def breaks(self) -> np.ndarray:
        """(M,) the first and the last of its times, as the program tells them, and those where it may not be smooth."""
        ...

    def at(self, times: np.ndarray, constraint: Held) -> Held:
        """The constraint held at other times (N, s), its kernel and its parameters kept."""
        ...
