"""Imports run downward only: no circles among files, rooms in their order, and one place that looks up."""

import ast
from collections.abc import Iterator
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

import symmotion

ROOT = Path(str(symmotion.__file__)).parent
FILES = sorted(ROOT.rglob("*.py"))

# From the ground up: a folder, or a file beside the folders. A room may take from those before it.
ROOMS = (
    *(
        "errors",
        "version",
        "renamed",
        "values",
        "brief",
        "checks",
        "whole",
        "opening",
        "documents",
        "forking",
        "interrupts",
        "saving",
        "tables",
        "svg",
        "pictures",
    ),
    *("splines", "curves", "kernels", "program", "systems", "motions", "jets", "energies", "constraints", "solvers"),
    *(
        "batches",
        "design",
        "answers",
        "loading",
        "bodies",
        "fairing",
        "sweeps",
        "files",
        "smoothing",
        "views",
        "report",
        "commands",
    ),
    *("__init__", "__main__"),
)
SEAM = "pictures"


def module_of(path: Path) -> str:
    parts = path.relative_to(ROOT).with_suffix("").parts
    return ".".join(("symmotion", *(parts[:-1] if parts[-1] == "__init__" else parts)))


MODULES = {module_of(path): path for path in FILES}


def imported(path: Path) -> Iterator[str]:
    """The modules of symmotion that a file takes from, at any depth of it and for types too."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names if alias.name in MODULES)
        elif isinstance(node, ast.ImportFrom):
            assert not node.level, f"{path}: absolute imports are needed"
            for alias in node.names:
                whole = f"{node.module}.{alias.name}"
                yield from (m for m in (whole if whole in MODULES else node.module,) if m in MODULES)


TAKEN = {module: sorted(set(imported(path))) for module, path in MODULES.items()}


def room_of(module: str) -> str:
    return module.split(".")[1] if "." in module else "__init__"


def test_every_room_has_its_place():
    assert {room_of(module) for module in MODULES} <= set(ROOMS)


@pytest.mark.parametrize("room", [room for room in ROOMS if room != SEAM])
def test_a_room_takes_from_those_below_it(room):
    upward = [
        f"{module} takes from {other}"
        for module, others in TAKEN.items()
        for other in others
        if room_of(module) == room and ROOMS.index(room_of(other)) > ROOMS.index(room)
    ]
    assert upward == []


def test_no_files_take_from_each_other_in_a_circle():
    graph = {module: others for module, others in TAKEN.items() if room_of(module) != SEAM}
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        pytest.fail(" → ".join(error.args[1]))


def test_the_one_place_that_looks_up_does_so_late():
    """The seam loads nothing of symmotion until a picture is asked for."""
    tree = ast.parse((ROOT / f"{SEAM}.py").read_text(encoding="utf-8"))
    early = [node for node in tree.body if isinstance(node, ast.Import | ast.ImportFrom)]
    assert not [node for node in early if "symmotion" in ast.unparse(node) or "matplotlib" in ast.unparse(node)]
    late = {room_of(module) for module in TAKEN[f"symmotion.{SEAM}"]}
    assert "views" in late and "report" not in late
