"""glTF files evaluated without symmotion: taken apart by pygltflib, interpolated by SciPy, by the specification."""

import numpy as np
from pygltflib import GLTF2
from scipy.interpolate import CubicHermiteSpline
from scipy.spatial.transform import Rotation, Slerp

WIDTHS = {"SCALAR": 1, "VEC3": 3, "VEC4": 4, "MAT4": 16}
TYPES = {5121: np.uint8, 5123: np.uint16, 5125: np.uint32, 5126: np.float32}


class Scene:
    """A .glb file at any time of its first animation."""

    def __init__(self, path):
        self.gltf = GLTF2().load(str(path))
        self.blob = self.gltf.binary_blob()

    def array(self, index):
        accessor = self.gltf.accessors[index]
        view = self.gltf.bufferViews[accessor.bufferView]
        assert view.byteOffset % 4 == 0
        width = WIDTHS[accessor.type]
        flat = np.frombuffer(self.blob, TYPES[accessor.componentType], accessor.count * width, view.byteOffset)
        flat = flat.reshape(-1, width)
        if accessor.min:
            np.testing.assert_array_equal(flat.min(axis=0), accessor.min)
            np.testing.assert_array_equal(flat.max(axis=0), accessor.max)
        return flat.astype(float)

    def channel(self, node, name, t):
        """A node's animated property, or the one that it has at rest."""
        animation = self.gltf.animations[0]
        for channel in animation.channels:
            if (channel.target.node, channel.target.path) == (node, name):
                sampler = animation.samplers[channel.sampler]
                times, values = self.array(sampler.input)[:, 0], self.array(sampler.output)
                if sampler.interpolation == "CUBICSPLINE":
                    k = min(np.searchsorted(times, t, side="right"), len(times) - 1)
                    before, value, behind = np.moveaxis(values.reshape(-1, 3, values.shape[1])[k - 1 : k + 1], 1, 0)
                    return CubicHermiteSpline(times[k - 1 : k + 1], value, [behind[0], before[1]])(t)
                assert (sampler.interpolation, name) == ("LINEAR", "rotation")
                return Slerp(times, Rotation.from_quat(values))(t).as_quat()
        return getattr(self.gltf.nodes[node], name)

    def world(self, node, t):
        """(4, 4) the matrix of a node in the scene."""
        matrix = np.eye(4)
        if (turn := self.channel(node, "rotation", t)) is not None:
            matrix[:3, :3] = Rotation.from_quat(turn).as_matrix()
        if (move := self.channel(node, "translation", t)) is not None:
            matrix[:3, 3] = move
        above = [k for k, n in enumerate(self.gltf.nodes) if node in (n.children or [])]
        return self.world(above[0], t) @ matrix if above else matrix

    @property
    def attributes(self):
        return self.gltf.meshes[0].primitives[0].attributes

    @property
    def vertices(self):
        return self.array(self.attributes.POSITION)

    def body(self, t):
        """(V, 3) the vertices of the body in the scene at a time of the file's clock."""
        node = next(k for k, n in enumerate(self.gltf.nodes) if n.mesh is not None)
        homogeneous = np.column_stack([self.vertices, np.ones(len(self.vertices))])
        if self.gltf.nodes[node].skin is None:
            return (homogeneous @ self.world(node, t).T)[:, :3]
        skin = self.gltf.skins[self.gltf.nodes[node].skin]
        inverse = self.array(skin.inverseBindMatrices).reshape(-1, 4, 4).swapaxes(1, 2)
        joints = [self.world(joint, t) @ inverse[j] for j, joint in enumerate(skin.joints)]
        which, weights = self.array(self.attributes.JOINTS_0).astype(int), self.array(self.attributes.WEIGHTS_0)
        blended = np.einsum("vj,vjkl->vkl", weights, np.array(joints)[which])
        return np.einsum("vkl,vl->vk", blended, homogeneous)[:, :3]
