import re
from pathlib import Path

import pytest

CONTRIBUTING = Path(__file__).parents[1] / "CONTRIBUTING.md"
RECIPES = dict(
    re.findall(
        r"^### (.*?)\n.*?```python\n(.*?)```", CONTRIBUTING.read_text(encoding="utf-8"), re.DOTALL | re.MULTILINE
    )
)


@pytest.mark.parametrize("code", RECIPES.values(), ids=RECIPES)
def test_recipes_run_as_printed(code, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    exec(compile(code, "CONTRIBUTING.md", "exec"), {"__name__": "__main__"})
    assert capsys.readouterr().out


def test_every_block_of_python_is_a_recipe():
    assert len(RECIPES) == CONTRIBUTING.read_text(encoding="utf-8").count("```python") >= 5


def test_an_energy_takes_fifteen_lines():
    (energy,) = re.findall(r"^@dataclass.*?\n\n\n", RECIPES["A new energy"], re.DOTALL | re.MULTILINE)
    assert len(energy.strip().splitlines()) <= 15
