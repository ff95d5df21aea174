"""Films in the table of formats, whose writer stands above it."""

from symmotion.bodies import Shape
from symmotion.bodies.places import Oriented
from symmotion.files.formats import FilePath
from symmotion.motions.motion import Moving

# As those of `write_animation`.
SECONDS, FPS = 4.0, 20.0


# Films are imported where one is made: Matplotlib takes long to import.
def write_film(
    motion: Moving | Oriented, path: FilePath, *, body: Shape | None = None, seconds: float = SECONDS, fps: float = FPS
) -> None:
    """Write a film; see `write_animation`."""
    from symmotion.views.films import write_animation

    write_animation(motion, path, body, seconds=seconds, fps=fps)


def check_film(path: FilePath, *, body: object = None, seconds: float = SECONDS, fps: float = FPS) -> None:
    """Raise InputError where there is no way to such a film."""
    from symmotion.views.films import plan

    plan(path, seconds, fps)
