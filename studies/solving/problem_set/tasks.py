"""The problems of the set as tasks of a contest."""

from collections.abc import Iterator
from functools import cache, partial
from itertools import islice

from studies.solving.contest.attempts import Task
from studies.solving.problem_set import load
from studies.solving.problem_set.families import FAMILIES, entries
from studies.solving.problem_set.problem import Measured
from symmotion.program import Program

# Kinds whose functions take long to derive; no problem of the quick forms is of these.
SLOW = ("orientation", "pose", "rate", "torque", "free times")


@cache
def program(name: str) -> Program:
    """The program of a name, with the numbers that the manifest has of it."""
    row = next(row for row in load.manifest()["problems"] if row["name"] == name)
    return entries()[name].program(Measured(row["measured"]))


def tasks() -> Iterator[Task]:
    """All problems of the set, with the best values that the manifest has."""
    for seed, row in enumerate(load.manifest()["problems"]):
        best = float("inf") if row["best"] is None else row["best"]["objective"]
        yield Task(row["name"], row["family"], seed, partial(program, row["name"]), best)


def quick(count: int, most: int = 150) -> list[Task]:
    """Some of each family, of at most so many unknowns."""
    rows = {row["name"]: row for row in load.manifest()["problems"]}
    small = [t for t in tasks() if rows[t.name]["unknowns"] <= most and rows[t.name]["kind"] not in SLOW]
    return [t for family in FAMILIES for t in islice((s for s in small if s.family == family), count)]
