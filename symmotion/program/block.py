"""Blocks: a kernel with the tables that say where in the unknowns it is applied, and their batched evaluation."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy import sparse

from symmotion.brief import in_a_line
from symmotion.errors import InputError
from symmotion.kernels.kernel import Kernel
from symmotion.kernels.mapped import Kernels, Mapped, kernel_function
from symmotion.program.state import made_of

EPS = float(np.finfo(float).eps)
WHOLE = ""  # the variable of a block that reads the vector of all unknowns, as one column


@dataclass(frozen=True, eq=False)
class Block:
    """A kernel applied at E · Q nodes: the Q nodes of an element read the same few controls.

    name: of the term or constraint; variable: which unknowns it reads, an array (n, channels
    and more), or `WHOLE`, all of them as one column; channels: the slice of their coordinates.
    operator: (E · Q · rows, n) sparse: the combinations of controls that the kernel's rows are,
        basis values and derivatives for a jet, single ones for plain controls.
    nodes: Q; weights: (E · Q,), quadrature times the term's factor; data: (E · Q, D).

    Raises InputError for a block without nodes.

    >>> block = sm.affine_program(sm.examples.planar_keyframes()).terms[0]
    >>> block.elements, block.nodes
    (6, 6)
    """

    name: str
    kernel: Kernel
    variable: str
    channels: slice
    operator: sparse.csr_array
    nodes: int
    weights: np.ndarray
    data: np.ndarray

    __getstate__ = made_of

    def __post_init__(self):
        if not len(self.weights):
            raise InputError(f"block {self.name!r} has no nodes: leave it out")

    def __repr__(self) -> str:
        return f"Block({self.nature})"

    @property
    def nature(self) -> str:
        """What it is, in words."""
        return f"{self.name}: {self.elements} elements × {self.nodes} nodes, {self.kernel.nature}"

    @property
    def count(self) -> int:
        """Nodes in all, E · Q."""
        return len(self.weights)

    @property
    def elements(self) -> int:
        return self.count // self.nodes

    def with_data(self, data: np.ndarray) -> "Block":
        """The same block with other numbers at its nodes; what was derived from its structure is kept."""
        fresh = replace(self, data=np.asarray(data, dtype=float).reshape(self.data.shape))
        fresh.take(self)
        return fresh

    def take(self, other: "Block") -> None:
        """Keep what another block of the same structure has derived from it."""
        for name in ("local", "transposed"):
            if name in other.__dict__:
                self.__dict__[name] = other.__dict__[name]

    def alike(self, other: "Block") -> bool:
        """Whether another block differs in its data only, and the derivatives by which it is linear not even there."""
        mine, theirs = self.operator, other.operator
        return (
            (self.name, self.variable, self.channels, self.nodes)
            == (other.name, other.variable, other.channels, other.nodes)
            and self.data.shape == other.data.shape
            and self.kernel.code == other.kernel.code
            and self.kernel.squares == other.kernel.squares
            and mine.shape == theirs.shape
            and np.array_equal(mine.indptr, theirs.indptr)
            and np.array_equal(mine.indices, theirs.indices)
            and np.array_equal(mine.data, theirs.data)
            and np.array_equal(self.weights, other.weights)
            and (not self.kernel.bilinear or np.array_equal(self.data, other.data))
        )

    @cached_property
    def transposed(self) -> sparse.csr_array:
        return sparse.csr_array(self.operator.T)

    @cached_property
    def local(self) -> "LocalTables":
        return LocalTables.of(self, self.operator)

    def rows(self, controls: np.ndarray) -> np.ndarray:
        """(E · Q, rows · channels) what each node reads from the controls (n, all channels)."""
        return (self.operator @ controls[:, self.channels]).reshape(self.count, -1)

    def sizes(self, controls: np.ndarray) -> np.ndarray:
        """(E · Q, rows · channels) the absolute values that `rows` sums up, from those of the controls."""
        o = self.operator
        # Made of its arrays: `abs` would leave notes in the operator, which is sent to other processes.
        sizes = sparse.csr_array((np.abs(o.data), o.indices, o.indptr), shape=o.shape)
        return (sizes @ controls[:, self.channels]).reshape(self.count, -1)


@dataclass(frozen=True, eq=False)
class LocalTables:
    """The dense view of an operator: the K columns that each element reads, and its coefficients there.

    columns: (E, K) increasing; coefficients: (E, Q, rows, K), zero where an element reads fewer.
    pairs: (2, K (K + 1) / 2) the pairs a ≤ b of local columns; products: (E, pairs, Q · rows²),
        weighted products of coefficients: one matrix product with them turns the node Hessians
        of an element into its blocks. None for blocks of `WHOLE`, which read many single numbers.
    blocks: (2, B) the different global column pairs; gather: (B, E · pairs) sums the element
        blocks that belong to each.
    """

    columns: np.ndarray
    coefficients: np.ndarray
    pairs: np.ndarray
    products: np.ndarray | None
    blocks: np.ndarray
    gather: sparse.csr_array

    __repr__ = in_a_line

    @staticmethod
    def of(block: Block, operator: sparse.csr_array) -> "LocalTables":
        """The tables of a block for its operator, or for its operator times a null-space basis."""
        columns, coefficients = _dense(block, operator)
        pairs = np.stack(np.triu_indices(columns.shape[1]))
        products = None if block.variable == WHOLE else _products(block, coefficients, pairs)
        blocks, gather = _summed(columns, pairs, operator.shape[1])
        return LocalTables(columns, coefficients, pairs, products, blocks, gather)


def _dense(block: Block, operator: sparse.csr_array) -> tuple[np.ndarray, np.ndarray]:
    """The columns (E, K) of an operator that each element reads, and the coefficients (E, Q, rows, K) there."""
    e, q, r = block.elements, block.nodes, block.kernel.rows
    coo = operator.tocoo()
    owner = coo.coords[0] // (q * r)
    keys, position = np.unique(owner.astype(np.int64) * operator.shape[1] + coo.coords[1], return_inverse=True)
    key_owner, key_column = np.divmod(keys, operator.shape[1])
    first = np.searchsorted(key_owner, np.arange(e))
    rank = np.arange(len(keys)) - first[key_owner]
    k = int(rank.max()) + 1 if len(rank) else 0
    # Elements that read fewer columns repeat their last one with coefficient zero.
    last = np.r_[first[1:], len(keys)] - 1
    columns = np.repeat(np.where(last >= first, np.append(key_column, 0)[last], 0)[:, None], k, axis=1)
    columns[key_owner, rank] = key_column
    coefficients = np.zeros((e, q * r, k))
    coefficients[owner, coo.coords[0] % (q * r), rank[position]] = coo.data
    return columns, coefficients.reshape(e, q, r, k)


def _products(block: Block, coefficients: np.ndarray, pairs: np.ndarray) -> np.ndarray:
    """(E, pairs, Q · rows²) the weighted products of the coefficients of each pair of local columns."""
    weighted = block.weights.reshape(*coefficients.shape[:2], 1, 1) * coefficients
    products = np.einsum("eqap,eqbp->epqab", weighted[..., pairs[0]], coefficients[..., pairs[1]])
    return np.ascontiguousarray(
        products.reshape(*products.shape[:2], np.prod(coefficients.shape[1:3]) * block.kernel.rows)
    )


def _summed(columns: np.ndarray, pairs: np.ndarray, n: int) -> tuple[np.ndarray, sparse.csr_array]:
    """The different pairs (2, B) of n global columns, and (B, E · pairs) what sums the elements' blocks of each."""
    ends = columns[:, pairs].transpose(0, 2, 1).reshape(-1, 2)
    keys, place = np.unique(ends[:, 0].astype(np.int64) * n + ends[:, 1], return_inverse=True)
    count = len(place)
    gather = sparse.csr_array((np.ones(count), (place, np.arange(count))), shape=(len(keys), count))
    return np.stack(np.divmod(keys, n)), gather


