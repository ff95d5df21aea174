"""The condensed saddle system: conditions that decouple are carried by controls of their own."""

from functools import cached_property

import numpy as np
import scipy.linalg as la
from scipy import sparse
from scipy.sparse.csgraph import reverse_cuthill_mckee
from scipy.sparse.linalg import ArpackNoConvergence, LinearOperator, eigsh

from symmotion import interrupts
from symmotion.program.evaluate import Pattern
from symmotion.program.local import LocalTables, Targets
from symmotion.program.program import Program
from symmotion.systems.curvature import Curvature, banded_curvature

LANCZOS = 100  # restarts in the search for negative curvature; directions that matter show long before
SMALL = 40  # conditions up to which a dense null-space basis is taken where they do not decouple
# How far apart free controls that are read together may lie before another order is tried, which is to halve that.
FAR, NEARER = 16, 0.5


def shared_conditions(program: Program) -> sparse.csr_array | None:
    """(M, n) the matrix N of conditions N X = K on the controls X (n, channels), alike for every channel.

    None where a program's constraints are not of this kind.
    """
    if len(program.start) != 1:
        return None
    (controls,) = program.start.values()
    if not program.constraints:
        return sparse.csr_array((0, len(controls)))
    channels = controls.shape[1]
    for c in program.constraints:
        k = c.block.kernel
        whole = k.rows == 1 and k.channels == channels == k.out.numel() and c.block.nodes == 1
        if not (whole and k.linear and c.is_equality):
            return None
        zeros = np.zeros((channels, 1))
        jacobian = np.asarray(k.function("jacobian")(zeros, np.zeros(k.data.shape), zeros))
        if not (jacobian.reshape(channels, channels) == np.eye(channels)).all():
            return None
    return sparse.csr_array(sparse.vstack([c.block.operator for c in program.constraints]))


