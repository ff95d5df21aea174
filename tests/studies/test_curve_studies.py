"""The studies of motion curves in their quick form, with figures pinned."""

import pytest
from studied import table

from studies.curves import curve_constraints, motion_curves
from symmotion.report import StudyOptions


def test_gallery_of_motion_curves():
    result = motion_curves.STUDY.run(StudyOptions())
    assert len(result.figures) == 9
    rows = {r["curve"]: r for r in table(result, "the same keys, the same times")}
    costs = {name: r["∫ ‖x''‖²"] for name, r in rows.items()}
    assert min(costs, key=costs.__getitem__) == "natural"
    assert costs["natural"] == pytest.approx(13.2470, rel=1e-4)
    broken = [name for name, r in rows.items() if r["largest jump of x'"] > 0]
    assert broken == ["Kochanek–Bartels, continuity 0.5"]
    assert [name for name, r in rows.items() if r["of x''"] == 0] == ["natural", "not-a-knot"]
    assert max(r["largest difference, relative"] for r in table(result, "agreement")) < 1e-13


def test_curves_under_constraints():
    result = curve_constraints.STUDY.run(StudyOptions())
    assert all(r.status == "solved" for r in result.runs)
    runs = {(r.case, r.method): r for r in result.runs}
    assert runs["ball, physical times", "newton"].objective == pytest.approx(0, abs=1e-12)
    drawn = [runs["ball, times of the animator", m].objective for m in ("newton", "ipopt")]
    assert drawn == pytest.approx([18.3883868] * 2, rel=1e-8)
    for row in table(result, "what a multiplier predicts: the ball at the animator's times"):
        assert row["predicted change of ∫ h'''²"] == pytest.approx(row["change when solved again"], rel=0.01)
    limits = table(result, "camera: the price of a speed limit")[1:]
    assert all(r["−2 v Σ λ"] == pytest.approx(r["d f*/d v by differences"], rel=1e-4) for r in limits)
    costs = [r["∫ ‖x''‖²"] for r in limits]
    assert costs == sorted(costs)
    assert costs[-1] == pytest.approx(117.1153, rel=1e-5)
