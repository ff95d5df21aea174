"""The studies of sweeps in their quick form, with figures pinned."""

import pytest
from studied import table

from studies.sweeps import sweep_surfaces, swept_volumes
from symmotion.report import StudyOptions


def test_sweep_surfaces():
    result = sweep_surfaces.STUDY.run(StudyOptions())
    assert {f.name for f in result.figures} == {"band", "vase-and-flower"}
    rows = {(r["surface"], r["motion"]): r for r in table(result, "motions")}
    assert rows["flower", "optimum"]["R* + E / 100"] == pytest.approx(1197.046789, rel=1e-8)
    for name in ("band", "vase", "flower"):
        assert rows[name, "optimum"]["R*"] < 0.9 * rows[name, "interpolating spline"]["R*"]
    assert max(r["largest |S − (v + A C)|"] for r in table(result, "control nets")) < 1e-13
    assert all(r.certified for r in result.runs if r.method == "newton")


def test_swept_volumes():
    result = swept_volumes.STUDY.run(StudyOptions())
    assert {f.name for f in result.figures} == {"swept-volumes", "characteristic-curves"}
    finest = [r for r in table(result, "closed forms") if r["divisions"] == 28]
    assert max(abs(r["error of the volume, relative"]) for r in finest) < 1e-3
    assert min(r["order"] for r in finest) > 1.8
    overlap = {r["sweep"]: r for r in table(result, "overlap")}
    assert overlap["ellipsoid"]["volume of the envelope"] == pytest.approx(26.5, rel=2e-3)
    assert overlap["letter S"]["overlap"] == 0
    assert overlap["loop"]["overlap"] > 10 * overlap["loop"]["standard error"]
    assert max(abs(r["difference, relative"]) for r in overlap.values()) < 0.02
    loops = {r["sweep"]: r for r in table(result, "characteristic curves")}
    assert all(r["boundary edges"] == 0 for r in loops.values())
    assert loops["breathing ball"]["no curve"] == 24
    assert loops["kneaded ball"]["two loops"] == 41
    assert all(r.certified for r in result.runs if r.method == "newton")
