"""Players move what the motions move: as data, and in a browser, with mouse, keyboard, without script and in print."""

import base64
import hashlib
import io
import json
import pickle
import re
from typing import Any, cast

import numpy as np
import pytest
from browsing import opened
from matplotlib.image import imread
from scipy.interpolate import CubicHermiteSpline

import symmotion as sm
from symmotion.bodies import eight_ellipses, jug, letter_k, wedge
from symmotion.bodies.places import placed
from symmotion.motions.nets import smooth_net
from symmotion.report import (
    Column,
    Run,
    StudyRecord,
    StudyResult,
    Table,
    Travelling,
    player,
    player_elements,
    write_report,
)
from symmotion.report.comparison import compared, comparison_result

EVIL = "</script><script>window.hacked = 1</script><!--<script><img src=x onerror='window.hacked = 1'>"
KEYS = {2: sm.examples.planar_keyframes(), 3: sm.examples.spatial_keyframes()}


def optimum(keys):
    return sm.ExactNewton().solve(sm.affine_program(keys)).require()


def in_the_plane(**changes):
    solution = optimum(KEYS[2])
    motions = {"interpolating spline": sm.interpolants.component_cubic(KEYS[2]), "optimum": solution.motion}
    made = {"body": letter_k(), "caption": "A letter K, moving.", "keyframes": KEYS[2], "unit": "s", **changes}
    return player("plane", changes.pop("motions", motions), **{k: v for k, v in made.items() if k != "motions"})


def in_space(**changes):
    motions = {"optimum": optimum(KEYS[3]).motion}
    made = {"body": wedge(), "caption": "A wedge.", "keyframes": KEYS[3], **changes}
    return player("space", changes.pop("motions", motions), **{k: v for k, v in made.items() if k != "motions"})


def spins():
    return {
        f"× {f}": placed(sm.quaternions.QuaternionMotion.hermite([1, 0, 0, 0], [0, 1, 0, 0], *np.eye(3)[:2] * f))
        for f in (1, 9)
    }


def torn(t, nu):
    """A point that is elsewhere after half of the time."""
    side = np.where(np.asarray(t) < 0.5, 0.0, 1.0) if nu == 0 else np.zeros_like(t)
    return np.stack([side, np.asarray(t) if nu == 0 else np.ones_like(t)], axis=-1)


def long_way():
    return sm.examples.random_keyframes(300, 60, seed=1)


# Data


def far(track, motion, corners, count=1001):
    """How far the track carries a body's corners from where the motion does, by SciPy's Hermite cubics."""
    t = np.linspace(track.times[0], track.times[-1], count)
    cubic = CubicHermiteSpline(track.times, track.poses, track.rates)(t)
    d = corners.shape[1]
    places = cubic[:, None, d * d :] + corners @ np.swapaxes(cubic[:, : d * d].reshape(-1, d, d), 1, 2)
    linear, translation = motion(t)
    wanted = translation[:, None] + corners @ np.swapaxes(linear, 1, 2)
    size = np.linalg.norm(np.ptp(wanted.reshape(-1, d), axis=0))
    return np.linalg.norm(places - wanted, axis=-1).max() / size


@pytest.mark.parametrize(
    "motion",
    [
        optimum(KEYS[3]).motion,
        *spins().values(),
        smooth_net(8).isoparametric(v=5.0),
        Travelling(sm.curves.bezier([[0, 0, 0], [1e6, 0, 1], [1e6, 1e6, 0]]), (0.0, 1.0)),
        sm.AffineMotion(
            sm.splines.BSplineBasis.clamped([1e6, 1e6 + 1e-3], 1), np.stack([np.eye(3)] * 2), 1e-4 * np.eye(3)[:2]
        ),
    ],
    ids=["affine", "turning", "turning fast", "rational", "a point", "soon"],
)
def test_tracks_follow_their_motions(motion):
    corners = np.concatenate(wedge())
    made = player("a", {"m": motion}, wedge(), "", picture=in_space().picture)
    assert far(made.tracks[0], motion, corners) < 5e-4
    assert len(made.tracks[0].times) == len(made.tracks[0].poses) == len(made.tracks[0].rates) <= 129


