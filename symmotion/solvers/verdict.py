"""What a comparison of solvers comes to, in one sentence."""

from collections.abc import Sequence

import numpy as np

from symmotion.solvers.minima import same
from symmotion.solvers.solution import Solution, Status


def verdict(found: Sequence[Solution], best: Solution | None, minima: int, left: Sequence[tuple[str, float]]) -> str:
    """Who won, who failed and by how much; best: the lowest minimum of so many; left: as in `Comparison`."""
    if best is None:
        return f"No solver reached a minimum: {', '.join(f'{s.method} {s.ended}' for s in found) or 'none was asked'}."
    alike = [s for s in found if s.status is Status.SOLVED and same(best, s)]
    won = min(alike, key=lambda s: (not s.certified, s.seconds.total))
    doubt = "" if won.certified else f", which is not certified ({won.inertia})"
    said = [f"{won.method} won with {won.objective:.6g}, best of {minima} minim{'um' if minima == 1 else 'a'}{doubt}"]
    said += [_beside(s, won, s in alike) for s in found if s is not won]
    said += [f"{method} met {value:.6g}, below which no minimum was certified" for method, value in left]
    return "; ".join(said) + "."


def _beside(s: Solution, won: Solution, alike: bool) -> str:
    if s.status is Status.UNSUPPORTED:
        return f"{s.method} does not take the program"
    if alike:
        doubt = "" if s.certified else f" but is not certified ({s.inertia})"
        return f"{s.method} got there in {_times(s.seconds.total, won.seconds.total)} the time{doubt}"
    if s.status is Status.SOLVED:
        doubt = "" if s.certified else f", not certified ({s.inertia})"
        return f"{s.method} ended {_higher(s, won)}{doubt}"
    where = f", {_higher(s, won)}" if np.isfinite(s.objective) and s.certificate.missed <= s.tolerance else ""
    return f"{s.method} failed ({s.ended}{where})"


def _times(one: float, other: float) -> str:
    return f"{one / other:.2g} times" if other > 0 else "times"


def _higher(s: Solution, won: Solution) -> str:
    """How much higher than the winner's an objective is."""
    gap = (s.objective - won.objective) / (abs(won.objective) or 1.0)
    if gap < 0:
        return f"{-100 * gap:.2g} % lower"
    return f"{100 * gap:.2g} % higher" if gap < 1 else f"{1 + gap:.3g} times as high"
