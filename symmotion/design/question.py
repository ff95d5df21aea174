"""What the questions have in common: constraints at the door, built into programs, and found to be independent."""

from collections.abc import Iterable, Sequence

from symmotion.constraints import MotionConstraint, Setting
from symmotion.design.terms import distinct
from symmotion.errors import InputError
from symmotion.program import Constraint


def as_constraints(constraints: object) -> tuple[MotionConstraint, ...]:
    """The constraints of a program; InputError unless they are a sequence of conditions."""
    if isinstance(constraints, MotionConstraint):
        raise InputError(f"constraints: a list is needed, [{type(constraints).__name__}(…)], for a single one too")
    if isinstance(constraints, str | bytes) or not isinstance(constraints, Iterable):
        raise InputError(f"constraints {constraints!r}: a list of conditions is needed")
    found = tuple(constraints)
    for c in found:
        if not isinstance(c, MotionConstraint):
            raise InputError(f"constraint {c!r} is no condition on a motion")
    return found


def built(constraints: Sequence[MotionConstraint], setting: Setting, given: Sequence[Constraint]) -> list[Constraint]:
    """The conditions as parts of a program beside those given, each under a name of its own.

    InputError where two give one parameter different numbers.
    """
    taken = {c.name for c in given}
    found = [c.named(distinct(c.name, taken)).build(setting) for c in constraints]
    numbers: dict[str, tuple[str, object]] = {}
    for c in found:
        for place in c.parameters:
            value = c.block.data[0, place.columns].tolist(), place.shape
            name, first = numbers.setdefault(place.name, (c.name, value))
            if first != value:
                raise InputError(
                    f"parameter {place.name!r} has other numbers in {c.name!r} than in {name!r}: "
                    "one name is one parameter"
                )
    return found
