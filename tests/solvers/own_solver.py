"""A solver of one's own, of public names only: SciPy's trust-constr on the plain CasADi problem of a program."""

from dataclasses import dataclass, field
from typing import Any

import casadi as ca
import numpy as np
from scipy.optimize import NonlinearConstraint, minimize

from symmotion.program import Program
from symmotion.solvers import (
    Callback,
    Iteration,
    Journal,
    Solution,
    Status,
    conclude,
    require_equalities,
    require_limits,
    start_vector,
)


@dataclass(frozen=True)
class TrustRegion:
    """The trust region method of SciPy for equalities, with exact derivatives by CasADi."""

    tolerance: float = 1e-8
    max_iterations: int = 1000
    time_limit: float | None = None
    callback: Callback | None = field(default=None, repr=False, compare=False)

    def __post_init__(self):
        require_limits(self.tolerance, self.max_iterations, self.time_limit, self.callback)

    def solve(self, program: Program, start: object = None) -> Solution:
        """Solve a program with equalities; start: None, a Solution, a motion, or (unknowns,) numbers."""
        require_equalities(program, "TrustRegion", curved=True)
        journal = Journal(self.max_iterations, self.time_limit, self.callback)
        x0, nlp = start_vector(program, start), program.nlp()
        x, f, g = nlp["x"], nlp["f"], nlp["g"]
        weights = ca.MX.sym("weights", g.shape[0])
        results = {
            "f": f,
            "slope": ca.gradient(f, x),
            "bend": ca.hessian(f, x)[0],
            "g": g,
            "jacobian": ca.jacobian(g, x),
            "bent": ca.hessian(ca.dot(weights, g), x)[0],
        }
        functions = {name: ca.Function(name, [x, nlp["p"], weights], [ca.densify(r)]) for name, r in results.items()}
        journal.compiled()

        def at(name: str, point: np.ndarray, of: Any = 0) -> np.ndarray:
            return np.asarray(functions[name](point, nlp["p0"], of))

        def watch(_: np.ndarray, state: Any) -> bool:
            journal.add(Iteration(float(state.fun), float(state.optimality), float(state.constr_violation), step=1.0))
            return journal.ending() is not None

        conditions = NonlinearConstraint(
            lambda point: at("g", point).ravel(),
            nlp["lbg"],
            nlp["ubg"],
            jac=lambda point: at("jacobian", point),
            hess=lambda point, of: at("bent", point, of),
        )
        result = minimize(
            lambda point: at("f", point).item(),
            x0,
            jac=lambda point: at("slope", point).ravel(),
            hess=lambda point: at("bend", point),
            constraints=conditions,
            method="trust-constr",
            callback=watch,
            options={"gtol": self.tolerance, "xtol": 1e-14, "maxiter": self.max_iterations},
        )
        journal.solved()
        failure = journal.ending()
        if failure is None and result.status not in (1, 2):
            failure = Status.FAILED, str(result.message)
        return conclude(
            program,
            self,
            result.x,
            result.v[0],
            log=journal.log,
            seconds=journal.seconds(program),
            failure=failure,
        )
