"""A bound that is meant for all times: what it is between those at which a program holds it, and held at others."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import casadi as ca
import numpy as np

from symmotion.constraints.maximum import Looked, Watched
from symmotion.constraints.setting import Setting
from symmotion.jets.jet import AnyJet
from symmotion.jets.seen import Seen, seen
from symmotion.program import Constraint
from symmotion.program.everywhere import Excess


class Condition(Protocol):
    """A condition on jets at one time, see `JetConstraint`."""

    @property
    def power(self) -> int: ...

    def said_of(self, jets: Sequence[AnyJet], values: Mapping[str, np.ndarray]) -> ca.SX:
        """Its expression for jets of symbols, with numbers for its parameters."""
        ...

    def bounds_for(self, out: ca.SX) -> tuple[np.ndarray, np.ndarray]:
        """(C,) the bounds of the components of its expression, column by column."""
        ...

    def held(self, setting: Setting, times: np.ndarray) -> Constraint:
        """As part of a program, at times (N, s) of each jet."""
        ...

    def written_for(self, *jets: AnyJet) -> "Condition": ...


def watched(condition: Condition, motions: Sequence[Seen], values: Mapping[str, np.ndarray]) -> Watched:
    """The expression of a condition along motions that are there."""
    return Watched(motions, looked_at(condition, motions, values))


def looked_at(condition: Condition, motions: Sequence[Seen], values: Mapping[str, np.ndarray]) -> Looked:
    """The expression of a condition for motions of a kind."""
    jets = [motion.symbols(slot) for slot, motion in enumerate(motions)]
    out = condition.said_of(jets, values)
    return Looked(jets, ca.vec(out), *condition.bounds_for(out), condition.power)


@dataclass(frozen=True, eq=False)
class Along:
    """A condition everywhere along the motion of a program. An `Everywhere`.

    setting: of the program; its `bodies` are the names of the motions that the condition is about, of a joined one.
    """

    condition: Condition
    setting: Setting

    def __getstate__(self) -> dict[str, object]:
        jets = [space.symbols(slot) for slot, space in enumerate(self.setting.spaces)]
        return {"condition": self.condition.written_for(*jets), "setting": self.setting}

    def _motions(self, motion: object) -> list[Seen]:
        bodies = self.setting.bodies
        if bodies and isinstance(motion, Mapping):
            return [seen(motion[body]) for body in bodies]
        return [seen(motion)]

    def _watched(self, motions: Sequence[Seen], parameters: Mapping[str, np.ndarray]) -> Watched:
        # An exchange looks at one motion after the other.
        key = tuple((name, value.tobytes()) for name, value in parameters.items())
        known = self.__dict__.get("_looked")
        if known is None or known[0] != key:
            known = key, looked_at(self.condition, motions, parameters)
            self.__dict__["_looked"] = known
        return Watched(motions, known[1])

    def excess(self, motion: object, parameters: Mapping[str, np.ndarray]) -> Excess:
        return self._watched(self._motions(motion), parameters).excess()

    def peaks(self, motion: object, parameters: Mapping[str, np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
        motions = self._motions(motion)
        times, heights = self._watched(motions, parameters).peaks()
        return self._retold(motions, np.repeat(times[:, None], len(motions), axis=1), back=False), heights

    def excesses(self, motion: object, parameters: Mapping[str, np.ndarray], times: np.ndarray) -> np.ndarray:
        motions = self._motions(motion)
        return self._watched(motions, parameters).excesses(self._retold(motions, times, back=True))

    def _retold(self, motions: Sequence[Seen], times: np.ndarray, back: bool) -> np.ndarray:
        """(N, s) times of a motion as the program tells them, or back: by the knots of its start, where they move."""
        columns = []
        for space, there, column in zip(self.setting.spaces, motions, times.T, strict=True):
            here, marks = space.breakpoints, there.breakpoints
            if back:
                here, marks = marks, here
            moved = len(here) == len(marks) and not np.array_equal(here, marks)
            columns.append(np.interp(column, marks, here) if moved else np.clip(column, *space.domain))
        return np.stack(columns, axis=1)

    def breaks(self) -> np.ndarray:
        spaces = self.setting.spaces
        first, last = max(s.domain[0] for s in spaces), min(s.domain[1] for s in spaces)
        marks = np.unique(np.concatenate([s.breakpoints for s in spaces]))
        return np.concatenate([[first], marks[(marks > first) & (marks < last)], [last]])

    def at(self, times: np.ndarray, constraint: Constraint) -> Constraint:
        fresh = self.condition.held(self.setting, times)
        old = constraint.block
        data = fresh.block.data.copy()
        for place, given in zip(fresh.parameters, constraint.parameters, strict=True):
            data[:, place.columns] = old.data[:1, given.columns]
        # The same kernel, so that what is compiled for it serves.
        block = replace(fresh.block, name=old.name, variable=old.variable, kernel=old.kernel, data=data)
        shape = None if constraint.shape is None else fresh.shape
        return replace(constraint, block=block, lower=fresh.lower, upper=fresh.upper, shape=shape, times=fresh.times)
