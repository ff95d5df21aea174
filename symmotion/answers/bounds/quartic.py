"""Programs as polynomials: objectives of degree four in the free unknowns, as sums of forms of few unknowns each."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy.linalg as la
from scipy import sparse
from scipy.sparse.csgraph import connected_components

from symmotion.answers.bounds.symmetry import Symmetry
from symmotion.errors import InputError
from symmotion.program import Block, BlockEvaluator, Evaluator, Program
from symmotion.systems import Condensed
from symmotion.systems.condensed import shared_conditions

# Rows of the largest matrix: a step on the semidefinite program takes their sixth power.
MOST = 91
UNSEEN = 1e-8  # the least share of the largest mean square that a direction counts with
NONE = 0  # the place of the factor 1 in a monomial


@dataclass(frozen=True, eq=False)
class Clique:
    """Free unknowns that terms read together, and the monomials whose squares prove a bound.

    unknowns: (k,) increasing. blocks: each (N, 2), the factors' numbers, from one, or NONE. The first has 1, u_i, and
    u_i u_j of unknowns that residuals multiply with each other; each other block products across two groups of these.
    """

    unknowns: np.ndarray
    blocks: tuple[np.ndarray, ...]

    @staticmethod
    def of(unknowns: np.ndarray, groups: np.ndarray) -> "Clique":
        """The clique of unknowns; groups: (free,) the group of every unknown, −1 of those without."""
        i, j = np.triu_indices(len(unknowns))
        pairs, group = np.column_stack([unknowns[i], unknowns[j]]) + 1, groups[unknowns]
        whole = (group[i] == group[j]) & (group[i] >= 0)
        single = np.column_stack([np.full(len(unknowns), NONE), unknowns + 1])
        blocks = [np.concatenate([[[NONE, NONE]], single, pairs[whole]])]
        names = np.unique(group[group >= 0])
        for a in range(len(names)):
            for b in range(a + 1, len(names)):
                across = {names[a], names[b]}
                blocks.append(
                    pairs[[not w and {x, y} == across for w, x, y in zip(whole, group[i], group[j], strict=True)]]
                )
        return Clique(unknowns, tuple(blocks))

    def values(self, u: np.ndarray) -> np.ndarray:
        """(N,) the monomials of the first block at free unknowns u."""
        return np.r_[1.0, u][self.blocks[0]].prod(axis=1)


@dataclass(frozen=True, eq=False)
class Chart:
    """Points that meet linear conditions: x = centre + basis u, u (free,) the free unknowns.

    basis: (unknowns, free) sparse. cliques: of the free unknowns of which the terms are sums of functions. symmetry:
    of the free unknowns, which the objective may have.
    """

    centre: np.ndarray
    basis: sparse.csr_array
    cliques: tuple[Clique, ...]
    symmetry: Symmetry | None = None

    @property
    def free(self) -> int:
        return self.basis.shape[1]

    def at(self, program: Program, centre: np.ndarray) -> "Chart":
        """The same chart of a program about another point that meets the conditions."""
        whole = Symmetry.of(program, len(centre))
        return replace(self, centre=centre if whole is None else whole.centred(centre))

    def point(self, u: np.ndarray) -> np.ndarray:
        """(unknowns,) x of free unknowns."""
        return self.centre + self.basis @ u

    def free_of(self, x: np.ndarray) -> np.ndarray:
        """(free,) the free unknowns of a point that meets the conditions."""
        return np.linalg.lstsq(self.basis.toarray(), x - self.centre, rcond=None)[0]

    @staticmethod
    def of(program: Program, centre: np.ndarray) -> "Chart":
        """The chart of a program about a point that meets its conditions.

        InputError where the program has bounds or nonlinear conditions, an objective that is no quartic polynomial, or
        terms of too many free unknowns.
        """
        _require_quartic(program)
        system = Condensed.of(program)
        basis = _orthonormal(program) if system is None else _alike(system.basis, system.channels)
        reads, groups = _reads(program, basis)
        if len(reads) == 1 and system is not None:
            basis = _orthonormal(program)
            reads, groups = _reads(program, basis)
        basis = _size(centre) * basis
        cliques = tuple(Clique.of(unknowns, groups) for unknowns in reads)
        # Every coordinate of the controls has the same basis, but of conditions that are not shared.
        symmetry = Symmetry.of(program, basis.shape[1]) if shared_conditions(program) is not None else None
        # Before they are made, as if they fell into halves: `relaxation` sees whether they do.
        require_small(cliques, max(len(b) for c in cliques for b in c.blocks) // (1 if symmetry is None else 2))
        return Chart(centre, basis, cliques, symmetry).at(program, centre)


def require_small(cliques: Sequence[Clique], largest: int) -> None:
    """InputError where the largest matrix of the relaxation of these cliques has more rows than MOST."""
    if largest > MOST:
        unknowns = max(len(c.unknowns) for c in cliques)
        raise InputError(
            f"terms of {unknowns} free unknowns, of {largest} monomials: global bounds take up to {MOST}, such as "
            "those of cubic motions in the plane with refine=0 or 1, or in space with refine=0, and of degrees up to 5 "
            "in the plane with refine=0, up to 7 where the keyframes turn and scale"
        )


def gram_forms(program: Program, chart: Chart) -> tuple[np.ndarray, ...]:
    """By clique, G (N, N) with f(x(u)) = Σ v(u)ᵀ G v(u) over the cliques, v the monomials of the first block."""
    forms = [np.zeros((len(c.blocks[0]), len(c.blocks[0]))) for c in chart.cliques]
    for block in program.terms:
        z = _read(program, block, sparse.csr_array(chart.centre[:, None])).toarray().reshape(block.count, -1)
        value, slope, bend = _taylor(block, z)
        for element, columns, dz in _elements(block, _read(program, block, chart.basis)):
            k = next(k for k, c in enumerate(chart.cliques) if np.isin(columns, c.unknowns).all())
            clique = chart.cliques[k]
            whole = np.zeros((*dz.shape[:2], len(clique.unknowns)))
            whole[:, :, np.searchsorted(clique.unknowns, columns)] = dz
            first = slope[element] @ whole
            second = np.einsum("qcab,qai,qbj->qcij", bend[element], whole, whole, optimize=True)
            weights, linear = block.weights[element], slice(1, 1 + len(clique.unknowns))
            if block.kernel.squares:
                i, j = np.searchsorted(clique.unknowns, clique.blocks[0][linear.stop :] - 1).T
                pairs = second[..., i, j] * np.where(i == j, 0.5, 1.0)
                residuals = np.concatenate([value[element][..., None], first, pairs], axis=2)
                forms[k] += np.einsum("q,qci,qcj->ij", weights, residuals, residuals, optimize=True)
            else:  # of degree two: products of the u_i, which need no squares of products
                slopes = 0.5 * np.einsum("q,qci->i", weights, first)
                forms[k][0, 0] += np.einsum("q,qc->", weights, value[element])
                forms[k][0, linear] += slopes
                forms[k][linear, 0] += slopes
                forms[k][linear, linear] += 0.5 * np.einsum("q,qcij->ij", weights, second)
    return tuple(forms)


def _require_quartic(program: Program) -> None:
    for c in program.constraints:
        if not (c.is_equality and c.block.kernel.linear):
            kind = "an inequality" if not c.is_equality else "nonlinear"
            raise InputError(f"global bounds take linear equalities only, and {c.name!r} is {kind}")
    for block in program.terms:
        if not block.kernel.quartic:
            raise InputError(f"global bounds take polynomials of degree four, and {block.name!r} is none")


def _size(centre: np.ndarray) -> float:
    """What counts as one: the root mean square of the unknowns."""
    return float(np.sqrt(np.mean(centre**2))) or 1.0


def _orthonormal(program: Program) -> sparse.csr_array:
    """(unknowns, free) a basis of what leaves the conditions as they are, orthonormal in what the terms read.

    Controls alone are no measure: those of high degree can be large where the motion is small.
    """
    shared = shared_conditions(program)
    if shared is None:
        return sparse.csr_array(la.null_space(Evaluator(program).jacobian(program.x0).toarray()))
    (controls,) = program.start.values()
    n, channels = controls.shape
    basis = la.null_space(shared.toarray()) if shared.shape[0] else np.eye(n)
    values, vectors = np.linalg.eigh(basis.T @ _metric(program, n) @ basis)
    seen = np.maximum(values, UNSEEN * values.max(initial=0.0))
    return _alike(sparse.csr_array(basis @ (vectors / np.sqrt(seen))), channels)


def _metric(program: Program, n: int) -> np.ndarray:
    """(n, n) the mean square of what the terms read of controls: values and every derivative alike."""
    metric = np.zeros((n, n))
    for block in program.terms:
        rows = block.kernel.rows
        for r in range(rows):
            reads = block.operator[r::rows].toarray()
            square = reads.T @ (np.abs(block.weights)[:, None] * reads)
            metric += square * (n / np.trace(square) if square.any() else 0.0)
    return metric


def _alike(basis: sparse.csr_array, channels: int) -> sparse.csr_array:
    """(unknowns, free) a basis (n, …) of the controls, the same for every coordinate."""
    return sparse.csr_array(sparse.kron(basis, sparse.eye_array(channels)))


def _read(program: Program, block: Block, columns: sparse.csr_array) -> sparse.csr_array:
    """(E · Q · rows · channels, …) what the nodes of a block read of columns (unknowns, …)."""
    first, stride = program.place(block.variable)
    channel = np.arange(stride)[block.channels]
    ones = np.ones(len(channel))
    chosen = sparse.csr_array((ones, (np.arange(len(channel)), channel)), shape=(len(channel), stride))
    operator = sparse.kron(block.operator, chosen, format="csr")
    return sparse.csr_array(operator @ columns[first : first + operator.shape[1]])


def _taylor(block: Block, z: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Of a kernel at z (N, Z): values (N, C), slopes (N, C, Z) and second derivatives (N, C, Z, Z), which are exact."""
    evaluator, width = BlockEvaluator(block, "interpreted"), z.shape[1]
    slopes, values = evaluator.prepare("jacobian"), evaluator.prepare("out")
    size = block.kernel.out.numel()

    def slope(there: np.ndarray) -> np.ndarray:
        return np.array(slopes(there, block.data, None)).reshape(len(z), size, width)

    value, here = np.array(values(z, block.data, None)).reshape(len(z), size), slope(z)
    origin = slope(np.zeros_like(z))
    # Residuals are quadratic: their slopes differ by second derivatives, whatever the step.
    bend = np.stack([slope(np.broadcast_to(e, z.shape).copy()) - origin for e in np.eye(width)], axis=3)
    return value, here, bend


