"""The frozen problem set: it loads with CasADi alone, it is what symmotion makes, and what it says of minima holds."""

import subprocess
import sys
from pathlib import Path

import casadi as ca
import numpy as np
import pytest

import symmotion as sm
from studies.solving.problem_set import load
from studies.solving.problem_set.families import FAMILIES, entries
from studies.solving.problem_set.problem import Measured
from studies.solving.problem_set.tasks import SLOW, program, quick
from studies.solving.problem_set.write import text_of

# Refuses to import whatever belongs to symmotion, or is installed beside CasADi and NumPy for it.
ALONE = """
import sys

class Refuse:
    def find_spec(self, name, path=None, target=None):
        if name.split(".")[0] in ("symmotion", "studies", "scipy", "matplotlib", "jinja2", "rich"):
            raise ImportError(f"{name} is not to be had here")

sys.meta_path.insert(0, Refuse())
try:
    import symmotion
except ImportError:
    pass
else:
    raise SystemExit("symmotion can be imported")
sys.path.insert(0, sys.argv.pop(1))
import load

load.main()
"""
ROWS = {row["name"]: row for row in load.manifest()["problems"]}
# One of each kind whose functions are quickly derived.
SAMPLE = [next(n for n, r in ROWS.items() if r["kind"] == k) for k in dict.fromkeys(r["kind"] for r in ROWS.values())]
SAMPLE = [name for name in SAMPLE if ROWS[name]["kind"] not in SLOW and ROWS[name]["unknowns"] < 500]


def alone(*arguments: str) -> str:
    command = [sys.executable, "-I", "-c", ALONE, str(load.HERE), *arguments]
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout


def test_it_loads_and_checks_where_symmotion_cannot_be_imported():
    said = alone("keyframes-30", "weakly-active-0", "--solver", "ipopt").splitlines()
    known = [line for line in said if ", best known: " in line]
    assert len(known) == 2
    for line, name in zip(known, ("keyframes-30", "weakly-active-0"), strict=True):
        assert line.startswith(name)
        told = dict(part.rsplit(" ", 1) for part in line.split(": ", 1)[1].split(", "))
        assert float(told["objective"]) == pytest.approx(ROWS[name]["best"]["objective"], rel=1e-5)
        assert float(told["stationarity"]) < 1e-6 and float(told["violation"]) < 1e-8
        assert float(told["curvature"]) > 0
    assert sum("Solve_Succeeded" in line for line in said) == 2


def test_it_lists_itself():
    said = alone().splitlines()
    assert len(said) == len(ROWS) >= 170
    assert {line.split()[0] for line in said} == set(ROWS)


def test_names_and_families_are_those_of_the_entries():
    assert list(ROWS) == list(entries())
    assert list(dict.fromkeys(r["family"] for r in ROWS.values())) == list(FAMILIES)
    assert load.names("long") == [f"long-{k}" for k in range(8)]
    counts = {f: len(load.names(f)) for f in FAMILIES}
    told = (load.HERE / "README.md").read_text(encoding="utf-8")
    assert all(f"| {family} | {count} |" in told for family, count in counts.items())
    assert Path(load.ARCHIVE).stat().st_size < 2e6


@pytest.mark.parametrize("name", SAMPLE)
def test_symmotion_still_makes_the_same_problem(name):
    frozen, made = load.load(name), program(name)
    nlp = made.nlp()
    function = ca.Function("nlp", [nlp["x"], nlp["p"]], [nlp["f"], nlp["g"]])
    assert len(frozen.x0) == made.unknowns == ROWS[name]["unknowns"]
    # Details of 1e-3 at 1e6 are determined to 1e-7: other machines round otherwise.
    np.testing.assert_allclose(frozen.x0, made.x0, rtol=1e-6, atol=1e-6 * np.abs(made.x0).max())
    np.testing.assert_allclose(frozen.unit, made.unit, rtol=1e-6)
    for old, new in ((frozen.lbg, made.lower), (frozen.ubg, made.upper)):
        np.testing.assert_allclose(old, new, rtol=1e-11)
    point = frozen.x0 + 0.1 * frozen.unit * np.sin(np.arange(len(frozen.x0)))
    for pair in zip(frozen.function(point, frozen.p0), function(point, nlp["p0"]), strict=True):
        old, new = (np.asarray(value) for value in pair)
        np.testing.assert_allclose(old, new, rtol=1e-6, atol=1e-6 * np.abs(old).max())


@pytest.mark.parametrize("name", [n for n in SAMPLE if ROWS[n]["best"] is not None])
def test_the_best_value_known_has_its_certificate(name):
    frozen, best = load.load(name), ROWS[name]["best"]
    assert frozen.x is not None and frozen.multipliers is not None
    certificate = sm.certify(program(name), frozen.x, frozen.multipliers)
    assert certificate.holds(1e-7) and certificate.inertia == best["inertia"] == "positive"
    assert certificate.objective == pytest.approx(best["objective"], rel=1e-9)


def test_the_loaders_check_is_the_certificate_in_other_words():
    frozen = load.load("pace-0")
    assert frozen.x is not None and frozen.multipliers is not None
    moved = frozen.x + 1e-4 * frozen.unit * np.cos(np.arange(len(frozen.x)))
    found = frozen.check(moved, frozen.multipliers)
    certificate = sm.certify(program("pace-0"), moved, frozen.multipliers)
    for name in ("objective", "stationarity", "violation", "decrement"):
        assert found[name] == pytest.approx(getattr(certificate, name), rel=1e-6), name
    assert found["curvature"] > 0 and found["independence"] > 1e-3
    assert load.load("vanishing-0").check(frozen_x("vanishing-0"), frozen_y("vanishing-0"))["independence"] < 1e-5


def frozen_x(name: str) -> np.ndarray:
    x = load.load(name).x
    assert x is not None
    return x


def frozen_y(name: str) -> np.ndarray:
    multipliers = load.load(name).multipliers
    assert multipliers is not None
    return multipliers


def test_a_text_that_was_changed_is_refused(monkeypatch):
    monkeypatch.setattr(load, "read", lambda name: b"{}" if name.endswith(".json") else b"something else")
    with pytest.raises(ValueError, match="checksum"):
        load.load("pace-0")
    with pytest.raises(KeyError, match="no problem 'nothing'"):
        load.load("nothing")


def test_texts_are_those_of_the_functions():
    function = ca.Function.deserialize(text_of(program("keyframes-30")))
    assert function.name_in() == ["x", "p"] and function.name_out() == ["f", "g"]


def test_what_was_measured_is_handed_out_again():
    found = Measured()
    assert found(lambda: 3.0) == 3.0 and found.all(lambda: [1.0, 2.0], 2).tolist() == [1.0, 2.0]
    again = Measured(found.numbers)
    assert again(lambda: 0.0) == 3.0 and again.all(lambda: 0.0, 2).tolist() == [1.0, 2.0]
    with pytest.raises(sm.InputError, match="1 numbers are missing"):
        again(lambda: 0.0)


def test_quick_tasks_are_of_every_family_that_has_small_ones():
    assert {t.family for t in quick(1)} == set(FAMILIES) - {"long", "recorded"}
