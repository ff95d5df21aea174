"""IPOPT on the same programs, with the batched derivatives of their kernels."""

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import InitVar, dataclass, field, replace
from math import inf
from typing import Any, TypeAlias

import casadi as ca
import numpy as np

from symmotion.checks import told
from symmotion.errors import InputError
from symmotion.forking import ForkedLock, Section
from symmotion.kernels import Kernels
from symmotion.program import DesignT, Evaluator, Program
from symmotion.solvers.exchanging import exchange
from symmotion.solvers.journal import Callback, Journal
from symmotion.solvers.options import require_kernels, require_limits
from symmotion.solvers.oracle import Kept, Watcher, oracles
from symmotion.solvers.solution import Iteration, Seconds, Solution, Status
from symmotion.solvers.solver import Solver, conclude, solving, start_multipliers, start_vector
from symmotion.solvers.units import OwnUnits

IpoptOption: TypeAlias = str | float | int
# What CasADi hands back of a solve. Any: numbers, texts and lists, by name.
Stats: TypeAlias = dict[str, Any]
# IPOPT's names for what the solver's own arguments say.
TAKEN = {"tol": "tolerance", "max_iter": "max_iterations", "max_wall_time": "time_limit"}
# From a solution of a neighbouring program: its multipliers, and a barrier that lets it stay near its bounds.
WARM: dict[str, IpoptOption] = {
    "warm_start_init_point": "yes",
    "warm_start_bound_push": 1e-9,
    "warm_start_slack_bound_push": 1e-9,
    "warm_start_mult_bound_push": 1e-9,
    "mu_init": 1e-6,
}
# What CasADi tells and does not tell.
CASADI = {"print_time": False, "record_time": True, "show_eval_warnings": False}
# `Opti` differentiates and expands while it solves, without the interpreter's lock: two at a time crash.
SYMBOLIC = ForkedLock()
RUNNING = Section("IPOPT")
# IPOPT's own test against that of the certificate, which does not depend on units: an iteration more.
FINER = 1e-4
ENDINGS = {
    "Maximum_Iterations_Exceeded": Status.ITERATION_LIMIT,
    "Maximum_WallTime_Exceeded": Status.TIME_LIMIT,
    "Search_Direction_Becomes_Too_Small": Status.STALLED,
    "Diverging_Iterates": Status.DIVERGED,
}


@dataclass(frozen=True)
class Ipopt:
    """IPOPT (interior point, filter line search) through CasADi; takes inequalities and nonlinear constraints.

    tolerance: of the certificate, see `Certificate.holds`; IPOPT itself goes on to a ten-thousandth of it.
    kernels, threads, time_limit: as ExactNewton's. callback: called with every `Iteration`, IPOPT's own figures, before
        the step from there is known; where it returns True the solve stops.
    options: IPOPT's own by their own names, {"mu_strategy": "adaptive"}; InputError where IPOPT refuses them.

    max_iterations, tolerance: IPOPT's, ended by the certificate.

    derivatives: of 0.1.0; an InputError says what takes its place.

    >>> solver = sm.Ipopt(options={"mu_strategy": "adaptive"})
    >>> solver.solve(sm.affine_program(sm.examples.planar_keyframes())).require().certified
    True
    """

    tolerance: float = 1e-8
    max_iterations: int = 1000
    derivatives: InitVar[str | None] = None
    kernels: Kernels = "auto"
    threads: int | None = None
    time_limit: float | None = None
    callback: Callback | None = field(default=None, repr=False, compare=False)
    options: Mapping[str, IpoptOption] = field(default_factory=dict, hash=False)

    def __post_init__(self, derivatives: str | None):
        if derivatives is not None and not (isinstance(derivatives, str) and derivatives == "mapped"):
            raise InputError(f"derivatives {told(derivatives)}: the comparator is symmotion.solvers.PlainIpopt() now")
        require_limits(self.tolerance, self.max_iterations, self.time_limit, self.callback)
        require_kernels(self.kernels, self.threads)
        object.__setattr__(self, "options", checked_options(self.options))

    @solving
    def solve(self, program: Program[DesignT], start: object = None) -> Solution[DesignT]:
        """Solve any program; start: None, a Solution with its multipliers, a motion, or (unknowns,) numbers.

        Bounds that are meant for all times hold at all: see `exchange`.
        """
        whole = Journal(self.max_iterations)
        return exchange(program, lambda p, s: self._at_times(p, s, whole.elapsed), start)

    def _at_times(self, program: Program[DesignT], start: object, spent: float = 0.0) -> Solution[DesignT]:
        """The solution of a program with its bounds held at the times that it has; spent: seconds before."""
        journal = Journal(self.max_iterations, self.time_limit, self.callback, spent)
        kept = Kept()
        x0 = start_vector(program, start)
        known = start_multipliers(program, start)
        evaluator = Evaluator(program, self.kernels, self.threads)
        settings = {**ipopt_settings(self, journal), **constants(program)}
        settings = {**settings, **({} if known is None else WARM), **self.options}
        answer = _solved(evaluator, settings, x0, known, journal, kept, FINER * self.tolerance)
        solution = concluded(self, program, "ipopt", answer, journal, evaluator)
        if solution.status is not Status.FAILED or answer.stats.get("return_status") != "Solve_Succeeded":
            return solution
        # Where its own test, of the gradient, is passed before the certificate's: on from there, a hundred times finer.
        finer = {name: 1e-2 * FINER * self.tolerance for name in ("tol", "dual_inf_tol")}
        near = answer.x, answer.multipliers
        answer = _solved(evaluator, {**settings, **WARM, **finer}, *near, journal, kept, FINER * self.tolerance)
        again = concluded(self, program, "ipopt", answer, journal, evaluator)
        return replace(again, log=solution.log + again.log) if again.status is Status.SOLVED else solution


