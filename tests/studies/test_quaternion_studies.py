"""The quaternion studies in their quick form, each with a figure pinned."""

from pathlib import Path

import numpy as np
import pytest
from studied import certified, table

from studies.quaternions import (
    boomerang,
    keyframe_body,
    quaternion_constructions,
    quaternion_curves,
    quaternion_speed,
    torque,
)
from studies.recorded import plates
from studies.sweeps import sweep
from symmotion.report import StudyOptions


def test_quaternion_curves():
    result = quaternion_curves.STUDY.run(StudyOptions())
    rows = {(r["end rates, factor"], r["extra turns"]): r for r in table(result, "Hermite curves")}
    assert max(r["largest error at the ends"] for r in rows.values()) < 1e-12
    assert rows[1.0, 0]["angle travelled"] == pytest.approx(140.943292876, rel=1e-8)
    jumps = {r["quantity"]: r for r in table(result, "continuity")}
    assert jumps["acceleration"]["largest jump at a knot"] < 1e-6 < jumps["jerk"]["largest jump at a knot"]
    assert len(result.figures) == 3


def test_quaternion_constructions():
    result = quaternion_constructions.STUDY.run(StudyOptions())
    jumps = {(r["neighbours apart"], r["curve"]): r for r in table(result, "continuity")}
    assert all(r["jump of the rate"] == "0" for r in jumps.values())
    assert all((r["jump of the acceleration"] == "0") == (key[1] == "cumulative B-spline") for key, r in jumps.items())
    # Two slerps that meet at an angle miss what one of them would do by a term of second order.
    assert "to the power of 2.01" in (result.conclusion or "")
    speeds = {
        (r["neighbours apart"], r["curve"]): float(r["fastest over slowest"].split()[0]) for r in table(result, "speed")
    }
    assert speeds[150, "rational spline"] > 2 * speeds[150, "C² cumulative"]
    turns = {r["curve"]: r for r in table(result, "uneven times")}
    for name in ("monotone, C¹", "slerp"):
        assert turns[name]["no whole turn more"] == turns[name]["found"] == 4
    assert turns["C² cumulative, Newton"]["no whole turn more"] < 2
    assert turns["slerp"]["travelled over asked"] == "1"
    assert [figure.name for figure in result.figures] == ["slerps", "accelerations", "speeds", "travels"]


def test_torque():
    result = torque.STUDY.run(StudyOptions())
    ratios = {r["between control quaternions"]: r for r in table(result, "cumulative against recursive")}
    assert ratios[10]["ratio, median"] == pytest.approx(1.0, abs=0.05)  # the claim of KKS 6.1, small angles
    assert ratios[150]["ours less"] == 0
    assert ratios[330]["ratio, median"] < 0.9
    optima = [r for r in table(result, "optima by knots") if r["inertia"] == "asymmetric"]
    values = [r["∫‖τ‖² at the optimum"] for r in optima]
    assert all(np.diff(values) < 0)
    assert values[-1] == pytest.approx(73.32229175, rel=1e-7)
    assert all(r.certified or r.case == "rate bounded" for r in result.runs)
    assert all(r.status == "solved" for r in result.runs)
    assert [r["certified"] for r in table(result, "far turns at uneven times")][:2] == [100, 100]


def test_boomerang_and_sweep():
    flights = table(boomerang.STUDY.run(StudyOptions()), "flights")
    assert max(r["error of the end rates"] for r in flights) < 1e-10
    assert flights[-1]["turns in all"] > 30
    swept = table(sweep.STUDY.run(StudyOptions()), "continuity of the swept surface")
    assert max(r["largest jump at a knot"] for r in swept) < 1e-6


def test_keyframe_body():
    result = keyframe_body.STUDY.run(StudyOptions())
    assert len(result.runs) == 6
    assert all(r.certified for r in result.runs)
    rows = table(result, "torque and bending")
    assert rows[2]["∫‖τ‖²"] < rows[0]["∫‖τ‖²"]
    assert rows[2]["∫‖τ‖²"] + rows[2]["E"] == pytest.approx(128.9593, rel=1e-4)


def test_plates_on_example_data(monkeypatch):
    monkeypatch.setattr(plates, "ROTATIONS", Path("nowhere"))
    result = plates.STUDY.run(StudyOptions())
    assert "example data made by the project" in result.notes[0]
    rows = {r["history"]: r for r in table(result, "histories")}
    assert rows["within 2°"]["∫‖Ω̇‖²"] < rows["within 0.5°"]["∫‖Ω̇‖²"] < rows["least ∫‖Ω̇‖²"]["∫‖Ω̇‖²"]
    assert all(r.status == "solved" for r in result.runs)


@pytest.mark.skipif(not plates.ROTATIONS.is_file(), reason=f"{plates.ROTATIONS} is not there")
def test_plates_on_the_rotations():
    result = plates.STUDY.run(StudyOptions())
    rows = {r["history"]: r for r in table(result, "histories")}
    assert rows["least ∫‖Ω̇‖²"]["∫‖Ω̇‖²"] == pytest.approx(2.8707e-4, rel=1e-4)
    assert result.runs[0].certified


def test_quaternion_speed(monkeypatch):
    monkeypatch.setattr(quaternion_speed, "ORIENTATIONS", 1000)
    monkeypatch.setattr(quaternion_speed, "KEYS", 50)
    monkeypatch.setattr(quaternion_speed, "PROGRAMS", (10, 20))
    result = quaternion_speed.STUDY.run(StudyOptions())
    assert certified(result)
    names = [r["curve"] for r in table(result, "evaluation")]
    assert names[:3] == ["symmotion, C² quaternion spline", "symmotion, degree 5", "SciPy RotationSpline"]
    assert [r["unknowns"] for r in table(result, "programs")] == [147, 147, 287]
