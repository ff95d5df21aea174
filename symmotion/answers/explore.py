"""The minima of a program: many starts, what they lead to, and how many minima they may have missed."""

from collections.abc import Sequence
from concurrent.futures import Executor
from contextlib import ExitStack
from dataclasses import dataclass, replace
from itertools import islice
from numbers import Real
from typing import Generic

import numpy as np

from symmotion import checks
from symmotion.answers.starts import HOP, RANDOM, FromStart, Start, drawn, settled
from symmotion.batches import Failed, own_processes, solve_many
from symmotion.errors import InputError
from symmotion.program import DesignT, Program
from symmotion.program.program import require_program
from symmotion.solvers import ExactNewton, Solution, Solver, Status
from symmotion.solvers.minima import same
from symmotion.solvers.solver import require_solver

# Starts that are not drawn before all others. Then in every round, after which the counts are looked at again, another
# one of them, a random one, and hops from the lowest minimum of before.
FIRST, SETTLED, DRAWS, HOPS = 2, 1, 1, 4


@dataclass(frozen=True, eq=False)
class Exploration(Generic[DesignT]):
    """What the starts of `explore` led to.

    minima: certified solutions that differ, lowest first; counts: how many starts led to each.
    starts: in the order in which they were tried; led: by start, the minimum (its place in `minima`) that it led to, −1
    where it led to none. reason: why no more were tried.

    program: that was explored. Raises InputError where there is no minimum.

    >>> program = sm.affine_program(sm.examples.random_keyframes(4, 150, seed=3))
    >>> search = sm.explore(program, budget=4)
    >>> bool(search.best.objective == min(search.objectives))
    True
    """

    program: Program[DesignT]
    minima: tuple[Solution[DesignT], ...]
    counts: tuple[int, ...]
    starts: tuple[Start, ...]
    led: tuple[int, ...]
    reason: str

    @property
    def best(self) -> Solution[DesignT]:
        """The lowest minimum; InputError where none was found."""
        if not self.minima:
            raise InputError("no start led to a minimum: more of them, or another solver, may")
        return self.minima[0]

    @property
    def objectives(self) -> np.ndarray:
        """(starts,) the objective of the minimum that each start led to, ∞ where it led to none."""
        return np.array([self.minima[k].objective if k >= 0 else np.inf for k in self.led])

    @property
    def draws(self) -> int:
        """Random starts that led to a minimum."""
        return sum(s.kind == RANDOM and k >= 0 for s, k in zip(self.starts, self.led, strict=True))

    @property
    def drawn(self) -> int:
        """Different minima that random starts led to."""
        return len({k for s, k in zip(self.starts, self.led, strict=True) if s.kind == RANDOM and k >= 0})

    @property
    def unseen(self) -> float:
        """The expected number of minima that no random start led to, see `expected_unseen`."""
        return expected_unseen(self.draws, self.drawn)

    @property
    def unseen_share(self) -> float:
        """The expected share of random starts that would lead to one of these, see `expected_share`."""
        return expected_share(self.draws, self.drawn)

    def __repr__(self) -> str:
        return (
            f"Exploration({_minima(len(self.minima))} from {len(self.starts)} starts, "
            f"{f'lowest {self.minima[0].objective:.9g}' if self.minima else 'none solved'})"
        )

    def __str__(self) -> str:
        lines = [f"{_minima(len(self.minima))} from {len(self.starts)} starts; {self.reason}"]
        for k, (solution, n) in enumerate(zip(self.minima, self.counts, strict=True)):
            kinds = dict.fromkeys(s.kind for s, to in zip(self.starts, self.led, strict=True) if to == k)
            lines.append(f"  {solution.objective:.9g}: {n} starts ({', '.join(kinds)}), inertia {solution.inertia}")
        lost = self.led.count(-1)
        lines += [f"  none: {lost} starts"] * (lost > 0)
        lines.append(
            f"  random starts: {self.draws}, which led to {_minima(self.drawn)}; expected unseen {self.unseen:.3g}, "
            f"with {100 * self.unseen_share:.3g} % of the starts. This says nothing of how low they are"
        )
        return "\n".join(lines)


def _minima(count: int) -> str:
    return f"{count} {'minimum' if count == 1 else 'minima'}"


