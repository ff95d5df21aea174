"""What the times at which bounds press, which move with the data, add to the curvature of a minimum."""

from dataclasses import dataclass, replace

import numpy as np
from scipy import sparse

from symmotion.program import Constraint, Evaluator, Program
from symmotion.program.program import Structure

# Steps of the differences in time, of the span that a contact lies in.
STEP = 1e-3
# Slopes in time, relative to the curvature times the span, from which on a contact is no maximum but held by an end.
STANDS = 1e-2
# Times as close, of the shortest span, are of one contact.
BESIDE = 0.02


@dataclass(frozen=True, eq=False)
class _Along:
    """A bound at its contacts and beside them: values (N, C) and Jacobians by number of steps."""

    values: dict[int, np.ndarray]
    jacobians: dict[int, sparse.csr_array]


def contact_curvature(program: Program, x: np.ndarray, multipliers: np.ndarray) -> sparse.csr_array:
    """(unknowns, unknowns) −Σ λ g_xτ g_xτᵀ / g_ττ over contacts with multipliers λ at times τ, maxima of g in time.

    It is what is left of τ in the Hessian of f + λᵀg(x, τ) once ∂g/∂τ = 0 has taken it out. Derivatives in time are
    differences of fourth order inside a span; contacts at the ends of the motion stay there.
    """
    n = program.unknowns
    whole = sparse.csr_array((n, n))
    bounds = [c for c in program.constraints if c.everywhere is not None and c.times is not None and not c.is_equality]
    if not bounds:
        return whole
    breaks = _breakpoints(program, x)
    for c in bounds:
        loads = program.split(multipliers)[c.name]
        assert c.times is not None  # of these bounds
        times = c.times[:, 0]
        span = np.clip(np.searchsorted(breaks, times, side="right") - 1, 0, len(breaks) - 2)
        widths = np.diff(breaks)[span]
        inside = (times - 2 * STEP * widths >= breaks[0]) & (times + 2 * STEP * widths <= breaks[-1])
        h = STEP * np.where(inside, widths, 0.0)
        beside = _beside(program, c, x, h)
        h = np.where(inside, h, 1.0)[:, None]
        g = beside.values
        slope = (8 * (g[1] - g[-1]) - (g[2] - g[-2])) / (12 * h)
        bend = (16 * (g[1] + g[-1]) - (g[2] + g[-2]) - 30 * g[0]) / (12 * h**2)
        # A maximum for an upper bound, a minimum for a lower one.
        stands = np.abs(slope) <= STANDS * np.abs(bend) * widths[:, None]
        moves = inside[:, None] & (loads * bend < 0) & stands
        if not moves.any():
            continue
        j = beside.jacobians
        turning = (8 * (j[1] - j[-1]) - (j[2] - j[-2])) / 12
        weight = np.where(moves, -loads / np.where(moves, bend, 1.0) / h**2, 0.0).ravel()
        whole = whole + turning.T @ sparse.diags_array(weight) @ turning
    return sparse.csr_array(whole)


def beside_contacts(program: Program, x: np.ndarray, pressing: np.ndarray) -> np.ndarray:
    """(conditions,) whether a bound that is meant for all times is held beside a time where it presses.

    An exchange ends with both, and the second says nothing that the first does not. pressing: (conditions,).
    """
    found = [np.empty(0, dtype=bool)]
    parts = program.split(pressing)
    breaks = None
    for c in program.constraints:
        near = np.zeros(c.lower.shape, dtype=bool)
        if c.everywhere is not None and c.times is not None and not c.is_equality:
            breaks = _breakpoints(program, x) if breaks is None else breaks
            apart = np.abs(c.times[:, :1] - c.times[:, 0])
            close = (apart <= BESIDE * np.diff(breaks).min()) & ~np.eye(len(apart), dtype=bool)
            near = ((close @ parts[c.name].astype(float)) > 0) & ~parts[c.name]
        found.append(near.ravel())
    return np.concatenate(found)


def _breakpoints(program: Program, x: np.ndarray) -> np.ndarray:
    motion: object = program.design.motion(program.unpack(x))
    every = list(motion.values()) if isinstance(motion, dict) else [motion]
    return np.unique(np.concatenate([np.asarray(getattr(m, "breakpoints", None)) for m in every]))


def _beside(program: Program, constraint: Constraint, x: np.ndarray, steps: np.ndarray) -> _Along:
    values, jacobians = {}, {}
    assert constraint.everywhere is not None and constraint.times is not None  # of a bound at contacts
    for k in range(-2, 3):
        held = constraint.everywhere.at(constraint.times + k * steps[:, None], constraint)
        evaluator = Evaluator(replace(program, terms=(), constraints=(held,), structure=Structure()), "interpreted")
        values[k] = evaluator.values(x).reshape(held.lower.shape)
        jacobians[k] = evaluator.jacobian(x)
    return _Along(values, jacobians)