def test_times_are_put_where_the_motion_bends():
    turns = sm.interpolants.component_cubic(sm.examples.uneven_turns())
    times = np.array(player("a", {"m": turns}, letter_k(), "").tracks[0].times)
    steps = np.diff(times)
    assert steps.max() >= 2 * steps.min() > 0


def test_a_corner_in_the_motion_ends_the_halving():
    made = player("a", {"m": sm.interpolants.polar_blend(KEYS[2], rotation="slerp")}, letter_k(), "")
    assert (
        far(made.tracks[0], sm.interpolants.polar_blend(KEYS[2], rotation="slerp"), np.concatenate(letter_k())) < 2e-3
    )


def test_a_jump_stays_a_jump():
    track = player("a", {"torn": Travelling(torn, (0.0, 1.0))}, letter_k(), "").tracks[0]
    t = np.linspace(0, 1, 400)
    assert np.diff(track.times).min() > 0
    assert np.allclose(CubicHermiteSpline(track.times, track.poses, track.rates)(t)[:, 4:], torn(t, 0), atol=1e-4)


def test_span_and_domain():
    made = in_the_plane(span=(0.25, 0.5))
    assert made.domain == (0.25, 0.5) and made.dimension == 2
    assert player("a", spins(), wedge(), "").domain == (0.0, 1.0)


def test_a_body_keeps_its_faces():
    mesh = jug().scaled(2.0)
    body = in_space(body=mesh).body
    assert len(body.vertices) == len({*map(tuple, body.vertices)}) < len(mesh.vertices)
    used = {tuple(body.vertices[i]) for face in body.faces for i in face}
    assert len(body.faces) > 0.9 * len(mesh.faces) and all(3 <= len(set(f)) == len(f) for f in body.faces)
    assert np.allclose(np.ptp(list(used), axis=0), np.ptp(mesh.vertices, axis=0), atol=1e-3)
    assert [len(face) for face in in_the_plane().body.faces] == [12]


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e4])
def test_the_body_of_a_comparison_suits_the_keyframes(scale):
    keys = sm.Keyframes(KEYS[3].times, KEYS[3].linear, scale * KEYS[3].translation)
    step = np.linalg.norm(np.diff(keys.translation, axis=0), axis=1)
    made = player("a", {"m": sm.interpolants.component_cubic(keys)}, None, "", keys)
    size = np.ptp(made.body.vertices @ keys.linear[0].T, axis=0).max()
    assert step.min() / 3 < size < 3 * step.max()


def test_players_are_compact_and_pickle():
    made = in_space()
    assert pickle.loads(pickle.dumps(made)) == made == in_space()
    assert all(len(json.dumps([t.poses, t.rates])) < 8_000 for t in (*made.tracks, *in_the_plane().tracks))


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: in_space(body=letter_k()), "'space', 'optimum': a motion in dimension .* body in dimension 2"),
        (lambda: in_the_plane(keyframes=KEYS[3]), "keyframes in dimension 3, the body in 2"),
        (lambda: in_the_plane(body=[]), "one outline or more"),
        (lambda: in_the_plane(body=[np.zeros((2, 2))]), "closed polygons"),
        (lambda: in_the_plane(body=[np.zeros((3, 2))]), "do not coincide"),
        (lambda: in_the_plane(body=[np.full((3, 2), np.nan)]), "outline 0: a point is not finite"),
        (lambda: in_the_plane(motions={}), "at least one motion"),
        (lambda: in_the_plane(span=(0.5, 0.5)), "span"),
        (lambda: in_the_plane(span=(0.5, 2.0)), "span"),
        (lambda: in_space(direction=(0, 0, 0)), "direction"),
        (lambda: player("a", {"long": sm.interpolants.component_cubic(long_way())}, wedge(), ""), "shorter span"),
        (lambda: in_space(centre=(0, 0)), "centre"),
        (lambda: player("a b", spins(), wedge(), ""), "player 'a b': letters"),
        (lambda: StudyResult(players=(in_space(), in_space())), "same name: space"),
    ],
)
def test_what_cannot_be_played_is_refused(make, message):
    with pytest.raises(sm.InputError, match=message):
        make()


# Report


