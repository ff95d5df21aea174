"""How much a vehicle slips sideways: what motions of wheels, keels and skates have little of."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike

from symmotion import checks
from symmotion.energies.energy import Energy
from symmotion.errors import InputError
from symmotion.jets import Jet, RigidJet
from symmotion.values import read_only


@dataclass(frozen=True, eq=False)
class SideSlip(Energy):
    """∫ ‖Nᵀ Aᵀ (v̇ + Ȧ p)‖² dt: the velocity of a body point across the direction in which the body travels.

    N: (d, d − 1) unit vectors orthogonal to `forward`. Zero where a vehicle rolls as its wheels stand, forward or
    backward: then the path says how it turns. Of poses too, A = R. Unit length²/time.

    forward: (d,) in the body's own axes, of any length. point: (d,) p, the body point that does not slip, midway
    between wheels that are not steered; the origin when left out.

    Beside `rigid_objective` 10/L² is a weight to begin with, L the root mean square distance of the places from their
    centre: a car's places between keyframes are off by 0.36 as much where these are a second apart, and by 0.54 where
    two (`python -m studies recordings --full`).

    Raises InputError for a direction that is zero, and for one or a point of another dimension.

    >>> forward = sm.Keyframes([0, 1], np.tile(np.eye(2), (2, 1, 1)), [[0, 0], [3, 0]])
    >>> motion = sm.interpolants.component_cubic(forward)
    >>> [round(sm.measure(motion, sm.energies.SideSlip(f)), 6) + 0.0 for f in ((1, 0), (0, 1))]
    [0.0, 9.0]
    """

    forward: np.ndarray
    point: np.ndarray | None = None

    if TYPE_CHECKING:
        # Whatever is like an array goes in; the fields are arrays.
        def __init__(self, forward: ArrayLike, point: ArrayLike | None = None) -> None: ...

    def __post_init__(self):
        forward = checks.array(self.forward, ("d",), "forward")
        if len(forward) not in (2, 3) or not forward.any():
            raise InputError(f"forward {checks.told(forward)}: a direction (2,) or (3,), not zero, is needed")
        object.__setattr__(self, "forward", read_only(forward))
        if self.point is not None:
            object.__setattr__(self, "point", read_only(checks.array(self.point, (len(forward),), "point")))

    @property
    def name(self) -> str:
        return "slip"

    def residuals(self, jet: Jet | RigidJet) -> ca.SX:
        d = len(self.forward)
        if jet.dimension != d:
            raise InputError(f"forward of dimension {d} for a motion in {jet.dimension}D")
        across = np.linalg.qr(self.forward[:, None], mode="complete")[0][:, 1:]
        velocity = jet.dv if self.point is None else jet.velocity(self.point)
        return ca.DM(across).T @ (jet.A.T @ velocity)

    @property
    def exact(self) -> bool:
        return True

    def nodes(self, degree: int) -> int:
        # On a span the integrand has degree 4p − 2.
        return max(1, 2 * degree)
