"""What tests read from the results of studies."""

from typing import Any


# A cell is a number, a word or nothing: its reader knows which.
def table(result, name) -> list[dict[str, Any]]:
    found = next(t for t in result.tables if t.name == name)
    return [dict(zip([c.name for c in found.columns], row, strict=True)) for row in found.rows]


def certified(result, methods=("newton", "ipopt")):
    mine = [r for r in result.runs if r.method in methods]
    return bool(mine) and all(r.certified and r.stationarity <= 1e-6 for r in mine)
