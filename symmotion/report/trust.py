"""How far a study can be trusted, and a report as a whole: read off its runs, in sentences."""

from collections import Counter
from collections.abc import Sequence

from symmotion.report.values import Run, StudyRecord
from symmotion.tables import shown

# Two certified minima of a case are the same where their objectives differ by less, relative.
SAME = 1e-6


def tally(records: Sequence[StudyRecord]) -> str:
    """One line on all studies: how many are ok, how many of their runs are certified, how long they took."""
    ok = sum(record.status == "ok" for record in records)
    runs = [run for record in records if record.result for run in record.result.runs]
    parts = [f"{ok} of {len(records)} ok"]
    if runs:
        parts.append(f"{sum(run.certified for run in runs)} of {len(runs)} runs certified")
    parts.append(f"{sum(record.seconds for record in records):.0f} s in all")
    return ", ".join(parts) + "."


def trust(record: StudyRecord) -> list[str]:
    """What the runs of a study say about it, and its notes, a sentence or two each."""
    result = record.result
    if result is None:
        return []
    return [*_runs(result.runs), *(f"Note: {note}" for note in result.notes)]


def _runs(runs: Sequence[Run]) -> list[str]:
    if not runs:
        return ["Nothing here rests on a solver: the figures are measured directly."]
    good = [run for run in runs if run.certified]
    said = [f"{len(good)} of {len(runs)} runs are certified: strict local minima by a check of our own"]
    if good:
        worst = max(run.stationarity or 0.0 for run in good), max(run.violation or 0.0 for run in good)
        said[0] += f", stationarity up to {shown(worst[0], 2)}, violation up to {shown(worst[1], 2)}"
    bad = [run for run in runs if not run.certified]
    if bad:
        kinds = Counter(run.ended for run in bad).most_common()
        who = {kind: Counter(run.method for run in bad if run.ended == kind) for kind, _ in kinds}
        listed = (f"{kind} {', '.join(f'{method} {n}' for method, n in who[kind].most_common())}" for kind, _ in kinds)
        said.append(f"How the others ended: {'; '.join(listed)}")
    said += _minima(good)
    return [f"{sentence}." for sentence in said]


def _minima(certified: Sequence[Run]) -> list[str]:
    """Where certified runs of one case ended at different minima, by how much."""
    cases: dict[str, list[float]] = {}
    for run in certified:
        if run.objective is not None:
            cases.setdefault(run.case, []).append(run.objective)
    several = {case: values for case, values in cases.items() if len(values) > 1}
    if not several:
        return []
    spread = {case: (max(v) - min(v)) / (abs(min(v)) or 1.0) for case, v in several.items()}
    apart = [case for case, gap in spread.items() if gap > SAME]
    if not apart:
        return [f"Certified runs of one case agree on its minimum, in {len(several)} of {len(several)} cases"]
    worst = max(apart, key=lambda case: spread[case])
    gap = spread[worst]
    by = f"{shown(100 * gap, 2)} %" if gap < 1 else f"a factor of {shown(1 + gap, 3)}"
    return [
        f"In {len(apart)} of {len(several)} cases certified runs ended at different local minima, the higher above the "
        f"lower by up to {by} ({worst})"
    ]
