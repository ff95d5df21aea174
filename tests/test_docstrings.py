"""What the reference is made of: every public name says what it takes and refuses, and its example runs."""

import ast
import doctest
import inspect
import re
import sys
from collections.abc import Iterator
from enum import Enum
from functools import cache, cached_property

import numpy as np
import pytest

import symmotion as sm
from studies.guide.building.reference import Entry, entries
from studies.guide.building.signatures import definition

ENTRIES = [entry for entry in entries() if entry.kind != "data"]
ARRAY = re.compile(r"(<class ')?(numpy\.ndarray|casadi\.casadi\.SX|scipy\.sparse\S*csr_array)('>)?( \| None)?$")
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
def test_every_public_member_has_a_docstring(group):
    # The reference leaves out those that have none.
    assert [path for path, member in members_of(group) if not inspect.getdoc(member)] == []


@pytest.mark.parametrize("group", GROUPS)
def test_members_that_are_arrays_tell_their_shape(group):
    shape = re.compile(r"\((\w[^()]*,[^()]*|…|…,[^()]*)\)|in the shape of")
    untold = [path for path, m in members_of(group) if ARRAY.match(returned(m)) and not shape.search(brief(m))]
    assert untold == []


@pytest.mark.parametrize("group", GROUPS)
def test_who_refuses_input_says_so(group):
    silent = {
        entry.path: missing
        for entry in ENTRIES
        if entry.group == group
        and (missing := sorted(error for error in raised_by(entry) if error not in told_by(entry)))
    }
    assert silent == {}


@pytest.mark.parametrize("group", GROUPS)
def test_what_is_asked_with_is_told_by_name(group):
    untold = {
        entry.path: missing
        for entry in ENTRIES
        if entry.group == group
        and (missing := [name for name in parameters_of(entry) if not re.search(rf"\b{name}\b", text_of(entry))])
    }
    assert untold == {}


def members_of(group: str) -> Iterator[tuple[str, object]]:
    """The methods and properties of the group's classes, inherited ones too; fields are told of by their class."""
    for entry in ENTRIES:
        if entry.group == group and inspect.isclass(entry.thing):
            fields = {name for kind in entry.thing.__mro__ for name in inspect.get_annotations(kind)}
            for name, member in inspect.getmembers_static(entry.thing):
                found = inspect.isroutine(member) or isinstance(member, property | cached_property)
                if found and not name.startswith("_") and name not in fields:
                    # A method by its class, which finds what it inherits of its docstring.
                    yield f"{entry.path}.{name}", getattr(entry.thing, name)


def returned(member: object) -> str:
    """What the source says that a member returns."""
    made = getattr(member, "fget", None) or getattr(member, "func", None) or member
    return str(getattr(inspect.unwrap(made), "__annotations__", {}).get("return", ""))  # pyright: ignore[reportArgumentType]


def brief(member: object) -> str:
    return (inspect.getdoc(member) or "").split("\n\n")[0]


def parameters_of(entry: Entry) -> list[str]:
    # A protocol is not called, and what an enumeration is called with is Python's.
    if getattr(entry.thing, "_is_protocol", False) or (inspect.isclass(entry.thing) and issubclass(entry.thing, Enum)):
        return []
    found = inspect.signature(entry.thing).parameters  # pyright: ignore[reportArgumentType]
    return [name for name in found if not name.startswith("_")]


def told_by(entry: Entry) -> str:
    members = [m for name, m in inspect.getmembers(entry.thing) if not name.startswith("_")]
    return "\n".join([text_of(entry), *(inspect.getdoc(m) or "" for m in members if inspect.isclass(entry.thing))])


def raised_by(entry: Entry) -> set[str]:
    """The errors raised here, and those of ours raised by our functions that are handed a parameter as it came."""
    thing = inspect.unwrap(entry.thing)  # pyright: ignore[reportArgumentType]
    handed_on = handed(thing, {"self", "cls", *parameters_of(entry)})
    return raised_in(thing).union(*(raised_in(function) & {"InputError", "SolveError"} for function in handed_on))


@cache
def tree_of(thing: object) -> list[ast.AST]:
    return list(ast.walk(definition(thing) or ast.Module([], [])))


def raised_in(thing: object) -> set[str]:
    raised = [node.exc for node in tree_of(thing) if isinstance(node, ast.Raise)]
    return {ast.unparse(error.func).split(".")[-1] for error in raised if isinstance(error, ast.Call)}


def handed(thing: object, names: set[str]) -> Iterator[object]:
    """Functions of ours, by name or of a module, that the source calls with one of these names, and does not try."""
    known = vars(sys.modules[thing.__module__])
    tried = {id(n) for t in tree_of(thing) if isinstance(t, ast.Try) for s in t.body for n in ast.walk(s)}
    for node in tree_of(thing):
        if isinstance(node, ast.Call) and id(node) not in tried:
            given = [n.id for a in node.args for n in (a, getattr(a, "value", a)) if isinstance(n, ast.Name)]
            match node.func:
                case ast.Name(name):
                    found = known.get(name)
                case ast.Attribute(ast.Name(owner), name):
                    found = getattr(known.get(owner), name, None)
                case _:
                    found = None
            if inspect.isfunction(found) and found.__module__.startswith("symmotion") and names & {*given}:
                yield inspect.unwrap(found)
