"""The skin by which files of our own carry a body along an affine motion."""

import numpy as np

from symmotion.files.gltf_reading import GltfFile, Items

GENERATOR = "symmotion"
CORNERS = 4


def own_skin(file: GltfFile, nodes: Items, index: int | None) -> list[int]:
    """The joints of the one skin of a file of our own, where the node asked for is the body or none; else no joints."""
    generator, skins = file.document["asset"].get("generator"), file.items("skins")
    if generator is None or generator.value != GENERATOR or len(skins) != 1:
        return []
    joints = [joint.whole(0, len(nodes) - 1) for joint in skins[0].items("joints")]
    if len(joints) != CORNERS or (index is not None and nodes[index].get("skin") is None):
        return []
    return joints


def bound_corners(file: GltfFile) -> np.ndarray:
    """(4, 3) where the joints of that skin are bound: the inverse of their matrices, which are translations."""
    place = file.items("skins")[0]["inverseBindMatrices"]
    matrices = file.accessor(place, ("MAT4",)).astype(float)
    if len(matrices) != CORNERS:
        raise place.fault(f"{len(matrices)} matrices for {CORNERS} joints")
    corners = -matrices[:, 12:15]
    if np.linalg.matrix_rank(corners[1:] - corners[0]) < 3:
        raise place.fault("the joints are bound in a plane: they fix no affine position")
    return corners
