"""Motions and curves out of JSON: the half that reads what `save` wrote, by one table of what there is."""

import os
from collections.abc import Mapping
from typing import TypeAlias, get_args

import numpy as np

from symmotion.curves import ArcParameter, RationalQuadratic, Retimed
from symmotion.documents import read_document
from symmotion.errors import InputError
from symmotion.motions import (
    AffineMotion,
    CurveMotion,
    Keyframes,
    PointPath,
    PoseMotion,
    RationalMotion,
    RelativeMotion,
    RetimedMotion,
    SequentialMotion,
    TwoParameterMotion,
)
from symmotion.motions.interpolants.blends import Exponential, Interpolant, PlanarTurns, Polar, SpatialTurns, Steady
from symmotion.motions.interpolants.slerps import SegmentCurve, SlerpPyramid, Slerps, Squads
from symmotion.motions.quaternions import ProductMotion, QuaternionMotion
from symmotion.opening import readable_bytes
from symmotion.saving import MARK, TOLD
from symmotion.splines import BSplineBasis, CumulativeBasis, Spline

SavedMotion: TypeAlias = (
    AffineMotion
    | PoseMotion
    | QuaternionMotion
    | ProductMotion
    | RationalMotion
    | CurveMotion
    | Interpolant
    | SegmentCurve
    | RetimedMotion
    | SequentialMotion
    | RelativeMotion
)
Saved: TypeAlias = Spline | RationalQuadratic | Retimed | SavedMotion | PointPath | TwoParameterMotion | Keyframes

NONE = type(None)
CURVES = (Spline, RationalQuadratic, Retimed, PointPath)
MOTIONS: tuple[type[SavedMotion], ...] = get_args(SavedMotion)
TURNS = (Steady, PlanarTurns, SpatialTurns)

# What can be in a file: the class, and what each of its fields may be.
CLASSES: dict[type, dict[str, tuple[type, ...]]] = {
    BSplineBasis: {"knots": (np.ndarray,), "degree": (int,), "periodic": (bool,), "origin": (float,)},
    Spline: {"basis": (BSplineBasis,), "control_points": (np.ndarray,)},
    RationalQuadratic: {"control_points": (np.ndarray,), "weight": (float,), "domain": (np.ndarray,)},
    ArcParameter: {"curve": CURVES, "domain": (np.ndarray,)},
    Retimed: {"curve": CURVES, "warp": (Spline, ArcParameter)},
    Keyframes: {"times": (np.ndarray,), "linear": (np.ndarray,), "translation": (np.ndarray,)},
    AffineMotion: {"basis": (BSplineBasis,), "linear": (np.ndarray,), "translation": (np.ndarray,)},
    QuaternionMotion: {"basis": (BSplineBasis,), "control_points": (np.ndarray,), "increments": (np.ndarray,)},
    PoseMotion: {"orientation": (QuaternionMotion, ProductMotion), "translation": (Spline,)},
    RationalMotion: {"basis": (BSplineBasis,), "real": (np.ndarray,), "dual": (np.ndarray, NONE)},
    TwoParameterMotion: {
        "u": (BSplineBasis,),
        "v": (BSplineBasis,),
        "real": (np.ndarray,),
        "dual": (np.ndarray, NONE),
    },
    CurveMotion: {"surface": (TwoParameterMotion,), "curve": (Spline,)},
    RetimedMotion: {"motion": MOTIONS, "warp": (Spline, ArcParameter)},
    SequentialMotion: {"motions": (tuple, *MOTIONS)},
    RelativeMotion: {"motion": MOTIONS, "reference": MOTIONS},
    PointPath: {"motion": MOTIONS, "point": (np.ndarray,)},
    Steady: {"times": (np.ndarray,), "matrices": (np.ndarray,), "logs": (np.ndarray,)},
    Exponential: {"generator": (Spline,)},
    PlanarTurns: {"angle": (Spline,)},
    SpatialTurns: {"times": (np.ndarray,), "rotations": (np.ndarray,)},
    Polar: {"turning": TURNS, "sizes": (Spline,), "path": (Spline,)},
    Interpolant: {
        "name": (str,),
        "keyframes": (Keyframes,),
        "series": (Exponential, Steady, Polar),
        "highest": (int, NONE),
    },
    Slerps: {"quaternions": (np.ndarray,)},
    SlerpPyramid: {"controls": (np.ndarray,), "intervals": (np.ndarray,)},
    Squads: {"outer": (Slerps,), "inner": (SlerpPyramid,)},
    SegmentCurve: {"times": (np.ndarray,), "segment": (Slerps, Squads, SlerpPyramid)},
    CumulativeBasis: {"basis": (BSplineBasis,), "first": (np.ndarray,), "weights": (np.ndarray,)},
    ProductMotion: {
        "functions": (CumulativeBasis,),
        "start": (np.ndarray,),
        "increments": (np.ndarray,),
        "frame": (str,),
    },
}
# Fields that files of version 0.1.0 lack.
LATER: dict[type, dict[str, object]] = {BSplineBasis: {"origin": 0.0}}
NAMES = {cls.__name__: cls for cls in CLASSES}
WORDS = {np.ndarray: "numbers", int: "a whole number", float: "a number", bool: "true or false", str: "a text"}


