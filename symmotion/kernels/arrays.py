"""Kernel functions without a compiler: their instructions carried out by NumPy, each on many nodes at once.

CasADi's machine reads the list of instructions anew for every node. Here an instruction is one call of NumPy for all
nodes of a chunk. What IEEE rounds is rounded alike; what comes from a library of functions, such as sines, is left to
CasADi, so that the bits are the interpreter's.
"""

from collections.abc import Callable, Sequence
from functools import lru_cache

import casadi as ca
import numpy as np

from symmotion.kernels.listing import Listing

NODES = 2048  # at once, at most: registers of 16 kB, of which those in use stay in cache
REGISTERS = 2**22  # numbers in all registers, at most: 32 MB
EXACT: dict[int, np.ufunc] = {
    ca.OP_ADD: np.add,
    ca.OP_SUB: np.subtract,
    ca.OP_MUL: np.multiply,
    ca.OP_DIV: np.divide,
    ca.OP_LT: np.less,
    ca.OP_LE: np.less_equal,
    ca.OP_EQ: np.equal,
    ca.OP_NE: np.not_equal,
    ca.OP_ASSIGN: np.positive,
    ca.OP_NEG: np.negative,
    ca.OP_SQ: np.square,
    ca.OP_SQRT: np.sqrt,
    ca.OP_FABS: np.fabs,
}
# Of what is left to CasADi, what has two operands.
BINARY = (
    *(ca.OP_POW, ca.OP_CONSTPOW, ca.OP_ATAN2, ca.OP_HYPOT, ca.OP_FMIN, ca.OP_FMAX, ca.OP_FMOD),
    *(ca.OP_COPYSIGN, ca.OP_AND, ca.OP_OR),
)

Register = np.ndarray | float


class ArrayFunction:
    """A kernel function for NumPy, over any number of nodes.

    function: CasADi's; listing: its instructions; inputs, outputs: the size of each at a node, zero of an input that is
    not read; nodes: at once.

    >>> kernel = sm.affine_program(sm.examples.planar_keyframes()).terms[0].kernel
    >>> sm.kernels.ArrayFunction.of(kernel.function("value")).outputs
    (1,)
    """

    elements = None

    def __init__(self, function: ca.Function, listing: Listing):
        self.function, self.listing = function, listing
        self.nodes = min(NODES, REGISTERS // max(1, int(listing.registers[0])))
        self.inputs, self.outputs = (tuple(sizes.tolist()) for sizes in (listing.inputs, listing.outputs))

    def __repr__(self) -> str:
        return f"ArrayFunction({self.listing})"

    @staticmethod
    @lru_cache(maxsize=512)
    def of(function: ca.Function) -> "ArrayFunction | None":
        """The instructions of a dense SX function; None where it has an operation that is not known here."""
        listing = Listing.of(function)
        return None if listing is None else ArrayFunction(function, listing)


class Arrays:
    """One thread's registers, inputs and outputs for so many nodes, and the steps of a function on them."""

    def __init__(self, function: ArrayFunction, nodes: int):
        self._inputs = [np.zeros((size, nodes)) for size in function.inputs]
        self._outputs = [np.empty((size, nodes)) for size in function.outputs]
        self._memory = np.empty((int(function.listing.registers[0]), nodes))
        self._kept: list[object] = []
        self._steps = self._bound(function.listing)

    def __call__(self, inputs: Sequence[np.ndarray | None], nodes: slice) -> list[np.ndarray]:
        count = nodes.stop - nodes.start
        for array, values in zip(self._inputs, inputs, strict=True):
            if values is not None and array.size:
                array[:, :count] = values[nodes].T
        with np.errstate(all="ignore"):
            for step, arguments in self._steps:
                step(*arguments)
        return [array[:, :count].T for array in self._outputs]

    def _bound(self, listing: Listing) -> list[tuple[Callable[..., object], tuple[object, ...]]]:
        """The instructions as calls and their arguments."""
        constants, holds = listing.constants.tolist(), dict[int, Register]()
        steps: list[tuple[Callable[..., object], tuple[object, ...]]] = []
        for op, made, first, second in listing.code.tolist():
            # Inputs and constants are read where they are.
            if op == ca.OP_INPUT:
                holds[made] = self._inputs[first][second]
                continue
            if op == ca.OP_CONST:
                holds[made] = constants[first]
                continue
            x, to = holds[first], self._memory[made]
            if op == ca.OP_OUTPUT:
                steps.append((np.copyto, (self._outputs[made][second], x)))
                continue
            y = holds[second]
            if op == ca.OP_TWICE:
                steps.append((np.add, (x, x, to)))
            elif op == ca.OP_INV:
                steps.append((np.divide, (1.0, x, to)))
            elif op in EXACT:
                steps.append((EXACT[op], (x, y, to) if EXACT[op].nin == 2 else (x, to)))
            elif op == ca.OP_IF_ELSE_ZERO:
                steps.append((_where, (x, y, to)))
            else:
                steps.append((self._by_casadi(op, x, y, to), ()))
            holds[made] = to
        return steps

    def _by_casadi(self, op: int, x: Register, y: Register, to: np.ndarray) -> Callable[[], object]:
        """CasADi's own operation of one operand or of two."""
        given = [np.empty_like(to), np.empty_like(to)]
        buffer, call = _operation(op).map(len(to)).buffer()
        for i, array in enumerate(given):
            buffer.set_arg(i, memoryview(array))  # pyright: ignore[reportCallIssue, reportArgumentType]
        found = np.empty_like(to)
        buffer.set_res(0, memoryview(found))  # pyright: ignore[reportCallIssue, reportArgumentType]
        self._kept.append(buffer)

        def step() -> None:
            given[0][:], given[1][:] = x, y
            call()
            to[:] = found

        return step


def _where(x: Register, y: Register, to: np.ndarray) -> None:
    to[:] = np.where(np.not_equal(x, 0.0), y, 0.0)


@lru_cache(maxsize=64)
def _operation(op: int) -> ca.Function:
    x, y = ca.SX.sym("x"), ca.SX.sym("y")
    return ca.Function("operation", [x, y], [ca.SX.binary(op, x, y) if op in BINARY else ca.SX.unary(op, x)])
