"""Kernel functions over many nodes: interpreted or compiled, in chunks that stay in cache, on one thread or several."""

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor, wait
from dataclasses import dataclass
from functools import lru_cache, partial
from typing import Literal, TypeAlias

import casadi as ca
import numpy as np

from symmotion import interrupts
from symmotion.forking import LIBRARIES
from symmotion.kernels.arrays import ArrayFunction, Arrays
from symmotion.kernels.compiled import BESIDE, LARGEST, Machine, begin, has_compiler, load
from symmotion.kernels.kernel import Kernel

# A function in one of the forms in which it is carried out.
Carried: TypeAlias = Machine | ArrayFunction | ca.Function
Kernels = Literal["auto", "compiled", "interpreted"]  # how kernels are run; what each does: `kernel_function`
CHUNK = 131072  # numbers that a chunk reads and writes: 1 MB
COMPILE_FROM = 20_000  # nodes of R from which a solve or two repay the compiler: study `kernels`
COMPILE_AFTER = (
    100_000  # nodes in all at which a function was interpreted that have taken as long as its compiler would
)
LIST_FROM = 10_000_000  # instructions at all nodes from which a solve or two repay listing those of a long function
ARRAYS_FROM = 500  # nodes from which NumPy carries out a function faster than CasADi, listing it included
THREADS_FROM = 16  # chunks from which a second thread pays


def kernel_function(kernel: Kernel, kind: str, count: int, kernels: Kernels) -> Carried:
    """One of the functions of `derive` for `count` nodes: compiled where that is wanted or free, else interpreted.

    kernels: "compiled" compiles what the cache lacks, "interpreted" leaves it to CasADi alone,
    "auto" takes what is in the cache, and has compiled beside what goes on what a program repays at once, and what many
    small ones have used so often that the compiler would have been repaid. What is not compiled is carried out by NumPy
    at many nodes, see `ArrayFunction`, and by CasADi at few.

    kind: its name; kernel: what it is derived from.

    >>> kernel = sm.affine_program(sm.examples.planar_keyframes()).terms[0].kernel
    >>> function = sm.kernels.kernel_function(kernel, "value", 30, "interpreted")
    """
    if kernels == "interpreted":
        return kernel.function(kind)
    key = kernel.code, kind, kernel.channels, kernel.squares
    machine = load(*key, build=kernels == "compiled")
    if machine is not None:
        return machine
    # Only here is the function derived: what is in the cache needs none.
    function = kernel.function(kind)
    length = function.n_instructions()
    if length <= LARGEST:
        repaid = count >= COMPILE_FROM or (_use(function).nodes >= COMPILE_AFTER and has_compiler())
    else:
        repaid = count * length >= LIST_FROM
    if repaid and kernels == "auto":
        begin(*key)
    return (ArrayFunction.of(function) if count >= ARRAYS_FROM else None) or function


def expect(kernel: Kernel) -> None:
    """Have the functions of a term compiled beside the next solves: a series of them is to come, which repays it.

    >>> sm.kernels.expect(sm.affine_program(sm.examples.planar_keyframes()).terms[0].kernel)
    """
    for kind in ("value", "gradient", "hessian", "line"):
        if kind != "line" or kernel.quartic:
            _use(kernel.function(kind)).nodes += COMPILE_AFTER


def news() -> int:
    """How many functions have been made beside what goes on: where it has grown, one may be there."""
    return BESIDE.done


@dataclass
class _Use:
    """At how many nodes a function has been interpreted."""

    nodes: int = 0


@lru_cache(maxsize=512)
def _use(function: ca.Function) -> _Use:
    return _Use()


def is_compilable(kernel: Kernel, kind: str) -> bool:
    """Whether one of the functions of `derive` is short enough for a compiler.

    kind: the name of that function, such as "value" or "hessian".

    >>> sm.kernels.is_compilable(sm.affine_program(sm.examples.planar_keyframes()).terms[0].kernel, "hessian")
    True
    """
    return kernel.function(kind).n_instructions() <= LARGEST


def default_threads() -> int:
    """How many threads a long program gets by default: as many as there are processors, four at most.

    >>> 1 <= sm.kernels.default_threads() <= 4
    True
    """
    # Machines with many processors are shared by jobs, and gathering the Hessian stays on one thread.
    return min(4, available_processors())


def available_processors() -> int:
    """How many processors this process may use.

    >>> sm.kernels.available_processors() >= 1
    True
    """
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


