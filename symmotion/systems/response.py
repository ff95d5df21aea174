"""How a minimum answers to small changes: its KKT matrix, factorised once."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any, Protocol, TypeAlias, TypeVar

import numpy as np
import scipy.linalg as la
from scipy import sparse
from scipy.sparse.csgraph import reverse_cuthill_mckee
from scipy.sparse.linalg import SuperLU, splu

from symmotion.errors import SolveError
from symmotion.program.evaluate import Evaluator
from symmotion.program.program import Program
from symmotion.systems.certificate import Inspection
from symmotion.systems.condensed import Condensed
from symmotion.systems.saddle import HessianTriangle


class Response(Protocol):
    """The KKT matrix K = [[H, Jᵀ], [J, 0]] of a minimum with its active conditions, H of the Lagrangian, factorised.

    Data p move the unknowns and the multipliers by K (dx, dλ) = −B dp, B = (B_x, B_c) (unknowns + conditions, size).

    >>> from symmotion.program import Evaluator
    >>> solution = sm.ExactNewton().solve(sm.affine_program(sm.examples.planar_keyframes()))
    >>> inspection = sm.systems.Inspection(
    ...     solution.program, Evaluator(solution.program), solution.x, solution.multiplier_vector
    ... )
    >>> response, repeated = sm.systems.response_of(inspection)
    >>> len(repeated)
    0
    """

    # Any: what the readings of this response collect.
    def reading(self, data: sparse.csr_array) -> "Reading[Any]":
        """What answers to changes of data with the derivatives B."""
        ...

    # Any: what the readings of this response collect.
    def adjoint(self, gradient: np.ndarray) -> Any:
        """The transposed solve for scalars with gradients (unknowns, k) by the unknowns, shared by all data."""
        ...


Reply = TypeVar("Reply", contravariant=True)


class Reading(Protocol[Reply]):
    """What a minimum answers to some data, batched: columns are directions."""

    def tangent(self, change: np.ndarray) -> np.ndarray:
        """(unknowns, k) dx for changes (size, k)."""
        ...

    def pressure(self, change: np.ndarray, tangent: np.ndarray) -> np.ndarray:
        """(conditions, k) dλ for changes (size, k) that move the unknowns by tangent."""
        ...

    def collect(self, reply: Reply, gradient: np.ndarray) -> np.ndarray:
        """(size, k) the gradients by the data of scalars with gradients (unknowns, k), from their transposed solve."""
        ...


# Any: the reply of its own response.
AnyReading: TypeAlias = Reading[Any]


def full_hessian(program: Program, evaluator: Evaluator, x: np.ndarray, multipliers: np.ndarray) -> sparse.csr_array:
    """(unknowns, unknowns) the Hessian of f + λᵀg."""
    triangle = HessianTriangle.of(program)
    flat = evaluator.second_order(x, triangle.pattern, multipliers)[1]
    return triangle.full(flat, program.unknowns)


@dataclass(frozen=True, eq=False)
class CondensedResponse:
    """On the null-space basis Z of linear conditions that decouple: banded, dx = Z f + Y c with J Y = 1."""

    system: Condensed
    factor: np.ndarray
    hessian: sparse.csr_array

    @cached_property
    def basis(self) -> sparse.csr_array:
        """(unknowns, free) Z for all channels."""
        return self.system.whole_basis()

    @cached_property
    def basis_transposed(self) -> sparse.csr_array:
        return sparse.csr_array(self.basis.T)

    @cached_property
    def lift(self) -> sparse.csr_array:
        """(unknowns, conditions) Y: the pivot controls that move the conditions by one each."""
        return self.system.lift

    @cached_property
    def lift_transposed(self) -> sparse.csr_array:
        return sparse.csr_array(self.lift.T)

    def solve(self, rhs: np.ndarray) -> np.ndarray:
        """(free, k) of the reduced Hessian."""
        if not rhs.size:
            return np.zeros_like(rhs)
        half = la.lapack.dtbtrs(self.factor, rhs, uplo="L")[0]
        return la.lapack.dtbtrs(self._upper, half, uplo="U")[0]

    @cached_property
    def _upper(self) -> np.ndarray:
        """(b, free) the factor's transpose as an upper band: column by column it takes half of a transposed solve."""
        b, n = self.factor.shape
        upper = np.zeros((b, n), order="F")
        for k in range(b):
            upper[b - 1 - k, k:] = self.factor[k, : n - k]
        return upper

    def adjoint(self, gradient: np.ndarray) -> np.ndarray:
        """(free, k)."""
        return self.solve(self.basis_transposed @ gradient)

    def reading(self, data: sparse.csr_array) -> "CondensedReading":
        n = self.hessian.shape[0]
        slopes, offsets = sparse.csr_array(data[:n]), sparse.csr_array(data[n:])
        moved = sparse.csr_array(-(self.lift @ offsets))
        forces = sparse.csr_array(slopes + self.hessian @ moved)
        return CondensedReading(self, slopes, moved, sparse.csr_array(self.basis_transposed @ forces))


@dataclass(frozen=True, eq=False)
class CondensedReading:
    """slopes: B_x; moved: −Y B_c, what keeps the conditions; forces: Zᵀ(B_x − H Y B_c), what pulls then."""

    response: CondensedResponse
    slopes: sparse.csr_array
    moved: sparse.csr_array
    forces: sparse.csr_array

    def tangent(self, change: np.ndarray) -> np.ndarray:
        free = self.response.solve(self.forces @ change)
        return self.moved @ change - self.response.basis @ free

    def pressure(self, change: np.ndarray, tangent: np.ndarray) -> np.ndarray:
        return -(self.response.lift_transposed @ (self.slopes @ change + self.response.hessian @ tangent))

    def collect(self, reply: np.ndarray, gradient: np.ndarray) -> np.ndarray:
        return self._moved_transposed @ gradient - self._forces_transposed @ reply

    @cached_property
    def _moved_transposed(self) -> sparse.csr_array:
        return sparse.csr_array(self.moved.T)

    @cached_property
    def _forces_transposed(self) -> sparse.csr_array:
        return sparse.csr_array(self.forces.T)


