"""The other way round: from a minimum to where a segment between keyframes turns rigidly on its longer way."""

import numpy as np

from symmotion.program import Program, Turning

# Turns in rad from which on the other way round, which is less than twice as long, often costs less.
LARGE = 2 * np.pi / 3


def large_turns(program: Program, most: int) -> list[int]:
    """The segments that turn by more than LARGE, the largest turns first, `most` of them; none of other designs."""
    if most == 0 or not isinstance(program.design, Turning):
        return []
    turns = program.design.turns
    return [int(k) for k in np.argsort(-turns, kind="stable")[:most] if turns[k] > LARGE]


def turned(program: Program, base: np.ndarray, segment: int) -> np.ndarray:
    """(unknowns,) of a motion (unknowns,) that turns rigidly along a segment, the other way round."""
    assert isinstance(program.design, Turning)
    return program.pack(program.design.turned(program.unpack(base), segment))
