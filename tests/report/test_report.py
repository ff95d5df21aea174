"""The report holds what the studies found, complete and escaped, as a page, as JSON and as figures."""

import json
import pickle
import re
import subprocess
import sys
import xml.etree.ElementTree as ET
from html.parser import HTMLParser
from itertools import pairwise
from typing import Any, cast

import matplotlib
import numpy as np
import pytest

import symmotion as sm
from symmotion.report import Column, Figure, Run, StudyRecord, StudyResult, Table, write_report
from symmotion.report.figures import convergence_figure, to_figure
from symmotion.report.page import duration
from symmotion.solvers import Iteration, Status
from symmotion.tables import shown
from symmotion.views.style import COLOURS, new_figure
from symmotion.views.svg_paths import shortened

EVIL = "<script>alert(1)</script>"


def draw(name="picture", title="σ over time"):
    with new_figure() as figure:
        axes = figure.subplots()
        axes.plot([0, 1, 2], [1, 0.5, 2], "o-", color=COLOURS[0], label="one")
        axes.axhline(1.0, color="black")
        axes.set_title(title)
        axes.legend()
        return to_figure(figure, name, f"Caption of {name}", "A line that falls and rises.")


def bad_run(case="second case"):
    return Run.failed(case, "ipopt", "Ipopt()", Status.FAILED, f"Restoration_Failed {EVIL}")


def good_run(case="quarter turn"):
    program = sm.affine_program(sm.examples.quarter_turn(), refine=0)
    return Run.of(case, sm.ExactNewton().solve(program))


def record(name="one", result=None, error="", question="Does it hold?"):
    return StudyRecord(name, question, "HJK 5.1", 1.25, result, error, subject="affine")


def found(**changes):
    table = Table(
        "optima", (Column("case"), Column("length", "m")), (("a", 1 / 3), ("b", None), ("c", np.inf)), "Least values."
    )
    return StudyResult(
        **{
            "tables": (table,),
            "figures": (draw(),),
            "runs": (good_run(), bad_run()),
            "answer": "It holds for 1 of 2.",
            "conclusion": "It holds.\n\nMostly.",
            "notes": ("Ran on example data.",),
            **changes,
        }
    )


def strict_json(path):
    def refuse(constant):
        raise AssertionError(f"{constant} is no JSON")

    return json.loads(path.read_text(encoding="utf-8"), parse_constant=refuse)


class Page(HTMLParser):
    """What a test wants to know of a page."""

    def __init__(self, path):
        super().__init__()
        self.ids, self.tags, self.attributes, self.text = [], [], [], ""
        self.source = path.read_text(encoding="utf-8")
        self.feed(self.source)

    def handle_starttag(self, tag, attrs):
        self.tags.append(tag)
        self.attributes.append(dict(attrs))
        self.ids += [value for key, value in attrs if key == "id"]

    def handle_data(self, data):
        self.text += data


# The files


def test_json_follows_the_contract(tmp_path):
    run = good_run()
    write_report([record(result=found(runs=(run, bad_run())))], tmp_path)
    document = strict_json(tmp_path / "report.json")
    assert document["schema"] == 1 and document["symmotion"] == sm.__version__
    assert {"python", "casadi", "numpy", "platform", "cpus"} <= set(document["environment"])
    (study,) = document["studies"]
    assert {"name", "question", "source", "status", "error", "seconds", "figures", "tables", "runs"} <= set(study)
    assert (study["status"], study["error"], study["seconds"]) == ("ok", None, 1.25)
    assert study["conclusion"] == "It holds.\n\nMostly." and study["notes"] == ["Ran on example data."]
    assert study["answer"] == "It holds for 1 of 2." and study["subject"] == "affine"
    assert study["figures"] == ["figures/one-picture.svg"] and (tmp_path / study["figures"][0]).is_file()
    assert study["tables"][0]["columns"] == [{"name": "case", "unit": ""}, {"name": "length", "unit": "m"}]
    assert study["tables"][0]["rows"] == [["a", 1 / 3], ["b", None], ["c", None]]
    good, bad = study["runs"]
    keys = "case method solver status objective stationarity violation decrement complementarity excess inertia "
    keys += "iterations evaluations unknowns multipliers"
    assert list(good) == [*keys.split(), "convergence_order", "seconds"]
    assert list(good["seconds"]) == ["build", "compile", "solve", "evaluate", "linear"]
    assert (good["method"], good["status"], good["inertia"]) == ("newton", "solved", "positive")
    assert good["objective"] == run.objective and good["unknowns"] > good["multipliers"] > 0
    assert bad["status"] == "failed" and bad["inertia"] == "unknown"
    assert all(bad[key] is None for key in ("objective", "stationarity", "iterations", "convergence_order"))
    assert set(bad["seconds"].values()) == {None}


