"""What the times of keyframes cost: how the optimum, and where it is, change when they move."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike
from scipy import sparse

from symmotion import checks
from symmotion.brief import in_a_line
from symmotion.design.affine import AffineDesign
from symmotion.design.free_times import LEAST_SHARE, FreeTimesDesign
from symmotion.design.spans import refined_times
from symmotion.errors import InputError
from symmotion.program import Evaluator, Program
from symmotion.solvers import Solution
from symmotion.splines import same_times
from symmotion.systems.response import AnyReading, full_hessian


@dataclass(frozen=True, eq=False)
class TimePrices:
    """How the optimum f* of an affine program changes with the times of its keyframes, knots moving with them.

    gradient: (M,) ∂f*/∂tᵢ, in units of the objective per unit of time. Where `free_times_program` has its optimum those
    of the inner times vanish, and the last one is less than zero, as f* falls with the time in all.

    solution: whose they are. Raises InputError for times that do not fit.

    >>> solution = sm.ExactNewton().solve(sm.affine_program(sm.examples.planar_keyframes())).require()
    >>> sm.answers.time_prices(solution).gradient.shape
    (4,)
    """

    solution: Solution
    gradient: np.ndarray
    _derivative: sparse.csr_array

    __repr__ = in_a_line

    @cached_property
    def _reading(self) -> AnyReading:
        return self.solution.sensitivity().response.reading(self._derivative)

    def tangent(self, change: ArrayLike) -> np.ndarray:
        """(unknowns,) the change of the controls for a change (M,) of the times; (k, unknowns) for k of them."""
        given, m = checks.numbers(change, "change of times"), len(self.gradient)
        if given.ndim not in (1, 2) or given.shape[-1] != m or not np.isfinite(given).all():
            raise InputError(f"change of times of shape {given.shape}: finite, {checks.shown((m,))}, is needed")
        moved = self._reading.tangent(np.atleast_2d(given).T).T
        return moved if given.ndim == 2 else moved[0]


def time_prices(solution: Solution) -> TimePrices:
    """The prices of the keyframes' times at a solution of an affine program, by its multipliers alone.

    f* changes as the Lagrangian of `free_times_program` does at the solution, ∂f*/∂t = ∂L/∂t. Knots are those of
    `refine`; the times of constraints move with the keyframes beside them.

    Raises InputError for solutions of other programs, and knots that `refine` has not set.

    >>> solution = sm.ExactNewton().solve(sm.affine_program(sm.examples.planar_keyframes())).require()
    >>> bool(np.isfinite(sm.answers.time_prices(solution).gradient).all())
    True
    """
    if not isinstance(solution, Solution) or not isinstance(solution.program.design, AffineDesign):
        raise InputError("prices of times are of the solution of an affine_program")
    solution.require()
    program, design = solution.program, solution.program.design
    keys, count = design.keyframes, len(design.basis.breakpoints) - 1
    refine = count // (len(keys) - 1) - 1
    if refine < 0 or not same_times(refined_times(keys.times, refine), design.basis.breakpoints):
        raise InputError("prices of times: knots equally spaced between the keyframes, by refine, are needed")
    nodes = {block.name: block.nodes for block in program.terms}
    least = LEAST_SHARE * float(np.ptp(keys.times)) / (len(keys) - 1)
    question = FreeTimesDesign(keys, design.objective, design.basis.degree, refine, least, design.constraints, nodes)
    free = question.program()
    x = free.pack(question.unknowns(solution.motion))
    multipliers = _carried(program, free, solution.multiplier_vector)
    evaluator = Evaluator(free)
    lagrangian = evaluator.gradient(x) + evaluator.pull(x, multipliers)
    hessian, jacobian = full_hessian(free, evaluator, x, multipliers), evaluator.jacobian(x)
    widths = np.arange(question.n) * (question.channels + 1) + question.channels
    spread = _spread(question)
    controls = np.setdiff1d(np.arange(free.unknowns), widths)
    rows = np.concatenate([_rows(free, c.name) for c in program.constraints])
    mixed = sparse.vstack([hessian[controls][:, widths], jacobian[rows][:, widths]])
    return TimePrices(solution, spread.T @ lagrangian[widths], sparse.csr_array(mixed @ spread))


def _rows(program: Program, name: str) -> np.ndarray:
    """The numbers of a constraint's conditions."""
    sizes = {c.name: c.size for c in program.constraints}
    names = list(sizes)
    first = sum(sizes[n] for n in names[: names.index(name)])
    return np.arange(first, first + sizes[name])


def _carried(program: Program, free: Program, multipliers: np.ndarray) -> np.ndarray:
    """The multipliers of a program with fixed times in that with free ones, zero of what is said of times."""
    found = np.zeros(free.conditions)
    for name, part in program.split(multipliers).items():
        found[_rows(free, name)] = part.ravel()
    return found


def _spread(question: FreeTimesDesign) -> sparse.csr_array:
    """(n, M) by how much the widths of the spans change with the times of the keyframes."""
    m, each = len(question.keyframes), question.refine + 1
    span = np.arange(question.spans)
    segment = span // each
    share = np.full(len(span), 1 / (each * question.unit))
    rows, columns = np.concatenate([span, span]), np.concatenate([segment, segment + 1])
    return sparse.csr_array((np.concatenate([-share, share]), (rows, columns)), shape=(question.n, m))
