"""Meshes and their files, with trimesh as the independent reader and measurer."""

import numpy as np
import pytest
import trimesh

from symmotion.bodies import Mesh
from symmotion.errors import InputError
from symmotion.files import write_mesh
from symmotion.motions import AffineMotion
from symmotion.splines import BSplineBasis
from symmotion.sweeps import MovingEllipsoid, swept_volume
from symmotion.sweeps.marching import sphere

CORNERS = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
FACES = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]])
TETRAHEDRON = Mesh(CORNERS, FACES)


def swept() -> Mesh:
    linear = np.array([[[1.2, 0.3, 0], [0, 0.7, 0.2], [0.1, 0, 0.5]], np.eye(3), np.diag([0.6, 1, 1.3])])
    motion = AffineMotion(BSplineBasis.clamped([0, 1], 2), linear, [[0, 0, 0], [2.0, 1, 0], [3.0, -1, 1]])
    return swept_volume(MovingEllipsoid(motion, [1, 0.6, 0.8]), slices=12, divisions=6).mesh


def test_measures_of_a_tetrahedron():
    assert TETRAHEDRON.closed
    assert TETRAHEDRON.volume == pytest.approx(1 / 6, rel=1e-14)
    assert TETRAHEDRON.area == pytest.approx(1.5 + np.sqrt(3) / 2, rel=1e-14)
    assert TETRAHEDRON.euler_characteristic == 2
    assert TETRAHEDRON.flipped().volume == pytest.approx(-1 / 6, rel=1e-14)
    assert TETRAHEDRON.flipped().outward().volume == pytest.approx(1 / 6, rel=1e-14)
    far = Mesh(CORNERS + 1e6, FACES)
    assert far.volume == pytest.approx(1 / 6, rel=1e-9)


def test_an_open_mesh_says_where():
    open_mesh = Mesh(CORNERS, FACES[1:])
    assert not open_mesh.closed
    # Each triangle meets the missing one along a directed edge of the base.
    assert {tuple(e) for e in open_mesh.boundary_edges.tolist()} == {(0, 1), (1, 2), (2, 0)}
    assert open_mesh.euler_characteristic == 1
    with pytest.raises(InputError, match="3 boundary edges has no volume"):
        _ = open_mesh.volume
    with pytest.raises(InputError, match="boundary edges"):
        open_mesh.outward()


def test_a_triangle_turned_over_and_a_doubled_one_are_not_closed():
    turned = FACES.copy()
    turned[0] = turned[0][::-1]
    assert not Mesh(CORNERS, turned).closed
    assert not Mesh(CORNERS, np.concatenate([FACES, FACES[:1]])).closed
    two = Mesh(np.concatenate([CORNERS, CORNERS + 3]), np.concatenate([FACES, FACES + 4]))
    assert two.closed
    assert two.euler_characteristic == 4


@pytest.mark.parametrize("divisions", [1, 2, 5, 12])
def test_the_sphere_is_closed_outward_and_converges(divisions):
    mesh = Mesh(*sphere(divisions))
    n = divisions**2
    assert (len(mesh.vertices), len(mesh.triangles)) == (10 * n + 2, 20 * n)
    assert mesh.closed
    assert mesh.euler_characteristic == 2
    np.testing.assert_allclose(np.linalg.norm(mesh.vertices, axis=1), 1, rtol=1e-14)
    assert 0 < 1 - mesh.volume / (4 / 3 * np.pi) < 0.6 / n
    assert np.bincount(mesh.triangles.ravel()).min() == 5


@pytest.mark.parametrize("mesh", [TETRAHEDRON, swept()], ids=["tetrahedron", "swept volume"])
@pytest.mark.parametrize("ending", ["obj", "ply", "stl"])
def test_files_as_trimesh_reads_them(mesh, ending, tmp_path):
    path = tmp_path / f"body.{ending}"
    write_mesh(mesh, path)
    read = trimesh.load_mesh(path)
    assert read.is_watertight
    assert read.is_winding_consistent
    assert read.euler_number == mesh.euler_characteristic
    single = ending == "stl"
    assert read.volume == pytest.approx(mesh.volume, rel=1e-6 if single else 1e-12)
    assert read.area == pytest.approx(mesh.area, rel=1e-6 if single else 1e-12)
    if not single:
        back = trimesh.load_mesh(path, process=False)
        np.testing.assert_array_equal(back.vertices, mesh.vertices)
        np.testing.assert_array_equal(back.faces, mesh.triangles)


def test_stl_has_the_size_and_normals_of_the_format(tmp_path):
    path = tmp_path / "body.STL"
    write_mesh(TETRAHEDRON, path)
    content = path.read_bytes()
    assert len(content) == 84 + 50 * 4
    assert int.from_bytes(content[80:84], "little") == 4
    np.testing.assert_allclose(np.frombuffer(content, "<f4", 3, 84), [0, 0, -1], atol=1e-7)
    assert not content.startswith(b"solid")  # which readers take for the text form


def test_files_that_cannot_be_written(tmp_path):
    with pytest.raises(InputError, match=r"format 'off' is unknown; there are obj, ply, stl"):
        write_mesh(TETRAHEDRON, tmp_path / "body.off")
    with pytest.raises(InputError, match="no directory"):
        write_mesh(TETRAHEDRON, tmp_path / "missing" / "body.ply")
    (tmp_path / "body.stl").write_text("old")
    with pytest.raises(InputError, match=r"body.stl: vertex 2 is too large, or too far from the origin"):
        write_mesh(Mesh(CORNERS * [1, 1e39, 1], FACES), tmp_path / "body.stl")
    with pytest.raises(InputError, match=r"vertex 0 is too large, or too far from the origin, .* write obj or ply"):
        write_mesh(Mesh(CORNERS + 1234567.9, FACES), tmp_path / "body.stl")
    assert (tmp_path / "body.stl").read_text() == "old"


@pytest.mark.parametrize(
    ("vertices", "triangles", "message"),
    [
        (CORNERS[:, :2], FACES, r"\(4, 2\): \(V, 3\) is needed"),
        (np.where(CORNERS == 1, np.nan, CORNERS), FACES, "vertex 1 is not finite"),
        (CORNERS, FACES[:, :2], r"\(F, 3\), F ≥ 1"),
        (CORNERS, FACES[:0], r"\(F, 3\), F ≥ 1"),
        (CORNERS, FACES.astype(float), "whole numbers"),
        (CORNERS, FACES + 1, "triangle 1 names a vertex outside 0 … 3"),
        (CORNERS, FACES - 1, "triangle 0 names a vertex outside"),
        (CORNERS, np.where(FACES == 3, 0, FACES), "triangle 1 has a vertex twice"),
    ],
)
def test_bad_meshes_name_the_culprit(vertices, triangles, message):
    with pytest.raises(InputError, match=message):
        Mesh(vertices, triangles)