def test_nothing_but_whole_files(tmp_path):
    target = tmp_path / "deep" / "report"
    for _ in range(2):  # the second overwrites
        assert write_report([record(result=found())], target) == target / "index.html"
    names = {str(p.relative_to(target)) for p in target.rglob("*")}
    assert names == {"index.html", "report.json", "figures", "figures/one-picture.svg"}


def test_an_unwritable_place_is_named(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(sm.InputError, match=re.escape(str(tmp_path / "file" / "report"))):
        write_report([], tmp_path / "file" / "report")
    (tmp_path / "index.html").mkdir()
    with pytest.raises(sm.InputError, match=r"index\.html"):
        write_report([], tmp_path)


def test_studies_of_one_name_are_refused(tmp_path):
    with pytest.raises(sm.InputError, match="same name: one, one"):
        write_report([record(), record()], tmp_path)


# The page


def test_names_are_escaped(tmp_path):
    table = Table(EVIL, (Column(EVIL, EVIL),), ((EVIL,),), EVIL)
    figures = (draw(title=EVIL), convergence_figure([good_run(f"${EVIL} --> {{{{ 1 }}}}"), good_run("b")], "c", EVIL))
    result = StudyResult((table,), figures, (good_run(EVIL), bad_run(EVIL)), EVIL, (EVIL,))
    records = [record("one", result, question=EVIL), record("two", error=f"ValueError: {EVIL}")]
    page = Page(write_report(records, tmp_path, EVIL, EVIL))
    assert "script" not in page.tags
    assert page.text.count(EVIL) >= 12
    assert all("script" not in ET.parse(path).getroot().itertext() for path in tmp_path.glob("figures/*.svg"))


def test_ids_are_unique_and_references_resolve(tmp_path):
    twice = StudyResult(figures=(draw("a"), draw("b")))
    page = Page(write_report([record("one", twice), record("two", twice)], tmp_path))
    assert len(set(page.ids)) == len(page.ids) > 40
    references = re.findall(r'(?:href="#|url\(#|labelledby=")([^")]+)', page.source)
    assert references and set(references) <= set(page.ids)


def test_the_page_is_accessible_and_needs_nothing_else(tmp_path):
    page = Page(write_report([record("one", found()), record("two", error="ValueError: no")], tmp_path))
    headings = [int(tag[1]) for tag in page.tags if re.fullmatch("h[1-6]", tag)]
    assert headings[:2] == [1, 2] and all(b - a <= 1 for a, b in pairwise(headings))
    assert page.tags.count("table") == page.tags.count("caption") == 3
    svgs = [a for tag, a in zip(page.tags, page.attributes, strict=True) if tag == "svg"]
    told = [a for a in svgs if a.get("aria-hidden") != "true"]  # the small one beside the answer says nothing new
    assert [(a["role"], a["aria-label"]) for a in told] == [("img", "A line that falls and rises.")]
    assert not {"script", "link", "img", "iframe"} & set(page.tags)
    assert not re.search(r'(src|href)="(?!#|report\.json")|@import|<image|url\((?!#)', page.source)


def test_a_failed_study_is_shown_with_its_error(tmp_path):
    path = write_report([record("one", found()), record("two", error="ValueError: no poses")], tmp_path)
    text = " ".join(Page(path).text.split())
    assert "1 of 2 ok, 1 of 2 runs certified" in text and "✗ failed: ValueError: no poses" in text
    failed = strict_json(tmp_path / "report.json")["studies"][1]
    assert (failed["status"], failed["error"], failed["conclusion"]) == ("failed", "ValueError: no poses", None)
    assert failed["figures"] == failed["tables"] == failed["runs"] == []


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (None, "–"),
        (np.nan, "–"),
        (-np.inf, "–"),
        (True, "yes"),
        (12345678, "12345678"),
        (1 / 3, "0.33333"),
        (1.5e-10, "1.5e-10"),
        (-2e-5, "-2e-5"),
        (1234567.8, "1234568"),
        (3e15, "3e15"),
        ("e+05", "e+05"),
    ],
)
def test_cells_read_well(value, text):
    assert shown(value) == text


def test_durations_read_well():
    assert [duration(s) for s in (0.04, 59.4, 60.2, 125.0)] == ["0.0 s", "59.4 s", "1 min 0 s", "2 min 5 s"]


# Values


def test_values_pickle():
    result = found()
    assert pickle.loads(pickle.dumps(result)) == result


