"""What notebooks show of motions, solutions, comparisons and fairing results: HTML with facts, tables and a picture.

Self-contained and without scripts; ink and ground are the notebook's. Nothing here raises, so
that a failed solve can be looked at.
"""

from collections.abc import Callable
from dataclasses import dataclass
from hashlib import sha256
from importlib import resources

import matplotlib
import numpy as np
from jinja2 import Environment, StrictUndefined, Template
from markupsafe import Markup
from matplotlib.axes import Axes
from numpy.typing import ArrayLike

from symmotion.brief import between
from symmotion.errors import InputError
from symmotion.fairing import FairingResult
from symmotion.motions import Keyframes, RigidSamples, TwoParameterMotion
from symmotion.motions.interpolants.slerps import SegmentCurve
from symmotion.motions.quaternions import ProductMotion
from symmotion.program import Program
from symmotion.solvers import Comparison, Solution
from symmotion.svg import as_element
from symmotion.tables import Cell, Column, Table, shown
from symmotion.views.canvas import FONT, HEIGHT, WIDTH, fit_height
from symmotion.views.plots import plot_comparison, plot_fairing, plot_solution, solver_names
from symmotion.views.solutions import Drawn, keyframe_multipliers
from symmotion.views.style import new_figure
from symmotion.views.svg import as_svg

MOST_PRICES = 5
MOST_TEXT = 2000  # letters of a message or name


@dataclass(frozen=True)
class Display:
    """What is shown: a headline, facts by name, tables, remarks, a picture, and texts that unfold."""

    kind: str
    headline: str = ""
    facts: tuple[tuple[str, Cell], ...] = ()
    tables: tuple[Table, ...] = ()
    notes: tuple[str, ...] = ()
    picture: Markup | str = ""
    more: tuple[tuple[str, str], ...] = ()

    def html(self) -> str:
        return _template().render(vars(self))


def html_of(thing: Drawn) -> str:
    """A motion, solution, comparison or fairing result, as HTML."""
    match thing:
        case Solution():
            return solution_html(thing)
        case Comparison():
            return comparison_html(thing)
        case FairingResult():
            return fairing_html(thing)
    return motion_html(thing)


def motion_html(motion: Drawn) -> str:
    """A motion, as HTML: what it is, and its own picture."""
    picture, notes = _picture(motion.plot)
    return Display(type(motion).__name__, "", tuple(_motion_facts(motion)), (), notes, picture).html()


def solution_html(solution: Solution) -> str:
    """A solution, as HTML: certificate, terms, the most expensive keyframes, its picture, the program."""
    c = solution.certificate
    facts: list[tuple[str, Cell]] = [
        ("objective", shown(c.objective, 9)),
        ("decrement", shown(c.decrement, 3)),
        ("stationarity", shown(c.stationarity, 3)),
        ("violation", shown(c.violation, 3)),
        ("inertia", c.inertia),
        ("iterations", solution.iterations if solution.log else None),
        ("seconds", shown(solution.seconds.total or None, 3)),
        ("solver", _short(solution.solver)),
    ]
    tables = []
    if np.isfinite(solution.x).all():
        terms = solution.terms
        if len(terms) > 1:
            tables.append(Table("Terms of the objective", (Column("term"), Column("value")), tuple(terms.items())))
        if np.isfinite(solution.multiplier_vector).all():
            tables += _prices(solution)
    picture, notes = _picture(lambda axes: plot_solution(solution, axes))
    message = (_short(solution.message),) if solution.message else ()
    return Display(
        "Solution",
        f"{solution.method}: {solution.status}",
        tuple(facts),
        tuple(tables),
        message + notes,
        picture,
        (_program_text(solution.program),),
    ).html()


def comparison_html(comparison: Comparison) -> str:
    """A comparison, as HTML: the solvers side by side, and stationarity over their iterations."""
    columns = ("solver", "status", "objective", "stationarity", "violation", "inertia", "iterations")
    rows = []
    for s in comparison.found:
        agreement = comparison.agreement(s)
        own = (s.method, s.ended, s.objective, s.stationarity, s.violation, s.inertia)
        steps = s.iterations if s.log else None
        rows.append((*own, steps, s.seconds.total or None, *((None, None) if agreement is None else agreement)))
    table = Table(
        "Solvers",
        (*map(Column, columns), Column("time", "s"), Column("Δ minimiser"), Column("Δ multipliers")),
        tuple(tuple(float(f"{c:.3g}") if isinstance(c, float) and k > 2 else c for k, c in enumerate(r)) for r in rows),
        "Δ: largest difference from the best one, relative to its largest entry.",
    )
    messages = tuple(
        f"{name}: {_short(s.message)}"
        for name, s in zip(solver_names(comparison.found), comparison.found, strict=True)
        if s.message
    )
    picture, notes = _picture(lambda axes: plot_comparison(comparison, axes))
    return Display(
        "Comparison", comparison.verdict, (), (table,), messages + notes, picture, (_program_text(comparison.program),)
    ).html()


