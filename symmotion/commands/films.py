"""The formats that the command line knows: the table, and films beside, whose writer stands above it."""

from typing import Any

from symmotion import checks
from symmotion.files.formats import FilePath, Format, Option
from symmotion.files.table import BODY, FORMATS
from symmotion.motions.motion import Motion


# Films are imported where one is made: Matplotlib takes long to import.
def write_film(motion: Motion, path: FilePath, **options: Any) -> None:  # Any: values of the options below
    """Write a film, with those of the options below that are given; see `write_animation`."""
    from symmotion.views.films import write_animation

    write_animation(motion, path, **options)


def check_film(path: FilePath, *, body: object = None, **options: Any) -> None:  # Any: as above
    """Raise InputError where there is no way to such a film."""
    from symmotion.views.films import plan

    plan(path, **options)


FILM = (
    BODY,
    Option("seconds", "length of the film", float, 4.0, checks.positive),
    Option("fps", "frames per second", float, 20.0, checks.positive),
)
FILMS = (
    Format("gif", ("gif",), "film", "played again and again", write=write_film, writing=FILM, check=check_film),
    Format("mp4", ("mp4",), "film", "takes the program ffmpeg", write=write_film, writing=FILM, check=check_film),
)
ALL_FORMATS = (*FORMATS, *FILMS)
