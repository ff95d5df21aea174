"""Programs: a start value, named terms and named constraints, all of them kernels applied many times."""

from collections.abc import Hashable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, Generic, Protocol, TypeAlias, TypeVar, runtime_checkable

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike
from scipy import sparse

from symmotion import checks
from symmotion.brief import in_a_line
from symmotion.errors import InputError
from symmotion.program.block import WHOLE, Block
from symmotion.program.everywhere import Everywhere
from symmotion.program.quadrature import Quadrature
from symmotion.program.state import made_of

MotionT = TypeVar("MotionT", covariant=True)  # of a design: what its unknowns read as
DesignT = TypeVar("DesignT", covariant=True, bound="Design[object]")
# By constraint. Any: arrays, pairs of them or numbers, as the design shows them.
Multipliers: TypeAlias = Mapping[str, Any]


@dataclass(frozen=True)
class ParameterPlace:
    """Where a parameter's numbers lie in a block's data: from column `first` on, in a shape, column by column.

    >>> keys = sm.examples.random_keyframes(3, 40, seed=1)
    >>> touch = sm.JetConstraint(lambda jet, p: jet.dv - p.v, at=0.5, name="touch", parameters={"v": [0, 0, 1]})
    >>> [place.name for place in sm.pose_program(keys, constraints=[touch]).constraint("touch").parameters]
    ['v']
    """

    name: str
    first: int
    shape: tuple[int, ...]

    @property
    def columns(self) -> slice:
        """The columns of the block's data that hold the parameter."""
        return slice(self.first, self.first + int(np.prod(self.shape)))


@dataclass(frozen=True, eq=False)
class Constraint:
    """lower ≤ kernel ≤ upper at every node of a block; an equality where both are the same.

    lower, upper: (E, C), one row per node. shape: in which its multipliers are shown, (E, C) when left out; matrix:
    whether the last two axes are those of a matrix, whose entries the kernel has column by column.
    parameters: the columns of the block's data that are numbers to change. times: (E, s) of its nodes, None where they
    have none. everywhere: of a condition that is meant for all times, and held at those of its nodes only, the rest.
    power: the kernel is this power of the quantity that is named; where it is not 1, `excess` is told of the quantity.

    >>> keyframes = sm.affine_program(sm.examples.planar_keyframes()).constraint("keyframes")
    >>> keyframes.lower.shape, keyframes.is_equality
    ((4, 4), True)
    """

    block: Block
    lower: np.ndarray
    upper: np.ndarray
    shape: tuple[int, ...] | None = None
    matrix: bool = False
    parameters: tuple[ParameterPlace, ...] = ()
    times: np.ndarray | None = None
    everywhere: "Everywhere[Constraint] | None" = None
    power: int = 1

    @staticmethod
    def equality(block: Block) -> "Constraint":
        """kernel = 0 at every node."""
        zero = np.zeros((block.count, block.kernel.out.numel()))
        return Constraint(block, zero, zero)

    def __repr__(self) -> str:
        return f"Constraint({self.nature})"

    @property
    def nature(self) -> str:
        """What it is, in words."""
        kind = "equality" if self.is_equality else "bounds"
        where = f", everywhere, held at {self.block.count} times" if self.everywhere else ""
        return f"{self.block.nature}; {self.size} multipliers, {kind}{where}"

    @property
    def name(self) -> str:
        """The name of its block, by which multipliers and reports tell of it."""
        return self.block.name

    @property
    def size(self) -> int:
        """How many conditions it is, E · C."""
        return self.lower.size

    @property
    def is_equality(self) -> bool:
        """Whether all its conditions are equalities."""
        return bool((self.lower == self.upper).all())

    @property
    def parameter_values(self) -> dict[str, np.ndarray]:
        """The numbers of its parameters by name, each in its shape."""
        data = self.block.data
        return {p.name: data[0, p.columns].reshape(p.shape, order="F") for p in self.parameters}

    def shaped(self, multipliers: np.ndarray) -> np.ndarray:
        """Multipliers (E, C) in the shape in which they are shown."""
        if self.shape is None:
            return multipliers
        if not self.matrix:
            return multipliers.reshape(self.shape)
        *rows, height, width = self.shape
        return np.swapaxes(multipliers.reshape(*rows, width, height), -1, -2)


