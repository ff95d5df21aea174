"""Bodies out of .obj files, where a format takes one."""

import numpy as np
import pytest

import symmotion as sm
from symmotion.commands import main
from symmotion.errors import InputError
from symmotion.files.meshes import read_obj

CORNER = "# a corner\nv 0 0 0\nv 1 0 0 1.0\nvn 0 0 1\nv 0 1 0\nv 0 0 1\nf 1/1/1 3//1 2\nf -4 2 4\nf 1 4 3\nf 2 3 4\n"
MOTION = sm.interpolants.component_cubic(sm.examples.spatial_keyframes())


def test_vertices_and_faces(tmp_path):
    (tmp_path / "a.obj").write_text(CORNER)
    body = read_obj(tmp_path / "a.obj")
    np.testing.assert_array_equal(body.vertices, [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    assert [tuple(face) for face in body.faces] == [(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)]


def test_what_was_written_is_read(tmp_path):
    faces = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
    mesh = sm.bodies.Mesh(np.array([[0.1, 0, 0], [1, 0, 0], [0, 1 / 3, 0], [0, 0, 1]]), faces)
    sm.files.write_mesh(mesh, tmp_path / "a.obj")
    np.testing.assert_array_equal(read_obj(tmp_path / "a.obj").vertices, mesh.vertices)


def test_a_scene_and_the_command_line_take_its_name(tmp_path):
    body, out = tmp_path / "a.obj", tmp_path / "m.glb"
    body.write_text(CORNER)
    sm.write_motion(MOTION, out, body=str(body))
    named = out.read_bytes()
    sm.write_motion(MOTION, out, body=read_obj(body))
    assert out.read_bytes() == named
    MOTION.save(tmp_path / "m.json")
    assert main(["convert", str(tmp_path / "m.json"), "-o", str(out), "--body", str(body), "--quiet"]) == 0
    assert out.read_bytes() == named


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("v 0 0\n", "a.obj, line 1: three coordinates are needed"),
        ("v 0 0 x\n", "a.obj, line 1: 'x' is not a number"),
        ("v 0 0 0\nf 1 1\n", "a.obj, line 2: three corners or more"),
        ("v 0 0 0\nf 1 1 2\n", "a.obj, line 2: corner '2' is none of the 1 vertices before it"),
        ("v 0 0 0\nf 1 1 a\n", "a.obj, line 2: corner 'a' is none"),
        ("v 0 0 0\n", "a.obj: holds no faces"),
    ],
)
def test_broken_files(tmp_path, content, message):
    (tmp_path / "a.obj").write_text(content)
    with pytest.raises(InputError, match=message):
        read_obj(tmp_path / "a.obj")


def test_other_files_are_no_bodies(tmp_path, capsys):
    with pytest.raises(InputError, match=r"body 'a\.ply': the name of an \.obj file"):
        sm.write_motion(MOTION, tmp_path / "m.glb", body="a.ply")
    MOTION.save(tmp_path / "m.json")
    assert main(["convert", str(tmp_path / "m.json"), "-o", str(tmp_path / "m.glb"), "--body", "a.ply"]) == 2
    assert "--body 'a.ply': the name of an .obj file is needed" in capsys.readouterr().err