class Condensed:
    """Newton's saddle system on a null-space basis of the conditions, as banded systems.

    One pivot control per condition is expressed by the others, X = X_p + Z F with F the free
    controls. Where each condition has a control that no other condition reads (one inserted
    knot per segment does that for cubics, HJK 4.3), Z is as local as the B-splines, the
    reduced Hessian ZᵀHZ is banded, and the multipliers follow from the pivots' rows.

    program: of linear equalities; conditions: their Jacobian; pivots: (conditions,) a free control for each; decoupled:
    whether no two conditions read one pivot. `system_of` finds them.

    >>> sm.systems.Condensed.of(sm.affine_program(sm.examples.planar_keyframes()))
    Condensed(20 of 36 unknowns)
    """

    def __init__(self, program: Program, conditions: sparse.csr_array, pivots: np.ndarray, decoupled: bool):
        self.program = program
        self.conditions = conditions
        self.pivots = pivots
        (controls,) = program.start.values()
        n, self.channels = controls.shape
        free = np.setdiff1d(np.arange(n), pivots)
        if decoupled:
            diagonal = np.asarray(conditions[np.arange(len(pivots)), pivots]).ravel() if len(pivots) else np.empty(0)
            self._solve = lambda k: k / diagonal[:, None]
            self._solve_transposed = self._solve
            dependents = sparse.csr_array(conditions[:, free].multiply(-1 / diagonal[:, None]))
        else:
            factor = la.lu_factor(conditions[:, pivots].toarray())
            self._solve = lambda k: la.lu_solve(factor, k)
            self._solve_transposed = lambda k: la.lu_solve(factor, k, trans=1)
            dependents = sparse.csr_array(-la.lu_solve(factor, conditions[:, free].toarray()))
        basis = sparse.vstack([sparse.eye_array(len(free), format="csr"), dependents], format="csr")
        self.free, self.basis = free, sparse.csr_array(basis[np.argsort(np.concatenate([free, pivots]))])
        tables = self._tables()
        nearer = _nearer(tables, len(free))
        if nearer is not None:
            self.free, self.basis = free[nearer], sparse.csr_array(self.basis[:, nearer])
            tables = self._tables()
        self._basis_transposed = sparse.csr_array(self.basis.T)
        self.size = len(free) * self.channels
        self._pattern(tables)

    def __repr__(self) -> str:
        return f"Condensed({self.size} of {self.program.unknowns} unknowns)"

    @staticmethod
    def of(program: Program) -> "Condensed | None":
        """The condensed system of a program, or None where it has none that is local or small."""
        if "condensed" not in program.structure:
            program.structure["condensed"] = _condense(program)
        return program.structure["condensed"]

    def _tables(self) -> list[LocalTables]:
        return [b.tables(sparse.csr_array(b.operator @ self.basis)) for b in self.program.terms]

    def _pattern(self, tables: list[LocalTables]) -> None:
        self.band = (_reach(tables) + 1) * self.channels - 1
        size = self.size * (self.band + 1)
        targets = []
        for b, t in zip(self.program.terms, tables, strict=True):
            channel = np.arange(self.channels)[b.channels]
            # The lower triangle by columns, LAPACK's band storage; a block (a ≤ b) is stored transposed.
            column = t.blocks[0][:, None] * self.channels + channel
            row = t.blocks[1][:, None] * self.channels + channel[0]
            targets.append(Targets(size, t.own, row + column * self.band))
        self.pattern = Pattern(tuple(tables), tuple(targets), size)

    def feasible(self, x: np.ndarray, violation: np.ndarray) -> np.ndarray:
        """(unknowns,) x with the pivot controls changed so that the conditions hold."""
        if not violation.any():
            return x
        x = x.copy()
        x.reshape(-1, self.channels)[self.pivots] -= self._solve(violation.reshape(-1, self.channels))
        return x

    def reduced(self, gradient: np.ndarray) -> np.ndarray:
        """(size,) Zᵀ∇f."""
        return (self._basis_transposed @ gradient.reshape(-1, self.channels)).ravel()

    def expand(self, free: np.ndarray) -> np.ndarray:
        """(unknowns,) Z times a step of the free controls."""
        return (self.basis @ free.reshape(-1, self.channels)).ravel()

    def multipliers(self, gradient: np.ndarray) -> np.ndarray:
        """(conditions,) λ that make ∇f + Jᵀλ vanish in the pivots' rows."""
        return -self._solve_transposed(gradient.reshape(-1, self.channels)[self.pivots]).ravel()

    @property
    def diagonal(self) -> slice:
        """Where the diagonal of the reduced Hessian lies in the flat array."""
        return slice(0, self.pattern.size, self.band + 1)

    def factorise(self, flat: np.ndarray) -> np.ndarray | None:
        """(band + 1, size) the reduced Hessian's banded Cholesky factor; None where it is not positive definite."""
        if not self.size:
            return flat
        factor, info = la.lapack.dpbtrf(self.lower_bands(flat), lower=1)
        return factor if info == 0 else None

    def step(self, factor: np.ndarray, gradient: np.ndarray) -> np.ndarray:
        """(unknowns,) the Newton step −Z (ZᵀHZ)⁻¹ Zᵀ∇f."""
        if not self.size:
            return np.zeros_like(gradient)
        solution, _ = la.lapack.dpbtrs(factor, -self.reduced(gradient), lower=1)
        return self.expand(solution)

    def on_diagonal(self, values: np.ndarray) -> np.ndarray:
        """(size,) of values (unknowns,) those of the free controls, as the reduced diagonal has them."""
        return values.reshape(-1, self.channels)[self.free].ravel()

    def whole_basis(self) -> sparse.csr_array:
        """(unknowns, size) Z of all channels: what `expand` does, as a matrix."""
        return sparse.csr_array(sparse.kron(self.basis, sparse.eye_array(self.channels), format="csr"))

    @cached_property
    def lift(self) -> sparse.csr_array:
        """(unknowns, conditions) Y with J Y = 1, zero but for the pivots: what moves one condition and no other."""
        columns = sparse.coo_array(self._solve(np.eye(len(self.pivots))))
        n = len(self.free) + len(self.pivots)
        lift = sparse.csr_array(
            (columns.data, (self.pivots[columns.coords[0]], columns.coords[1])), shape=(n, len(self.pivots))
        )
        return sparse.csr_array(sparse.kron(lift, sparse.eye_array(self.channels), format="csr"))

    def curvature(self, flat: np.ndarray) -> Curvature:
        """The curvature of the reduced Hessian, with a direction Z y that is, if found, the lowest."""
        bands = self.lower_bands(flat)
        found = banded_curvature(bands)
        if found.direction is None:
            return found
        offsets = -np.arange(self.band + 1)
        lower = sparse.dia_array((bands, offsets), shape=(self.size, self.size)).tocsr()
        full = lower + sparse.csr_array(lower.T) - sparse.diags_array(bands[0])
        y = lowest_curvature(full, float(np.abs(bands[0]).max()))
        return Curvature("indefinite", self.expand(found.direction if y is None else y))

    def lower_bands(self, flat: np.ndarray) -> np.ndarray:
        """(band + 1, size) the reduced Hessian's lower bands, as SciPy's banded routines take them."""
        return flat.reshape(-1, self.band + 1).T


