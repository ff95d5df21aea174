"""Films of motions: GIFs opened by Pillow, whose body is where the motion has it, and what bad requests get."""

import shutil
from typing import Any, cast

import numpy as np
import pytest
from matplotlib.animation import FFMpegWriter
from PIL import Image

import symmotion as sm
from symmotion.errors import InputError
from symmotion.views.films import write_animation
from symmotion.views.spheres import VIEW
from symmotion.whole import whole_file

PLANAR = sm.interpolants.component_cubic(sm.examples.planar_keyframes())
SPATIAL = sm.interpolants.component_cubic(sm.examples.spatial_keyframes())
DISC = 0.4 * np.column_stack([np.cos(np.linspace(0, 6, 40)), np.sin(np.linspace(0, 6, 40))])
BALL = 0.4 * np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]])
FACES = np.array([[a, b, c] for a in (0, 1) for b in (2, 3) for c in (4, 5)])


def frames(path):
    """Each frame as (H, W, 3), and how long it is shown in ms."""
    with Image.open(path) as film:
        for k in range(cast(Any, film).n_frames):
            film.seek(k)
            yield np.asarray(film.convert("RGB")).astype(float), film.info["duration"]


@pytest.mark.parametrize(("motion", "body"), [(PLANAR, DISC), (SPATIAL, (BALL, FACES))], ids=["planar", "spatial"])
def test_the_body_is_where_the_motion_has_it(tmp_path, motion, body):
    write_animation(motion, tmp_path / "m.gif", body, seconds=1.5, fps=10)
    shown, durations = zip(*frames(tmp_path / "m.gif"), strict=True)
    assert sum(durations) == 1500
    centres = []
    for image in shown:
        coloured = np.ptp(image, axis=2) > 60  # the path is grey, the ground white
        centres.append(np.argwhere(coloured).mean(axis=0)[::-1])
    times = np.linspace(*motion.domain, num=len(shown))
    places = motion(times).translation
    places = places if motion.dimension == 2 else places @ VIEW[:, :2]
    # One scale and one shift take the places to the pixels, whose rows count downwards.
    ground = np.column_stack([places.ravel() * np.tile([1, -1], len(places)), np.tile(np.eye(2), (len(places), 1))])
    fit, *_ = np.linalg.lstsq(ground, np.array(centres).ravel())
    np.testing.assert_allclose(ground @ fit, np.array(centres).ravel(), atol=1.5)
    assert fit[0] > 10


@pytest.mark.parametrize(("fps", "duration"), [(30, 30), (60, 20), (300, 20), (7, 140), (0.5, 2000)])
def test_a_gif_lasts_as_long_as_asked_for(tmp_path, fps, duration):
    seconds = max(1.0, 2 / fps)
    write_animation(PLANAR, tmp_path / "m.gif", DISC, seconds=seconds, fps=fps)
    durations = [shown for _, shown in frames(tmp_path / "m.gif")]
    assert set(durations) == {duration}
    assert abs(sum(durations) - 1000 * seconds) <= duration / 2


@pytest.mark.parametrize("body", [None, DISC, [DISC, DISC + 1], np.stack([DISC, DISC + 1])])
def test_planar_bodies(tmp_path, body):
    write_animation(PLANAR, tmp_path / "m.gif", body, seconds=0.3, fps=10)
    first, _ = next(frames(tmp_path / "m.gif"))
    assert first.shape[1] == 480
    assert (np.ptp(first, axis=2) > 60).mean() > 0.001


def test_mp4_where_ffmpeg_is(tmp_path):
    if not FFMpegWriter.isAvailable():
        with pytest.raises(
            InputError, match=r"m\.mp4: mp4 needs the program ffmpeg, which is not installed: install it"
        ):
            write_animation(PLANAR, tmp_path / "m.mp4")
        assert not list(tmp_path.iterdir())
        return
    write_animation(PLANAR, tmp_path / "m.mp4", seconds=0.5)
    assert (tmp_path / "m.mp4").read_bytes()[4:8] == b"ftyp"


def test_a_broken_ffmpeg_leaves_no_file(tmp_path, monkeypatch):
    tools = tmp_path / "tools"
    tools.mkdir()
    shutil.copy(shutil.which("false") or "", tools / "ffmpeg")
    monkeypatch.setenv("PATH", str(tools))
    monkeypatch.setattr(FFMpegWriter, "isAvailable", classmethod(lambda cls: True))
    with pytest.raises(InputError, match=r"m\.mp4: "):
        write_animation(PLANAR, tmp_path / "m.mp4", seconds=0.5)
    assert [p.name for p in tmp_path.iterdir()] == ["tools"]


@pytest.mark.parametrize(
    ("motion", "name", "options", "message"),
    [
        (sm.examples.planar_keyframes(), "m.gif", {}, "a Keyframes is no motion"),
        (PLANAR, "m.avi", {}, "m.avi: format 'avi' is unknown; there are gif, mp4"),
        (PLANAR, "no/m.gif", {}, "no/m.gif: cannot be written"),
        (PLANAR, "m.gif", {"seconds": 0}, "seconds 0: a positive number"),
        (PLANAR, "m.gif", {"fps": np.inf}, "fps inf: a positive number"),
        (PLANAR, "m.gif", {"seconds": 0.05}, "are 1: 2 to 582 can be written"),
        (PLANAR, "m.gif", {"seconds": 1e9}, r"are 2e\+10: 2 to"),
        (PLANAR, "m.gif", {"body": [DISC, DISC[:1]]}, r"outline 1: shape \(1, 2\)"),
        (PLANAR, "m.gif", {"body": np.eye(3)}, r"outline 0: shape \(3, 3\)"),
        (PLANAR, "m.gif", {"body": "disc"}, "outlines are arrays of numbers"),
        (SPATIAL, "m.gif", {"body": DISC}, r"outline 0: shape \(40, 2\); \(P, 3\)"),
    ],
)  # fmt: skip
def test_bad_requests(tmp_path, monkeypatch, motion, name, options, message):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(InputError, match=message):
        write_animation(motion, name, **options)
    assert not list(tmp_path.iterdir())


def test_a_film_replaces_an_older_one_only_when_it_is_whole(tmp_path):
    path = tmp_path / "m.gif"
    with whole_file(path) as handle:
        handle.write("older")
    broken = sm.AffineMotion(sm.splines.BSplineBasis.clamped([0, 1], 1), np.full((2, 2, 2), np.nan))
    with pytest.raises(InputError, match="the motion is not finite"):
        write_animation(broken, path, DISC)
    assert path.read_text() == "older"


def test_the_axis_that_is_upright_is_upright_in_the_film(tmp_path):
    stood = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])
    keys = sm.examples.spatial_keyframes()
    turned = sm.Keyframes(keys.times, stood @ keys.linear, keys.translation @ stood.T)
    sm.write_motion(SPATIAL, tmp_path / "y.gif", body=(BALL, FACES), seconds=0.2, up="y")
    sm.write_motion(sm.interpolants.component_cubic(turned), tmp_path / "z.gif", body=(BALL, FACES), seconds=0.2)
    for (shown, _), (expected, _) in zip(frames(tmp_path / "y.gif"), frames(tmp_path / "z.gif"), strict=True):
        assert np.abs(shown - expected).mean() < 0.5
    with pytest.raises(InputError, match="up 'x' is unknown; there are y, z"):
        sm.write_motion(SPATIAL, tmp_path / "x.gif", up=cast(Any, "x"))
