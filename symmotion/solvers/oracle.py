"""An Evaluator's functions as CasADi's solvers call them, and what is raised in them, which CasADi would swallow."""

from collections.abc import Callable, Sequence
from typing import TypeAlias

import casadi as ca
import numpy as np
from scipy import sparse

from symmotion import interrupts
from symmotion.forking import LIBRARIES
from symmotion.program import Evaluator
from symmotion.solvers.journal import Journal
from symmotion.solvers.solution import Iteration
from symmotion.solvers.units import OwnUnits
from symmotion.systems import HessianTriangle

# The arrays of a function's inputs to those of its outputs.
Compute: TypeAlias = Callable[..., tuple[np.ndarray, ...]]


class Kept:
    """The first exception raised in a solver's callbacks: raised again once the solver has ended."""

    def __init__(self):
        self.error: BaseException | None = None

    @property
    def over(self) -> bool:
        """Whether there is one, or a signal's: nothing more is to be done."""
        return self.error is not None or interrupts.pending()

    def check(self) -> None:
        """Raise what was kept, if anything was."""
        if self.error is not None:
            raise self.error
        interrupts.check()


class NumericFunction(ca.Callback):
    """A NumPy function with fixed sparsity as a CasADi function of named inputs.

    After an exception it returns NaN, without another call, which ends the solver.
    """

    def __init__(
        self,
        name: str,
        inputs: Sequence[tuple[str, int]],
        outputs: Sequence[tuple[str, ca.Sparsity]],
        compute: Compute,
        kept: Kept,
    ):
        super().__init__()
        self._inputs, self._outputs, self._compute, self._kept = inputs, outputs, compute, kept
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

    def has_eval_buffer(self) -> bool:
        # Matrices of CasADi are made and read number by number, which takes longer than the functions themselves.
        return True

    def eval_buffer(self, arg: Sequence[memoryview | None], res: Sequence[memoryview | None]) -> int:
        values: Sequence[np.ndarray | float] = [np.nan] * len(res)
        LIBRARIES.pause()
        if not self._kept.over:
            try:
                given = [_numbers(a, size) for a, (_, size) in zip(arg, self._inputs, strict=True)]
                values = self._compute(*given)
            except BaseException as error:
                self._kept.error = error
        for place, value in zip(res, values, strict=True):
            if place:  # else it is not asked for
                np.frombuffer(place)[:] = value
        return 0


def _numbers(given: memoryview | None, size: int) -> np.ndarray:
    """(size,) the numbers of an input; CasADi hands over nothing for what is all zero."""
    return np.frombuffer(given) if given else np.zeros(size)


class Watcher(ca.Callback):
    """What a solver of CasADi calls after every iteration: it tells the journal, and stops where that says so.

    rows: the log so far, asked for at every iteration.
    """

    def __init__(self, unknowns: int, conditions: int, journal: Journal, kept: Kept):
        super().__init__()
        self._sizes = {"x": unknowns, "lam_x": unknowns, "f": 1, "g": conditions, "lam_g": conditions}
        self._journal, self._kept = journal, kept
        self.rows: Callable[[], list[Iteration]] = list
        self.construct("watcher", {})

    def get_n_in(self) -> int:
        return ca.nlpsol_n_out()

    def get_n_out(self) -> int:
        return 1

    def get_name_in(self, i: int) -> str:
        return ca.nlpsol_out(i)

    def get_name_out(self, i: int) -> str:
        return "ret"

    def get_sparsity_in(self, i: int) -> ca.Sparsity:
        size = self._sizes.get(ca.nlpsol_out(i), 0)
        return ca.Sparsity.dense(size, 1 if size else 0)

    def eval(self, arg: Sequence[ca.DM]) -> list[ca.DM]:
        if not self._kept.over:
            try:
                self._journal.add(self.rows()[-1])
            except BaseException as error:
                self._kept.error = error
        return [ca.DM(self._kept.over or self._journal.stopped)]


def oracles(evaluator: Evaluator, kept: Kept, own: OwnUnits) -> dict[str, NumericFunction]:
    """The functions of an NLP that an Evaluator computes, in own units, named as the options of `nlpsol` name them.

    "nlp" is beside them.
    """
    program = evaluator.program
    n, m = program.unknowns, program.conditions
    unit, size = own.unknowns, own.objective
    jacobian = _by_columns(evaluator, program.x0)
    share = (1 / own.conditions)[jacobian.indices] * np.repeat(unit, np.diff(jacobian.indptr))
    columns = ca.Sparsity(m, n, jacobian.indptr.tolist(), jacobian.indices.tolist())
    triangle = HessianTriangle.of(program)
    square = unit[triangle.rows] * unit[triangle.columns] / size
    dense = ca.Sparsity.dense
    point = [("x", n), ("p", 0)]

    def values(x: np.ndarray, _: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        x = unit * x
        return np.array([evaluator.objective(x) / size]), evaluator.values(x) / own.conditions

    def gradient(x: np.ndarray, _: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        x = unit * x
        return np.array([evaluator.objective(x) / size]), unit * evaluator.gradient(x) / size

    def slopes(x: np.ndarray, _: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        x = unit * x
        slopes = jacobian if program.linear else _by_columns(evaluator, x)
        return evaluator.values(x) / own.conditions, share * slopes.data

    def curvature(x: np.ndarray, _: np.ndarray, sigma: np.ndarray, lam: np.ndarray) -> tuple[np.ndarray]:
        lam = own.multipliers * lam
        return (square * evaluator.second_order(unit * x, triangle.pattern, lam, factor=float(sigma[0]))[1],)

    hessian = [("triu_hess_gamma_x_x", triangle.sparsity(n))]
    return {
        "nlp": NumericFunction("nlp", point, [("f", dense(1, 1)), ("g", dense(m, 1))], values, kept),
        "grad_f": NumericFunction("nlp_grad_f", point, [("f", dense(1, 1)), ("grad_f_x", dense(n, 1))], gradient, kept),
        "jac_g": NumericFunction("nlp_jac_g", point, [("g", dense(m, 1)), ("jac_g_x", columns)], slopes, kept),
        "hess_lag": NumericFunction("nlp_hess_l", [*point, ("lam_f", 1), ("lam_g", m)], hessian, curvature, kept),
    }


def _by_columns(evaluator: Evaluator, x: np.ndarray) -> sparse.csc_array:
    jacobian = sparse.csc_array(evaluator.jacobian(x))
    jacobian.sort_indices()
    return jacobian
