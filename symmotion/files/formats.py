"""The file formats and the names of their columns and entries."""

import os
from collections.abc import Sequence
from pathlib import Path

from symmotion.errors import InputError

FilePath = str | os.PathLike[str]

FORMATS = ("tum", "kitti", "csv", "json")
# What other tools animate: keyframes are read from the first group, motions written as the second and the third.
ANIMATIONS = ("bvh", "glb", "gltf")
SCENES = ("glb", "usda")
FILMS = ("gif", "mp4")

TIMES = (("t",), ("time",), ("timestamp",))
TRANSLATIONS = (("x", "y", "z"), ("tx", "ty", "tz"), ("v1", "v2", "v3"))
QUATERNION = ("qx", "qy", "qz", "qw")
ANGLE = ("theta",)
MATRICES = {d: tuple(f"a{i}{j}" for i in range(1, d + 1) for j in range(1, d + 1)) for d in (2, 3)}

TUM = ("t", "tx", "ty", "tz", *QUATERNION)
KITTI = ("a11", "a12", "a13", "v1", "a21", "a22", "a23", "v2", "a31", "a32", "a33", "v3")

# What makes a JSON file a motion, and the entries that it holds beside.
MOTION = {"symmotion": "affine-motion", "version": 1}
MOTION_ENTRIES = ("degree", "periodic", "knots", "linear", "translation")


def format_of(path: FilePath, format: str | None, formats: Sequence[str]) -> str:
    """The format given, else the one that the ending of `path` names; InputError unless it is one of `formats`."""
    chosen = Path(path).suffix.lower().removeprefix(".") if format is None else format
    if chosen not in formats:
        raise InputError(f"{path}: format {chosen!r} is unknown; there are {', '.join(formats)}")
    return chosen
