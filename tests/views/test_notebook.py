"""What notebooks show: HTML that is whole, escaped, small and without scripts, for whatever happened."""

import re
import xml.etree.ElementTree as ET
from dataclasses import replace
from html.parser import HTMLParser

import matplotlib
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import symmotion as sm
from symmotion.motions.nets import noisy_net, smooth_net
from symmotion.solvers import Status
from symmotion.views.notebook import MOST_TEXT, motion_html

EVIL = '<script>alert("1")</script>'
TIMES = np.arange(4.0)
TURNS = Rotation.from_euler("ZYX", [[0, 0, 0], [60, 30, 10], [110, -20, 70], [190, 25, 95]], degrees=True)
PLANAR, SPATIAL = sm.examples.planar_keyframes(), sm.examples.spatial_keyframes()
VOID = {"br", "hr", "img", "meta", "link"}
HARMFUL = re.compile(r"<script|<style|<link|<iframe|<img|\bon\w+=|javascript:|src=|@import", re.IGNORECASE)


class Page(HTMLParser):
    """Checks that elements are closed in order, and keeps the text and the table rows."""

    def __init__(self, html):
        super().__init__()
        self.open, self.text, self.rows = [], [], []
        self.feed(html)
        self.close()
        assert not self.open

    def handle_starttag(self, tag, attrs):
        if tag not in VOID:
            self.open.append(tag)
        if tag == "tr":
            self.rows.append([])

    def handle_startendtag(self, tag, attrs):
        pass

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.text.append(data)
        if self.open and self.open[-1] in ("td", "th"):
            self.rows[-1].append(data)


def shown(thing) -> Page:
    """What a notebook shows of a thing, checked."""
    html = thing._repr_html_()
    assert not HARMFUL.search(html)
    assert len(html) <= 200_000
    # Nothing is fetched: addresses are names of XML only.
    assert set(re.findall(r"https?://[\w./]+", html)) <= {"http://www.w3.org/2000/svg", "http://www.w3.org/1999/xlink"}
    for svg in re.findall(r"<svg .*?</svg>", html, flags=re.DOTALL):
        ids = [e.get("id") for e in ET.fromstring(svg).iter() if e.get("id")]
        assert len(set(ids)) == len(ids)
        used = set(re.findall(r'(?:href="#|url\(#)([^")]+)', svg))
        assert used <= set(ids)
    return Page(html)


@pytest.fixture(scope="module")
def comparison():
    objective = sm.Rigidity() + 1e-3 * sm.TrajectoryEnergy(np.eye(3))
    return sm.compare(sm.affine_program(SPATIAL, objective=objective))


@pytest.fixture(scope="module")
def faired():
    return sm.fair(noisy_net(smooth_net(9), 0.018, seed=1), target=0.05)


SHOWN = {
    "affine": lambda: sm.interpolants.component_cubic(PLANAR),
    "interpolant": lambda: sm.interpolants.polar_blend(SPATIAL),
    "pose": lambda: sm.Ipopt().solve(sm.pose_program(sm.Keyframes.from_rotations(TIMES, TURNS))).motion,
    "orientation": lambda: sm.quaternions.interpolate_quaternions(TIMES, TURNS),
    "product of turns": lambda: sm.interpolants.monotone_curve(TIMES, TURNS),
    "slerps": lambda: sm.interpolants.slerp_curve(TIMES, TURNS),
    "rational": lambda: smooth_net(6, spatial=True).isoparametric(v=4.0),
    "net": lambda: smooth_net(6),
    "keyframes": lambda: SPATIAL,
    "rigid": lambda: sm.motions.orthonormalise(sm.interpolants.component_cubic(PLANAR), np.linspace(0, 1, 5)),
}


@pytest.mark.parametrize("make", SHOWN.values(), ids=SHOWN)
def test_motions_show_what_they_are_and_a_picture(make):
    before = dict(matplotlib.rcParams)
    motion = make()
    text = repr(motion)
    page = shown(motion)
    assert type(motion).__name__ in page.text and "<svg" in motion._repr_html_()
    assert not any("No picture" in t for t in page.text)
    assert repr(motion) == text and dict(matplotlib.rcParams) == before


def test_facts_of_motions():
    rows = {row[0]: row[1] for row in shown(sm.interpolants.component_cubic(PLANAR)).rows}
    assert rows == {"dimension": "2", "degree": "3", "controls": "6", "times": "0 to 1"}
    rows = {row[0]: row[1] for row in shown(smooth_net(6, 7)).rows}
    assert rows == {"degree": "3 × 3", "controls": "6 × 7", "u": "3 to 6", "v": "3 to 7"}
    rows = {row[0]: row[1] for row in shown(SPATIAL).rows}
    assert rows == {"dimension": "3", "positions": "4", "times": "0 to 1"}


def test_a_solution_shows_certificate_terms_and_prices(comparison):
    solution = comparison.solutions[0]
    page = shown(solution)
    rows = {row[0]: row[1:] for row in page.rows}
    assert rows["objective"] == [f"{solution.objective:.9g}"]
    assert rows["inertia"] == ["positive"] and rows["iterations"] == [str(solution.iterations)]
    assert float(rows["R"][0]) == pytest.approx(solution.terms["R"], rel=1e-4)
    prices = solution.multipliers["keyframes"]
    dearest = page.rows[page.rows.index(["keyframe", "‖λ‖, linear part", "‖λ‖, translation"]) + 1]
    k = int(dearest[0])
    assert float(dearest[1]) == pytest.approx(np.linalg.norm(prices.linear[k]), rel=1e-3)
    assert np.linalg.norm(prices.linear[k]) == np.linalg.norm(prices.linear, axis=(1, 2)).max()
    assert any(str(solution.program) in t for t in page.text)


