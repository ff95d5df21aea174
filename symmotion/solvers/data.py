"""The data of a program at a minimum: which numbers there are, by name, and how its KKT conditions change with them."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import sparse

from symmotion import checks
from symmotion.errors import InputError
from symmotion.motions.position import Affine
from symmotion.program import WHOLE, BlockEvaluator, Constraint, Evaluator, Program, Targeted, Targets

LINEAR, TRANSLATION = "linear", "translation"


@dataclass(frozen=True, eq=False)
class Datum:
    """Numbers p of one name, with the KKT conditions F(x, λ; p) = 0 of the program and its Lagrangian L.

    parts: the shapes of its arrays by name, one under "" or "linear" and "translation"; they follow each other in p.
    derivative: (unknowns + conditions, size) ∂F/∂p; slope: (size,) ∂L/∂p, by which the optimum changes.
    unknown: (size,) numbers that are no datum of the program, and have to stay as they are.
    """

    name: str
    parts: Mapping[str, tuple[int, ...]]
    derivative: sparse.csr_array
    slope: np.ndarray
    unknown: np.ndarray

    @property
    def size(self) -> int:
        return self.slope.size

    # Any: numbers, or an object with .linear and .translation.
    def flat(self, change: Any) -> tuple[np.ndarray, bool]:
        """(k, size) changes, and whether a leading axis says that they are several."""
        what = f"change of {self.name!r}"
        if "" in self.parts:
            return self._checked(*_batch(change, self.parts[""], what))
        if isinstance(change, tuple) and len(change) == 2:
            change = Affine(*change)
        given = {part: getattr(change, part, None) for part in self.parts}
        if given[LINEAR] is None and given[TRANSLATION] is None:
            given[LINEAR] = change
        found = {p: _batch(v, self.parts[p], f"{what}: {p} part") for p, v in given.items() if v is not None}
        several = any(b for _, b in found.values())
        count = max(len(v) for v, _ in found.values())
        if any(len(v) not in (1, count) for v, _ in found.values()):
            raise InputError(f"{what}: as many linear parts as translations are needed")
        whole = []
        for part, shape in self.parts.items():
            values = found[part][0] if part in found else np.zeros((1, int(np.prod(shape))))
            whole.append(np.broadcast_to(values, (count, values.shape[1])))
        return self._checked(np.concatenate(whole, axis=1), several)

    def _checked(self, change: np.ndarray, several: bool) -> tuple[np.ndarray, bool]:
        wrong = (change[:, self.unknown] != 0).any()
        if wrong:
            raise InputError(
                f"change of {self.name!r}: some of it is no condition of the program, which a constraint frees or others "
                "settle: change the data of that constraint, or leave it zero"
            )
        return change, several

    def shaped(self, flat: np.ndarray) -> np.ndarray | Affine:
        """Numbers (…, size) in the shape of the datum, behind the leading axes."""
        lead, found, first = flat.shape[:-1], {}, 0
        for part, shape in self.parts.items():
            size = int(np.prod(shape))
            found[part] = flat[..., first : first + size].reshape((*lead, *shape))
            first += size
        return found[""] if "" in found else Affine(found[LINEAR], found[TRANSLATION])


def _batch(change: object, shape: tuple[int, ...], what: str) -> tuple[np.ndarray, bool]:
    values = checks.numbers(change, what)
    fits = values.ndim >= len(shape) and values.shape[values.ndim - len(shape) :] == shape
    if not fits or values.ndim > len(shape) + 1 or not np.isfinite(values).all():
        wanted = checks.shown(shape) if shape else "a number"
        raise InputError(f"{what} of shape {values.shape}: finite, {wanted}, is needed, or several of them in a row")
    return values.reshape(-1, int(np.prod(shape))), values.ndim > len(shape)


@dataclass(frozen=True, eq=False)
class Data:
    """The data of a program at x (unknowns,) with multipliers λ (conditions,)."""

    program: Program
    x: np.ndarray
    multipliers: np.ndarray

    def every(self) -> dict[str, "Datum"]:
        """By name: positions, conditions, parameters, weights."""
        found: dict[str, Datum] = {}
        for datum in (*self._positions(), *self._conditions(), *self._parameters(), *self._weights()):
            found.setdefault(datum.name, datum)
        return found

    def _positions(self) -> Iterator[Datum]:
        design = self.program.design
        targets = design.targets(self.program) if isinstance(design, Targeted) else {}
        for name, known in targets.items():
            yield self._position(name, known)

    def _position(self, name: str, known: Targets) -> Datum:
        d, m = known.dimension, known.count
        width = d * d + d
        size = self.program.unknowns + self.program.conditions
        whole, slope = sparse.csr_array((size, m * width)), np.zeros(m * width)
        for place in known.places:
            columns = np.arange(*place.part.indices(width))
            derivative, pull = self._block(place.block, slice(place.first, place.first + len(columns)))
            target = (place.numbers[:, None] * width + columns).ravel()
            moved = sparse.csr_array((np.ones(len(target)), (np.arange(len(target)), target)), shape=(len(target), m * width))
            whole, slope = whole + derivative @ moved, slope + pull @ moved
        # The linear parts first, then the translations.
        order = np.arange(m * width).reshape(m, width)
        order = np.concatenate([order[:, : d * d].ravel(), order[:, d * d :].ravel()])
        parts = {LINEAR: (m, d, d), TRANSLATION: (m, d)}
        return Datum(name, parts, sparse.csr_array(sparse.csc_array(whole)[:, order]), slope[order], np.zeros(m * width, dtype=bool))

    def _block(self, name: str, columns: slice) -> tuple[sparse.csr_array, np.ndarray]:
        """∂F/∂data (unknowns + conditions, E · columns), ∂L/∂data of columns of the data of a term or a constraint."""
        program, first = self.program, self.program.unknowns
        for block in program.terms:
            if block.name == name:
                return self._derived(block, columns, None, 0)
        for c in program.constraints:
            if c.name == name:
                return self._derived(c.block, columns, program.split(self.multipliers)[name], first)
            first += c.size
        raise InputError(f"no term or constraint {name!r}")

    def _derived(
        self, block: Any, columns: slice, mu: np.ndarray | None, first: int
    ) -> tuple[sparse.csr_array, np.ndarray]:
        """As `_block`; first: the row of the first of the constraint's conditions."""
        program, evaluator = self.program, BlockEvaluator(block, "interpreted")
        z = block.rows(program.arrays(self.x)[block.variable])
        weights = mu if mu is not None else np.ones((block.count, block.kernel.out.numel()))
        width = block.data.shape[1]
        wanted = np.arange(*columns.indices(width))
        mixed = evaluator.prepare("mixed")(z, block.data, weights).reshape(block.count, -1, width)[..., wanted]
        slope = evaluator.prepare("shift")(z, block.data, weights)[:, wanted]
        lines = _blocks(mixed * block.weights[:, None, None])
        begin, stride = program.place(block.variable)
        channel = np.arange(stride)[block.channels]
        spread = sparse.csr_array(sparse.kron(block.transposed, sparse.eye_array(len(channel)), format="csr"))
        local = sparse.coo_array(spread @ lines)
        control, offset = np.divmod(local.coords[0], len(channel))
        rows, values, places = [begin + control * stride + channel[offset]], [local.data], [local.coords[1]]
        if mu is not None:
            data = evaluator.prepare("data")(z, block.data, None).reshape(block.count, -1, width)[..., wanted]
            border = sparse.coo_array(_blocks(data))
            rows.append(first + border.coords[0])
            values.append(border.data)
            places.append(border.coords[1])
        shape = (program.unknowns + program.conditions, block.count * len(wanted))
        found = sparse.csr_array((np.concatenate(values), (np.concatenate(rows), np.concatenate(places))), shape=shape)
        found.eliminate_zeros()
        return found, (slope * block.weights[:, None]).ravel()

    def _conditions(self) -> Iterator[Datum]:
        """What every condition equals, or at most is, in the shape in which its multipliers are shown."""
        program, n, m = self.program, self.program.unknowns, self.program.conditions
        if not m:
            return
        shown = [program.design.multipliers(program.shown(v)) for v in (np.arange(1.0, m + 1), np.ones(m), self.multipliers)]
        for name in shown[0]:
            number, scale, own = (_parts(values[name]) for values in shown)
            parts = {part: value.shape for part, value in number.items()}
            numbers, scales, pulls = (np.concatenate([v.ravel() for v in x.values()]) for x in (number, scale, own))
            known = scales != 0
            rows = np.zeros(len(numbers), dtype=int)
            rows[known] = np.rint(numbers[known] / scales[known]).astype(int) - 1
            derivative = sparse.csr_array(
                (-scales[known], (n + rows[known], np.flatnonzero(known))), shape=(n + m, len(numbers))
            )
            # A part without any condition, such as a translation that the objective does not see, moves nothing.
            seen = np.concatenate([np.full(v.size, bool(v.any())) for v in scale.values()])
            yield Datum(name, parts, derivative, -pulls, ~known & seen)

    def _parameters(self) -> Iterator[Datum]:
        program = self.program
        for name, value in program.parameters.items():
            size = program.unknowns + program.conditions
            derivative, slope = sparse.csr_array((size, value.size)), np.zeros(value.size)
            for c in program.constraints:
                for place in (p for p in c.parameters if p.name == name):
                    single, pull = self._block(c.name, place.columns)
                    every = np.tile(np.eye(value.size), (c.block.count, 1))
                    derivative = derivative + single @ sparse.csr_array(every)
                    slope = slope + pull @ every
            # The block has them column by column.
            order = np.arange(value.size).reshape(value.shape, order="F").ravel()
            derivative = sparse.csr_array(sparse.csc_array(derivative)[:, order])
            yield Datum(name, {"": value.shape}, derivative, slope[order], np.zeros(value.size, dtype=bool))

    def _weights(self) -> Iterator[Datum]:
        """The relative change of the factor of a term."""
        program, evaluator = self.program, Evaluator(self.program, "interpreted")
        for k, block in enumerate(program.terms):
            gradient = np.zeros(program.unknowns + program.conditions)
            arrays = program.arrays(gradient[: program.unknowns])
            z = block.rows(program.arrays(self.x)[block.variable])
            arrays[block.variable][:, block.channels] += evaluator.terms[k].gradient(z)
            value = np.array([evaluator.terms[k].value(z)])
            name = f"weight of {block.name}"
            yield Datum(name, {"": ()}, sparse.csr_array(gradient[:, None]), value, np.zeros(1, dtype=bool))


def _blocks(values: np.ndarray) -> sparse.csr_array:
    """(E · R, E · C) the blocks (E, R, C) along the diagonal."""
    count, height, width = values.shape
    row = np.arange(count * height).reshape(count, height, 1)
    column = np.arange(count * width).reshape(count, 1, width)
    where = np.broadcast_to(row, values.shape).ravel(), np.broadcast_to(column, values.shape).ravel()
    return sparse.csr_array((values.ravel(), where), shape=(count * height, count * width))


# Any: what a design shows of multipliers.
def _parts(shown: Any) -> dict[str, np.ndarray]:
    if hasattr(shown, LINEAR) and hasattr(shown, TRANSLATION):
        return {LINEAR: np.asarray(shown.linear), TRANSLATION: np.asarray(shown.translation)}
    return {"": np.asarray(shown, dtype=float)}
