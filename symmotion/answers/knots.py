"""Where to insert knots, driven by the integrand (HJK 4.2 leave it open), and auxiliary keyframes (HJK 4.1)."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from symmotion.checks import choice
from symmotion.design.affine import affine_program
from symmotion.design.measure import span_values
from symmotion.energies import Energy
from symmotion.errors import InputError
from symmotion.motions import Affine, AffineMotion, Keyframes
from symmotion.motions.interpolants import component_cubic, rational_spline
from symmotion.motions.rigid import polar_factors
from symmotion.program import Evaluator
from symmotion.solvers import ExactNewton, Solution, Solver

SHORTEST = 64  # roundings of the times in a span that is not halved


@dataclass(frozen=True, eq=False)
class KnotSearch:
    """What `auto_knots` did: the solution of every stage, the last the one of least objective.

    reason: why it stopped.

    >>> search = sm.answers.auto_knots(sm.examples.planar_keyframes(), objective=sm.Rigidity(2), budget=3)
    >>> search.stages[-1].objective <= search.stages[0].objective
    True
    """

    stages: tuple[Solution, ...]
    reason: str

    def __repr__(self) -> str:
        (few, high), (many, low) = self.history[0], self.history[-1]
        course = f"{few} → {many} unknowns, objective {high:.6g} → {low:.6g}"
        return f"KnotSearch({len(self.stages)} stages, {course}; {self.reason})"

    @property
    def solution(self) -> Solution:
        """The solution on the last knots."""
        return self.stages[-1]

    @property
    def motion(self) -> AffineMotion:
        """The motion on the last knots."""
        return self.solution.motion

    @property
    def history(self) -> list[tuple[int, float]]:
        """Unknowns and objective of every stage."""
        return [(s.program.unknowns, s.objective) for s in self.stages]


def auto_knots(
    keyframes: Keyframes,
    *,
    degree: int = 3,
    objective: Energy,
    budget: int,
    fall: float = 1e-3,
    share: float = 0.3,
    solver: Solver | None = None,
) -> KnotSearch:
    """Insert knots where the integrand of the objective is largest, and solve again, until it pays no more.

    Starts with simple knots at the keyframe times. At every stage the spans that together hold
    `share` of the objective are halved, each stage starting from the optimum before.

    budget: most inserted knots; fall: least relative fall of the objective by a stage, below which
    it stops. It stops, too, where all that is left of the objective is rounding, and where spans are as short as times
    resolve. solver: ExactNewton() when left out. Raises SolveError where a stage is not solved.

    degree: of the motion. Raises InputError for a budget, share or fall out of range.

    keyframes: that are passed.

    >>> search = sm.answers.auto_knots(sm.examples.planar_keyframes(), objective=sm.Rigidity(2), budget=3)
    >>> search.reason
    'the budget of 3 knots is used'
    """
    if budget < 0 or not 0 < share <= 1 or not 0 <= fall < 1:
        raise InputError(f"budget {budget} ≥ 0, share {share:g} in (0, 1] and fall {fall:g} in [0, 1) are needed")
    solver = solver or ExactNewton()
    inner = keyframes.times[1:-1]
    stages = [solver.solve(affine_program(keyframes, degree=degree, refine=0, objective=objective)).require()]
    while True:
        left = budget - (len(inner) - (len(keyframes) - 2))
        if left <= 0:
            return KnotSearch(tuple(stages), f"the budget of {budget} knots is used")
        motion = stages[-1].motion
        ends, contributions = motion.basis.breakpoints, np.abs(span_contributions(motion, objective))
        if stages[-1].objective <= Evaluator(stages[-1].program).rounding(stages[-1].x):
            return KnotSearch(tuple(stages), "the objective is nothing but rounding")
        middle = 0.5 * (ends[1:] + ends[:-1])
        contributions[np.diff(ends) <= SHORTEST * np.spacing(np.abs(ends).max())] = 0.0
        if not contributions.any():
            return KnotSearch(tuple(stages), "spans are as short as the times resolve")
        order = np.argsort(-contributions, kind="stable")
        needed = int(np.searchsorted(np.cumsum(contributions[order]), share * contributions.sum())) + 1
        chosen = order[: min(needed, left)]
        inner = np.sort(np.concatenate([inner, middle[chosen]]))
        program = affine_program(keyframes, degree=degree, objective=objective, knots=inner)
        stages.append(solver.solve(program, start=motion).require())
        before, after = stages[-2].objective, stages[-1].objective
        if before - after < fall * abs(before):
            return KnotSearch(tuple(stages), f"the last stage lowered the objective by less than {fall:g}")


def span_contributions(motion: AffineMotion, objective: Energy) -> np.ndarray:
    """(S,) what each span of a motion adds to an objective, to ten digits of their sum."""
    return span_values(motion, objective)


def auxiliary_keyframes(
    keyframes: Keyframes, per_segment: int = 1, rigid: bool | Literal["polar", "rational"] = False
) -> Keyframes:
    """The keyframes with `per_segment` more in every segment, from the cubic through four neighbours (HJK 4.1).

    rigid: True or "polar", orthonormalise the new ones (polar factor); "rational", take them from the rational motion
    through these neighbours, which is rigid, of keyframes in space (`interpolants.rational_spline`). Fewer than four
    keyframes take the curve through all. For keyframes so far apart that optimisation fails: optimise
    through these first, then start the true problem from that motion.

    Raises InputError for a number below 1, where the cubic between two keyframes is reflected, and for keyframes that
    no rational motion goes through.

    >>> sm.answers.auxiliary_keyframes(sm.examples.planar_keyframes()).times.round(3)
    array([0.   , 0.168, 0.335, 0.501, 0.666, 0.833, 1.   ])
    """
    if per_segment < 1:
        raise InputError(f"per_segment {per_segment}: at least 1 auxiliary keyframe is needed")
    if not isinstance(rigid, bool):
        choice(rigid, ("polar", "rational"), "way to rigid keyframes")
    m, times = len(keyframes), keyframes.times
    ends = "not-a-knot" if m >= 4 else "natural"
    new_times, found = [times], [Affine(keyframes.linear, keyframes.translation)]
    for i in range(m - 1):
        first = int(np.clip(i - 1, 0, max(0, m - 4)))
        window = keyframes[first : min(first + 4, m)]
        local = rational_spline(window, ends) if rigid == "rational" else component_cubic(window, ends)
        t = times[i] + (times[i + 1] - times[i]) * np.arange(1, per_segment + 1) / (per_segment + 1)
        position = local(t)
        if rigid is True or rigid == "polar":
            linear, _, _ = polar_factors(position.linear)
            if (np.linalg.det(linear) < 0).any():
                raise InputError(f"between keyframes {i} and {i + 1} the cubic is reflected: give a keyframe there")
            position = Affine(linear, position.translation)
        new_times.append(t)
        found.append(position)
    every = np.concatenate(new_times)
    order = np.argsort(every)
    linear, translation = (np.concatenate(parts)[order] for parts in zip(*found, strict=True))
    return Keyframes(every[order], linear, translation)
