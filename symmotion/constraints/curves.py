"""What a motion curve can be asked to do at given times: values, derivatives, tolerances, bounds, links."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike
from scipy import sparse

from symmotion import checks
from symmotion.brief import between, instant, instants
from symmotion.constraints.constraint import JetConstraint, MotionConstraint, require_possible
from symmotion.constraints.setting import Setting
from symmotion.errors import InputError
from symmotion.jets import CurveJet
from symmotion.jets.linear import LinearSpace, sided
from symmotion.kernels import Kernel
from symmotion.program import Block, Constraint
from symmotion.splines import BSplineBasis, unified

NAMES = ("values", "slopes", "accelerations")
SIDES = {"left": -1, "right": 1}


@dataclass(frozen=True, eq=False)
class CurveCondition(MotionConstraint):
    """Rows lower ≤ Σ_s c_s x⁽ᵒ⁾(t_s) − target ≤ upper on a curve x, each a named condition with its multipliers.

    Made by `at`, `between`, `norm_below`, `closed` and `linked`.

    times, orders, coefficients: (N, s) what each row samples; sides: (N, s), −1 or 1, from which side.
    target, lower, upper: (N, …), in the shape of the curve's values or (N,) for the same in all
    coordinates. norm: the row is Σ of the squares of all coordinates instead of each of them.

    name: of its multipliers. Raises InputError for times, values and orders that do not fit.

    >>> at = sm.constraints.CurveCondition.at([0.0, 1.0, 2.0], [0.0, 1.0, 0.0], name="values")
    >>> slope = sm.constraints.CurveCondition.at([0.0], [0.0], order=1, name="slope")
    >>> solution = sm.ExactNewton().solve(sm.curve_program([at, slope])).require()
    >>> sorted(solution.multipliers)
    ['slope', 'values']
    """

    name: str
    times: np.ndarray
    orders: np.ndarray
    coefficients: np.ndarray
    sides: np.ndarray
    target: np.ndarray
    lower: np.ndarray
    upper: np.ndarray
    norm: bool = False

    def __post_init__(self):
        super().__post_init__()
        checks.text(self.name, "name of a condition")
        require_possible(self.lower, self.upper, self.name)

    @staticmethod
    def at(
        times: ArrayLike,
        values: ArrayLike,
        *,
        order: int = 0,
        tolerance: float = 0.0,
        side: str = "right",
        name: str | None = None,
    ) -> "CurveCondition":
        """x⁽ᵒ⁾(t_i) = values_i: values for order 0, slopes for 1, accelerations for 2, …

        times: (N,), different; values: (N, …). tolerance: ≥ 0, how far each coordinate may be off.
        side: "left" or "right", where the derivative jumps. name: "values", "slopes", … when left out.
        """
        name = _name(order) if name is None else name
        times = _times(times, name)
        target = _rows(values, times, f"{name}: values", exact=True)
        width = np.full(len(times), checks.not_negative(tolerance, f"{name}: tolerance"))
        return _single(name, times, order, side, target, -width, width)

    @staticmethod
    def between(
        times: ArrayLike, lower: ArrayLike, upper: ArrayLike, *, order: int = 0, name: str | None = None
    ) -> "CurveCondition":
        """lower_i ≤ x⁽ᵒ⁾(t_i) ≤ upper_i, coordinate by coordinate.

        times: (N,), different; lower, upper: one number, (N,) or (N, …), infinite where there is no bound.
        """
        name = f"bounds on {_name(order)}" if name is None else name
        times = _times(times, name)
        low, high = (_rows(b, times, f"{name}: {w}", finite=False) for b, w in ((lower, "lower"), (upper, "upper")))
        low, high = _alike(low, high, name)
        crossed = (low > high).reshape(len(times), -1).any(axis=1)
        if crossed.any():
            raise InputError(
                f"{name}: the lower bound at time {instant(times[np.argmax(crossed)])} is above the upper one"
            )
        return _single(name, times, order, "right", np.zeros(len(times)), low, high)

    @staticmethod
    def norm_below(times: ArrayLike, limit: ArrayLike, *, order: int = 1, name: str = "speed") -> "CurveCondition":
        """‖x⁽ᵒ⁾(t_i)‖² ≤ limit_i², one multiplier per time; order 1 bounds the speed.

        times: (N,), different; limit: one number or (N,), positive. f* changes by −λ per unit of limit².
        """
        times = _times(times, name)
        limits = _rows(limit, times, f"{name}: limit")
        if limits.ndim > 1 or (limits <= 0).any():
            raise InputError(f"{name}: limit: one positive number, or one per time, is needed")
        zeros = np.zeros(len(times))
        single = _single(name, times, order, "right", zeros, np.full(len(times), -np.inf), limits**2)
        return CurveCondition(**{**vars(single), "norm": True})

    @staticmethod
    def closed(start: float, end: float, orders: Sequence[int] = (0, 1), *, name: str = "periodic") -> "CurveCondition":
        """x⁽ᵒ⁾(end) = x⁽ᵒ⁾(start) for each order, one multiplier each.

        The orders below that of the objective make a curve of least ∫ ‖x⁽ᵏ⁾‖² periodic in those above too.
        """
        ends = _times([checks.number(start, f"{name}: start"), checks.number(end, f"{name}: end")], name)
        if ends[0] > ends[1]:
            first, last = instants(*ends)
            raise InputError(f"{name}: the start {first} comes after the end {last}")
        if isinstance(orders, str) or not isinstance(orders, Iterable):
            raise InputError(f"{name}: orders {checks.told(orders)}: a list of derivative orders is needed")
        checked = np.array([_order(o, name) for o in orders])
        if not checked.size or np.unique(checked).size < checked.size:
            raise InputError(f"{name}: orders {tuple(checked.tolist())}: at least one, each once, is needed")
        count, zeros = len(checked), np.zeros(len(checked))
        rows = (count, 2)
        return CurveCondition(
            name,
            np.broadcast_to(ends, rows),
            np.stack([checked, checked], axis=1),
            np.broadcast_to([-1.0, 1.0], rows),
            np.broadcast_to([1, -1], rows),
            zeros,
            zeros,
            zeros,
        )

    @staticmethod
    def linked(times: ArrayLike, factor: ArrayLike, *, order: int = 1, name: str = "rebound") -> "CurveCondition":
        """x⁽ᵒ⁾(t_i+) = factor_i x⁽ᵒ⁾(t_i−): what comes after a break follows from what comes before.

        times: (N,) of breaks; factor: one number or (N,): minus the coefficient of restitution for a bounce.
        """
        times = _times(times, name)
        factors = _rows(factor, times, f"{name}: factor")
        if factors.ndim > 1:
            raise InputError(f"{name}: factor of shape {factors.shape}: one number, or one per time, is needed")
        rows, zeros = (len(times), 2), np.zeros(len(times))
        return CurveCondition(
            name,
            np.stack([times, times], axis=1),
            np.full(rows, _order(order, name)),
            np.stack([-factors, np.ones_like(factors)], axis=1),
            np.broadcast_to([-1, 1], rows),
            zeros,
            zeros,
            zeros,
        )

    def __repr__(self) -> str:
        what = f"{'values' if self.is_equality else 'bounds'} at {self.count} times"
        return f"CurveCondition({self.name!r}, {what}, {between(self.times.min(), self.times.max())})"

    @property
    def is_equality(self) -> bool:
        """Whether all its rows are equalities."""
        return bool((self.lower == self.upper).all())

    @property
    def count(self) -> int:
        """How many rows it has, each a condition on the whole value of the curve."""
        return len(self.times)

    @property
    def value_shape(self) -> tuple[int, ...]:
        """The shape of the curve's values as far as this condition tells."""
        return max((a.shape[1:] for a in (self.target, self.lower, self.upper)), key=len)

    def put_on(self, marks: np.ndarray) -> "CurveCondition":
        """The same condition, its times put on marks (K,) that they agree with up to rounding."""
        return replace(self, times=unified(self.times, marks))

    @property
    def places(self) -> bool:
        """Whether it gives the curve's own values."""
        return self.is_equality and not self.norm and self.times.shape[1] == 1 and not self.orders.any()

    @property
    def samples(self) -> list[tuple[float, int, int]]:
        """Time, order and side of each row of a condition that samples the curve once."""
        return list(zip(self.times[:, 0].tolist(), self.orders[:, 0].tolist(), self.sides[:, 0].tolist(), strict=True))

    def stated(self, setting: Setting) -> JetConstraint:
        raise InputError(f"{self.name}: a condition on a curve, in a program of another kind of motion")

    def build(self, setting: Setting) -> Constraint:
        space = setting.space
        jet = space.symbols()
        if not isinstance(space, LinearSpace) or not isinstance(jet, CurveJet):
            return super().build(setting)
        shape = jet.x.shape if jet.x.shape[1] > 1 else jet.x.shape[:1]
        return self.on(space, shape, np.arange(self.count))

    def on(self, space: LinearSpace, shape: tuple[int, ...], kept: np.ndarray) -> Constraint:
        """The rows `kept` of the condition on the curves of a space, with values of a shape."""
        channels = space.channels
        z, target = ca.SX.sym("z", channels), ca.SX.sym("target", channels)
        rows, data = self.rows(space.basis), self.spread(self.target, shape)
        shifted = space.shift is not None
        if space.shift is not None:
            # The rows see of the shift what they make of a constant curve.
            data = data - np.outer(rows.sum(axis=1), space.shift)
        out = z - target
        if self.norm:
            out = ca.sumsqr(out) if shifted else ca.sumsqr(z)
        rows, data = rows[kept], data[kept]
        whole = slice(0, channels)
        kernel = Kernel(z, target, out, channels)
        block = Block(self.name, kernel, space.variable, whole, rows, 1, np.ones(len(kept)), data)
        shape = () if self.norm else shape
        bounds = self.spread(self.lower, shape)[kept], self.spread(self.upper, shape)[kept]
        return Constraint(block, *bounds, times=self.times[kept], power=2 if self.norm else 1)

    def rows(self, basis: BSplineBasis) -> sparse.csr_array:
        """(N, n) the condition's rows on the controls of a basis."""
        total = sparse.csr_array((self.count, basis.n))
        for s in range(self.times.shape[1]):
            for order, side in set(zip(self.orders[:, s].tolist(), self.sides[:, s].tolist(), strict=True)):
                i = np.flatnonzero((self.orders[:, s] == order) & (self.sides[:, s] == side))
                place = (self.coefficients[i, s], (i, np.arange(i.size)))
                spread = sparse.csr_array(place, shape=(self.count, i.size))
                total = total + spread @ sided(basis, self.times[i, s], order, side)
        total = sparse.csr_array(total)
        total.eliminate_zeros()
        return total

    def spread(self, array: np.ndarray, shape: tuple[int, ...]) -> np.ndarray:
        """(N, D) one of the condition's arrays for values of a shape of D coordinates."""
        if array.ndim == 1:
            array = array.reshape(-1, *(1,) * len(shape))
        if array.shape[1:] != shape and any(s != 1 for s in array.shape[1:]):
            raise InputError(f"{self.name}: values of shape {array.shape[1:]} on a curve of values of shape {shape}")
        return np.broadcast_to(array, (self.count, *shape)).reshape(self.count, -1).astype(float)


