"""The torque that turns a body, integrated: what orientation and pose motions are made cheap in (KKS 6.1)."""

from dataclasses import dataclass

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike

from symmotion import checks
from symmotion.energies.energy import Energy
from symmotion.errors import InputError
from symmotion.jets import Jet, RigidJet


@dataclass(frozen=True, eq=False)
class Torque(Energy):
    """∫ ‖τ‖² dt, τ = J Ω̇ + Ω × JΩ, the torque about the centre of mass that a turning body needs: KKS 6.1.

    inertia: J, (3, 3) symmetric positive definite or (3,) principal moments; the identity when left out, which makes
    it the energy ∫ ‖Ω̇‖² dt of the angular acceleration. Unit: (unit of J)² rad²/time³.
    gauss_nodes: per span; the integrand is no polynomial, except about a single axis. None: as many as ten digits
        need.

        Torque((1.0, 2.0, 2.5)) + 0.1 * TrajectoryEnergy([[0.3, 0.0, 0.0]])
    """

    inertia: ArrayLike | None = None
    gauss_nodes: int | None = 6

    def __post_init__(self):
        if self.gauss_nodes is not None:
            checks.whole(self.gauss_nodes, 1, "Gauss nodes")
        if self.inertia is not None:
            object.__setattr__(self, "inertia", checks.read_only(as_inertia(self.inertia)))

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


def as_inertia(inertia: ArrayLike | None) -> np.ndarray:
    """(3, 3) the inertia from a matrix, principal moments (3,) or None; InputError unless positive definite."""
    if inertia is None:
        return np.eye(3)
    moments = checks.numbers(inertia, "inertia")
    moments = np.diag(moments) if moments.shape == (3,) else moments
    if moments.shape != (3, 3) or not np.isfinite(moments).all():
        raise InputError(f"inertia of shape {np.shape(inertia)}: finite, (3, 3) or (3,), is needed")
    if not np.allclose(moments, moments.T, rtol=1e-9, atol=0):
        raise InputError("inertia must be symmetric")
    least, *_, largest = np.linalg.eigvalsh(moments)
    if least <= 1e-12 * max(largest, 0.0) or largest <= 0:
        raise InputError(
            f"inertia is singular or not positive (least moment {least:.3g}): a body needs extent about every axis"
        )
    return moments