def fairing_html(result: FairingResult) -> str:
    """A fairing result, as HTML: how much fairer, how far the controls went, and G over the steps."""
    facts: list[tuple[str, Cell]] = [
        ("G of the start", result.initial),
        ("G of the result", result.final),
        ("steps", f"{result.steps}, the best after {result.best_step}"),
        ("largest displacement", float(result.displacement.max(initial=0.0))),
        ("seconds", shown(result.seconds, 3)),
    ]
    if result.certificate is not None:
        facts.append(("stationarity", result.certificate.stationarity))
    picture, notes = _picture(lambda axes: plot_fairing(result, axes))
    message = (_short(result.message),) if result.message else ()
    headline = f"{result.method}: {result.status}"
    return Display("FairingResult", headline, tuple(facts), (), message + notes, picture).html()


def _motion_facts(motion: object) -> list[tuple[str, Cell]]:
    facts: list[tuple[str, Cell]] = []
    name = getattr(motion, "name", "")
    if name:
        facts.append(("interpolant", str(name)))
    dimension = getattr(motion, "dimension", None)
    if dimension is not None:
        facts.append(("dimension", dimension))
    bases = getattr(motion, "bases", None) or tuple(b for b in (getattr(motion, "basis", None),) if b is not None)
    if bases:
        facts.append(("degree", " × ".join(str(b.degree) for b in bases)))
        facts.append(("controls", " × ".join(str(b.n) for b in bases)))
    if isinstance(motion, TwoParameterMotion):
        facts += [(letter, _interval(ends)) for letter, ends in zip("uv", motion.domain, strict=True)]
    elif (ends := getattr(motion, "domain", None)) is not None:
        facts.append(("times", _interval(ends)))
    if isinstance(motion, ProductMotion):
        facts += [("degree", motion.functions.basis.degree), ("factors", motion.functions.n)]
    if isinstance(motion, SegmentCurve):
        facts.append(("segments", len(motion.times) - 1))
    if isinstance(motion, Keyframes | RigidSamples):
        facts += [("positions", len(motion.times)), ("times", _interval(motion.times[[0, -1]]))]
    if isinstance(motion, RigidSamples):
        facts.append(("largest deviation", motion.deviation))
    return facts


def _interval(ends: ArrayLike) -> str:
    return between(*np.asarray(ends, dtype=float))


def _prices(solution: Solution) -> list[Table]:
    """The most expensive keyframes by every part of their multipliers."""
    sizes = keyframe_multipliers(solution)
    if not sizes:
        return []
    columns = np.stack(list(sizes.values()), axis=1)
    # The parts have units of their own: each counts relative to its largest.
    largest = columns.max(axis=0)
    order = np.argsort(-(columns / np.where(largest > 0, largest, 1.0)).max(axis=1), kind="stable")[:MOST_PRICES]
    many = len(columns) > MOST_PRICES
    return [
        Table(
            "Multipliers of the keyframes",
            (Column("keyframe"), *(Column(f"‖λ‖, {name}") for name in sizes)),
            tuple((int(i), *(float(f"{v:.4g}") for v in columns[i])) for i in order),
            f"The {MOST_PRICES} largest of {len(columns)}." if many else "",
        )
    ]


def _program_text(program: Program) -> tuple[str, str]:
    return f"Program: {program.unknowns} unknowns, {program.conditions} conditions", _short(str(program))


def _picture(draw: Callable[[Axes], object]) -> tuple[Markup | str, tuple[str, ...]]:
    """A picture as SVG, or none and the reason."""
    try:
        with new_figure(WIDTH, HEIGHT) as figure:
            matplotlib.rcParams.update(FONT)
            axes = figure.add_subplot()
            draw(axes)
            fit_height(axes)
            drawn = as_svg(figure, "picture")
    except InputError as error:
        return "", (f"No picture: {error}",)
    except Exception as error:
        # A display that raises would hide the object that has to be looked at.
        return "", (f"No picture ({type(error).__name__}: {error})",)
    # Ids that differ from those of other outputs in the same notebook.
    svg = str(as_element(drawn, "Picture", "sm" + sha256(drawn.encode()).hexdigest()[:10]))
    return Markup(svg.replace("<svg ", '<svg style="max-width:100%;height:auto" ', 1)), ()


def _short(text: str) -> str:
    return text if len(text) <= MOST_TEXT else text[:MOST_TEXT] + " …"


def _template() -> Template:
    environment = Environment(autoescape=True, trim_blocks=True, lstrip_blocks=True, undefined=StrictUndefined)
    environment.filters["shown"] = shown
    source = resources.files("symmotion.views").joinpath("display.html.jinja").read_text(encoding="utf-8")
    return environment.from_string(source)
