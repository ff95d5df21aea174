"""Reports: studies' tables, figures and runs as a page and as JSON; Matplotlib is loaded by who draws."""

from typing import TYPE_CHECKING

from symmotion.report.page import require_writable, write_report
from symmotion.report.values import (
    Body,
    Cell,
    Column,
    Figure,
    Player,
    Run,
    Study,
    StudyOptions,
    StudyRecord,
    StudyResult,
    Table,
    Track,
)

if TYPE_CHECKING:
    from symmotion.report.figures import convergence_figure, to_figure
    from symmotion.report.players import Shape, Travelling, player, turning, wedge


def __getattr__(name: str):
    # Matplotlib takes long to import, and who reads or writes values needs none of it.
    if name in __all__:
        from symmotion.report import figures, players

        return getattr(figures if hasattr(figures, name) else players, name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


__all__ = [
    "Body",
    "Cell",
    "Column",
    "Figure",
    "Player",
    "Run",
    "Shape",
    "Study",
    "StudyOptions",
    "StudyRecord",
    "StudyResult",
    "Table",
    "Track",
    "Travelling",
    "convergence_figure",
    "player",
    "require_writable",
    "to_figure",
    "turning",
    "wedge",
    "write_report",
]