class Mapped:
    """A kernel function over many nodes, in chunks. One per thread that calls it.

    count: nodes in all; multiple: nodes that must stay in one chunk; threads: at most so many
    work on it at once. elements: the function's pass over elements, where it has one. Every node's numbers are the
    same whatever the chunks and threads.

    A call raises ValueError for arrays of other shapes, and where one that the function reads is missing.

    >>> kernel = sm.affine_program(sm.examples.planar_keyframes()).terms[0].kernel
    >>> function = sm.kernels.kernel_function(kernel, "value", 30, "interpreted")
    >>> mapped = sm.kernels.Mapped(function, 30)
    """

    def __init__(
        self, function: Machine | ArrayFunction | ca.Function, count: int, multiple: int = 1, threads: int = 1
    ):
        if isinstance(function, Machine | ArrayFunction):
            inputs, outputs = function.inputs, function.outputs
        else:
            inputs = tuple(function.size1_in(i) for i in range(function.n_in()))
            outputs = tuple(function.size1_out(i) for i in range(function.n_out()))
        self.count, self.inputs, self.outputs = count, inputs, outputs
        self.compiled = isinstance(function, Machine)
        self.elements = None if isinstance(function, ca.Function) else function.elements
        own = function.function if isinstance(function, ArrayFunction) else function
        self._use = _Use() if isinstance(own, Machine) else _use(own)
        # Chunks of equal size: what the last one lacks would be interpreted in vain.
        elements = count // multiple
        most = function.nodes if isinstance(function, ArrayFunction) else CHUNK / max(1, sum(inputs + outputs))
        rounds = max(1, round(count / most))
        size = -(-elements // rounds) * multiple
        self._chunks = [slice(start, min(start + size, count)) for start in range(0, count, size)] if size else []
        self.threads = min(threads, max(1, 2 * len(self._chunks) // THREADS_FROM))
        with LIBRARIES:
            self._workers = [_worker(function, size) for _ in range(self.threads)]

    def __repr__(self) -> str:
        return f"Mapped({self.count} nodes, {'compiled' if self.compiled else 'interpreted'})"

    def each(self, use: Callable[[slice, list[np.ndarray]], None], *inputs: np.ndarray | None) -> None:
        """Call use(nodes, outputs) for every chunk: its slice of the nodes and the outputs there, (nodes, size) each.

        inputs: (count, size) each, in the function's order; None for one that it does not read.
        outputs are valid during the call only. `use` runs on several threads where the work is
        large, and may write to different places only.
        """
        interrupts.check()
        contiguous = [None if a is None else np.ascontiguousarray(a, dtype=float) for a in inputs]
        for a, size in zip(contiguous, self.inputs, strict=True):
            if a is not None and size and a.size != self.count * size:
                raise ValueError(f"an array ({self.count}, {size}) is needed, not {a.shape}")

        def work(worker: _Compiled | Arrays | _Interpreted, chunks: Sequence[slice]) -> None:
            for nodes in chunks:
                use(nodes, worker(contiguous, nodes))

        self._use.nodes += self.count
        share = -(-len(self._chunks) // len(self._workers))
        parts = [self._chunks[k * share : (k + 1) * share] for k in range(len(self._workers))]
        together([partial(work, *pair) for pair in zip(self._workers, parts, strict=True)])

    def __call__(self, *inputs: np.ndarray | None) -> np.ndarray:
        """(count, size) the first output at all nodes."""
        result = np.empty((self.count, self.outputs[0]))

        def keep(nodes: slice, outputs: list[np.ndarray]) -> None:
            result[nodes] = outputs[0]

        self.each(keep, *inputs)
        return result


def together(tasks: Sequence[Callable[[], object]]) -> None:
    """Do tasks at the same time, the first in this thread."""
    with LIBRARIES:  # for the other threads too
        if len(tasks) == 1:
            tasks[0]()
            return
        rest = [_pool(len(tasks), os.getpid()).submit(task) for task in tasks[1:]]
        try:
            tasks[0]()
        finally:
            wait(rest)  # an interrupt must not leave them writing into arrays that are used again
    for future in rest:
        future.result()


@lru_cache(maxsize=4)
def _pool(threads: int, process: int) -> ThreadPoolExecutor:
    # Of this process: a forked one has the parent's pool without its threads.
    # Starting threads costs more than the work that they take over in a program of middling size.
    return ThreadPoolExecutor(threads, thread_name_prefix="symmotion")


def _worker(function: Carried, size: int) -> "_Compiled | Arrays | _Interpreted":
    """One thread's memory for a function at so many nodes."""
    if isinstance(function, Machine):
        return _Compiled(function, size)
    return Arrays(function, size) if isinstance(function, ArrayFunction) else _Interpreted(function, size)


class _Compiled:
    """One thread's output arrays for machine code."""

    def __init__(self, function: Machine, chunk: int):
        self._function = function
        self._outputs = [np.empty((chunk, size)) for size in function.outputs]
        self._addresses = [array.ctypes.data for array in self._outputs]

    def __call__(self, inputs: Sequence[np.ndarray | None], nodes: slice) -> list[np.ndarray]:
        count = nodes.stop - nodes.start
        pairs = zip(inputs, self._function.inputs, strict=True)
        self._function(count, [_address(a, size * nodes.start) if size else None for a, size in pairs], self._addresses)
        return [array[:count] for array in self._outputs]


def _address(array: np.ndarray | None, first: int) -> int:
    """Where the number of index `first` lies."""
    if array is None:
        raise ValueError("an input that the function reads is missing")
    return array.ctypes.data + array.itemsize * first


class _Interpreted:
    """One thread's input and output arrays for CasADi's virtual machine.

    `Function.buffer()` costs under a microsecond a call where an ordinary call costs fifty.
    """

    def __init__(self, function: ca.Function, chunk: int):
        self._inputs = [np.zeros((chunk, function.size1_in(i))) for i in range(function.n_in())]
        self._outputs = [np.zeros((chunk, function.size1_out(i))) for i in range(function.n_out())]
        # CasADi's stubs do not know that a memoryview brings its own size.
        self._buffer, self._call = _repeated(function, chunk).buffer()
        for i, array in enumerate(self._inputs):
            if array.size:
                self._buffer.set_arg(i, memoryview(array))  # pyright: ignore[reportCallIssue, reportArgumentType]
        for i, array in enumerate(self._outputs):
            self._buffer.set_res(i, memoryview(array))  # pyright: ignore[reportCallIssue, reportArgumentType]

    def __call__(self, inputs: Sequence[np.ndarray | None], nodes: slice) -> list[np.ndarray]:
        count = nodes.stop - nodes.start
        for array, values in zip(self._inputs, inputs, strict=True):
            if values is not None and array.size:
                array[:count] = values[nodes]
        self._call()
        return [array[:count] for array in self._outputs]


@lru_cache(maxsize=512)
def _repeated(function: ca.Function, count: int) -> ca.Function:
    return function.map(count)