# Any: who puts something in knows what it is.
class Structure(dict[Hashable, Any]):
    """What is derived from a program's structure, by name. A pickle holds it empty, and once for all that share it."""

    def __reduce__(self):
        return Structure, ()


class Design(Protocol[MotionT]):
    """The question behind a program: how its unknowns read as a motion, and back.

    A design of which more can be asked is `Rekeyed` or `Staged` too.

    >>> program = sm.affine_program(sm.examples.planar_keyframes())
    >>> design: sm.program.Design = program.design
    >>> sorted(design.unknowns(design.motion(program.unpack(program.x0))))
    ['controls']
    """

    def motion(self, unknowns: Mapping[str, np.ndarray]) -> MotionT:
        """The motion of the program's unknowns, by name (n, channels)."""
        ...

    # Any: a user's motion, of any kind.
    def unknowns(self, motion: Any) -> Mapping[str, np.ndarray]:
        """The unknowns of a motion, exactly where the space holds it."""
        ...

    def multipliers(self, multipliers: Mapping[str, np.ndarray]) -> Multipliers:
        """Multipliers by constraint in the shapes that users meet: those of keyframes are pairs of arrays."""
        ...


@runtime_checkable
class Rekeyed(Protocol):
    """A design whose keyframes can be moved without building the program again.

    >>> keys = sm.examples.planar_keyframes()
    >>> program = sm.affine_program(keys)
    >>> edited = program.with_keyframes(keys.moved(1, linear=np.eye(2)))
    >>> edited.unknowns == program.unknowns
    True
    """

    # Any: keyframes in the form that the design's program takes.
    def with_keyframes(self, program: "Program", keyframes: Any) -> "Program":
        """The program for other keyframes at the same times."""
        ...


@runtime_checkable
class Staged(Protocol):
    """A design that knows smaller programs on the way to its own.

    >>> program = sm.affine_program(sm.examples.planar_keyframes(), degree=5)
    >>> [stage.unknowns for stage in program.stages("degree")]
    [28, 32, 36, 40]
    """

    def stages(self, by: str) -> "Iterable[Program]":
        """Smaller programs that lead to this one, coarsest first, by "degree" or "knots"."""
        ...


@runtime_checkable
class Turning(Protocol):
    """A design whose motion turns from keyframe to keyframe, and could turn the other way round.

    >>> sm.affine_program(sm.examples.planar_keyframes()).design.turns.round(3)
    array([1.222, 1.396, 1.571])
    """

    @property
    def turns(self) -> np.ndarray:
        """(M − 1,) the angles in rad, 0 to π, between neighbours; none where no rotations lead from one to the next."""
        ...

    def rigid(self, whole: np.ndarray | None = None) -> Mapping[str, np.ndarray]:
        """The unknowns of a motion that turns rigidly, with (M − 1,) whole turns added: −1 for the other way round."""
        ...

    def turned(self, unknowns: Mapping[str, np.ndarray], segment: int) -> Mapping[str, np.ndarray]:
        """The unknowns of a motion that turns rigidly the other way round along a segment, elsewhere as these."""
        ...


@runtime_checkable
class Noted(Protocol):
    """A design with something to say of what it was given, which it takes all the same."""

    @property
    def notes(self) -> tuple[str, ...]: ...


@runtime_checkable
class Telling(Protocol):
    """A design with something to say of a motion that was found, which may not be what was meant."""

    # Any: its own kind of motion, of several bodies a mapping.
    def told(self, motion: Any) -> tuple[str, ...]: ...


