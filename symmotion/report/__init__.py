"""Reports: studies' tables, figures and runs as a page and as JSON. Who draws imports `figures` and `players`."""

from symmotion.report.page import require_writable, write_report
from symmotion.report.values import (
    Body,
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

__all__ = [
    "Body",
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
    "require_writable",
    "write_report",
]
