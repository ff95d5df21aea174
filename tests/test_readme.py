import re
from pathlib import Path

import pytest

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
