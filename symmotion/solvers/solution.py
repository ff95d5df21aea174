"""What every solver returns: a point with multipliers, our certificate of it, and how it came about."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from enum import StrEnum
from functools import cached_property
from os import PathLike
from typing import Any, Generic

import numpy as np

from symmotion import checks
from symmotion.brief import in_a_line
from symmotion.errors import InputError, SolveError
from symmotion.pictures import as_html, plot_solution
from symmotion.program import (
    Design,
    DesignT,
    Evaluator,
    Excess,
    Integrated,
    MotionT,
    Multipliers,
    Program,
    Quadrature,
)
from symmotion.program.program import Telling
from symmotion.program.state import made_of
from symmotion.saving import save_beside
from symmotion.solvers.sensitivity import Sensitivity
from symmotion.systems import Certificate
from symmotion.systems.certificate import DIGITS


class Status(StrEnum):
    """How a solve ended. Only SOLVED means that the certificate holds to the solver's tolerance.

    SADDLE: the first-order conditions hold, and the certificate has a direction in which the objective falls.
    INFEASIBLE: the violation cannot be lowered from nearby; the message names the conditions that contradict.

    >>> short = sm.ExactNewton(max_iterations=1).solve(sm.affine_program(sm.examples.planar_keyframes()))
    >>> short.status is sm.solvers.Status.ITERATION_LIMIT
    True
    """

    SOLVED = "solved"
    SADDLE = "saddle"
    ITERATION_LIMIT = "iteration-limit"
    TIME_LIMIT = "time-limit"
    STOPPED = "stopped"
    STALLED = "stalled"
    DIVERGED = "diverged"
    INFEASIBLE = "infeasible"
    FAILED = "failed"
    UNSUPPORTED = "unsupported"


def is_certified(status: str, inertia: str) -> bool:
    """Whether that is a strict local minimum, to the solver's tolerance."""
    return status == Status.SOLVED and inertia == "positive"


def ending(status: str, inertia: str) -> str:
    """How a solve ended, for a reader: what is not certified is not called solved without a word on why."""
    return f"{status}, but {inertia}" if status == Status.SOLVED and inertia != "positive" else str(status)


@dataclass(frozen=True)
class Iteration:
    """One row of a solver's log; None where the solver does not tell.

    stationarity and violation are as in the certificate, for IPOPT its own (scaled) figures.
    theta: share of the exact Hessian in the matrix factorised for the step taken from here;
    step: its length; inertia: of the exact Hessian; evaluate, linear: seconds of this iteration.

    objective: f there.

    >>> solution = sm.ExactNewton().solve(sm.affine_program(sm.examples.planar_keyframes()))
    >>> solution.log[-1].stationarity < solution.log[0].stationarity
    True
    """

    objective: float
    stationarity: float
    violation: float
    theta: float | None = None
    step: float | None = None
    inertia: str | None = None
    evaluate: float | None = None
    linear: float | None = None

    __repr__ = in_a_line


@dataclass(frozen=True)
class Seconds:
    """Wall-clock seconds: building the program, deriving its functions, solving, and of that the two main parts.

    build, compile, solve, evaluate, linear: None where not told.

    >>> solution = sm.ExactNewton().solve(sm.affine_program(sm.examples.planar_keyframes()))
    >>> solution.seconds.solve > 0
    True
    """

    build: float | None = None
    compile: float | None = None
    solve: float | None = None
    evaluate: float | None = None
    linear: float | None = None

    __repr__ = in_a_line

    @property
    def total(self) -> float:
        """Build, compile and solve together."""
        return (self.build or 0.0) + (self.compile or 0.0) + (self.solve or 0.0)


@dataclass(frozen=True)
class Round:
    """One solve of an exchange, see `solvers.exchange`.

    times: by constraint, at how many times it was held; excess: by constraint, certified or sampled, of what came out.

    objective: f at its end; iterations: of that solve.

    >>> keys = sm.examples.random_keyframes(4, 60, seed=1)
    >>> solution = sm.ExactNewton().solve(sm.orientation_program(keys, constraints=[sm.RateBound(1.2)], refine=2))
    >>> float(solution.exchange.rounds[-1].excess["rate bound"]) < 1e-6
    True
    """

    times: Mapping[str, int]
    excess: Mapping[str, Excess]
    objective: float
    iterations: int

    __repr__ = in_a_line

    @property
    def worst(self) -> float:
        """The largest excess."""
        return max(e.value for e in self.excess.values())


