"""Two-parameter motions in and out of JSON and NPZ files."""

import numpy as np

from symmotion.errors import InputError
from symmotion.files.archives import read_arrays
from symmotion.files.documents import entries_of, outline_of, read_list, require_entries
from symmotion.files.formats import FilePath
from symmotion.files.saved import class_saved, load_as
from symmotion.motions.dual import DualQuaternions
from symmotion.motions.two_parameter import Knots, TwoParameterMotion, as_basis
from symmotion.saving import save
from symmotion.splines import BSplineBasis
from symmotion.whole import whole_file

# What makes an archive, or a JSON object of 0.1.0, a two-parameter motion; then its entries, and those of a net.
MARK = {"symmotion": "two-parameter-motion", "version": 1}
MOTION = (("degree", "knots_u", "knots_v", "real"), ("dual",))
NET = (("axis", "angle"), ("translation", "knots_u", "knots_v"))


def read_net_json(path: FilePath) -> TwoParameterMotion:
    """The motion, or net of displacements, of a JSON object; see `read_two_parameter`."""
    if class_saved(outline_of(path)) is not None:
        return load_as(path, TwoParameterMotion, "TwoParameterMotion")
    document = entries_of(path)
    entries = {k: read_list(path, document, k) for k in document if k not in MARK}
    return _made(path, entries, {k: document[k] for k in MARK if k in document})


def read_net_npz(path: FilePath) -> TwoParameterMotion:
    """The motion, or net of displacements, of an archive of arrays; see `read_two_parameter`."""
    return _made(path, *_read_npz(path))


def write_net_json(motion: TwoParameterMotion, path: FilePath) -> None:
    """Write a motion as a JSON object, as its `save` does."""
    save(motion, path)


def write_net_npz(motion: TwoParameterMotion, path: FilePath) -> None:
    """Write a motion as an archive of arrays."""
    with whole_file(path, binary=True) as handle:
        np.savez(handle, **{k: np.array(v) for k, v in MARK.items()}, **_entries(motion), allow_pickle=False)


def is_net_json(path: FilePath) -> bool:
    """Whether a JSON file has the mark of a two-parameter motion, was saved from one, or has what a net needs."""
    document = outline_of(path)
    if class_saved(document) == "TwoParameterMotion":
        return True
    mark = document.get("symmotion")
    return mark == MARK["symmotion"] or (mark is None and set(NET[0]) <= document.keys())


def _entries(motion: TwoParameterMotion) -> dict[str, np.ndarray]:
    entries = {
        "degree": np.array([motion.u.degree, motion.v.degree]),
        "knots_u": motion.u.knots,
        "knots_v": motion.v.knots,
        "real": motion.real,
    }
    return entries if motion.dual is None else entries | {"dual": motion.dual}


def _made(path: FilePath, entries: dict[str, np.ndarray], marks: dict[str, object]) -> TwoParameterMotion:
    if marks and marks != MARK:
        raise InputError(f"{path}: {_shown(marks)}: {_shown(MARK)} is needed for a two-parameter motion")
    require_entries(path, entries, *(MOTION if marks else NET))
    try:
        return _motion(entries) if marks else _net(entries)
    except InputError as error:
        raise InputError(f"{path}: {error}") from None


def _shown(marks: dict[str, object]) -> str:
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


def _read_npz(path: FilePath) -> tuple[dict[str, np.ndarray], dict[str, object]]:
    """The arrays of a file as floats, and its marks."""
    found = read_arrays(path)
    marks = {k: found.pop(k).tolist() for k in MARK if k in found}
    for k, array in found.items():
        if array.dtype.kind not in "fiu" or array.ndim == 0 or not np.isfinite(array).all():
            raise InputError(f"{path}, {k}: an array of finite numbers is needed")
    return {k: array.astype(float) for k, array in found.items()}, marks
