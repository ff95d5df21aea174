"""The minimum of a program as a CasADi function of its data, with derivatives, to be part of a larger program."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, TypeAlias

import casadi as ca
import numpy as np

from symmotion.errors import InputError
from symmotion.program import Program, Targeted
from symmotion.solvers import ExactNewton, Solution, Solver


def optimum_function(solution: Solution, name: str, *, solver: Solver | None = None) -> ca.Function:
    """p ↦ (x*, f*): the minimum (unknowns,) and its objective as a CasADi function, `Opti` and `nlpsol` take it.

    solution: where it starts from, and what it follows from call to call. name: of a datum, see `Sensitivity`; p is a
    column of its numbers: of a parameter its values, column by column; of anything else their change, row by row (rows
    of a pair being its d² + d coordinates), zero at the solution. solver: ExactNewton(tolerance=1e-10) when left out.

    First derivatives, forward, reverse and as a matrix, are those of `Sensitivity`; second ones are differences.
    It raises SolveError where there is no minimum for p, which an outer solver takes for a point that it may not enter.
    Keep a reference to the function as long as it is used.
    Source: Andersson, Rawlings 2018.

        function = sm.answers.optimum_function(solution, "v")
        x, f = function(p)

    Raises InputError for a name that the program does not have.

    >>> keys = sm.examples.random_keyframes(3, 40, seed=1)
    >>> touch = sm.JetConstraint(lambda jet, p: jet.dv[2] - p.w, at=0.5, name="touch", parameters={"w": 0.1})
    >>> solution = sm.ExactNewton().solve(sm.pose_program(keys, constraints=[touch])).require()
    >>> function = sm.answers.optimum_function(solution, "w")
    >>> x, f = function(0.1)
    >>> bool(abs(float(f) - solution.objective) < 1e-6)
    True
    """
    solution.sensitivity().datum(name)
    return _Optimum(_Followed(solution, name, solver or ExactNewton(tolerance=1e-10)))


def moved_program(program: Program, name: str, change: np.ndarray, solution: Solution) -> Program:
    """The program with a datum (size,) changed, see `optimum_function`."""
    datum = solution.sensitivity().datum(name)
    known = program.design.targets(program) if isinstance(program.design, Targeted) else {}
    if name in known:
        rows = change.reshape(datum.shape)
        for place in known[name].places:
            part = rows[place.numbers][:, place.part]
            columns = slice(place.first, place.first + part.shape[1])
            if place.block in {c.name for c in program.constraints}:
                data = program.constraint(place.block).block.data.copy()
                data[:, columns] += part
                program = program.with_data(place.block, data)
            else:
                terms = []
                for block in program.terms:
                    data = block.data.copy()
                    if block.name == place.block:
                        data[:, columns] += part
                    terms.append(block.with_data(data) if block.name == place.block else block)
                program = replace(program, terms=tuple(terms))
        return program
    if name.startswith("weight of ") and name.removeprefix("weight of ") in {b.name for b in program.terms}:
        raise InputError(f"{name}: a function of keyframes, limits, parameters or samples is made")
    shift = -(datum.derivative[program.unknowns :] @ change)
    parts = program.split(shift)
    moved = [replace(c, lower=c.lower + parts[c.name], upper=c.upper + parts[c.name]) for c in program.constraints]
    return replace(program, constraints=tuple(moved))


# Any: whatever CasADi hands on.
Options: TypeAlias = Mapping[str, Any]


class _Followed:
    """The last minimum, from which the next one is found."""

    def __init__(self, solution: Solution, name: str, solver: Solver):
        self.first, self.last, self.name, self.solver = solution, solution, name, solver
        self.parameter = name in solution.program.parameters and name not in solution.multipliers
        value = solution.program.parameters[name].ravel(order="F") if self.parameter else None
        self.size = solution.sensitivity().datum(name).size
        self.at = np.zeros(self.size) if value is None else value

    def solution(self, p: np.ndarray) -> Solution:
        """The minimum at p (size,)."""
        if not np.array_equal(p, self.at):
            if self.parameter:
                shape = self.first.program.parameters[self.name].shape
                program = self.first.program.with_parameters(**{self.name: p.reshape(shape, order="F")})
            else:
                program = moved_program(self.first.program, self.name, p, self.first)
            self.last, self.at = self.solver.solve(program, start=self.last).require(), p.copy()
        return self.last

    def rows(self, columns: np.ndarray) -> np.ndarray:
        """(k, size) numbers in the order of the datum, from columns (size, k) in that of p."""
        if not self.parameter:
            return columns.T
        shape = self.first.program.parameters[self.name].shape
        return (
            columns.T.reshape((-1, *shape[::-1])).transpose((0, *range(len(shape), 0, -1))).reshape(len(columns.T), -1)
        )

    def columns(self, rows: np.ndarray) -> np.ndarray:
        """The inverse of `rows`."""
        if not self.parameter:
            return rows.T
        shape = self.first.program.parameters[self.name].shape
        return rows.reshape((-1, *shape)).transpose((0, *range(len(shape), 0, -1))).reshape(len(rows), -1).T

    def forward(self, p: np.ndarray, change: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The changes (unknowns, k), (1, k) of x and f for those (size, k) of p."""
        sensitivity = self.solution(p).sensitivity()
        rows = self.rows(change)
        moved = sensitivity.reading(self.name).tangent(np.ascontiguousarray(rows.T))
        return moved, (rows @ sensitivity.datum(self.name).slope)[None]

    def reverse(self, p: np.ndarray, x: np.ndarray, f: np.ndarray) -> np.ndarray:
        """(size, k) the gradients by p of scalars with gradients (unknowns, k), (1, k) by x and f."""
        sensitivity = self.solution(p).sensitivity()
        found = sensitivity.operator(self.name).rmatmat(x) + np.outer(sensitivity.datum(self.name).slope, f)
        return self.columns(found.T)


