"""The files that `symmotion design` writes: motions and samples, animated scenes, films."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from symmotion.errors import InputError
from symmotion.files import write_motion
from symmotion.files.formats import FILMS, SCENES, format_of
from symmotion.files.gltf_writing import write_gltf
from symmotion.files.usd import write_usd
from symmotion.files.writing import MOTION_FORMATS
from symmotion.motions import AffineMotion
from symmotion.whole import require_place

TIMED = (*SCENES, *FILMS)
SAMPLED = ("csv", "tum")


def check_outputs(
    paths: Sequence[Path], source: Path, seconds: float | None, rate: float | None, orthonormalise: bool
) -> None:
    """Raise InputError for files that cannot be written, here, and for options that none of them would take.

    source: the file of the keyframes, which stays; seconds, rate: positive.
    """
    endings = [format_of(path, None, (*MOTION_FORMATS, *FILMS)) for path in paths]
    for flag, value, takers in (
        ("--seconds", seconds, TIMED),
        ("--rate", rate, SAMPLED),
        ("--orthonormalise", orthonormalise or None, ("tum",)),
    ):
        if value is not None and not {*takers} & {*endings}:
            raise InputError(f"{flag} goes with {', '.join(f'.{e}' for e in takers)}: leave it out")
        if value is not None and not (np.isfinite(value) and value > 0):
            raise InputError(f"{flag} {value:g}: a positive number is needed")
    for path, ending in zip(paths, endings, strict=True):
        require_place(path)
        if path.exists() and source.exists() and path.samefile(source):
            raise InputError(f"{path}: is the file of the keyframes, which would be lost: name another one")
        if ending in FILMS:
            from symmotion.views.films import SECONDS, plan  # here: Matplotlib takes long to import

            plan(path, SECONDS if seconds is None else seconds)


def write_output(
    motion: AffineMotion, path: Path, rate: float | None, orthonormalise: bool, seconds: float | None
) -> str:
    """Write one file, with those of the options that its format takes; returns what to say of it."""
    ending = format_of(path, None, (*MOTION_FORMATS, *FILMS))
    if ending in SCENES:
        return str((write_gltf if ending == "glb" else write_usd)(motion, path, seconds=seconds))
    if ending in FILMS:
        from symmotion.views.films import SECONDS, write_animation  # here: see check_outputs

        write_animation(motion, path, seconds=SECONDS if seconds is None else seconds)
    else:
        rigid = orthonormalise and ending == "tum"
        write_motion(motion, path, rate=rate if ending in SAMPLED else None, orthonormalise=rigid)
    return str(path)
