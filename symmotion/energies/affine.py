"""Rigidity and trajectory energies of affine motions (HJK 3.1, 3.2)."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike

from symmotion import checks
from symmotion.energies.energy import Energy
from symmotion.errors import InputError
from symmotion.jets import BodyJet, Jet
from symmotion.values import read_only


@dataclass(frozen=True, eq=False)
class Rigidity(Energy):
    """R = ∫ Σ w_ij (dᵏ/dtᵏ q_iᵀ AᵀA q_j)² dt, zero on rigid motions: HJK (10) for k = 1, HJK (11), R*, for k = 2.

    order: k. test_vectors: (d, T), columns q_i that span the space, the unit vectors when left
    out; weights: (T, T) symmetric, not negative, ones when left out. R has the unit
    length⁴/time for k = 1 and length⁴/time³ for k = 2.

    Raises InputError for another order, vectors that do not span the space, and weights that are negative or not
    symmetric.

    >>> linear = sm.interpolants.component_cubic(sm.examples.quarter_turn())
    >>> round(sm.measure(linear, sm.Rigidity(2)), 6)
    32.0
    """

    order: int = 1
    test_vectors: np.ndarray | None = None
    weights: np.ndarray | None = None

    if TYPE_CHECKING:
        # Whatever is like an array goes in; the fields are arrays.
        def __init__(
            self, order: int = 1, test_vectors: ArrayLike | None = None, weights: ArrayLike | None = None
        ) -> None: ...

    def __post_init__(self):
        whole = isinstance(self.order, int | np.integer) and not isinstance(self.order, bool)
        if not whole or self.order not in (1, 2):
            raise InputError(f"rigidity of order {checks.told(self.order)}: 1 (HJK 10) or 2 (HJK 11) is needed")
        if self.test_vectors is not None:
            q = read_only(checks.numbers(self.test_vectors, "test vectors"))
            if q.ndim != 2 or not np.isfinite(q).all():
                raise InputError(f"test vectors of shape {q.shape}: finite columns, shape (d, T), are needed")
            if np.linalg.matrix_rank(q) < len(q):
                raise InputError(f"the {q.shape[1]} test vectors do not span the {len(q)}-dimensional space")
            object.__setattr__(self, "test_vectors", q)
        if self.weights is not None:
            w = read_only(checks.numbers(self.weights, "weights"))
            if w.ndim != 2 or w.shape[0] != w.shape[1] or not np.isfinite(w).all():
                raise InputError(f"weights of shape {w.shape}: a finite square array (T, T) is needed")
            if (w < 0).any():
                i, j = np.argwhere(w < 0)[0]
                raise InputError(f"weight ({i}, {j}) is negative: {w[i, j]:g}")
            if not np.allclose(w, w.T):
                raise InputError("weights must be symmetric")
            if self.test_vectors is not None and len(w) != self.test_vectors.shape[1]:
                raise InputError(f"{len(w)} × {len(w)} weights for {self.test_vectors.shape[1]} test vectors")
            object.__setattr__(self, "weights", w)

    @property
    def name(self) -> str:
        return "R" if self.order == 1 else "R*"

    def residuals(self, jet: Jet) -> ca.SX:
        d = jet.dimension
        q = np.eye(d) if self.test_vectors is None else self.test_vectors
        if len(q) != d:
            raise InputError(f"test vectors of dimension {len(q)} for a motion in {d}D")
        w = np.ones((q.shape[1],) * 2) if self.weights is None else self.weights
        if len(w) != q.shape[1]:
            raise InputError(f"{len(w)} × {len(w)} weights for {q.shape[1]} test vectors")
        rate = ca.DM(q).T @ (jet.gram_rate if self.order == 1 else jet.gram_acceleration) @ ca.DM(q)
        # The matrix is symmetric: the pairs (i, j) and (j, i) are one residual with twice the weight.
        pairs = [(i, j) for i in range(len(w)) for j in range(i + 1) if w[i, j] > 0]
        return ca.vertcat(*(np.sqrt(w[i, j] * (1 if i == j else 2)) * rate[i, j] for i, j in pairs))

    @property
    def exact(self) -> bool:
        return True

    def nodes(self, degree: int) -> int:
        # On a span the integrand has degree 4p − 2, for R* 4p − 4; m Gauss nodes are exact to 2m − 1.
        return max(1, 2 * degree + 1 - self.order)


@dataclass(frozen=True, eq=False)
class TrajectoryEnergy(Energy):
    """E = ∫ Σ m_i ‖v̈ + Ä p_i‖² dt, the bending of the paths of body points: HJK (12). Of poses too, A = R.

    points: (P, d) body points p_i; masses: (P,) positive, ones when left out. Unit:
    mass · length²/time³.

    Raises InputError for points of another dimension, and masses that are not positive.

    >>> motion = sm.interpolants.component_cubic(sm.examples.planar_keyframes())
    >>> round(sm.measure(motion, sm.TrajectoryEnergy(np.zeros((1, 2)))), 3)
    567.198
    """

    points: np.ndarray
    masses: np.ndarray | None = None

    if TYPE_CHECKING:
        # Whatever is like an array goes in; the fields are arrays.
        def __init__(self, points: ArrayLike, masses: ArrayLike | None = None) -> None: ...

    def __post_init__(self):
        points = read_only(checks.numbers(self.points, "body points"))
        if points.ndim != 2 or not points.size or not np.isfinite(points).all():
            raise InputError(f"body points of shape {points.shape}: finite, shape (P, d), P ≥ 1, is needed")
        object.__setattr__(self, "points", points)
        if self.masses is not None:
            masses = read_only(checks.numbers(self.masses, "masses"))
            if masses.shape != (len(points),):
                raise InputError(f"masses of shape {masses.shape} for {len(points)} points")
            if not (masses > 0).all() or not np.isfinite(masses).all():
                i = int(np.argmin((masses > 0) & np.isfinite(masses)))
                raise InputError(f"mass {i} is {masses[i]:g}: masses must be positive and finite")
            object.__setattr__(self, "masses", masses)

    @property
    def name(self) -> str:
        return "E"

    def residuals(self, jet: BodyJet) -> ca.SX:
        if not isinstance(jet, BodyJet):
            raise InputError(f"E is of body points, and a jet of kind {jet.kind} has none")
        if self.points.shape[1] != jet.dimension:
            raise InputError(f"body points of dimension {self.points.shape[1]} for a motion in {jet.dimension}D")
        return jet.bending(self.points, np.ones(len(self.points)) if self.masses is None else self.masses)

    @property
    def exact(self) -> bool:
        return True

    def nodes(self, degree: int) -> int:
        return max(1, degree - 1)
