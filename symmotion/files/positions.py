"""Positions as files have them, on the way to keyframes."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from symmotion.errors import InputError
from symmotion.files.formats import FilePath
from symmotion.motions import Keyframes


class Positions(NamedTuple):
    """What a file says: A (M, d, d), v (M, d), times (M,) if it has them, and what messages call each one's place."""

    linear: np.ndarray
    translation: np.ndarray
    times: np.ndarray | None
    place: Callable[[int], str]

    def keyframes(self, path: FilePath, times: ArrayLike | None) -> Keyframes:
        """The keyframes at `times`, else at those of the file, else at 0, 1, 2, …; InputError names the place."""
        if times is None:
            times = np.arange(len(self.linear)) if self.times is None else self.times
            _require_increasing(path, times, self.place)
        try:
            return Keyframes(times, self.linear, self.translation)
        except InputError as error:
            raise InputError(f"{path}: {error}") from None


def _require_increasing(path: FilePath, times: np.ndarray, place: Callable[[int], str]) -> None:
    wrong = np.diff(times) <= 0
    if times.ndim == 1 and wrong.any():  # Keyframes refuses other shapes
        i = int(np.argmax(wrong))
        how = "repeats" if times[i + 1] == times[i] else "comes before"
        raise InputError(
            f"{path}, {place(i + 1)}: time {times[i + 1]} {how} that of {place(i)}: times must increase; "
            "leave one of them out"
        )
