"""The operations that a prim of USD is placed by (xformOps), between their time samples too."""

from typing import NamedTuple

import numpy as np

from symmotion.errors import InputError
from symmotion.files.formats import FilePath
from symmotion.motions import Affine
from symmotion.motions.interpolants import slerp

AXES = "XYZ"
INVERT, RESET = "!invert!", "!resetXformStack!"
# How many numbers a value of an operation has.
WIDTHS = {"translate": 3, "scale": 3, "orient": 4, "transform": 16}
WIDTHS |= {f"{what}{axis}": 1 for what in ("translate", "scale", "rotate") for axis in AXES}
WIDTHS |= {f"rotate{order}": 3 for order in ("XYZ", "XZY", "YXZ", "YZX", "ZXY", "ZYX")}


class Samples(NamedTuple):
    """Values (K, c) at time codes (K,) increasing, of one that does not move (1, c) at none."""

    codes: np.ndarray
    values: np.ndarray


class Operation(NamedTuple):
    """One of a prim's operations: kind, as translate or rotateXYZ, and whether its inverse is meant."""

    kind: str
    samples: Samples
    inverted: bool = False

    def __call__(self, codes: np.ndarray) -> Affine:
        """Its positions at time codes (N,); InputError, without the place, where an inverse does not exist."""
        values = _between(self.samples, codes, self.kind == "orient")
        found = _placed(self.kind, values)
        return found.inverse() if self.inverted else found


def kind_of(name: str) -> str | None:
    """The kind of an operation by its attribute's name, as xformOp:translate:pivot; None for what is none."""
    words = name.removeprefix(INVERT).split(":")
    return words[1] if words[0] == "xformOp" and len(words) > 1 and words[1] in WIDTHS else None


def composed(operations: list[Operation], codes: np.ndarray) -> Affine:
    """The operations of a prim in their order, of which the last is applied to the body first."""
    found = Affine(np.broadcast_to(np.eye(3), (len(codes), 3, 3)), np.zeros((len(codes), 3)))
    for operation in operations:
        found = found @ operation(codes)
    return found


def local(path: FilePath, prim: str, operations: list[Operation], codes: np.ndarray) -> Affine:
    """Those of the prim of a file, which errors name."""
    try:
        return composed(operations, codes)
    except InputError as error:
        raise InputError(f"{path}, prim {prim}: {error}") from None


def _between(samples: Samples, codes: np.ndarray, turning: bool) -> np.ndarray:
    """(N, c) linear between samples, slerps of quaternions; the first and the last are held."""
    at, values = samples
    if len(values) == 1:
        return np.repeat(values, len(codes), axis=0)
    if not turning:
        return np.stack([np.interp(codes, at, column) for column in values.T], axis=1)
    k = np.clip(np.searchsorted(at, codes, side="right") - 1, 0, len(at) - 2)
    share = np.clip((codes - at[k]) / (at[k + 1] - at[k]), 0, 1)
    before, behind = values[k], values[k + 1]
    behind = behind * np.where(np.sum(before * behind, axis=1) < 0, -1.0, 1.0)[:, None]
    return slerp(before, behind, share)


def _placed(kind: str, values: np.ndarray) -> Affine:
    """Positions (N,) of an operation's values (N, c)."""
    from scipy.spatial.transform import Rotation  # here: see as_rotations

    count = len(values)
    linear, translation = np.tile(np.eye(3), (count, 1, 1)), np.zeros((count, 3))
    if kind == "transform":  # vectors of USD are rows
        matrices = np.swapaxes(values.reshape(count, 4, 4), 1, 2)
        if (matrices[:, 3] != (0, 0, 0, 1)).any():
            raise InputError("a matrix is projective: its last column must be 0, 0, 0, 1")
        return Affine(matrices[:, :3, :3], matrices[:, :3, 3])
    if kind == "orient":
        return Affine(Rotation.from_quat(values, scalar_first=True).as_matrix(), translation)
    what, axes = kind.rstrip(AXES), kind[len(kind.rstrip(AXES)) :]
    if what == "rotate":
        angles = values if len(axes) == 1 else values[:, [AXES.index(axis) for axis in axes]]
        return Affine(
            Rotation.from_euler(axes.lower(), angles, degrees=True).as_matrix().reshape(-1, 3, 3), translation
        )
    which = [AXES.index(axis) for axis in axes or AXES]
    if what == "translate":
        translation[:, which] = values
    else:
        linear[:, which, which] = values
    return Affine(linear, translation)
