"""What a user would pick instead of symmotion, on the same problem: minimum rigidity through rigid keyframes in space.

Each is written from symbols, as its documentation suggests, and takes from the program the keyframes,
the spline basis and the start only. All are judged by symmotion's certificate.
"""

from dataclasses import dataclass, replace
from time import perf_counter
from typing import Any, Literal, Protocol

import casadi as ca
import numpy as np
from scipy import sparse

import symmotion as sm
from symmotion.solvers import Iteration, Seconds, Status, conclude

ENTRIES = 9  # of a control matrix in space, the channels of the problem
NODES = 6  # Gauss nodes per span: exact for the integrand of degree 10 of a cubic

# Their own tests of convergence against the certificate's, which does not depend on units; as of `Ipopt`.
FINER = 1e-4


@dataclass(frozen=True, eq=False)
class Answer:
    """What a method hands back, before it is judged.

    x (unknowns,); multipliers (conditions,) of L = f + λᵀg; said: empty where the method claims success;
    unknowns: how many its own formulation has.
    """

    x: np.ndarray
    multipliers: np.ndarray
    seconds: Seconds
    iterations: int | None
    said: str
    unknowns: int


class Alternative(Protocol):
    """A way to solve the problem; its repr is its provenance."""

    @property
    def tolerance(self) -> float: ...

    @property
    def name(self) -> str: ...

    def attempt(self, program: sm.program.Program) -> Answer: ...


def judge(program: sm.program.Program, method: Alternative, answer: Answer) -> sm.Solution:
    """The answer as a Solution with symmotion's certificate, which decides whether it is solved."""
    failure = (Status.FAILED, answer.said) if answer.said else None
    # Of its way only the number of steps is known: every row but the last has one.
    unknown = Iteration(np.nan, np.nan, np.nan)
    log = [replace(unknown, step=np.nan)] * answer.iterations + [unknown] if answer.iterations is not None else []
    return conclude(
        program,
        method,
        answer.x,
        answer.multipliers,
        method=method.name,
        log=log,
        seconds=answer.seconds,
        failure=failure,
    )


@dataclass(frozen=True, eq=False)
class Tables:
    """The problem in numbers: basis (n, spans · NODES) and rates there, weights (1, spans · NODES), all nodes in a row.

    keys: (n, M) basis at the keyframes; targets: (9, M) their linear parts row by row; start: (9, n).
    """

    basis: sparse.csc_array
    rates: sparse.csc_array
    weights: np.ndarray
    keys: sparse.csc_array
    targets: np.ndarray
    start: np.ndarray

    @staticmethod
    def of(program: sm.program.Program) -> "Tables":
        keyframes, basis = program.design.keyframes, program.design.basis
        if keyframes.dimension != 3 or program.unknowns != ENTRIES * basis.n:
            raise sm.InputError("the alternatives are written for rigidity in space: the controls are 3 × 3 matrices")
        gauss, weights = np.polynomial.legendre.leggauss(NODES)
        knots = basis.breakpoints
        half = np.diff(knots)[:, None] / 2
        times = (knots[:-1, None] + half * (1 + gauss)).ravel()
        values, rates = (sparse.csc_array(basis.matrix(times, nu).T) for nu in (0, 1))
        keys = sparse.csc_array(basis.matrix(keyframes.times).T)
        targets = keyframes.linear.reshape(-1, ENTRIES).T
        start = program.x0.reshape(-1, ENTRIES).T
        return Tables(values, rates, (half * weights).reshape(1, -1), keys, targets, start)


def rigidity(A: Any, rate: Any, weights: Any) -> Any:
    """Σ w ‖ȦᵀA + AᵀȦ‖² over nodes in a row: A, rate (9, nodes) of one CasADi type, weights (1, nodes)."""
    total = 0
    for i in range(3):
        for j in range(3):
            entry = sum(A[3 * k + i, :] * rate[3 * k + j, :] + rate[3 * k + i, :] * A[3 * k + j, :] for k in range(3))
            total = total + ca.dot(weights, entry**2)
    return total


def expressions(tables: Tables, X: Any) -> tuple[Any, Any]:
    """Objective and conditions (9, M) = 0 in the controls X (9, n), MX or SX, written for all nodes at once."""
    objective = rigidity(X @ _matrix(tables.basis), X @ _matrix(tables.rates), ca.DM(tables.weights))
    return objective, X @ _matrix(tables.keys) - ca.DM(tables.targets)


def _matrix(matrix: sparse.csc_array) -> ca.DM:
    return ca.DM(sparse.csc_matrix(matrix))


