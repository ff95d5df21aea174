"""Motion curves of least ∫ ‖x⁽ᵏ⁾‖² under conditions at given times, as programs."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from time import perf_counter

import numpy as np
from numpy.typing import ArrayLike

from symmotion import checks
from symmotion.brief import in_a_line, instant, instants
from symmotion.constraints import CurveCondition, JetConstraint, MotionConstraint, Setting
from symmotion.curves import Curve
from symmotion.design.affine import represent
from symmotion.design.quadratures import nodes_at, term_quadratures
from symmotion.design.question import as_constraints, assembled, keyframe_notes, require_rates, require_times
from symmotion.design.spans import spline_degree
from symmotion.design.terms import as_objective, kernel_of, parts_of, terms_of
from symmotion.energies import Bending, Energy
from symmotion.errors import InputError
from symmotion.jets.linear import LinearSpace, curve_space
from symmotion.jets.space import UNKNOWN
from symmotion.motions import Keyframes
from symmotion.motions.crowding import require_apart
from symmotion.motions.keyframes import require_no_path
from symmotion.program import Constraint, Multipliers, Program, Quadrature
from symmotion.program.state import made_of
from symmotion.renamed import renamed
from symmotion.splines import BSplineBasis, Spline, amid, from_origin, same_times, unified

MOST_KNOTS = 20_000  # in every interval
SMALL = 600  # conditions up to which a dense factorisation looks for redundant ones
KEYFRAMES = "keyframes"


@renamed(conditions="keys")
def curve_program(
    keys: Keyframes | Sequence[MotionConstraint],
    *,
    objective: Energy | None = None,
    constraints: Sequence[MotionConstraint] = (),
    degree: int | None = None,
    refine: int = 0,
    knots: ArrayLike | None = None,
    ends: str = "natural",
    end_rates: ArrayLike | None = None,
    order: int = 2,
    breaks: ArrayLike = (),
    domain: tuple[float, float] | None = None,
) -> "Program[CurveDesign]":
    """The curve of least ∫ ‖x⁽ᵏ⁾‖² dt, or otherwise best, under conditions at given times, as a program.

    keys: `Keyframes`, as far apart as in `affine_program`, whose translations the curve passes under the name
    "keyframes"; or conditions at times of any distance, those that agree up to rounding being the same, made by
    `CurveCondition.at`, `.between`, `.norm_below`, `.closed`, `.linked`; each keeps its multipliers under its
    name, in the shape of its values. constraints: more of them, and any `JetConstraint` of a `CurveJet`.
    objective: an energy or weighted sum of energies of the jet, Bending(order) when left out; order: k = 1, 2 or 3.
    ends: what holds at the ends: "natural" (nothing), "clamped" with `end_rates` (2, …), the slopes there, or
    "periodic", the closed curve. breaks: (B,) times where the curve is only continuous and the integral is
    taken piece by piece. domain: of the curve, the interval of the conditions' times when left out.

    degree: 2k − 1 when left out, or the least in which the conditions' derivatives are continuous.
    Knots lie at the conditions' times, 1 + o copies for the highest order o < k asked for there:
    that space holds the minimiser among all functions (a natural spline), for bounds and
    tolerances too, since only the times count, so that refine is 0 here when left out. Conditions of
    order k and more have no such minimiser: there the optimum depends on the knots. refine: knots more in every
    interval; or `knots`, all inner knots with their copies, instead.

    Raises InputError for conditions that repeat or depend on one another, or that leave part of
    the curve undetermined.

    >>> at = sm.constraints.CurveCondition.at([0.0, 1.0, 2.0], [0.0, 1.0, 0.0], name="values")
    >>> round(sm.ExactNewton().solve(sm.curve_program([at])).require().objective, 6)
    6.0
    """
    began = perf_counter()
    energy = as_objective(objective, Bending(order))
    conditions, extra = _asked(keys, constraints)
    torn = checks.numbers(breaks, "breaks").ravel()
    given = np.empty(0) if knots is None else checks.array(knots, ("K",), "knots")
    every = _spoken_of(conditions, extra, domain, torn, given)
    conditions = tuple(c.put_on(every) for c in conditions)
    extra = tuple(c.put_on(every) if isinstance(c, JetConstraint) else c for c in extra)
    least, most = _orders(energy, conditions[0].value_shape if conditions else ())
    conditions = (*conditions, *_at_ends(conditions, isinstance(keys, Keyframes), ends, end_rates, most, domain))
    _require_names(conditions)
    refine = checks.whole(refine, 0, "refine", " of knots per interval", most=MOST_KNOTS)
    marks = _marks(conditions, extra)
    highest = max((o for _, orders in marks for o in orders), default=0)
    if degree is None:
        degree = max(2 * most - 1, highest + 1 if highest >= most else 0)
    degree = spline_degree(degree, max(most, highest))
    span = _domain(conditions, extra, domain)
    torn = np.unique(unified(torn, every))
    outside = ~((torn > span[0]) & (torn < span[1]))
    if outside.any():
        at, a, b = instants(torn[outside][0], *span)
        raise InputError(f"break {at} is not inside the domain ({a}, {b})")
    inner = _knots(marks, most, degree, span, torn) if knots is None else unified(given, every)
    origin, ends_since = from_origin(np.array(span))
    inner = inner - origin
    if knots is None and refine:
        borders = np.unique(np.concatenate([ends_since, inner]))
        share = np.arange(1, refine + 1) / (refine + 1)
        inner = np.sort(np.concatenate([inner, (borders[:-1, None] + np.diff(borders)[:, None] * share).ravel()]))
    end = np.full(degree + 1, 1.0)
    basis = BSplineBasis(np.concatenate([ends_since[0] * end, inner, ends_since[1] * end]), degree, origin=origin)
    design = CurveDesign(conditions, extra, energy, least, basis, torn)
    return replace(design.program(), build_seconds=perf_counter() - began)


def _asked(keys: object, constraints: object) -> tuple[tuple[CurveCondition, ...], tuple[MotionConstraint, ...]]:
    """The conditions that are linear in the curve, those of the keyframes first, and all others."""
    if isinstance(keys, Keyframes):
        require_apart(keys.times)
        first: tuple[MotionConstraint, ...] = (CurveCondition.at(keys.times, keys.translation, name=KEYFRAMES),)
    else:
        require_no_path(keys, "keys")
        first = tuple(keys) if isinstance(keys, Iterable) and not isinstance(keys, str | bytes) else ()
        if not first or not all(isinstance(c, MotionConstraint) for c in first):
            raise InputError("conditions: a sequence of one CurveCondition or more is needed, or Keyframes")
    every = as_constraints((*first, *as_constraints(constraints)))
    linear = tuple(c for c in every if isinstance(c, CurveCondition))
    if not linear:
        raise InputError("conditions: a sequence of one CurveCondition or more is needed, or Keyframes")
    return linear, tuple(c for c in every if not isinstance(c, CurveCondition))


def _spoken_of(
    conditions: Sequence[CurveCondition],
    extra: Sequence[MotionConstraint],
    domain: tuple[float, float] | None,
    breaks: np.ndarray,
    knots: np.ndarray,
) -> np.ndarray:
    """All times that a program is told: of those that agree up to rounding the first stands for all."""
    ends = np.empty(0) if domain is None else checks.array(domain, (2,), "domain")
    asked = [c.times.ravel() for c in conditions]
    asked += [np.ravel(np.asarray(c.at)) for c in extra if isinstance(c, JetConstraint) and c.at is not None]
    return np.concatenate([ends, *asked, breaks, knots])


def _require_names(conditions: Sequence[CurveCondition]) -> None:
    names = [c.name for c in conditions]
    for name in names:
        if names.count(name) > 1:
            raise InputError(f"conditions of the same name, {name!r}: give each a name of its own")


def _orders(energy: Energy, shape: tuple[int, ...]) -> tuple[int, int]:
    """The least and the highest derivative that some term of an objective is the first, or the last, to read."""
    space = curve_space(BSplineBasis.clamped(np.array([0.0, 1.0]), 1), shape)
    read = [kernel_of(e, w, space).orders for _, w, e in parts_of(energy)]
    return max(1, min(min(r) for r in read)), max(1, max(max(r) for r in read))


def _at_ends(
    conditions: Sequence[CurveCondition],
    keyed: bool,
    ends: str,
    end_rates: ArrayLike | None,
    order: int,
    domain: tuple[float, float] | None,
) -> list[CurveCondition]:
    require_rates(ends, end_rates)
    if ends == "natural":
        return []
    a, b = _domain(conditions, (), domain)
    if end_rates is not None:
        return [CurveCondition.at([a, b], end_rates, order=1, name="end rates")]
    orders = range(1 if keyed else 0, order)
    return [CurveCondition.closed(a, b, orders)] if orders else []


def _marks(conditions: Sequence[CurveCondition], extra: Sequence[MotionConstraint]) -> list[tuple[float, set[int]]]:
    """The times that conditions speak of, with the derivative orders asked for there."""
    found: dict[float, set[int]] = {}
    for c in conditions:
        for t, o in zip(c.times.ravel().tolist(), c.orders.ravel().tolist(), strict=True):
            found.setdefault(t, set()).add(o)
    shape = max((c.value_shape for c in conditions), key=len)
    space = curve_space(BSplineBasis.clamped(np.array([0.0, 1.0]), 1), shape)
    for c in extra:
        if isinstance(c, JetConstraint) and c.at is not None:
            times = np.asarray(c.at)
            times = times.reshape(-1, c.slots)
            for slot, orders in enumerate(c.orders(space)):
                for t in times[:, slot].tolist():
                    found.setdefault(t, set()).update(orders)
    return sorted(found.items())


def _domain(
    conditions: Sequence[CurveCondition], extra: Sequence[MotionConstraint], domain: tuple[float, float] | None
) -> tuple[float, float]:
    spoken = [(c.name, c.times) for c in conditions]
    spoken += [(c.name, np.asarray(c.at)) for c in extra if isinstance(c, JetConstraint) and c.at is not None]
    # Keyframes say when the curve begins and ends; conditions alone do so together.
    telling = [t for name, t in spoken if name == KEYFRAMES] or [t for _, t in spoken]
    ends = min(t.min() for t in telling), max(t.max() for t in telling)
    a, b = ends if domain is None else checks.array(domain, (2,), "domain").tolist()
    if not (np.isfinite([a, b]).all() and a < b):
        a, b = instants(a, b)
        raise InputError(f"domain from {a} to {b}: conditions at two times or more, or a longer domain, are needed")
    for name, times in spoken:
        if times.min() < a or times.max() > b:
            worst = times.min() if times.min() < a else times.max()
            at, first, last = instants(worst, a, b)
            raise InputError(f"{name}: time {at} is outside the domain [{first}, {last}]")
    return float(a), float(b)


def _knots(
    marks: Sequence[tuple[float, set[int]]], order: int, degree: int, span: tuple[float, float], breaks: np.ndarray
) -> np.ndarray:
    """The inner knots at the times marked, with the copies that their orders call for."""
    orders: dict[float, set[int]] = {float(t): set() for t in breaks}
    for t, asked in marks:
        orders.setdefault(t, set()).update(asked)
    knots = []
    for t in sorted(set(orders) - set(span)):
        low, high = ([o for o in orders[t] if (o < order) == below] for below in (True, False))
        # The minimiser's derivative of order 2k − 1 − o may jump; an order that is asked for must not.
        copies = degree - 2 * order + 2 + max(low) if low else 1
        copies = min(copies, degree - max(high)) if high else copies
        knots += [t] * (degree if t in breaks else max(copies, 1))
    return np.array(knots)


@dataclass(frozen=True, eq=False)
class CurveDesign:
    """The question of a curve program: conditions, objective, spline space.

    constraints: those that are no `CurveCondition`; order: the lowest derivative that the objective sees;
    breaks: (B,) times where the curve is only continuous.

    basis: of the curve; nodes: by term, more Gauss nodes than it asks for. Raises InputError for a start of another
    kind.

    >>> at = sm.constraints.CurveCondition.at([0.0, 1.0, 2.0], [0.0, 1.0, 0.0])
    >>> sm.curve_program([at]).design.basis.degree
    3
    """

    conditions: tuple[CurveCondition, ...]
    constraints: tuple[MotionConstraint, ...]
    objective: Energy
    order: int
    basis: BSplineBasis
    breaks: np.ndarray
    # By term, Gauss nodes per span where they are not those that the start needs.
    nodes: Mapping[str, int] = field(default_factory=dict)

    __repr__ = in_a_line

    __getstate__ = made_of

    @property
    def notes(self) -> tuple[str, ...]:
        """What is said before solving: keyframes that crowd."""
        first = self.conditions[0]
        return keyframe_notes(first.times[:, 0]) if first.name == KEYFRAMES else ()

    @cached_property
    def shape(self) -> tuple[int, ...]:
        """The shape of the curve's values."""
        return max((c.value_shape for c in self.conditions), key=len)

    @property
    def channels(self) -> int:
        """How many numbers a value of the curve has: the product of its shape."""
        return int(np.prod(self.shape))

    @cached_property
    def space(self) -> LinearSpace:
        """The linear map from controls (n, channels) to the jet of the curve at a parameter."""
        return curve_space(self.basis, self.shape, self.shift)

    @cached_property
    def shift(self) -> np.ndarray:
        """(channels,) what the program subtracts from every control: a point amid values that are far from zero."""
        places = [c.spread(c.target, self.shape) for c in self.conditions if c.places]
        return amid(np.concatenate(places)) if places else np.zeros(self.channels)

    @property
    def setting(self) -> Setting:
        """What constraints may know of this program: the parameters of its keyframes, empty where it has none."""
        keyed = next((c.times[:, 0] for c in self.conditions if c.name == KEYFRAMES), np.empty(0))
        return Setting((self.space,), keyed)

    def program(self) -> "Program[CurveDesign]":
        """The program of this question."""
        given: list[Constraint] = [
            c.on(self.space, self.shape, self._kept[c.name]) for c in self.conditions if len(self._kept[c.name])
        ]
        self._require_independent()
        if not self.constraints:
            self._require_determined()
        start = self._start() - self.shift
        terms = terms_of(self.objective, self.space, start, self.nodes)
        lengths = {UNKNOWN: slice(None)}
        shifts = {UNKNOWN: self.shift}
        return assembled({UNKNOWN: start}, terms, given, self.constraints, self.setting, self, lengths, shifts)

    @cached_property
    def _kept(self) -> dict[str, np.ndarray]:
        """The rows of each condition that are left to the solver.

        A bound at a time where an equality fixes the same derivative decides nothing, and would make
        the Jacobian rank-deficient: it is checked, left out, and its multiplier is zero.
        """
        fixed = {}
        for c in self.conditions:
            if c.is_equality and not c.norm and c.times.shape[1] == 1:
                for key, value in zip(c.samples, c.spread(c.target, self.shape), strict=True):
                    fixed.setdefault(key, (c.name, value))
        kept = {}
        for c in self.conditions:
            kept[c.name] = np.arange(c.count)
            if c.is_equality or c.times.shape[1] > 1:
                continue
            decided = [(i, *fixed[key]) for i, key in enumerate(c.samples) if key in fixed]
            shape = () if c.norm else self.shape
            target, lower, upper = c.spread(c.target, self.shape), c.spread(c.lower, shape), c.spread(c.upper, shape)
            for i, name, value in decided:
                g = np.array([value @ value]) if c.norm else value - target[i]
                low, high = lower[i], upper[i]
                slack = 1e-12 * max(1.0, np.abs(g).max())
                if (g < low - slack).any() or (g > high + slack).any():
                    raise InputError(f"{c.name} at time {instant(c.times[i, 0])} contradicts {name} there")
            kept[c.name] = np.setdiff1d(kept[c.name], [i for i, *_ in decided])
        return kept

    def _start(self) -> np.ndarray:
        """Controls on the broken line through the values asked for, or zero."""
        given = [c for c in self.conditions if c.times.shape[1] == 1 and not c.orders.any() and not c.norm]
        given = [c for c in given if np.isfinite(c.lower).all() and np.isfinite(c.upper).all()]
        if not given:
            return np.zeros((self.basis.n, self.channels))
        times = np.concatenate([c.times[:, 0] for c in given])
        values = np.concatenate(
            [
                c.spread(c.target, self.shape) + (c.spread(c.lower, self.shape) + c.spread(c.upper, self.shape)) / 2
                for c in given
            ]
        )
        along = np.argsort(times, kind="stable")
        since, where = times[along] - self.basis.origin, self.basis.relative.greville
        return np.column_stack([np.interp(where, since, v[along]) for v in values.T])

    def _require_independent(self) -> None:
        """Raise InputError that names the first equality that repeats others or contradicts them."""
        from scipy.linalg import qr

        equalities = [c for c in self.conditions if c.is_equality]
        labels = [(c, i) for c in equalities for i in range(c.count)]
        if not labels or len(labels) > SMALL:
            return
        rows = np.concatenate([c.rows(self.basis).toarray() for c in equalities])
        scale = np.abs(rows).max(axis=1, keepdims=True)
        triangle = np.asarray(qr((rows / np.where(scale > 0, scale, 1.0)).T, mode="r")[0])
        rank = min(triangle.shape)
        pivots = np.concatenate([np.abs(np.diag(triangle)), np.zeros(len(labels) - rank)])
        if (pivots <= 1e-11).any():
            c, i = labels[int(np.argmax(pivots <= 1e-11))]
            raise InputError(
                f"{c.name}, row {i} (time {instant(c.times[i, -1])}), follows from the conditions before it or "
                "contradicts them: leave it out, or insert knots"
            )

    def _require_determined(self) -> None:
        """Raise InputError where a curve that costs nothing is free under the conditions."""
        # ∫ ‖x⁽ᵏ⁾‖² does not see polynomials of degree k − 1, one for each piece between breaks, joined continuously.
        (a, b), origin = self.basis.relative.domain, self.basis.origin
        k = self.order
        knots = np.concatenate([np.full(k, a), np.repeat(self.breaks - origin, k - 1), np.full(k, b)])
        unseen = BSplineBasis(knots, k - 1, origin=origin)
        rows = np.concatenate([c.rows(unseen).toarray() for c in self.conditions])
        rank = np.linalg.matrix_rank(rows / np.maximum(np.abs(rows).max(axis=1, keepdims=True), 1e-300))
        if rank < unseen.n:
            kind = ("constants", "straight lines", "parabolas")[k - 1]
            pieces = " between the breaks" if len(self.breaks) else ""
            raise InputError(
                f"the conditions leave the curve undetermined: {kind}{pieces} cost nothing and have {unseen.n} degrees "
                f"of freedom per coordinate, of which the conditions fix {rank}; add conditions"
            )

    def motion(self, unknowns: Mapping[str, np.ndarray]) -> Spline:
        """The curve of the program's unknowns."""
        return Spline(self.basis, (unknowns[UNKNOWN] + self.shift).reshape(-1, *self.shape))

    def unknowns(self, motion: Curve) -> dict[str, np.ndarray]:
        """The unknowns that represent a curve, exactly where the space holds it."""
        if not hasattr(motion, "to_bspline"):
            raise InputError(f"start {motion!r:.80}: a curve, a solution or numbers are needed")
        spline = motion.to_bspline().clamped()
        if not same_times(spline.domain, self.basis.domain) or spline.control_points.shape[1:] != self.shape:
            raise InputError(
                f"a curve over {spline.domain} with values of shape {spline.control_points.shape[1:]}: "
                f"{self.basis.domain} and {self.shape} are needed"
            )
        spline = spline.elevated(max(0, self.basis.degree - spline.degree))
        basis, spline = self.basis.relative, spline.about(self.basis.origin).relative
        controls = represent(basis, spline, basis.greville).control_points.reshape(basis.n, -1)
        return {UNKNOWN: controls - self.shift}

    def quadratures(self, program: Program, x: np.ndarray) -> dict[str, Quadrature]:
        """By term, how well its nodes integrate at x (unknowns,)."""
        return term_quadratures(program, x, self.objective, self.motion(program.unpack(x)), self.setting.times)

    def refined(self, program: "Program[CurveDesign]", x: np.ndarray) -> "Program[CurveDesign] | None":
        """The program with the nodes that ten digits need at x (unknowns,); None where it has them, or can have."""
        nodes = nodes_at(program, x, self.objective, self.motion(program.unpack(x)))
        if not nodes:
            return None
        return replace(self, nodes={**self.nodes, **nodes}).program().with_parameters(**program.parameters)

    def with_keyframes(self, program: "Program[CurveDesign]", keyframes: Keyframes) -> "Program[CurveDesign]":
        """The program for other keyframes at the same times."""
        began = perf_counter()
        first = self.conditions[0]
        if first.name != KEYFRAMES or not isinstance(keyframes, Keyframes):
            raise InputError("with_keyframes: the program was made of conditions, or these are no Keyframes")
        require_times(keyframes.times, first.times[:, 0])
        moved = CurveCondition.at(first.times[:, 0], keyframes.translation, name=KEYFRAMES)
        fresh = replace(self, conditions=(moved, *self.conditions[1:])).program()
        return replace(fresh, structure=program.structure, build_seconds=perf_counter() - began)

    def multipliers(self, multipliers: Mapping[str, np.ndarray]) -> Multipliers:
        """Multipliers by condition, (N, …) in the shape of the curve's values, (N,) for a norm.

        ∂f*/∂target_i = −λ_i; at a bound ∂f*/∂bound_i = −λ_i too, of a norm per unit of its square.
        """
        shaped = dict(multipliers)
        for c in self.conditions:
            whole = np.zeros((c.count, 1 if c.norm else self.channels))
            if c.name in multipliers:
                whole[self._kept[c.name]] = multipliers[c.name]
            shaped[c.name] = whole.reshape(c.count, *(() if c.norm else self.shape))
        return shaped