def report(tmp_path, *players, **changes):
    """A report of one study, or of what is given as records; returns the page's path."""
    solution = optimum(KEYS[2])
    table = Table(
        "figures of all kinds",
        (Column("case"), Column("value", "m"), Column("count")),
        (("third", 1 / 3, 12345678), ("small", -1.23456789e-10, None), ("large", 2.5e12, 0), ("none", None, -3)),
    )
    runs = (Run.of("a", solution), Run.failed("b", "ipopt", "Ipopt()", "failed", "no"))
    result = StudyResult((table,), (), runs, "", (), players)
    made = {"name": "moving", "question": "Does it move?", "source": "", "seconds": 1.0, "result": result}
    return write_report([StudyRecord(**{**made, **changes})], tmp_path)


def test_json_lists_the_players_and_their_pictures(tmp_path):
    report(tmp_path, in_the_plane(), in_space())
    (study,) = json.loads((tmp_path / "report.json").read_text())["studies"]
    assert study["players"] == [
        {"name": "plane", "tracks": ["interpolating spline", "optimum"], "domain": [0.0, 1.0]},
        {"name": "space", "tracks": ["optimum"], "domain": [0.0, 1.0]},
    ]
    assert study["figures"] == ["figures/moving-plane-still.svg", "figures/moving-space-still.svg"]
    assert all((tmp_path / path).is_file() for path in study["figures"])


def test_a_picture_of_the_study_is_not_shown_twice(tmp_path):
    still = in_the_plane().picture
    made = in_the_plane(picture=still)
    result = StudyResult(figures=(still,), players=(made,))
    assert result.pictures == (still,) and result.player_of(still) == made
    page = report(tmp_path, result=result).read_text()
    assert page.count('role="img"') == 1 == page.count('<figure class="player">')


def test_bodies_are_shared(tmp_path):
    players = [player(name, spins(), wedge(), "") for name in "ab"]
    page = report(tmp_path, *players, in_the_plane(body=eight_ellipses())).read_text()
    assert len(json.loads(re.findall(r'id="bodies">(.*?)</script>', page)[0])) == 2


def test_the_policy_allows_the_one_script(tmp_path):
    page = report(tmp_path, in_space()).read_text()
    policy = re.findall(r'Content-Security-Policy" content="(.*?)"', page)[0]
    script = re.findall(r"<script>(.*?)</script>", page, re.DOTALL)
    digest = base64.b64encode(hashlib.sha256(script[0].encode()).digest()).decode()
    assert len(script) == 1 and f"script-src 'sha256-{digest}';" in policy and "default-src 'none'" in policy
    assert "unsafe-eval" not in policy and "script-src 'unsafe-inline'" not in policy
    assert not re.search(r"\beval\(|Function\(|fetch\(|XMLHttpRequest|innerHTML|import\(", script[0])


def test_a_report_without_players_has_no_script(tmp_path):
    page = report(tmp_path).read_text()
    assert "<script" not in page and "script-src" not in page


def compared_result(keys):
    objectives = [sm.Rigidity()]
    return comparison_result(keys, objectives, compared(keys, objectives, 3, 1, [sm.ExactNewton()]))


def test_the_page_of_a_comparison_of_thousands_of_poses_stays_small(tmp_path):
    keys = sm.examples.recorded_tour(3000)
    objective = sm.Rigidity(2) + 1e-3 * sm.TrajectoryEnergy(np.eye(3))
    result = comparison_result(keys, [objective], compared(keys, [objective], 3, 1, [sm.ExactNewton()]))
    page = write_report([StudyRecord("compare", "?", "", 1.0, result)], tmp_path)
    assert page.stat().st_size < 1e6  # two objectives and three solvers, too, below 2 MB
    player, figures = result.players[0], result.figures
    assert len(player.keyframes) < 100 and len(figures) == 2
    assert sum(len(f.svg) for f in figures) < 2e5


def test_a_comparison_plays_before_and_after():
    result = compared_result(KEYS[2])
    (made,) = result.players
    assert [track.label for track in made.tracks] == ["interpolating spline", "minimum"] and len(made.keyframes) == 4
    result = compared_result(long_way())
    assert result.players[0].domain == (0.0, 15.0) and "first 16 of 300 keyframes" in result.players[0].caption


# Browser

