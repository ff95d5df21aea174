import pytest
from studied import certified, table

from studies.solving import global_minima, minima
from symmotion.report import StudyOptions


def test_minima_study():
    result = minima.STUDY.run(StudyOptions())
    found = table(result, "minima")
    assert found[0]["R"] == pytest.approx(min(r["R"] for r in found)) and len(found) > 3
    assert sum(r["starts"] for r in found) <= minima.BUDGET
    reached = table(result, "best known")
    assert reached[-1]["problems"] >= reached[0]["problems"] and certified(result)
    assert [f.name for f in result.figures] == ["motions", "budget"]


def test_global_study():
    pytest.importorskip("clarabel", reason="the extra symmotion[global] is not installed")
    result = global_minima.STUDY.run(StudyOptions())
    rows = {r["keyframes"]: r for r in table(result, "bounds")}
    assert all(r["bound is"] == "proved" and 0 <= r["relative gap"] <= 1e-6 for r in rows.values())
    hidden = next(r for name, r in rows.items() if name.endswith(f"seed {global_minima.HIDDEN}"))
    assert hidden["own start"] == pytest.approx(25.2625, abs=1e-4)
    assert hidden["lowest known"] == pytest.approx(23.28335, abs=1e-5)
    assert {r["rank"] for name, r in rows.items() if "half turn" in name} == {2}
    assert certified(result)


def test_global_study_without_its_solver(monkeypatch):
    monkeypatch.setattr(global_minima, "find_spec", lambda name: None)
    result = global_minima.STUDY.run(StudyOptions())
    assert "symmotion[global]" in result.notes[0] and not result.tables
