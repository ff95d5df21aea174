"""The problems of the set by name: which family, which seed, and how symmotion makes them.

Bounds that are meant for all times are held at fixed ones here, so that each problem is one nonlinear program.
"""

import json
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cache, partial
from pathlib import Path

import numpy as np

import symmotion as sm
from studies.solving import bounded_problems, hard_keyframes
from studies.solving.problem_set import degenerate
from studies.solving.problem_set.problem import Measured
from symmotion.program import Program

EQUALITIES, CURVED, BOUNDS, DEGENERATE, SCALED, LONG, RECORDED = FAMILIES = (
    "equalities",
    "nonlinear equalities",
    "inequalities",
    "degenerate",
    "badly scaled",
    "long",
    "recorded",
)
RECORDINGS = Path(__file__).with_name("recorded.json")
CORNERS = np.concatenate([np.eye(3), -np.eye(3)])
Make = Callable[[Measured], Program]


@dataclass(frozen=True, eq=False)
class Entry:
    """A problem of the set: name, family, kind within the family, seed of what is drawn."""

    name: str
    family: str
    kind: str
    seed: int
    make: Make

    def program(self, measured: Measured | None = None) -> Program:
        """The program, its bounds held at fixed times."""
        made = self.make(Measured() if measured is None else measured)
        held = tuple(replace(c, everywhere=None) for c in made.constraints)
        return replace(made, constraints=held)


def _hard() -> Iterator[Entry]:
    for seed in range(50):
        kind = hard_keyframes.KINDS[seed % len(hard_keyframes.KINDS)]
        family = SCALED if kind in (hard_keyframes.SCALED, hard_keyframes.FAR) else EQUALITIES
        yield Entry(f"keyframes-{seed:02}", family, kind, seed, partial(_hard_program, seed))


def _hard_program(seed: int, _: Measured) -> Program:
    return hard_keyframes.problem(seed).program


def _bounded() -> Iterator[Entry]:
    for seed in range(4 * len(bounded_problems.KINDS)):
        kind = list(bounded_problems.KINDS)[seed % len(bounded_problems.KINDS)]
        yield Entry(f"bounded-{seed:02}", BOUNDS, kind, seed, partial(_bounded_program, seed))


def _bounded_program(seed: int, measured: Measured) -> Program:
    found = bounded_problems.problem(seed, measured.known)
    measured.numbers = found.measured
    return found.program


def keys_of(seed: int, count: int, angle: float, dimension: int = 3) -> sm.Keyframes:
    """Seeded keyframes whose neighbours are turned by an angle in degrees."""
    keys = sm.examples.random_keyframes(count, angle, seed)
    return keys if dimension == 3 else sm.Keyframes(keys.times, _flat(keys), keys.translation[:, :2])


def _flat(keys: sm.Keyframes) -> np.ndarray:
    """(M, 2, 2) turns in the plane, by the angle that each is turned against the first."""
    angles = np.unwrap(np.arctan2(keys.linear[:, 1, 0], keys.linear[:, 0, 0]))
    return np.stack([sm.examples.rotation_2d(np.rad2deg(a)) for a in angles])


def both(seed: int, order: int = 1) -> sm.energies.Energy:
    """R or R* with a seeded weight of E beside it."""
    weight = round(float(10.0 ** np.random.default_rng([seed, 7]).uniform(-3, 0)), 4)
    return sm.Rigidity(order) + weight * sm.TrajectoryEnergy(CORNERS)


def _volume(seed: int, _: Measured) -> Program:
    keys = keys_of(seed, 4 + seed, 70)
    middle = 0.5 * (keys.times[1:] + keys.times[:-1])
    conditions = [sm.constraints.UnitVolume(middle)]
    return sm.affine_program(keys, objective=both(seed, 1 + seed % 2), constraints=conditions, refine=2)


