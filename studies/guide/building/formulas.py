"""Formulas beside the lines of code that they are; one whose line is gone fails the build."""

from pathlib import Path

ROOT = Path(__file__).parents[3]


def lines_of(path: str, text: str, count: int = 1) -> tuple[int, str]:
    """Where a file has the text, once, and as many lines from there; LookupError where it has not."""
    rows = (ROOT / path).read_text(encoding="utf-8").splitlines()
    found = [number for number, row in enumerate(rows) if text in row]
    if len(found) != 1:
        raise LookupError(f"{path} has {text!r} {len(found)} times, once is needed")
    chosen = rows[found[0] : found[0] + count]
    margin = min((len(row) - len(row.lstrip()) for row in chosen if row.strip()), default=0)
    return found[0] + 1, "\n".join(row[margin:] for row in chosen)
