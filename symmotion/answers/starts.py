"""Starts of descents: a portfolio of the kinds that lead to different minima, each made where it is solved."""

from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import count

import numpy as np

from symmotion.program import Evaluator, Program, Staged, Turning
from symmotion.solvers import Solution, Solver
from symmotion.solvers.ways import turned
from symmotion.systems import AnySystem, Saddle, largest, shifted, system_of, tenfold

OWN, RIGID, STAGED, WINDING, RANDOM, HOP = "own", "rigid", "staged", "winding", "random", "hop"
# How far random starts lie from the program's own, relative to the spread of its numbers: from near to all over.
LEAST_SPREAD, MOST_SPREAD = 0.1, 1.0
# And hops from a minimum that is there already, whose neighbours are often lower: shorter ones lead back to it.
LEAST_HOP, MOST_HOP = 1.0, 4.0
# The share of the controls that a hop moves where it does not move all, and how often it moves all.
LEAST_PART, MOST_PART, ALL = 0.1, 0.4, 0.25
# What a hop makes of the numbers that it takes: the opposite, or nothing.
FACTORS = (-1.0, -1.0, 0.0)
# Turns in rad from which the other way round is a start of its own.
LEAST_TURN = 0.25 * np.pi
WAYS = 2  # before the stages
# Multiples of the identity that make a Gauss–Newton matrix positive definite, relative to its diagonal.
RIDGE, MOST_RIDGE = 1e-6, 1e6


@dataclass(frozen=True)
class Start:
    """Where a descent begins.

    kind: "own", the program's; "rigid", turning as rigidly as the keyframes let it; "staged", through programs of lower
    degree; "winding", rigid with one segment the other way round; "random", drawn independently of all others; "hop",
    noise about the lowest minimum that was known.
    number: which segment, or which draw; seed: of the draws. base: (unknowns,) what a hop sets out from.
    """

    kind: str
    number: int = 0
    seed: int = 0
    base: np.ndarray | None = field(default=None, repr=False, compare=False)

    def __str__(self) -> str:
        return f"{self.kind} {self.number}" if self.kind in (WINDING, RANDOM, HOP) else self.kind


def settled(program: Program) -> list[Start]:
    """The starts that are not drawn, in the order in which they pay: stages take the time of several solves."""
    angles = _angles(program)
    # The longer the way, the less longer is the other one.
    order = np.argsort(-angles, kind="stable")
    found = [Start(OWN), *([Start(RIGID)] if angles.size else [])]
    ways = [Start(WINDING, int(k)) for k in order if angles[k] > LEAST_TURN]
    return found + ways[:WAYS] + ([Start(STAGED)] if isinstance(program.design, Staged) else []) + ways[WAYS:]


def drawn(seed: int) -> Iterator[Start]:
    """Random starts without end, alike in distribution and independent of each other."""
    return (Start(RANDOM, k, seed) for k in count())


@dataclass(frozen=True)
class FromStart:
    """A solver that takes a `Start` for start."""

    solver: Solver

    @property
    def tolerance(self) -> float:
        return self.solver.tolerance

    @property
    def max_iterations(self) -> int:
        return self.solver.max_iterations

    def solve(self, program: Program, start: object = None) -> Solution:
        return self.solver.solve(program, begun(program, start, self.solver) if isinstance(start, Start) else start)


def begun(program: Program, start: Start, solver: Solver) -> object:
    """What a solver takes as start: None for the program's own, a motion, or (unknowns,) numbers."""
    design = program.design
    if start.kind == OWN:
        return None
    if start.kind == STAGED:
        return _staged(program, solver)
    if start.kind == RANDOM:
        return _random(program, np.random.default_rng([start.seed, start.number]))
    if start.base is not None:
        rng = np.random.default_rng([start.seed, start.number, 1])
        return _hop(program, start.base, rng)
    assert isinstance(design, Turning)
    whole = np.zeros(len(design.turns))
    if start.kind == WINDING:
        whole[start.number] = -1
    return program.pack(design.rigid(whole))


def _angles(program: Program) -> np.ndarray:
    """(M − 1,) the turns between keyframes, of designs that know them."""
    return program.design.turns if isinstance(program.design, Turning) else np.empty(0)


def _staged(program: Program, solver: Solver) -> object:
    """The motion of the last of the programs of lower degree, each started from the one before."""
    reached = None
    for stage in program.stages("degree"):
        reached = solver.solve(stage, reached)
    return None if reached is None else reached.motion


