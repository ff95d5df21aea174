"""The sparse saddle system, for any program: [[H, Jᵀ], [J, −δI]] without pivots, equilibrated and refined."""

from collections.abc import Callable
from copy import copy
from dataclasses import dataclass
from threading import get_ident
from typing import TypeAlias

import casadi as ca
import numpy as np
import scipy.linalg as la
from scipy import sparse
from scipy.sparse.linalg import LinearOperator, SuperLU, splu

from symmotion.brief import in_a_line
from symmotion.errors import InputError
from symmotion.program.evaluate import Evaluator, Pattern
from symmotion.program.local import Targets
from symmotion.program.program import Program
from symmotion.systems.condensed import lowest_curvature
from symmotion.systems.curvature import (
    EPS,
    FLAT,
    POSITIVE,
    UNKNOWN,
    Curvature,
    dense_curvature,
    first_failing_pivot,
    scaling,
)
from symmotion.systems.system import gram_factor, own_size, reach, solved

# The factorisation does not pivot: a zero in the lower block would stop it, and one that is next to zero costs the
# digits of all that is small beside stiff bounds. Refinement removes its effect.
DELTA = 1e-3
# Sweeps that bring rows and columns to size one, and steps of refinement, which end at a relative residual.
SWEEPS, REFINED, EXACT = 5, 8, 1e-15
# Unknowns up to which a dense basis of the null space is taken, where it decides whether curvature is negative.
DENSE = 300
# Of a diagonal entry beside the largest of its row, see `scaling`.
SLIGHT = 1e-4
# Weights of the conditions beside a Hessian of order one, in turn.
WEIGHTS = (1e2, 1e4, 1e6, 1e8)

# The saddle matrix as it is, the factor of the regular one in own units, and the units.
SaddleFactor: TypeAlias = tuple[sparse.csc_array, SuperLU, np.ndarray]


@dataclass(frozen=True, eq=False)
class HessianTriangle:
    """The sparsity of the Hessian's upper triangle: rows, columns (entries,), column by column, and its pattern.

    >>> triangle = sm.systems.HessianTriangle.of(sm.affine_program(sm.examples.planar_keyframes()))
    >>> bool((triangle.rows <= triangle.columns).all())
    True
    """

    rows: np.ndarray
    columns: np.ndarray
    pattern: Pattern

    __repr__ = in_a_line

    @property
    def diagonal(self) -> np.ndarray:
        """(unknowns,) where the diagonal lies among the entries."""
        return np.flatnonzero(self.rows == self.columns)

    @staticmethod
    def of(program: Program) -> "HessianTriangle":
        """The triangle for a program, made once."""
        if "triangle" not in program.structure:
            program.structure["triangle"] = HessianTriangle._make(program)
        return program.structure["triangle"]

    @staticmethod
    def _make(program: Program) -> "HessianTriangle":
        n = program.unknowns
        blocks = (*program.terms, *(c.block for c in program.constraints if not c.block.kernel.linear))
        entries, unread = [], np.ones(n, dtype=bool)
        for b in blocks:
            local = b.local.blocks
            first, stride = program.place(b.variable)
            channel = np.arange(stride)[b.channels] + first
            row = local[0][:, None, None] * stride + channel[:, None]
            column = local[1][:, None, None] * stride + channel
            # The blocks are those with a ≤ b; inside one on the diagonal half the entries are mirror images.
            entries.append(np.where(row <= column, column * n + row, n * n).ravel())
            own = local[1][local[0] == local[1]]
            unread[own[:, None] * stride + channel] = False
        # Multiples of the identity go to unknowns too that no term reads.
        unread = np.flatnonzero(unread) * (n + 1)
        if len(entries) == 1 and not len(unread):
            order = np.argsort(entries[0], kind="stable")
            keys = entries[0][order]
            targets = [np.empty(len(order), dtype=np.intp)]
            targets[0][order] = np.arange(len(order))
        else:
            keys, places = np.unique(np.concatenate([*entries, unread, [n * n]]), return_inverse=True)
            targets = np.split(places, np.cumsum([len(e) for e in entries]))[:-1]
        size = int(np.searchsorted(keys, n * n))
        columns, rows = np.divmod(keys[:size], n)
        goals = []
        for b, t in zip(blocks, targets, strict=True):
            c = b.kernel.channels
            goals.append(Targets.of(np.minimum(t, size).reshape(-1, c, c), b.local.own, size))
        return HessianTriangle(rows, columns, Pattern(tuple(b.local for b in blocks), tuple(goals), size))

    def sparsity(self, n: int) -> ca.Sparsity:
        """The triangle as a CasADi sparsity (n, n)."""
        return ca.Sparsity(n, n, np.searchsorted(self.columns, np.arange(n + 1)).tolist(), self.rows.tolist())

    def full(self, values: np.ndarray, n: int) -> sparse.csr_array:
        """(n, n) the symmetric matrix of values in the order of the pattern."""
        upper = sparse.csr_array((values, (self.rows, self.columns)), shape=(n, n))
        return sparse.csr_array(upper + sparse.triu(upper, 1).T)


