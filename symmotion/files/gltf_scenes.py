"""What a glTF file says of a motion: nodes, their animation and the body's mesh."""

from collections.abc import Mapping, Sequence

import numpy as np

from symmotion.bodies import Body
from symmotion.files.gltf_document import INDICES, VERTICES, DocumentBuilder
from symmotion.files.keys import HermiteKeys


def skinned_scene(
    notes: dict[str, object],
    body: Body,
    centre: np.ndarray,
    corners: np.ndarray,
    weights: np.ndarray,
    times: np.ndarray,
    keys: HermiteKeys,
) -> DocumentBuilder:
    """A body whose vertices follow four joints.

    centre: (3,) of the node that the joints hang from; corners: (4, 3) the joints' places where the body is as it is
    given; weights: (V, 4) of each vertex; times: (K,) in the file; keys: of the joints' paths, (K, 4, 3).
    """
    document = DocumentBuilder(notes)
    ticks = document.accessor(times, "SCALAR", bounds=True)
    samplers = [_hermite_sampler(document, ticks, keys.column(j)) for j in range(4)]
    inverse = np.tile(np.eye(4), (4, 1, 1))
    inverse[:, 3, :3] = -corners  # column-major in glTF
    skin = {"joints": [1, 2, 3, 4], "inverseBindMatrices": document.accessor(inverse, "MAT4"), "skeleton": 0}
    extra = {
        "JOINTS_0": document.accessor(np.where(weights > 0, np.arange(4), 0), "VEC4", component="<u1", target=VERTICES),
        "WEIGHTS_0": document.accessor(weights, "VEC4", target=VERTICES),
    }
    document.entries |= {
        "scene": 0,
        "scenes": [{"nodes": [0, 5]}],
        "nodes": [
            {"name": "motion", "translation": centre.tolist(), "children": [1, 2, 3, 4]},
            *({"name": f"corner {j}", "translation": keys.values[0, j].tolist()} for j in range(4)),
            {"name": "body", "mesh": 0, "skin": 0},
        ],
        "skins": [skin],
        "animations": [_animation(samplers, [(j + 1, "translation") for j in range(4)])],
        **_mesh(document, body, extra),
    }
    return document


def turning_scene(
    notes: dict[str, object],
    body: Body,
    centre: np.ndarray,
    times: np.ndarray,
    quaternions: np.ndarray,
    moving: np.ndarray,
    keys: HermiteKeys,
) -> DocumentBuilder:
    """A body that one node turns and moves.

    centre: (3,) of the node above; times: (K,) in the file, of the quaternions (K, 4); moving: (L,) those of the
    keys (L, 3) of its translation.
    """
    document = DocumentBuilder(notes)
    turns = quaternions[:, [1, 2, 3, 0]]
    rotation = {
        "input": document.accessor(times, "SCALAR", bounds=True),
        "output": document.accessor(turns, "VEC4"),
        "interpolation": "LINEAR",
    }
    translation = _hermite_sampler(document, document.accessor(moving, "SCALAR", bounds=True), keys)
    pose = {"translation": keys.values[0].tolist(), "rotation": turns[0].tolist()}
    document.entries |= {
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [
            {"name": "motion", "translation": centre.tolist(), "children": [1]},
            {"name": "body", "mesh": 0, **pose},
        ],
        "animations": [_animation([rotation, translation], [(1, "rotation"), (1, "translation")])],
        **_mesh(document, body, {}),
    }
    return document


def _hermite_sampler(document: DocumentBuilder, times: int, keys: HermiteKeys) -> dict[str, object]:
    """A sampler of vectors (K, 3): at every key its slope before, value and slope behind."""
    triples = np.stack([keys.arriving, keys.values, keys.leaving], axis=1)
    output = document.accessor(triples.reshape(-1, 3), "VEC3")
    return {"input": times, "output": output, "interpolation": "CUBICSPLINE"}


def _animation(samplers: Sequence[Mapping[str, object]], targets: list[tuple[int, str]]) -> dict[str, object]:
    channels = [{"sampler": i, "target": {"node": n, "path": path}} for i, (n, path) in enumerate(targets)]
    return {"name": "motion", "samplers": samplers, "channels": channels}


def _mesh(document: DocumentBuilder, body: Body, extra: dict[str, int]) -> dict[str, object]:
    attributes = {
        "POSITION": document.accessor(body.vertices, "VEC3", target=VERTICES, bounds=True),
        "COLOR_0": document.accessor(body.shown_colours, "VEC3", target=VERTICES),
        **extra,
    }
    component = "<u2" if len(body.vertices) < 2**16 - 1 else "<u4"
    indices = document.accessor(body.triangles.reshape(-1, 1), "SCALAR", component=component, target=INDICES)
    surface = {"pbrMetallicRoughness": {"metallicFactor": 0.0, "roughnessFactor": 0.8}, "doubleSided": True}
    return {
        "meshes": [{"name": "body", "primitives": [{"attributes": attributes, "indices": indices, "material": 0}]}],
        "materials": [surface],
    }