def expected_unseen(draws: int, seen: int) -> float:
    """E[unseen minima] = w (w + 1)/(n − w − 2) after n independent starts led to w minima; ∞ where n ≤ w + 2.

    The posterior mean where any number of minima, and any shares of the starts for them, are equally likely before.
    Source: Boender and Rinnooy Kan 1987.
    """
    return seen * (seen + 1) / (draws - seen - 2) if draws > seen + 2 else np.inf


def expected_share(draws: int, seen: int) -> float:
    """E[share of starts that lead to unseen minima] = w (w + 1)/(n (n − 1)), 1 at most; see `expected_unseen`."""
    return min(1.0, seen * (seen + 1) / (draws * (draws - 1))) if draws > 1 else 1.0


def explore(
    program: Program[DesignT],
    *,
    budget: int,
    seed: int = 0,
    executor: Executor | int | None = None,
    solver: Solver | None = None,
    unseen: float = 0.5,
) -> Exploration[DesignT]:
    """Minima of a program from many starts, and an estimate of those that were missed.

    The first starts are the program's own and a rigid one, polar factors that turn at constant rates. Then come rounds
    of six: one that is not drawn while there are some, which are rigid with one segment the other way round, those
    with the largest turns first, and staged by degree; a random one; and hops. Random ones are drawn independently:
    noise about the program's own start, noise along directions of low curvature, rigid with either way round by lot.
    Hops lead away from the lowest minimum that is known when they are handed out, by lot with a segment the other way
    round, with some controls in opposition or at zero, or with noise. All programs have the own start, random ones and
    hops; the others where they make sense.

    budget: the most starts. seed: of the random ones. executor: None for this process, a number of processes, or an
    executor, see `solve_many`; the answer is the same, whatever the workers. solver: ExactNewton() when left out.
    unseen: no more starts are tried once the random ones expect fewer unseen minima, see `expected_unseen`; 0 to use
    the budget.

    Minima differ where their objectives do by more than a millionth, or their motions by more than a thousandth; of
    those that are not strict, which may be one of many, only objectives count.

    Raises InputError for a budget below 1.

    >>> program = sm.affine_program(sm.examples.random_keyframes(4, 150, seed=3))
    >>> search = sm.explore(program, budget=4)
    >>> sum(search.counts)
    4
    """
    require_program(program)
    budget, seed = checks.whole(budget, 1, "budget", " of starts"), checks.whole(seed, 0, "seed")
    unseen = checks.not_negative(unseen, "unseen")
    launched = FromStart(ExactNewton() if solver is None else require_solver(solver))
    known, more = iter(settled(program)), drawn(seed)
    batch = [*islice(known, FIRST)]
    starts: list[Start] = []
    answers: list[Solution | Failed] = []
    with ExitStack() as stack:
        if isinstance(executor, Real):
            # Kept from round to round: starting processes takes longer than many solves.
            executor = stack.enter_context(own_processes(checks.whole(executor, 1, "executor", " of processes")))
        while True:
            batch = [*batch, *islice(known, SETTLED), *islice(more, DRAWS)][: budget - len(starts)]
            answers += solve_many(((program, s) for s in batch), launched, executor)
            starts += batch
            found = _sorted(program, starts, answers, "")
            if found.unseen < unseen:
                reason = f"fewer than {unseen:g} minima are expected to be unseen"
            elif len(starts) >= budget:
                reason = f"the budget of {budget} starts is used"
            else:
                base = found.minima[0].x if found.minima else None
                batch = [] if base is None else [Start(HOP, len(starts) + k, seed, base) for k in range(HOPS)]
                continue
            return replace(found, reason=reason)


def _sorted(
    program: Program[DesignT], starts: Sequence[Start], answers: Sequence[Solution | Failed], reason: str
) -> Exploration[DesignT]:
    minima: list[Solution] = []
    led: list[int] = []
    for answer in answers:
        if isinstance(answer, Failed) or answer.status is not Status.SOLVED:
            led.append(-1)
            continue
        place = next((k for k, other in enumerate(minima) if same(other, answer)), len(minima))
        if place == len(minima):
            minima.append(answer)
        led.append(place)
    order = sorted(range(len(minima)), key=lambda k: minima[k].objective)
    rank = {old: new for new, old in enumerate(order)} | {-1: -1}
    led = [rank[k] for k in led]
    counts = tuple(led.count(k) for k in range(len(minima)))
    return Exploration(program, tuple(minima[k] for k in order), counts, tuple(starts), tuple(led), reason)
