"""Problems at whose minimum conditions depend on each other, or press without a force.

At the minima of all of them there are multipliers, though not always one set only.
"""

from collections.abc import Callable

import casadi as ca
import numpy as np

import symmotion as sm
from studies.solving.problem_set.problem import Measured
from symmotion.program import Program

Energy = sm.energies.Energy


def repeated(keys: sm.Keyframes, energy: Energy, _: Measured) -> Program:
    """Where a keyframe holds the place as an equality, bounds say so again: equal rows of the Jacobian."""
    place = keys.translation[1]
    again = sm.JetConstraint(lambda jet: jet.v - place, lower=-np.inf, upper=0.0, at=keys.times[1], name="again")
    return sm.affine_program(keys, objective=energy, constraints=[again])


def redundant(keys: sm.Keyframes, energy: Energy, _: Measured) -> Program:
    """det A ≥ 1 at the keyframes, which are rotations: redundant once linearised, curved before."""
    volume = sm.JetConstraint(lambda jet: ca.det(jet.A) - 1, lower=0.0, upper=np.inf, at=keys.times, name="volume")
    return sm.affine_program(keys, objective=energy, constraints=[volume])


def weakly_active(keys: sm.Keyframes, energy: Energy, measured: Measured) -> Program:
    """A wall that the free motion touches at one time: met without a multiplier."""
    free, times = sm.affine_program(keys, objective=energy), _between(keys, 5)
    most = measured(lambda: sm.ExactNewton().solve(free).motion(times).translation[:, 0].max())
    wall = sm.JetConstraint(lambda jet: jet.v[0], lower=-np.inf, upper=most, at=times, name="wall")
    return sm.affine_program(keys, objective=energy, constraints=[wall])


def vanishing(keys: sm.Keyframes, energy: Energy, measured: Measured) -> Program:
    """‖v − c‖² = 0 where the free motion passes c: the gradient of the condition is zero at all feasible points."""
    free, time = sm.affine_program(keys, objective=energy), _between(keys, 1)[1]
    place = measured.all(lambda: sm.ExactNewton().solve(free).motion(time).translation, 3)
    there = sm.JetConstraint(lambda jet: ca.sumsqr(jet.v - place), at=time, name="there")
    return sm.affine_program(keys, objective=energy, constraints=[there])


def corner(keys: sm.Keyframes, energy: Energy, measured: Measured) -> Program:
    """a ≥ 0, b ≥ 0, a b ≤ 0 of two coordinates at a time: complementarity, without an interior."""
    free, time = sm.affine_program(keys, objective=energy), _between(keys, 1)[0]
    place = measured.all(lambda: sm.ExactNewton().solve(free).motion(time).translation, 3)
    x, y = place[:2] - 0.1

    def function(jet: sm.jets.Jet) -> ca.SX:
        return ca.vertcat(jet.v[0] - x, jet.v[1] - y, -(jet.v[0] - x) * (jet.v[1] - y))

    edges = sm.JetConstraint(function, lower=0.0, upper=np.inf, at=time, name="edges")
    return sm.affine_program(keys, objective=energy, constraints=[edges])


def _between(keys: sm.Keyframes, count: int) -> np.ndarray:
    """((M − 1) · count,) times inside the segments."""
    inside = (np.arange(count) + 1.0) / (count + 1)
    return (keys.times[:-1, None] + np.diff(keys.times)[:, None] * inside).ravel()


KINDS: dict[str, Callable[[sm.Keyframes, Energy, Measured], Program]] = {
    "repeated": repeated,
    "redundant": redundant,
    "weakly active": weakly_active,
    "vanishing": vanishing,
    "corner": corner,
}
