"""Where bounds press that hold everywhere: times with multipliers, and how far times may go at once."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

# Between the times of which differences are taken, as a share of the span.
APART = 1e-4
# A time that close to the end of a span, as a share of it, is there.
THERE = 1e-7
# The share of the way to the next contact that a time goes at most.
NEIGHBOUR = 0.4
# Of values at the times −2, −1, 0, 1, 2 apart the first and second derivatives: from the left, about, from the right.
FIRST = np.array([[0.5, -2, 1.5, 0, 0], [0, -0.5, 0, 0.5, 0], [0, 0, -1.5, 2, -0.5]])
SECOND = np.array([[1.0, -2, 1, 0, 0], [0, 1, -2, 1, 0], [0, 0, 1, -2, 1]])


@dataclass(frozen=True, eq=False)
class Contacts:
    """Times (K,) at which components (K,) of bounds (K,), by name, press, with multipliers (K,)."""

    bounds: np.ndarray
    times: np.ndarray
    components: np.ndarray
    loads: np.ndarray

    @staticmethod
    def joined(parts: Sequence[tuple[str, float, int, float]]) -> "Contacts":
        """Of bounds, times, components and multipliers one by one."""
        columns = [np.array(c) for c in zip(*sorted(parts), strict=True)] or [np.empty(0, dtype=int)] * 4
        return Contacts(*columns)

    def with_more(self, others: Sequence["Contacts"]) -> "Contacts":
        """With others, bound by bound."""
        every = [(c.bounds, c.times, c.components, c.loads) for c in (self, *others) if len(c.times)]
        columns = [np.concatenate(column) for column in zip(*every, strict=True)]
        order = np.argsort(columns[0], kind="stable")
        return Contacts(*(column[order] for column in columns))

    def of(self, which: np.ndarray) -> "Contacts":
        """Some of them."""
        return Contacts(self.bounds[which], self.times[which], self.components[which], self.loads[which])

    def held(self, name: str, slots: int, width: int) -> tuple[np.ndarray, np.ndarray]:
        """The different times (N, slots) at which a bound presses, and the multipliers (N, width) there."""
        here = self.of(self.bounds == name)
        times, place = np.unique(here.times, return_inverse=True)
        loads = np.zeros((len(times), width))
        np.add.at(loads, (place, here.components), here.loads)
        return np.repeat(times[:, None], slots, axis=1), loads


def sides_of(
    times: np.ndarray, spans: np.ndarray, breaks: np.ndarray, excess: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """(K,) from where differences are taken, a row of FIRST, and whether the time may move.

    excess: (K, 5) at the times apart, up to a constant.
    """
    near = breaks[np.argmin(np.abs(breaks - times[:, None]), axis=1)]
    away = (near - times) / spans
    side = np.where(np.abs(away) >= 2 * APART, 1, np.where(away > 0, 0, 2))
    at = np.abs(away) <= THERE
    before, after = (excess @ FIRST[0] > 0) & (near > breaks[0]), (excess @ FIRST[2] < 0) & (near < breaks[-1])
    rises_left, rises_right = (near > breaks[0]) & ~before, (near < breaks[-1]) & ~after
    side = np.where(at, np.where(rises_right, 2, 0), side)
    return side, ~at | rises_left | rises_right


def together(contacts: Contacts, moves: np.ndarray) -> float:
    """What of a step keeps the contacts of a component apart."""
    length = 1.0
    for name, component in {*zip(contacts.bounds.tolist(), contacts.components.tolist(), strict=True)}:
        here = (contacts.bounds == name) & (contacts.components == component)
        order = np.argsort(contacts.times[here])
        gaps, closing = np.diff(contacts.times[here][order]), -np.diff(moves[here][order])
        tight = closing > 2 * NEIGHBOUR * gaps
        if tight.any():
            length = min(length, float((2 * NEIGHBOUR * gaps[tight] / closing[tight]).min()))
    return length


def stopped(every: Mapping[str, np.ndarray], contacts: Contacts, moves: np.ndarray) -> np.ndarray:
    """(K,) the times moved, no further than to the next break of their bound."""
    times = contacts.times + moves
    for name in np.unique(contacts.bounds):
        breaks = every[name]
        for k in np.flatnonzero(contacts.bounds == name):
            low, high = sorted((contacts.times[k], times[k]))
            slack = THERE * float(np.diff(breaks).min())
            crossed = breaks[(breaks > low + slack) & (breaks < high - slack)]
            if len(crossed):
                times[k] = crossed[0] if moves[k] > 0 else crossed[-1]
        here = contacts.bounds == name
        times[here] = np.clip(times[here], breaks[0], breaks[-1])
    return times


def span_lengths(breaks: np.ndarray, times: np.ndarray) -> np.ndarray:
    """(K,) the lengths of the spans in which times (K,) lie, of the shorter one at a break."""
    lengths = np.diff(breaks)
    sides = [np.clip(np.searchsorted(breaks, times, side) - 1, 0, len(lengths) - 1) for side in ("left", "right")]
    return np.minimum(lengths[sides[0]], lengths[sides[1]])
