import runpy
import sys

import pytest


def test_the_package_runs_as_the_command(monkeypatch, capsys):
    monkeypatch.setattr(sys, "argv", ["symmotion", "--help"])
    with pytest.raises(SystemExit) as ended:
        runpy.run_module("symmotion", run_name="__main__")
    assert not ended.value.code
    assert "keyframes" in capsys.readouterr().out