def load(path: str | os.PathLike[str]) -> Saved:
    """The motion or curve that was saved: equal to it, bit for bit.

    It reads what `save` of a motion or curve wrote, which the JSON of `write_motion` and
    `write_two_parameter` is too, and what these wrote in 0.1.0. Nothing in a file is executed.
    Raises InputError that names the file and the entry at fault.

    path: of the file.

    >>> motion = sm.interpolants.component_cubic(sm.examples.planar_keyframes())
    >>> motion.save("motion.json")
    >>> sm.load("motion.json") == motion
    True
    """
    with readable_bytes(path) as handle:
        document = read_document(path, handle.read(), whole=int)
    mark = {name: document.pop(name, None) for name in MARK}
    document.pop(TOLD, None)
    if mark != MARK:
        document = _older(path, mark, document)
    made = _made(document, f"{path}", f"{path}: ")
    if not isinstance(made, Saved):
        raise InputError(f"{path}: {type(made).__name__} is a part of motions and curves, and none itself")
    return made


def _older(path: object, mark: Mapping[str, object], entries: dict[str, object]) -> dict[str, object]:
    """The entries of a file of 0.1.0, of `write_motion` or `write_two_parameter`, as `save` lays them out."""
    kind, version = mark["symmotion"], mark["version"]
    if kind == "affine-motion" and version == 1:
        basis = {name: entries.pop(name) for name in ("knots", "degree", "periodic", "origin") if name in entries}
        return {"class": "AffineMotion", "basis": {"class": "BSplineBasis", **basis}, **entries}
    if kind == "two-parameter-motion" and version == 1:
        degrees = entries.pop("degree", None)
        if not isinstance(degrees, list) or len(degrees) != 2:
            raise InputError(f"{path}, degree: two whole numbers are needed")
        for name, degree in zip("uv", degrees, strict=True):
            basis = {"knots": entries.pop(f"knots_{name}", None), "degree": degree, "periodic": False}
            entries[name] = {"class": "BSplineBasis", **basis}
        return {"class": "TwoParameterMotion", "dual": None, **entries}
    raise InputError(
        f"{path}: symmotion {kind!r:.40}, version {version!r:.40}: this is no file of a motion or curve that this "
        f"version reads; {MARK['symmotion']!r}, version {MARK['version']}, is needed"
    )


def _made(entry: object, where: str, before: str) -> object:
    """What an object in a file stands for; where: what messages call it; before: what they put before its entries."""
    if not isinstance(entry, dict):
        raise InputError(f"{where}: an object with a class is needed")
    name = entry.get("class")
    cls = NAMES.get(name) if isinstance(name, str) else None
    if cls is None:
        raise InputError(f"{where}: class {name!r:.40} is unknown; there are {', '.join(NAMES)}")
    kinds, entry = CLASSES[cls], {**LATER.get(cls, {}), **entry}
    for fault, names in (
        ("is missing", [n for n in kinds if n not in entry]),
        ("is unknown", [n for n in entry if n not in kinds and n != "class"]),
    ):
        if names:
            raise InputError(f"{before}{names[0]:.40} {fault}: {name} has {', '.join(kinds)}")
    given = {n: _field(entry[n], kinds[n], f"{before}{n}") for n in kinds}
    try:
        return cls(**given)
    except InputError as error:
        raise InputError(f"{where}: {error}") from None


def _field(entry: object, kinds: tuple[type, ...], where: str) -> object:
    """An entry as one of the kinds that a field may be, of a tuple each of its items."""
    if tuple in kinds:
        if not isinstance(entry, list):
            raise InputError(f"{where}: a list is needed")
        return tuple(_field(item, kinds[1:], f"{where}[{i}]") for i, item in enumerate(entry))
    if isinstance(entry, list | np.ndarray) and np.ndarray in kinds:
        return _array(entry, where)
    if isinstance(entry, dict):
        found = _made(entry, where, f"{where}.")
    else:
        found = float(entry) if type(entry) is int and float in kinds else entry
    if type(found) not in kinds or (isinstance(found, float) and not np.isfinite(found)):
        needed = " or ".join("null" if k is NONE else WORDS.get(k, k.__name__) for k in kinds)
        raise InputError(f"{where}: {needed}, is needed")
    return found


def _array(entry: list | np.ndarray, where: str) -> np.ndarray:
    try:
        numbers = np.asarray(entry)
    except ValueError:  # lists of different lengths
        numbers = np.empty(0, dtype=object)
    if numbers.dtype.kind not in "fiu":
        raise InputError(f"{where}: numbers are needed, in lists of equal lengths")
    if not np.isfinite(numbers).all():
        raise InputError(f"{where}: a number is not finite")
    return numbers.astype(float, copy=False)