FOCUSED = """(() => {
    const { tagName, type, ariaLabel, textContent } = document.activeElement;
    return [tagName, type, ariaLabel || textContent].join(" ");
})()"""


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    return report(tmp_path_factory.mktemp("report"), in_the_plane(), in_space(), player("three", three(), wedge(), ""))


def three():
    return {
        **spins(),
        "× 0": placed(sm.quaternions.QuaternionMotion.hermite([1, 0, 0, 0], [0.8, 0, 0.6, 0], [0] * 3, [0] * 3)),
    }


class Screen:
    """A player as its user sees it."""

    def __init__(self, page, index):
        self.page, self.figure = page, page.locator("figure.player").nth(index)
        self.figure.scroll_into_view_if_needed()
        self.play, self.scrub = self.figure.locator(".play"), self.figure.locator("input[type=range]")
        self.canvas = self.figure.locator("canvas")

    def data(self, key):
        self.page.evaluate("() => new Promise((f) => requestAnimationFrame(() => requestAnimationFrame(f)))")
        return self.figure.evaluate("(figure, key) => figure.dataset[key]", key)

    def time(self):
        return float(self.data("time"))

    def pose(self):
        return np.array(self.data("pose").split(), dtype=float)

    def pixels(self):
        self.data("time")
        return self.canvas.evaluate("(canvas) => canvas.toDataURL()")

    def until(self, condition):
        element = self.figure.element_handle()
        self.page.wait_for_function(f"(figure) => {condition}", arg=element)


def test_scrubbing_moves_the_body_as_the_motion_says(browser, path):
    with opened(browser, path) as page:
        motions = [sm.interpolants.component_cubic(KEYS[2]), optimum(KEYS[3]).motion]
        for k, motion in enumerate(motions):
            screen, seen = Screen(page, k), set()
            for step in (0, 37, 110, 200):
                screen.scrub.fill(str(step))
                seen.add(screen.pixels())
                t = screen.time()
                linear, translation = motion(t)
                assert t == pytest.approx(step / 200) and f"{t:.2f}" in screen.figure.locator("output").inner_text()
                assert np.allclose(screen.pose(), np.append(linear, translation), atol=7e-3)
            assert len(seen) == 4
            assert screen.scrub.get_attribute("aria-valuetext").startswith("1.00")


def test_before_and_after_is_a_switch(browser, path):
    with opened(browser, path) as page:
        screen = Screen(page, 0)
        screen.scrub.fill("70")
        seen, poses = [], []
        for label in ("interpolating spline", "optimum", "both"):
            screen.figure.get_by_label(label).check()
            seen.append(screen.pixels())
            poses.append(screen.pose())
        assert len(set(seen)) == 3 and screen.time() == pytest.approx(0.35)
        linear, translation = optimum(KEYS[2]).motion(0.35)
        assert np.allclose(poses[1], np.append(linear, translation), atol=7e-3)
        assert np.allclose(poses[0], poses[2]) and not np.allclose(poses[0], poses[1], atol=1e-2)
        assert Screen(page, 1).figure.locator("input[type=radio], select").count() == 0


def test_of_many_motions_one_is_chosen(browser, path):
    with opened(browser, path) as page:
        screen, seen = Screen(page, 2), set()
        screen.scrub.fill("90")
        assert screen.figure.locator("option").all_inner_texts() == ["× 1", "× 9", "× 0", "all"]
        for label in ("× 1", "× 9", "× 0", "all"):
            screen.figure.locator("select").select_option(label)
            swatches = screen.figure.locator(".key .swatch")
            colours = swatches.evaluate_all("(all) => all.map((i) => i.style.backgroundColor)")
            assert len(set(colours)) == len(colours) == (3 if label == "all" else 1)
            assert screen.figure.locator(".key").inner_text().split("\n") == (list(three()) if label == "all" else [""])
            seen.add(screen.pixels())
        assert len(seen) == 4


def test_nothing_moves_until_it_is_played_and_pause_stops_it(browser, path):
    with opened(browser, path) as page:
        screen = Screen(page, 0)
        page.wait_for_timeout(300)
        assert screen.time() == 0.0 and screen.play.inner_text() == "▶ Play"
        screen.play.click()
        screen.until("figure.dataset.time > 0.01")
        assert "Pause" in screen.play.inner_text()
        screen.play.click()
        stopped = screen.time()
        page.wait_for_timeout(200)
        assert 0.0 < stopped == screen.time() and screen.play.inner_text() == "▶ Play"


