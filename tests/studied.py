"""What tests read from the results of studies."""

import re
from typing import Any


# A cell is a number, a word or nothing: its reader knows which.
def table(result, name) -> list[dict[str, Any]]:
    found = next(t for t in result.tables if t.name == name)
    return [dict(zip([c.name for c in found.columns], row, strict=True)) for row in found.rows]


def certified(result, methods=("newton", "ipopt")):
    mine = [r for r in result.runs if r.method in methods]
    return bool(mine) and all(r.certified and r.stationarity <= 1e-6 for r in mine)


def is_answer(text: str) -> bool:
    """Whether a text is one sentence of at most 200 characters that tells a figure."""
    plain = re.fullmatch(r"[^\n]*\d[^\n]*\.", text) and not re.search(r"\.\s|\bnan\b|\binf\b|\bNone\b", text)
    return bool(plain) and len(text) <= 200
