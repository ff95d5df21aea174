"""Which conditions of a program cannot hold together."""

from collections.abc import Sequence
from contextlib import suppress
from functools import partial

import numpy as np
from scipy import sparse

from symmotion.program.evaluate import Evaluator
from symmotion.program.program import Program
from symmotion.systems.system import largest, reach

# Violations in own units below which conditions hold, and their share of the largest below which one is not involved.
HOLDS, INVOLVED = 1e-8, 1e-4
# Entries of a Jacobian up to which least squares go by its singular values.
DENSE = 500_000
MOST_STEPS = 100


def conflicting(program: Program, x: np.ndarray, evaluator: Evaluator | None = None) -> tuple[str, ...]:
    """The names of conditions that cannot hold together near x (unknowns,), none of which can be left out.

    min ‖ρ(x)‖², ρ how far each condition is outside its bounds, in own units: where it ends with ρ ≠ 0, conditions
    with ρ_i = 0 are not involved, since ρᵀ∂ρ/∂x = 0 is a combination of the others alone that nothing can satisfy. Of
    the rest those go, one after the other, without which it still does not vanish. Of linear conditions this is a
    proof, of others it is true near x. Empty where they can hold.

    program: whose; evaluator: of the program, where there is one already.

    Raises InputError for what is no program.

    >>> keys = sm.examples.planar_keyframes()
    >>> objective = sm.Rigidity() + sm.TrajectoryEnergy(np.eye(2))
    >>> slow = sm.SpeedBound(np.zeros((1, 2)), 1.0)
    >>> program = sm.affine_program(keys, objective=objective, constraints=[slow])
    >>> sm.systems.conflicting(program, program.x0)
    ('keyframes', 'speed')
    """
    evaluator = evaluator or Evaluator(program)
    starts = [point for point in (np.asarray(x, dtype=float), program.x0) if np.isfinite(point).all()]
    unit = program.unit
    # What is not finite is no conflict of conditions.
    found = [(largest(evaluator.violation(point) / reach(evaluator.jacobian(point), unit)), point) for point in starts]
    found = [(size, point) for size, point in found if np.isfinite(size)]
    if not found:
        return ()
    size, point = min(found, key=lambda pair: pair[0])
    if size <= HOLDS:
        return ()
    scale = reach(evaluator.jacobian(point), unit)
    missed = partial(_missed, evaluator, point, unit, scale)
    every = np.arange(program.conditions)
    rest = missed(every)
    most = largest(rest)
    if most <= HOLDS:
        return ()
    places = program.split(every)
    sizes = {name: largest(rest[part.ravel()]) for name, part in places.items()}
    names = sorted((name for name, own in sizes.items() if own > INVOLVED * most), key=sizes.__getitem__)
    for name in list(names):
        fewer = [other for other in names if other != name]
        if fewer and largest(missed(_rows(places, fewer))) > max(HOLDS, INVOLVED * most):
            names = fewer
    return tuple(name for name in places if name in names)


def conflict(program: Program, names: Sequence[str], proven: bool = False) -> str:
    """What is to be said of conditions that conflict; proven: whether that is so for no linear ones too.

    program: whose; names: of the conditions.

    >>> sm.systems.conflict(sm.affine_program(sm.examples.planar_keyframes()), ["keyframes", "speed"])
    "'keyframes' and 'speed' cannot hold together"
    """
    listed = " and ".join(([", ".join(map(repr, names[:-1]))] if len(names) > 1 else []) + [repr(names[-1])])
    proven = proven or all(c.block.kernel.linear for c in program.constraints if c.name in names)
    return f"{listed} cannot hold" + (" together" if len(names) > 1 else "") + ("" if proven else " near this motion")


def _rows(places: dict[str, np.ndarray], names: Sequence[str]) -> np.ndarray:
    return np.sort(np.concatenate([places[name].ravel() for name in names]))


def _missed(
    evaluator: Evaluator, start: np.ndarray, unit: np.ndarray, scale: np.ndarray, rows: np.ndarray
) -> np.ndarray:
    """(R,) the least violation of some conditions, in own units, near a start."""
    from scipy.optimize import least_squares  # here, since it is a sixth of the time of `import symmotion`

    program = evaluator.program
    equal = (program.lower == program.upper)[rows]
    touched = np.unique(evaluator.jacobian(start)[rows].indices)
    if not program.linear or not len(touched):
        touched = np.arange(program.unknowns)

    def point(y: np.ndarray) -> np.ndarray:
        x = start.copy()
        x[touched] += unit[touched] * y
        return x

    def outside(y: np.ndarray) -> np.ndarray:
        return (evaluator.violation(point(y)) / scale)[rows]

    def slopes(y: np.ndarray) -> np.ndarray | sparse.csr_array:
        x = point(y)
        weight = np.where(equal | (evaluator.violation(x)[rows] != 0), 1 / scale[rows], 0.0)
        found = sparse.csr_array(evaluator.jacobian(x)[rows][:, touched] * unit[touched] * weight[:, None])
        return found.toarray() if dense else found

    dense = len(rows) * len(touched) <= DENSE
    start_at, limits = np.zeros(len(touched)), {"ftol": 1e-14, "xtol": 1e-12, "gtol": 1e-12, "max_nfev": MOST_STEPS}
    if dense:
        # LAPACK gives up on some matrices of very unequal rows, which least squares by products take.
        with suppress(np.linalg.LinAlgError):
            return least_squares(outside, start_at, slopes, tr_solver="exact", **limits).fun
        dense = False
    return least_squares(outside, start_at, slopes, tr_solver="lsmr", **limits).fun
