"""How a minimum moves with the data of its program: tangents, their adjoint, and the change of the optimum."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike
from scipy import sparse
from scipy.sparse.linalg import LinearOperator

from symmotion import checks
from symmotion.errors import InputError
from symmotion.program import Evaluator, Multipliers, Program
from symmotion.solvers.contact_curvature import beside_contacts, contact_curvature
from symmotion.solvers.data import Data, Datum, Paired
from symmotion.systems import AnyReading, Inspection, Response, response_of

# What the conditions that others repeat may be missed by, relative.
CONSISTENT = 1e-7


@dataclass(frozen=True, eq=False)
class Sensitivity:
    """The derivatives of a minimum x, λ by the data of its program: dx = −(K⁻¹ ∂F/∂p dp) with K the KKT matrix.

    Conditions that are equalities and bounds that press stay met, bounds that do not touch are not there. Data by name:

    - of a condition what it equals, or the limit that presses, in the shape of its multipliers: what the constraint's
      expression is has to change by as much. "keyframes" of affine motions are a pair `.linear` (M, d, d) and
      `.translation` (M, d), and move what a tolerance or a line makes of them, too; of orientations (M, 3), ε with
      q_i → q_i exp(ε/2). "samples" of a fit, a pair too, are those that it follows and those that it meets.
    - parameters of constraints, in their shape;
    - "weight of …", the relative change of the factor of a term.

    Where the bounds have contact times that the solver moves (`solvers.exchange`), the times follow.
    Source: Fiacco 1983; Pirnay, López-Negrete, Biegler 2012.

    program, x (unknowns,), multiplier_vector (conditions,): the minimum; response: what solves with its KKT matrix;
    repeated: numbers and rows of the pressing conditions that depend on the others. `Solution.sensitivity` makes one.

    Raises InputError for data that the program does not have, and shapes that are not theirs.

    SolveError where the minimum has none: a bound that is met without a multiplier.

    >>> keys = sm.examples.planar_keyframes()
    >>> sensitivity = sm.ExactNewton().solve(sm.affine_program(keys)).require().sensitivity()
    >>> sensitivity.tangent("keyframes", 0.01 * keys.linear).shape
    (36,)
    """

    program: Program
    x: np.ndarray
    multiplier_vector: np.ndarray
    response: Response
    # Of active conditions that follow from others, their rows and those of the Jacobian.
    repeated: tuple[np.ndarray, sparse.csr_array]

    @staticmethod
    def of(program: Program, x: np.ndarray, multipliers: np.ndarray) -> "Sensitivity":
        """The sensitivities of a minimum; InputError that names bounds that are met without a multiplier."""
        inspection = Inspection(program, Evaluator(program), x, multipliers)
        weak = inspection.undecided & ~beside_contacts(program, x, inspection.pressing)
        if weak.any():
            names = ", ".join(repr(name) for name, part in program.split(weak).items() if part.any())
            raise InputError(
                f"bounds {names} are met without a multiplier: the minimum moves otherwise one way than the other, it "
                "has one-sided derivatives only; move the limit a little"
            )
        response, repeated = response_of(inspection, contact_curvature(program, x, multipliers))
        return Sensitivity(program, x, multipliers, response, (repeated, inspection.jacobian[repeated]))

    @cached_property
    def _data(self) -> dict[str, Datum]:
        return Data(self.program, self.x, self.multiplier_vector).every()

    @cached_property
    def _readings(self) -> dict[str, AnyReading]:
        return {}

    @cached_property
    def _every(self) -> AnyReading:
        """The linear algebra of all data side by side."""
        return self.response.reading(sparse.csr_array(sparse.hstack([d.derivative for d in self._data.values()])))

    def __repr__(self) -> str:
        return f"Sensitivity({self.program.unknowns} unknowns; data: {', '.join(self.names) or 'none'})"

    @property
    def names(self) -> tuple[str, ...]:
        """Of the data."""
        return tuple(self._data)

    def datum(self, name: str) -> Datum:
        """The datum of this name; InputError says which there are."""
        if name not in self._data:
            raise InputError(f"no datum {name!r}; there are {', '.join(self.names) or 'none'}")
        return self._data[name]

    def reading(self, name: str) -> AnyReading:
        """The linear algebra of a datum, made once."""
        datum = self.datum(name)
        if name not in self._readings:
            self._readings[name] = self.response.reading(datum.derivative)
        return self._readings[name]

    def tangent(self, name: str, change: ArrayLike | Paired) -> np.ndarray:
        """(unknowns,) the change of x for a change of a datum; (k, unknowns) for k of them along a leading axis.

        change: in the shape of the datum; of a pair `.linear` and `.translation`, or linear parts alone.
        """
        flat, several = self.datum(name).flat(change)
        moved = self._tangent(name, flat.T).T
        return moved if several else moved[0]

    def _tangent(self, name: str, change: np.ndarray) -> np.ndarray:
        found = self.reading(name).tangent(change)
        rows, jacobian = self.repeated
        if len(rows):
            n = self.program.unknowns
            off = jacobian @ found + self.datum(name).derivative[n + rows] @ change
            if np.abs(off).max() > CONSISTENT * (np.abs(jacobian) @ np.abs(found) + np.abs(change).max()).max():
                raise InputError(f"change of {name!r}: conditions that repeat each other would contradict each other")
        return found

    def multipliers(self, name: str, change: ArrayLike | Paired) -> Multipliers:
        """By constraint, the change of the multipliers for one change of a datum, in the shape of `multipliers`."""
        flat, several = self.datum(name).flat(change)
        if several:
            raise InputError(f"change of {name!r}: multipliers are told of one change at a time")
        pressure = self.reading(name).pressure(flat.T, self._tangent(name, flat.T))[:, 0]
        return self.program.design.multipliers(self.program.shown(pressure))

    def adjoint(self, gradient: ArrayLike) -> Multipliers:
        """By name of the datum, the gradient of a scalar of the motion, in the shape of the datum.

        gradient: (unknowns,) of the scalar by x, or (k, unknowns) of k scalars; then a leading axis is of them.
        What does not move the minimum of itself, such as the limit of a bound that is not met, has a gradient of zero.
        """
        given = checks.floats(gradient, "gradient")
        if given.ndim not in (1, 2) or given.shape[-1] != self.program.unknowns or not np.isfinite(given).all():
            wanted = checks.shown((self.program.unknowns,))
            raise InputError(f"gradient of shape {given.shape}: finite, {wanted}, is needed, or several in a row")
        columns = np.atleast_2d(given).T
        every = self._every.collect(self.response.adjoint(columns), columns).T
        ends = np.cumsum([datum.size for datum in self._data.values()])
        parts = zip(
            self._data.items(), np.split(every if given.ndim == 2 else every[0], ends[:-1], axis=-1), strict=True
        )
        return {name: datum.shaped(part) for (name, datum), part in parts}

    @property
    def optimum(self) -> Multipliers:
        """By name of the datum, the gradient of the optimum: −λ of what conditions equal."""
        return {name: datum.shaped(datum.slope) for name, datum in self._data.items()}

    def operator(self, name: str) -> LinearOperator:
        """(unknowns, size) the tangent of a datum as SciPy's operator on its numbers in a row, with its adjoint."""
        reading, size = self.reading(name), self.datum(name).size

        def columns(values: np.ndarray) -> np.ndarray:
            return np.asarray(values, dtype=float).reshape(len(values), -1)

        def adjoint(gradient: np.ndarray) -> np.ndarray:
            return reading.collect(self.response.adjoint(columns(gradient)), columns(gradient))

        return LinearOperator(
            (self.program.unknowns, size),
            matvec=lambda v: self._tangent(name, columns(v))[:, 0],
            matmat=lambda v: self._tangent(name, columns(v)),
            rmatvec=lambda v: adjoint(v)[:, 0],
            rmatmat=adjoint,
            dtype=float,
        )
