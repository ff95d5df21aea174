"""What the reference is made of: every public name says what it takes and refuses, and its example runs."""

import doctest
import inspect

import numpy as np
import pytest

import symmotion as sm
from studies.guide.building.reference import Entry, entries

ENTRIES = [entry for entry in entries() if entry.kind != "data"]
GROUPS = sorted({entry.group for entry in ENTRIES})


def text_of(entry: Entry) -> str:
    return inspect.getdoc(entry.thing) or ""


@pytest.mark.parametrize("group", GROUPS)
def test_examples_run(group, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    finder = doctest.DocTestFinder(recurse=False)
    runner = doctest.DocTestRunner(optionflags=doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE, verbose=False)
    for entry in (e for e in ENTRIES if e.group == group):
        for test in finder.find(entry.thing, entry.path, module=False, globs={"np": np, "sm": sm}):
            runner.run(test)
    assert runner.summarize(verbose=False).failed == 0


@pytest.mark.parametrize("group", GROUPS)
def test_every_public_name_has_an_example(group):
    assert [e.path for e in ENTRIES if e.group == group and ">>>" not in text_of(e)] == []
