"""Constraints: what must hold of a motion, said in its jet, at times or everywhere along it."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from keyword import iskeyword
from types import SimpleNamespace
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike

from symmotion import checks
from symmotion.brief import in_a_line
from symmotion.constraints.along import Along
from symmotion.constraints.setting import DENSEST, Setting, placed
from symmotion.errors import InputError
from symmotion.jets import AnyJet, Written
from symmotion.jets.enclosed import values as values_of
from symmotion.jets.jet import as_expression, of_jets, require_closed, said
from symmotion.jets.linear import LinearSpace
from symmotion.jets.nets import NetSpace
from symmotion.jets.seen import Seen
from symmotion.jets.space import JetSpace, block_of
from symmotion.jets.written import positional, same_text, tuples_of_jets
from symmotion.program import Constraint, Excess, ParameterPlace, excess_at
from symmotion.program.state import made_of
from symmotion.splines.instants import unified
from symmotion.values import adopt, read_only, restore, same, same_fields, settle

DENSITY = 8  # times in each span at which what has to hold everywhere is held


class MotionConstraint(ABC):
    """A condition on a motion. A subclass states it as a `JetConstraint` once it knows the program it joins.

    It is a dataclass with a `name`; arrays in its fields are copied, and refuse writes.

    Raises InputError where `stated` returns something else.

    >>> class Above(sm.constraints.MotionConstraint):
    ...     name = "above"
    ...
    ...     def stated(self, setting):
    ...         return sm.JetConstraint(lambda jet: jet.v[-1], lower=-5.0, upper=np.inf, name=self.name)
    >>> sm.excess(sm.interpolants.component_cubic(sm.examples.planar_keyframes()), Above()).value
    0.0
    """

    name: str

    def __init_subclass__(cls, **options: object):
        super().__init_subclass__(**options)
        adopt(cls, settle)

    def __post_init__(self):
        settle(self)

    __repr__ = in_a_line

    def named(self, name: str) -> "MotionConstraint":
        """The same condition under another name."""
        return replace(self, name=name)  # pyright: ignore[reportArgumentType] every subclass is a dataclass

    def frees(self, setting: Setting) -> tuple[set[int], set[int]]:
        """The keyframes whose linear part or turn, and whose translation, are no longer interpolated."""
        return set(), set()

    def follows(self, setting: Setting) -> tuple[np.ndarray, slice] | None:
        """The numbers (N,) of the keyframes whose coordinates `part` are its data at its times; None where none are."""
        return None

    @abstractmethod
    def stated(self, setting: Setting) -> "JetConstraint":
        """The condition in full: expression, times, bounds."""

    def build(self, setting: Setting) -> Constraint:
        """The condition as part of a program; its multipliers are (N, C), a row for each time."""
        setting = self.seen_from(setting)
        stated = said(self.name, "stated", "this program", lambda: self.stated(setting))
        if not isinstance(stated, JetConstraint):
            raise InputError(f"{self.name}: stated returns a {type(stated).__name__}: a JetConstraint is needed")
        return replace(stated.named(self.name).build(setting), shape=None)

    def seen_from(self, setting: Setting) -> Setting:
        """The setting that it is stated and built in."""
        return setting

    def freed(self, setting: Setting) -> tuple[set[int], set[int]]:
        """What it `frees`, numbers of keyframes that there are."""
        what = f"{self.name}: frees"

        def numbered() -> tuple[set[int], set[int]]:
            linear, translation = self.frees(setting)
            return {setting.keyframe(i, what) for i in linear}, {setting.keyframe(i, what) for i in translation}

        return said(self.name, "frees", "this program", numbered)

    def __eq__(self, other: object) -> bool:
        return same_fields(self, other)

    __hash__ = None  # pyright: ignore[reportAssignmentType] - arrays inside: nothing hashes a constraint
    __setstate__ = restore


@dataclass(frozen=True, eq=False)
class JetConstraint(MotionConstraint):
    """lower ≤ function(jet) ≤ upper, an equality where both are the same (spec of multipliers: L = f + λᵀg).

    function: from a jet of the motion (`Jet`, `RigidJet`, `CurveJet`) to a CasADi expression, a scalar, column or
        matrix; of as many jets as the times it couples, or as the bodies it couples.
    lower, upper: numbers, or arrays that broadcast to (N, …), the expression at each of N times; infinite: no bound.
    at: a time, or times (N,); a list of N tuples of times for a function of as many jets; None: everywhere along
        the motion. A program holds it at `density` times inside every span, or at `first` (N,), to begin with, and
        what solves it puts those times where it presses (`solvers.exchange`); an equality stays at them.
    power: of a bound, that the function is this power of the quantity that is named (2 of a speed whose square is
        bounded by the square of its limit): by how far it is exceeded is told of the quantity.
    parameters: numbers by name, handed to the function as its last argument (`p.v`, in the shape given), to be
        changed by `program.with_parameters`; the same name in two constraints is one parameter.
    data: (N, D) numbers of each time, handed to the function as a column behind the jets.

    The multipliers have the shape of the expression, behind the axis of the times where `at` is no single time: the
    optimum changes by −λ with the bound that is active.

        JetConstraint(lambda jet: jet.place([0.1, 0.0, 0.0])[2], upper=np.inf, name="floor")

    Raises InputError that names the constraint where the function, its bounds, times or parameters are at fault.

    >>> keys = sm.examples.spatial_keyframes()
    >>> objective = sm.Rigidity() + 0.01 * sm.TrajectoryEnergy(np.eye(3))
    >>> rest = sm.JetConstraint(lambda jet: jet.dv, at=0.0, name="at rest")
    >>> solution = sm.ExactNewton().solve(sm.affine_program(keys, objective=objective, constraints=[rest])).require()
    >>> solution.multipliers["at rest"].shape
    (3,)
    """

    function: Callable[..., Any]  # a function of the user's own: CasADi expressions, or what converts to one
    lower: ArrayLike = field(default=0.0, kw_only=True)
    upper: ArrayLike = field(default=0.0, kw_only=True)
    at: ArrayLike | Sequence[tuple[float, ...]] | None = field(default=None, kw_only=True)
    name: str = field(default="constraint", kw_only=True)
    parameters: Mapping[str, ArrayLike] | None = field(default=None, kw_only=True)
    density: int = field(default=DENSITY, kw_only=True)
    data: ArrayLike | None = field(default=None, kw_only=True)
    first: ArrayLike | None = field(default=None, kw_only=True)
    power: int = field(default=1, kw_only=True)

    def __init_subclass__(cls, **options: object):
        super().__init_subclass__(**options)
        adopt(cls, JetConstraint.__post_init__)

    def __post_init__(self):
        checks.whole(self.power, 1, f"{self.name}: power")
        if not callable(self.function):
            raise InputError(f"{self.name}: function {self.function!r}: a function of a jet is needed")
        checks.text(self.name, "name of a constraint")
        checks.whole(self.density, 1, f"{self.name}: density", most=DENSEST)
        low, high = (checks.numbers(b, f"{self.name}: {w}") for b, w in ((self.lower, "lower"), (self.upper, "upper")))
        if np.isnan(low).any() or np.isnan(high).any():
            raise InputError(f"{self.name}: a bound is not a number")
        try:
            crossed = (low > high).any()
        except ValueError:
            raise InputError(f"{self.name}: bounds of shapes {low.shape} and {high.shape}") from None
        if crossed:
            raise InputError(f"{self.name}: the lower bound is above the upper one")
        if not (np.isfinite(low).any() or np.isfinite(high).any()):
            raise InputError(f"{self.name}: both bounds are infinite: nothing is asked")
        require_possible(low, high, self.name)
        if self.parameters is not None:
            if not isinstance(self.parameters, Mapping):
                given = checks.told(self.parameters)
                raise InputError(f"{self.name}: parameters {given}: a mapping of names to numbers is needed")
            for key in self.parameters:
                if not isinstance(key, str) or not key.isidentifier() or iskeyword(key):
                    raise InputError(f"{self.name}: parameter {key!r}: a name as of a variable of Python is needed")
            values = {k: checks.numbers(v, f"{self.name}: parameter {k!r}") for k, v in self.parameters.items()}
            for key, value in values.items():
                if value.ndim > 2 or not value.size or not np.isfinite(value).all():
                    raise InputError(f"{self.name}: parameter {key!r}: finite numbers are needed")
            object.__setattr__(self, "parameters", {k: read_only(v) for k, v in values.items()})
        object.__setattr__(self, "lower", read_only(low))
        object.__setattr__(self, "upper", read_only(high))
        if self.at is not None:
            object.__setattr__(self, "at", read_only(self._times()))
        if self.first is not None:
            object.__setattr__(self, "first", read_only(checks.times(self.first, f"{self.name}: first")))
        if self.data is not None:
            object.__setattr__(self, "data", read_only(checks.array(self.data, ("N", "D"), f"{self.name}: data")))

    def _times(self) -> np.ndarray:
        times = checks.numbers(self.at, f"{self.name}: at")
        if times.ndim > 2 or not times.size or not np.isfinite(times).all():
            raise InputError(f"{self.name}: at of shape {times.shape}: finite times, or tuples of times, are needed")
        return times

    def __copy__(self) -> "JetConstraint":
        return self

    def __deepcopy__(self, memo: object) -> "JetConstraint":
        return self

    def __getstate__(self) -> dict[str, object]:
        # A lambda does not pickle, the expressions that it makes do.
        return {**made_of(self), "function": self._written()}

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, JetConstraint) or not same_fields(self, other, but="function"):
            return False
        return same(self.function, other.function) or same_text(self._written, other._written)

    __hash__ = None  # pyright: ignore[reportAssignmentType] - as of every constraint

    def written_for(self, *jets: AnyJet) -> "JetConstraint":
        """The same condition, which pickles: its function as text for these jets, one of each body."""
        return replace(self, function=self._written([jets]))

    def _written(self, arguments: Iterable[Sequence[AnyJet]] | None = None) -> Written:
        """The function as text, for jets of the kinds of `arguments`, when left out of every kind that it may take."""
        if isinstance(self.function, Written):
            return self.function
        data, numbers = self._symbols()
        count, behind = len(data), len(data) + bool(numbers)
        jets = positional(self.function, self.slots + behind) - behind
        every = tuples_of_jets(jets) if arguments is None else arguments

        def write() -> Written:
            return Written.of(self.function, every, [*data, *numbers], lambda s: self._handed(s[:count], s[count:]))

        return said(self.name, "the function", "jets of every kind", write)

    def _symbols(self) -> tuple[list[ca.SX], list[ca.SX]]:
        """Symbols for the data of a time, where there are any, and for the numbers of each parameter."""
        data = [] if self.data is None else [ca.SX.sym("data", np.shape(self.data)[1])]
        return data, [ca.SX.sym(name, np.size(value)) for name, value in (self.parameters or {}).items()]

    @property
    def slots(self) -> int:
        """How many jets the function takes, as far as its times tell."""
        return self.at.shape[1] if isinstance(self.at, np.ndarray) and self.at.ndim == 2 else 1

    def put_on(self, marks: np.ndarray) -> "JetConstraint":
        """The same constraint, its times put on marks (K,) that they agree with up to rounding."""
        return self if self.at is None else replace(self, at=unified(np.asarray(self.at), marks))

    def orders(self, space: LinearSpace) -> list[tuple[int, ...]]:
        """The derivative orders that the function reads of each of its jets, in a space of curves."""
        out = self._expression([space.symbols(k) for k in range(self.slots)], *self._symbols())
        return [space.orders(out, k)[0] for k in range(self.slots)]

    def _handed(self, data: Sequence[ca.SX], numbers: Sequence[ca.SX]) -> list[object]:
        """What the function is handed behind the jets: the data, then the parameters by name."""
        if isinstance(self.function, Written):
            return [*data, *numbers]
        shapes = {k: np.shape(v) for k, v in (self.parameters or {}).items()}
        return [*data, *([_named(shapes, numbers)] if shapes else [])]

    def stated(self, setting: Setting) -> "JetConstraint":
        return self

    def build(self, setting: Setting) -> Constraint:
        spaces, times, lead = self._spread(setting)
        built = self._built(setting, spaces, times, lead)
        return replace(built, everywhere=Along(self, setting)) if self._is_everywhere(built) else built

    def _is_everywhere(self, built: Constraint) -> bool:
        """Whether it is meant for all times, and says the same at each of them."""
        return self.at is None and self.data is None and _alike(built.lower) and _alike(built.upper)

    def held(self, setting: Setting, times: np.ndarray) -> Constraint:
        """As part of a program, at times (N, s) of each jet in place of its own."""
        spaces = list(setting.spaces) if len(setting.spaces) > 1 else [setting.space] * times.shape[1]
        return self._built(setting, spaces, times, times.shape[:1])

    def said_of(self, jets: Sequence[AnyJet], values: Mapping[str, np.ndarray]) -> ca.SX:
        """(C, 1) the expression for jets of symbols, with numbers in place of its parameters."""
        numbers = [ca.SX(np.ravel(values[k], order="F")) for k in self.parameters or {}]
        return self._expression(jets, [], numbers)

    def excess_at(self, motions: Sequence[Seen]) -> Excess:
        """By how far motions exceed it at its times."""
        times = np.atleast_1d(np.asarray(self.first if self.at is None else self.at, dtype=float))
        if times.ndim < 2:
            times = np.repeat(times[:, None], len(motions), axis=1)
        every = list(motions) * times.shape[1] if len(motions) == 1 else list(motions)
        if len(every) != times.shape[1]:
            raise InputError(f"{self.name}: tuples of {times.shape[1]} times for {len(motions)} bodies")
        table = np.empty((len(times), 0)) if self.data is None else np.asarray(self.data)
        data, values = self._symbols()[0], self.parameters or {}
        jets = [motion.symbols(slot) for slot, motion in enumerate(every)]
        out = self._expression(jets, data, [ca.SX(np.ravel(v, order="F")) for v in values.values()])
        entries, needed = ca.vertcat(*(jet.entries for jet in jets), *data), range(jets[0].entries.numel())
        columns = [
            motion.numbers(placed(column, motion.domain, np.empty(0), self.name), needed)
            for motion, column in zip(every, times.T, strict=True)
        ]
        found = values_of(entries, ca.vec(out))(np.concatenate([*columns, table], axis=1))
        shape, lead = _shown_shape(out), times.shape[:1] if self.at is None else np.asarray(self.at).shape[:1]
        low, high = (self._bound(b, len(times), shape, lead) for b in (self.lower, self.upper))
        return excess_at(found, low, high, times, self.power)

    def bounds_for(self, out: ca.SX) -> tuple[np.ndarray, np.ndarray]:
        """(C,) the bounds of the components of its expression, column by column, the same at all times."""
        shape = _shown_shape(out)
        low, high = (self._bound(b, 1, shape, ())[0] for b in (self.lower, self.upper))
        return low, high

    def _built(
        self, setting: Setting, spaces: Sequence[JetSpace], times: np.ndarray, lead: tuple[int, ...]
    ) -> Constraint:
        count, values = len(times), self.parameters or {}
        table = np.empty((count, 0)) if self.data is None else np.asarray(self.data)
        if len(table) != count:
            raise InputError(f"{self.name}: data of {len(table)} rows for {count} times: one of each is needed")
        data, symbols = self._symbols()
        plain = [space.symbols(slot) for slot, space in enumerate(spaces)]
        require_closed(self.name, self._expression(plain, data, symbols), plain, [*data, *symbols])
        out = self._expression([space.jet(slot) for slot, space in enumerate(spaces)], data, symbols)
        numbers = np.concatenate([np.ravel(v, order="F") for v in values.values()] + [np.empty(0)])
        block = block_of(
            self.name,
            ca.vec(out),
            spaces,
            times,
            data=ca.vertcat(*data, *symbols),
            numbers=np.concatenate([table, np.broadcast_to(numbers, (count, numbers.size))], axis=1),
            places=setting.places,
        )
        first, places = block.data.shape[1] - numbers.size, []
        for key, value in values.items():
            places.append(ParameterPlace(key, first, np.shape(value)))
            first += np.size(value)
        shape = _shown_shape(out)
        low, high = (self._bound(b, count, shape, lead) for b in (self.lower, self.upper))
        return Constraint(
            block,
            low,
            high,
            (*lead, *shape),
            len(shape) == 2,
            tuple(places),
            times if times.ndim == 2 else None,
            power=self.power,
        )

    def _spread(self, setting: Setting) -> tuple[list[JetSpace], np.ndarray, tuple[int, ...]]:
        """The spaces of the jets, the times (N, s) of each, and the leading axes of the multipliers."""
        several = len(setting.spaces) > 1
        if isinstance(setting.space, NetSpace):
            return self._of_net(setting.space)
        if self.at is None:
            times = setting.inside_spans(self.density, self.name) if self.first is None else np.asarray(self.first)
            lead: tuple[int, ...] = (len(times),)
        else:
            times = np.asarray(self.at)
            lead = times.shape[:1]
        if several:
            if times.ndim < 2:
                times = np.repeat(np.atleast_1d(times)[:, None], len(setting.spaces), axis=1)
            if times.shape[1] != len(setting.spaces):
                raise InputError(f"{self.name}: tuples of {times.shape[1]} times for {len(setting.spaces)} bodies")
            spaces = list(setting.spaces)
        else:
            times = np.atleast_1d(times)
            times = times[:, None] if times.ndim < 2 else times
            spaces = [setting.space] * times.shape[1]
        # A knot is met from the right, which a time that rounding has put before it would not be.
        columns = zip(spaces, times.T, strict=True)
        inside = [placed(column, space.domain, space.breakpoints, self.name) for space, column in columns]
        return spaces, np.stack(inside, axis=1), lead

    def _of_net(self, space: NetSpace) -> tuple[list[JetSpace], np.ndarray, tuple[int, ...]]:
        """As `_spread`, at the parameters (u, v) of a net, or of a curve."""
        if self.at is None:
            raise InputError(f"{self.name}: at, parameters (u, v), is needed on a net")
        pairs = np.asarray(self.at)
        if len(space.bases) == 1:
            lead, pairs = pairs.shape[:1], np.atleast_1d(pairs).reshape(-1, 1)
        else:
            lead, pairs = pairs.shape[:-1] if pairs.ndim > 1 else (), np.atleast_2d(pairs)
        return [space], space.placed(pairs, self.name)[:, None, :], lead

    def _expression(self, jets: Sequence[AnyJet], data: Sequence[ca.SX], numbers: Sequence[ca.SX]) -> ca.SX:
        handed = self._handed(data, numbers)
        out = said(self.name, "the function", of_jets(jets), lambda: self.function(*jets, *handed))
        return ca.densify(as_expression(f"{self.name}: the function", out))

    def _bound(self, bound: ArrayLike, count: int, shape: tuple[int, ...], lead: tuple[int, ...]) -> np.ndarray:
        """(N, C) a bound for each time and component, column by column."""
        given = np.asarray(bound, dtype=float)
        if not shape and given.shape[-1:] == (1,) and given.ndim > len(lead):
            given = given[..., 0]
        try:
            whole = np.broadcast_to(given, (count, *shape) if lead or given.ndim > len(shape) else shape)
        except ValueError:
            wanted = checks.shown((*lead, *shape))
            raise InputError(f"{self.name}: a bound of shape {given.shape} for values of shape {wanted}") from None
        whole = np.broadcast_to(whole, (count, *shape))
        if len(shape) == 2:
            whole = np.swapaxes(whole, 1, 2)
        return np.ascontiguousarray(whole.reshape(count, -1))


def _alike(rows: np.ndarray) -> bool:
    """Whether all rows are the same."""
    return bool((rows == rows[:1]).all())


def _shown_shape(out: ca.SX) -> tuple[int, ...]:
    """The shape of an expression as users meet it: () for a scalar, (n,) for a column, (n, m) for a matrix."""
    return out.shape if out.shape[1] > 1 else out.shape[:1] if out.numel() > 1 else ()


def _named(shapes: Mapping[str, tuple[int, ...]], symbols: Sequence[ca.SX]) -> SimpleNamespace:
    """Parameters by name, in the shapes given: columns for vectors."""
    shaped = {}
    for (name, shape), column in zip(shapes.items(), symbols, strict=True):
        shaped[name] = ca.reshape(column, *shape) if len(shape) == 2 else column
    return SimpleNamespace(**shaped)


def require_possible(low: np.ndarray, high: np.ndarray, name: str) -> None:
    """InputError that names the first component with a lower bound of ∞ or an upper one of −∞."""
    for what, bound, never in (("lower", low, np.inf), ("upper", high, -np.inf)):
        if (bound == never).any():
            where = np.argwhere(bound == never)[0].tolist()
            raise InputError(f"{name}: {what}{where or ''} is {never}: nothing satisfies it; no bound is {-never}")
