"""What a solver is, and what every solver begins and ends with."""

from collections.abc import Callable, Sequence
from functools import wraps
from typing import ParamSpec, Protocol, TypeVar, cast

import numpy as np

from symmotion import checks, interrupts
from symmotion.brief import in_a_line
from symmotion.errors import InputError
from symmotion.forking import LIBRARIES
from symmotion.program import DesignT, Evaluator, Program
from symmotion.program.program import require_program
from symmotion.solvers.journal import Failure
from symmotion.solvers.solution import Iteration, Seconds, Solution, Status
from symmotion.systems import certify, conflict, conflicting
from symmotion.systems.certificate import DIGITS
from symmotion.values import read_only, value

# Endings that may be those of conditions that cannot hold; others are the caller's wish.
OF_ITSELF = (Status.FAILED, Status.STALLED, Status.DIVERGED, Status.ITERATION_LIMIT)
MORE_NODES = "program.refined(solution.x) has more Gauss nodes, as has gauss_nodes=None where they are stated"

P = ParamSpec("P")
T = TypeVar("T")


class Judged(Protocol):
    """Whose answers are judged to a tolerance, see `Certificate.holds`; its repr is the provenance of what it finds."""

    @property
    def tolerance(self) -> float:
        """What the certificate's numbers are held to, relative to the program's units."""
        ...


class Solver(Judged, Protocol):
    """What solves programs; its repr tells its options.

    >>> solver: sm.solvers.Solver = sm.ExactNewton()
    >>> solver.solve(sm.affine_program(sm.examples.planar_keyframes())).certified
    True
    """

    @property
    def max_iterations(self) -> int:
        """After how many iterations it gives up."""
        ...

    def solve(self, program: Program[DesignT], start: object = None) -> Solution[DesignT]:
        """The solution, whether it is solved or not; start: as `start_vector` takes it.

        Raises InputError for a program that it does not take.
        """
        ...


def solving(function: Callable[P, T]) -> Callable[P, T]:
    """A solver's method `solve`: what is not finite is told by the status; Ctrl-C and forks come between its steps.

    The steps call `Journal.ending`, or `interrupts.check`.
    """

    @wraps(function)
    def guarded(*arguments: P.args, **options: P.kwargs) -> T:
        with LIBRARIES, interrupts.kept(), np.errstate(all="ignore"):
            return function(*arguments, **options)

    return guarded


def require_solver(value: object, *names: str) -> Solver:
    """The value; InputError unless it has a method solve, and attributes of these names."""
    if isinstance(value, type):
        raise InputError(f"solver {value.__name__} is a class: {value.__name__}() makes one")
    if not callable(getattr(value, "solve", None)):
        raise InputError(f"solver {value!r} has no method solve")
    for name in names:
        if not hasattr(value, name):
            raise InputError(f"solver {value!r} has no {name}, which every solver has")
    return cast(Solver, value)


@value
class Guess:
    """A start with multipliers: x (unknowns,) and λ (conditions,), those of bounds zero where none presses.

    Raises InputError for what are no numbers; a solver does for other lengths.

    >>> program = sm.affine_program(sm.examples.planar_keyframes())
    >>> guess = sm.solvers.Guess(program.x0, np.zeros(program.conditions))
    >>> sm.ExactNewton().solve(program, guess).certified
    True
    """

    x: np.ndarray
    multipliers: np.ndarray

    __repr__ = in_a_line

    def __post_init__(self):
        for name in ("x", "multipliers"):
            given = checks.numbers(getattr(self, name), f"{name} of a guess").copy()
            object.__setattr__(self, name, read_only(given))


def start_vector(program: Program, start: object) -> np.ndarray:
    """(unknowns,) a start as x: None for the program's own, a Solution, a Guess, a motion, or (unknowns,) numbers.

    Raises InputError for a start of another length or kind, or that is not finite.

    >>> program = sm.affine_program(sm.examples.planar_keyframes())
    >>> sm.solvers.start_vector(program, None).shape
    (36,)
    """
    require_program(program)
    if start is None:
        return program.x0
    if isinstance(start, Solution):
        if start.program.structure is program.structure:
            # Keyframes that moved carry the start value along; the solution follows it.
            return start.x + (program.x0 - start.program.x0)
        start = start.motion
    if isinstance(start, Guess):
        start = start.x
    if isinstance(start, np.ndarray | Sequence):
        return checks.array(start, (program.unknowns,), "start")
    return program.pack(program.design.unknowns(start))