@dataclass(frozen=True)
class Course:
    """How bounds came to hold everywhere: tolerance, of their excess; rounds, all solves, the solution's the last.

    >>> keys = sm.examples.random_keyframes(4, 60, seed=1)
    >>> solution = sm.ExactNewton().solve(sm.orientation_program(keys, constraints=[sm.RateBound(1.2)], refine=2))
    >>> len(solution.exchange.rounds) > 1
    True
    """

    tolerance: float
    rounds: tuple[Round, ...]

    @property
    def before(self) -> Mapping[str, Excess]:
        """By constraint, the excess after the first solve."""
        return self.rounds[0].excess

    @property
    def after(self) -> Mapping[str, Excess]:
        """By constraint, the excess of the solution."""
        return self.rounds[-1].excess

    @property
    def holds(self) -> bool:
        """Whether nothing is exceeded by more than the tolerance."""
        return self.rounds[-1].worst <= self.tolerance

    def __repr__(self) -> str:
        first, last = self.rounds[0].worst, self.rounds[-1].worst
        return f"Course({len(self.rounds)} rounds, excess {first:.2g} → {last:.2g}, tolerance {self.tolerance:.0e})"

    def __str__(self) -> str:
        lines = [f"exchange: {len(self.rounds)} rounds, to an excess of {self.tolerance:.0e}"]
        for k, r in enumerate(self.rounds):
            held = ", ".join(
                f"{name} at {n} times, {r.excess[name].kind} excess {r.excess[name].value:.2g}"
                for name, n in r.times.items()
            )
            lines.append(f"  {k}: objective {r.objective:.9g}, {r.iterations} iterations; {held}")
        return "\n".join(lines)


