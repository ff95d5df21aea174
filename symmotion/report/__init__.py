"""Reports: studies' tables, figures, players and runs as a page and as JSON; Matplotlib is loaded by who draws.

A study of your own is a function that returns a `StudyResult`. A figure is drawn on one of
`symmotion.views.new_figure`, in black where it should follow the page's ink; a player moves a body:

    import symmotion as sm
    from symmotion.report import Study, StudyOptions, StudyRecord, StudyResult, player, to_figure, write_report
    from symmotion.views import new_figure

    def run(options):
        keys = sm.examples.planar_keyframes()
        motion = sm.interpolants.component_cubic(keys)
        with new_figure(7.0, 3.0) as figure:
            motion.plot(figure.add_subplot(), keyframes=keys)
            drawn = to_figure(figure, "motion", "The interpolating spline.")
        moving = player("player", {"spline": motion}, None, "A letter under the spline.", keys)
        return StudyResult(figures=(drawn,), players=(moving,), conclusion="It passes through the keyframes.")

    study = Study("mine", "Where does the spline go?", "", run)
    record = StudyRecord(study.name, study.question, study.source, 0.0, study.run(StudyOptions()))
    write_report([record], "report")
"""

from typing import TYPE_CHECKING

from symmotion.renamed import moved
from symmotion.report.carrying import Travelling
from symmotion.report.page import inline, player_elements, require_writable, write_report
from symmotion.report.values import (
    Figure,
    Player,
    Run,
    Study,
    StudyOptions,
    StudyRecord,
    StudyResult,
    Track,
)
from symmotion.tables import Cell, Column, Table

if TYPE_CHECKING:
    from symmotion.report.figures import convergence_figure, to_figure
    from symmotion.report.players import player


def __getattr__(name: str) -> object:
    # Matplotlib takes long to import, and who reads or writes values needs none of it.
    if name in __all__:
        from symmotion.report import figures, players

        return getattr(figures if hasattr(figures, name) else players, name)
    return moved(__name__, {"bodies": "Body"})(name)


__all__ = [
    "Cell",
    "Column",
    "Figure",
    "Player",
    "Run",
    "Study",
    "StudyOptions",
    "StudyRecord",
    "StudyResult",
    "Table",
    "Track",
    "Travelling",
    "convergence_figure",
    "inline",
    "player",
    "player_elements",
    "require_writable",
    "to_figure",
    "write_report",
]
