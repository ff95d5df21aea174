"""What a study asks and returns, as plain data that pickles: tables, figures, players, runs and a conclusion."""

import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from symmotion.bodies import Body
from symmotion.brief import brief, in_a_line, start_of
from symmotion.errors import InputError
from symmotion.solvers.solution import Iteration, Seconds, Solution, Status, ending, is_certified
from symmotion.tables import Table


@dataclass(frozen=True)
class Figure:
    """An SVG as text, from `<svg` on.

    name: what its file is called; alt: what a blind reader is told, the caption when left out.

    Raises InputError for a text that is no SVG.

    >>> sm.report.Figure("dot", "<svg xmlns='http://www.w3.org/2000/svg'/>", "A dot.").name
    'dot'
    """

    name: str
    svg: str
    caption: str
    alt: str = ""

    __repr__ = in_a_line

    def __post_init__(self):
        require_name("figure", self.name)
        if not self.svg.startswith("<svg"):
            raise InputError(f"figure {self.name!r}: the text of an SVG element is needed")


@dataclass(frozen=True)
class Track:
    """A motion as piecewise cubics: poses and their rates at times, Hermite's cubics between.

    A pose is d² + d numbers: the linear part row by row, then the translation; colour: "#rrggbb".

    >>> keys = sm.examples.planar_keyframes()
    >>> moving = sm.report.player("spline", {"spline": sm.interpolants.component_cubic(keys)}, None, "A letter.", keys)
    >>> moving.tracks[0].label
    'spline'
    """

    label: str
    colour: str
    times: tuple[float, ...]
    poses: tuple[tuple[float, ...], ...]
    rates: tuple[tuple[float, ...], ...]

    __repr__ = in_a_line


@dataclass(frozen=True)
class Player:
    """A body that moves on the page; `symmotion.report.player` makes one from motions.

    tracks: motions to choose from, two are shown as before and after; keyframes: poses that stay in sight;
    picture: what is shown without script and in print, one of the study's figures or one of its own;
    unit: of the times; direction: from where a body in space is first seen; centre: the body point
    whose path is drawn.

    name: one of its own on a page; body: what moves; caption: below it; alt: what is seen, in words.

    Raises InputError for a name that a page cannot have.

    >>> keys = sm.examples.planar_keyframes()
    >>> moving = sm.report.player("spline", {"spline": sm.interpolants.component_cubic(keys)}, None, "A letter.", keys)
    >>> moving.domain
    (0.0, 1.0)
    """

    name: str
    body: Body
    tracks: tuple[Track, ...]
    picture: Figure
    caption: str
    alt: str = ""
    keyframes: tuple[tuple[float, ...], ...] = ()
    unit: str = ""
    direction: tuple[float, ...] = (1.0, -1.6, 1.3)
    centre: tuple[float, ...] = ()

    __repr__ = in_a_line

    def __post_init__(self):
        require_name("player", self.name)
        require_distinct(f"motions of player {self.name!r}", (track.label for track in self.tracks))

    @property
    def dimension(self) -> int:
        """Of the space that the bodies are in, 2 or 3."""
        return self.body.dimension

    @property
    def domain(self) -> tuple[float, float]:
        """From the first to the last time of all tracks."""
        return min(track.times[0] for track in self.tracks), max(track.times[-1] for track in self.tracks)

    @property
    def start(self) -> float:
        """What the times that are shown are told from, see `start_of`."""
        return start_of(np.array(self.domain))


@dataclass(frozen=True)
class Run:
    """One solver on one case: a row of the report, also where it failed.

    stationarity, violation, decrement, complementarity, inertia: the certificate's; excess: the worst of all
        bounds, anywhere where they are meant so, None where there are none; evaluations: of functions and
        derivatives, all together; unknowns, multipliers: how many;
    log: the iterations, for plots; message: what the solver said where it did not solve.

    case, method, solver: what was solved, by which solver's short name and repr; status: one of `solvers.Status`;
    objective: at the end; convergence_order: of the last steps; iterations: of the solver; seconds: by part.

    >>> solution = sm.ExactNewton().solve(sm.affine_program(sm.examples.planar_keyframes()))
    >>> sm.report.Run.of("four keyframes", solution).certified
    True
    """

    case: str
    method: str
    solver: str
    status: str
    objective: float | None = None
    stationarity: float | None = None
    violation: float | None = None
    decrement: float | None = None
    complementarity: float | None = None
    excess: float | None = None
    inertia: str = "unknown"
    iterations: int | None = None
    evaluations: int | None = None
    unknowns: int | None = None
    multipliers: int | None = None
    convergence_order: float | None = None
    seconds: Seconds = field(default_factory=Seconds)
    log: tuple[Iteration, ...] = field(default=(), repr=False)
    message: str = ""

    def __repr__(self) -> str:
        found = f"objective {brief(self.objective)}, {self.iterations} iterations"
        return f"Run({self.case}, {self.method}: {self.status}, {found})"

    @staticmethod
    def of(case: str, solution: Solution) -> "Run":
        """The row of a solution."""
        return Run(
            case,
            solution.method,
            solution.solver,
            str(solution.status),
            solution.objective,
            solution.stationarity,
            solution.violation,
            solution.certificate.decrement,
            solution.certificate.complementarity,
            max((e.value for e in solution.certificate.excess.values()), default=None),
            solution.inertia,
            solution.iterations if solution.log else None,
            sum(solution.evaluations.values()) or None,
            solution.program.unknowns,
            solution.program.conditions,
            solution.convergence_order,
            solution.seconds,
            solution.log,
            solution.message,
        )

    @staticmethod
    def failed(case: str, method: str, solver: str, status: Status | str, message: str) -> "Run":
        """The row of a run that has no solution to show."""
        return Run(case, method, solver, str(status), message=message)

    @property
    def certified(self) -> bool:
        """Whether it is a strict local minimum to the solver's tolerance."""
        return is_certified(self.status, self.inertia)

    @property
    def ended(self) -> str:
        """How it ended, see `ending`."""
        return ending(self.status, self.inertia)


