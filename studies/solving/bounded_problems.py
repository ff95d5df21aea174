"""Seeded problems with inequalities, of every kind of program; what the studies of bounds draw from."""

from collections.abc import Callable, Sequence
from typing import Any

import casadi as ca
import numpy as np
from scipy.spatial.transform import Rotation

import symmotion as sm
from studies.solving.problem_set.problem import Measured, Problem
from symmotion.program import Evaluator

POINTS = np.concatenate([np.zeros((1, 3)), np.eye(3)])
TIP = np.array([0.3, -0.1, 0.5])


# Any: programs of all kinds.
Made = Callable[[Sequence[Any]], Any]


def problem(seed: int, known: Sequence[float] | None = None) -> Problem:
    """The problem of a seed: the kinds take turns, the rest is drawn.

    Limits are drawn beside what the motion without them does: from as much down to 0.75 of it, which not every
    problem can keep. known: what was measured of that motion before, see `Measured`.
    """
    rng = np.random.default_rng(seed)
    kind = list(KINDS)[seed % len(KINDS)]
    share = round(float(rng.uniform(0.75, 1.0)), 3)
    count = int(rng.integers(4, 13))
    measured = Measured(known)
    program = KINDS[kind](rng, count, share, measured)
    return Problem(kind, f"{seed}: {kind}, {count} keyframes, limit × {share:g}", program, measured.numbers)


def _limited(
    make: Made, bound: Callable[[float], Any], share: float, measured: Measured, squared: bool = False
) -> sm.program.Program:
    """The program whose bound is a share of what its free motion reaches where the bound is looked at."""
    most = measured(lambda: largest(make([bound(1.0)]), sm.ExactNewton().solve(make([])).x))
    return make([bound(share * (most**0.5 if squared else most))])


def largest(program: sm.program.Program, x: np.ndarray) -> float:
    """The largest value of a program's last constraint at x (unknowns,)."""
    return float(Evaluator(program).values(x)[-program.constraints[-1].size :].max())


def _keys(rng: np.random.Generator, count: int, angle: float = 60.0) -> sm.Keyframes:
    return sm.examples.random_keyframes(count, float(rng.uniform(20, angle)), int(rng.integers(1_000_000)))


def _objective(rng: np.random.Generator) -> sm.energies.Energy:
    weight = round(float(10.0 ** rng.uniform(-3, 0)), 4)
    return sm.Rigidity(int(rng.integers(1, 3))) + weight * sm.TrajectoryEnergy(POINTS)


def _speed(rng: np.random.Generator, count: int, share: float, measured: Measured) -> sm.program.Program:
    keys, objective = _keys(rng, count), _objective(rng)
    return _limited(
        lambda c: sm.affine_program(keys, objective=objective, constraints=c),
        lambda limit: sm.SpeedBound(POINTS, limit),
        share,
        measured,
        squared=True,
    )


def _tolerance(rng: np.random.Generator, count: int, share: float, measured: Measured) -> sm.program.Program:
    keys, objective = _keys(rng, count, 150.0), _objective(rng)
    loose = sm.constraints.Tolerance(linear=0.4 * (1 - share), translation=1 - share)
    return sm.affine_program(keys, objective=objective, constraints=[loose])


def _no_inversion(rng: np.random.Generator, count: int, share: float, measured: Measured) -> sm.program.Program:
    keys, objective = _keys(rng, count, 170.0), sm.Rigidity(2) + 1e-2 * sm.TrajectoryEnergy(POINTS)
    return sm.affine_program(keys, objective=objective, constraints=[sm.constraints.NoInversion(share)])


def _floor(rng: np.random.Generator, count: int, share: float, measured: Measured) -> sm.program.Program:
    keys, objective = _keys(rng, count), _objective(rng)

    def bound(depth: float) -> sm.JetConstraint:
        return sm.JetConstraint(
            lambda jet: ca.vertcat(*(-jet.place(p)[2] for p in POINTS)), lower=-np.inf, upper=depth, name="floor"
        )

    lowest = float(-(keys.linear @ POINTS.T + keys.translation[:, :, None])[:, 2].min())
    free, wide = (sm.affine_program(keys, objective=objective, constraints=c) for c in ((), [bound(0.0)]))
    most = measured(lambda: largest(wide, sm.ExactNewton().solve(free).x))
    # Between the lowest keyframe, or a little above, and what the free motion does.
    return sm.affine_program(
        keys, objective=objective, constraints=[bound(lowest + (share - 0.8) * max(most - lowest, 0.01) / 0.2)]
    )


