"""Camera positions as reconstruction programs write them: COLMAP, nerfstudio, Open3D."""

from array import array
from collections.abc import Callable
from math import isfinite

import numpy as np
from numpy.typing import ArrayLike

from symmotion.errors import InputError
from symmotion.files.documents import entries_of, outline_of, stacked
from symmotion.files.formats import FilePath
from symmotion.files.poses import AFFINE_TOLERANCE, NORM_TOLERANCE
from symmotion.files.positions import Positions
from symmotion.files.recording import Recording
from symmotion.files.tables import beginning, number
from symmotion.opening import readable

COLMAP = ("IMAGE_ID", "QW", "QX", "QY", "QZ", "TX", "TY", "TZ", "CAMERA_ID", "NAME")


def is_colmap(path: FilePath) -> bool:
    """Whether a text has the comments of COLMAP's images.txt at its beginning."""
    with readable(path) as handle:
        words = [line.lstrip("# ").replace(",", " ").split() for line in beginning(handle, 20) if line.startswith("#")]
    return any(tuple(line[:5]) == COLMAP[:5] for line in words)


def read_colmap(path: FilePath, *, times: ArrayLike | None = None) -> Recording:
    """Where the cameras of COLMAP's images.txt are in the world, in the order of the images' names, at 0, 1, 2, ….

    The file has the world in the camera's frame, x_c = R x + t: the camera is turned by Rᵀ at −Rᵀ t.
    """
    from scipy.spatial.transform import Rotation  # here: see as_rotations

    rows: list[tuple[str, int, list[float]]] = []
    with readable(path) as handle:
        lines = ((n, text) for n, text in enumerate(handle, 1) if not text.startswith("#"))
        for line, text in lines:
            if not text.strip():
                continue
            fields = text.split(maxsplit=9)
            if len(fields) != 10:
                raise InputError(f"{path}, line {line}: {len(fields)} columns, not 10: {', '.join(COLMAP)} are needed")
            rows.append((fields[9].strip(), line, _numbers(path, line, fields[1:8])))
            next(lines, None)  # the image's points, which may be none
    if not rows:
        raise InputError(f"{path}: holds no images")
    rows.sort()
    values = np.array([row[2] for row in rows])
    norms = np.linalg.norm(values[:, :4], axis=1)
    if (wrong := ~(np.abs(norms - 1) <= NORM_TOLERANCE)).any():
        i = int(np.argmax(wrong))
        raise InputError(f"{path}, line {rows[i][1]}: a quaternion of norm {norms[i]:.6g}: unit quaternions are needed")
    turned = Rotation.from_quat(values[:, [1, 2, 3, 0]]).inv()
    notes = ("images in the order of their names, cameras in the world",)
    places = -turned.apply(values[:, 4:])
    found = Positions(turned.as_matrix(), places, None, lambda i: f"line {rows[i][1]}", notes)
    return found.recording(path, times)


def is_transforms(path: FilePath) -> bool:
    """Whether a JSON file has frames with matrices."""
    return "frames" in outline_of(path)


def read_transforms(path: FilePath, *, times: ArrayLike | None = None) -> Recording:
    """The cameras of a nerfstudio transforms.json, in the order of its frames, at their `time` or at 0, 1, 2, …."""
    frames = entries_of(path)["frames"]
    if not isinstance(frames, list) or not frames or not all(isinstance(frame, dict) for frame in frames):
        raise InputError(f"{path}, frames: a list of objects is needed")

    def place(i: int) -> str:
        return f"{path}, frames[{i}].transform_matrix"

    whole = stacked([frame.get("transform_matrix") for frame in frames], place)
    if whole.shape[1:] not in ((3, 4), (4, 4)):
        raise InputError(f"{place(0)}: 4 × 4 finite numbers are needed")
    _require_homogeneous(whole, place)
    stamps = [frame.get("time") for frame in frames]
    own = np.array(stamps) if all(isinstance(t, float) and isfinite(t) for t in stamps) else None
    return Positions(whole[:, :3, :3], whole[:, :3, 3], own, "frames[{}]".format).recording(path, times)


def read_log(path: FilePath, *, times: ArrayLike | None = None) -> Recording:
    """The cameras of an Open3D trajectory (.log), at 0, 1, 2, …: a line of three numbers, then a 4 × 4 matrix each."""
    rows, places, ends = array("d"), array("q"), array("q")
    with readable(path) as handle:
        lines = ((n, text.split()) for n, text in enumerate(handle, 1) if text.strip() and not text.startswith("#"))
        for line, head in lines:
            if len(head) != 3:
                raise InputError(f"{path}, line {line}: {len(head)} numbers where the 3 above a matrix are needed")
            _numbers(path, line, head)
            at = line
            for _ in range(4):
                at, words = next(lines, (line, None))
                if words is None:
                    raise InputError(f"{path}, line {line}: the file ends within the matrix that begins here")
                if len(words) != 4:
                    raise InputError(f"{path}, line {at}: {len(words)} numbers in a row of a matrix, not 4")
                rows.extend(_numbers(path, at, words))
            places.append(line)
            ends.append(at)
    if not places:
        raise InputError(f"{path}: holds no keyframes")
    whole = np.frombuffer(rows).reshape(-1, 4, 4)
    _require_homogeneous(whole, lambda i: f"{path}, line {ends[i]}")
    return Positions(whole[:, :3, :3], whole[:, :3, 3], None, lambda i: f"line {places[i]}").recording(path, times)


def _numbers(path: FilePath, line: int, words: list[str]) -> list[float]:
    try:
        return [number(word) for word in words]
    except InputError as error:
        raise InputError(f"{path}, line {line}: {error}") from None


def _require_homogeneous(matrices: np.ndarray, place: Callable[[int], str]) -> None:
    """Raise InputError that names the first matrix (N, 3 or 4, 4) whose fourth row is not 0 0 0 1."""
    wrong = (np.abs(matrices[:, 3:] - np.eye(4)[3]) > AFFINE_TOLERANCE).any(axis=(1, 2))
    if wrong.any():
        raise InputError(f"{place(int(np.argmax(wrong)))}: the last row of the matrix is not 0 0 0 1")
