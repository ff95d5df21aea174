"""The same questions asked in other units of time and length, from other origins: do the answers stay the same?"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

import symmotion as sm
from studies.shares import share
from symmotion.report import Column, Figure, Study, StudyOptions, StudyResult, Table, to_figure
from symmotion.views import COLOURS, new_figure


@dataclass(frozen=True)
class Units:
    """t → a t + b and v → k v + w: b in mean segments, w in extents of the places, both after scaling."""

    name: str
    a: float = 1.0
    b: float = 0.0
    k: float = 1.0
    w: float = 0.0

    def of(self, keys: sm.Keyframes) -> tuple[sm.Keyframes, sm.Keyframes, np.ndarray]:
        """Keyframes in these units, those that their rounded numbers mean in the old ones, and w as a vector."""
        step, extent = np.diff(keys.times).mean(), np.ptp(keys.translation, axis=0).max()
        far = self.w * self.k * extent * np.array([1.0, -0.7, 0.4])
        seen = sm.Keyframes(self.a * keys.times + self.b * self.a * step, keys.linear, self.k * keys.translation + far)
        if not self.b and not self.w:  # the same but for a rounding of each
            return seen, sm.Keyframes(keys.times - keys.times[0], keys.linear, keys.translation), far
        times = (seen.times - seen.times[0]) / self.a
        return seen, sm.Keyframes(times, keys.linear, (seen.translation - far) / self.k), far

    @property
    def resolved(self) -> float:
        """What the numbers given resolve of the places, in extents."""
        return 1e-9 + 64 * float(np.finfo(float).eps) * abs(self.w)


SAME = Units("as given")
UNITS = (
    Units("ns for s", a=1e9),
    Units("1e-9 of a unit of time", a=1e-9),
    Units("UNIX time at 1 kHz", a=1e-3, b=1.7e12 / 1e3),
    Units("nm for m", k=1e9),
    Units("bodies of 1e-9", k=1e-9),
    Units("5·10⁶ m away", w=1e6),
    Units("all far away", a=1e-9, b=1e9, k=1e9, w=-1e9),
    Units("all far away, before", a=1e9, b=-1e9, k=1e-9, w=1e9),
)
INERTIA = np.diag([1.0, 2.0, 2.5])


def _paths(u: Units) -> sm.TrajectoryEnergy:
    return sm.TrajectoryEnergy(u.k * np.eye(3))


def _mixed(u: Units) -> Any:  # Any: a sum of energies
    return sm.Rigidity() + 0.1 * (u.a / u.k) ** 2 * _paths(u)


def _touching(keys: sm.Keyframes, u: Units) -> tuple[sm.Keyframes, list[sm.JetConstraint]]:
    """Keyframes without the fourth, of which only a height is kept: that of a body point at its time."""
    (at, _, place), tip = keys[3], u.k * np.array([0.3, 0.0, 0.1])
    height = float(place[2])
    touch = sm.JetConstraint(lambda jet: jet.place(tip)[2], lower=height, upper=height, at=at, name="touch")
    return keys[[0, 1, 2, 4]], [touch]


def _affine(keys: sm.Keyframes, u: Units) -> Any:  # Any: programs of all kinds
    return sm.affine_program(keys, objective=_mixed(u))


def _met(keys: sm.Keyframes, u: Units) -> Any:  # Any: as above
    rest, touch = _touching(keys, u)
    return sm.affine_program(rest, objective=_mixed(u), constraints=touch)


def _turning(keys: sm.Keyframes, u: Units) -> Any:  # Any: as above
    return sm.orientation_program(keys, objective=sm.Torque(INERTIA), constraints=[sm.RateBound(4.0 / u.a)])


def _pose(keys: sm.Keyframes, u: Units) -> Any:  # Any: as above
    objective = sm.Torque(INERTIA) + 0.1 / u.k**2 * sm.TrajectoryEnergy(u.k * np.array([[0.3, 0.1, 0.0]]))
    rest, touch = _touching(keys, u)
    return sm.pose_program(rest, objective=objective, constraints=touch)


def _slopes(keys: sm.Keyframes, u: Units) -> Any:  # Any: as above
    given = u.k / u.a * np.array([[1.0, 2.0, 0.0]])
    return sm.curve_program(keys, constraints=[sm.constraints.CurveCondition.at([keys.times[1]], given, order=1)])


def _fit(keys: sm.Keyframes, u: Units) -> Any:  # Any: as above
    points, smooth = u.k * np.concatenate([np.eye(3), -np.eye(3)]), 1e-3 * u.k**2 * u.a * sm.Rigidity()
    return sm.fit_program(keys, controls=4, huber=0.1 * u.k, objective=smooth, points=points)


class Problem(NamedTuple):
    """A kind of program: how it is made, who solves it, whether its keyframes are rigid."""

    make: Callable[[sm.Keyframes, Units], Any]  # Any: as above
    solver: sm.ExactNewton | sm.Ipopt = sm.ExactNewton()
    rigid: bool = False


PROBLEMS = {
    "affine, R*": Problem(lambda keys, u: sm.affine_program(keys, objective=sm.Rigidity(2))),
    "affine, R + E": Problem(_affine),
    "affine, a point given": Problem(_met),
    "affine, tolerance": Problem(
        lambda keys, u: sm.affine_program(keys, objective=_mixed(u), constraints=[sm.Tolerance(linear=0.02)]),
        sm.Ipopt(),
    ),
    "fit, Huber": Problem(_fit),
    "free times": Problem(
        lambda keys, u: sm.free_times_program(keys, objective=sm.Rigidity(2) + 0.1 / u.k**2 * _paths(u)), sm.Ipopt()
    ),
    "orientation": Problem(lambda keys, u: sm.orientation_program(keys, objective=sm.Torque(INERTIA)), rigid=True),
    "orientation, rate bound": Problem(_turning, sm.Ipopt(), True),
    "pose, a point given": Problem(_pose, rigid=True),
    "curve": Problem(lambda keys, u: sm.curve_program(keys, order=3)),
    "curve, slopes given": Problem(_slopes),
}


class Deviation(NamedTuple):
    """How far an answer is from the one in the old units.

    linear, place: of the motion, places in extents; multipliers: of the keyframes, relative; iterations: difference;
    same: whether status and inertia are the same.
    """

    linear: float
    place: float
    multipliers: float
    iterations: int
    same: bool


def keyframes(seed: int, rigid: bool) -> sm.Keyframes:
    """Five random keyframes at random times."""
    rng = np.random.default_rng(seed)
    found = sm.examples.random_keyframes(5, 60, seed=seed)
    linear = found.linear + (0.0 if rigid else 0.1) * rng.normal(size=found.linear.shape)
    return sm.Keyframes(np.cumsum(rng.uniform(0.5, 1.5, 5)), linear, 2 * rng.normal(size=(5, 3)))


# Any: solutions of all kinds.
def deviation(problem: Problem, units: Units, seed: int, known: dict[sm.Keyframes, Any] | None = None) -> Deviation:
    """The answer in other units against that in the old ones, at the keyframes that the rounded numbers mean.

    known: old answers of the problem by their keyframes, to which this one is added.
    """
    seen, plain, far = units.of(keyframes(seed, problem.rigid))
    known = {} if known is None else known
    if plain not in known:
        known[plain] = problem.solver.solve(problem.make(plain, SAME))
    new, old = problem.solver.solve(problem.make(seen, units)), known[plain]
    share = np.linspace(0, plain.times[-1], 41)
    times = np.clip(seen.times[0] + units.a * share, *new.motion.domain)
    linear, places = _parts(new.motion(times))
    wanted, there = _parts(old.motion(np.clip((times - seen.times[0]) / units.a, *old.motion.domain)))
    extent = float(np.ptp(there, axis=0).max(initial=0.0)) or 1.0
    return Deviation(
        float(np.abs(linear - wanted).max(initial=0.0)),
        float(np.abs((places - far) / units.k - there).max(initial=0.0)) / extent if places.size else 0.0,
        _multipliers(new, old, units),
        abs(new.iterations - old.iterations),
        new.status == old.status and new.inertia == old.inertia,
    )


def _parts(value: Any) -> tuple[np.ndarray, np.ndarray]:  # Any: positions, quaternions or points
    """Turning and place of what a motion returns."""
    if isinstance(value, tuple):
        linear, places = value
        return linear, places if places.any() else places[:, :0]
    return (value, np.empty((len(value), 0))) if value.shape[1] == 4 else (np.empty(0), value)


def _multipliers(new: Any, old: Any, units: Units) -> float:  # Any: solutions of all kinds
    """The largest difference of the keyframes' multipliers relative to their largest, each over its objective."""
    worst = 0.0
    for (found, length), (wanted, _) in zip(_by_part(new), _by_part(old), strict=True):
        found = found * (units.k if length else 1.0) / new.objective
        wanted = wanted / old.objective
        worst = max(worst, float(np.abs(found - wanted).max()) / (float(np.abs(wanted).max()) or 1.0))
    return worst


