"""IPOPT as a CasADi user would call it, to compare with: the program as one expression, written with `Opti`."""

from collections.abc import Iterator
from dataclasses import dataclass, field

import casadi as ca
import numpy as np

from symmotion.program import Block, DesignT, Evaluator, Program
from symmotion.solvers.exchanging import exchange
from symmotion.solvers.ipopt import (
    CASADI,
    FINER,
    RUNNING,
    SYMBOLIC,
    IpoptAnswer,
    IpoptOption,
    concluded,
    ipopt_settings,
    watching,
)
from symmotion.solvers.journal import Callback, Journal
from symmotion.solvers.options import require_limits
from symmotion.solvers.oracle import Kept, Watcher
from symmotion.solvers.solution import Solution
from symmotion.solvers.solver import solving, start_vector
from symmotion.solvers.units import OwnUnits


@dataclass(frozen=True)
class PlainIpopt:
    """A comparator for Ipopt: the program written term by term with `Opti` and differentiated as a whole.

    tolerance, max_iterations, time_limit, callback: as Ipopt's. One solve at a time, whatever the threads.

    Raises InputError for options that are none.

    >>> sm.solvers.PlainIpopt().solve(sm.affine_program(sm.examples.quarter_turn())).require(1e-6).method
    'ipopt-plain'
    """

    tolerance: float = 1e-8
    max_iterations: int = 1000
    time_limit: float | None = None
    callback: Callback | None = field(default=None, repr=False, compare=False)

    def __post_init__(self):
        require_limits(self.tolerance, self.max_iterations, self.time_limit, self.callback)

    @solving
    def solve(self, program: Program[DesignT], start: object = None) -> Solution[DesignT]:
        """Solve any program; start: None, a Solution, a motion, or (unknowns,) numbers.

        Bounds that are meant for all times hold at all: see `exchange`.
        """
        whole = Journal(self.max_iterations)
        return exchange(program, lambda p, s: self._at_times(p, s, whole.elapsed), start)

    def _at_times(self, program: Program[DesignT], start: object, spent: float = 0.0) -> Solution[DesignT]:
        """The solution of a program with its bounds held at the times that it has; spent: seconds before."""
        journal = Journal(self.max_iterations, self.time_limit, self.callback, spent)
        x0 = start_vector(program, start)
        evaluator, kept = Evaluator(program), Kept()
        settings, own = ipopt_settings(self, journal), OwnUnits.of(evaluator, x0, FINER * self.tolerance)
        with RUNNING, SYMBOLIC:
            problem = _Problem(program, kept, own)
            answer = problem.solve(x0, settings, journal, kept)
            del problem  # while it is alone: it lets go of functions that others use
        return concluded(self, program, "ipopt-plain", answer, journal, evaluator)


class _Problem:
    """The program through `Opti`: one expression, a loop over the nodes, expanded, differentiated as a whole."""

    def __init__(self, program: Program, kept: Kept, own: OwnUnits):
        self._opti, self._kept, self._own = ca.Opti(), kept, own
        opti = self._opti
        self._variables = {name: opti.variable(v.shape[1], v.shape[0]) for name, v in program.start.items()}
        units = program.unpack(own.unknowns)
        self._controls = {
            name: v if (units[name] == 1).all() else ca.DM(units[name].T) * v for name, v in self._variables.items()
        }
        self._program = program
        objective = ca.MX(0)
        for block in program.terms:
            value = block.kernel.function("value")
            for node, z in self._nodes(block):
                objective += block.weights[node] * value(z, block.data[node], 1)
        opti.minimize(objective / own.objective)
        conditions, sizes = [], program.split(own.conditions)
        for constraint in program.constraints:
            block = constraint.block
            out = block.kernel.function("out")
            for node, z in self._nodes(block):
                size = sizes[constraint.name][node]
                found = out(z, block.data[node], 0) / size
                low, high = constraint.lower[node] / size, constraint.upper[node] / size
                expression = found == low if constraint.is_equality else opti.bounded(low, found, high)
                conditions.append(expression)
        if conditions:  # Opti refuses an empty list
            opti.subject_to(conditions)

    def _nodes(self, block: Block) -> Iterator[tuple[int, ca.MX]]:
        controls = self._controls[block.variable][block.channels, :]
        rows, operator = block.kernel.rows, block.operator
        for node in range(block.count):
            self._kept.check()
            parts = []
            for row in range(node * rows, (node + 1) * rows):
                entries = slice(operator.indptr[row], operator.indptr[row + 1])
                columns = operator.indices[entries].tolist()
                parts.append(controls[:, columns] @ ca.DM(operator.data[entries]))
            yield node, ca.vertcat(*parts)

    def solve(self, x0: np.ndarray, settings: dict[str, IpoptOption], journal: Journal, kept: Kept) -> IpoptAnswer:
        """IPOPT's answer from a start."""
        opti, program = self._opti, self._program
        # Also where nobody watches: nothing else of ours is called that could end the solve after Ctrl-C.
        watch = Watcher(program.unknowns, program.conditions, journal, kept)
        options = {**CASADI, "expand": True, "iteration_callback": watch}
        opti.solver("ipopt", options, settings)
        own = self._own
        for name, value in program.unpack(x0 / own.unknowns).items():
            opti.set_initial(self._variables[name], value.T)
        # Opti's own statistics are for afterwards.
        with watching(watch, lambda: opti.advanced.casadi_solver.stats(), own):
            try:
                values = opti.solve()
            except RuntimeError:
                values = opti.debug
        kept.check()
        found = {name: np.asarray(values.value(c)).reshape(c.shape).T for name, c in self._controls.items()}
        stats = opti.stats()
        evaluate = sum(v for key, v in stats.items() if key.startswith("t_wall_nlp_"))
        multipliers = own.multipliers * np.asarray(values.value(opti.lam_g)).ravel()
        return IpoptAnswer(program.pack(found), multipliers, stats, evaluate, own)
