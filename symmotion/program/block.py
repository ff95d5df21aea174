"""Blocks: a kernel with the tables that say where in the unknowns it is applied, and their batched evaluation."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy import sparse

from symmotion.errors import InputError
from symmotion.kernels.kernel import Kernel
from symmotion.program.local import LocalTables
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
        """How many elements it has, E, each with the same number of nodes."""
        return self.count // self.nodes

    def with_data(self, data: np.ndarray) -> "Block":
        """The same block with other numbers at its nodes; what was derived from its structure is kept."""
        fresh = replace(self, data=np.asarray(data, dtype=float).reshape(self.data.shape))
        fresh.take(self)
        return fresh

    def take(self, other: "Block") -> None:
        """Keep what another block of the same structure has derived from it."""
        if "local" in other.__dict__:
            self.__dict__["local"] = other.__dict__["local"]

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
    def local(self) -> LocalTables:
        """The tables by which its nodes read their controls."""
        return self.tables(self.operator)

    def tables(self, operator: sparse.csr_array) -> LocalTables:
        """The tables of its operator, or of its operator times a null-space basis."""
        return LocalTables.of(operator, self.weights.reshape(self.elements, self.nodes), self.kernel.rows)

    def rows(self, controls: np.ndarray) -> np.ndarray:
        """(E · Q, rows · channels) what each node reads from the controls (n, all channels)."""
        return (self.operator @ controls[:, self.channels]).reshape(self.count, -1)

    def sizes(self, controls: np.ndarray) -> np.ndarray:
        """(E · Q, rows · channels) the absolute values that `rows` sums up, from those of the controls."""
        o = self.operator
        # Made of its arrays: `abs` would leave notes in the operator, which is sent to other processes.
        sizes = sparse.csr_array((np.abs(o.data), o.indices, o.indptr), shape=o.shape)
        return (sizes @ controls[:, self.channels]).reshape(self.count, -1)
