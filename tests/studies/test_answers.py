"""Every study answers its question in one sentence, of what it measured."""

import ast
import importlib
from pathlib import Path

import numpy as np
import pytest
from studied import is_answer

import studies
from studies.shares import interval, share, spread

ROOT = Path(str(studies.__file__)).parent
runner = importlib.import_module("studies.__main__")


def made(path: Path) -> list[ast.Call]:
    """The results that the functions of a file make."""
    calls = [n for n in ast.walk(ast.parse(path.read_text(encoding="utf-8"))) if isinstance(n, ast.Call)]
    return [call for call in calls if isinstance(call.func, ast.Name) and call.func.id == "StudyResult"]


RESULTS = {path.relative_to(ROOT).as_posix(): found for path in sorted(ROOT.rglob("*.py")) if (found := made(path))}


@pytest.mark.parametrize("file", RESULTS)
def test_every_result_has_an_answer_that_is_computed(file):
    for call in RESULTS[file]:
        given = {k.arg: k.value for k in call.keywords}
        # players come before it, where it is given by position
        answer = given.get("answer", call.args[6] if len(call.args) > 6 else None)
        assert answer is not None and not isinstance(answer, ast.Constant), f"{file}: an answer is needed"


def test_every_study_makes_its_result_in_a_file_that_was_looked_at():
    for study in runner.discover():
        module = importlib.import_module(study.run.__module__)
        own = Path(str(module.__file__))
        taken = {getattr(value, "__module__", "") for value in vars(module).values()}
        files = [own, *(ROOT.parent / f"{m.replace('.', '/')}.py" for m in taken if m.startswith("studies."))]
        assert any(f.relative_to(ROOT).as_posix() in RESULTS for f in files), study.name


def test_every_study_has_a_subject_that_the_report_knows():
    assert {study.subject for study in runner.discover()} == set(studies.SUBJECTS)


@pytest.mark.parametrize(
    "text",
    [
        "",
        " ",
        "No full stop: 1",
        "R is 2.\nS is 3.",
        "R falls to nan.",
        "R falls to 3. It is low.",
        "It falls.",
        "1" * 200 + ".",
    ],
)
def test_what_is_no_answer(text):
    assert not is_answer(text)


def test_what_is_one():
    assert is_answer("With R = 2.5 (1.3–3.4) the body is rigid to 1e-9.")


@pytest.mark.parametrize(("found", "of"), [(0, 7), (6, 8), (40, 40)])
def test_shares_tell_the_interval_of_wilson(found, of):
    low, high = (x / 100 for x in interval(found, of))
    # The ends of the interval are the shares from which what was found is 1.96 standard deviations away.
    for p in (low, high):
        assert (found / of - p) ** 2 == pytest.approx(1.959964**2 * p * (1 - p) / of, abs=1e-6)
    assert share(found, of) == f"{found} of {of} ({100 * low:.0f}–{100 * high:.0f} %)"


def test_spreads_tell_all():
    assert spread(np.array([3.0, 1.0, 2.0])) == "2 (1–3)" and spread([4.0]) == "4"