def _pace(seed: int, _: Measured) -> Program:
    """The origin has a given speed in the middle of every other segment."""
    keys = keys_of(seed, 6 + seed, 50)
    middle = 0.5 * (keys.times[1::2] + keys.times[:-1:2])[: len(keys) // 2]
    speed = float(np.linalg.norm(np.diff(keys.translation, axis=0), axis=1).sum() / np.ptp(keys.times))
    pace = sm.JetConstraint(lambda jet: jet.dv.T @ jet.dv - speed**2, at=middle, name="pace")
    return sm.affine_program(keys, objective=both(seed), constraints=[pace], refine=2)


def _coupled(seed: int, _: Measured) -> Program:
    """Two bodies at a given distance at two times."""
    keys = keys_of(seed, 5, 60)
    beside = sm.Keyframes(keys.times, keys.linear, keys.translation + np.array([2.0, 0.5, 0.0]))
    parts = {n: sm.affine_program(k, objective=both(seed)) for n, k in (("left", keys), ("right", beside))}
    times = keys.times[:2] + 0.4 * np.diff(keys.times[:3])
    apart = sm.JetConstraint(lambda a, b: (a.v - b.v).T @ (a.v - b.v) - 5.0, at=[(t, t) for t in times], name="apart")
    return sm.join(parts, [apart])


def _turning(seed: int, _: Measured) -> Program:
    rng = np.random.default_rng(seed)
    times, turns = np.cumsum(rng.uniform(0.7, 1.3, 4 + seed)), sm.quaternions.exp(rng.normal(size=(4 + seed, 3)))
    return sm.orientation_program(times, turns, refine=1 + seed % 2)


def _posed(seed: int, _: Measured) -> Program:
    rng = np.random.default_rng(seed)
    times, turns = np.arange(4.0 + seed), sm.quaternions.exp(0.6 * rng.normal(size=(4 + seed, 3)))
    objective = sm.Torque((1.0, 2.0, 2.5)) + 0.1 * sm.TrajectoryEnergy(np.eye(3))
    return sm.pose_program(times, turns, rng.normal(size=(4 + seed, 3)), objective=objective)


CURVED_KINDS = {"unit volume": _volume, "pace": _pace, "two bodies": _coupled, "orientation": _turning, "pose": _posed}


def _curved() -> Iterator[Entry]:
    for kind, make in CURVED_KINDS.items():
        for seed in range(3 if kind == "pose" else 5):
            yield Entry(f"{kind.replace(' ', '-')}-{seed}", CURVED, kind, seed, partial(make, seed))


def _degenerate() -> Iterator[Entry]:
    for kind, make in degenerate.KINDS.items():
        for seed in range(5):
            name = f"{kind.replace(' ', '-')}-{seed}"
            yield Entry(name, DEGENERATE, kind, seed, partial(make, keys_of(seed, 4 + seed, 60), both(seed)))


def _in_units(clock: float, yardstick: float, bound: bool, seed: int, measured: Measured) -> Program:
    """A problem told in other units of time and length: its objective and conditions are of very different size."""
    keys = keys_of(seed, 5 + seed, 60)
    told = sm.Keyframes(clock * keys.times, keys.linear, yardstick * keys.translation)
    objective = sm.Rigidity() + 0.1 * sm.TrajectoryEnergy(yardstick * CORNERS)
    if not bound:
        return sm.affine_program(told, objective=objective)

    def limited(limit: float) -> Program:
        return sm.affine_program(told, objective=objective, constraints=[sm.SpeedBound(np.zeros(3), limit)])

    free = sm.affine_program(told, objective=objective)
    most = measured(lambda: bounded_problems.largest(limited(1.0), sm.ExactNewton().solve(free).x) ** 0.5)
    return limited(0.97 * most)


def _scaled() -> Iterator[Entry]:
    units = {
        "microseconds": (1e6, 1.0),
        "years": (1e-7, 1.0),
        "micrometres": (1.0, 1e6),
        "clock and yardstick": (1e4, 1e-4),
    }
    for kind, (clock, yardstick) in units.items():
        for seed in range(4):
            make = partial(_in_units, clock, yardstick, seed % 2 == 1, seed)
            yield Entry(f"{kind.replace(' ', '-')}-{seed}", SCALED, kind, seed, make)


def _long_program(count: int, order: int, constraint: str, seed: int, measured: Measured) -> Program:
    keys = keys_of(seed, count, 40)
    objective = sm.Rigidity(order) + 0.01 * sm.TrajectoryEnergy(CORNERS[:3]) if constraint else sm.Rigidity(order)
    if constraint == "speed":
        limited = partial(_speed_limited, keys, objective)
        free = sm.affine_program(keys, objective=objective)
        most = measured(lambda: bounded_problems.largest(limited(1.0), sm.ExactNewton().solve(free).x) ** 0.5)
        return limited(0.95 * most)
    middle = 0.5 * (keys.times[1:] + keys.times[:-1])[::4]
    conditions = [sm.constraints.UnitVolume(middle)] if constraint == "volume" else []
    return sm.affine_program(keys, objective=objective, constraints=conditions)


def _speed_limited(keys: sm.Keyframes, objective: sm.energies.Energy, limit: float) -> Program:
    return sm.affine_program(keys, objective=objective, constraints=[sm.SpeedBound(np.zeros(3), limit)])


def _long() -> Iterator[Entry]:
    made = ((100, 1, ""), (200, 1, ""), (100, 2, ""), (150, 2, ""), (60, 1, "speed"), (100, 1, "speed"))
    for seed, (count, order, constraint) in enumerate((*made, (60, 1, "volume"), (100, 1, "volume"))):
        kind = {"": "keyframes", "speed": "speed bound", "volume": "unit volume"}[constraint]
        make = partial(_long_program, count, order, constraint, seed)
        yield Entry(f"long-{seed}", LONG, kind, seed, make)


def _recorded_program(name: str, energy: str, _: Measured) -> Program:
    keys = recordings()[name]
    if energy == "torque":
        return sm.orientation_program(keys.times, keys.rotations(), refine=1)
    return sm.affine_program(keys, objective=sm.Rigidity() if energy == "R" else both(len(keys), 2))


def _recorded() -> Iterator[Entry]:
    for name, energy in ((n, e) for n in recordings() for e in ("R", "R* and E", "torque")):
        slug = energy.replace("*", "").replace(" ", "-").lower()
        yield Entry(f"{name}-{slug}", RECORDED, f"{energy}", 0, partial(_recorded_program, name, energy))


@cache
def recordings() -> dict[str, sm.Keyframes]:
    """Keyframes picked from recordings, by name; their sources and licences lie beside them."""
    told = json.loads(RECORDINGS.read_text(encoding="utf-8"))["keyframes"]
    return {
        n: sm.Keyframes(*(np.array(k[part]) for part in ("times", "linear", "translation"))) for n, k in told.items()
    }


@cache
def entries() -> dict[str, Entry]:
    """All problems by name, in the order of the families."""
    makers = (_hard, _curved, _bounded, _degenerate, _scaled, _long, _recorded)
    found = [entry for make in makers for entry in make()]
    return {e.name: e for family in FAMILIES for e in found if e.family == family}
