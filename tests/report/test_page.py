"""The page answers first and fits its screen: in a browser, on a phone, a tablet and a desktop, by day and by night."""

import base64
import io
import json

import numpy as np
import pytest
from browsing import opened
from matplotlib.image import imread

from symmotion.bodies import letter_k
from symmotion.report import Column, Run, StudyRecord, StudyResult, Table, Travelling, player, to_figure, write_report
from symmotion.views import new_figure

SCREENS = {"phone": (390, 844), "tablet": (820, 1180), "desktop": (1440, 900)}
RUNS = (
    Run("a", "newton", "ExactNewton()", "solved", 1.0, 1e-12, 1e-15, inertia="positive"),
    Run("a", "ipopt", "Ipopt()", "solved", 1.5, 1e-10, 0.0, inertia="positive"),
    Run("b", "elimination", "Elimination()", "solved", 2.0, 1e-9, 0.0, inertia="flat"),
)


def drawn(name, width=7.0):
    with new_figure(width, 3.0) as figure:
        figure.subplots().plot([0, 1, 2], [1, 3, 2])
        return to_figure(figure, name, f"Caption of {name}.")


def wide():
    columns = tuple(Column(f"quite a long heading {k}", "m") for k in range(14))
    return Table("wide", columns, (tuple(10.0**-k for k in range(14)),) * 30, "More than a screen holds.")


def along(t, nu):
    x = 40 * np.asarray(t) if nu == 0 else np.full(np.shape(t), 40.0)
    return np.stack([x, np.zeros_like(x)], axis=-1)


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    motion = Travelling(along, (0.0, 1.0))
    moving = player("moving", {"along": motion}, letter_k(), "A letter on a long way.")
    studies = [
        ("first", "affine", "The least R is 1.000 in 2 of 3 runs.", StudyResult((wide(),), (drawn("a"),), RUNS)),
        ("second", "affine", "The letter goes 40 units.", StudyResult(players=(moving,), notes=("Made up.",))),
        ("third", "solving", "Nothing was solved in 0 of 0 runs.", StudyResult(figures=(drawn("c", 12.0),))),
    ]
    records = [
        StudyRecord(n, f"What of {n}?", "here", 1.5, StudyResult(**{**vars(r), "answer": a}), subject=s)
        for n, s, a, r in studies
    ]
    records.append(StudyRecord("broken", "Does it break?", "", 0.5, None, "ValueError: it does", subject="solving"))
    return write_report(records, tmp_path_factory.mktemp("page"), "Studies", "In their quick form.")


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("screen", SCREENS)
def test_the_page_answers_first_and_fits(browser, path, screen, scheme):
    width, height = SCREENS[screen]
    told = json.loads(path.with_name("report.json").read_text())["studies"]
    with opened(browser, path, width, height, color_scheme=scheme) as page:
        assert page.evaluate("document.documentElement.scrollWidth") == width
        cards = page.locator(".card")
        assert cards.count() == len(told)
        for k, study in enumerate(told):
            text = cards.nth(k).inner_text()
            assert (study["answer"] or study["error"]) in text and study["question"] in text
        first = cards.nth(0).bounding_box()
        assert first["y"] + first["height"] < height / 2
        # The figure that carries it, small, is drawn.
        shown = page.locator(".thumb svg use").evaluate_all("(all) => all.map((u) => u.getBoundingClientRect().width)")
        assert len(shown) == 3 and all(40 < w < 160 for w in shown)
        assert page.locator("h2").all_inner_texts()[:3] == ["Affine", "Solving", "Status and times"]
        runs = [run for study in told for run in study["runs"]]
        sure = sum(run["status"] == "solved" and run["inertia"] == "positive" for run in runs)
        ok = sum(study["status"] == "ok" for study in told)
        tally = page.locator(".tally").inner_text()
        assert tally == f"{ok} of {len(told)} ok, {sure} of {len(runs)} runs certified, 5 s in all."
        # Figures fit, tables scroll in their boxes and show that they do.
        rights = page.locator("figure svg, figure canvas").evaluate_all(
            "(all) => all.map((e) => e.getBoundingClientRect().right)"
        )
        assert max(rights) <= width
        box = page.locator(".table.box", has_text="wide.")
        inner, outer, back = box.evaluate("(b) => [b.scrollWidth, b.clientWidth, getComputedStyle(b).backgroundImage]")
        assert inner > outer and back.count("linear-gradient") == 4
        # The contents stay, and on a desktop the page is as wide as the screen.
        page.evaluate("window.scrollTo(0, document.body.scrollHeight)")
        contents = page.locator(".contents").bounding_box()
        assert contents["y"] == 0 and (contents["width"] < 300) == (screen == "desktop")
        if screen == "desktop":
            assert page.locator("main").bounding_box()["width"] > 0.8 * width
        ink, paper = (page.evaluate(f"getComputedStyle(document.body).{what}") for what in ("color", "backgroundColor"))
        lightness = [sum(map(int, colour[4:-1].split(","))) for colour in (ink, paper)]
        assert (
            (lightness[0] < 150 and lightness[1] > 700)
            if scheme == "light"
            else (lightness[0] > 600 > 150 > lightness[1])
        )


def test_a_study_says_what_it_asked_found_and_how_far_to_trust_it(browser, path):
    with opened(browser, path) as page:
        study = page.locator("section.study", has=page.locator("#study-first"))
        text = study.inner_text()
        parts = ["What of first?", "The least R is 1.000", "How far to trust it", "2 of 3 runs are certified"]
        parts += ["solved, but flat elimination 1", "In 1 of 1 cases", "50 %", "wide."]
        places = [text.find(part) for part in parts]
        assert -1 not in places and places == sorted(places)
        assert "Note: Made up." in page.locator("section.study", has=page.locator("#study-second")).inner_text()


def test_a_player_frames_the_body_and_not_the_way(browser, path):
    with opened(browser, path) as page:
        figure = page.locator("figure.player")
        figure.scroll_into_view_if_needed()
        slider, canvas = figure.locator("input[type=range]"), figure.locator("canvas")

        def share():
            """Of the stage's width, in which something of the body's colour is seen."""
            page.evaluate("() => new Promise((f) => requestAnimationFrame(() => requestAnimationFrame(f)))")
            image = imread(io.BytesIO(base64.b64decode(canvas.evaluate("(c) => c.toDataURL()").split(",")[1])))
            columns = np.flatnonzero(((image[..., 2] > image[..., 0] + 0.25) & (image[..., 3] > 0.6)).any(axis=0))
            return np.ptp(columns) / image.shape[1]

        for step in ("0", "100", "200"):
            slider.fill(step)
            assert 0.15 < share() < 0.5
        figure.get_by_text("Whole path").click()
        assert share() < 0.05
