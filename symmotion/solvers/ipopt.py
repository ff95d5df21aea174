"""IPOPT on the same programs, with our mapped derivatives or with what a CasADi user would write."""

from collections.abc import Sequence
from contextlib import nullcontext
from dataclasses import dataclass
from threading import Lock
from time import perf_counter
from typing import Any, Literal

import casadi as ca
import numpy as np
from scipy import sparse

from symmotion.kernels import Kernels
from symmotion.program import Evaluator, Program
from symmotion.solvers.solution import Iteration, Seconds, Solution, Status, conclude, start_vector
from symmotion.systems import HessianTriangle, gradient_scale

# `Opti` differentiates and expands while it solves, without the interpreter's lock: two at a time crash.
_SYMBOLIC = Lock()


@dataclass(frozen=True)
class Ipopt:
    """IPOPT (interior point, filter line search) through CasADi; takes inequalities and nonlinear constraints.

    tolerance: IPOPT's, and on its unscaled dual and primal infeasibility.
    derivatives: "mapped", the batched kernel derivatives that ExactNewton uses, or "plain", the
        program written term by term with `Opti` and differentiated as a whole, as a CasADi user would.
    kernels, threads: of the mapped derivatives, as ExactNewton's.
    """

    tolerance: float = 1e-8
    max_iterations: int = 1000
    derivatives: Literal["mapped", "plain"] = "mapped"
    kernels: Kernels = "auto"
    threads: int | None = None

    def solve(self, program: Program, start: Any = None) -> Solution:
        """Solve any program; start: None, a Solution, a motion, or (unknowns,) numbers."""
        began = perf_counter()
        x0 = start_vector(program, start)
        # In small units IPOPT would take the start for a solution: it scales large objectives down, not small ones up.
        evaluator = Evaluator(program, self.kernels, self.threads)
        unit = _unit(evaluator, x0)
        options = {
            "ipopt.obj_scaling_factor": 1.0 / unit,
            "print_time": False,
            "record_time": True,
            "calc_lam_p": False,
            "ipopt.print_level": 0,
            "ipopt.sb": "yes",
            "ipopt.tol": self.tolerance,
            "ipopt.dual_inf_tol": self.tolerance * unit,
            "ipopt.constr_viol_tol": self.tolerance,
            "ipopt.acceptable_iter": 0,
            "ipopt.max_iter": self.max_iterations,
        }
        mapped = self.derivatives == "mapped"
        with nullcontext() if mapped else _SYMBOLIC:
            run = _Mapped(evaluator, options) if mapped else _Plain(program, options)
            compiled = perf_counter()
            x, multipliers, stats = run.solve(x0)
            solved = perf_counter()
            evaluate, total = run.evaluate_seconds(stats), float(stats.get("t_wall_total", solved - compiled))
            del run  # while it is alone: it lets go of functions that others use
        # Opti derives its functions at the first solve: what is not IPOPT's own time is compilation.
        seconds = Seconds(program.build_seconds, solved - began - total, total, evaluate, total - evaluate)
        said = str(stats.get("return_status", "no status"))
        failure = None
        if said != "Solve_Succeeded":
            status = {
                "Maximum_Iterations_Exceeded": Status.ITERATION_LIMIT,
                "Search_Direction_Becomes_Too_Small": Status.STALLED,
                "Diverging_Iterates": Status.DIVERGED,
            }.get(said, Status.FAILED)
            failure = (status, said)
        method = "ipopt" if mapped else "ipopt-plain"
        return conclude(program, self, method, x, multipliers, _log(stats), seconds, failure, evaluator)


def _unit(evaluator: Evaluator, x: np.ndarray) -> float:
    """The part of `gradient_scale` that is not the gradient's own."""
    triangle = HessianTriangle.of(evaluator.program)
    _, hessian = evaluator.second_order(x, triangle.pattern, np.zeros(evaluator.program.conditions))
    usual = gradient_scale(np.zeros(0), hessian[triangle.diagonal], x)
    return usual if np.isfinite(usual) else 1.0


def _log(stats: dict[str, Any]) -> list[Iteration]:
    history = stats.get("iterations") or {}
    objective, dual, primal, step = (history.get(key, []) for key in ("obj", "inf_du", "inf_pr", "alpha_pr"))
    # IPOPT lists with each iterate the step that led there; our rows hold the one taken from there.
    steps = [*step[1:], None]
    return [Iteration(*row[:3], step=row[3]) for row in zip(objective, dual, primal, steps, strict=False)]


class _Function(ca.Callback):
    """A NumPy function with fixed sparsity as a CasADi function of the named inputs of an IPOPT oracle."""

    def __init__(self, name: str, inputs: list[tuple[str, int]], outputs: list[tuple[str, ca.Sparsity]], compute: Any):
        super().__init__()
        self._inputs, self._outputs, self._compute = inputs, outputs, compute
        self.construct(name, {})

    def get_n_in(self) -> int:
        return len(self._inputs)

    def get_n_out(self) -> int:
        return len(self._outputs)

    def get_name_in(self, i: int) -> str:
        return self._inputs[i][0]

    def get_name_out(self, i: int) -> str:
        return self._outputs[i][0]

    def get_sparsity_in(self, i: int) -> ca.Sparsity:
        return ca.Sparsity.dense(self._inputs[i][1], 1 if self._inputs[i][1] else 0)

    def get_sparsity_out(self, i: int) -> ca.Sparsity:
        return self._outputs[i][1]

    def eval(self, arg: Sequence[ca.DM]) -> list[ca.DM]:
        values = self._compute(*(np.asarray(a).ravel() for a in arg))
        return [ca.DM(s, v) for (_, s), v in zip(self._outputs, values, strict=True)]


