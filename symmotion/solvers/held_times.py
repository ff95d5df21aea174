"""The times at which bounds that hold everywhere are held: where they press, where they are exceeded, and no others."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from symmotion.program import DesignT, Program
from symmotion.program.everywhere import Everywhere
from symmotion.solvers.contacts import Contacts
from symmotion.solvers.reduced import Reduced, Settled
from symmotion.solvers.solution import Solution

# The share of the largest multiplier below which a bound does not press.
IDLE = 1e-7
# Times as close as that, as a share of their span, are one; times that press are a contact, which idle ones are beside.
CLOSE, BESIDE = 1e-3, 0.05
# Rounds after which times that do not press are let go, and promises that are not kept after which none is taken.
RESTED, BROKEN = 2, 3
# How often contacts that turn up on the way are settled with the others, before there is a solve.
SETTLED = 4


class HeldTimes:
    """At which times bounds are held next, with what an exchange has to remember for that.

    reduced: the program whose contacts move; tolerance: of the excess.
    """

    def __init__(self, reduced: Reduced, bounds: Mapping[str, Everywhere], tolerance: float):
        self.reduced, self.bounds, self.tolerance = reduced, bounds, tolerance
        self.rested: dict[tuple[str, float], int] = {}
        self.dropped: list[tuple[str, float]] = []
        self.promised, self.broken = False, 0
        self.keeps = self.begun = False

    def last(self, found: Solution[DesignT]) -> Solution[DesignT] | None:
        """A start with one time for each contact, None where that is so already."""
        pressing = {name: _pressing(found, name) for name in self.bounds}
        if not any(p.any() for p in pressing.values()) or (self.promised and all(p.all() for p in pressing.values())):
            return None
        contacts = self._contacts(found)
        fewer = any(len(np.unique(contacts.times[contacts.bounds == n])) < len(p) for n, p in pressing.items())
        if not fewer:
            return None
        settled = self._settled(found, found.x, found.program.split(found.multiplier_vector), contacts)
        x, contacts = (settled.x, settled.contacts) if settled else (found.x, contacts)
        return self._carried(found, x, contacts, {name: np.empty(0) for name in self.bounds})

    def next(self, found: Solution[DesignT]) -> Solution[DesignT]:
        """A start at the times for the next solve."""
        broken, self.promised = self.promised, False
        self.broken += broken
        contacts = self._contacts(found)
        x, settled = found.x, False
        more, above = self._more(found, x)
        if self.broken < BROKEN:
            parts = found.program.split(found.multiplier_vector)
            fresh = contacts
            for _ in range(SETTLED):
                trial = self._settled(found, x, parts, fresh)
                if trial is None:
                    break
                x, parts, contacts, settled = trial.x, parts | dict(trial.multipliers), trial.contacts, True
                more, above = self._more(found, x)
                if not any(len(a) for a in above.values()):
                    break
                fresh = contacts.with_more(
                    [self.reduced.beginning(x, name, times) for name, times in above.items() if len(times)]
                )
        if settled and any(len(a) for a in above.values()) and self._held(found, contacts, more):
            # From there the same solve would lead back.
            x, settled, contacts = found.x, False, self._contacts(found)
            more, above = self._more(found, x)
            self.broken += 1
        for name in self.bounds:
            excess = found.certificate.excess[name]
            if not len(above[name]) and excess.value > self.tolerance and (broken or not settled):
                # Narrower than the samples: the bound knows where.
                more[name] = np.append(more[name], excess.time)
        if settled and not any(len(m) for m in more.values()):
            self.promised = True
            return self._carried(found, x, contacts, more)
        began, self.begun = self.begun, True
        for name in self.bounds if began else ():
            more[name] = np.concatenate([more[name], self._idle(found, name, contacts, more[name], not settled)])
        return self._carried(found, x, contacts, more)

    def _held(self, found: Solution, contacts: Contacts, more: Mapping[str, np.ndarray]) -> bool:
        """Whether a solution was found with all these times held, or ones next to them."""
        for name in self.bounds:
            asked, held = np.append(contacts.times[contacts.bounds == name], more[name]), _times(found, name)
            if any(np.abs(held - t).min() > CLOSE * self.reduced.span(name)(t) for t in asked.tolist()):
                return False
        return True

    def _idle(self, found: Solution, name: str, contacts: Contacts, fresh: np.ndarray, adding: bool) -> np.ndarray:
        """The times of a bound that do not press and stay all the same for a while."""
        times, pressing = _times(found, name), _pressing(found, name)
        span = self.reduced.span(name)
        if not self.keeps:
            near = [t for n, t in self.dropped if n == name and len(fresh) and np.abs(fresh - t).min() < 0.5 * span(t)]
            self.keeps = bool(near)
        before, self.rested = self.rested, {k: v for k, v in self.rested.items() if k[0] != name}
        kept, taken = [], np.concatenate([contacts.times[contacts.bounds == name], fresh])
        for time in times[~pressing].tolist():
            if len(taken) and np.abs(taken - time).min() < (CLOSE if adding else BESIDE) * span(time):
                continue
            rounds = before.get((name, time), 0) + 1
            if rounds >= RESTED and not self.keeps:
                self.dropped.append((name, time))
                continue
            self.rested[name, time] = rounds
            kept.append(time)
        return np.array(kept)

    def _contacts(self, found: Solution) -> Contacts:
        """The contacts of a solution: of times that press on one maximum, what they are together."""
        parts: list[tuple[str, float, int, float]] = []
        for name, bound in self.bounds.items():
            loads, times = found.program.split(found.multiplier_vector)[name], _times(found, name)
            heavy = np.abs(loads) > IDLE * max(float(np.abs(loads).max()), 1e-300)
            span = self.reduced.span(name)
            for component in np.flatnonzero(heavy.any(axis=0)).tolist():
                rows = np.flatnonzero(heavy[:, component])
                rows = rows[np.argsort(times[rows])]
                joined = _bridged(found, name, bound, times[rows])
                groups = [rows[:1].tolist()]
                for last, row, over in zip(rows, rows[1:], joined, strict=False):
                    same = loads[row, component] * loads[last, component] > 0
                    if same and (over or times[row] - times[last] < CLOSE * span(float(times[row]))):
                        groups[-1].append(row)
                    else:
                        groups.append([row])
                for group in groups:
                    weights = loads[group, component]
                    time = times[group[0]] if len(group) == 1 else float(weights @ times[group] / weights.sum())
                    parts.append((name, float(time), component, float(weights.sum())))
        return Contacts.joined(parts)

    def _more(self, found: Solution, x: np.ndarray) -> tuple[dict[str, np.ndarray], dict[str, np.ndarray]]:
        """By bound, the times of the maxima at a point that are near the limit, and those that are above it."""
        motion: object = found.motion if x is found.x else found.program.design.motion(found.program.unpack(x))
        near, above = {}, {}
        for name, bound in self.bounds.items():
            peaks, heights = bound.peaks(motion, _values(found.program, name))
            beyond = heights > self.tolerance
            # What is as far below the limit as others are above may exceed it next.
            near[name] = peaks[heights > -heights.max(), 0] if beyond.any() else np.empty(0)
            above[name] = peaks[beyond, 0]
        return near, above

    def _settled(
        self, found: Solution, x: np.ndarray, multipliers: Mapping[str, np.ndarray], contacts: Contacts
    ) -> Settled | None:
        program = found.program
        if any(np.ptp(np.asarray(program.constraint(name).times), axis=1).any() for name in self.bounds):
            return None
        return self.reduced.settled(x, multipliers, contacts)

    def _carried(
        self, found: Solution[DesignT], x: np.ndarray, contacts: Contacts, more: Mapping[str, np.ndarray]
    ) -> Solution[DesignT]:
        """A start at other times: a point, with the multipliers of contacts in place of its own, and more times."""
        parts, held = found.program.split(found.multiplier_vector), {}
        for name in self.bounds:
            constraint = found.program.constraint(name)
            assert constraint.times is not None  # of a bound that is meant for all times
            slots = constraint.times.shape[1]
            times, loads = contacts.held(name, slots, constraint.lower.shape[1])
            extra = np.setdiff1d(more[name], times[:, 0])
            if not len(times) and not len(extra):
                extra = constraint.times[:1, 0]
            times = np.concatenate([times, np.repeat(extra[:, None], slots, axis=1)])
            loads = np.concatenate([loads, np.zeros((len(extra), loads.shape[1]))])
            order = np.argsort(times[:, 0], kind="stable")
            held[name], parts[name] = times[order], loads[order]
        program = found.program.with_times(held)
        whole = np.concatenate([parts[c.name].ravel() for c in program.constraints])
        return replace(found, program=program, x=x, multiplier_vector=whole)


def _values(program: Program, name: str) -> dict[str, np.ndarray]:
    return program.constraint(name).parameter_values


def _slots(solution: Solution, name: str) -> int:
    """How many times a bound couples."""
    times = solution.program.constraint(name).times
    assert times is not None  # of a bound that is meant for all times
    return times.shape[1]


def _times(solution: Solution, name: str) -> np.ndarray:
    """(N,) the times at which a bound is held."""
    times = solution.program.constraint(name).times
    assert times is not None  # of a bound that is meant for all times
    return times[:, 0]


def _pressing(solution: Solution, name: str) -> np.ndarray:
    """(N,) which times of a bound press."""
    sizes = np.abs(solution.program.split(solution.multiplier_vector)[name]).max(axis=1)
    return sizes > IDLE * max(float(sizes.max()), 1e-300)


def _bridged(solution: Solution, name: str, bound: Everywhere, times: np.ndarray) -> np.ndarray:
    """(N − 1,) whether a bound is exceeded all the way from one of times (N,) to the next."""
    if len(times) < 2:
        return np.empty(0, dtype=bool)
    between = times[:-1, None] + np.diff(times)[:, None] * np.arange(1, 8) / 8
    slots = np.repeat(between.reshape(-1, 1), _slots(solution, name), axis=1)
    excess = bound.excesses(solution.motion, _values(solution.program, name), slots)
    return np.all(excess.reshape(between.shape) > 0, axis=1)
