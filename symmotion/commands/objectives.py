"""Objectives as words."""

import re

import numpy as np

from symmotion.energies import Energy, Rigidity, StrainAcceleration, StrainRate, TrajectoryEnergy
from symmotion.errors import InputError

OBJECTIVES = ("rigidity", "rigidity2", "energy", "strain", "strain2")
LETTERS = ("R", "R*", "E", "S", "S*")


def objective_by_name(text: str, dimension: int) -> Energy:
    """An objective from its name or a weighted sum of names, such as "rigidity+0.001*energy".

    Names: rigidity (or R), rigidity2 (R*), energy (E, of the unit points and opposites), strain (S), strain2 (S*).
    """
    points = np.concatenate([np.eye(dimension), -np.eye(dimension)])
    energies = (Rigidity(), Rigidity(2), TrajectoryEnergy(points), StrainRate(), StrainAcceleration())
    known: dict[str, Energy] = dict(zip((*OBJECTIVES, *LETTERS), energies * 2, strict=True))
    # A plus after an exponent's e belongs to the number.
    first, *others = (_term(part, known) for part in re.split(r"(?<![0-9.][eE])\+", text))
    return sum(others, start=first)


def _term(part: str, known: dict[str, Energy]) -> Energy:
    """One name, with its weight where it has one."""
    match = re.fullmatch(r"\s*(?:([-+0-9.eE]+)\s*\*\s*)?([A-Za-z0-9]+\*?)\s*", part)
    if match is None or match[2] not in known:
        raise InputError(f"objective {part.strip()!r} is unknown; there are {', '.join(OBJECTIVES)} and their sums")
    if not match[1]:
        return known[match[2]]
    try:
        weight = float(match[1])
    except ValueError:
        raise InputError(f"objective {part.strip()!r}: {match[1]!r} is no number") from None
    return weight * known[match[2]]