def _random(program: Program, rng: np.random.Generator) -> np.ndarray:
    """(unknowns,) one of three kinds by lot: other ways round, noise, or noise along low curvature.

    Noise has a distance of its own from the start, between LEAST_SPREAD and MOST_SPREAD.
    """
    angles, x = _angles(program), program.x0
    kind = rng.integers(3 if angles.size else 2)
    extent = _extent(program, rng, LEAST_SPREAD, MOST_SPREAD)
    if kind == 2:
        assert isinstance(program.design, Turning)
        # Either way round by how much shorter it is than the other: half a turn goes both ways alike.
        whole = -(rng.random(len(angles)) < angles / (2 * np.pi)).astype(float)
        return program.pack(program.design.rigid(whole))
    noise = rng.normal(size=len(x))
    if kind == 1:
        step = _softened(program, x, noise / extent)
        if step is not None:
            return x + step * (np.sqrt(len(x)) / (np.linalg.norm(step / extent) or 1.0))
    return x + extent * noise


def _hop(program: Program, base: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """(unknowns,) away from a minimum, one of three ways by lot.

    A segment the other way round; all numbers but lengths, of some controls that follow each other or of all, times
    one of FACTORS; or noise on them.
    """
    angles = _angles(program)
    kind = rng.integers(3 if angles.size else 2)
    if kind == 2:
        return turned(program, base, int(rng.choice(len(angles), p=angles / angles.sum() if angles.any() else None)))
    part = _part(program, rng)
    if kind == 1:
        return base + part * _extent(program, rng, LEAST_HOP, MOST_HOP) * rng.normal(size=len(base))
    factor = rng.choice(FACTORS)
    return np.where(part * ~_lengths(program), factor * base, base)


def _part(program: Program, rng: np.random.Generator) -> np.ndarray:
    """(unknowns,) whether each belongs to some controls that follow each other, or to all, by lot."""
    whole, middle, size = rng.random() < ALL, rng.random(), rng.uniform(LEAST_PART, MOST_PART)
    taken = {}
    for name, values in program.start.items():
        place = np.arange(len(values)) / max(1, len(values) - 1)
        near = np.abs(place - middle) <= max(size / 2, 0.5 / len(values))
        taken[name] = np.broadcast_to((near | whole)[:, None], values.shape)
    return program.pack(taken).astype(bool)


def _lengths(program: Program) -> np.ndarray:
    """(unknowns,) which unknowns are lengths, not pure numbers."""
    found = {}
    for name, values in program.start.items():
        found[name] = np.zeros(values.shape, dtype=bool)
        found[name][:, program.lengths.get(name, slice(0, 0))] = True
    return program.pack(found).astype(bool)


def _extent(program: Program, rng: np.random.Generator, least: float, most: float) -> np.ndarray:
    """(unknowns,) a distance drawn between two, all orders alike, relative to the spread of the start."""
    return np.exp(rng.uniform(np.log(least), np.log(most))) * spread(program)


def spread(program: Program) -> np.ndarray:
    """(unknowns,) the root mean square of the start's numbers about their means, of lengths and pure numbers each."""
    spreads = {}
    for name, values in program.start.items():
        lengths = np.zeros(values.shape[1], dtype=bool)
        lengths[program.lengths.get(name, slice(0, 0))] = True
        size = np.empty(values.shape)
        for part in (lengths, ~lengths):
            centred = values[:, part] - values[:, part].mean(axis=0) if part.any() else np.zeros(1)
            size[:, part] = np.sqrt(np.mean(centred**2)) or 1.0
        spreads[name] = size
    return program.pack(spreads)


def _softened(program: Program, x: np.ndarray, noise: np.ndarray) -> np.ndarray | None:
    """(unknowns,) M⁻¹ noise along the equalities, M the Gauss–Newton matrix at x: long where it curves little."""
    evaluator = Evaluator(program)
    system = _system(program, evaluator, x)
    still = np.zeros(program.conditions)
    _, matrix = evaluator.second_order(x, system.pattern, still, theta=0.0)
    factor, _ = shifted(system, matrix, program.unit, tenfold(RIDGE, most=MOST_RIDGE))
    step = None if factor is None else system.step(factor, noise)
    return step if step is not None and np.isfinite(step).all() and largest(step) > 0 else None


def _system(program: Program, evaluator: Evaluator, x: np.ndarray) -> AnySystem:
    if program.equalities_only and program.linear:
        return system_of(program, evaluator, x)
    return Saddle(program, evaluator.jacobian(x)[np.flatnonzero(program.lower == program.upper)])
