"""The formats that the command line knows: the table, and films beside, whose writer stands above it."""

from typing import TypedDict, Unpack

from symmotion import checks
from symmotion.bodies import Shape
from symmotion.files.formats import FilePath, Format, Option
from symmotion.files.table import BODY, FORMATS
from symmotion.motions.motion import Motion

# As those of `write_animation`.
SECONDS, FPS = 4.0, 20.0


class FilmOptions(TypedDict, total=False):
    """What a film is told, see `FILM`."""

    body: Shape
    seconds: float
    fps: float


# Films are imported where one is made: Matplotlib takes long to import.
def write_film(motion: Motion, path: FilePath, **options: Unpack[FilmOptions]) -> None:
    """Write a film, with those of the options below that are given; see `write_animation`."""
    from symmotion.views.films import write_animation

    write_animation(motion, path, **options)


def check_film(path: FilePath, *, body: object = None, seconds: float = SECONDS, fps: float = FPS) -> None:
    """Raise InputError where there is no way to such a film."""
    from symmotion.views.films import plan

    plan(path, seconds, fps)


FILM = (
    BODY,
    Option("seconds", "length of the film", float, SECONDS, checks.positive),
    Option("fps", "frames per second", float, FPS, checks.positive),
)
FILMS = (
    Format("gif", ("gif",), "film", "played again and again", write=write_film, writing=FILM, check=check_film),
    Format("mp4", ("mp4",), "film", "takes the program ffmpeg", write=write_film, writing=FILM, check=check_film),
)
ALL_FORMATS = (*FORMATS, *FILMS)
