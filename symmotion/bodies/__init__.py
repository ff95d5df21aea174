"""Bodies that move: meshes, outlines and letters."""

from symmotion.bodies.mesh import Mesh
from symmotion.bodies.quads import QuadMesh, ellipsoid_mesh, grid_mesh, jug, read_teapot

__all__ = [
    "Mesh",
    "QuadMesh",
    "ellipsoid_mesh",
    "grid_mesh",
    "jug",
    "read_teapot",
]