@dataclass(frozen=True)
class OptiIpopt:
    """CasADi's Opti with IPOPT; symbols: "SX" expands the expression to scalars, "MX" keeps matrix operations."""

    symbols: Literal["SX", "MX"]
    tolerance: float = 1e-8

    @property
    def name(self) -> str:
        return f"opti-{self.symbols.lower()}"

    def attempt(self, program: sm.program.Program) -> Answer:
        tables, began = Tables.of(program), perf_counter()
        opti = ca.Opti()
        X = opti.variable(*tables.start.shape)
        objective, conditions = expressions(tables, X)
        opti.minimize(objective)
        opti.subject_to(ca.vec(conditions) == 0)
        opti.set_initial(X, tables.start)
        options = {"expand": self.symbols == "SX", "print_time": False, "record_time": True}
        opti.solver("ipopt", options, {"print_level": 0, "sb": "yes", "tol": FINER * self.tolerance})
        built = perf_counter()
        try:
            values: Any = opti.solve()
        except RuntimeError:
            values = opti.debug
        ended, stats = perf_counter(), opti.stats()
        said = str(stats.get("return_status", "no status"))
        # Opti derives its functions at the first solve: what is not IPOPT's own time is compilation.
        solve = float(stats.get("t_wall_total", ended - built))
        return Answer(
            np.asarray(values.value(X)).T.ravel(),
            np.asarray(values.value(opti.lam_g)).ravel(),
            Seconds(built - began, ended - built - solve, solve),
            stats.get("iter_count"),
            "" if said == "Solve_Succeeded" else said,
            program.unknowns,
        )


@dataclass(frozen=True)
class Sqpmethod:
    """CasADi's sqpmethod with its sparse active-set QP solver and the exact Hessian, not convexified.

    Its "regularize" adds one multiple of the identity for all, which here turns quadratic convergence into
    hundreds of steps, and its two by eigenvalues end in an error of CasADi 3.8 itself.
    """

    qp: str = "qrqp"
    tolerance: float = 1e-8
    max_iterations: int = 200

    @property
    def name(self) -> str:
        return "sqpmethod"

    def attempt(self, program: sm.program.Program) -> Answer:
        silent = dict.fromkeys(("print_header", "print_iteration", "print_status", "print_time"), False)
        quiet = dict.fromkeys(("print_header", "print_iter", "print_info", "print_time", "error_on_fail"), False)
        options = {
            "qpsol": self.qp,
            "qpsol_options": quiet,
            "max_iter": self.max_iterations,
            "tol_du": FINER * self.tolerance,
            "tol_pr": FINER * self.tolerance,
            "error_on_fail": False,
        }
        return _solve_with("sqpmethod", program, {**silent, **options})


def _solve_with(plugin: str, program: sm.program.Program, options: dict[str, Any]) -> Answer:
    """CasADi's nlpsol on the MX expressions."""
    tables, began = Tables.of(program), perf_counter()
    x = ca.MX.sym("x", tables.start.size)
    objective, conditions = expressions(tables, ca.reshape(x, *tables.start.shape))
    built = perf_counter()
    solver = ca.nlpsol("solver", plugin, {"x": x, "f": objective, "g": ca.vec(conditions)}, options)
    compiled = perf_counter()
    result = solver(x0=program.x0, lbg=0, ubg=0)
    seconds = Seconds(built - began, compiled - built, perf_counter() - compiled)
    x, multipliers = np.asarray(result["x"]).ravel(), np.asarray(result["lam_g"]).ravel()
    return Answer(x, multipliers, seconds, *told(solver), program.unknowns)


def told(solver: ca.Function) -> tuple[int | None, str]:
    """Iterations, and what the solver said unless it claims success."""
    stats = solver.stats()
    said = str(stats.get("unified_return_status", "no status"))
    return stats.get("iter_count"), "" if said == "SOLVER_RET_SUCCESS" else said


@dataclass(frozen=True)
class TrustConstr:
    """SciPy's trust-constr with gradient and sparse Hessian by CasADi; the conditions as a sparse LinearConstraint."""

    tolerance: float = 1e-8
    max_iterations: int = 1000

    @property
    def name(self) -> str:
        return "trust-constr"

    def attempt(self, program: sm.program.Program) -> Answer:
        from scipy.optimize import LinearConstraint, minimize

        tables, began = Tables.of(program), perf_counter()
        x = ca.MX.sym("x", tables.start.size)
        objective, _ = expressions(tables, ca.reshape(x, *tables.start.shape))
        built = perf_counter()
        hessian, gradient = ca.hessian(objective, x)
        slope = ca.Function("slope", [x], [objective, gradient])
        curvature = ca.Function("curvature", [x], [hessian])
        compiled = perf_counter()

        def value_and_slope(point: np.ndarray) -> tuple[float, np.ndarray]:
            value, g = slope(point)
            return float(value), np.asarray(g).ravel()

        operator = sparse.csr_matrix(sparse.kron(tables.keys.T, sparse.eye_array(ENTRIES)))
        targets = tables.targets.T.ravel()
        result = minimize(
            value_and_slope,
            tables.start.T.ravel(),
            jac=True,
            hess=lambda point: sparse.csr_matrix(curvature(point).sparse()),
            method="trust-constr",
            constraints=[LinearConstraint(operator, targets, targets)],
            options={"gtol": FINER * self.tolerance, "xtol": 1e-17, "maxiter": self.max_iterations},
        )
        seconds = Seconds(built - began, compiled - built, perf_counter() - compiled)
        said = "" if result.status in (1, 2) else str(result.message)
        return Answer(result.x, np.asarray(result.v[0]), seconds, int(result.nit), said, program.unknowns)