def test_at_the_end_it_begins_again_but_not_for_who_wants_calm(browser, path):
    for calm in (False, True):
        with opened(browser, path, reduced_motion="reduce" if calm else "no-preference") as page:
            screen = Screen(page, 0)
            screen.scrub.fill("199")
            screen.play.click()
            screen.until("figure.dataset.playing === 'false'" if calm else "figure.dataset.time < 0.5")
            assert screen.data("playing") == ("false" if calm else "true")
            assert (screen.time() == 1.0) == calm


def test_frames_are_drawn_only_for_what_plays_in_sight(browser, path):
    with opened(browser, path) as page:
        screen = Screen(page, 0)
        page.wait_for_timeout(300)

        def frames():
            before = page.evaluate("window.drawn")
            page.wait_for_timeout(250)
            return page.evaluate("window.drawn") - before

        assert frames() == 0
        screen.play.click()
        screen.until("figure.dataset.time > 0.005")
        assert frames() > 0
        page.evaluate("window.scrollTo(0, document.body.scrollHeight)")
        page.wait_for_timeout(300)
        assert frames() == 0
        screen.figure.scroll_into_view_if_needed()
        page.wait_for_timeout(100)
        assert frames() > 0


def test_the_keyboard_is_enough(browser, path):
    with opened(browser, path) as page:
        reached = []
        for _ in range(40):
            page.keyboard.press("Tab")
            reached.append(page.evaluate(FOCUSED))
        wanted = ("BUTTON button Play, plane", "INPUT range Time, plane", "INPUT radio", "BUTTON button Still picture")
        wanted += ("CANVAS  A wedge. Arrow keys turn the view.", "INPUT range Time, space", "BUTTON button Reset view")
        for name in wanted:
            assert any(r.startswith(name) for r in reached), (name, reached)
        screen = Screen(page, 1)
        screen.scrub.focus()
        for key, time in (
            ("ArrowRight", 0.005),
            ("ArrowRight", 0.01),
            ("End", 1.0),
            ("ArrowLeft", 0.995),
            ("Home", 0.0),
        ):
            page.keyboard.press(key)
            screen.until(f"Math.abs(figure.dataset.time - {time}) < 1e-9")
        page.keyboard.press("Space")
        screen.until("figure.dataset.time > 0.005")
        page.keyboard.press("Space")
        assert screen.data("playing") == "false"
        screen.play.focus()
        page.keyboard.press("Space")
        assert screen.data("playing") == "true"
        page.keyboard.press("Enter")
        assert screen.data("playing") == "false"
        home = screen.data("view")
        screen.canvas.focus()
        page.keyboard.press("ArrowLeft")
        page.keyboard.press("ArrowUp")
        yaw, pitch = (float(x) for x in screen.data("view").split())
        assert np.allclose([yaw, pitch], np.array(home.split(), dtype=float) + 0.1)
        screen.figure.get_by_text("Reset view").press("Enter")
        assert np.allclose(np.array(screen.data("view").split(), float), np.array(home.split(), float))


def test_dragging_turns_a_body_in_space(browser, path):
    with opened(browser, path) as page:
        screen = Screen(page, 1)
        view, pixels, box = screen.data("view"), screen.pixels(), screen.canvas.bounding_box()
        page.mouse.move(box["x"] + 100, box["y"] + 60)
        page.mouse.down()
        page.mouse.move(box["x"] + 160, box["y"] + 80, steps=4)
        page.mouse.up()
        turned = screen.data("view")
        assert np.allclose(np.subtract(*(np.array(v.split(), float) for v in (turned, view))), [-0.6, 0.2])
        assert screen.pixels() != pixels
        page.mouse.move(box["x"] + 20, box["y"] + 20)
        assert screen.data("view") == turned
        # In the plane there is nothing to turn, and the canvas is no stop of the keyboard.
        assert Screen(page, 0).canvas.evaluate("(canvas) => canvas.tabIndex") == -1


