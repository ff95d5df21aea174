"""A block's functions over all its nodes, in one pass over its elements where the kernel is compiled."""

from functools import cached_property

import numpy as np

from symmotion.kernels.compiled import Machine
from symmotion.kernels.mapped import Kernels, Mapped, kernel_function, news
from symmotion.kernels.packing import Packing, unpacked
from symmotion.program.block import EPS, WHOLE, Block
from symmotion.program.local import LocalTables, Targets
from symmotion.program.passing import Passes

AT_ONCE = 2**17  # products that are made before they are summed up: 1 MB


class BlockEvaluator:
    """A block's functions over all its nodes, with the buffers for it. One per thread.

    Every call takes the controls (n, all channels) of the block's variable; multipliers are one for each
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
        # Each with how much was compiled when it was made.
        self._functions: dict[str, tuple[Mapped, int]] = {}
        self._pass = Passes(block)

    def __repr__(self) -> str:
        return f"BlockEvaluator({self.block.nature})"

    def prepare(self, kind: str) -> Mapped:
        """The function of one kind (see `derive`), made at its first use, and again where it was compiled meanwhile."""
        known, seen = self._functions.get(kind, (None, 0))
        if known is None or not (known.compiled or seen == news() or self._kernels != "auto"):
            block, seen = self.block, news()
            function = kernel_function(block.kernel, kind, block.count, self._kernels)
            if known is None or isinstance(function, Machine):
                known = Mapped(function, block.count, block.nodes, self._threads)
            self._functions[kind] = known, seen
        return known

    @cached_property
    def _ones(self) -> np.ndarray | None:
        kernel = self.block.kernel
        return None if kernel.squares else np.ones((self.block.count, kernel.out.numel()))

    def _mu(self, multipliers: np.ndarray | None) -> np.ndarray | None:
        return self._ones if multipliers is None else multipliers

    def value(self, controls: np.ndarray) -> float:
        """Σ w φ over the nodes."""
        return float(self.block.weights @ self._at_nodes("value", controls, self._mu(None))[:, 0])

    def density(self, controls: np.ndarray) -> np.ndarray:
        """(E, Q) the integrand φ, without weights, at the nodes."""
        return self._at_nodes("value", controls, self._mu(None)).reshape(self.block.elements, -1)

    def out(self, controls: np.ndarray) -> np.ndarray:
        """(E · Q, C) the kernel itself at the nodes."""
        return self._at_nodes("out", controls)

    def line(self, controls: np.ndarray, direction: np.ndarray) -> np.ndarray:
        """(5,) coefficients of the quartic Σ w φ of controls + α direction."""
        return self.block.weights @ self._at_nodes("line", controls, direction=direction)

    def along(self, controls: np.ndarray, direction: np.ndarray) -> np.ndarray:
        """(E · Q, C) the derivative of the kernel at the nodes along a direction of the controls."""
        return self._at_nodes("along", controls, direction=direction)

    def _at_nodes(
        self, kind: str, controls: np.ndarray, mu: np.ndarray | None = None, direction: np.ndarray | None = None
    ) -> np.ndarray:
        """(E · Q, …) a function at the nodes; direction: of the controls, read as they are in the place of mu."""
        block, mapped = self.block, self.prepare(kind)
        if self._passing(mapped):
            found = np.empty((block.count, mapped.outputs[0]))
            self._pass(kind, mapped, controls, direction=direction, mu=mu, out=found)
            return found
        return mapped(block.rows(controls), block.data, mu if direction is None else block.rows(direction))

    def gradient(self, controls: np.ndarray, multipliers: np.ndarray | None = None) -> np.ndarray:
        """(n, channels) ∂/∂controls of Σ w φ."""
        block, mapped, mu = self.block, self.prepare("gradient"), self._mu(multipliers)
        if self._passing(mapped):
            found = np.zeros((len(controls), block.kernel.channels))
            self._pass("gradient", mapped, controls, mu=mu, gradient=found)
            return found
        return self._collect(mapped(block.rows(controls), block.data, mu))

    def _collect(self, slopes: np.ndarray) -> np.ndarray:
        """(n, channels) the weighted slopes at the nodes (E · Q, rows · channels), brought to the controls."""
        block, coefficients = self.block, self.block.local.coefficients
        e, q, rows, k = coefficients.shape
        values = (slopes * block.weights[:, None]).reshape(e, q, rows, -1).transpose(1, 2, 3, 0)
        found = _summed(coefficients.transpose(1, 2, 3, 0), values)
        return block.local.collecting @ found.transpose(2, 0, 1).reshape(e * k, -1)

    def rounding(self, controls: np.ndarray, size: np.ndarray) -> float:
        """The rounding of Σ w φ, where every number that the nodes read sums up to size; see `Block.sizes`.

        Of a sum of squares it is the square of the residuals' rounding, which what is far from zero does not
        drown: ε² Σ w ‖|J| s‖², J of the residuals and s the sizes; else ε Σ w |φ|.
        """
        block = self.block
        if not block.kernel.squares:
            return EPS * float(block.weights @ np.abs(self.density(controls)).ravel())
        return EPS**2 * float(block.weights @ self._at_nodes("rounding", controls, size)[:, 0])

    def second_order(
        self,
        controls: np.ndarray,
        local: LocalTables,
        targets: Targets,
        matrix: np.ndarray,
        theta: float,
        multipliers: np.ndarray | None = None,
        stiffness: np.ndarray | None = None,
        factor: float = 1.0,
    ) -> np.ndarray:
        """The gradient (n, channels) of Σ w φ; factor times its Hessian is added to a matrix (targets.size,).

        local: the tables of the columns to which the Hessian belongs. theta: see `derive`. stiffness: (E · Q, C) σ of
        which Σ w Jᵀ diag(σ) J is added, J of the kernel; theta is then the share of all that the multipliers weigh.
        """
        block, kind = self.block, "hessian" if stiffness is None else "barrier"
        mapped, mu = self.prepare(kind), self._mu(multipliers)
        if self._passing(mapped) and targets.starts is not None:
            gradient = np.zeros((len(controls), block.kernel.channels))
            places = {"gradient": gradient, "matrix": matrix, "sigma": stiffness, "mu": mu}
            self._pass(kind, mapped, controls, (local, targets), theta, factor, **places)
            return gradient
        slopes = np.empty((block.count, block.kernel.rows * block.kernel.channels))
        channels, known = block.kernel.channels, targets.wanted
        sums = np.zeros((local.blocks.shape[1] + local.places.size, channels * channels))
        sums[: local.blocks.shape[1]].ravel()[known[0]] = matrix[known[1]]
        parts = sums[local.blocks.shape[1] :].reshape(block.elements, -1, channels * channels)

        def use(nodes: slice, outputs: list[np.ndarray]) -> None:
            elements = slice(nodes.start // block.nodes, nodes.stop // block.nodes)
            blocks = self._single if block.variable == WHOLE else self._assembled
            np.multiply(blocks(local, elements, outputs[0]), factor, out=parts[elements])
            slopes[nodes] = outputs[1]

        share = np.full((block.count, 1), theta)
        more = () if stiffness is None else (stiffness,)
        mapped.each(use, block.rows(controls), block.data, mu, share, *more)
        matrix[known[1]] = (local.summing @ sums).ravel()[known[0]]
        return self._collect(slopes)

    def _single(self, local: LocalTables, elements: slice, packed: np.ndarray) -> np.ndarray:
        """(E, P, 1) the Hessians of elements that read many single numbers, at one node each, by their pairs."""
        rows = local.coefficients[elements, 0]
        hessian = unpacked(packed, rows.shape[1], 1)[..., 0, 0]
        whole = local.weights[elements, :, None] * (rows.swapaxes(1, 2) @ hessian @ rows)
        return whole[:, local.pairs[0], local.pairs[1], None]

    def _assembled(self, local: LocalTables, elements: slice, packed: np.ndarray) -> np.ndarray:
        """(E, P, channels²) the Hessians at the nodes of elements, packed, as the blocks of their pairs of columns."""
        channels, p = self.block.kernel.channels, Packing.of(self.block.kernel.rows, self.block.kernel.channels)
        count, pairs = elements.stop - elements.start, local.pairs.shape[1]
        nodes = np.ascontiguousarray(packed.reshape(count, self.block.nodes, -1).transpose(1, 2, 0))
        shapes = ((self.block.nodes, *size, count) for size in (p.symmetric, p.skew))
        split = [part.reshape(s) for part, s in zip((nodes[:, : p.split], nodes[:, p.split :]), shapes, strict=True)]
        sums = [_summed(w[..., elements], values) for w, values in zip(local.parts, split, strict=True)]
        (i, j), (k, m) = p.upper, p.above
        blocks = np.empty((pairs, channels, channels, count))
        blocks[:, i, j] = blocks[:, j, i] = sums[0]
        blocks[:, k, m] += sums[1]
        blocks[:, m, k] -= sums[1]
        return blocks.reshape(pairs, channels * channels, count).transpose(2, 0, 1)

    def jacobian(self, controls: np.ndarray) -> np.ndarray:
        """(E, C, K, channels) derivatives of the components by the controls of the element; one node per element."""
        block, local = self.block, self.block.local
        values = self.prepare("jacobian")(block.rows(controls), block.data, None)
        values = values.reshape(block.elements, -1, block.kernel.rows, block.kernel.channels)
        return np.einsum("ecrm,erk->eckm", values, local.coefficients[:, 0])

    def _passing(self, mapped: Mapped) -> bool:
        """Whether a function has a pass over the block's elements; those that read many single numbers gain nothing."""
        return mapped.elements is not None and self.block.variable != WHOLE


def _summed(weights: np.ndarray, values: np.ndarray) -> np.ndarray:
    """(P, size, E) the sums over nodes and parts of weights (Q, S, P, E) times values (Q, S, size, E).

    In the order of the compiled pass: not by matrix products, whose order is theirs.
    """
    (q, parts, pairs, count), size = weights.shape, values.shape[2]
    weights, values = (np.ascontiguousarray(a) for a in (weights, values))
    weights, values = weights.reshape(q * parts, pairs, 1, count), values.reshape(q * parts, 1, size, count)
    found = np.zeros((pairs, size, count))
    # Along the first axis NumPy adds one after the other, but of single numbers.
    if len(weights) and 1 < found.size <= AT_ONCE // len(weights):
        return np.add.reduce(weights * values, axis=0)
    term = np.empty_like(found)
    for w, v in zip(weights, values, strict=True):
        np.multiply(w, v, out=term)
        found += term
    return found
