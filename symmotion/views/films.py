"""Motions as short films: animated GIF, and MP4 where ffmpeg is installed."""

from collections.abc import Callable, Sequence
from pathlib import Path
from subprocess import CalledProcessError
from typing import NamedTuple

import numpy as np
from matplotlib.animation import AbstractMovieWriter, FFMpegWriter, PillowWriter
from matplotlib.collections import PolyCollection
from matplotlib.typing import ColorType

from symmotion.bodies import Body, Shape
from symmotion.bodies.places import Oriented, dimension_of, fitting_body, placed
from symmotion.bodies.shapes import Up
from symmotion.errors import InputError
from symmotion.files.formats import FilePath, format_of
from symmotion.motions.motion import Moving
from symmotion.views.parallel import lit, upright_view
from symmotion.views.style import COLOURS, INK, new_figure
from symmotion.whole import whole_files

FILMS = ("gif", "mp4")
SECONDS = 4.0
FPS = 20.0
SHORTEST = 2  # hundredths of a second that a frame of a GIF is shown
DPI = 100
WIDTH = 480  # pixels; height follows from the motion
HEIGHTS = (240, 640)
# A GIF is put together in memory, 3 bytes a pixel.
MOST_BYTES = 512 * 2**20

# From a time to polygons on the picture, back to front, and their colours.
Picture = Callable[[float], tuple[list[np.ndarray], Sequence[ColorType]]]


def write_animation(
    motion: Moving | Oriented,
    path: FilePath,
    body: Shape | None = None,
    *,
    seconds: float = SECONDS,
    fps: float = FPS,
    up: Up = "z",
) -> None:
    """Write a film of a moving body: .gif, played again and again, or .mp4, which takes the program ffmpeg.

    body: of any form that `Body.of` takes; a letter F when left out. Spatial motions are seen from
    (2, −3, 1.6), z upwards, without perspective; with up "y", as files of BVH and glTF have it, from (2, 1.6, 3)
    with y upwards. The thin line is the path of the body's origin.
    seconds: the film's length, whatever the motion's; fps: frames per second, in a GIF at most 50
    and rounded so that a frame lasts whole hundredths of a second.

    Raises InputError for bad bodies, lengths and rates, films too large to be put together, mp4
    where ffmpeg is missing, and a path that cannot be written.

    >>> motion = sm.interpolants.component_cubic(sm.examples.planar_keyframes())
    >>> sm.views.write_animation(motion, "motion.gif", seconds=0.2)
    """
    _, frames, writer = plan(path, seconds, fps)
    view = upright_view(up)
    motion = placed(motion)
    d = dimension_of(motion)
    picture = _moving(motion, fitting_body(body, motion, dimension=d, up=up), view)
    origin = motion(np.linspace(*motion.domain, 300)).translation
    seen = origin if d == 2 else origin @ view[:, :2]
    t = np.linspace(*motion.domain, frames)
    with whole_files(path) as film:
        try:
            _film(writer, film, picture, seen, t)
        except CalledProcessError as error:
            raise InputError(f"{path}: ffmpeg failed ({error}): write .gif, or mend ffmpeg") from None


class Plan(NamedTuple):
    """How a film is made: gif or mp4, how many frames, and what writes them."""

    format: str
    frames: int
    writer: AbstractMovieWriter


def plan(path: FilePath, seconds: float = SECONDS, fps: float = FPS) -> Plan:
    """The way to the film that `write_animation` is asked for; InputError where there is none."""
    chosen = format_of(path, None, FILMS)
    if chosen == "mp4" and not FFMpegWriter.isAvailable():
        raise InputError(f"{path}: mp4 needs the program ffmpeg, which is not installed: install it, or write .gif")
    for name, value in (("seconds", seconds), ("fps", fps)):
        if not (np.isfinite(value) and value > 0):
            raise InputError(f"{name} {value!r}: a positive number is needed")
    # Players slow frames of less than two hundredths down.
    hundredths = max(SHORTEST, round(100 / max(fps, 1e-6)))
    shown = fps if chosen == "mp4" else 100 / hundredths
    most = MOST_BYTES // (3 * WIDTH * HEIGHTS[1])
    if not 1.5 <= seconds * shown <= most:
        raise InputError(
            f"{path}: {seconds:g} seconds of {shown:.3g} frames are {seconds * shown:.3g}: 2 to {most} can be written; "
            "choose another length or rate"
        )
    # Pillow's writer cuts milliseconds off to whole ones: half a millisecond more keeps rounding from losing one.
    writer = FFMpegWriter(fps=fps) if chosen == "mp4" else PillowWriter(fps=1000 / (10 * hundredths + 0.5))  # pyright: ignore[reportArgumentType]
    return Plan(chosen, round(seconds * shown), writer)


def _film(writer: AbstractMovieWriter, film: Path, picture: Picture, path: np.ndarray, t: np.ndarray) -> None:
    shown = [path, *(np.concatenate(picture(now)[0]) for now in t)]
    low, high = np.min([s.min(axis=0) for s in shown], axis=0), np.max([s.max(axis=0) for s in shown], axis=0)
    if not np.isfinite([low, high]).all():
        raise InputError("the motion is not finite")
    sides = np.maximum(high - low, 1e-3 * (high - low).max())
    # Films have even numbers of pixels.
    height = 2 * round(np.clip(WIDTH * sides[1] / sides[0], *HEIGHTS) / 2)
    with new_figure(WIDTH / DPI, height / DPI) as figure:
        figure.set_layout_engine("none")
        figure.set_facecolor("white")
        axes = figure.add_axes((0.03, 0.03, 0.94, 0.94))
        axes.plot(*path.T, color=INK, linewidth=0.8, alpha=0.5)
        polygons, colours = picture(t[0])
        drawn = PolyCollection(polygons, facecolors=colours, edgecolors="face", linewidths=0.4, zorder=3)
        axes.add_collection(drawn)
        axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]))
        axes.set_aspect("equal")
        axes.set_axis_off()
        with writer.saving(figure, str(film), DPI):
            for now in t:
                polygons, colours = picture(now)
                drawn.set_verts(polygons)
                drawn.set_facecolor(colours)
                writer.grab_frame()


def _moving(motion: Moving, body: Body, view: np.ndarray) -> Picture:
    """The faces of a body at a time, in space from back to front, shaded."""
    if body.dimension == 2:
        return lambda t: (body.polygons(motion(t)(body.vertices)), [COLOURS[0]])
    shades = _shades(body)

    def picture(t: float) -> tuple[list[np.ndarray], Sequence[ColorType]]:
        faces = body.polygons(motion(t)(body.vertices) @ view)
        order = np.argsort([face[:, 2].mean() for face in faces], kind="stable")
        colours = shades * (0.55 + 0.45 * lit(faces)[:, None])
        return [faces[k][:, :2] for k in order], colours[order].tolist()

    return picture


def _shades(body: Body) -> np.ndarray:
    """(F, 3) the colours of faces."""
    # The body has linear colours, a picture those of sRGB.
    shades = body.shown_colours ** (1 / 2.2)
    return np.array([shades[list(face)].mean(axis=0) for face in body.faces])