def test_the_still_picture_is_a_button_away(browser, path):
    with opened(browser, path) as page:
        screen = Screen(page, 0)
        svg, button = screen.figure.locator("svg"), screen.figure.get_by_text("Still picture")
        assert not svg.is_visible() and screen.canvas.is_visible()
        button.click()
        assert svg.is_visible() and not screen.canvas.is_visible() and button.get_attribute("aria-pressed") == "true"
        screen.scrub.fill("20")
        assert screen.canvas.is_visible() and not svg.is_visible()


def test_without_script_and_in_print_the_picture_is_shown(browser, path):
    with opened(browser, path, java_script_enabled=False) as page:
        pictures = page.locator("figure.player svg")
        assert pictures.count() == 3 and all(pictures.nth(k).is_visible() for k in range(3))
        assert page.locator("canvas, button").count() == 0
    with opened(browser, path) as page:
        page.emulate_media(media="print")
        assert page.locator("figure.player svg").nth(0).is_visible()
        assert not page.locator("canvas").nth(0).is_visible() and not page.locator(".controls").nth(0).is_visible()


@pytest.mark.parametrize("width", [320, 400, 1000])
def test_it_fits_the_screen_and_is_sharp(browser, path, width):
    with opened(browser, path, device_scale_factor=2) as page:
        page.set_viewport_size({"width": width, "height": 800})
        for k in range(3):
            screen = Screen(page, k)
            screen.pixels()
            size = screen.canvas.evaluate("(c) => [c.width, c.clientWidth]")
            assert size[0] == 2 * size[1] > 250
            right = screen.figure.evaluate(
                "(figure) => Math.max(...[...figure.querySelectorAll('canvas, button, input, select, output')]"
                ".map((e) => e.getBoundingClientRect().right))"
            )
            assert right <= width


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_it_is_legible_in_light_and_dark(browser, path, scheme):
    def luminance(colour):
        c = np.asarray(colour)[..., :3] / 255
        return np.where(c <= 0.04045, c / 12.92, ((c + 0.055) / 1.055) ** 2.4) @ [0.2126, 0.7152, 0.0722]

    def contrast(a, b):
        low, high = np.sort([luminance(a), np.broadcast_to(luminance(b), luminance(a).shape)], axis=0)
        return (high + 0.05) / (low + 0.05)

    def colour(locator, what):
        text = locator.evaluate(f"(e) => getComputedStyle(e).{what}")
        return np.array(re.findall(r"[\d.]+", text)[:3], dtype=float)

    with opened(browser, path, color_scheme=scheme) as page:
        paper = colour(page.locator("body"), "backgroundColor")
        assert (luminance(paper) > 0.5) == (scheme == "light")
        for k in range(3):
            screen = Screen(page, k)
            assert contrast(colour(screen.play, "color"), colour(screen.play, "backgroundColor")) > 7
            assert contrast(colour(screen.figure.locator("output"), "color"), paper) > 7
            image = imread(io.BytesIO(base64.b64decode(screen.pixels().split(",")[1])))
            alpha = image[..., 3:]
            seen = contrast(255 * alpha * image[..., :3] + (1 - alpha) * paper, paper)
            assert (seen > 3).mean() > 0.004 and seen.max() > 4


def test_hostile_names_do_nothing(browser, tmp_path):
    motions = {EVIL: sm.interpolants.component_cubic(KEYS[2]), f"{EVIL}&amp;": optimum(KEYS[2]).motion}
    hostile = in_the_plane(motions=motions, caption=EVIL, unit=EVIL, alt=EVIL)
    page_path = report(tmp_path, hostile, question=EVIL, source=EVIL)
    with opened(browser, page_path) as page:
        screen = Screen(page, 0)
        screen.scrub.fill("50")
        labels = [text.strip() for text in screen.figure.locator("label").all_inner_texts()]
        assert labels == [EVIL, f"{EVIL}&amp;", "both"] and EVIL in screen.figure.locator("output").inner_text()
        assert screen.canvas.get_attribute("aria-label") == EVIL
        assert page.evaluate("window.hacked") is None
        assert page.locator("script").count() == 3 and page.locator("img").count() == 0


def test_the_policy_stops_other_scripts(browser, path):
    context = browser.new_context()
    page = context.new_page()
    page.goto(path.as_uri())
    page.evaluate(
        "() => document.body.append(Object.assign(document.createElement('script'), { text: 'window.hacked = 1' }))"
    )
    assert page.evaluate("window.hacked") is None
    context.close()