def _keep_out(rng: np.random.Generator, count: int, share: float, measured: Measured) -> sm.program.Program:
    keys, objective = _keys(rng, count), _objective(rng)
    free = sm.affine_program(keys, objective=objective)
    k = int(rng.integers(count - 1))
    middle = measured.all(lambda: sm.ExactNewton().solve(free).motion(keys.times[k : k + 2].mean()).translation, 3)
    ends = np.linalg.norm(keys.translation - middle, axis=1).min()
    centre = middle + 0.05 * rng.normal(size=3)
    radius = (1.7 - share) * 0.8 * ends
    apart = sm.JetConstraint(lambda jet: ca.sumsqr(jet.v - centre), lower=radius**2, upper=np.inf, name="keep out")
    return sm.affine_program(keys, objective=objective, constraints=[apart])


def _fit(rng: np.random.Generator, count: int, share: float, measured: Measured) -> sm.program.Program:
    samples = sm.examples.random_keyframes(4 * count, 10, int(rng.integers(1_000_000)))
    return _limited(
        lambda c: sm.fit_program(samples, controls=count + 3, constraints=c),
        lambda limit: sm.SpeedBound(np.zeros(3), limit),
        share,
        measured,
        squared=True,
    )


def drawn_turns(rng: np.random.Generator, count: int) -> tuple[np.ndarray, Rotation]:
    axes = rng.normal(size=(count, 3))
    angles = np.deg2rad(rng.uniform(20, 90, count))
    steps = Rotation.from_rotvec(angles[:, None] * axes / np.linalg.norm(axes, axis=1, keepdims=True))
    turns = [steps[0]]
    for i in range(1, count):
        turns.append(turns[-1] * steps[i])
    return np.cumsum(rng.uniform(0.7, 1.3, count)), Rotation.concatenate(turns)


def _rate(rng: np.random.Generator, count: int, share: float, measured: Measured) -> sm.program.Program:
    times, turns = drawn_turns(rng, count)

    def reached() -> float:
        free = sm.ExactNewton().solve(sm.orientation_program(times, turns, refine=2))
        t = np.linspace(*free.motion.domain, 400)
        return float(np.linalg.norm(free.motion.rate(t, "body"), axis=1).max())

    fastest = measured(reached)
    return sm.orientation_program(times, turns, refine=2, constraints=[sm.RateBound(share * fastest)])


def _torque(rng: np.random.Generator, count: int, share: float, measured: Measured) -> sm.program.Program:
    times, turns = drawn_turns(rng, count)
    inertia = (1.0, 2.0, 2.5)
    objective = sm.Torque(inertia)
    return _limited(
        lambda c: sm.orientation_program(times, turns, objective=objective, refine=3, constraints=c),
        lambda limit: sm.constraints.TorqueBound(limit, inertia),
        share,
        measured,
        squared=True,
    )


def _pose(rng: np.random.Generator, count: int, share: float, measured: Measured) -> sm.program.Program:
    times, turns = drawn_turns(rng, count)
    places = np.cumsum(rng.normal(size=(count, 3)), axis=0)
    return _limited(
        lambda c: sm.pose_program(times, turns, places, refine=2, constraints=c),
        lambda limit: sm.SpeedBound(TIP, limit),
        share,
        measured,
        squared=True,
    )


def _curve(rng: np.random.Generator, count: int, share: float, measured: Measured) -> sm.program.Program:
    points = np.cumsum(rng.normal(size=(count, 3)), axis=0)
    keys = sm.Keyframes(np.cumsum(rng.uniform(0.7, 1.3, count)), np.tile(np.eye(3), (count, 1, 1)), points)
    return _limited(
        lambda c: sm.curve_program(keys, constraints=c, degree=5),
        lambda limit: sm.JetConstraint(lambda jet: ca.sumsqr(jet.ddx), lower=-np.inf, upper=limit, name="acceleration"),
        share,
        measured,
    )


def _free_times(rng: np.random.Generator, count: int, share: float, measured: Measured) -> sm.program.Program:
    keys = _keys(rng, min(count, 8), 90.0)
    objective = sm.Rigidity() + 1e-2 * sm.TrajectoryEnergy(POINTS)
    return sm.free_times_program(keys, objective=objective, least_step=0.8 * share * float(np.diff(keys.times).min()))


KINDS: dict[str, Callable[[np.random.Generator, int, float, Measured], sm.program.Program]] = {
    "speed": _speed,
    "tolerance": _tolerance,
    "no inversion": _no_inversion,
    "floor": _floor,
    "keep out": _keep_out,
    "fit": _fit,
    "rate": _rate,
    "torque": _torque,
    "pose": _pose,
    "curve": _curve,
    "free times": _free_times,
}
