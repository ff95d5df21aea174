import runpy
import sys

import pytest

import symmotion as sm


def test_the_package_runs_as_the_command(monkeypatch, capsys):
    monkeypatch.setattr(sys, "argv", ["symmotion", "--version"])
    with pytest.raises(SystemExit) as ended:
        runpy.run_module("symmotion", run_name="__main__")
    assert not ended.value.code
    assert sm.__version__ in capsys.readouterr().out
