"""Keyframes as JSON objects of arrays."""

import numpy as np
from numpy.typing import ArrayLike

from symmotion.files.documents import entries_of, outline_of, read_list, require_entries, write_object
from symmotion.files.formats import FilePath
from symmotion.files.positions import Positions
from symmotion.motions import Keyframes


def read_keyframes_json(path: FilePath, *, times: ArrayLike | None = None) -> Keyframes:
    """Keyframes of an object with `linear` (M, d, d) and optionally `times` (M,) and `translation` (M, d)."""
    document = entries_of(path)
    require_entries(path, document, ["linear"], ["times", "translation"])
    linear = read_list(path, document, "linear")
    own = read_list(path, document, "times") if "times" in document else None
    translation = read_list(path, document, "translation") if "translation" in document else np.zeros(linear.shape[:-1])
    return Positions(linear, translation, own, "times[{}]".format).keyframes(path, times)


def write_keyframes_json(keyframes: Keyframes, path: FilePath) -> None:
    """Write keyframes exactly."""
    entries = {"times": keyframes.times, "linear": keyframes.linear, "translation": keyframes.translation}
    write_object(path, entries)


def is_keyframes_json(path: FilePath) -> bool:
    """Whether a JSON file has linear parts, and no mark of another kind."""
    document = outline_of(path)
    return "linear" in document and "symmotion" not in document