class _Optimum(ca.Callback):
    def __init__(self, followed: _Followed):
        ca.Callback.__init__(self)
        self.followed = followed
        self.made: list[ca.Callback] = []
        self.construct("optimum", {})

    def get_n_in(self) -> int:
        return 1

    def get_n_out(self) -> int:
        return 2

    def get_name_in(self, i: int) -> str:
        return "p"

    def get_name_out(self, i: int) -> str:
        return ("x", "f")[i]

    def get_sparsity_in(self, i: int) -> ca.Sparsity:
        return ca.Sparsity.dense(self.followed.size, 1)

    def get_sparsity_out(self, i: int) -> ca.Sparsity:
        return ca.Sparsity.dense((self.followed.first.program.unknowns, 1)[i], 1)

    def eval(self, arg: Sequence[ca.DM]) -> list[ca.DM]:
        found = self.followed.solution(_column(arg[0]))
        return [ca.DM(found.x), ca.DM(found.objective)]

    def has_forward(self, nfwd: int) -> bool:
        return True

    def get_forward(
        self, nfwd: int, name: str, inames: Sequence[str], onames: Sequence[str], opts: Options
    ) -> ca.Function:
        return self._kept(_Derivative(self.followed, "forward", nfwd, name, inames, onames, opts))

    def has_reverse(self, nadj: int) -> bool:
        return True

    def get_reverse(
        self, nadj: int, name: str, inames: Sequence[str], onames: Sequence[str], opts: Options
    ) -> ca.Function:
        return self._kept(_Derivative(self.followed, "reverse", nadj, name, inames, onames, opts))

    def has_jacobian(self) -> bool:
        return True

    def get_jacobian(self, name: str, inames: Sequence[str], onames: Sequence[str], opts: Options) -> ca.Function:
        return self._kept(_Derivative(self.followed, "jacobian", self.followed.size, name, inames, onames, opts))

    def _kept(self, made: ca.Callback) -> ca.Callback:
        # CasADi holds no reference to what Python made.
        self.made.append(made)
        return made


class _Derivative(ca.Callback):
    """(p, x, f, seeds) ↦ sensitivities, or (p, x, f) ↦ the two Jacobians; derivatives of its own are differences."""

    def __init__(
        self,
        followed: _Followed,
        kind: str,
        count: int,
        name: str,
        inames: Sequence[str],
        onames: Sequence[str],
        opts: Options,
    ):
        ca.Callback.__init__(self)
        self.followed, self.kind, self.names = followed, kind, (list(inames), list(onames))
        size, n = followed.size, followed.first.program.unknowns
        seeds = {"forward": [(size, count)], "reverse": [(n, count), (1, count)], "jacobian": []}[kind]
        self.shapes = [(size, 1), (n, 1), (1, 1), *seeds]
        self.results = {
            "forward": [(n, count), (1, count)],
            "reverse": [(size, count)],
            "jacobian": [(n, size), (1, size)],
        }[kind]
        self.construct(name, {**opts, "enable_fd": True})

    def get_n_in(self) -> int:
        return len(self.shapes)

    def get_n_out(self) -> int:
        return len(self.results)

    def get_name_in(self, i: int) -> str:
        return self.names[0][i]

    def get_name_out(self, i: int) -> str:
        return self.names[1][i]

    def get_sparsity_in(self, i: int) -> ca.Sparsity:
        return ca.Sparsity.dense(*self.shapes[i])

    def get_sparsity_out(self, i: int) -> ca.Sparsity:
        return ca.Sparsity.dense(*self.results[i])

    def eval(self, arg: Sequence[ca.DM]) -> list[ca.DM]:
        p, seeds = _column(arg[0]), [np.array(a) for a in arg[3:]]
        if self.kind == "reverse":
            return [ca.DM(self.followed.reverse(p, seeds[0], seeds[1][0]))]
        change = seeds[0] if self.kind == "forward" else np.eye(self.followed.size)
        return [ca.DM(part) for part in self.followed.forward(p, change)]


def _column(value: ca.DM) -> np.ndarray:
    return np.array(value).ravel(order="F")
