import re
import tomllib
from importlib import import_module
from pathlib import Path

import pytest

README = Path(__file__).parents[1] / "README.md"
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


def test_pictures_have_absolute_addresses_as_soon_as_the_project_has_one():
    text = README.read_text(encoding="utf-8")
    pictures = re.findall(r"!\[[^]]*\]\(([^)]+)\)", text)
    project = tomllib.loads((README.parent / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    addresses = tuple(project.get("urls", {}).values())
    assert pictures and all(p.startswith(addresses) if addresses else (README.parent / p).is_file() for p in pictures)
    assert "@keyframes" in (README.parent / re.sub(r"^https?://.*/(?=studies/)", "", pictures[0])).read_text()


def test_readme_names_public_faces_and_files_that_exist():
    text = README.read_text(encoding="utf-8")
    for module in re.findall(r"from (symmotion[.\w]*) import", text):
        assert hasattr(import_module(module), "__path__"), f"{module} is no package"
    for package, name in re.findall(r"`(symmotion(?:\.\w+)*)\.(\w+)`", text):
        assert name in import_module(package).__all__, f"{package} has no {name}"
    for path in re.findall(r"\]\(([^):]+)\)", text):
        assert (README.parent / path).is_file(), f"{path} is not there"
