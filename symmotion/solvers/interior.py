"""Newton's method where there are bounds: a primal–dual interior point on the systems that equalities have."""

from dataclasses import dataclass, replace
from math import inf

import numpy as np

from symmotion.solvers.descent import CLEARLY, ESCAPES, Enough, Point, downhill
from symmotion.solvers.frame import Frame
from symmotion.solvers.held import Held, held_newton
from symmotion.solvers.solution import Iteration
from symmotion.systems import AnyFactor, AnySystem, largest, shifted, tenfold

# Multiples of the identity that are added where the matrix is not positive definite, relative to its diagonal.
RIDGE, MOST_SHIFT = 1e-8, 1e6
# The distance from a bound that slacks have at first, relative to the bound or to what is between two.
INSIDE = 1e-2
# How hard the barrier pulls at first, relative to the objective, and pulls along the equalities that are rounding.
PULL, ROUNDING = 10.0, 1e-9
# The share of the way to a bound that a step goes at most.
BOUNDARY = 0.995
# Multipliers are kept within this factor of μ / distance.
APART = 1e10
# The share of the violation that the merit's slope must at least account for.
ACCOUNTED = 0.1
# The least that a step is shortened to, and steps that are crawling: with a violation, so many are the end.
SHORTEST, CRAWLING, CRAWLS = 1e-8, 0.05, 6
# The gap, relative to the objective, from which on the bounds that press are guessed; after a wrong guess the gap
# falls by AGAIN before the next. Where no guess holds, the gap that is left at the end, relative to the tolerance.
NEAR, AGAIN, LEFT = 1e-3, 1e-2, 1e-3
# Multipliers, relative to the largest, of bounds that press.
WEAK = 1e-7


@dataclass(frozen=True, eq=False)
class Slacks:
    """Distances (bounds,) of slacks from their lower and upper bounds, with multipliers z ≥ 0 of these sides.

    Where a side has no bound the distance is infinite and z is zero. Distances are kept, not slacks: near a bound that
    is far from zero the slack has no digits left for them.
    """

    above: np.ndarray
    below: np.ndarray
    down: np.ndarray
    up: np.ndarray

    @property
    def multipliers(self) -> np.ndarray:
        return self.up - self.down

    @property
    def stiffness(self) -> np.ndarray:
        """(bounds,) Σ = z / distance, of both sides together."""
        return self.down / self.above + self.up / self.below

    @property
    def gap(self) -> float:
        """Σ z · distance."""
        return _product(self.down, self.above) + _product(self.up, self.below)

    @property
    def sides(self) -> int:
        """How many bounds there are, of both sides."""
        return int(np.isfinite(self.above).sum() + np.isfinite(self.below).sum())

    def moved(self, change: np.ndarray) -> "Slacks":
        """With slacks that are larger by a change (bounds,)."""
        return replace(self, above=self.above + change, below=self.below - change)

    def missed(self, values: np.ndarray, lower: np.ndarray, upper: np.ndarray) -> np.ndarray:
        """(bounds,) by how much values exceed the slacks; lower, upper: the bounds that distances are from."""
        low = np.isfinite(self.above)
        return values - np.where(low, lower, upper) - np.where(low, self.above, -self.below)

    @property
    def barrier(self) -> float:
        """−Σ log(distance), ∞ outside."""
        distances = np.concatenate([d[np.isfinite(d)] for d in (self.above, self.below)])
        return -float(np.log(distances).sum()) if (distances > 0).all() else inf


def _product(z: np.ndarray, distance: np.ndarray) -> float:
    there = np.isfinite(distance)
    return float(z[there] @ distance[there])


@dataclass(frozen=True, eq=False)
class Step:
    """A step of x and s, of the multipliers of both sides, and the multipliers of the equalities that it leads to."""

    x: np.ndarray
    s: np.ndarray
    down: np.ndarray
    up: np.ndarray
    equalities: np.ndarray | None