@dataclass(frozen=True)
class StudyResult:
    """What a study found.

    answer: the one sentence that its reader takes away, of what was measured; the first figure stands beside it.
    conclusion: plain text, blank lines between paragraphs; notes: about this run of it.

    tables, figures, players: what it shows, by name; runs: solvers on its cases.

    Raises InputError for names that repeat.

    >>> from symmotion.report import Column, StudyResult, Table
    >>> StudyResult((Table("heights", (Column("h", "mm"),), ((1.5,),)),)).tables[0].rows
    ((1.5,),)
    """

    tables: tuple[Table, ...] = ()
    figures: tuple[Figure, ...] = ()
    runs: tuple[Run, ...] = ()
    conclusion: str = ""
    notes: tuple[str, ...] = ()
    players: tuple[Player, ...] = ()
    answer: str = ""

    __repr__ = in_a_line

    def __post_init__(self):
        require_distinct("figures", (figure.name for figure in self.pictures))
        require_distinct("players", (player.name for player in self.players))
        require_distinct("players' pictures", (player.picture.name for player in self.players))

    @property
    def pictures(self) -> tuple[Figure, ...]:
        """The figures, then the pictures of players that are not among them."""
        return self.figures + tuple(p.picture for p in self.players if p.picture not in self.figures)

    def player_of(self, picture: Figure) -> Player | None:
        """The player that moves a picture, None where it stands still."""
        return next((player for player in self.players if player.picture == picture), None)

    @property
    def certified(self) -> int:
        """How many of the runs are certified."""
        return sum(run.certified for run in self.runs)


def _silent(step: str) -> None:
    pass


@dataclass(frozen=True)
class StudyOptions:
    """How to run a study; full: the long form; data: a file of recorded poses; progress: told each step's name.

    >>> sm.report.StudyOptions(full=True).data is None
    True
    """

    full: bool = False
    data: Path | None = None
    progress: Callable[[str], None] = _silent

    __repr__ = in_a_line


@dataclass(frozen=True)
class Study:
    """One question and the function that answers it; they stand in increasing `order`, then by name.

    subject: what the report groups it under; alone: whether it times what it does, so that no other runs beside it;
    effort: about the seconds that its quick form takes; of those that run at the same time long ones begin.

    source: the paper's section, or "".

    >>> from symmotion.report import Study, StudyOptions, StudyResult
    >>> study = Study("mine", "Is it so?", "", lambda options: StudyResult(conclusion="It is."))
    >>> study.run(StudyOptions()).conclusion
    'It is.'
    """

    name: str
    question: str
    source: str
    run: Callable[[StudyOptions], StudyResult]
    order: int = 100
    subject: str = ""
    alone: bool = False
    effort: float = 2.0

    __repr__ = in_a_line


@dataclass(frozen=True)
class StudyRecord:
    """A study that was run: its result, or None and the error in one line; seconds: wall-clock.

    traceback: of an error that is a defect rather than bad input; subject: the study's.

    name, question, source: the study's.

    Raises InputError for a name that a file cannot have.

    >>> from symmotion.report import StudyRecord, StudyResult
    >>> StudyRecord("mine", "Is it so?", "", 0.1, StudyResult(conclusion="It is.")).status
    'ok'
    """

    name: str
    question: str
    source: str
    seconds: float
    result: StudyResult | None
    error: str = ""
    traceback: str = ""
    subject: str = ""

    __repr__ = in_a_line

    def __post_init__(self):
        # Without a hyphen, so that "study-figure" is one figure's file and ids only.
        if not re.fullmatch(r"[A-Za-z0-9_]+", self.name):
            raise InputError(f"study {self.name!r}: letters, digits and _ are needed in its name")

    @property
    def status(self) -> str:
        """ "ok", or "failed" where there is no result."""
        return "failed" if self.result is None else "ok"


def require_name(what: str, name: str) -> None:
    """Raise InputError where a name, which names a file too, has other characters than letters, digits, - and _."""
    if not re.fullmatch(r"[A-Za-z0-9_-]+", name):
        raise InputError(f"{what} {name!r}: letters, digits, - and _ are needed in its name, which names a file")


def require_distinct(what: str, names: Iterable[str]) -> None:
    """Raise InputError that lists names where one occurs twice."""
    names = list(names)
    if len(set(names)) < len(names):
        raise InputError(f"{what} of the same name: {', '.join(names)}")