@dataclass(frozen=True, eq=False)
class SparseResponse:
    """In all unknowns and active multipliers, by a factorisation with pivots.

    matrix: K with its rows and columns in an order (unknowns + active,), in which it is a band as narrow as the motion
    lets it, scaled by scale (unknowns + active,) from both sides; rows: (active,) which of the conditions are active
    and independent.
    """

    matrix: sparse.csc_array
    order: np.ndarray
    scale: np.ndarray
    rows: np.ndarray
    n: int
    conditions: int

    @staticmethod
    def of(
        hessian: sparse.csr_array, jacobian: sparse.csr_array, rows: np.ndarray, unit: np.ndarray
    ) -> "SparseResponse":
        n, active = hessian.shape[0], jacobian[rows]
        reach = np.asarray(abs(active) @ unit)
        size = float(np.abs(hessian.diagonal() * unit**2).max(initial=0.0)) or 1.0
        scale = np.concatenate([unit / np.sqrt(size), np.sqrt(size) / np.where(reach > 0, reach, 1.0)])
        whole = sparse.block_array([[hessian, active.T], [active, None]], format="csr") if len(rows) else hessian
        matrix = sparse.csr_array(scale[:, None] * sparse.csr_array(whole) * scale)
        order = reverse_cuthill_mckee(matrix, symmetric_mode=True)
        return SparseResponse(sparse.csc_array(matrix[order][:, order]), order, scale, rows, n, jacobian.shape[0])

    @cached_property
    def _factor(self) -> SuperLU:
        try:
            return splu(self.matrix, permc_spec="NATURAL")
        except RuntimeError as error:
            raise SolveError("the KKT matrix is singular: the minimum does not move smoothly") from error

    def solve(self, rhs: np.ndarray) -> np.ndarray:
        """(unknowns + active, k)."""
        found = np.empty_like(rhs)
        found[self.order] = self._factor.solve((self.scale[:, None] * rhs)[self.order])
        found *= self.scale[:, None]
        return found

    def adjoint(self, gradient: np.ndarray) -> np.ndarray:
        """(unknowns + active, k)."""
        return self.solve(np.concatenate([gradient, np.zeros((len(self.rows), gradient.shape[1]))]))

    def reading(self, data: sparse.csr_array) -> "SparseReading":
        lines = np.concatenate([np.arange(self.n), self.n + self.rows])
        return SparseReading(self, sparse.csr_array(data[lines]))


@dataclass(frozen=True, eq=False)
class SparseReading:
    """data: B in the rows of the unknowns and of the active conditions."""

    response: SparseResponse
    data: sparse.csr_array

    def tangent(self, change: np.ndarray) -> np.ndarray:
        return -self.response.solve(self.data @ change)[: self.response.n]

    def pressure(self, change: np.ndarray, tangent: np.ndarray) -> np.ndarray:
        found = np.zeros((self.response.conditions, change.shape[1]))
        found[self.response.rows] = -self.response.solve(self.data @ change)[self.response.n :]
        return found

    def collect(self, reply: np.ndarray, gradient: np.ndarray) -> np.ndarray:
        return -(self._transposed @ reply)

    @cached_property
    def _transposed(self) -> sparse.csr_array:
        return sparse.csr_array(self.data.T)


def response_of(inspection: Inspection, more: sparse.csr_array | None = None) -> tuple[Response, np.ndarray]:
    """How a minimum answers, and the rows of active conditions that follow from others.

    more: (unknowns, unknowns) what is added to the Hessian of the Lagrangian.

    Raises SolveError where the minimum is not strict, along the active conditions, to second order.

    >>> from symmotion.program import Evaluator
    >>> solution = sm.ExactNewton().solve(sm.affine_program(sm.examples.planar_keyframes()))
    >>> inspection = sm.systems.Inspection(
    ...     solution.program, Evaluator(solution.program), solution.x, solution.multiplier_vector
    ... )
    >>> response, repeated = sm.systems.response_of(inspection)
    >>> len(repeated)
    0
    """
    program, x, multipliers = inspection.program, inspection.x, inspection.multipliers
    hessian = full_hessian(program, inspection.evaluator, x, multipliers)
    system, none = inspection.shared, np.empty(0, dtype=int)
    if isinstance(system, Condensed):
        flat = inspection.evaluator.second_order(x, system.pattern)[1]
        factor = system.factorise(flat)
        if factor is None:
            raise SolveError(FLAT)
        return CondensedResponse(system, factor, hessian), none
    rows, degenerate = inspection.rows
    saddle = inspection.system
    curvature = saddle.curvature(inspection.evaluator.second_order(x, saddle.pattern, multipliers)[1])
    if curvature.inertia != "positive":
        raise SolveError(FLAT)
    active = np.flatnonzero(inspection.pressing)
    repeated = np.setdiff1d(active, rows) if degenerate else none
    hessian = hessian if more is None else sparse.csr_array(hessian + more)
    return SparseResponse.of(hessian, inspection.jacobian, rows, program.unit), repeated


FLAT = "the curvature along the conditions is not positive: there is no single minimum that moves with the data"
