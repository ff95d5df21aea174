"""What a constraint may know of the program that it joins."""

from dataclasses import dataclass

import numpy as np

from symmotion import checks
from symmotion.brief import in_a_line, instants
from symmotion.errors import InputError
from symmotion.jets import RigidJet
from symmotion.jets.space import JetSpace, Places
from symmotion.splines.instants import distinct, unified

# Times in every span or segment at which a bound begins to be held.
DENSEST = 1000


@dataclass(frozen=True, eq=False)
class Setting:
    """What a constraint may know of the program that it joins.

    spaces: of the jets it is a function of, one for all or one for each body. times: (M,) of the keyframes, empty
    where there are none; linear, translation, quaternions: (M, d, d), (M, d), (M, 4) their parts, None where they
    have none such. moves: whether the translation is unknown; held: whether the keyframes are met; places: of the
    unknowns, where there are several bodies; bodies: the names of those that the constraint is about.

    Raises InputError where a constraint speaks of what the motion does not have.

    >>> from dataclasses import dataclass
    >>> @dataclass(frozen=True)
    ... class Early(sm.constraints.MotionConstraint):
    ...     name: str = "early"
    ...
    ...     def stated(self, setting: sm.constraints.Setting):
    ...         return sm.JetConstraint(lambda jet: jet.dv, at=setting.times[0], name=self.name)
    >>> keys = sm.examples.planar_keyframes()
    >>> objective = sm.Rigidity() + 0.01 * sm.TrajectoryEnergy(np.eye(2))
    >>> sm.affine_program(keys, objective=objective, constraints=[Early()]).constraint("early").is_equality
    True
    """

    spaces: tuple[JetSpace, ...]
    times: np.ndarray
    linear: np.ndarray | None = None
    translation: np.ndarray | None = None
    quaternions: np.ndarray | None = None
    moves: bool = True
    held: bool = True
    places: Places | None = None
    bodies: tuple[str, ...] = ()

    __repr__ = in_a_line

    @property
    def space(self) -> JetSpace:
        """The first of the spaces, where there is one motion its own."""
        return self.spaces[0]

    @property
    def domain(self) -> tuple[float, float]:
        """The times that all the motions have in common."""
        return max(s.domain[0] for s in self.spaces), min(s.domain[1] for s in self.spaces)

    def keyframe(self, i: int, name: str) -> int:
        """The number of keyframe i, counted from the end where negative."""
        if not len(self.times):
            raise InputError(f"{name} is about keyframe {i}, and this program has no keyframes")
        return checks.index(i, len(self.times), f"{name}: keyframe")

    def require_translation(self, name: str) -> None:
        """Raise InputError, for the constraint of this name, where the translation is not unknown."""
        if self.moves:
            return
        if isinstance(self.space.symbols(), RigidJet):
            raise InputError(f"{name} is about the translation, and an orientation has none: make a pose_program")
        raise InputError(
            f"{name} is a condition on the translation, which the objective does not see: add a TrajectoryEnergy"
        )

    def between_keyframes(self, density: int, name: str) -> np.ndarray:
        """(N,) `density` times inside every segment between keyframes, equally spaced."""
        return dense_times(self.times, density, name)

    def inside_spans(self, density: int, name: str) -> np.ndarray:
        """(N,) `density` times inside every span, at the middles of equal parts: at a knot two spans say the same."""
        checks.whole(density, 1, f"{name}: density", most=DENSEST)
        breaks = distinct(np.concatenate([s.breakpoints for s in self.spaces]))
        a, b = unified(self.domain, breaks)
        if not a < b:
            raise InputError(f"{name}: the motions have no times in common: give at, tuples of a time for each body")
        breaks = breaks[(breaks >= a) & (breaks <= b)]
        inside = (np.arange(density) + 0.5) / density
        return (breaks[:-1, None] + np.diff(breaks)[:, None] * inside).ravel()

    def inside(self, times: np.ndarray, name: str) -> np.ndarray:
        """(N,) the times, those that are a keyframe's up to rounding put there; InputError for the first outside."""
        return placed(times, self.domain, self.times, name)


def placed(times: np.ndarray, domain: tuple[float, float], marks: np.ndarray, name: str) -> np.ndarray:
    """The times, put on the ends of the domain and on marks that they agree with up to rounding."""
    a, b = domain
    times = unified(times, [a, b, *marks])
    outside = ~((times >= a) & (times <= b))
    if outside.any():
        t, a, b = instants(times[outside][0], a, b)
        raise InputError(f"{name}: time {t} is outside the motion's domain [{a}, {b}]")
    return times


def dense_times(times: np.ndarray, density: int, name: str) -> np.ndarray:
    """`density` times inside every interval of times (M,), equally spaced.

    name: whose they are. Raises InputError that names it where the density is no whole number of 1 or more.

    >>> sm.constraints.dense_times(np.array([0.0, 1.0, 3.0]), 1, "bound")
    array([0.5, 2. ])
    """
    density = checks.whole(density, 1, f"{name}: density", most=DENSEST)
    share = np.arange(1, density + 1) / (density + 1)
    return (times[:-1, None] + np.diff(times)[:, None] * share).ravel()
