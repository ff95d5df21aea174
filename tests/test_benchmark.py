"""The benchmark of `.ci`: it tells a ratio that changed from noise, and does not ask how fast the machine is."""

import json
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from types import ModuleType

import pytest


def loaded() -> ModuleType:
    spec = spec_from_file_location("benchmark", Path(__file__).parents[1] / ".ci" / "benchmark.py")
    assert spec is not None and spec.loader is not None
    module = module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


benchmark = loaded()


def nothing() -> None: ...


def clock(*durations: float):
    """A clock on which one piece of work after the other takes these seconds."""
    return iter([reading for seconds in durations for reading in (0.0, seconds)]).__next__


def test_a_ratio_that_doubles_fails_and_noise_does_not():
    stored = {"a": 0.25, "b": 3.0}
    assert benchmark.changes(stored, {"a": 0.45, "b": 1.6}) == []
    assert benchmark.changes(stored, {"a": 0.51, "b": 3.0}) == ["a: 0.51 instead of 0.25"]
    assert benchmark.changes(stored, {"a": 0.12, "b": 3.0}) == ["a: 0.12 instead of 0.25"]


def test_a_ratio_that_is_new_or_gone_fails():
    assert benchmark.changes({"a": 1.0}, {"b": 2.0}) == ["b: 2, and none is stored", "a: stored, but not measured"]
    assert benchmark.changes({"a": 1.0}, {"a": float("nan")}) == ["a: nan instead of 1"]


@pytest.mark.parametrize("speed", [1.0, 100.0])
def test_the_median_is_taken_and_the_machines_speed_does_not_matter(speed):
    case = benchmark.Case("a", lambda: (nothing, nothing), scale=10.0)
    pairs = [(4.0, 1.0), (900.0, 1.0), (6.0, 2.0)]
    measured = benchmark.ratio(case, 3, clock(*(seconds / speed for pair in pairs for seconds in pair)))
    assert measured == pytest.approx(0.4)


@pytest.mark.parametrize(("factor", "status"), [(1.5, 0), (2.1, 1), (0.4, 1)])
def test_the_command_fails_where_a_ratio_changes(factor, status, tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(benchmark, "STORED", tmp_path / "ratios.json")
    monkeypatch.setattr(benchmark, "CASES", (benchmark.Case("work", lambda: (nothing, nothing)),))
    monkeypatch.setattr(benchmark, "ratio", lambda case: 0.5 * factor)
    benchmark.STORED.write_text('{"work": 0.5}')
    assert benchmark.main([]) == status
    assert ("work: " in capsys.readouterr().out) == bool(status)
    assert benchmark.main(["--store"]) == 0
    assert json.loads(benchmark.STORED.read_text()) == {"work": pytest.approx(0.5 * factor)}
    assert benchmark.main([]) == 0


def test_every_case_has_a_stored_ratio():
    assert list(json.loads(benchmark.STORED.read_text())) == [case.name for case in benchmark.CASES]
