"""How rough turn and place are, each by a derivative and a weight of its own: what smooths recordings and keyframes."""

from dataclasses import dataclass

import casadi as ca
import numpy as np

from symmotion import checks
from symmotion.energies.energy import Energy
from symmotion.errors import InputError
from symmotion.jets import Jet

ORDERS = (2, 3)


@dataclass(frozen=True, eq=False)
class Roughness(Energy):
    """∫ w_A ‖A^(k)‖² + w_v ‖v^(l)‖² dt: how rough turn and place are, each by a derivative of its own.

    turn, place: w_A and w_v, not negative; orders: (k, l), 2 or 3.

    Raises InputError for weights that are negative or both 0, and for other orders.

    >>> motion = sm.interpolants.component_cubic(sm.examples.planar_keyframes())
    >>> sm.measure(motion, sm.energies.Roughness(1.0, 1.0)) > 0
    True
    """

    turn: float
    place: float
    orders: tuple[int, int] = (2, 2)

    def __post_init__(self):
        for weight, part in ((self.turn, "turn"), (self.place, "place")):
            checks.not_negative(weight, f"weight of the {part}")
        if not self.turn and not self.place:
            raise InputError("weights of turn and place are both 0: one of them has to be positive")
        if len(self.orders) != 2 or any(order not in ORDERS for order in self.orders):
            raise InputError(f"orders {checks.told(self.orders)}: of turn and place, 2 or 3 each, are needed")

    @property
    def name(self) -> str:
        return "roughness"

    def residuals(self, jet: Jet) -> ca.SX:
        turns, places = {2: jet.ddA, 3: jet.dddA}, {2: jet.ddv, 3: jet.dddv}
        parts = (self.turn, ca.vec(turns[self.orders[0]])), (self.place, places[self.orders[1]])
        return ca.vertcat(*(np.sqrt(weight) * part for weight, part in parts if weight))

    def nodes(self, degree: int) -> int:
        return max(1, degree - min(self.orders) + 1)

    @property
    def exact(self) -> bool:
        return True
