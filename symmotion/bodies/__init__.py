"""Bodies that move: meshes, outlines and letters."""

from symmotion.bodies.mesh import Mesh

__all__ = [
    "Mesh",
]