def test_the_numbers_on_the_page_are_those_of_the_json(browser, path):
    (study,) = json.loads(path.with_name("report.json").read_text())["studies"]
    with opened(browser, path) as page:
        tables = page.locator(".study table").evaluate_all(
            "(tables) => tables.map((t) => [...t.rows].map((r) => [...r.cells].map((c) => c.textContent.trim())))"
        )
    assert len(tables) == 2

    def agree(text, value, digits):
        if value is None:
            assert text == "–"
        elif isinstance(value, float):
            assert float(text) == pytest.approx(value, rel=0.51 * 10.0 ** (1 - digits), abs=0.0)
        else:
            assert text == str(value)

    (heads, *rows), (table,) = tables[0], study["tables"]
    assert heads == [" ".join(filter(None, c.values())) for c in table["columns"]] and len(rows) == len(table["rows"])
    for texts, values in zip(rows, table["rows"], strict=True):
        for text, value in zip(texts, values, strict=True):
            agree(text, value, 5)
    (heads, *rows), runs = tables[1], study["runs"]
    shown = ["case", "method", "status", "objective", "stationarity", "violation", "inertia"]
    shown += ["iterations", "convergence_order"]
    digits = {"objective": 8, "stationarity": 2, "violation": 2}
    assert len(rows) == len(runs)
    for texts, run in zip(rows, runs, strict=True):
        values = [run[key] for key in shown] + [run["seconds"][key] for key in ("build", "compile", "solve")]
        values += [run["unknowns"], run["multipliers"]]
        for text, value, key in zip(texts, values, [*shown] + [""] * 5, strict=True):
            agree(text, value, digits.get(key, 3))


def test_players_move_on_a_page_of_ones_own(browser, tmp_path):
    figures, rest = player_elements([in_the_plane(), in_space()])
    page_file = tmp_path / "own.html"
    page_file.write_text(
        "<!doctype html><meta charset=utf-8><title>own</title>" + "".join(figures) + rest, encoding="utf-8"
    )
    with opened(browser, page_file) as page:
        assert page.locator("figure.player.moving").count() == 2
        first = page.locator("figure.player").first
        first.locator(".play").click()
        page.wait_for_function("document.querySelector('figure.player').dataset.time > 0")
        first.locator(".play").click()
        before = first.locator("canvas").screenshot()
        page.evaluate("document.body.style.background = '#222'; document.body.dataset.theme = 'dark'")
        page.wait_for_function("window.drawn > 0")
        page.wait_for_timeout(100)
        assert first.locator("canvas").screenshot() != before
    with pytest.raises(sm.InputError, match="players of the same name: plane"):
        player_elements([in_the_plane(), in_the_plane()])


def test_what_is_upright_in_a_file_is_upright_in_the_player():
    stood = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])
    keys = sm.examples.spatial_keyframes()
    turned = sm.Keyframes(keys.times, stood @ keys.linear, keys.translation @ stood.T)
    shown, expected = (
        player("p", {"spline": sm.interpolants.component_cubic(k)}, wedge(), "c", k, direction=d, up=cast(Any, up))
        for k, d, up in ((keys, (1.0, 1.0, 2.0), "y"), (turned, (1.0, -2.0, 1.0), "z"))
    )
    np.testing.assert_allclose(shown.tracks[0].poses, expected.tracks[0].poses, atol=1e-9)
    np.testing.assert_allclose(shown.tracks[0].rates, expected.tracks[0].rates, atol=1e-9)
    np.testing.assert_allclose(shown.keyframes, expected.keyframes, atol=1e-9)
    assert shown.direction == expected.direction
    letter = player("p", {"spline": sm.interpolants.component_cubic(keys)}, None, "c", up="y")
    sides = np.ptp(letter.body.vertices, axis=0)
    assert sides.argmax() == 1
    assert letter.direction == (1.0, -1.6, 1.3)
    with pytest.raises(sm.InputError, match="player 'p': up 'x' is unknown; there are y, z"):
        player("p", {"spline": sm.interpolants.component_cubic(keys)}, None, "c", up=cast(Any, "x"))