def test_numpy_scalars_become_plain():
    row: Any = (np.int64(3), np.float64(0.5), np.bool_(True))
    table = Table("t", (Column("a"), Column("b"), Column("c")), (row,))
    assert [type(cell) for cell in table.rows[0]] == [int, float, bool]
    assert table.numeric == (True, True, False)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Table("t", (Column("a"),), ((1,), (1, 2))), "'t', row 1: 2 cells for 1 columns"),
        (lambda: Table("t", (Column("a"),), cast(Any, (([1],),))), "row 0: a cell cannot be a list"),
        (lambda: Table("t", (Column("a", end=True),), ()), "'t': its first column is the end of no interval"),
        (lambda: Figure("a b", "<svg>", ""), "figure 'a b': letters"),
        (lambda: Figure("a", "<?xml?>", ""), "SVG element"),
        (lambda: record("../x"), r"study '../x': letters"),
        (lambda: StudyResult(figures=(Figure("a", "<svg>", ""),) * 2), "figures of the same name: a, a"),
    ],
)
def test_what_cannot_be_reported_is_refused(make, message):
    with pytest.raises(sm.InputError, match=message):
        make()


def test_only_certified_minima_count():
    run = good_run()
    assert run.certified and not bad_run().certified
    assert StudyResult(runs=(run, bad_run(), run)).certified == 2


def test_measured_times_have_fewer_digits():
    table = Table("speed", (Column("length", "m"), Column("time", "ms"), Column("peak", "MB")), ())
    assert [c.digits for c in table.columns] == [5, 3, 3]


def test_the_ends_of_intervals_stand_in_brackets(tmp_path):
    share = Column("share", "%"), Column("from", "%", end=True), Column("to", "%", end=True)
    rows = ("a", 200 / 3, 9.4531, 98.5, 3), ("b", None, None, None, 0)
    table = Table("t", (Column("case"), *share, Column("n")), rows)
    assert [[table.shown(row, part) for part in table.parts] for row in rows] == [
        ["a", "66.7 (9.45–98.5)", "3"],
        ["b", "–", "0"],
    ]
    write_report([record(result=found(tables=(table,)))], tmp_path)
    assert "66.7 (9.45–98.5)" in Page(tmp_path / "index.html").text
    assert strict_json(tmp_path / "report.json")["studies"][0]["tables"][0]["rows"][0][1:4] == [200 / 3, 9.4531, 98.5]


# Figures


def test_figures_are_reproducible_and_take_the_ink_of_the_page():
    before = dict(matplotlib.rcParams)
    figure = draw()
    assert draw() == figure
    assert dict(matplotlib.rcParams) == before
    root = ET.fromstring(figure.svg)
    assert root.get("fill") == "currentColor"
    assert "stroke: currentColor" in figure.svg and COLOURS[0] in figure.svg
    assert not re.search("#000000|<!--|<style|<metadata|<text", figure.svg)


def absolute(data):
    """The corners (N, 2) of a path of lines, as its letters say."""
    return np.cumsum(np.array(re.findall(r"-?(?:\d+\.?\d*|\.\d+)", data), dtype=float).reshape(-1, 2), axis=0)


def apart(points, corners):
    """The largest distance of points from a polygon line."""
    a, side = corners[:-1], np.diff(corners, axis=0)
    share = np.clip(((points[:, None] - a) * side).sum(axis=2) / (side**2).sum(axis=1), 0, 1)
    return np.linalg.norm(points[:, None] - a - share[..., None] * side, axis=2).min(axis=1).max()


def test_short_paths_look_the_same():
    s = np.linspace(0, 9, 1500)
    curve = np.column_stack([40 * s, 100 + 90 * np.cos(s * s) * np.exp(-s / 5)])
    data = "M " + " \nL ".join(f"{x:.6f} {y:.6f}" for x, y in curve) + " \n"
    made = shortened(data)
    short = absolute(made)
    assert apart(curve, short) < 0.15 and apart(short, curve) < 0.15
    assert len(made) < len(data) / 8
    assert re.fullmatch(r"M[-\d. ]+l[-\d. ]+", made)
    assert shortened(data + "z\n" + data) == made + "z" + made


@pytest.mark.parametrize(
    ("data", "text"),
    [
        ("M 1 2 \nL 1 2 \n", "M1 2l0 0"),
        ("M -0.5 10.004 \nL 0.25 -3 \nL 7 7 \nz\n", "M-.5 10l.75-13 6.75 10z"),
        ("M 0 0.12345 Q 1.98765 2 3 4 z", "M 0 0.12 Q 1.98 2 3 4 z"),
        ("M 3 4 ", "M3 4"),
        ("", ""),
    ],
)
def test_short_paths_as_text(data, text):
    assert shortened(data) == text


def test_convergence_has_a_panel_per_case_and_leaves_out_what_was_not_logged():
    zero = Run("a", "newton", "", "solved", log=(Iteration(1.0, 1.0, 0.0), Iteration(0.5, 0.0, 0.0)))
    panels = [
        convergence_figure(runs, "c", "").svg.count('id="axes_')
        for runs in ([], [bad_run()], [zero], [zero, bad_run("b"), good_run("c")])
    ]
    assert panels == [1, 1, 1, 2]


def test_importing_symmotion_leaves_the_heavy_packages_alone():
    code = "import sys, symmotion; print({'matplotlib', 'jinja2', 'rich'} & set(sys.modules))"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout == "set()\n"