@runtime_checkable
class Integrated(Protocol):
    """A design whose terms are integrals by Gauss nodes, of which there can be more.

    >>> program = sm.affine_program(sm.examples.planar_keyframes(), objective=sm.StrainRate())
    >>> program.refined(program.x0).terms[0].nodes >= program.terms[0].nodes
    True
    """

    def quadratures(self, program: "Program", x: np.ndarray) -> Mapping[str, Quadrature]:
        """By term, how well its nodes integrate at x (unknowns,)."""
        ...

    # Any: the program's design is of the same kind.
    def refined(self, program: "Program[Any]", x: np.ndarray) -> "Program[Any] | None":
        """The program with as many nodes as ten digits need at x (unknowns,); None where it has them, or can have."""
        ...


@dataclass(frozen=True, eq=False)
class Target:
    """Where positions lie in a block's data: their coordinates `part` from column `first` on.

    numbers: (E,) which of the positions each node has.

    >>> program = sm.affine_program(sm.examples.planar_keyframes())
    >>> [place.block for place in program.design.targets(program)["keyframes"].places]
    ['keyframes']
    """

    block: str
    first: int
    numbers: np.ndarray
    part: slice

    __repr__ = in_a_line


@dataclass(frozen=True, eq=False)
class Targets:
    """What a program knows of `count` affine positions in d dimensions, d² + d coordinates each, rows of A first.

    places: the conditions that hold coordinates of positions, and which.

    >>> program = sm.affine_program(sm.examples.planar_keyframes())
    >>> program.design.targets(program)["keyframes"].dimension
    2
    """

    count: int
    dimension: int
    places: tuple[Target, ...]

    __repr__ = in_a_line


@runtime_checkable
class Targeted(Protocol):
    """A design that meets or follows affine positions.

    >>> program = sm.affine_program(sm.examples.planar_keyframes())
    >>> program.design.targets(program)["keyframes"].count
    4
    """

    # Any: the program's design is of the same kind.
    def targets(self, program: "Program[Any]") -> Mapping[str, Targets]:
        """By name, such as "keyframes", where they are in the program's data."""
        ...


