"""Passes over the elements of a block: the tables that they read, their memory, and which thread adds what."""

from collections.abc import Iterator
from functools import partial
from itertools import pairwise

import numpy as np

from symmotion import interrupts
from symmotion.kernels.mapped import Mapped, together
from symmotion.kernels.passes import Pass
from symmotion.program.block import Block
from symmotion.program.local import LocalTables, Targets

WRITTEN = ("out", "gradient", "matrix")
OVERLAP = 1.1  # shares of elements at which threads that see each other's do too much twice


class Passes:
    """The passes of a block's functions. One per thread that calls it.

    Several threads sum up different controls and blocks, each in the order of the elements: the same bits as of one.
    What elements at the border of their shares add to both they evaluate both.
    """

    def __init__(self, block: Block):
        self._block = block
        # Of a function and where its Hessian goes: a task for each thread, and the memory that they name.
        self._tasks: dict[tuple[str, int, int], tuple[list[Pass], list[object]]] = {}

    def __repr__(self) -> str:
        return f"Passes({len(self._tasks)} functions)"

    def __call__(
        self,
        kind: str,
        mapped: Mapped,
        controls: np.ndarray,
        hessian: tuple[LocalTables, Targets] | None = None,
        theta: float = 1.0,
        factor: float = 1.0,
        **arrays: np.ndarray | None,
    ) -> None:
        """One pass of a function over all elements, see `Pass`; arrays: the rest of what it reads and writes."""
        interrupts.check()
        block, function = self._block, mapped.elements
        key = kind, 0 if hessian is None else id(hessian[1]), mapped.threads
        if key not in self._tasks:
            self._tasks[key] = self._made(mapped, hessian)
        # Held until the call has ended.
        given = {"x": controls, **arrays}
        held = {name: None if a is None else np.ascontiguousarray(a, dtype=float) for name, a in given.items()}
        self._require(mapped, held)
        if any(held[name] is not given[name] for name in WRITTEN if name in given):
            raise ValueError("what a pass adds to lies in one piece, in numbers of double precision")
        if hessian is not None and (matrix := held["matrix"]) is not None and matrix.size != hessian[1].size:
            raise ValueError(f"a matrix of {matrix.size} numbers: {hessian[1].size} are needed")
        tasks, first = self._tasks[key][0], block.channels.start or 0
        places = {
            name: None if a is None else a.ctypes.data + a.itemsize * first * (name in ("x", "direction"))
            for name, a in held.items()
        }
        for task in tasks:
            task.theta, task.factor, task.stride = theta, factor, controls.shape[1]
            for name, place in places.items():
                setattr(task, name, place)
        assert function is not None
        together([partial(function, task) for task in tasks])

    def _require(self, mapped: Mapped, given: dict[str, np.ndarray | None]) -> None:
        """Raise ValueError where an array is missing or too short: machine code would read beyond it."""
        block, numbers = self._block, given["x"]
        whole = block.operator.shape[1] * (0 if numbers is None else numbers.shape[1])
        third = "direction" if given.get("direction") is not None else "mu"
        sizes = {"x": whole, third: whole if third == "direction" else block.count * mapped.inputs[2]}
        if len(mapped.inputs) > 4:
            sizes["sigma"] = block.count * mapped.inputs[4]
        for name, size in sizes.items():
            array = given.get(name)
            if size and (array is None or array.size != size):
                raise ValueError(f"{name} of {0 if array is None else array.size} numbers: {size} are needed")

    def _made(self, mapped: Mapped, hessian: tuple[LocalTables, Targets] | None) -> tuple[list[Pass], list[object]]:
        """What is the same for every pass of a function."""
        block = self._block
        local, (columns, targets) = block.local, hessian or (block.local, None)
        tables = {"columns": local.columns, "coefficients": local.coefficients, "weights": block.weights}
        tables |= {"data": block.data, "basis": columns.coefficients}
        if targets is not None:
            tables |= {"places": columns.met, "starts": targets.starts}
        kinds = {name: np.int64 if name in ("columns", "places", "starts") else np.float64 for name in tables}
        whole = {name: np.ascontiguousarray(table, dtype=kinds[name]) for name, table in tables.items()}
        tasks, kept = [], [hessian, whole]
        assert mapped.elements is not None
        for first, end, low, high, begin, stop in self._shares(mapped.threads, columns if targets else None):
            task = Pass(first=first, end=end, low=low, high=high, begin=begin, stop=stop)
            task.nodes, task.controls, task.reduced = block.nodes, local.columns.shape[1], columns.columns.shape[1]
            task.mirrored = targets is not None and targets.mirrored
            for name, table in whole.items():
                setattr(task, name, table.ctypes.data)
            kept.append(mapped.elements.work(task))
            tasks.append(task)
        return tasks, kept

    def _shares(self, threads: int, reduced: LocalTables | None) -> Iterator[tuple[int, ...]]:
        """For each thread the elements (first, end), and the blocks (low, high) and controls (begin, stop) of its own.

        reduced: the tables of the Hessian, None where there is none.
        """
        e, columns = self._block.elements, self._block.local.columns
        places = np.zeros((e, 0), dtype=np.int64) if reduced is None else reduced.places
        blocks, width = (0 if reduced is None else reduced.blocks.shape[1]), self._block.operator.shape[1]
        if threads == 1:
            yield 0, e, 0, blocks, 0, width
            return
        cuts = [e * k // threads for k in range(1, threads)]
        borders = [
            [0, *(int(t[cut:].min(initial=n)) for cut in cuts), n] for t, n in ((places, blocks), (columns, width))
        ]
        found = []
        for (low, high), (begin, stop) in zip(*map(pairwise, borders), strict=True):
            mine = ((places >= low) & (places < high)).any(axis=1) | ((columns >= begin) & (columns < stop)).any(axis=1)
            seen = np.flatnonzero(mine)
            first, end = (int(seen[0]), int(seen[-1]) + 1) if len(seen) else (0, 0)
            found.append((first, end, low, high, begin, stop))
        if sum(end - first for first, end, *_ in found) > OVERLAP * e:
            found = [(0, e, 0, blocks, 0, width)]
        yield from found
