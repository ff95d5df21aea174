"""Studies use what users can use: `import symmotion as sm`, and the public names of its packages."""

import ast
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path

import pytest

import studies
import symmotion as sm

ROOT = Path(str(studies.__file__)).parent
FILES = sorted(ROOT.rglob("*.py"))


def complaints(tree: ast.AST) -> Iterator[str]:
    """What reaches behind a face: where a name begins with an underscore, or no package lists it."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            names = [alias.name for alias in node.names if alias.name.split(".")[0] == "symmotion"]
            yield from (f"import {name}" for name in names if name != "symmotion")
        elif isinstance(node, ast.ImportFrom):
            module = node.module or "."
            yield from (f"from {module} import {a.name}" for a in node.names if not is_public(module, a.name))
        elif isinstance(node, ast.Attribute):
            base = node.value.id if isinstance(node.value, ast.Name) else ""
            hidden = node.attr.startswith("_") and not node.attr.endswith("__") and base not in ("self", "cls", "os")
            if hidden or (base == "sm" and node.attr not in sm.__all__):
                yield ast.unparse(node)


def is_public(module: str, name: str) -> bool:
    """Whether a name may be imported from a module: of symmotion from packages that list it."""
    if module.split(".")[0] != "symmotion":
        return not name.startswith("_") or module == "__future__"
    try:
        package = import_module(module)
    except ImportError:
        return False
    return hasattr(package, "__path__") and name in package.__all__ and hasattr(package, name)


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.relative_to(ROOT).as_posix())
def test_a_study_imports_public_faces_only(path):
    assert list(complaints(ast.parse(path.read_text(encoding="utf-8")))) == []


@pytest.mark.parametrize(
    "line",
    [
        "import symmotion.program",
        "from symmotion.program.block import Block",
        "from symmotion.program import block",
        "from symmotion.program import _block",
        "from symmotion.errors import InputError",
        "from symmotion.nowhere import name",
        "from studies.solving.scaling import _grow",
        "sm.kernel_function(program)",
        "solution._private",
    ],
)
def test_what_reaches_behind_a_face_is_found(line):
    assert list(complaints(ast.parse(line)))


def test_every_study_is_found():
    without = [p.parent for p in FILES if not (p.parent / "__init__.py").is_file()]
    assert not without  # folders that are no packages are not walked
    written = [p for p in FILES if "\nSTUDY = Study(" in p.read_text(encoding="utf-8")]
    discover = import_module("studies.__main__").discover
    assert len(discover()) == len(written) >= 33
