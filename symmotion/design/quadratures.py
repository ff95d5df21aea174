"""How well the terms of programs integrate, asked at their solutions, and the nodes that they need there."""

import numpy as np

from symmotion.brief import instant
from symmotion.design.integrals import Integrand, integrand
from symmotion.design.terms import parts_of
from symmotion.energies import Energy
from symmotion.jets.seen import Called
from symmotion.motions import AffineMotion
from symmotion.program import QUADRATURE, Block, BlockEvaluator, Program, Quadrature
from symmotion.splines import Integral, Spline

# Rounding that is as much of a value leaves none of it: a motion that costs nothing.
NOTHING = 0.01


def term_quadratures(
    program: Program, x: np.ndarray, objective: Energy | None, motion: Called, keys: np.ndarray
) -> dict[str, Quadrature]:
    """By term of an objective, how well its nodes integrate along the motion that x (unknowns,) stands for.

    keys: (M,) times of the keyframes, by which errors are placed.
    """
    blocks, found = {b.name: b for b in program.terms}, {}
    for name, weight, energy in [] if objective is None else parts_of(objective):
        shares = _shares(program, blocks[name], x)
        if _exact(energy, motion):
            found[name] = Quadrature(float(shares.sum()), 0.0)
            continue
        along = integrand(motion, energy)
        integral = along.integral()
        found[name] = _compared(along, integral, weight, shares.reshape(len(integral.parts), -1).sum(axis=1), keys)
    return found


def nodes_at(program: Program, x: np.ndarray, objective: Energy | None, motion: Called) -> dict[str, int]:
    """By term, more Gauss nodes per span where ten digits of the program's objective at x (unknowns,) need them."""
    blocks = {b.name: b for b in program.terms}
    size = sum(float(np.abs(_shares(program, b, x)).sum()) for b in program.terms)
    found = {}
    for name, weight, energy in [] if objective is None else parts_of(objective):
        if energy.stated or _exact(energy, motion):
            continue
        along = integrand(motion, energy)
        integral, here = along.integral(), float(_shares(program, blocks[name], x).sum())
        now = blocks[name].count // (len(along.marks) - 1)
        if not integral.reached or abs(weight * integral.value - here) <= QUADRATURE * size:
            continue
        nodes = along.nodes(now, integral)
        if nodes > now:
            found[name] = nodes
    return found


def _exact(energy: Energy, motion: object) -> bool:
    return energy.exact and isinstance(motion, AffineMotion | Spline)


def _shares(program: Program, block: Block, x: np.ndarray) -> np.ndarray:
    """(N,) what each node of a term adds to it."""
    return BlockEvaluator(block).density(program.arrays(x)[block.variable]).ravel() * block.weights


def _compared(along: Integrand, integral: Integral, weight: float, spans: np.ndarray, keys: np.ndarray) -> Quadrature:
    """The value of a term, by spans (S,), beside its integral."""
    value, right, rounding = float(spans.sum()), weight * integral.value, abs(weight) * integral.rounding
    known = bool(integral.digits) or integral.reached
    error = abs(right - value) + abs(weight) * integral.error if np.isfinite(right) else np.inf
    if integral.reached and error <= 10 * rounding and rounding >= NOTHING * max(abs(value), abs(right)):
        error = 0.0
    if known:
        k = int(np.argmax(np.abs(spans - weight * integral.parts)))
        time, reason = 0.5 * (along.marks[k] + along.marks[k + 1]), ""
    else:
        time = 0.5 * sum(integral.worst)
        reason = ", where A is singular" if along.energy.divides_by_volume else ", where the integrand is infinite"
    return Quadrature(value, error, f"{_place(along.origin + time, keys)}{reason}")


def _place(time: float, keys: np.ndarray) -> str:
    if len(keys) < 2:
        return f"about time {instant(time, 9)}"
    k = int(np.clip(np.searchsorted(keys, time, side="right") - 1, 0, len(keys) - 2))
    return f"between keyframes {k} and {k + 1}, about time {instant(time, 9)}"
