"""The data of a program at a minimum: which numbers there are, by name, and how its KKT conditions change with them."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np
from scipy import sparse

from symmotion import checks
from symmotion.brief import in_a_line
from symmotion.errors import InputError
from symmotion.motions.position import Affine
from symmotion.program import Block, BlockEvaluator, Evaluator, Program, Targeted, Targets

LINEAR = "linear"


@runtime_checkable
class Paired(Protocol):
    """Numbers of positions: linear parts (…, d, d) beside translations (…, d), as `Affine` and `Keyframes` have."""

    @property
    def linear(self) -> np.ndarray: ...

    @property
    def translation(self) -> np.ndarray: ...


@dataclass(frozen=True, eq=False)
class Datum:
    """Numbers p of one name, with the KKT conditions F(x, λ; p) = 0 of the program and its Lagrangian L.

    shape: of the numbers; of `pair`s, linear parts (…, d, d) beside translations (…, d), it is (…, d² + d), rows of the
    linear part first. derivative: (unknowns + conditions, size) ∂F/∂p; slope: (size,) ∂L/∂p, by which the optimum
    changes. unknown: (size,) numbers that are no datum of the program, and have to stay as they are.
    """

    name: str
    shape: tuple[int, ...]
    pair: bool
    derivative: sparse.csr_array
    slope: np.ndarray
    unknown: np.ndarray

    __repr__ = in_a_line

    @property
    def size(self) -> int:
        return self.slope.size

    @property
    def dimension(self) -> int:
        """d of a pair."""
        return int((np.sqrt(4 * self.shape[-1] + 1) - 1) / 2)

    def flat(self, change: object) -> tuple[np.ndarray, bool]:
        """(k, size) changes, and whether a leading axis says that they are several."""
        what = f"change of {self.name!r}"
        if not self.pair:
            whole, several = _batch(change, self.shape, what)
        else:
            lead, d = self.shape[:-1], self.dimension
            linear, translation = (getattr(change, part, None) for part in (LINEAR, "translation"))
            if linear is None and translation is None:
                linear, translation = change if isinstance(change, tuple) and len(change) == 2 else (change, None)
            first, some = (np.zeros((1, *lead, d, d)), False) if linear is None else _batch(linear, (*lead, d, d), what)
            second, more = (
                (np.zeros((1, *lead, d)), False) if translation is None else _batch(translation, (*lead, d), what)
            )
            count, several = max(len(first), len(second)), some or more
            if {len(first), len(second)} - {1, count}:
                raise InputError(f"{what}: as many linear parts as translations are needed")
            whole = np.empty((count, *self.shape))
            whole[..., : d * d] = first.reshape(-1, *lead, d * d)
            whole[..., d * d :] = second
        whole = whole.reshape(len(whole), -1)
        if self.unknown.any() and whole[:, self.unknown].any():
            raise InputError(
                f"{what}: some of it is no condition of the program, since a constraint frees it or others settle it: "
                "change the data of that constraint, or leave it zero"
            )
        return whole, several

    def shaped(self, flat: np.ndarray) -> np.ndarray | Affine:
        """Numbers (…, size) in the shape of the datum, behind the leading axes."""
        values = flat.reshape((*flat.shape[:-1], *self.shape))
        if not self.pair:
            return values
        d = self.dimension
        return Affine(values[..., : d * d].reshape((*values.shape[:-1], d, d)), values[..., d * d :])


def _batch(change: object, shape: tuple[int, ...], what: str) -> tuple[np.ndarray, bool]:
    """(k, …) changes of a shape, and whether there was a leading axis."""
    values = checks.floats(change, what)
    more = values.ndim - len(shape)
    if more not in (0, 1) or values.shape[more:] != shape or not np.isfinite(values).all():
        wanted = checks.shown(shape) if shape else "a number"
        raise InputError(f"{what} of shape {values.shape}: finite, {wanted}, is needed, or several of them in a row")
    return values if more else values[None], bool(more)


@dataclass(frozen=True, eq=False)
class Data:
    """The data of a program at x (unknowns,) with multipliers λ (conditions,)."""

    program: Program
    x: np.ndarray
    multipliers: np.ndarray

    __repr__ = in_a_line

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
            moved = sparse.csr_array(
                (np.ones(len(target)), (np.arange(len(target)), target)), shape=(len(target), m * width)
            )
            whole, slope = whole + derivative @ moved, slope + pull @ moved
        return Datum(name, (m, width), True, whole, slope, np.zeros(m * width, dtype=bool))

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
        self, block: Block, columns: slice, mu: np.ndarray | None, first: int
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
        spread = sparse.csr_array(sparse.kron(block.operator.T, sparse.eye_array(len(channel)), format="csr"))
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
        shown = [
            program.design.multipliers(program.shown(v)) for v in (np.arange(1.0, m + 1), np.ones(m), self.multipliers)
        ]
        for name in shown[0]:
            number, scale, own = (_row(values[name]) for values in shown)
            numbers, scales = number.ravel(), scale.ravel()
            known = scales != 0
            rows = np.rint(numbers[known] / scales[known]).astype(int) - 1
            derivative = sparse.csr_array(
                (-scales[known], (n + rows, np.flatnonzero(known))), shape=(n + m, len(numbers))
            )
            # Without any condition, as a translation that the objective does not see, a part moves nothing.
            pair = isinstance(shown[0][name], Paired)
            seen = (scale.reshape(-1, scale.shape[-1]) != 0).any(axis=0) if pair else np.array(True)
            unknown = ((scale == 0) & seen).ravel()
            yield Datum(name, number.shape, pair, derivative, -own.ravel(), unknown)

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
            yield Datum(name, value.shape, False, derivative, slope[order], np.zeros(value.size, dtype=bool))

    def _weights(self) -> Iterator[Datum]:
        """The relative change of the factor of a term."""
        program, evaluator = self.program, Evaluator(self.program, "interpreted")
        for k, block in enumerate(program.terms):
            gradient = np.zeros(program.unknowns + program.conditions)
            arrays = program.arrays(gradient[: program.unknowns])
            controls = program.arrays(self.x)[block.variable]
            arrays[block.variable][:, block.channels] += evaluator.terms[k].gradient(controls)
            value = np.array([evaluator.terms[k].value(controls)])
            name = f"weight of {block.name}"
            yield Datum(name, (), False, sparse.csr_array(gradient[:, None]), value, np.zeros(1, dtype=bool))


def _blocks(values: np.ndarray) -> sparse.csr_array:
    """(E · R, E · C) the blocks (E, R, C) along the diagonal."""
    count, height, width = values.shape
    row = np.arange(count * height).reshape(count, height, 1)
    column = np.arange(count * width).reshape(count, 1, width)
    where = np.broadcast_to(row, values.shape).ravel(), np.broadcast_to(column, values.shape).ravel()
    return sparse.csr_array((values.ravel(), where), shape=(count * height, count * width))


def _row(shown: object) -> np.ndarray:
    """Multipliers as one array, of pairs (…, d² + d)."""
    if not isinstance(shown, Paired):
        return np.asarray(shown, dtype=float)
    linear, translation = np.asarray(shown.linear), np.asarray(shown.translation)
    return np.concatenate([linear.reshape((*translation.shape[:-1], -1)), translation], axis=-1)
