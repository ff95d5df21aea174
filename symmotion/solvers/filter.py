"""The filter by which steps towards curved conditions are judged: objective and violation apart, not weighed."""

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

EPS = float(np.finfo(float).eps)
# Relative decreases that are enough, of the violation or, beside it, of the objective; and along its slope.
ENOUGH, ALONG = 1e-5, 1e-8
# A step counts as one of the objective's where its slope to this power outweighs the violation to that.
SLOPE, MISSED = 2.3, 1.1
# A violation that no step exceeds, unless the first did: further away the conditions are others than those linearised.
MOST = 0.5
# Violations, relative to the first one or to one, up to which the objective alone counts.
LITTLE = 1e-4


class Seen(NamedTuple):
    """What is judged of a point: the violation ‖c‖₁ in own units, and f in units of its gradient."""

    missed: float
    objective: float


@dataclass
class Filter:
    """Points that steps may not be worse than in both respects (Fletcher, Leyffer 2002; Wächter, Biegler 2006).

    first: the violation at the start; conditions: how many there are, the rounding of which is none.
    """

    first: float
    conditions: int
    _kept: list[Seen] = field(default_factory=list)

    def takes(self, there: Seen) -> bool:
        """Whether a point is better than every one that is kept, in one respect at least."""
        finite = np.isfinite(there.missed) and np.isfinite(there.objective)
        if not finite or there.missed > max(MOST, self.first):
            return False
        return all(there.missed < kept.missed or there.objective < kept.objective for kept in self._kept)

    def keep(self, here: Seen) -> None:
        """No step may come back to about this point."""
        self._kept.append(Seen((1 - ENOUGH) * here.missed, here.objective - ENOUGH * here.missed))

    def accepts(self, here: Seen, there: Seen, length: float, slope: float) -> bool:
        """Whether a step of some length goes to a better point; slope: of the objective along all of it.

        Where it does, and the violation decides, no later step may come back to where it began.
        """
        if not self.takes(there):
            return False
        rounding = 10 * EPS * abs(here.objective)
        falls = slope < 0 and length * (-slope) ** SLOPE > here.missed**MISSED
        if falls and here.missed <= LITTLE * max(1.0, self.first):
            return there.objective <= here.objective + ALONG * length * slope + rounding
        nearer = there.missed <= (1 - ENOUGH) * here.missed
        if nearer or there.objective <= here.objective - ENOUGH * here.missed:
            if not falls:
                self.keep(here)
            return True
        # At the end both are rounding.
        return there.missed <= 100 * EPS * self.conditions and there.objective <= here.objective + rounding
