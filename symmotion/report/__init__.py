"""Reports: studies' tables, figures and runs as a page and as JSON. `figures` is imported by who draws."""

from symmotion.report.page import require_writable, write_report
from symmotion.report.values import Column, Figure, Run, Study, StudyOptions, StudyRecord, StudyResult, Table

__all__ = [
    "Column",
    "Figure",
    "Run",
    "Study",
    "StudyOptions",
    "StudyRecord",
    "StudyResult",
    "Table",
    "require_writable",
    "write_report",
]