def _elements(block: Block, reading: sparse.csr_array) -> Iterator[tuple[slice, np.ndarray, np.ndarray]]:
    """By element: its nodes, which free unknowns they read, and how, (Q, Z, those)."""
    q, width = block.nodes, reading.shape[0] // block.count
    for e in range(block.elements):
        rows = reading[e * q * width : (e + 1) * q * width]
        columns = np.unique(rows.indices[rows.data != 0])
        yield slice(e * q, (e + 1) * q), columns, rows[:, columns].toarray().reshape(q, width, len(columns))


def _reads(program: Program, basis: sparse.csr_array) -> tuple[list[np.ndarray], np.ndarray]:
    """The free unknowns that elements read, without sets that are part of others; and (free,) groups of unknowns.

    Residuals multiply unknowns of a group with each other only; those that they multiply with none have the group −1.
    """
    free = basis.shape[1]
    found, multiplied = set(), np.zeros((free, free), dtype=bool)
    for block in program.terms:
        width = block.kernel.z.numel()
        _, _, bend = _taylor(block, np.zeros((block.count, width)))
        for element, columns, dz in _elements(block, _read(program, block, basis)):
            found.add(tuple(columns.tolist()))
            if block.kernel.squares:
                second = np.einsum("qcab,qai,qbj->ij", np.abs(bend[element]), np.abs(dz), np.abs(dz), optimize=True)
                multiplied[np.ix_(columns, columns)] |= second > 0
    sets = [np.array(c) for c in sorted(found) if not any(set(c) < set(other) for other in found)]
    groups = connected_components(sparse.csr_array(multiplied), directed=False)[1]
    return sets, np.where(multiplied.any(axis=1), groups, -1)