def start_multipliers(program: Program, start: object) -> np.ndarray | None:
    """(conditions,) the multipliers that a start brings along: a guess, a solution of a program of the same structure.

    Raises InputError for a guess of another program.

    >>> solution = sm.ExactNewton().solve(sm.affine_program(sm.examples.planar_keyframes()))
    >>> sm.solvers.start_multipliers(solution.program, solution).shape
    (16,)
    """
    if isinstance(start, Solution) and start.program.structure is program.structure:
        return start.multiplier_vector
    if isinstance(start, Guess):
        return checks.array(start.multipliers, (program.conditions,), "multipliers of the start")
    return None


def require_equalities(program: Program, solver: str, curved: bool = False) -> None:
    """Raise InputError that names the first constraint that a solver for (linear) equalities cannot take.

    curved: whether it takes nonlinear equalities.

    program: what it is asked to solve; solver: its name, for the message.

    >>> sm.solvers.require_equalities(sm.affine_program(sm.examples.planar_keyframes()), "mine")
    """
    for c in require_program(program).constraints:
        if not c.is_equality or not (curved or c.block.kernel.linear):
            nature = "an inequality" if not c.is_equality else "nonlinear"
            taken = "equalities" if curved else "linear equalities"
            raise InputError(
                f"{solver} takes {taken} only and {c.name!r} is {nature}; ExactNewton() and Ipopt() take it"
            )


def conclude(
    program: Program[DesignT],
    solver: Judged,
    x: np.ndarray,
    multipliers: np.ndarray,
    *,
    method: str = "",
    log: Sequence[Iteration] = (),
    seconds: Seconds | None = None,
    failure: Failure | None = None,
    evaluator: Evaluator | None = None,
) -> Solution[DesignT]:
    """A Solution with its certificate, which decides whether it is SOLVED.

    x (unknowns,), multipliers (conditions,): where the solver ended, with L = f + λᵀg.
    method: the solver's short name, of its class when left out; failure: what the solver says went wrong, None where
    it claims success; evaluator: one of the program, if there is one.

    log: its iterations; seconds: what it measured, by name.

    Raises InputError for x and multipliers of other lengths.

    >>> from symmotion.solvers import conclude
    >>> program = sm.affine_program(sm.examples.planar_keyframes())
    >>> conclude(program, sm.ExactNewton(), program.x0, np.zeros(program.conditions)).certified
    False
    """
    require_program(program)
    counts = dict(evaluator.counts) if evaluator else {}
    interrupted = failure is not None and failure[0] in (Status.STOPPED, Status.TIME_LIMIT)
    claimed = failure is None
    certificate = certify(program, x, multipliers, evaluator)
    wanting = certificate.wanting(solver.tolerance)
    if wanting and failure is None:
        failure = Status.FAILED, f"the solver reports success, the certificate does not agree: {wanting}"
    if not wanting:
        # Whatever stopped the solver.
        failure = None
        if certificate.inertia == "indefinite":
            failure = Status.SADDLE, "the Hessian is indefinite along the conditions"
    missed = certificate.missed > solver.tolerance or not np.isfinite(certificate.objective)
    if failure is not None and failure[0] in OF_ITSELF and missed:
        names = conflicting(program, x, evaluator)
        failure = (failure[0], f"{failure[1]}: {conflict(program, names)}") if names else failure
    status, message = failure or (Status.SOLVED, "")
    if not wanting and certificate.digits < DIGITS:
        rough = f"the objective has {certificate.digits} digits, not ten: {MORE_NODES}"
        message = f"{message}; {rough}" if message else rough
    return Solution(
        program,
        repr(solver),
        method or type(solver).__name__.lower(),
        status,
        x,
        multipliers,
        certificate,
        solver.tolerance,
        tuple(log),
        seconds or Seconds(),
        message,
        counts,
        interrupted=interrupted,
        claimed=claimed,
    )