def kkt_pattern(program: Program) -> sparse.csr_array:
    """(unknowns + conditions)² where the saddle matrix [[H, Jᵀ], [J, 0]] can differ from zero, as a boolean array.

    Raises InputError for what is no program.

    >>> program = sm.affine_program(sm.examples.planar_keyframes())
    >>> sm.systems.kkt_pattern(program).shape == (program.unknowns + program.conditions,) * 2
    True
    """
    jacobian = Evaluator(program).jacobian(program.x0)
    triangle = HessianTriangle.of(program)
    hessian = triangle.full(np.ones(triangle.pattern.size), program.unknowns)
    return sparse.csr_array(sparse.block_array([[hessian, jacobian.T], [jacobian, None]]) != 0)


class Saddle:
    """Newton's saddle system in all unknowns and multipliers, factorised by SuperLU without pivots.

    Raises InputError for conditions that are redundant or contradict each other.

    >>> from symmotion.program import Evaluator
    >>> program = sm.affine_program(sm.examples.planar_keyframes())
    >>> sm.systems.Saddle(program, Evaluator(program).jacobian(program.x0)).independent
    True
    """

    def __init__(self, program: Program, jacobian: sparse.csr_array):
        self.jacobian = jacobian
        self.n, self.m = program.unknowns, jacobian.shape[0]
        self.unit, self._reach = program.unit, reach(jacobian, program.unit)
        self._triangle = HessianTriangle.of(program)
        self.pattern = self._triangle.pattern
        # Every entry carries its number, so that sorting the whole matrix tells where each comes from.
        size, entries = self.n + self.m, self.pattern.size
        border = sparse.coo_array(jacobian)
        corner = np.arange(self.n, size)
        rows = [self._triangle.rows, self._triangle.columns, border.coords[1], border.coords[0] + self.n, corner]
        columns = [self._triangle.columns, self._triangle.rows, border.coords[0] + self.n, border.coords[1], corner]
        edge = entries + np.arange(border.nnz)
        number = [np.arange(entries), np.arange(entries), edge, edge, entries + border.nnz + np.arange(self.m)]
        keys = np.concatenate(columns) * size + np.concatenate(rows)
        keys, first = np.unique(keys, return_index=True)
        self._source = np.concatenate(number)[first]
        self._corner = self._source >= entries + border.nnz
        self._border = border.data
        columns, self._rows = np.divmod(keys, size)
        self._pointers = np.searchsorted(columns, np.arange(size + 1))
        self.diagonal = self._triangle.diagonal
        # Along the motion, where the matrix is banded, pivots next to zero come early, and refinement does not help.
        numbered = sparse.csc_array((np.arange(len(keys)), self._rows, self._pointers), shape=(size, size))
        self._order = np.array(ca.Sparsity(size, size, self._pointers.tolist(), self._rows.tolist()).amd(), dtype=int)
        self._banded = sparse.csc_array(numbered[self._order][:, self._order])
        self._factored_normal: SuperLU | None = None

    def __repr__(self) -> str:
        return f"Saddle({self.n} unknowns, {self.m} conditions)"

    @property
    def _normal(self) -> SuperLU | None:
        """The factor of J Jᵀ in own units, which projects onto the conditions; made when first needed.

        None without conditions.
        """
        if self._factored_normal is None and self.m:
            own = self._own
            try:
                self._factored_normal = splu(sparse.csc_array(own @ own.T))
            except RuntimeError as error:
                raise InputError("the conditions are redundant or contradict each other") from error
        return self._factored_normal

    @property
    def _own(self) -> sparse.csr_array:
        """(conditions, unknowns) the Jacobian in own units, in which unknowns and conditions are of order one."""
        return sparse.csr_array(self.jacobian.multiply(self.unit).multiply(1 / self._reach[:, None]))

    @staticmethod
    def of(program: Program, jacobian: Callable[[], sparse.csr_array]) -> "Saddle":
        """This thread's saddle system of a program; `jacobian` is called where it has to be made."""
        key = ("saddle", get_ident())
        if key not in program.structure:
            program.structure[key] = Saddle(program, jacobian())
        return program.structure[key]

    def at(self, jacobian: sparse.csr_array) -> "Saddle":
        """The system for a Jacobian of the same pattern at another point; what the pattern decides is shared."""
        other = copy(self)
        other.jacobian, other._border = jacobian, sparse.coo_array(jacobian).data
        other._factored_normal, other._reach = None, reach(jacobian, self.unit)
        return other

    def feasible(self, x: np.ndarray, violation: np.ndarray) -> np.ndarray:
        """(unknowns,) x with the least change, in own units, that makes linear conditions hold."""
        if self._normal is None or not violation.any():
            return x
        return x - self.unit * (self._own.T @ self._normal.solve(violation / self._reach))

    def reduced(self, gradient: np.ndarray) -> np.ndarray:
        """(unknowns,) the part of a gradient along the conditions."""
        return gradient + self.jacobian.T @ self.multipliers(gradient)

    def multipliers(self, gradient: np.ndarray) -> np.ndarray:
        """(conditions,) λ of least ‖∇f + Jᵀλ‖ in own units."""
        if self._normal is None:
            return np.empty(0)
        return -self._normal.solve(self._own @ (self.unit * gradient)) / self._reach

    def matrix(self, flat: np.ndarray) -> sparse.csc_array:
        """The whole symmetric saddle matrix for a Hessian in the order of the pattern."""
        values = np.concatenate([flat, self._border, np.zeros(self.m)])
        size = self.n + self.m
        return sparse.csc_array((values[self._source], self._rows, self._pointers), shape=(size, size))

    def factorise(self, flat: np.ndarray) -> SaddleFactor | None:
        """The factorised saddle matrix, or None where the Hessian is not positive definite along the conditions."""
        plain = self.matrix(flat)
        scale, scaled = self._equilibrated(plain, self._scale(flat))
        scaled[self._corner] = -DELTA
        numbers, indices, pointers = self._banded.data, self._banded.indices, self._banded.indptr
        banded = sparse.csc_matrix((scaled[numbers], indices, pointers), shape=plain.shape)
        try:
            factor = splu(banded, permc_spec="NATURAL", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
        except RuntimeError:
            return None
        # Rows change places where a pivot is exactly zero, as on uniform knots: the matrix is singular then.
        kept = np.array_equal(factor.perm_r, np.arange(self.n + self.m))
        negative = np.count_nonzero(factor.U.diagonal() < 0)
        return (plain, factor, scale) if kept and negative == self.m else None

    def _scale(self, flat: np.ndarray) -> np.ndarray:
        """(unknowns + conditions,) the units in which the saddle matrix is of order one, the Hessian's too."""
        size = own_size(self, flat, self.unit) or 1.0
        return np.concatenate([self.unit / np.sqrt(size), np.sqrt(size) / self._reach])

    def _equilibrated(self, matrix: sparse.csc_array, scale: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Units in which every row of a saddle matrix has the size one, nearly, and its entries in them.

        The factorisation does not pivot: beside a stiff bound all else would drown in its rounding, and in δ.
        Source: Ruiz 2001.
        """
        counts = np.diff(self._pointers)
        entries = matrix.data * scale[self._rows] * np.repeat(scale, counts)
        for _ in range(SWEEPS):
            size = np.maximum.reduceat(np.abs(entries), self._pointers[:-1])
            change = 1 / np.sqrt(np.where(size > 0, size, 1.0))
            scale = scale * change
            entries = entries * change[self._rows] * np.repeat(change, counts)
        return scale, entries

    def step(self, factor: SaddleFactor, gradient: np.ndarray) -> np.ndarray:
        """(unknowns,) the Newton step along the conditions."""
        # Beside what the conditions carry of a gradient all else would be rounding, and the step no smaller than that.
        along = self.reduced(gradient)
        if np.linalg.norm(self.unit * along) < np.linalg.norm(self.unit * gradient):
            gradient = along
        return self.solve(factor, np.concatenate([-gradient, np.zeros(self.m)]))[: self.n]

    def pivoted_step(self, flat: np.ndarray, gradient: np.ndarray) -> np.ndarray | None:
        """(unknowns,) the Newton step along the conditions, by a factorisation with pivots; None if singular."""
        scale = self._scale(flat)
        scaled = sparse.csc_array(self.matrix(flat).multiply(scale).multiply(scale[:, None]))
        try:
            return (scale * solved(scaled, scale * np.concatenate([-gradient, np.zeros(self.m)])))[: self.n]
        except RuntimeError:
            return None

    @property
    def independent(self) -> bool:
        """Whether no condition follows from the others, or contradicts them, to first order and up to rounding."""
        try:
            pivots = np.abs(self._normal.U.diagonal()) if self._normal is not None else np.ones(1)
        except InputError:
            return False
        return bool(pivots.min() > EPS * self.m * pivots.max())

    def solve(self, factor: SaddleFactor, rhs: np.ndarray) -> np.ndarray:
        """(unknowns + conditions,) the solution of the saddle system, refined as long as that helps."""
        exact, regular, scale = factor
        least, solution, left = np.inf, np.zeros_like(rhs), rhs
        enough = EXACT * float(np.linalg.norm(scale * rhs))
        for _ in range(REFINED):
            fresh = solution + scale * self._apply(regular, scale * left)
            left = rhs - exact @ fresh
            now = float(np.linalg.norm(scale * left))
            if not now < least:
                break
            solution, halved, least = fresh, now < 0.5 * least, now
            if now <= enough or not halved:
                break
        return solution

    def on_diagonal(self, values: np.ndarray) -> np.ndarray:
        """Of values (unknowns,), those where the Hessian's diagonal lies in the flat array."""
        return values[self._triangle.rows[self.diagonal]]

    def curvature(self, flat: np.ndarray) -> Curvature:
        """The curvature along the conditions: on a dense basis of their null space, or of H + σ JᵀJ."""
        hessian, jacobian = self._triangle.full(flat, self.n), self.jacobian
        if not hessian.count_nonzero():
            return FLAT
        own = sparse.csr_array(self.unit[:, None] * hessian * self.unit)
        d = self.unit * scaling(own.diagonal(), np.asarray(abs(own).max(axis=1).todense()).ravel(), SLIGHT)
        scaled = sparse.csr_array(d[:, None] * hessian * d)
        rows, rounding = sparse.csr_array(jacobian * d), self.n * EPS * float(abs(scaled).max())
        if self.n <= DENSE:
            # The factorisation of the steps does not pivot: it may miss what is small.
            basis = la.qr(rows.toarray().T)[0][:, self.m :]
            found = dense_curvature(basis.T @ (scaled @ basis), rounding)
            return found if found.direction is None else Curvature("indefinite", d * (basis @ found.direction))
        size = np.sqrt(np.asarray(rows.multiply(rows).sum(axis=1)).ravel())
        rows = sparse.csr_array(rows / np.where(size > 0, size, 1.0)[:, None])
        normal = gram_factor(rows) if self.m else None
        for weight in WEIGHTS:
            # Finsler: positive definite for some weight if and only if H is along the conditions.
            y = first_failing_pivot(sparse.csc_array(scaled + weight * (rows.T @ rows)))
            if y is None:
                return POSITIVE
            along = y if normal is None else y - rows.T @ normal.solve(rows @ y)
            # What is left of a y that breaks the conditions, as under weights too small, is rounding of that y.
            if along @ (scaled @ along) < -rounding * float(y @ y):
                lowest = lowest_curvature(*self._projected(hessian))
                return Curvature("indefinite", d * along if lowest is None else self.unit * lowest)
        return UNKNOWN

    def _projected(self, hessian: sparse.csr_array) -> tuple[LinearOperator, float]:
        """v ↦ P H P v in own units, with P the projector onto the conditions, and the size of H."""
        own, unit = self._own, self.unit

        def along(v: np.ndarray) -> np.ndarray:
            return v if self._normal is None else v - own.T @ self._normal.solve(own @ v)

        projected = LinearOperator(
            hessian.shape, matvec=lambda v: along(unit * (hessian @ (unit * along(np.ravel(v))))), dtype=float
        )
        return projected, float(np.abs(hessian.diagonal() * unit**2).max())

    def _apply(self, factor: SuperLU, rhs: np.ndarray) -> np.ndarray:
        found = np.empty_like(rhs)
        found[self._order] = factor.solve(rhs[self._order])
        return found
