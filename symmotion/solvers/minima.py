"""Which minima of a program are one, as far as numbers tell."""

from collections.abc import Iterable

from symmotion.solvers.solution import Solution, Status
from symmotion.systems import largest

# Two minima are one where objectives differ by less, relative, and unknowns by less in the program's units.
SAME, NEAR = 1e-6, 1e-3


def same(one: Solution, other: Solution) -> bool:
    """Whether two minima of a program are one."""
    if abs(one.objective - other.objective) > margin(one, other):
        return False
    strict = one.inertia == other.inertia == "positive"
    unit = one.program.unit
    return not strict or largest((one.x - other.x) / unit) <= NEAR * (1.0 + largest(one.x / unit))


def margin(*solutions: Solution) -> float:
    """What objectives of one minimum may differ by."""
    size = max(abs(s.objective) for s in solutions)
    return SAME * size + max(s.certificate.rounding for s in solutions)


def distinct(solutions: Iterable[Solution]) -> tuple[Solution, ...]:
    """Of the solved ones those that differ, lowest first; of those that are one, the first."""
    kept: list[Solution] = []
    for solution in solutions:
        if solution.status is Status.SOLVED and not any(same(other, solution) for other in kept):
            kept.append(solution)
    return tuple(sorted(kept, key=lambda s: s.objective))