@dataclass(frozen=True, eq=False)
class Program(Generic[DesignT]):
    """Minimise Σ terms over the unknowns, subject to constraints that keep their multipliers.

    start: by name, the unknowns' start values, each (n, channels); their shapes define the
        unknowns x, one vector of all of them in this order, row by row.
    terms: blocks whose sum is the objective; constraints: each with a multiplier per component.
    design: turns x back into a motion. build_seconds: what making the program took.
    lengths: by name, the channels that are lengths in the user's unit; the others are pure numbers.
    shifts: by name, (channels,) what was subtracted from each control, so that it is not far from zero.
    directions: by name, the channels that make unit vectors, see `normalised`.

    The Lagrangian is L = Σ terms + λᵀg, so that the optimum changes by −λ with the data that
    g subtracts.

    structure: what is derived from it, shared by those that differ in data. Raises InputError for names and data
    that it does not have.

    >>> program = sm.affine_program(sm.examples.planar_keyframes())
    >>> program.unknowns, [term.name for term in program.terms], [c.name for c in program.constraints]
    (36, ['R'], ['keyframes'])
    """

    start: Mapping[str, np.ndarray]
    terms: tuple[Block, ...]
    constraints: tuple[Constraint, ...]
    design: DesignT
    build_seconds: float | None = None
    lengths: Mapping[str, slice] = field(default_factory=dict)
    shifts: Mapping[str, np.ndarray] = field(default_factory=dict)
    directions: Mapping[str, slice] = field(default_factory=dict)
    # Derived structure (patterns, null-space bases), shared by programs that differ in data only.
    structure: Structure = field(default_factory=Structure, repr=False)

    __getstate__ = made_of

    @cached_property
    def offsets(self) -> dict[str, int]:
        """Where each unknown begins in x."""
        sizes = [v.size for v in self.start.values()]
        return dict(zip(self.start, np.concatenate([[0], np.cumsum(sizes)]).tolist(), strict=False))

    @property
    def unknowns(self) -> int:
        """How many numbers are unknown: of all variables together."""
        return sum(v.size for v in self.start.values())

    @property
    def conditions(self) -> int:
        """Scalar constraints, and so multipliers."""
        return sum(c.size for c in self.constraints)

    @property
    def x0(self) -> np.ndarray:
        """(unknowns,) the start value."""
        return self.pack(self.start)

    @cached_property
    def unit(self) -> np.ndarray:
        """(unknowns,) what counts as one, of each unknown: for lengths the extent of the start, 1 for pure numbers."""
        units = {name: np.ones(value.shape) for name, value in self.start.items()}
        for name, channels in self.lengths.items():
            values = self.start[name][:, channels]
            extent = float(np.ptp(values, axis=0).max(initial=0.0)) or float(np.abs(values).max(initial=0.0)) or 1.0
            units[name][:, channels] = extent
        return self.pack(units)

    @cached_property
    def whole_shift(self) -> np.ndarray:
        """(unknowns,) what was subtracted from each unknown."""
        none = {name: np.zeros(value.shape) for name, value in self.start.items()}
        return self.pack({name: value + self.shifts.get(name, 0.0) for name, value in none.items()})

    def normalised(self, x: np.ndarray) -> np.ndarray:
        """x (unknowns,) with its unit vectors, such as control quaternions, of length one."""
        if not self.directions:
            return x
        values = {name: value.copy() for name, value in self.unpack(x).items()}
        for name, channels in self.directions.items():
            values[name][:, channels] /= np.linalg.norm(values[name][:, channels], axis=1, keepdims=True)
        return self.pack(values)

    def pack(self, values: Mapping[str, np.ndarray]) -> np.ndarray:
        """(unknowns,) named arrays as one vector x."""
        return np.concatenate([np.asarray(values[name], dtype=float).ravel() for name in self.start])

    def unpack(self, x: np.ndarray) -> dict[str, np.ndarray]:
        """The vector x as named arrays (views)."""
        return {
            name: x[self.offsets[name] : self.offsets[name] + value.size].reshape(value.shape)
            for name, value in self.start.items()
        }

    def arrays(self, x: np.ndarray) -> dict[str, np.ndarray]:
        """`unpack`, and under `WHOLE` all of x as one column, a view too: what blocks read."""
        return {**self.unpack(x), WHOLE: x[:, None]}

    def place(self, variable: str) -> tuple[int, int]:
        """Where a variable begins in x, and its numbers per control."""
        return (0, 1) if variable == WHOLE else (self.offsets[variable], self.start[variable].shape[1])

    def split(self, multipliers: np.ndarray) -> dict[str, np.ndarray]:
        """The multiplier vector λ (conditions,) by constraint, each (E, C)."""
        parts, k = {}, 0
        for c in self.constraints:
            parts[c.name] = multipliers[k : k + c.size].reshape(c.lower.shape)
            k += c.size
        return parts

    def shown(self, multipliers: np.ndarray) -> dict[str, np.ndarray]:
        """The multiplier vector λ (conditions,) by constraint, each in the shape in which it is shown."""
        parts = self.split(multipliers)
        return {c.name: c.shaped(parts[c.name]) for c in self.constraints}

    @cached_property
    def lower(self) -> np.ndarray:
        """(conditions,) the lower sides, −∞ where there is none."""
        return np.concatenate([c.lower.ravel() for c in self.constraints]) if self.constraints else np.empty(0)

    @cached_property
    def upper(self) -> np.ndarray:
        """(conditions,) the upper sides, ∞ where there is none."""
        return np.concatenate([c.upper.ravel() for c in self.constraints]) if self.constraints else np.empty(0)

    @property
    def notes(self) -> tuple[str, ...]:
        """What there is to say of what the program was given: of keyframes that crowd, or that reflect each other."""
        return self.design.notes if isinstance(self.design, Noted) else ()

    @property
    def equalities_only(self) -> bool:
        """Whether it has no inequalities."""
        return all(c.is_equality for c in self.constraints)

    @property
    def linear(self) -> bool:
        """Whether all constraints are linear."""
        return all(c.block.kernel.linear for c in self.constraints)

    def constraint(self, name: str) -> Constraint:
        """The constraint of this name; InputError says which exist."""
        for c in self.constraints:
            if c.name == name:
                return c
        raise InputError(f"no constraint {name!r}; there are {', '.join(c.name for c in self.constraints) or 'none'}")

    def with_data(self, name: str, data: np.ndarray) -> "Program[DesignT]":
        """The same program with other data in one constraint; structure and compiled kernels are kept.

        Structure not where the data are factors of the unknowns: the Jacobian is kept there.
        """
        target = self.constraint(name)
        fresh = replace(target, block=target.block.with_data(data))
        structure = Structure() if self.linear and target.block.kernel.bilinear else self.structure
        constraints = tuple(fresh if c is target else c for c in self.constraints)
        return replace(self, constraints=constraints, structure=structure)

    def sharing(self, other: "Program") -> "Program[DesignT]":
        """This program on the structure of another one, with what was derived from it, where only data differ."""
        pairs = list(zip(self._blocks, other._blocks, strict=False))
        if len(self._blocks) != len(other._blocks) or not all(a.alike(b) for a, b in pairs):
            return self
        equal = (self.lower == self.upper).tolist() == (other.lower == other.upper).tolist()
        if not equal or {k: v.shape for k, v in self.start.items()} != {k: v.shape for k, v in other.start.items()}:
            return self
        for mine, theirs in pairs:
            mine.take(theirs)
        return replace(self, structure=other.structure)

    @property
    def _blocks(self) -> tuple[Block, ...]:
        return (*self.terms, *(c.block for c in self.constraints))

    @property
    def parameters(self) -> dict[str, np.ndarray]:
        """The numbers of the constraints' parameters by name, each in its shape."""
        found: dict[str, np.ndarray] = {}
        for c in self.constraints:
            for name, value in c.parameter_values.items():
                found.setdefault(name, value)
        return found

    def with_parameters(self, /, **values: ArrayLike) -> "Program[DesignT]":
        """The same program with other numbers for these parameters; structure and compiled kernels are kept."""
        known, program = self.parameters, self
        for name, value in values.items():
            if name not in known:
                raise InputError(f"no parameter {name!r}; there are {', '.join(known) or 'none'}")
            fresh = checks.numbers(value, f"parameter {name!r}")
            if fresh.shape != known[name].shape or not np.isfinite(fresh).all():
                raise InputError(
                    f"parameter {name!r} of shape {fresh.shape}: finite, {checks.shown(known[name].shape)}, is needed"
                )
            for c in self.constraints:
                for place in (p for p in c.parameters if p.name == name):
                    data = program.constraint(c.name).block.data.copy()
                    data[:, place.columns] = fresh.ravel(order="F")
                    program = program.with_data(c.name, data)
        return program

    def with_times(self, times: Mapping[str, ArrayLike]) -> "Program[DesignT]":
        """The same program with conditions that are meant for all times held at others; compiled kernels are kept.

        times: by constraint, (N,) or (N, s) of each of the motions that it couples.
        """
        changed = {}
        for name, where in times.items():
            c = self.constraint(name)
            if c.everywhere is None or c.times is None:
                raise InputError(f"{name}: a condition at given times stays there")
            there = checks.numbers(where, f"{name}: times")
            there = there if there.ndim == 2 else np.repeat(np.atleast_1d(there)[:, None], c.times.shape[1], axis=1)
            if there.shape[1:] != c.times.shape[1:] or not len(there):
                raise InputError(
                    f"{name}: times of shape {there.shape}: {checks.shown(('N', c.times.shape[1]))}, is needed"
                )
            if not np.array_equal(there, c.times):
                changed[name] = c.everywhere.at(there, c)
        if not changed:
            return self
        return replace(self, constraints=tuple(changed.get(c.name, c) for c in self.constraints), structure=Structure())

    def with_keyframes(self, keyframes: object) -> "Program[DesignT]":
        """The same program for other keyframes at the same times; structure and compiled kernels are kept.

        keyframes: in the form that the program's constructor takes.
        """
        if not isinstance(self.design, Rekeyed):
            raise InputError(f"{type(self.design).__name__} has no keyframes to change: make a new program")
        return self.design.with_keyframes(self, keyframes).with_parameters(**self.parameters)

    def stages(self, by: str) -> "list[Program[DesignT]]":
        """Smaller programs that lead to this one, coarsest first, by "degree" or "knots"."""
        if not isinstance(self.design, Staged):
            raise InputError(f"{type(self.design).__name__} has no stages by {by!r}: solve the program at once")
        return [stage.with_parameters(**self.parameters) for stage in self.design.stages(by)]

    def refined(self, x: np.ndarray) -> "Program[DesignT]":
        """The program with the Gauss nodes per span that ten digits of the objective need at x (unknowns,).

        Itself where they are right, or where all terms have nodes that are stated. The unknowns and the conditions are
        the same: `solver.solve(program.refined(solution.x), start=solution.x)` goes on from a solution.
        """
        x = checks.array(x, (self.unknowns,), "x")
        finer = self.design.refined(self, x) if isinstance(self.design, Integrated) else None
        return self if finer is None else finer

    # Any: symbols or arrays, by the key.
    def nlp(self) -> dict[str, Any]:
        """The plain CasADi problem, for whoever brings a solver of their own.

        Keys: x, p, f, g (MX), x0, p0, lbg, ubg (arrays); p are the parameters of the constraints, one after the
        other, column by column. `nlpsol(name, plugin, {k: nlp[k] for k in "xpfg"})(x0=…, p=nlp["p0"], lbg=…, ubg=…)`.
        """
        x = ca.MX.sym("x", self.unknowns)
        values = {name: value.ravel(order="F") for name, value in self.parameters.items()}
        p = ca.MX.sym("p", sum(v.size for v in values.values()))
        ends = np.cumsum([0, *(v.size for v in values.values())])
        parameters = {name: p[int(a) : int(b)] for name, a, b in zip(values, ends[:-1], ends[1:], strict=True)}
        f = sum((self._symbolic(b, x, None, {}) for b in self.terms), ca.MX(0))
        g = [self._symbolic(c.block, x, c, parameters) for c in self.constraints]
        return {
            "x": x,
            "p": p,
            "f": f,
            "g": ca.vertcat(*g) if g else ca.MX(0, 1),
            "x0": self.x0,
            "p0": np.concatenate([*values.values(), np.empty(0)]),
            "lbg": self.lower,
            "ubg": self.upper,
        }

    def _symbolic(self, block: Block, x: ca.MX, constraint: Constraint | None, parameters: dict[str, ca.MX]) -> ca.MX:
        begin, stride = self.place(block.variable)
        count = self.unknowns if block.variable == WHOLE else len(self.start[block.variable])
        controls = ca.reshape(x[begin : begin + count * stride], stride, count)[block.channels, :]
        z = ca.reshape(controls @ ca.DM(sparse.csc_matrix(block.operator)).T, -1, block.count)
        function = block.kernel.function("value" if constraint is None else "out").map(block.count)
        mu = ca.DM.ones(block.kernel.out.numel() if constraint is None else function.size1_in(2), block.count)
        data: ca.DM | ca.MX = ca.DM(block.data.T)
        for place in constraint.parameters if constraint else ():
            rows = [data[: place.columns.start, :], ca.repmat(parameters[place.name], 1, block.count)]
            data = ca.vertcat(*rows, data[place.columns.stop :, :])
        result = function(z, data, mu)
        return ca.dot(ca.DM(block.weights), result.T) if constraint is None else ca.vec(result)

    def __str__(self) -> str:
        lines = [f"Program: {self.unknowns} unknowns, {self.conditions} conditions"]
        lines += [f"  unknown     {name}: {v.shape[0]} × {v.shape[1]}" for name, v in self.start.items()]
        lines += [f"  term        {b.nature}" for b in self.terms]
        lines += [f"  constraint  {c.nature}" for c in self.constraints]
        lines += [f"  parameter   {name}: {np.array2string(v, precision=6)}" for name, v in self.parameters.items()]
        lines += [f"  note        {note}" for note in self.notes]
        return "\n".join(lines)

    __repr__ = __str__


def require_program(value: object) -> Program:
    """The value; InputError unless it is a program."""
    if not isinstance(value, Program):
        raise InputError(f"program of type {type(value).__name__}: what affine_program and its like return is needed")
    return value
