"""The runner of studies says what went wrong, in one line or in the report, and goes on."""

import importlib
import json
import subprocess
import sys
import time
from functools import partial
from pathlib import Path
from typing import Any

import pytest

import symmotion as sm
from studies.runner import running
from symmotion.report import Run, Study, StudyOptions, StudyResult

runner = importlib.import_module("studies.__main__")


def reported(directory: Path) -> list:
    return json.loads((directory / "report.json").read_text(encoding="utf-8"))["studies"]


def answer(options: StudyOptions) -> StudyResult:
    options.progress("drawing")
    runs = (Run("a", "newton", "", "solved", inertia="positive"), Run("a", "ipopt", "", "failed"))
    return StudyResult(runs=runs, conclusion="long" if options.full else "quick", notes=(str(options.data),))


def break_down(options: StudyOptions) -> StudyResult:
    raise ZeroDivisionError("[red]<b>\nsecond line")


def reject(options: StudyOptions) -> StudyResult:
    raise sm.InputError("poses.tum, line 3: 7 numbers are needed")


GOOD = Study("good", "Does it work?", "", answer, order=1)
BROKEN = Study("broken", "Does it break?", "", break_down, order=2)
REJECTING = Study("rejecting", "Is bad data refused?", "", reject)


@pytest.fixture
def studies(monkeypatch, tmp_path):
    """Sets the studies that there are, in an empty working directory."""
    monkeypatch.chdir(tmp_path)
    return lambda *found: monkeypatch.setattr(runner, "discover", lambda: list(found))


def test_runs_all_studies_into_the_default_place(studies, tmp_path, capfd):
    studies(GOOD)
    (tmp_path / "poses.tum").write_text("")
    assert runner.main(["--full", "--data", "poses.tum"]) == 0
    out, err = capfd.readouterr()
    assert f"report: {Path('report', 'index.html')}" in out and "1 of 2" in out and "good: ok" in err
    (study,) = reported(tmp_path / "report")
    assert (study["conclusion"], study["notes"]) == ("long", ["poses.tum"])


@pytest.mark.parametrize("jobs", ["1", "2"])
def test_a_study_that_breaks_does_not_stop_the_others(studies, tmp_path, capfd, jobs):
    studies(GOOD, BROKEN, REJECTING)
    assert runner.main(["--jobs", jobs, "-o", "out"]) == 1
    found = reported(tmp_path / "out")
    assert [(s["name"], s["status"]) for s in found] == [("good", "ok"), ("broken", "failed"), ("rejecting", "failed")]
    assert found[1]["error"] == "ZeroDivisionError: [red]<b> second line"
    err = capfd.readouterr().err
    assert err.count("Traceback") == 1 and "break_down" in err


def leave_a_trace(options: StudyOptions) -> StudyResult:
    assert options.data is not None
    time.sleep(0.2)
    (options.data / str(time.monotonic_ns())).touch()
    return StudyResult()


def test_an_interrupt_ends_the_studies_that_have_not_begun(monkeypatch, tmp_path, capfd):
    def interrupted(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr(running, "_collect", interrupted)
    chosen = [Study(f"study {k}", "", "", leave_a_trace) for k in range(12)]
    with pytest.raises(KeyboardInterrupt):
        running.run_all(chosen, StudyOptions(data=tmp_path), jobs=2)
    # Two may run, and three may wait in the pipe to the workers.
    assert len(list(tmp_path.iterdir())) <= 5


def tell_when(name: str, options: StudyOptions) -> StudyResult:
    assert options.data is not None
    began = time.monotonic_ns()
    time.sleep(0.1)
    (options.data / name).write_text(f"{began} {time.monotonic_ns()}")
    return StudyResult()


def test_a_study_that_times_things_runs_alone_and_long_ones_begin_first(tmp_path):
    def study(name: str, **more: Any) -> Study:
        return Study(name, "", "", partial(tell_when, name), **more)

    others = [study(f"other_{k}", effort=float(k)) for k in range(3)]
    chosen = [study("alone_0", alone=True), *others, study("alone_1", alone=True)]
    names = [[s.name for s in group] for group in running.in_turn(chosen)]
    assert names == [["other_2", "other_1", "other_0"], ["alone_0"], ["alone_1"]]
    records = running.run_all(chosen, StudyOptions(data=tmp_path), jobs=2)
    assert [r.name for r in records] == [s.name for s in chosen]
    times = {path.name: tuple(map(int, path.read_text().split())) for path in tmp_path.iterdir()}
    ended = max(times[s.name][1] for s in others)
    for name in ("alone_0", "alone_1"):
        assert times[name][0] >= ended
        ended = times[name][1]


def test_runs_the_named_studies_only(studies, tmp_path):
    studies(GOOD, BROKEN)
    assert runner.main(["good"]) == 0
    assert [s["name"] for s in reported(tmp_path / "report")] == ["good"]


def test_lists_studies_and_runs_none(studies, tmp_path, capsys):
    studies(GOOD, BROKEN)
    assert runner.main(["--list"]) == 0
    assert capsys.readouterr().out == "good    Does it work?\nbroken  Does it break?\n"
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["nothing"], "no study 'nothing'; there are broken"),
        (["--jobs", "0"], "--jobs 0"),
        (["--data", "missing.tum"], "missing.tum: there is no such file"),
        (["-o", "file/report"], "file/report: cannot write"),
    ],
)
def test_bad_input_is_told_in_one_line_before_anything_runs(studies, tmp_path, capsys, arguments, message):
    studies(BROKEN)
    (tmp_path / "file").write_text("")
    assert runner.main(arguments) == 2
    out, err = capsys.readouterr()
    assert not out and err.count("\n") == 1 and message in err
    assert [p.name for p in tmp_path.iterdir()] == ["file"]


@pytest.mark.parametrize("arguments", [["--jobs", "many"], ["--unknown"]])
def test_misspelt_arguments_are_told_in_one_line(arguments, capsys):
    with pytest.raises(SystemExit) as exit:
        runner.main(arguments)
    assert exit.value.code == 2 and capsys.readouterr().err.count("\n") == 1


def test_help_has_an_example(capsys):
    with pytest.raises(SystemExit) as exit:
        runner.main(["--help"])
    assert exit.value.code == 0 and "python -m studies solvers --full" in capsys.readouterr().out


def test_discovers_the_studies_in_their_order():
    found = runner.discover()
    assert [(s.order, s.name) for s in found] == sorted((s.order, s.name) for s in found)
    assert len({s.name for s in found}) == len(found)


def test_runs_as_a_program_in_two_processes(tmp_path):
    # As users start it: only then is the runner the main module, which workers do not import.
    names = [s.name for s in runner.discover()][:2]
    root = Path(str(runner.__file__)).parents[1]
    command = [sys.executable, "-m", "studies", *names, "--jobs", "2", "-o", str(tmp_path)]
    subprocess.run(command, cwd=root, capture_output=True, check=True)
    assert [(s["name"], s["status"]) for s in reported(tmp_path)] == [(name, "ok") for name in names]
