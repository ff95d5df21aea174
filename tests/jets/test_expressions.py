"""What a function of the user's own may return and raise: the same in constraints, energies and measures."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np
import pytest

import symmotion as sm

KEYS = sm.examples.random_keyframes(4, 60, seed=1)
OBJECTIVE = sm.Rigidity() + 0.01 * sm.TrajectoryEnergy(np.eye(3))
POSE = sm.pose_program(KEYS)
MOTIONS = {
    "affine": sm.affine_program(KEYS).design.motion(sm.affine_program(KEYS).start),
    "pose": POSE.design.motion(POSE.start),
    "orientation": POSE.design.motion(POSE.start).orientation,
    "sampled": sm.interpolants.polar_blend(KEYS),
}


@dataclass(frozen=True, eq=False)
class Own(sm.energies.Energy):
    """An energy by a function of the integrand, or of the residuals."""

    function: Callable[..., Any]
    squares: bool = False

    @property
    def name(self) -> str:
        return "mine"

    def residuals(self, jet):
        return self.function(jet) if self.squares else None

    def integrand(self, jet):
        return super().integrand(jet) if self.squares else self.function(jet)


def constrained(function):
    constraint = sm.JetConstraint(function, lower=-9.0, upper=9.0, at=1.5, name="mine")
    sm.affine_program(KEYS, objective=OBJECTIVE, constraints=[constraint])


DOORS: dict[str, Callable[..., Any]] = {
    "constraint": constrained,
    "jet energy": lambda f: sm.affine_program(KEYS, objective=OBJECTIVE + sm.JetEnergy(f, label="mine")),
    "squares": lambda f: sm.pose_program(KEYS, objective=sm.Torque() + sm.JetEnergy(f, squares=True, label="mine")),
    "own energy": lambda f: sm.orientation_program(KEYS, objective=sm.Torque() + Own(f)),
    "own residuals": lambda f: sm.free_times_program(KEYS, objective=OBJECTIVE + Own(f, squares=True)),
    **{f"measure {name}": lambda f, m=motion: sm.measure(m, Own(f)) for name, motion in MOTIONS.items()},
}


def raising(error):
    def function(jet):
        raise error

    return function


@pytest.mark.parametrize("door", DOORS)
@pytest.mark.parametrize(
    ("function", "message"),
    [
        (raising(KeyError("k")), "fails on jets of kind .*: KeyError: 'k'"),
        (raising(ZeroDivisionError()), "fails on .*: ZeroDivisionError: no message"),
        (lambda jet: jet.nothing, "fails on .*: AttributeError: .* no attribute 'nothing'"),
        (
            lambda jet: [jet.A[0, 0], jet.A[0, 1]],
            r"type list: a CasADi .*; ca.vertcat\(…\) makes a column",
        ),
        (lambda jet: np.zeros(3), "something of type ndarray"),
        (lambda jet: 1.0, "something of type float"),
        (lambda jet: jet.A[0, 0] > 0, "returns a comparison: .* lower= and upper="),
        (lambda jet: jet.A[0, 0] * np.nan, "holds the number nan"),
        (lambda jet: jet.A[0, 0] - ca.SX.sym("q"), "holds the symbol q"),
        (lambda jet: jet.t, "does not depend on the motion"),
        (lambda jet: ca.SX(0, 1), "returns an empty expression"),
    ],
)
def test_what_a_function_does_wrong_is_said_with_its_name(door, function, message):
    with pytest.raises(sm.InputError, match=f"mine.*{message}"):
        DOORS[door](function)


@pytest.mark.parametrize("door", [name for name in DOORS if name not in ("squares", "own residuals")])
def test_none_is_no_expression(door):
    with pytest.raises(sm.InputError, match=r"mine.* returns None: a CasADi expression"):
        DOORS[door](lambda jet: None)


@pytest.mark.parametrize("door", [name for name in DOORS if name not in ("constraint", "squares", "own residuals")])
@pytest.mark.parametrize("function", [lambda jet: jet.A, lambda jet: jet.A[:, 0]], ids=["matrix", "column"])
def test_an_integrand_is_a_scalar(door, function):
    with pytest.raises(sm.InputError, match=r"energy mine returns shape \(3, .\) as integrand: a scalar is needed"):
        DOORS[door](function)


@pytest.mark.parametrize("name", MOTIONS)
def test_matrices_of_residuals_are_flattened(name):
    motion = MOTIONS[name]
    expected = sm.measure(motion, Own(lambda jet: ca.sumsqr(jet.dA)))
    assert sm.measure(motion, Own(lambda jet: jet.dA, squares=True)) == pytest.approx(expected, rel=1e-12)
    program = sm.affine_program(KEYS, objective=Own(lambda jet: jet.dA, squares=True))
    column = sm.affine_program(KEYS, objective=Own(lambda jet: ca.vec(jet.dA), squares=True))
    assert program.terms[0].kernel.code == column.terms[0].kernel.code


@pytest.mark.parametrize("energy", [sm.Rigidity(), sm.energies.Bending()], ids=lambda e: e.name)
@pytest.mark.parametrize("name", ["pose", "orientation"])
def test_a_measure_that_a_motion_has_not(name, energy):
    with pytest.raises(sm.InputError, match=f"fails on jets of kind {name}: AttributeError"):
        sm.measure(MOTIONS[name], energy)


def test_an_interrupt_passes():
    with pytest.raises(KeyboardInterrupt):
        constrained(raising(KeyboardInterrupt()))
    with pytest.raises(sm.InputError) as caught:
        constrained(raising(KeyError("k")))
    assert isinstance(caught.value.__cause__, KeyError)
