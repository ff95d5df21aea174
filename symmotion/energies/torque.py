"""The torque that turns a body, integrated: what orientation and pose motions are made cheap in (KKS 6.1)."""

from dataclasses import dataclass

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike

from symmotion import checks
from symmotion.energies.energy import Energy
from symmotion.jets import Jet, RigidJet
from symmotion.jets.inertia import as_inertia
from symmotion.values import read_only


@dataclass(frozen=True, eq=False)
class Torque(Energy):
    """∫ ‖τ‖² dt, τ = J Ω̇ + Ω × JΩ, the torque about the centre of mass that a turning body needs: KKS 6.1.

    inertia: J, (3, 3) symmetric positive definite or (3,) principal moments, none of which exceeds the sum of the
    other two (they are ∫ y² + z² dm, ∫ z² + x² dm, ∫ x² + y² dm of a body); the identity when left out, which makes
    it the energy ∫ ‖Ω̇‖² dt of the angular acceleration. Unit: (unit of J)² rad²/time³.
    gauss_nodes: per span; the integrand is no polynomial, except about a single axis. None: as many as ten digits
        need.

        Torque((1.0, 2.0, 2.5)) + 0.1 * TrajectoryEnergy([[0.3, 0.0, 0.0]])

    Raises InputError for an inertia that no body has.

    >>> keys = sm.examples.random_keyframes(4, 60, seed=1)
    >>> curve = sm.quaternions.interpolate_quaternions(keys)
    >>> least = sm.ExactNewton().solve(sm.orientation_program(keys, objective=sm.Torque((1.0, 2.0, 2.5)))).require()
    >>> least.objective < sm.measure(curve, sm.Torque((1.0, 2.0, 2.5)))
    True
    """

    inertia: ArrayLike | None = None
    gauss_nodes: int | None = 6

    def __post_init__(self):
        if self.gauss_nodes is not None:
            checks.whole(self.gauss_nodes, 1, "Gauss nodes")
        if self.inertia is not None:
            object.__setattr__(self, "inertia", read_only(as_inertia(self.inertia)))

    @property
    def name(self) -> str:
        return "acceleration" if self.plain else "torque"

    @property
    def plain(self) -> bool:
        """Whether the inertia is the identity."""
        return self.inertia is None or np.array_equal(self.inertia, np.eye(3))

    def residuals(self, jet: Jet | RigidJet) -> ca.SX:
        return jet.acceleration if self.plain else jet.torque(as_inertia(self.inertia))

    def nodes(self, degree: int) -> int:
        return self.gauss_nodes or 2 * degree

    @property
    def stated(self) -> bool:
        return self.gauss_nodes is not None
