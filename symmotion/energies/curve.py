"""What makes a motion curve smooth."""

from dataclasses import dataclass

import casadi as ca
import numpy as np

from symmotion import checks
from symmotion.energies.energy import Energy
from symmotion.errors import InputError
from symmotion.jets import CurveJet


@dataclass(frozen=True, eq=False)
class Bending(Energy):
    """∫ ‖x⁽ᵏ⁾‖² dt of a curve x; natural splines of degree 2k − 1 make it least.

    order: k, 1, 2 or 3. Unit: length²/time²ᵏ⁻¹.

    Raises InputError for another order.

    >>> line = sm.curves.bezier([[0.0, 0.0], [1.0, 1.0]])
    >>> float(sm.measure(line, sm.energies.Bending()))
    0.0
    """

    order: int = 2

    def __post_init__(self):
        if isinstance(self.order, bool) or not isinstance(self.order, int | np.integer) or self.order not in (1, 2, 3):
            raise InputError(f"order {checks.told(self.order)}: 1, 2 or 3 is needed")

    @property
    def name(self) -> str:
        return f"∫ ‖x{self.order * chr(39)}‖²"

    def residuals(self, jet: CurveJet) -> ca.SX:
        # Row by row, as the curve's coordinates are counted.
        return ca.vec(jet.derivatives[self.order].T)

    @property
    def exact(self) -> bool:
        return True

    def nodes(self, degree: int) -> int:
        # On a span the integrand has degree 2 (p − k).
        return max(1, degree - self.order + 1)
