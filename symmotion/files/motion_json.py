"""Motions as JSON objects, exactly."""

import numpy as np

from symmotion.errors import InputError
from symmotion.files.documents import entries_of, outline_of, read_list, require_entries
from symmotion.files.formats import FilePath
from symmotion.files.saved import class_saved, load_as
from symmotion.loading import MOTIONS, SavedMotion
from symmotion.motions import AffineMotion
from symmotion.saving import save
from symmotion.splines import BSplineBasis

# What made a file a motion before `save` did, and the entries that it held beside.
MARK = {"symmotion": "affine-motion", "version": 1}
ENTRIES = ("degree", "periodic", "knots", "linear", "translation")


def read_motion_json(path: FilePath) -> SavedMotion:
    """The motion that `save` wrote, or `write_motion` of 0.1.0; InputError names the file and the entry at fault."""
    if class_saved(outline_of(path)) is not None:
        return load_as(path, MOTIONS, "motion")
    document = entries_of(path)
    mark, version = (document.get(name) for name in MARK)
    if mark != MARK["symmotion"]:
        raise InputError(f"{path}: symmotion is {mark!r:.40}: 'value', as `save` writes it, is needed for a motion")
    if version != MARK["version"]:
        raise InputError(f"{path}: version is {version!r:.40}: {MARK['version']} is needed for a motion")
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


def write_motion_json(motion: SavedMotion, path: FilePath) -> None:
    """Write a motion as its `save` does; InputError for classes of your own and for controls that are not finite."""
    if not isinstance(motion, MOTIONS):
        raise InputError(
            f"{path}: json holds motions of {', '.join(kind.__name__ for kind in MOTIONS)}: a {type(motion).__name__} "
            "does not go into it; write csv"
        )
    if isinstance(motion, AffineMotion):
        finite = np.isfinite(motion.spline.control_points).all(axis=1)
        if not finite.all():
            raise InputError(f"{path}: control {int(np.argmin(finite))} of the motion is not finite")
    save(motion, path)


def is_motion_json(path: FilePath) -> bool:
    """Whether a JSON file has the mark of a motion, or was saved from one."""
    document = outline_of(path)
    return (
        class_saved(document) in {kind.__name__ for kind in MOTIONS} or document.get("symmotion") == MARK["symmotion"]
    )