def _single(name, times, order, side, target, lower, upper) -> CurveCondition:
    """A condition whose rows sample the curve once."""
    checks.choice(side, SIDES, f"{name}: side")
    one = np.ones((len(times), 1))
    orders = np.full((len(times), 1), _order(order, name))
    return CurveCondition(
        name, times[:, None], orders, one, np.full((len(times), 1), SIDES[side]), target, lower, upper
    )


def _order(order: int, name: str) -> int:
    return checks.whole(order, 0, f"{name}: derivative order")


def _name(order: int) -> str:
    order = checks.whole(order, 0, "derivative order")
    return NAMES[order] if order < len(NAMES) else f"derivatives {order}"


def _times(times: ArrayLike, name: str) -> np.ndarray:
    array = np.atleast_1d(checks.numbers(times, f"{name}: times"))
    if array.ndim != 1 or not array.size or not np.isfinite(array).all():
        raise InputError(f"{name}: times of shape {array.shape}: finite, (N,), N ≥ 1, is needed")
    values, counts = np.unique(unified(array), return_counts=True)
    if (counts > 1).any():
        raise InputError(f"{name}: time {instant(values[np.argmax(counts > 1)])} is given twice")
    return array


def _rows(values: ArrayLike, times: np.ndarray, what: str, finite: bool = True, exact: bool = False) -> np.ndarray:
    """(N, …) one row per time; a single number serves for all, unless `exact` and there are several times."""
    array = checks.numbers(values, what)
    if not array.ndim and not (exact and len(times) > 1):
        array = np.full(len(times), float(array))
    if not array.ndim or len(array) != len(times):
        raise InputError(f"{what} of shape {array.shape} for {len(times)} times: one row per time is needed")
    if np.isnan(array).any() or (finite and not np.isfinite(array).all()):
        raise InputError(f"{what}: row {int(np.argwhere(~np.isfinite(array))[0][0])} is not finite")
    return array


def _alike(a: np.ndarray, b: np.ndarray, name: str) -> tuple[np.ndarray, np.ndarray]:
    """Both arrays with the trailing axes of the one that has more."""
    axes = max(a.ndim, b.ndim)
    try:
        low, high = np.broadcast_arrays(*(x.reshape(x.shape + (1,) * (axes - x.ndim)) for x in (a, b)))
    except ValueError:
        raise InputError(f"{name}: bounds of shapes {a.shape} and {b.shape}") from None
    return low, high
