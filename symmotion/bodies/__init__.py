"""Bodies that move: one `Body` of polygons, made of any shape, and shapes to begin with; meshes that enclose."""

from symmotion.bodies.body import Body, Meshed, Shape, Triangulated, joined
from symmotion.bodies.mesh import Mesh
from symmotion.bodies.shapes import eight_ellipses, ellipse, letter_k, wedge
from symmotion.bodies.surfaces import ellipsoid_mesh, grid_mesh, jug, read_teapot

__all__ = [
    "Body",
    "Mesh",
    "Meshed",
    "Shape",
    "Triangulated",
    "eight_ellipses",
    "ellipse",
    "ellipsoid_mesh",
    "grid_mesh",
    "joined",
    "jug",
    "letter_k",
    "read_teapot",
    "wedge",
]
