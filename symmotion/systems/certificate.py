"""What is true at a point with multipliers, computed the same way whatever solver returned them."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TypeAlias

import numpy as np
import scipy.linalg as la
from scipy import sparse

from symmotion import checks
from symmotion.brief import in_a_line
from symmotion.errors import InputError
from symmotion.program.bounded import Bounded
from symmotion.program.evaluate import Evaluator
from symmotion.program.everywhere import Excess, excess_at
from symmotion.program.program import Integrated, Program
from symmotion.program.quadrature import QUADRATURE
from symmotion.systems.condensed import Condensed
from symmotion.systems.curvature import EPS
from symmotion.systems.pressed import Pressed
from symmotion.systems.saddle import Saddle
from symmotion.systems.system import DEPENDENT, AnyFactor, AnySystem, largest, own_size, reach, shifted, tenfold

# Multipliers and distances from a bound below this, relative, count as none: IPOPT's are never exactly zero.
WEAK = 1e-6
# Where an interior point ends at a bound without a multiplier, both are this small, and not far from each other.
NEARLY = 1e-3
# What sums of some ten numbers may be off by, in roundings of the largest.
SLOPPY = 64
# Of an objective, that quadrature is asked for.
DIGITS = 10
# Multiples of the identity that are added to a matrix that is not positive definite, relative to its diagonal.
LEAST_SHIFT, MOST_SHIFT = 1e-10, 1e6


@dataclass(frozen=True)
class Certificate:
    """First- and second-order conditions at a point x with multipliers λ; r = ∇f + Jᵀλ, M the Hessian of f + λᵀg.

    objective: f; stationarity: ‖r‖∞; violation: ‖g‖∞, for inequalities the positive part.
    decrement: ½ rᵀM⁻¹r along the conditions, by how much a Newton step would still lower f, whatever the units; where
        M is not positive there, of M plus a multiple of the identity that is.
    complementarity: max |λ| · slack, in units of f, slack being the distance from the bound at which λ would have
        its sign, or what the condition moves by where there is no such bound.
    inertia: of M along the equalities and the bounds that press: "positive" definite (a strict local minimum), "flat"
        (zero), "indefinite" (no minimum), or "unknown", where rounding leaves it open or a bound that is met
        without a multiplier excludes the direction.
    rounding: of f, see `Evaluator.rounding`, where the decrement is not far below f, else 0.
    mismatch, missed, pressing: the part of r that multipliers should cancel, the violation and the complementarity
        relative to the program's own units.
    weak: names of bounds that are met without a multiplier. degenerate: whether active conditions depend on each
        other, which leaves multipliers open.
    quadrature: by how much the objective may miss the integrals that its terms stand for; unresolved: what is said of
        the terms of which that leaves no digit. They fail the certificate.

    Raises InputError for a tolerance that is negative.

    >>> certificate = sm.ExactNewton().solve(sm.affine_program(sm.examples.planar_keyframes())).certificate
    >>> certificate.holds(1e-8), certificate.inertia
    (True, 'positive')
    """

    objective: float
    stationarity: float
    violation: float
    decrement: float
    complementarity: float
    inertia: str
    rounding: float = 0.0
    mismatch: float = 0.0
    missed: float = 0.0
    pressing: float = 0.0
    weak: tuple[str, ...] = ()
    degenerate: bool = False
    quadrature: float = 0.0
    unresolved: tuple[str, ...] = ()

    @property
    def digits(self) -> int:
        """How many digits of the objective its nodes give, of the ten that are asked for."""
        if self.quadrature <= max(QUADRATURE * abs(self.objective), self.rounding):
            return DIGITS
        if not self.quadrature < abs(self.objective):
            return 0
        return min(DIGITS, int(-np.log10(self.quadrature / abs(self.objective))))

    @cached_property
    def excess(self) -> Mapping[str, Excess]:
        """By name of the constraint, of every bound, and of every condition that is meant for all times.

        By how far the point exceeds it anywhere along the motion where it is meant for all times; at its own times
        where it has some. See `Excess`. Found when it is first asked for; empty of a certificate without its
        point (`at`).
        """
        point: tuple[Program, np.ndarray] | None = self.__dict__.get("_point")
        if point is None or not np.isfinite(point[1]).all():
            return {}
        program, x = point
        parts, found = program.split(Evaluator(program, "interpreted").values(x)), {}
        motion = program.design.motion(program.unpack(x)) if any(c.everywhere for c in program.constraints) else None
        for c in program.constraints:
            if c.everywhere is not None:
                found[c.name] = c.everywhere.excess(motion, c.parameter_values)
            elif not c.is_equality:
                found[c.name] = excess_at(parts[c.name], c.lower, c.upper, c.times, c.power)
        return found

    def __repr__(self) -> str:
        figures = ("stationarity", "violation", "decrement", "complementarity")
        told = [f"objective {self.objective:.9g}", *(f"{name} {getattr(self, name):.1e}" for name in figures)]
        told.append(f"inertia {self.inertia}")
        rough = f" ({self.digits} digits)" if self.digits < DIGITS else ""
        told += [f"quadrature {self.quadrature:.1e}{rough}"] if self.quadrature else []
        told += [f"weak {', '.join(self.weak)}"] if self.weak else []
        told += ["multipliers open"] if self.degenerate else []
        return f"Certificate({', '.join([*told, *self.unresolved])})"

    def __getstate__(self) -> dict[str, object]:
        # A factor belongs to the memory of its system.
        return {name: value for name, value in self.__dict__.items() if name != "_factor"}

    def factor_of(self, system: AnySystem) -> AnyFactor | None:
        """The factor of the Hessian at the point along conditions that decouple, where it is positive; else None.

        system: that of the program; another one has no part in it.
        """
        kept, factor = self.__dict__.get("_factor", (None, None))
        return factor if kept is system else None

    def at(self, program: Program, x: np.ndarray, kept: tuple[AnySystem, AnyFactor] | None = None) -> "Certificate":
        """The same certificate, which knows its point (unknowns,) of a program, and the factor there."""
        fresh = replace(self)
        fresh.__dict__["_point"] = program, x
        if kept is not None:
            fresh.__dict__["_factor"] = kept
        return fresh

    def holds(self, tolerance: float) -> bool:
        """Whether the point is a minimum to a tolerance, as far as first and second derivatives tell.

        That is a decrement of at most tolerance² |f|, so that x is good to about the tolerance, or the rounding of f;
        and the relative figures at most the tolerance. With an inertia that is "unknown" it may be a saddle point.
        """
        return self.inertia != "indefinite" and self.stationary(tolerance)

    def stationary(self, tolerance: float) -> bool:
        """Whether the first-order conditions hold, those of a saddle point too."""
        return not self.wanting(tolerance)

    def wanting(self, tolerance: float) -> str:
        """What of the first-order conditions does not hold to a tolerance, in words; nothing where they hold."""
        checks.not_negative(tolerance, "tolerance")
        if not np.isfinite(self.objective):
            return "the objective, a condition or a derivative is not finite"
        most = max(tolerance * tolerance * abs(self.objective), self.rounding)
        found = []
        if not self.decrement <= most:
            found.append(f"decrement {self.decrement:.2g} ({most:.2g} is small enough)")
        relative = {
            "a violation": self.missed,
            "multipliers off by": self.mismatch,
            "multipliers that press without touching, or to the wrong side,": self.pressing,
        }
        found += [f"{what} {value:.2g} in own units" for what, value in relative.items() if not value <= tolerance]
        told = ", ".join(found) + (f" (tolerance {tolerance:g})" if found else "")
        return "; ".join([*([told] if told else []), *self.unresolved])


NAN = float("nan")
# Of a point: r, the inertia, the decrement, and the part of r that multipliers should cancel.
Seen: TypeAlias = tuple[np.ndarray, str, float, float]

NOWHERE = Certificate(NAN, NAN, NAN, NAN, NAN, "unknown", mismatch=np.inf)


def system_of(program: Program, evaluator: Evaluator, x: np.ndarray) -> AnySystem:
    """The saddle system that suits the structure of a program with linear equalities: condensed, else sparse.

    evaluator: one of the program; x: (unknowns,), where the conditions are linearised.

    >>> from symmotion.program import Evaluator
    >>> program = sm.affine_program(sm.examples.planar_keyframes())
    >>> sm.systems.system_of(program, Evaluator(program), program.x0)
    Condensed(20 of 36 unknowns)
    """
    return Condensed.of(program) or Saddle.of(program, lambda: evaluator.jacobian(x))


def certify(
    program: Program, x: np.ndarray, multipliers: np.ndarray, evaluator: Evaluator | None = None
) -> Certificate:
    """The certificate of a point x (unknowns,) with multipliers (conditions,).

    Raises InputError for other shapes, and for what is no program.

    program: that has them; evaluator: of the program, where there is one already.

    >>> program = sm.affine_program(sm.examples.planar_keyframes())
    >>> sm.certify(program, program.x0, np.zeros(program.conditions)).holds(1e-8)
    False
    """
    if not isinstance(program, Program):
        raise InputError(f"program of type {type(program).__name__}: a Program is needed")
    x = checks.array(x, (program.unknowns,), "x", finite=False)
    multipliers = checks.array(multipliers, (program.conditions,), "multipliers", finite=False)
    if not (np.isfinite(x).all() and np.isfinite(multipliers).all()):
        return NOWHERE
    inspection = Inspection(program, evaluator or Evaluator(program), x, multipliers)
    return inspection.certificate().at(program, x, inspection.kept)


@dataclass(frozen=True, eq=False)
class Inspection:
    """A point x (unknowns,) of a program with multipliers (conditions,), and what its certificate is made of.

    >>> from symmotion.program import Evaluator
    >>> solution = sm.ExactNewton().solve(sm.affine_program(sm.examples.planar_keyframes()))
    >>> evaluator = Evaluator(solution.program)
    >>> inspection = sm.systems.Inspection(solution.program, evaluator, solution.x, solution.multiplier_vector)
    >>> bool(inspection.pressing.all())
    True
    """

    program: Program
    evaluator: Evaluator
    x: np.ndarray
    multipliers: np.ndarray

    __repr__ = in_a_line

    @cached_property
    def kept(self) -> tuple[AnySystem, AnyFactor] | None:
        """The system and its factor, of the certificate once that is made, where a later use can have it."""
        return None

    @cached_property
    def values(self) -> np.ndarray:
        """(conditions,) the values of the conditions at x."""
        return self.evaluator.values(self.x)

    @cached_property
    def jacobian(self) -> sparse.csr_array:
        """(conditions, unknowns) J, the derivatives of the conditions at x."""
        return self.evaluator.jacobian(self.x)

    @cached_property
    def sizes(self) -> sparse.csr_array:
        """(conditions, unknowns) the Jacobian's absolute values."""
        return self._once("sizes", lambda: abs(self.jacobian))

    @cached_property
    def transposed(self) -> sparse.csr_array:
        """(unknowns, conditions) the Jacobian's transpose."""
        return self._once("transposed", lambda: sparse.csr_array(self.jacobian.T))

    def _once(self, name: str, make: Callable[[], sparse.csr_array]) -> sparse.csr_array:
        """What is made of the Jacobian, kept where that is."""
        if not self.program.linear:
            return make()
        structure = self.program.structure
        if name not in structure:
            structure[name] = make()
        return structure[name]

    @cached_property
    def reach(self) -> np.ndarray:
        """(conditions,) by how much each condition changes where the unknowns move by their units."""
        return reach(self.sizes, self.program.unit)

    @cached_property
    def equal(self) -> np.ndarray:
        """(conditions,) whether each is an equality."""
        return self.program.lower == self.program.upper

    @cached_property
    def slack(self) -> np.ndarray:
        """(conditions,) the distance from the bound that a multiplier of this sign belongs to, relative; 0 outside."""
        up = self.program.upper - self.values
        down = self.values - self.program.lower
        nearest = np.where(self.multipliers > 0, up, np.where(self.multipliers < 0, down, np.minimum(up, down)))
        return np.where(self.equal, 0.0, np.clip(nearest / self.reach, 0.0, None))

    @cached_property
    def press(self) -> np.ndarray:
        """(conditions,) the multipliers in units of f."""
        return np.abs(self.multipliers) * self.reach

    @cached_property
    def share(self) -> np.ndarray:
        """(conditions,) the multipliers relative to the heaviest."""
        return self.press / (largest(self.press) or 1.0)

    @cached_property
    def pressing(self) -> np.ndarray:
        """(conditions,) whether a condition is kept by its multiplier: equalities, and bounds that press."""
        return self.equal | (self.share > self.slack)

    @cached_property
    def weak(self) -> np.ndarray:
        """(conditions,) whether a bound is met without a multiplier."""
        met = np.minimum(self.program.upper - self.values, self.values - self.program.lower) / self.reach < WEAK
        return ~self.equal & met & (self.share < WEAK)

    @cached_property
    def undecided(self) -> np.ndarray:
        """(conditions,) whether a bound has neither a slack nor a multiplier that counts beside the other."""
        heaviest = max(largest(self.press), abs(self.evaluator.objective(self.x))) or 1.0
        share = self.press / heaviest
        slack = np.minimum(self.program.upper - self.values, self.values - self.program.lower) / self.reach
        tiny = np.maximum(share, slack) < WEAK
        close = (np.maximum(share, slack) < NEARLY) & (np.minimum(share, slack) > NEARLY * np.maximum(share, slack))
        return ~self.equal & (tiny | close)

    @cached_property
    def rows(self) -> tuple[np.ndarray, bool]:
        """Conditions that press and are independent of each other, and whether some are not."""
        active = np.flatnonzero(self.pressing & ~self.weak)
        scaled = sparse.csr_array(self.jacobian[active] * self.program.unit)
        if not len(active) or _independent(scaled):
            return active, False
        _, r, order = la.qr(scaled.toarray().T, mode="economic", pivoting=True)
        strengths = np.abs(np.diag(r))
        return active[np.sort(order[: int((strengths > DEPENDENT**0.5 * strengths[0]).sum())])], True

    @cached_property
    def shared(self) -> AnySystem | None:
        """The program's own saddle system, where its conditions are linear equalities independent of each other."""
        if not (self.program.equalities_only and self.program.linear):
            return None
        system = system_of(self.program, self.evaluator, self.x)
        return system if not isinstance(system, Saddle) or system.independent else None

    @cached_property
    def pressed(self) -> Pressed | None:
        """The band of the equalities with the bounds that press, where the former decouple and all are independent."""
        program = self.program
        if program.equalities_only:
            return None
        bounded = Bounded(program, self.evaluator.kernels, self.evaluator.threads)
        system = Condensed.of(bounded.framed) if bounded.equal.linear else None
        if system is None or self.rows[1]:
            return None
        return Pressed(bounded, system, self.x, self.jacobian, self.rows[0])

    @cached_property
    def system(self) -> AnySystem:
        """The saddle system of the conditions that press."""
        if self.shared is not None:
            return self.shared
        rows, program = self.rows[0], self.program
        return Saddle(program, self.jacobian[rows] if len(rows) < program.conditions else self.jacobian)

    def certificate(self) -> Certificate:
        """The certificate of the point; NOWHERE where the functions are not finite or nothing factorises."""
        program, evaluator, x = self.program, self.evaluator, self.x
        violation, objective = evaluator.violation(x), evaluator.objective(x)
        pull = self.transposed @ self.multipliers
        if not (np.isfinite(objective) and np.isfinite(pull).all()):
            return NOWHERE
        seen = self._banded(pull) or self._sparse(pull)
        if seen is None:
            return NOWHERE
        residual, inertia, decrement, mismatch = seen
        # Only where a decrement is not far below f may it be rounding that is left.
        rounding = 0.0 if decrement <= EPS * abs(objective) / SLOPPY else evaluator.rounding(x)
        far = np.abs(x) + np.abs(program.whole_shift)
        sums = np.asarray(self.sizes @ far) + np.abs(np.where(self.equal, program.lower, 0.0))
        unseen = SLOPPY * EPS * sums
        missed = np.where(np.abs(violation) <= unseen, 0.0, np.abs(violation) / self.reach)
        slack = self.press * np.minimum(self.slack, 1.0)
        # The minimum may be next to nothing: what counts is what the objective is like elsewhere, too.
        start = 0.0 if program.equalities_only else abs(evaluator.objective(program.x0))
        weight = max(abs(objective), start, largest(self.press)) or 1.0
        quadrature, unresolved = self._quadrature()
        return Certificate(
            objective=objective,
            stationarity=largest(residual),
            violation=largest(violation),
            decrement=decrement,
            complementarity=largest(slack),
            inertia=inertia,
            rounding=rounding,
            mismatch=mismatch,
            missed=largest(missed),
            pressing=largest(slack) / weight,
            weak=tuple(name for name, part in program.split(self.weak).items() if part.any()),
            degenerate=self.shared is None and self.rows[1],
            quadrature=quadrature,
            unresolved=unresolved,
        )

    def _quadrature(self) -> tuple[float, tuple[str, ...]]:
        """The quadrature error, and what is said of the terms that it leaves no digit of."""
        if not isinstance(self.program.design, Integrated):
            return 0.0, ()
        try:
            found = self.program.design.quadratures(self.program, self.x)
        except InputError as error:  # at a point that is no motion, such as one with knots that decrease
            return np.inf, (str(error),)
        useless = {name: q for name, q in found.items() if q.useless}
        # A motion that costs nothing has no digits to lose.
        nothing = self.evaluator.rounding(self.x) if useless else 0.0
        unresolved = [
            f"{name} is {q.value:.3g} with a quadrature error of {q.error:.2g} {q.where}"
            for name, q in useless.items()
            if not q.error <= nothing
        ]
        return float(sum(q.error for q in found.values())), tuple(unresolved)

    def _banded(self, pull: np.ndarray) -> Seen | None:
        """What is seen from the band where the Hessian is positive definite along bounds that press, else None."""
        if self.pressed is None:
            return None
        gradient, hessian = self.pressed.second_order(self.multipliers)
        residual = gradient + pull
        if not (np.isfinite(residual).all() and np.isfinite(hessian).all()):
            return None
        decrement = self.pressed.decrement(hessian, residual)
        if decrement is None:
            return None
        return residual, "positive", decrement, self._mismatch(self.pressed, gradient, residual, hessian)

    def _sparse(self, pull: np.ndarray) -> Seen | None:
        """What is seen from the saddle system of the conditions that press; None where it is not finite."""
        gradient, hessian = self.evaluator.second_order(self.x, self.system.pattern, self.multipliers)
        residual = gradient + pull
        if not (np.isfinite(residual).all() and np.isfinite(hessian).all()):
            return None
        inertia, decrement = self._along(hessian, residual)
        return residual, inertia, decrement, self._mismatch(self.system, gradient, residual, hessian)

    def _along(self, hessian: np.ndarray, residual: np.ndarray) -> tuple[str, float]:
        """The inertia along the conditions that press, and the decrement there."""
        system = self.system
        curvature = system.curvature(hessian)
        inertia = curvature.inertia if curvature.direction is None else self._weakened(curvature.direction)
        factor = system.factorise(hessian)
        if factor is not None and isinstance(system, Condensed):
            # Solves go on from it along conditions that decouple alone.
            self.__dict__["kept"] = system, factor
        if factor is None and inertia != "positive":
            factor, _ = shifted(system, hessian.copy(), self.program.unit, tenfold(LEAST_SHIFT, most=MOST_SHIFT))
        if factor is not None:
            step = system.step(factor, residual)
        elif inertia == "positive" and isinstance(system, Saddle):
            # What is factorised for the steps does not pivot, and may fail where the matrix is regular.
            step = system.pivoted_step(hessian, residual)
        else:
            return inertia, float("nan")
        return inertia, max(0.0, -0.5 * float(residual @ step))

    def _weakened(self, direction: np.ndarray) -> str:
        """indefinite, unless bounds that are met without a multiplier exclude the direction and its opposite."""
        change = (self.jacobian @ direction)[self.weak]
        upper = (self.program.upper - self.values <= self.values - self.program.lower)[self.weak]
        outward = np.where(upper, change, -change)
        return "indefinite" if (outward <= 0).all() or (outward >= 0).all() else "unknown"

    def _mismatch(
        self, system: AnySystem | Pressed, gradient: np.ndarray, residual: np.ndarray, hessian: np.ndarray
    ) -> float:
        """The part of r in the range of Jᵀ, relative to the gradient in the program's own units."""
        unit = self.program.unit
        transposed = system.jacobian.T if isinstance(system, Saddle) else self.transposed
        off = unit * (transposed @ system.multipliers(residual))
        far = largest(self.x / unit)
        floor = SLOPPY * EPS * far * own_size(system, hessian, unit)
        worst = largest(off)
        return 0.0 if worst <= floor else worst / (largest(unit * gradient) or 1.0)


def _independent(jacobian: sparse.csr_array) -> bool:
    """Whether the rows are independent, up to rounding."""
    size = np.sqrt(np.asarray(jacobian.multiply(jacobian).sum(axis=1)).ravel())
    if not size.all():
        return False
    rows = sparse.csr_array(jacobian / size[:, None])
    try:
        pivots = np.abs(sparse.linalg.splu(sparse.csc_array(rows @ rows.T)).U.diagonal())
    except RuntimeError:
        return False
    return bool(pivots.min() > DEPENDENT)