@dataclass(frozen=True, eq=False)
class IpoptAnswer:
    """Where IPOPT ended, the multipliers there, what CasADi tells of the solve, and seconds in the functions.

    own: the units of the solve, in which its log is.
    """

    x: np.ndarray
    multipliers: np.ndarray
    stats: Stats
    evaluate: float
    own: OwnUnits


def checked_options(options: Mapping[str, IpoptOption]) -> dict[str, IpoptOption]:
    """A copy of options for IPOPT; InputError that names one that cannot be, as far as that is seen from here."""
    if not isinstance(options, Mapping):
        raise InputError(f"options {options!r}: IPOPT's own by name are needed, {{'mu_strategy': 'adaptive'}} say")
    for name, value in options.items():
        if not isinstance(name, str) or name.startswith("ipopt."):
            raise InputError(f"option {name!r}: IPOPT's own name is needed, such as 'mu_strategy'")
        if name in TAKEN:
            raise InputError(f"option {name!r}: this is what the solver's argument {TAKEN[name]} says")
        if not isinstance(value, str | int | float) or isinstance(value, bool) or not _accepted(name, value):
            raise InputError(f"option {name!r}: {value!r}: IPOPT has no such option, or does not take this value")
    return dict(options)


def _accepted(name: str, value: IpoptOption) -> bool:
    """Whether IPOPT takes an option: on x² = min, which tells of missing linear solvers too."""
    x = ca.SX.sym("x")
    quiet = {"ipopt.print_level": 0, "ipopt.sb": "yes", "print_time": False}
    with RUNNING, SYMBOLIC:
        try:
            trial = ca.nlpsol("trial", "ipopt", {"x": x, "f": x**2}, {**quiet, f"ipopt.{name}": value})
            trial(x0=1.0)
        except RuntimeError:
            return False
        return trial.stats()["return_status"] != "Invalid_Option"


def ipopt_settings(solver: Solver, journal: Journal) -> dict[str, IpoptOption]:
    """IPOPT's options by its own names for a program in own units."""
    settings: dict[str, IpoptOption] = {
        "print_level": 0,
        "sb": "yes",
        "tol": FINER * solver.tolerance,
        "dual_inf_tol": FINER * solver.tolerance,
        "constr_viol_tol": FINER * solver.tolerance,
        "acceptable_iter": 0,
        "max_iter": solver.max_iterations,
    }
    return settings if journal.left == inf else {**settings, "max_wall_time": max(journal.left, 1e-6)}