class BlockEvaluator:
    """A block's functions over all its nodes, with the buffers for it. One per thread.

    Every call takes z, what the nodes read (`Block.rows`); multipliers are one for each
    component at each node, or None for a term.

    kernels: "auto", "compiled" or "interpreted", as ExactNewton's; threads: how many at most.

    >>> from symmotion.program import BlockEvaluator
    >>> program = sm.affine_program(sm.examples.planar_keyframes())
    >>> BlockEvaluator(program.terms[0]).block.name
    'R'
    """

    def __init__(self, block: Block, kernels: Kernels = "auto", threads: int = 1):
        self.block, self._threads = block, threads
        self._kernels: Kernels = kernels
        self._functions: dict[str, Mapped] = {}
        kernel = block.kernel
        self._ones = np.ones((block.count, kernel.out.numel())) if not kernel.squares else None

    def __repr__(self) -> str:
        return f"BlockEvaluator({self.block.nature})"

    def prepare(self, kind: str) -> Mapped:
        """The function of one kind (see `derive`), made at its first use."""
        if kind not in self._functions:
            block = self.block
            function = kernel_function(block.kernel, kind, block.count, self._kernels)
            self._functions[kind] = Mapped(function, block.count, block.nodes, self._threads)
        return self._functions[kind]

    def _mu(self, multipliers: np.ndarray | None) -> np.ndarray | None:
        return self._ones if multipliers is None else multipliers

    def value(self, z: np.ndarray) -> float:
        """Σ w φ over the nodes."""
        return float(self.block.weights @ self.prepare("value")(z, self.block.data, self._mu(None))[:, 0])

    def density(self, z: np.ndarray) -> np.ndarray:
        """(E, Q) the integrand φ, without weights, at the nodes."""
        return self.prepare("value")(z, self.block.data, self._mu(None)).reshape(self.block.elements, -1)

    def out(self, z: np.ndarray) -> np.ndarray:
        """(E · Q, C) the kernel itself at the nodes."""
        return self.prepare("out")(z, self.block.data, None)

    def gradient(self, z: np.ndarray, multipliers: np.ndarray | None = None) -> np.ndarray:
        """(n, channels) ∂/∂controls of Σ w φ."""
        slopes = self.prepare("gradient")(z, self.block.data, self._mu(multipliers))
        return self._collect(slopes)

    def _collect(self, slopes: np.ndarray) -> np.ndarray:
        """(n, channels) the weighted slopes at the nodes (E · Q, rows · channels), brought to the controls."""
        slopes *= self.block.weights[:, None]
        return self.block.transposed @ slopes.reshape(-1, self.block.kernel.channels)

    def rounding(self, z: np.ndarray, size: np.ndarray) -> float:
        """The rounding of Σ w φ, where every number of z sums up to size; the two have the same shape.

        Of a sum of squares it is the square of the residuals' rounding, which what is far from zero does not
        drown: ½ ε² Σ w sᵀ|H|s with H the Gauss–Newton part; else ε Σ w |φ|.
        """
        block = self.block
        if not block.kernel.squares:
            return EPS * float(block.weights @ np.abs(self.density(z)).ravel())
        rows, channels = block.kernel.rows, block.kernel.channels
        flat, parts = size.reshape(block.count, rows * channels), np.empty(block.count)

        def use(nodes: slice, outputs: list[np.ndarray]) -> None:
            hessian = np.abs(outputs[0]).reshape(-1, rows, rows, channels, channels)
            rows_of = hessian.swapaxes(2, 3).reshape(len(hessian), rows * channels, -1) @ flat[nodes, :, None]
            parts[nodes] = (flat[nodes, None] @ rows_of).ravel()

        self.prepare("hessian").each(use, z, block.data, self._mu(None), np.zeros((block.count, 1)))
        return 0.5 * EPS**2 * float(block.weights @ parts)

    def line(self, z: np.ndarray, direction: np.ndarray) -> np.ndarray:
        """(5,) coefficients of the quartic Σ w φ(z + α direction)."""
        return self.block.weights @ self.prepare("line")(z, self.block.data, direction)

    def along(self, z: np.ndarray, direction: np.ndarray) -> np.ndarray:
        """(E · Q, C) the derivative of the kernel at the nodes along a direction, what nodes read of it like z."""
        return self.prepare("along")(z, self.block.data, direction)

    def second_order(
        self,
        z: np.ndarray,
        local: LocalTables,
        theta: float,
        multipliers: np.ndarray | None = None,
        stiffness: np.ndarray | None = None,
    ) -> tuple[np.ndarray, np.ndarray]:
        """The gradient (n, channels) of Σ w φ and the blocks `local.blocks` (B, channels, channels) of its Hessian.

        theta: see `derive`. stiffness: (E · Q, C) σ of which Σ w Jᵀ diag(σ) J is added, J of the kernel; theta is
        then the share of all that the multipliers weigh.
        """
        c, q = self.block.kernel.channels, self.block.nodes
        products, coefficients = local.products, local.coefficients
        weights = self.block.weights.reshape(-1, 1, 1)
        parts = np.empty((self.block.elements, local.pairs.shape[1], c * c))
        slopes = np.empty_like(z)
        share = np.full((self.block.count, 1), theta)

        def use(nodes: slice, outputs: list[np.ndarray]) -> None:
            elements = slice(nodes.start // q, nodes.stop // q)
            if products is not None:
                np.matmul(products[elements], outputs[0].reshape(-1, products.shape[2], c * c), out=parts[elements])
            else:
                local_rows = coefficients[elements, 0]
                hessian = outputs[0].reshape(-1, local_rows.shape[1], local_rows.shape[1])
                whole = weights[elements] * (np.swapaxes(local_rows, 1, 2) @ hessian @ local_rows)
                parts[elements, :, 0] = whole[:, local.pairs[0], local.pairs[1]]
            slopes[nodes] = outputs[1]

        kind, more = ("hessian", ()) if stiffness is None else ("barrier", (stiffness,))
        self.prepare(kind).each(use, z, self.block.data, self._mu(multipliers), share, *more)
        return self._collect(slopes), (local.gather @ parts.reshape(-1, c * c)).reshape(-1, c, c)

    def jacobian(self, z: np.ndarray) -> np.ndarray:
        """(E, C, K, channels) derivatives of the components by the controls of the element; one node per element."""
        block, local = self.block, self.block.local
        values = self.prepare("jacobian")(z, block.data, None)
        values = values.reshape(block.elements, -1, block.kernel.rows, block.kernel.channels)
        return np.einsum("ecrm,erk->eckm", values, local.coefficients[:, 0])
