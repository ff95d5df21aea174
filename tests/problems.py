"""Programs with known optima, and helpers that several test files share."""

from dataclasses import dataclass

import numpy as np

import symmotion as sm


@dataclass(frozen=True)
class Known:
    """A program, its minimum, and where that figure comes from."""

    program: sm.program.Program
    minimum: float
    because: str


def quarter_turn(degree: int) -> sm.program.Program:
    keys = sm.Keyframes([0, 1], np.array([np.eye(2), [[0, -1], [1, 0]]]))
    return sm.affine_program(keys, degree=degree, refine=0, objective=sm.Rigidity(order=2))


KNOWN = {
    "quarter turn, degree 1, R*": Known(quarter_turn(1), 32.0, "G = (1 − 2t + 2t²) I, so R* = 2·4²"),
    "quarter turn, degree 2, R*": Known(quarter_turn(2), 3.901022576, "specification of HJK figure 1"),
    "quarter turn, degree 3, R*": Known(quarter_turn(3), 0.002298006, "specification of HJK figure 1"),
}

SOLVERS = (
    sm.ExactNewton(system="condensed"),
    sm.ExactNewton(system="sparse"),
    sm.Ipopt(),
    sm.solvers.PlainIpopt(),
    sm.Elimination(),
    sm.Elimination(stages="degree"),
)


def body_points(dimension: int) -> np.ndarray:
    """The origin and the unit vectors."""
    return np.concatenate([np.zeros((1, dimension)), np.eye(dimension)])


def difference(function, x: np.ndarray, step: float = 1e-6) -> np.ndarray:
    """Central differences of a function of a vector, one row per entry of x."""
    units = np.eye(len(x)) * step
    return np.array([(function(x + u) - function(x - u)) / (2 * step) for u in units])