def constants(program: Program) -> dict[str, IpoptOption]:
    """What IPOPT need not ask for twice: Jacobians of linear conditions, the Hessian of a quadratic program."""
    found: dict[str, IpoptOption] = {}
    for name, equal in (("jac_c_constant", True), ("jac_d_constant", False)):
        parts = [c.block.kernel for c in program.constraints if c.is_equality is equal]
        if parts and all(k.linear for k in parts):
            found[name] = "yes"
    if program.linear and all(b.kernel.linear if b.kernel.squares else b.kernel.quartic for b in program.terms):
        found["hessian_constant"] = "yes"
    return found


def _solved(
    evaluator: Evaluator,
    settings: Mapping[str, IpoptOption],
    x0: np.ndarray,
    known: np.ndarray | None,
    journal: Journal,
    kept: Kept,
    tolerance: float,
) -> IpoptAnswer:
    """IPOPT on the functions of an Evaluator, in own units: it scales what is large down, not what is small up.

    known: multipliers (conditions,) to start from; tolerance: of IPOPT's own test.
    """
    program = evaluator.program
    evaluator.prepare("value", "gradient", "hessian")
    own = OwnUnits.of(evaluator, x0, tolerance)
    functions = oracles(evaluator, kept, own)
    watch = Watcher(program.unknowns, program.conditions, journal, kept) if journal.watched else None
    options = {
        **{f"ipopt.{name}": value for name, value in settings.items()},
        **{name: f for name, f in functions.items() if name != "nlp"},
        **({} if watch is None else {"iteration_callback": watch}),
        **CASADI,
        "calc_lam_p": False,
        "no_nlp_grad": True,
    }
    solver = ca.nlpsol("solver", "ipopt", functions["nlp"], options)
    evaluator.seconds = 0.0
    duals = {} if known is None else {"lam_g0": known / own.multipliers, "lam_x0": np.zeros_like(x0)}
    bounds = {"lbg": program.lower / own.conditions, "ubg": program.upper / own.conditions}
    with RUNNING, watching(watch, solver.stats, own):
        result = solver(x0=x0 / own.unknowns, **bounds, **duals)
    kept.check()
    x = own.unknowns * np.asarray(result["x"]).ravel()
    multipliers = own.multipliers * np.asarray(result["lam_g"]).ravel()
    return IpoptAnswer(x, multipliers, solver.stats(), evaluator.seconds, own)


@contextmanager
def watching(watch: Watcher | None, stats: Callable[[], Stats], own: OwnUnits) -> Iterator[None]:
    """A solve during which the watcher asks for rows of the log there."""
    if watch is None:
        yield
        return
    watch.rows = lambda: logged(stats(), own)
    try:
        yield
    finally:
        # The solver holds the watcher: a circle that goes through CasADi is never freed.
        watch.rows = list


def concluded(
    solver: Solver,
    program: Program[DesignT],
    method: str,
    answer: IpoptAnswer,
    journal: Journal,
    evaluator: Evaluator,
) -> Solution[DesignT]:
    """The Solution that IPOPT's answer is."""
    journal.solved()
    elapsed, said = journal.elapsed, str(answer.stats.get("return_status", "no status"))
    failure = None if said == "Solve_Succeeded" else (ENDINGS.get(said, Status.FAILED), said)
    if said == "User_Requested_Stop":
        failure = journal.ending() or failure
    total = float(answer.stats.get("t_wall_total", elapsed))
    # Opti derives its functions at the first solve: what is not IPOPT's own time is compilation.
    spent = Seconds(program.build_seconds, elapsed - total, total, answer.evaluate, total - answer.evaluate)
    return conclude(
        program,
        solver,
        answer.x,
        answer.multipliers,
        method=method,
        log=logged(answer.stats, answer.own),
        seconds=spent,
        failure=failure,
        evaluator=evaluator,
    )


def logged(stats: Stats, own: OwnUnits) -> list[Iteration]:
    """The rows of IPOPT's log: the objective, and in own units what IPOPT says of gradient and violation."""
    history = stats.get("iterations") or {}
    objective, dual, primal, step = (history.get(key, []) for key in ("obj", "inf_du", "inf_pr", "alpha_pr"))
    # IPOPT lists with each iterate the step that led there; our rows hold the one taken from there.
    steps = [*step[1:], None]
    rows = zip(objective, dual, primal, steps, strict=False)
    return [Iteration(own.objective * row[0], *row[1:3], step=row[3]) for row in rows]
