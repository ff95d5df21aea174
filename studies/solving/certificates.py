"""Minima, and points that only look like one: does the certificate pass the first and refuse the others?"""

from collections import Counter
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

import symmotion as sm
from studies.shares import interval, share
from symmotion.report import Column, Study, StudyOptions, StudyResult, Table

TOLERANCE = 1e-8
QUICK, FULL = 1, 100  # programs of a kind, and five or six forgeries of each
E2 = 0.1 * sm.TrajectoryEnergy(np.eye(2))


def planar(seed: int) -> sm.Keyframes:
    return sm.examples.random_keyframes(4, 40, seed=seed)


def affine(seed: int, **options: Any) -> sm.program.Program:  # Any: of the program
    keys = planar(seed)
    both = sm.Rigidity() + 0.1 * sm.TrajectoryEnergy(np.eye(keys.dimension))
    return sm.affine_program(keys, **{"objective": both, **options})


def orientation(seed: int, **options: Any) -> sm.program.Program:  # Any: of the program
    rng = np.random.default_rng(seed)
    turns = sm.quaternions.exp(0.4 * rng.normal(size=(4, 3)))
    return sm.orientation_program(np.arange(4.0), turns, **options)


def pose(seed: int) -> sm.program.Program:
    turns = orientation(seed).design.keys.quaternions
    places = np.random.default_rng(seed).normal(size=(4, 3))
    both = sm.Torque() + sm.TrajectoryEnergy(np.eye(3))
    return sm.pose_program(np.arange(4.0), turns, places, objective=both)


def curve(seed: int) -> sm.program.Program:
    points = np.random.default_rng(seed).normal(size=(5, 2))
    return sm.curve_program([sm.constraints.CurveCondition.at(np.arange(5.0), points)])


def fit(seed: int) -> sm.program.Program:
    return sm.fit_program(sm.examples.random_keyframes(12, 10, seed=seed), controls=6, objective=1e-3 * sm.Rigidity())


def bounded(seed: int) -> sm.program.Program:
    """A speed bound that presses: a little below the fastest of what is not bounded."""
    plain = affine(seed)
    motion = sm.ExactNewton().solve(plain).motion
    tip, (a, b) = np.zeros(motion.dimension), motion.domain
    fast = np.linalg.norm(motion.trajectory(tip, np.linspace(a, b, 50), 1), axis=-1).max()
    return affine(seed, constraints=[sm.SpeedBound(tip, 0.97 * float(fast))])


def linear_bound(seed: int) -> sm.program.Program:
    """A plane that a coordinate of the path may not pass: behind all keyframes, halfway to where the path would go."""
    motion = sm.ExactNewton().solve(affine(seed)).motion
    highest, (a, b) = planar(seed).translation[:, 0].max(), motion.domain
    path = motion(np.linspace(a, b, 2001)).translation[:, 0]
    most = 0.5 * (max(path.max(), highest) + highest)
    wall = sm.JetConstraint(lambda jet: jet.v[0], lower=-np.inf, upper=float(most), name="wall")
    return affine(seed, constraints=[wall])


KINDS: dict[str, Callable[[int], sm.program.Program]] = {
    "R and E": affine,
    "R*": lambda seed: affine(seed, objective=sm.Rigidity(2), degree=4),
    "unit volume": lambda seed: affine(seed, constraints=[sm.constraints.UnitVolume([0.4])]),
    "orientation": orientation,
    "pose": pose,
    "curve": curve,
    "fit": fit,
    "speed bound": bounded,
    "wall": linear_bound,
    "S": lambda seed: affine(seed, objective=sm.StrainRate() + E2 if planar(seed).dimension == 2 else None),
}


def along(program: sm.program.Program, solution: sm.Solution, rng: np.random.Generator) -> np.ndarray:
    """(unknowns,) a random change of the point, of the size of the unknowns, that keeps what is met to first order."""
    pressing = np.abs(solution.multiplier_vector) > 1e-4 * np.abs(solution.multiplier_vector).max(initial=0.0)
    met = np.flatnonzero((program.lower == program.upper) | pressing)
    jacobian = sm.program.Evaluator(program).jacobian(solution.x)[met].toarray()
    step = program.unit * rng.normal(size=program.unknowns)
    return step - np.linalg.lstsq(jacobian, jacobian @ step, rcond=None)[0] if len(jacobian) else step


def forgeries(
    program: sm.program.Program, solution: sm.Solution, rng: np.random.Generator
) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """What looks like the solution but is no minimum: the point or its multipliers, and in what it is wrong."""
    x, multipliers = solution.x, solution.multiplier_vector
    yield x + 1e-4 * along(program, solution, rng), multipliers
    yield x + 1e-6 * along(program, solution, rng), multipliers
    if not len(multipliers):
        return
    yield x + 1e-6 * program.unit * rng.normal(size=len(x)), multipliers
    yield x, multipliers * (1 + 1e-5 * rng.normal(size=len(multipliers)))
    yield x, -multipliers
    for k in np.flatnonzero((program.lower < program.upper) & (multipliers == 0.0))[:1]:
        # A bound that is not met presses.
        pressed = multipliers.copy()
        pressed[k] = np.abs(multipliers).max() or 1.0
        yield x, pressed


def run(options: StudyOptions) -> StudyResult:
    count, rows = FULL if options.full else QUICK, []
    for kind in KINDS:
        options.progress(kind)
        found = judged(kind, count)
        rows.append((kind, *(found[name] for name in ("true", "passed", "forged", "refused"))))
    rows.append(("all", *(sum(row[k] for row in rows) for k in range(1, 5))))
    columns = Column("program"), Column("minima"), Column("of them passed"), Column("forged"), Column("of them refused")
    caption = (
        "Minima that a solver found, and points that only look like one: moved by 1e-4 and by 1e-6 along the "
        "conditions, by 1e-6 across them, with multipliers that are off by 1e-5, of the wrong sign, or on a bound that "
        "is not met."
    )
    _, true, passed, forged, refused = rows[-1]
    low = [interval(*pair)[0] for pair in ((passed, true), (refused, forged))]
    text = (
        f"Of {true} minima {passed} pass, of {forged} forged points {refused} are refused, to a tolerance of "
        f"{TOLERANCE:g}: with 95 % confidence at least {low[0]:.1f} % and {low[1]:.1f} %."
    )
    answer = (
        f"The certificate passes {share(passed, true)} minima and refuses {share(refused, forged)} points that only "
        "look like one."
    )
    return StudyResult((Table("points", columns, tuple(rows), caption),), (), (), text, answer=answer)


def judged(kind: str, count: int) -> Counter[str]:
    """How many points of a kind there were, true and forged, and of how many the certificate was right."""
    rng, found = np.random.default_rng(11), Counter[str]()
    for seed in range(count):
        solution = sm.ExactNewton().solve(KINDS[kind](seed))
        if solution.status != "solved":
            continue
        program = solution.program  # with the times of its bounds at the end
        certificate = sm.certify(program, solution.x, solution.multiplier_vector)
        found["true"] += 1
        found["passed"] += certificate.holds(TOLERANCE) and certificate == solution.certificate
        for x, multipliers in forgeries(program, solution, rng):
            found["forged"] += 1
            found["refused"] += not sm.certify(program, x, multipliers).holds(TOLERANCE)
    return found


STUDY = Study(
    "certificates",
    "Does the certificate pass every minimum, and nothing else?",
    "Nocedal, Wright 2006, chapter 12",
    run,
    order=8,
)