def test_a_comparison_shows_solvers_side_by_side(comparison):
    page = shown(comparison)
    assert [row[0] for row in page.rows] == ["solver", "newton", "ipopt", "elimination"]
    assert len({len(row) for row in page.rows}) == 1
    assert float(page.rows[1][2]) == pytest.approx(comparison.solutions[0].objective, rel=1e-4)


def test_a_fairing_shows_how_much_fairer(faired):
    rows = {row[0]: row[1] for row in shown(faired).rows}
    assert float(rows["G of the start"]) == pytest.approx(faired.initial, rel=1e-4)
    assert float(rows["G of the result"]) == pytest.approx(faired.final, rel=1e-4)


def test_failed_solves_are_shown_with_their_reason():
    comparison = sm.compare(sm.free_times_program(PLANAR, objective=sm.Rigidity(2)), [sm.Elimination()])
    (solution,) = comparison.solutions
    for thing in (comparison, solution):
        page = shown(thing)
        assert any("Elimination takes linear equalities only" in t for t in page.text)
    assert {row[0]: row[1:] for row in page.rows}["objective"] == ["–"]
    limited = sm.ExactNewton(max_iterations=1).solve(sm.affine_program(PLANAR, objective=sm.Rigidity(2)))
    assert "newton: iteration-limit" in " ".join(shown(limited).text)


@pytest.mark.parametrize("what", ["x", "multiplier_vector"])
def test_solutions_that_are_not_finite_are_shown(comparison, what):
    solution = comparison.solutions[0]
    nan = float("nan")
    certificate = replace(solution.certificate, objective=nan, stationarity=nan, violation=nan, inertia="unknown")
    broken = replace(
        solution,
        status=Status.DIVERGED,
        certificate=certificate,
        **{what: np.full_like(getattr(solution, what), nan)},
    )
    assert "newton: diverged" in " ".join(shown(broken).text)
    shown(sm.solvers.Comparison(broken.program, (broken, solution)))


def test_motions_that_are_not_finite_are_shown_with_the_reason():
    motion = sm.interpolants.component_cubic(PLANAR)
    page = shown(sm.AffineMotion(motion.basis, np.full_like(motion.linear, np.nan)))
    assert any("No picture: the motion is not finite" in t for t in page.text)


def test_a_picture_that_fails_for_another_reason_does_not_hide_the_rest():
    class Strange:
        domain = (0.0, 1.0)

        def plot(self, axes=None):
            raise ZeroDivisionError(EVIL)

    html = motion_html(Strange())
    assert not HARMFUL.search(html)
    assert any("No picture (ZeroDivisionError" in t for t in Page(html).text)


def test_names_are_text_and_nothing_else():
    condition = sm.constraints.CurveCondition.at(TIMES, np.eye(4)[:, :2], name=EVIL)
    solution = sm.ExactNewton().solve(sm.curve_program([condition]))
    hostile = replace(solution, method=EVIL, solver=EVIL, message=EVIL + "x" * 10 * MOST_TEXT, status=Status.FAILED)
    page = shown(hostile)
    assert "".join(page.text).count(EVIL) >= 3
    shown(sm.solvers.Comparison(hostile.program, (hostile, solution)))


def test_many_keyframes_stay_small():
    keyframes = sm.examples.random_keyframes(2_000, 40, 1)
    program = sm.affine_program(keyframes)
    # Unsolved: what is shown is as much either way.
    solution = sm.ExactNewton(max_iterations=1).solve(program)
    for thing in (
        keyframes,
        sm.interpolants.component_cubic(keyframes),
        solution,
        sm.solvers.Comparison(program, (solution,)),
    ):
        shown(thing)
    turns = sm.quaternions.interpolate_quaternions(np.arange(500.0), Rotation.random(500, random_state=1))
    shown(turns)


def test_a_long_log_stays_small(comparison):
    solution = comparison.solutions[0]
    long = replace(solution, log=solution.log * 500)
    shown(sm.solvers.Comparison(solution.program, (long, long, long)))


def test_pictures_in_one_notebook_do_not_share_ids(comparison):
    ids = [
        set(re.findall(r'\bid="([^"]+)"', thing._repr_html_()))
        for thing in (comparison, comparison.solutions[0], comparison.solutions[0].motion)
    ]
    assert all(ids) and not (ids[0] & ids[1] or ids[0] & ids[2] or ids[1] & ids[2])


def test_a_comparison_of_nothing_is_shown():
    assert "No solver reached a minimum" in "".join(shown(sm.compare(sm.affine_program(PLANAR), [])).text)


def test_ink_and_ground_are_the_notebooks(comparison):
    html = comparison._repr_html_()
    assert "currentColor" in html
    assert not re.search(r"background|(?<![-\w])color:|fill: ?(#000|black|#fff|white)", html)


def test_ipython_picks_html_and_keeps_the_text(comparison, faired):
    formatters = pytest.importorskip("IPython.core.formatters")
    formatter = formatters.DisplayFormatter()
    for thing in (comparison, comparison.solutions[0], comparison.solutions[0].motion, faired, SPATIAL):
        data, _ = formatter.format(thing)
        assert data["text/html"] == thing._repr_html_()
    data, _ = formatter.format(comparison.solutions[0])
    assert data["text/plain"] == repr(comparison.solutions[0])
