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

TIMED = (*SCENES, *FILMS)


def check_outputs(paths: Sequence[Path], seconds: float | None) -> None:
    """Raise InputError for endings that cannot be written, here, and for seconds that no file would take."""
    endings = [format_of(path, None, (*MOTION_FORMATS, *FILMS)) for path in paths]
    if seconds is not None:
        if not {*TIMED} & {*endings}:
            raise InputError(f"--seconds goes with {', '.join(f'.{e}' for e in TIMED)}: leave it out")
        if not (np.isfinite(seconds) and seconds > 0):
            raise InputError(f"--seconds {seconds:g}: a positive duration is needed")
    for path, ending in zip(paths, endings, strict=True):
        if ending in FILMS:
            from symmotion.report.animation import film_format  # here: Matplotlib takes long to import

            film_format(path)


def write_output(
    motion: AffineMotion, path: Path, rate: float | None, orthonormalise: bool, seconds: float | None
) -> str:
    """Write one file, with those of the options that its format takes; returns what to say of it."""
    ending = format_of(path, None, (*MOTION_FORMATS, *FILMS))
    if ending in SCENES:
        return str((write_gltf if ending == "glb" else write_usd)(motion, path, seconds=seconds))
    if ending in FILMS:
        from symmotion.report.animation import SECONDS, write_animation  # here: see check_outputs

        write_animation(motion, path, seconds=seconds or SECONDS)
    else:
        rigid = orthonormalise and ending == "tum"
        write_motion(motion, path, rate=None if ending == "json" else rate, orthonormalise=rigid)
    return str(path)