def lowest_curvature(matrix: sparse.csr_array | LinearOperator, scale: float) -> np.ndarray | None:
    """The eigenvector of the least eigenvalue of a symmetric operator, where that is clearly negative; else None."""
    size = matrix.shape[0]
    if size < 64:
        values, vectors = np.linalg.eigh(matrix @ np.eye(size))
    else:
        start = np.random.default_rng(0).normal(size=size)  # seeded: the same escape in every run

        def along(v: np.ndarray) -> np.ndarray:
            interrupts.check()
            return matrix @ v

        try:
            operator = LinearOperator(matrix.shape, matvec=along, dtype=float)
            values, vectors = eigsh(operator, k=1, which="SA", v0=start, tol=1e-4, maxiter=LANCZOS)
        except ArpackNoConvergence:
            return None
    return vectors[:, 0] if values[0] < -1e-10 * scale else None


def _reach(tables: list[LocalTables]) -> int:
    """How far free controls that are read together lie apart, at most."""
    return max((int((t.blocks[1] - t.blocks[0]).max()) for t in tables if t.blocks.size), default=0)


def _nearer(tables: list[LocalTables], count: int) -> np.ndarray | None:
    """(count,) an order of the free controls in which those that are read together lie clearly nearer; else None.

    Of nets it is that along their longer side.
    """
    reach = _reach(tables)
    if reach <= FAR:
        return None
    one, other = np.concatenate([t.blocks for t in tables], axis=1)
    read = sparse.csr_array((np.ones(len(one)), (one, other)), shape=(count, count))
    order = reverse_cuthill_mckee(sparse.csr_array(read + read.T), symmetric_mode=True)
    place = np.argsort(order)
    return order if int(np.abs(place[one] - place[other]).max()) <= NEARER * reach else None


def _condense(program: Program) -> Condensed | None:
    conditions = shared_conditions(program)
    if conditions is None:
        return None
    conditions.eliminate_zeros()
    m, n = conditions.shape
    if not m:
        return Condensed(program, conditions, np.empty(0, dtype=int), decoupled=True)
    counts, columns = np.diff(conditions.indptr), conditions.indices
    alone = np.bincount(columns, minlength=n)[columns] == 1
    strength = np.where(alone, np.abs(conditions.data), 0.0)
    most = np.maximum.reduceat(strength, conditions.indptr[:-1]) if counts.all() else np.zeros(m)
    if (most > 0).all():
        # The first of the strongest.
        strongest = np.flatnonzero(strength == np.repeat(most, counts))
        pivots = columns[strongest[np.searchsorted(strongest, conditions.indptr[:-1])]]
        return Condensed(program, conditions, pivots, decoupled=True)
    if m > SMALL:
        return None
    _, r, order = la.qr(conditions.toarray(), mode="economic", pivoting=True)
    strengths = np.abs(np.diag(r))
    if m > n or strengths[-1] <= 1e-12 * strengths[0]:
        return None
    return Condensed(program, conditions, np.sort(order[:m]), decoupled=False)
