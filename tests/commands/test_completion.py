"""Completion of shells: the script that bash takes, and what it offers."""

import shutil
import subprocess
import sys

import pytest

from symmotion.commands import main


def script(shell, capsys):
    with pytest.raises(SystemExit) as ended:
        main(["--completion", shell])
    assert ended.value.code == 0
    return capsys.readouterr().out


@pytest.mark.parametrize("shell", ["bash", "zsh", "tcsh"])
def test_every_shell_has_its_script(shell, capsys):
    told = script(shell, capsys)
    # tcsh completes no options of commands.
    names = ("smooth", "compare", "design", "convert", "fair", *(["--explore"] if shell != "tcsh" else []))
    assert all(name in told for name in names)


@pytest.mark.skipif(shutil.which("bash") is None, reason="no bash")
@pytest.mark.parametrize(
    ("words", "wanted"),
    [
        (["symmotion", "des"], {"design"}),
        (["symmotion", "design", "--expl"], {"--explore"}),
        (["symmotion", "design", "pos"], {"poses.csv"}),
        (["symmotion", "--completion", "z"], {"zsh"}),
    ],
)
def test_bash_offers_commands_options_and_files(words, wanted, capsys, tmp_path):
    (tmp_path / "poses.csv").write_text("", encoding="utf-8")
    told = script("bash", capsys)
    asked = " ".join(words)
    ask = f"""
{told}
COMP_WORDS=({asked}); COMP_CWORD={len(words) - 1}; COMP_LINE="{asked}"; COMP_POINT=${{#COMP_LINE}}
$(complete -p symmotion | sed 's/.*-F \\([^ ]*\\).*/\\1/') symmotion "{words[-1]}" "{words[-2]}"
printf '%s\\n' "${{COMPREPLY[@]}}"
"""
    done = subprocess.run(["bash", "-c", ask], cwd=tmp_path, capture_output=True, text=True, timeout=60, check=False)
    assert {word.strip() for word in done.stdout.split("\n")} - {""} == wanted, done.stderr


def test_what_is_missing_is_said(capsys, monkeypatch):
    monkeypatch.setitem(sys.modules, "shtab", None)
    with pytest.raises(SystemExit) as ended:
        main(["--completion", "bash"])
    assert ended.value.code == 2
    assert 'takes shtab: python -m pip install "symmotion[completion]"' in capsys.readouterr().err
