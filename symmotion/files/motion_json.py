"""Affine motions as JSON objects, exactly."""

import numpy as np

from symmotion.errors import InputError
from symmotion.files.documents import entries_of, read_list, require_entries, write_object
from symmotion.files.formats import FilePath
from symmotion.files.saved import class_saved, load_as
from symmotion.motions import AffineMotion
from symmotion.splines import BSplineBasis

# What makes a file a motion, and the entries that it holds beside.
MARK = {"symmotion": "affine-motion", "version": 1}
ENTRIES = ("degree", "periodic", "knots", "linear", "translation")


def read_motion_json(path: FilePath) -> AffineMotion:
    """The motion that `write_motion_json` or `save` wrote; InputError names the file and the entry at fault."""
    document = entries_of(path)
    if class_saved(document) is not None:
        return load_as(path, AffineMotion)
    for name, needed in MARK.items():
        if document.get(name) != needed:
            raise InputError(f"{path}: {name} is {document.get(name)!r:.40}: {needed!r} is needed for a motion")
    require_entries(path, document, (*MARK, *ENTRIES), ("origin",))
    if not isinstance(document["periodic"], bool):
        raise InputError(f"{path}, periodic: true or false is needed")
    degree = document["degree"]
    if not isinstance(degree, float) or not degree.is_integer():
        raise InputError(f"{path}, degree: a whole number is needed")
    knots, linear, translation = (read_list(path, document, name) for name in ("knots", "linear", "translation"))
    try:
        basis = BSplineBasis(knots, int(degree), document["periodic"], document.get("origin", 0.0))
        return AffineMotion(basis, linear, translation)
    except InputError as error:
        raise InputError(f"{path}: {error}") from None


def write_motion_json(motion: AffineMotion, path: FilePath) -> None:
    """Write a motion exactly; InputError for motions of other kinds and for controls that are not finite."""
    if not isinstance(motion, AffineMotion):
        raise InputError(f"{path}: json holds an AffineMotion: {type(motion).__name__} does not go into it")
    finite = np.isfinite(motion.spline.control_points).all(axis=1)
    if not finite.all():
        raise InputError(f"{path}: control {int(np.argmin(finite))} of the motion is not finite")
    entries = {
        "degree": motion.degree,
        "periodic": motion.basis.periodic,
        "knots": motion.basis.knots,
        **({"origin": motion.basis.origin} if motion.basis.origin else {}),
        "linear": motion.linear,
        "translation": motion.translation,
    }
    write_object(path, MARK | entries)


def is_motion_json(path: FilePath) -> bool:
    """Whether a JSON file has the mark of a motion, or was saved from an affine one."""
    document = entries_of(path)
    return class_saved(document) == "AffineMotion" or document.get("symmotion") == MARK["symmotion"]