class Interior:
    """The course of a descent to the minimum of f subject to c_E = 0, lower ≤ c ≤ upper, by a logarithmic barrier.

    With slacks s and multipliers z of the bounds eliminated, each step solves the saddle system of M + Jᵀ Σ J,
    Σ = z/distance, with the residual ∇f + Jᵀ(q + Σ (c − s)), q = μ/distance. M is the blend of Gauss–Newton and exact
    Hessian of the Lagrangian as without bounds. μ follows Mehrotra's predictor and the step his corrector; the
    merit of the line search is f − μ Σ log(distance) + ν (‖c_E‖₁ + ‖c − s‖₁), with a second-order correction. Once
    it is near, the bounds that press are guessed, and Newton's method on them ends to rounding (`held_newton`).

    wider: by how much bounds are wider where the barrier is, relative to them or to one in own units, so that those
    without an inside have one. What presses is held at the bounds themselves in the end. follows: slacks are those of
    the values where that lowers the merit; steps along curved bounds that do not press are longer, others end sooner
    without.
    Sources: Mehrotra 1992; El-Bakry, Tapia, Zhang 1994; Wächter, Biegler 2006; Nocedal, Wächter, Waltz 2009.
    """

    strange = "the objective, a condition or a derivative is not finite"
    idle = "steps lower neither the objective nor the violation any more"
    blend = corrects = True

    def __init__(self, tolerance: float, frame: Frame, x: np.ndarray, wider: float = 0.0, follows: bool = False):
        self.frame, self.evaluator, self.journal = frame, frame.evaluator, frame.journal
        self.system: AnySystem = frame.system(x)
        self.x = x
        self._enough = Enough(tolerance, frame.evaluator)
        self._objective, self._violation = self.evaluator.objective(x), self.evaluator.violation(x)
        self._values = frame.values(x)
        self._bounds = tuple(b + side * wider * _own(b) for b, side in ((frame.lower, -1), (frame.upper, 1)))
        self._slacks = self._first()
        self._mu, self._penalty = self._slacks.gap / self._slacks.sides, 0.0
        self.equalities = frame.equalities(x, self._slacks.multipliers)
        self._tried, self._crawls, self._escapes, self._follows = inf, 0, 0, follows
        self._held: Held | None = None

    def continues(self, multipliers: np.ndarray) -> bool:
        """Whether Newton's method ends from here, with the bounds held that multipliers (conditions,) press on."""
        equalities, bounds = self.frame.parted(multipliers)
        pressing = np.abs(bounds) > WEAK * largest(bounds)
        low, high = pressing & (bounds < 0), pressing & (bounds > 0)
        bounds = np.where(pressing, bounds, 0.0)
        self._held = held_newton(self.frame, self._enough, Held(self.x, equalities, bounds, low, high), inf)
        if self._held is not None:
            self.journal.add(self.look(1.0).row)
            self._settle()
        return self._held is not None

    @property
    def over(self) -> bool:
        """Whether Newton's method on the held bounds has ended."""
        return self._held is not None

    @property
    def multipliers(self) -> np.ndarray:
        """(conditions,) those of the program, where it stands."""
        bounds = self._slacks.multipliers if self._held is None else self._held.multipliers
        equalities = self.equalities if self.frame.curved else self.frame.equalities(self.x, bounds)
        return self.frame.joined(equalities, bounds)

    def _first(self) -> Slacks:
        """Slacks inside their bounds, and multipliers of a barrier that pulls like the objective."""
        frame, x, (lower, upper) = self.frame, self.x, self._bounds
        width = upper - lower
        margins = [np.minimum(INSIDE * _own(b), 0.5 * width) for b in (lower, upper)]
        s = np.clip(self._values, lower + margins[0], upper - margins[1])
        slacks = Slacks(s - lower, upper - s, np.zeros_like(s), np.zeros_like(s))
        barrier, descent = 1 / slacks.below - 1 / slacks.above, self.evaluator.gradient(x)
        pull = frame.pull(x, barrier)
        force, gradient = (float(np.linalg.norm(self.system.reduced(g))) for g in (pull, descent))
        # In the unit of the objective where the barrier does not pull but by rounding: in the middle between bounds,
        # or against equalities.
        own = largest(frame.unit * descent) or abs(self._objective) or 1.0
        mu = PULL * gradient / force if gradient and force > ROUNDING * float(np.linalg.norm(pull)) else own
        return replace(slacks, down=mu / slacks.above, up=mu / slacks.below)

    @property
    def _off(self) -> np.ndarray:
        """(bounds,) by how much the values exceed the slacks."""
        return self._slacks.missed(self._values, *self._bounds)

    def _missed(self, slacks: Slacks) -> float:
        """‖(c_E, c − s)‖₁."""
        return float(np.abs(slacks.missed(self._values, *self._bounds)).sum() + np.abs(self._violation).sum())

    def look(self, theta: float) -> Point:
        self.system = self.frame.system(self.x)
        gradient, matrix = self._second_order(theta)
        self._pulled = gradient + self.frame.pull(self.x, self._slacks.multipliers)
        if self.frame.curved:
            self._pulled += self.evaluator.pull(self.x, self.equalities)
            stationarity = largest(self._pulled)
        else:
            stationarity = largest(self.system.reduced(self._pulled))
        outside = largest(self.frame.outside(self._values) * self.frame.scale)
        row = Iteration(self._objective, stationarity, max(largest(self._violation), outside))
        finite = np.isfinite(self._objective) and np.isfinite(matrix).all() and np.isfinite(row.violation)
        return Point(row, gradient, matrix, bool(finite))

    def matrix(self, theta: float) -> np.ndarray:
        return self._second_order(theta)[1]

    def _second_order(self, theta: float) -> tuple[np.ndarray, np.ndarray]:
        frame, slacks = self.frame, self._slacks
        gradient, matrix = frame.second_order(self.system, self.x, self.equalities, theta)
        return gradient, frame.stiffen(matrix, self.system, self.x, slacks.multipliers, slacks.stiffness, theta)

    def shifted(self, matrix: np.ndarray) -> AnyFactor:
        shifts = tenfold(RIDGE, most=MOST_SHIFT)
        return shifted(
            self.system, matrix, self.frame.unit, shifts, factorise=lambda m: self.frame.factorise(self.system, m)
        )[0]

    def settled(self, point: Point, factor: AnyFactor) -> bool:
        slacks, tolerance = self._slacks, self._enough.tolerance
        nothing = np.zeros_like(slacks.down)
        affine = self._newton(point.gradient, factor, 0.0, nothing, nothing)
        weight = max(abs(self._objective), largest(slacks.multipliers)) or 1.0
        missed = max(largest(self._violation), largest(self._off))
        if slacks.gap <= min(NEAR * weight, AGAIN * self._tried) and missed <= NEAR:
            self._tried = slacks.gap
            self._held = held_newton(self.frame, self._enough, self._guess(affine), NEAR * weight)
            if self._held is not None:
                return True
        mu = slacks.gap / slacks.sides
        ahead = self._moved(affine, *self._longest(affine, 1.0)).gap / slacks.sides
        self._mu = max(min(1.0, (ahead / mu) ** 3) * mu, 0.1 * LEFT * tolerance * weight / slacks.sides)
        self._step = self._newton(point.gradient, factor, self._mu, affine.s * affine.down, -affine.s * affine.up)
        point.step = self._step.x
        return (
            missed <= CLEARLY * tolerance
            and slacks.gap <= LEFT * tolerance * weight
            and self._enough(0.5 * abs(float(self._pulled @ point.step)), self._objective, self.x)
        )

    def _guess(self, affine: Step) -> Held:
        """The bounds that press, by the step to μ = 0: it leaves their multipliers, and the others' distances."""
        slacks = self._slacks
        low, high = (
            np.isfinite(distance) & (dz * np.where(np.isfinite(distance), distance, 0.0) > z * change)
            for z, dz, distance, change in (
                (slacks.down, affine.down, slacks.above, affine.s),
                (slacks.up, affine.up, slacks.below, -affine.s),
            )
        )
        multipliers = np.where(low | high, slacks.multipliers, 0.0)
        return Held(self.x, self.equalities, multipliers, low & ~high, high)

    def _newton(self, gradient: np.ndarray, factor: AnyFactor, mu: float, down: np.ndarray, up: np.ndarray) -> Step:
        """The step towards the barrier of μ; down, up: products of steps of distance and multiplier, of both sides."""
        slacks, frame = self._slacks, self.frame
        off = self._off
        towards_down, towards_up = (mu - down) / slacks.above, (mu - up) / slacks.below
        residual = gradient + frame.pull(self.x, towards_up - towards_down + slacks.stiffness * off)
        x, equalities = frame.step(self.system, factor, residual, self._violation)
        s = frame.along(self.x, x) + off
        return Step(
            x,
            s,
            towards_down - slacks.down - slacks.down / slacks.above * s,
            towards_up - slacks.up + slacks.up / slacks.below * s,
            equalities,
        )

    def _longest(self, step: Step, share: float) -> tuple[float, float]:
        """The longest steps ≤ 1, of slacks and of multipliers, that go at most a share of the way to zero."""
        slacks = self._slacks
        primal = min(_until(slacks.above, step.s, share), _until(slacks.below, -step.s, share))
        return primal, min(_until(slacks.down, step.down, share), _until(slacks.up, step.up, share))

    def _moved(self, step: Step, primal: float, dual: float) -> Slacks:
        slacks = self._slacks
        down, up = slacks.down + dual * step.down, slacks.up + dual * step.up
        return replace(slacks.moved(primal * step.s), down=down, up=up)

    def outward(self, point: Point) -> np.ndarray | None:
        if self._escapes == ESCAPES:
            return None
        direction = self.journal.timed(self.system.curvature, self.matrix(1.0)).direction
        if direction is None:
            return None
        self._escapes += 1
        return downhill(direction, point.gradient, self.x, self.frame.unit)

    def advance(self, point: Point, factor: AnyFactor, outward: np.ndarray | None) -> tuple[float, bool]:
        slacks, step, mu = self._slacks, self._step, self._mu
        if outward is not None:
            nothing = np.zeros_like(slacks.down)
            step = Step(outward, self.frame.along(self.x, outward), nothing, nothing, None)
        primal, dual = self._longest(step, BOUNDARY)
        missed = self._missed(slacks)
        slope = float(point.gradient @ step.x) + mu * float((step.s / slacks.below - step.s / slacks.above).sum())
        self._penalty = self._weighed(slope, missed, step)
        merit = self._objective + mu * slacks.barrier + self._penalty * missed
        slope = min(slope - self._penalty * missed, 0.0)
        x, found, length = self._searched(step, factor, primal, merit, slope)
        if step.equalities is not None:
            self.equalities = self.equalities + length * (step.equalities - self.equalities)
        self.x = x
        moved = self._moved(step, length, dual)
        self._slacks = self._tidied(replace(moved, above=found.above, below=found.below))
        self._crawls = self._crawls + 1 if length < CRAWLING and missed > self._enough.tolerance else 0
        return length, length > SHORTEST and self._crawls <= CRAWLS

    def _weighed(self, slope: float, missed: float, step: Step) -> float:
        """ν large enough for the step to descend on the merit, and no larger than need be."""
        slacks = self._slacks
        most = largest(slacks.multipliers + step.up - step.down)
        if step.equalities is not None:
            most = max(most, largest(step.equalities))
        # Where nothing is missed a weight from before would keep steps along curved bounds short.
        needed = slope / ((1 - ACCOUNTED) * missed) if missed > 0.0 else 0.0
        # Along linear equalities the multipliers suffice, and a slope that is rounding asks for too much.
        needed = needed if self.frame.curved else min(needed, 2 * most)
        return max(1.1 * needed, 0.5 * (self._penalty + most))

    def _searched(
        self, step: Step, factor: AnyFactor, length: float, merit: float, slope: float
    ) -> tuple[np.ndarray, Slacks, float]:
        """The point accepted along a step, its slacks, and the length of the step."""
        rounding, slacks, longest = 1e-13 * (abs(merit) + 1e-300), self._slacks, length
        while True:
            x = self.x + length * step.x
            value, moved = self._merit(x, slacks.moved(length * step.s))
            if value <= merit + 1e-4 * length * slope + rounding or length < SHORTEST:
                return x, moved, length
            if length == longest and np.isfinite(self._objective):
                # What the conditions' curvature adds, through the same factor.
                off = moved.missed(self._values, *self._bounds)
                residual = self.frame.pull(self.x, slacks.stiffness * off)
                more, _ = self.frame.step(self.system, factor, residual, self._violation)
                value, inside = self._merit(x + more, moved.moved(self.frame.along(self.x, more) + off))
                if value <= merit + 1e-4 * length * slope + rounding:
                    return x + more, inside, length
            length *= 0.5

    def _merit(self, x: np.ndarray, slacks: Slacks) -> tuple[float, Slacks]:
        """The merit at a point, whose objective and conditions are kept, with these slacks or those of its values."""
        self._objective, self._violation = self.evaluator.objective(x), self.evaluator.violation(x)
        self._values = self.frame.values(x)
        if not self._follows:
            return self._of(slacks), slacks
        off = slacks.missed(self._values, *self._bounds)
        followed = slacks.moved(np.clip(off, -BOUNDARY * slacks.above, BOUNDARY * slacks.below))
        found = [(self._of(s), s) for s in (slacks, followed)]
        return min(found, key=lambda pair: pair[0])

    def _of(self, slacks: Slacks) -> float:
        """The merit of slacks, where it stands."""
        value = self._objective + self._mu * slacks.barrier + self._penalty * self._missed(slacks)
        return value if np.isfinite(value) else inf

    def _tidied(self, slacks: Slacks) -> Slacks:
        """Slacks as far inside as one-sided values, and multipliers not too far from the barrier's."""
        off = slacks.missed(self._values, *self._bounds)
        inward = np.where(np.isinf(slacks.above), np.minimum(off, 0.0), 0.0)
        slacks = slacks.moved(np.where(np.isinf(slacks.below), np.maximum(off, 0.0), inward))
        down, up = (
            np.clip(z, self._mu / (APART * distance), APART * self._mu / distance)
            for z, distance in ((slacks.down, slacks.above), (slacks.up, slacks.below))
        )
        return replace(slacks, down=down, up=up)

    def rest(self, point: Point, factor: AnyFactor) -> None:
        """Go where the held bounds ended, and log the way."""
        if self._held is not None:
            self._settle()

    def _settle(self) -> None:
        assert self._held is not None
        self.x, self.equalities = self._held.x, self._held.equalities
        for row in self._held.rows:
            last = self.journal.log.pop()
            self.journal.log.append(replace(last, theta=1.0, step=1.0))
            self.journal.add(row)


def _own(bounds: np.ndarray) -> np.ndarray:
    """(bounds,) the size of bounds, or one in own units: what widths beside them are relative to."""
    return np.maximum(1.0, np.abs(np.where(np.isfinite(bounds), bounds, 0.0)))


def _until(value: np.ndarray, change: np.ndarray, share: float) -> float:
    """The largest α ≤ 1 with value + α change ≥ (1 − share) value, where value ≥ 0."""
    falling = (change < 0) & np.isfinite(value)
    return float(min(1.0, (share * value[falling] / -change[falling]).min())) if falling.any() else 1.0
