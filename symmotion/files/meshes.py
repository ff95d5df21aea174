"""Triangle meshes into OBJ, PLY and STL files."""

import os

import numpy as np

from symmotion.bodies import Body, Shape
from symmotion.bodies.mesh import Mesh
from symmotion.errors import InputError
from symmotion.files.formats import FilePath
from symmotion.files.numbers import finite
from symmotion.opening import readable
from symmotion.whole import whole_file

# How far single precision may move a vertex, relative to the size of the mesh.
ROUNDING = 1e-4

PLY_HEADER = """ply
format binary_little_endian 1.0
comment symmotion
element vertex {vertices}
property double x
property double y
property double z
element face {triangles}
property list uchar int vertex_indices
end_header
"""
FACE = np.dtype([("count", "u1"), ("corners", "<i4", 3)])
FACET = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])


def checked_body(shape: "Shape | FilePath", what: str = "body") -> "Shape | Body":
    """A body of whatever form, of a file its faces; InputError that names the option for other kinds of files."""
    if not isinstance(shape, str | os.PathLike):
        return shape
    if not str(shape).lower().endswith((".obj", ".obj.gz")):
        raise InputError(f"{what} {str(shape)!r:.60}: the name of an .obj file is needed")
    return read_obj(shape)


def read_obj(path: FilePath) -> Body:
    """The vertices and faces of an .obj file, without what it says beside; InputError names the line at fault."""
    vertices: list[list[float]] = []
    faces: list[tuple[int, ...]] = []
    with readable(path) as handle:
        for line, text in enumerate(handle, 1):
            kind, *words = text.split("#")[0].split() or [""]
            try:
                if kind == "v":
                    vertices.append([finite(word) for word in words[:3]])
                    if len(words) < 3:
                        raise InputError("three coordinates are needed")
                elif kind == "f":
                    faces.append(tuple(_corner(word, len(vertices)) for word in words))
                    if len(words) < 3:
                        raise InputError("three corners or more are needed")
            except InputError as error:
                raise InputError(f"{path}, line {line}: {error}") from None
    if not faces:
        raise InputError(f"{path}: holds no faces")
    return Body(np.array(vertices), tuple(faces))


def _corner(word: str, count: int) -> int:
    """The vertex of a corner v/vt/vn, counted from 1, or from the end where negative."""
    number = word.partition("/")[0]
    k = int(number) if number.lstrip("-").isdecimal() else 0
    if not (1 <= k <= count or -count <= k <= -1):
        raise InputError(f"corner {word!r:.20} is none of the {count} vertices before it")
    return k - 1 if k > 0 else count + k


def write_obj(mesh: Mesh, path: FilePath) -> None:
    """Write a mesh as text."""
    lines = [f"v {x!r} {y!r} {z!r}\n" for x, y, z in mesh.vertices.tolist()]
    lines += [f"f {a} {b} {c}\n" for a, b, c in (mesh.triangles + 1).tolist()]
    with whole_file(path) as handle:
        handle.write("# symmotion\n")
        handle.writelines(lines)


def write_ply(mesh: Mesh, path: FilePath) -> None:
    """Write a mesh in binary, little endian, in double precision."""
    header = PLY_HEADER.format(vertices=len(mesh.vertices), triangles=len(mesh.triangles))
    faces = np.empty(len(mesh.triangles), dtype=FACE)
    faces["count"], faces["corners"] = 3, mesh.triangles
    with whole_file(path, binary=True) as handle:
        handle.write(header.encode("ascii") + mesh.vertices.astype("<f8").tobytes() + faces.tobytes())


def write_stl(mesh: Mesh, path: FilePath) -> None:
    """Write a mesh in binary, in single precision; InputError where that moves a vertex by more than 1e-4 of its size.

    A normal per triangle, and no shared vertices.
    """
    with np.errstate(over="ignore"):
        moved = np.abs(mesh.vertices.astype("<f4") - mesh.vertices)
    far = (moved > ROUNDING * np.ptp(mesh.vertices, axis=0).max()).any(axis=1)
    if far.any():
        raise InputError(
            f"{path}: vertex {int(np.argmax(far))} is too large, or too far from the origin, for the single precision "
            "of stl; write obj or ply"
        )
    size = np.linalg.norm(mesh.area_vectors, axis=1, keepdims=True)
    facets = np.zeros(len(mesh.triangles), dtype=FACET)
    facets["normal"] = mesh.area_vectors / np.where(size > 0, size, 1.0)
    facets["corners"] = mesh.vertices[mesh.triangles]
    with whole_file(path, binary=True) as handle:
        handle.write(b"symmotion".ljust(80) + np.uint32(len(facets)).astype("<u4").tobytes() + facets.tobytes())