@dataclass(frozen=True, eq=False)
class Solution(Generic[DesignT]):
    """A solver's answer to a program.

    x (unknowns,), multiplier_vector (conditions,): where it ended; solver: the solver's repr,
    its provenance; method: its short name; tolerance: the solver's; log: its iterations;
    message: what it said where it did not solve, or of how many digits the objective is where these are not ten;
    evaluations: how often what was evaluated, by kind, where known.
    exchange: how bounds that are meant for all times came to hold; None of programs without.
    interrupted: whether a callback or the time limit ended it, with a solution or without, so that it may end
    elsewhere another time. claimed: whether the solver itself reported success, whatever the certificate says of it.

    status, certificate, seconds: how it ended, what symmotion computed there, and how long it took. Of the certificate
    `objective`, `stationarity`, `violation` and `inertia` stand here too. Raises
    InputError where the motion of several bodies is asked for as one.

    >>> solution = sm.ExactNewton().solve(sm.affine_program(sm.examples.planar_keyframes())).require()
    >>> solution.motion, solution.multipliers["keyframes"].linear.shape
    (AffineMotion(2D, degree 3, 9 controls, times 0 to 1), (4, 2, 2))
    """

    program: Program[DesignT]
    solver: str
    method: str
    status: Status
    x: np.ndarray
    multiplier_vector: np.ndarray
    certificate: Certificate
    tolerance: float
    log: tuple[Iteration, ...]
    seconds: Seconds
    message: str = ""
    evaluations: Mapping[str, int] = field(default_factory=dict)
    exchange: Course | None = None
    interrupted: bool = False
    claimed: bool = True

    __getstate__ = made_of

    @property
    def motion(self: "Solution[Design[MotionT]]") -> MotionT:
        """The motion that the unknowns describe."""
        # Kept by hand: a cached property has one type, not that of the design.
        if "_motion" not in self.__dict__:
            self.__dict__["_motion"] = self.program.design.motion(self.program.unpack(self.x))
        return self.__dict__["_motion"]

    # Any: the bodies' kinds differ.
    @property
    def motions(self) -> Mapping[str, Any]:
        """The motions by body, of a program that joins several."""
        motion: object = self.motion
        if not isinstance(motion, Mapping):
            raise InputError("this solution has one motion: .motion")
        return motion

    @property
    def notes(self) -> tuple[str, ...]:
        """What there is to say of what the program was given, and of the motion: that it squeezes a rigid body."""
        return (*self.program.notes, *self._told)

    @cached_property
    def _told(self) -> tuple[str, ...]:
        design = self.program.design
        return design.told(self.motion) if isinstance(design, Telling) else ()

    @cached_property
    def multipliers(self) -> Multipliers:
        """Multipliers by constraint; those of "keyframes" in the keyframes' shape, `.linear` and `.translation`."""
        return self.program.design.multipliers(self.program.shown(self.multiplier_vector))

    @cached_property
    def terms(self) -> dict[str, float]:
        """The value of each term of the objective."""
        return Evaluator(self.program).terms_at(self.x)

    @property
    def objective(self) -> float:
        """f, the certificate's value of the objective."""
        return self.certificate.objective

    @property
    def stationarity(self) -> float:
        """‖∇f + Jᵀλ‖∞ of the certificate."""
        return self.certificate.stationarity

    @property
    def violation(self) -> float:
        """‖g‖∞ of the certificate, by how much a condition is missed at most, in its own units."""
        return self.certificate.violation

    @property
    def inertia(self) -> str:
        """Of the certificate: "positive" (a strict local minimum), "flat", "indefinite" or "unknown"."""
        return self.certificate.inertia

    @property
    def certified(self) -> bool:
        """Whether it is a strict local minimum, to the solver's tolerance."""
        return is_certified(self.status, self.inertia)

    @property
    def ended(self) -> str:
        """How it ended, see `ending`."""
        return ending(self.status, self.inertia)

    @property
    def quadrature_error(self) -> float:
        """By how much the objective may miss the integrals that it stands for; see `quadratures`."""
        return self.certificate.quadrature

    @cached_property
    def quadratures(self) -> Mapping[str, Quadrature]:
        """By term that is an integral: its value by Gauss nodes, the error of that, and where it is known least."""
        design = self.program.design
        return design.quadratures(self.program, self.x) if isinstance(design, Integrated) else {}

    @property
    def iterations(self) -> int:
        """Steps taken."""
        return sum(i.step is not None for i in self.log)

    @property
    def convergence_order(self) -> float | None:
        """Estimated order of convergence, log(r₂/r₁)/log(r₁/r₀) of the last stationarities clear of rounding.

        None where there are not three that fall, each to less than half.
        """
        floor = 1e-13 * max((i.stationarity for i in self.log), default=0.0)
        r = [i.stationarity for i in self.log if i.stationarity > floor][-3:]
        if len(r) < 3 or not (r[2] < 0.5 * r[1] < 0.25 * r[0]):
            return None
        return float(np.log(r[-1] / r[-2]) / np.log(r[-2] / r[-3]))

    def require(self, tolerance: float | None = None) -> "Solution[DesignT]":
        """This solution, if it is a minimum to `tolerance` (the solver's own when left out), else SolveError.

        See `Certificate.holds`.
        """
        tolerance = self.tolerance if tolerance is None else checks.not_negative(tolerance, "tolerance")
        c = self.certificate
        if c.holds(tolerance):
            return self
        if c.stationary(tolerance):
            raise SolveError(f"{self.solver}: a saddle point, the Hessian is indefinite along the conditions")
        raise SolveError(
            f"{self.solver}: {self.status}, {c.wanting(tolerance)}{': ' + self.message if self.message else ''}"
        )

    def sensitivity(self) -> Sensitivity:
        """How the minimum moves with keyframes, limits, parameters, samples and weights; see `Sensitivity`.

        The KKT matrix is factorised once, and kept. Raises SolveError where this is no strict minimum, and
        InputError that names bounds that are met without a multiplier, where derivatives are one-sided.

            moved = solution.x + solution.sensitivity().tangent("keyframes", change)
        """
        self.require()
        if "_sensitivity" not in self.__dict__:
            self.__dict__["_sensitivity"] = Sensitivity.of(self.program, self.x, self.multiplier_vector)
        return self.__dict__["_sensitivity"]

    def save(self, path: str | PathLike[str]) -> None:
        """Write the motion as its own `save` does, with the multipliers and the certificate beside it.

        `sm.load` makes the motion of it, bit for bit. Under "solution" stand status, solver, objective, tolerance and
        message, "multipliers" by constraint in the shape that they have here, and "certificate" with the excess of
        every bound; what is not finite is null. Raises InputError for a path that cannot be written, and for several
        bodies, each of which has a motion of its own.

        >>> solution = sm.ExactNewton().solve(sm.affine_program(sm.examples.planar_keyframes()))
        >>> solution.save("solution.json")
        >>> sm.load("solution.json") == solution.motion
        True
        """
        motion: object = self.motion
        if isinstance(motion, Mapping):
            raise InputError(f"{path}: several bodies: save solution.motions[{next(iter(motion))!r}] and the others")
        excess = {name: asdict(found) for name, found in self.certificate.excess.items()}
        save_beside(
            motion,
            path,
            {
                "status": str(self.status),
                "solver": self.solver,
                "objective": self.objective,
                "tolerance": self.tolerance,
                "message": self.message,
                "multipliers": self.multipliers,
                "certificate": {**asdict(self.certificate), "excess": excess},
            },
        )

    plot = plot_solution
    _repr_html_ = as_html

    def __repr__(self) -> str:
        c = self.certificate
        rough = f" ± {c.quadrature:.1e} (quadrature: {c.digits} digits)" if c.digits < DIGITS else ""
        objective = f"{c.objective:.9g}{rough}"
        enough = self.tolerance if self.exchange is None else max(self.tolerance, self.exchange.tolerance)
        name, worst = max(c.excess.items(), key=lambda item: item[1].value, default=("", None))
        told = "".join(f"; {note.partition(': singular')[0]}" for note in self._told)
        over = f", {worst.kind} excess {worst.value:.1e} of {name}" if worst and worst.value > enough else ""
        return (
            f"Solution({self.method}: {self.status}, objective {objective}, stationarity {c.stationarity:.1e}, "
            f"violation {c.violation:.1e}, inertia {c.inertia}{over}, {self.iterations} iterations{told})"
        )
