"""Positions as files have them, on the way to keyframes."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from symmotion.errors import InputError
from symmotion.files.formats import FilePath
from symmotion.files.recording import Recording, apart
from symmotion.motions import Keyframes, polar_factors

Repeated = Literal["error", "drop", "merge"]
RIGID = 1e-6


@dataclass(frozen=True, eq=False)
class Positions:
    """What a file says: A (M, d, d), v (M, d), times (M,) if it has them, what messages call the places, notes."""

    linear: np.ndarray
    translation: np.ndarray
    times: np.ndarray | None
    place: Callable[[int], str]
    notes: tuple[str, ...] = ()

    def keyframes(self, path: FilePath, times: ArrayLike | None) -> Keyframes:
        """The keyframes at `times`, else at those of the file, else at 0, 1, 2, …; InputError names the place."""
        return self.recording(path, times).keyframes

    def recording(self, path: FilePath, times: ArrayLike | None, repeated: Repeated | None = None) -> Recording:
        """The keyframes with the notes, repeated and crowded times dropped or merged where that is asked for."""
        found = self
        if times is None:
            if repeated in ("drop", "merge") and found.times is not None:
                found = found._apart(path, repeated)
            if found.times is not None:
                _require_increasing(path, found.times, found.place)
            times = np.arange(len(found.linear), dtype=float) if found.times is None else found.times
        try:
            return Recording(Keyframes(times, found.linear, found.translation), found.notes)
        except InputError as error:
            raise InputError(f"{path}: {error}") from None

    def _apart(self, path: FilePath, repeated: Repeated) -> "Positions":
        assert self.times is not None
        _require_increasing(path, self.times, self.place, repeats=True)
        crowds = apart(self.times, repeated)
        first = np.array([crowd[0] for crowd in crowds])
        if len(first) == len(self.times) and all(len(crowd) == 1 for crowd in crowds):
            return self
        counts = np.array([len(crowd) for crowd in crowds])[:, None]
        word = "merged" if repeated == "merge" else "dropped"
        note = f"{len(self.times) - len(first)} rows whose times repeat or crowd are {word}"
        if repeated == "drop":
            linear, translation, times = self.linear[first], self.translation[first], self.times[first]
        else:
            linear = np.add.reduceat(self.linear, first) / counts[..., None]
            translation = np.add.reduceat(self.translation, first) / counts
            # Of differences: sums of large stamps would lose digits.
            shift = np.add.reduceat(self.times - np.repeat(self.times[first], counts[:, 0]), first)
            times = self.times[first] + shift / counts[:, 0]
            eye = np.eye(linear.shape[-1])
            if np.abs(self.linear @ np.swapaxes(self.linear, 1, 2) - eye).max() < RIGID:
                several = counts[:, 0] > 1
                linear[several] = polar_factors(linear[several])[0]
        return replace(
            self,
            linear=linear,
            translation=translation,
            times=times,
            place=lambda i: self.place(int(first[i])),
            notes=(*self.notes, note),
        )


def _require_increasing(path: FilePath, times: np.ndarray, place: Callable[[int], str], repeats: bool = False) -> None:
    wrong = np.diff(times) < 0 if repeats else np.diff(times) <= 0
    if times.ndim == 1 and wrong.any():  # Keyframes refuses other shapes
        i = int(np.argmax(wrong))
        same = times[i + 1] == times[i]
        how = "repeats" if same else "comes before"
        remedy = "leave one of them out, as repeated='drop' and repeated='merge' do" if same else "sort the rows"
        raise InputError(
            f"{path}, {place(i + 1)}: time {times[i + 1]} {how} that of {place(i)}: times must increase; {remedy}"
        )
