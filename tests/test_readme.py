import re
import runpy
from importlib import import_module
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
README = ROOT / "README.md"
EXAMPLES = re.findall(r"```python\n(.*?)```", README.read_text(encoding="utf-8"), flags=re.DOTALL)


@pytest.mark.parametrize("code", EXAMPLES, ids=range(len(EXAMPLES)))
def test_readme_examples_run_as_printed(code, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    exec(compile(code, "README.md", "exec"), {"__name__": "__main__"})


def test_readme_is_short_and_its_commands_stand_in_the_order_they_run():
    text = README.read_text(encoding="utf-8")
    assert len(text.splitlines()) <= 150 and len(EXAMPLES) >= 2
    assert re.findall(r"```sh\n(.*?)\n```", text, flags=re.DOTALL) == [
        "python -m pip install . && python -m studies",
        "symmotion --help",
        'python -m pip install ".[docs]" && python -m studies.guide -o site',
        'python -m pip install ".[test]" && python -m pytest',
    ]


def test_on_a_package_index_the_picture_that_moves_and_all_links_have_absolute_addresses():
    readme = runpy.run_path(str(ROOT / "setup.py"))["readme"]
    text = README.read_text(encoding="utf-8")
    assert readme(text, "") == text
    shown = readme(text, "https://example.org/symmotion/")
    pictures = re.findall(r"!\[[^]]*\]\(([^)]+)\)", shown)
    assert len(pictures) == 1 and pictures[0].startswith("https://example.org/symmotion/raw/HEAD/")
    path = ROOT / pictures[0].removeprefix("https://example.org/symmotion/raw/HEAD/")
    assert "@keyframes" in path.read_text(encoding="utf-8")
    targets = re.findall(r"\]\(([^)]+)\)", shown)
    assert len(targets) > 10 and all(target.startswith("https://") for target in targets)
    assert shown.count("https://example.org/") == len(targets) and readme(shown, "https://other.org") == shown


def test_readme_names_public_faces_and_files_that_exist():
    text = README.read_text(encoding="utf-8")
    for module in re.findall(r"from (symmotion[.\w]*) import", text):
        assert hasattr(import_module(module), "__path__"), f"{module} is no package"
    for package, name in re.findall(r"`(symmotion(?:\.\w+)*)\.(\w+)`", text):
        assert name in import_module(package).__all__, f"{package} has no {name}"
    for path in re.findall(r"\]\(([^):]+)\)", text):
        assert (README.parent / path).is_file(), f"{path} is not there"
