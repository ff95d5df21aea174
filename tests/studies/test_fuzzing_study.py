from pathlib import Path
from typing import Any

import numpy as np

import symmotion as sm
from studies.solving import fuzzing
from symmotion.report import StudyOptions


def test_damaged_files_of_every_format_are_refused_or_read():
    result = fuzzing.STUDY.run(StudyOptions())
    (table,) = result.tables
    assert [row[0] for row in table.rows] == list(fuzzing.READERS)
    rows: Any = table.rows
    for _, files, refused, read, faults in rows:
        assert (files, faults) == (60, 0) and refused + read == 60 and refused > 30
    assert result.notes == ()


def test_what_is_not_taken_well_is_told(tmp_path, monkeypatch):
    def fall(path: Path) -> object:
        raise KeyError("entry")

    def shout(path: Path) -> object:
        raise sm.InputError("no file is named here")

    unfinished = sm.examples.planar_keyframes()
    readers = {"falls": fall, "shouts": shout, "reads": lambda path: unfinished}
    monkeypatch.setattr(fuzzing, "READERS", readers)
    found = [fuzzing.outcome(kind, b"", tmp_path / "damaged.csv") for kind in readers]
    assert found == ["KeyError: 'entry'", "a message as 'no file is named here'", "read"]


def test_damage_is_seeded():
    first, second = (fuzzing.damaged(np.random.default_rng(3), b"0 1 2 3") for _ in range(2))
    assert first == second
