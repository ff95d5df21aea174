"""Two-parameter motions in and out of JSON and NPZ files."""

import json
import zipfile
from typing import Any

import numpy as np

from symmotion.errors import InputError
from symmotion.files.documents import read_list, read_object, require_entries
from symmotion.files.formats import FilePath, format_of
from symmotion.files.opening import readable
from symmotion.motions.dual import DualQuaternions
from symmotion.motions.two_parameter import Knots, TwoParameterMotion, as_basis
from symmotion.splines import BSplineBasis
from symmotion.whole import whole_file

FORMATS = ("json", "npz")
# What makes a file a two-parameter motion; then its entries, and those of a net of control displacements.
MARK = {"symmotion": "two-parameter-motion", "version": 1}
MOTION = (("degree", "knots_u", "knots_v", "real"), ("dual",))
NET = (("axis", "angle"), ("translation", "knots_u", "knots_v"))


def write_two_parameter(motion: TwoParameterMotion, path: FilePath) -> None:
    """Write a two-parameter motion exactly, for `read_two_parameter`: .json or .npz.

    Entries: degree (2,), knots_u, knots_v, real (n, m, 4) and for a spatial motion dual
    (n, m, 4), scalar-first. The file appears whole or not at all.
    """
    chosen = format_of(path, None, FORMATS)
    entries: dict[str, Any] = {
        "degree": np.array([motion.u.degree, motion.v.degree]),
        "knots_u": motion.u.knots,
        "knots_v": motion.v.knots,
        "real": motion.real,
    }
    if motion.dual is not None:
        entries["dual"] = motion.dual
    if chosen == "json":
        with whole_file(path) as handle:
            handle.write(json.dumps(MARK | entries, default=np.ndarray.tolist) + "\n")
    else:
        with whole_file(path, binary=True) as handle:
            np.savez(handle, **{k: np.array(v) for k, v in MARK.items()}, **entries)


def read_two_parameter(path: FilePath) -> TwoParameterMotion:
    """A two-parameter motion from a .json or .npz file of at most 512 MB: one written by us, or a net of displacements.

    A net has the entries axis (n, m, 3), angle (n, m) in rad and optionally translation
    (n, m, 3), knots_u (n + 4,) and knots_v (m + 4,), uniform of distance 1 when left out: the
    control data of PCG table 1. Its quaternions are put in one hemisphere; those of a motion are
    taken as they are.

    Raises InputError that names the file and the entry at fault.
    """
    if format_of(path, None, FORMATS) == "json":
        with readable(path) as handle:
            document = read_object(path, handle)
            entries = {k: read_list(path, document, k) for k in document if k not in MARK}
            marks = {k: document[k] for k in MARK if k in document}
    else:
        entries, marks = _read_npz(path)
    if marks and marks != MARK:
        raise InputError(f"{path}: {_shown(marks)}: {_shown(MARK)} is needed for a two-parameter motion")
    require_entries(path, entries, *(MOTION if marks else NET))
    try:
        return _motion(entries) if marks else _net(entries)
    except InputError as error:
        raise InputError(f"{path}: {error}") from None


def _shown(marks: dict[str, Any]) -> str:
    return ", ".join(f"{k} {v!r:.40}" for k, v in marks.items())


def _motion(entries: dict[str, np.ndarray]) -> TwoParameterMotion:
    degree = entries["degree"]
    if degree.shape != (2,) or (degree != np.floor(degree)).any() or (degree < 0).any():
        raise InputError("degree: two whole numbers, 0 or more, are needed")
    u, v = (BSplineBasis(entries[f"knots_{x}"], int(p)) for x, p in zip("uv", degree, strict=True))
    return TwoParameterMotion(u, v, entries["real"], entries.get("dual"))


def _net(entries: dict[str, np.ndarray]) -> TwoParameterMotion:
    net = DualQuaternions.from_axis_angle(entries["axis"], entries["angle"], entries.get("translation"))
    if len(net.shape) != 2:
        raise InputError(f"angles of shape {net.shape}: a net (n, m) is needed")
    given = [entries.get(f"knots_{x}") for x in "uv"]
    bases: list[Knots] = ["uniform" if k is None else BSplineBasis(k, 3) for k in given]
    u, v = (as_basis(b, n, 3, x) for b, n, x in zip(bases, net.shape, "uv", strict=True))
    return TwoParameterMotion.from_displacements(net, u, v, spherical="translation" not in entries)


def _read_npz(path: FilePath) -> tuple[dict[str, np.ndarray], dict[str, Any]]:
    """The arrays of a file as floats, and its marks."""
    with readable(path, binary=True) as handle:
        try:
            with np.load(handle, allow_pickle=False) as arrays:
                found = {k: arrays[k] for k in arrays.files}
        except (ValueError, OSError, EOFError, zipfile.BadZipFile, TypeError) as error:
            raise InputError(f"{path}: is no NPZ file of arrays of numbers ({error})") from None
    marks = {k: found.pop(k).tolist() for k in MARK if k in found}
    for k, array in found.items():
        if array.dtype.kind not in "fiu" or array.ndim == 0 or not np.isfinite(array).all():
            raise InputError(f"{path}, {k}: an array of finite numbers is needed")
    return {k: array.astype(float) for k, array in found.items()}, marks