class _Mapped:
    """An IPOPT instance whose functions are an Evaluator's."""

    def __init__(self, evaluator: Evaluator, options: dict[str, Any]):
        self.program = program = evaluator.program
        self.evaluator = evaluator
        evaluator.prepare("value", "gradient", "hessian")
        n, m = program.unknowns, program.conditions
        x0 = program.x0
        jacobian = sparse.csc_array(evaluator.jacobian(x0))
        jacobian.sort_indices()
        columns = ca.Sparsity(m, n, jacobian.indptr.tolist(), jacobian.indices.tolist())
        triangle = HessianTriangle.of(program)
        dense = ca.Sparsity.dense
        point = [("x", n), ("p", 0)]

        def slopes(x, _):
            if program.linear:
                return evaluator.values(x), jacobian.data
            fresh = sparse.csc_array(evaluator.jacobian(x))
            fresh.sort_indices()
            return evaluator.values(x), fresh.data

        def curvature(x, _, sigma, lam):
            return evaluator.second_order(x, triangle.pattern, lam, factor=float(sigma[0]))[1:]

        self._functions = {
            "nlp": _Function(
                "nlp",
                point,
                [("f", dense(1, 1)), ("g", dense(m, 1))],
                lambda x, _: (np.array([evaluator.objective(x)]), evaluator.values(x)),
            ),
            "grad_f": _Function(
                "nlp_grad_f",
                point,
                [("f", dense(1, 1)), ("grad_f_x", dense(n, 1))],
                lambda x, _: (np.array([evaluator.objective(x)]), evaluator.gradient(x)),
            ),
            "jac_g": _Function("nlp_jac_g", point, [("g", dense(m, 1)), ("jac_g_x", columns)], slopes),
            "hess_lag": _Function(
                "nlp_hess_l",
                [*point, ("lam_f", 1), ("lam_g", m)],
                [("triu_hess_gamma_x_x", triangle.sparsity(n))],
                curvature,
            ),
        }
        oracles = {key: f for key, f in self._functions.items() if key != "nlp"}
        self._solver = ca.nlpsol("solver", "ipopt", self._functions["nlp"], {**options, **oracles, "no_nlp_grad": True})

    def solve(self, x0: np.ndarray) -> tuple[np.ndarray, np.ndarray, dict[str, Any]]:
        self.evaluator.seconds = 0.0
        result = self._solver(x0=x0, lbg=self.program.lower, ubg=self.program.upper)
        return np.asarray(result["x"]).ravel(), np.asarray(result["lam_g"]).ravel(), self._solver.stats()

    def evaluate_seconds(self, stats: dict[str, Any]) -> float:
        return self.evaluator.seconds


class _Plain:
    """The program through `Opti`: one expression, a loop over the nodes, expanded, differentiated as a whole."""

    def __init__(self, program: Program, options: dict[str, Any]):
        self.opti = opti = ca.Opti()
        self.controls = {name: opti.variable(v.shape[1], v.shape[0]) for name, v in program.start.items()}
        self.program = program
        objective = ca.MX(0)
        for block in program.terms:
            value = block.kernel.function("value")
            for node, z in self._nodes(block):
                objective += block.weights[node] * value(z, block.data[node], 1)
        opti.minimize(objective)
        self.conditions = []
        for constraint in program.constraints:
            block = constraint.block
            out = block.kernel.function("out")
            for node, z in self._nodes(block):
                expression = opti.bounded(constraint.lower[node], out(z, block.data[node], 0), constraint.upper[node])
                if constraint.is_equality:
                    expression = out(z, block.data[node], 0) == constraint.lower[node]
                self.conditions.append(expression)
        if self.conditions:  # Opti refuses an empty list
            opti.subject_to(self.conditions)
        ipopt = {key.removeprefix("ipopt."): v for key, v in options.items() if key.startswith("ipopt.")}
        opti.solver("ipopt", {"expand": True, "print_time": False, "record_time": True}, ipopt)

    def _nodes(self, block: Any):
        controls = self.controls[block.variable][block.channels, :]
        rows, operator = block.kernel.rows, block.operator
        for node in range(block.count):
            parts = []
            for row in range(node * rows, (node + 1) * rows):
                entries = slice(operator.indptr[row], operator.indptr[row + 1])
                columns = operator.indices[entries].tolist()
                parts.append(controls[:, columns] @ ca.DM(operator.data[entries]))
            yield node, ca.vertcat(*parts)

    def solve(self, x0: np.ndarray) -> tuple[np.ndarray, np.ndarray, dict[str, Any]]:
        for name, value in self.program.unpack(x0).items():
            self.opti.set_initial(self.controls[name], value.T)
        try:
            values = self.opti.solve()
        except RuntimeError:
            values = self.opti.debug
        found = {name: np.asarray(values.value(c)).reshape(c.shape).T for name, c in self.controls.items()}
        return self.program.pack(found), np.asarray(values.value(self.opti.lam_g)).ravel(), self.opti.stats()

    def evaluate_seconds(self, stats: dict[str, Any]) -> float:
        return sum(v for key, v in stats.items() if key.startswith("t_wall_nlp_"))
