"""What the reference is made of: every public name says what it takes and refuses, and its example runs."""

import doctest
import inspect
import re

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
    found = runner.summarize(verbose=False)
    assert found.failed == 0 and found.attempted >= 2


@pytest.mark.parametrize("group", GROUPS)
def test_every_public_name_has_an_example(group):
    assert [e.path for e in ENTRIES if e.group == group and ">>>" not in text_of(e)] == []


@pytest.mark.parametrize("group", GROUPS)
def test_who_refuses_input_says_so(group):
    silent = [
        entry.path
        for entry in ENTRIES
        if entry.group == group
        and "raise InputError" in inspect.getsource(inspect.unwrap(entry.thing))  # pyright: ignore[reportArgumentType]
        and "InputError" not in text_of(entry)
    ]
    assert silent == []


@pytest.mark.parametrize(
    "group", [group for group in GROUPS if group in ("design", "constraints", "curves", "energies")]
)
def test_what_is_asked_with_is_told_by_name(group):
    """Parameters of the functions that a program is asked for with, and of conditions and energies."""
    untold = {
        entry.path: missing
        for entry in ENTRIES
        if entry.group == group and not getattr(entry.thing, "_is_protocol", False)
        if (missing := [name for name in parameters_of(entry) if not re.search(rf"\b{name}\b", text_of(entry))])
    }
    assert untold == {}


def parameters_of(entry: Entry) -> list[str]:
    return list(inspect.signature(entry.thing).parameters)  # pyright: ignore[reportArgumentType]
