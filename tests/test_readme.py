import inspect
import re
from importlib import import_module
from pathlib import Path

import pytest

import symmotion as sm

README = Path(__file__).parents[1] / "README.md"
EXAMPLES = re.findall(r"```python\n(.*?)```", README.read_text(encoding="utf-8"), flags=re.DOTALL)


@pytest.mark.parametrize("code", EXAMPLES, ids=range(len(EXAMPLES)))
def test_readme_examples_run_as_printed(code, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    exec(compile(code, "README.md", "exec"), {"__name__": "__main__"})


def test_readme_has_examples_and_both_commands():
    text = README.read_text(encoding="utf-8")
    assert len(EXAMPLES) >= 3
    assert "python -m pip install . && python -m studies" in text
    assert 'python -m pip install ".[test]" && python -m pytest' in text


def test_readme_names_public_faces_and_files_that_exist():
    text = README.read_text(encoding="utf-8")
    for module in re.findall(r"from (symmotion[.\w]*) import", text):
        assert hasattr(import_module(module), "__path__"), f"{module} is no package"
    for package, name in re.findall(r"`(symmotion(?:\.\w+)*)\.(\w+)`", text):
        assert name in import_module(package).__all__, f"{package} has no {name}"
    for path in re.findall(r"\]\(([^):]+)\)", text):
        assert (README.parent / path).is_file(), f"{path} is not there"


def test_the_table_of_the_grammar_is_that_of_the_signatures():
    text = README.read_text(encoding="utf-8")
    table = text[text.index("## One grammar") :].split("\n\n")[2].splitlines()
    kinds = [cell.strip() for cell in table[0].split("|")[2:-1]]
    assert kinds == ["affine", "fit", "free_times", "orientation", "pose", "curve"]
    orders = set()
    for kind in kinds:
        shown = {}
        for line in table[2:]:
            first, *cells = (cell.strip() for cell in line.split("|")[1:-1])
            for name in re.findall(r"`(\w+)`", first):
                shown[name] = cells[kinds.index(kind)]
        found = inspect.signature(inspect.unwrap(getattr(sm, f"{kind}_program"))).parameters
        orders.add(tuple(name for name in found if name in shown and name != "refine"))
        for name, cell in shown.items():
            assert (name in found) == (cell != "–"), (kind, name)
            if cell not in ("yes", "–"):
                assert str(found[name].default) == cell, (kind, name)
    assert len(orders) == 1