def _by_part(solution: Any) -> list[tuple[np.ndarray, bool]]:  # Any: as above
    """The multipliers of keyframes, of turns and of places, and whether they are per length."""
    found = solution.multipliers
    keys, places = found.get("keyframes"), found.get("translation")
    if isinstance(keys, tuple):
        return [(keys[0], False), (keys[1], True)]
    parts = [] if keys is None else [(keys, not hasattr(solution.motion, "dimension"))]
    return parts + ([] if places is None else [(places, True)])


def run(options: StudyOptions) -> StudyResult:
    rows, worst = [], {}
    for number, (name, problem) in enumerate(PROBLEMS.items()):
        options.progress(name)
        known: dict[sm.Keyframes, Any] = {}
        # The quick form asks every kind in three of the units.
        asked = UNITS if options.full else [UNITS[(number + 3 * k) % len(UNITS)] for k in range(3)]
        for units in asked:
            found = [deviation(problem, units, seed, known) for seed in range(10 if options.full else 1)]
            linear, place, multipliers = (max(d[k] for d in found) for k in range(3))
            same = sum(d.same and d.iterations <= 1 for d in found)
            rows.append((name, units.name, linear, place, units.resolved, multipliers, same, len(found)))
            worst[name] = max(worst.get(name, 0.0), linear, place if units.w == 0 else 0.0)
    columns = (
        Column("program"),
        Column("units"),
        Column("turns and linear parts off by"),
        Column("places off by"),
        Column("places resolved to"),
        Column("multipliers off by"),
        Column("alike"),
        Column("problems"),
    )
    caption = (
        "Largest deviations from the answer in the old units at the keyframes that the rounded numbers mean; places in "
        "extents. Multipliers: relative, over the objective. Alike: status and inertia equal, iterations within one."
    )
    within = sum(row[2] <= 1e-9 and row[3] <= row[4] for row in rows)
    alike, problems = sum(row[6] for row in rows), sum(row[7] for row in rows)
    conclusion = (
        "The answer does not depend on the clock and the yardstick, nor on where they begin: in units from 1e-9 to "
        "1e9, up to 1e9 steps after zero and 1e9 extents away, turns and linear parts agree to "
        f"{max(row[2] for row in rows):.1g}, places to what the given numbers resolve, in {within} of {len(rows)} "
        f"cases; {alike} of {problems} problems end with the same status and inertia after as many iterations, give "
        f"or take one, and multipliers scale as they must, to {max(row[5] for row in rows):.1g}."
    )
    answer = (
        f"In other units and from far origins, turns and linear parts differ by {max(row[2] for row in rows):.0e} at "
        f"most, and {share(alike, problems)} problems end alike, after as many iterations give or take one."
    )
    tables = (Table("deviations", columns, tuple(rows), caption),)
    return StudyResult(tables, (_figure(worst),), conclusion=conclusion, answer=answer)


def _figure(worst: dict[str, float]) -> Figure:
    with new_figure(7.0, 3.2) as figure:
        axes = figure.subplots()
        names = list(worst)
        axes.barh(range(len(names)), [max(worst[n], 1e-17) for n in names], 0.6, color=COLOURS[0])
        axes.axvline(1e-9, color=COLOURS[1])
        axes.set_xscale("log")
        axes.set_yticks(range(len(names)), names)
        axes.set_xlabel("motion off by")
        axes.grid(False, axis="y")
        return to_figure(
            figure, "units", "Worst deviation of the motion by kind of program; the line is what is promised."
        )


STUDY = Study(
    "invariance_of_units",
    "Does an answer depend on the units and the origins of time and length?",
    "",
    run,
)
