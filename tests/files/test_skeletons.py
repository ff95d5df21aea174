"""Whole skeletons out of BVH, glTF and USD, and keyframes of them with a reference of choice."""

import json
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from test_gltf_reading import Maker

import symmotion as sm
from symmotion.errors import InputError
from symmotion.files import PosedSkeleton, read_skeleton, write_bvh
from symmotion.motions import keyframes_from_copies

RECORDED = Path(__file__).resolve().parents[3] / "shared" / "data" / "test_freebvh.bvh"
LEG = """\
HIERARCHY
ROOT hip
{
  OFFSET 0 1 0
  CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation
  JOINT knee
  {
    OFFSET 0.25 -2 0
    CHANNELS 3 Zrotation Xrotation Yrotation
    End Site
    {
      OFFSET 0 -2 0.5
    }
  }
}
MOTION
Frames: 3
Frame Time: 0.5
0 1 0 0 0 0 0 0 0
1 2 3 10 20 30 40 50 60
1 2 4 90 0 0 0 -45 20
"""


@pytest.fixture
def leg(tmp_path) -> PosedSkeleton:
    (tmp_path / "leg.bvh").write_text(LEG)
    return read_skeleton(tmp_path / "leg.bvh")


def test_all_joints_of_a_bvh_file(leg, tmp_path):
    assert (leg.names, list(leg.parents), leg.times.tolist()) == (("hip", "knee", "knee end"), [-1, 0, 1], [0, 0.5, 1])
    np.testing.assert_allclose(leg.rest, [[0, 1, 0], [0.25, -1, 0], [0.25, -3, 0.5]])
    for name, keys in leg.items():
        assert keys == sm.read_keyframes(tmp_path / "leg.bvh", node=name) == leg.keyframes(name)


def test_the_same_skeleton_in_gltf(leg, tmp_path):
    """Nodes of its offsets, turned by quaternions at the frames' times; what neither moves nor hangs is left out."""
    numbers = np.array([line.split() for line in LEG.splitlines()[-3:]], dtype=float)
    maker = Maker(
        {"name": "lamp"},
        {"name": "knee end", "translation": [0, -2, 0.5]},
        {"name": "knee", "translation": [0.25, -2, 0], "children": [1]},
        {"name": "hip", "translation": [0, 1, 0], "children": [2]},
        {"name": "scene", "children": [3, 0]},
    )
    maker.animate(3, "translation", leg.times, numbers[:, :3])
    for node, first in ((3, 3), (2, 6)):
        turns = Rotation.from_euler("ZXY", numbers[:, first : first + 3], degrees=True)
        maker.animate(node, "rotation", leg.times, turns.as_quat())
    found = read_skeleton(maker.save(tmp_path / "leg.gltf"))
    assert (found.names, list(found.parents)) == (leg.names, list(leg.parents))
    np.testing.assert_allclose(found.linear, leg.linear, atol=1e-6)
    np.testing.assert_allclose(found.translation, leg.translation, atol=1e-6)
    np.testing.assert_allclose(found.rest, leg.rest, atol=1e-12)
    for name in found.names:
        single = sm.read_keyframes(tmp_path / "leg.gltf", node=name)
        np.testing.assert_allclose(found.keyframes(name).coordinates, single.coordinates, atol=1e-12)


def test_joints_of_a_skin_that_stand_still_are_there_too(tmp_path):
    maker = Maker({"name": "a"}, {"name": "b", "translation": [1, 2, 3]}, {"name": "c"})
    maker.animate(0, "translation", [0, 1], np.eye(3)[:2])
    maker.document["skins"] = [{"joints": [0, 1]}]
    found = read_skeleton(maker.save(tmp_path / "a.gltf"))
    assert found.names == ("a", "b")
    np.testing.assert_array_equal(found.translation[:, 1], [[1, 2, 3], [1, 2, 3]])


def test_prims_of_usd(tmp_path):
    moves = "        double3 xformOp:translate.timeSamples = {\n            0: (0, 0, 0), 24: (1, 0, 0)\n        }\n"
    order = '        uniform token[] xformOpOrder = ["xformOp:translate"]\n'
    tip = f'    def Xform "Tip"\n    {{\n        double3 xformOp:translate = (0, 2, 0)\n{order}    }}\n'
    (tmp_path / "a.usda").write_text(
        f'#usda 1.0\ndef Xform "Arm"\n{{\n{moves}{order}{tip}}}\ndef Xform "Lamp"\n{{\n}}\n'
    )
    found = read_skeleton(tmp_path / "a.usda")
    assert (found.names, list(found.parents), found.times.tolist()) == (("/Arm", "/Arm/Tip"), [-1, 0], [0, 1])
    np.testing.assert_array_equal(found.translation[1], [[1, 0, 0], [1, 2, 0]])


def cloud(deform) -> PosedSkeleton:
    """Joints at random places at rest, carried by maps (F, 3, 3)."""
    rest = np.random.default_rng(3).normal(size=(8, 3))
    deform = np.asarray(deform)
    turns = np.tile(np.eye(3), (len(deform), 8, 1, 1))
    names = tuple(f"j{k}" for k in range(8))
    return PosedSkeleton(names, [-1] * 8, np.arange(len(deform)), turns, rest @ deform.swapaxes(1, 2), rest)


def test_a_frame_as_the_reference():
    rng = np.random.default_rng(0)
    deform = np.eye(3) + 0.2 * rng.normal(size=(4, 3, 3))
    fit = cloud(deform).affine_keyframes(reference=2)
    np.testing.assert_allclose(fit.keyframes.linear, deform @ np.linalg.inv(deform[2]), atol=1e-12)
    np.testing.assert_allclose(fit.determinants, np.linalg.det(deform) / np.linalg.det(deform[2]), rtol=1e-12)
    np.testing.assert_allclose(cloud(deform).affine_keyframes(reference=-2).keyframes.linear, fit.keyframes.linear)
    with pytest.raises(InputError, match="reference frame 4 does not exist: there are 4"):
        cloud(deform).affine_keyframes(reference=4)


def test_rigid_ones_are_those_of_scipy():
    rng = np.random.default_rng(1)
    skeleton = cloud(Rotation.random(5, random_state=2).as_matrix() @ (np.eye(3) + 0.3 * rng.normal(size=(5, 3, 3))))
    fit = skeleton.affine_keyframes(rigid=True)
    rest = skeleton.rest - skeleton.rest.mean(axis=0)
    for i, places in enumerate(skeleton.translation):
        turn, _ = Rotation.align_vectors(places - places.mean(axis=0), rest)
        np.testing.assert_allclose(fit.keyframes.linear[i], turn.as_matrix(), atol=1e-10)
    np.testing.assert_allclose(fit.determinants, 1, rtol=1e-12)
    assert (fit.deviations > skeleton.affine_keyframes().deviations).all()
    np.testing.assert_allclose(fit.size, np.sqrt((rest**2).sum(axis=1).mean()))


def test_a_whole_that_flattens_is_told():
    fit = cloud([np.eye(3), np.diag([1.0, 1, 0.05]), np.diag([1.0, 1, -0.2])]).affine_keyframes()
    assert fit.notes[1].startswith("det A is -0.2 to 1, the whole reflected at keyframe 2: another reference frame")
    assert "det A -0.2 to 1" in repr(fit)
    assert len(cloud([np.eye(3), np.diag([1.0, 1, 0.5])]).affine_keyframes().notes) == 1
    rigid = cloud([np.eye(3), np.diag([1.0, 1, -0.2])]).affine_keyframes(rigid=True)
    assert len(rigid.notes) == 1 and "of their size (rms, keyframe 1)" in rigid.notes[0]


@pytest.mark.skipif(not RECORDED.is_file(), reason="recorded data are not there")
def test_a_recorded_walk_against_its_rest_and_against_a_frame():
    """Arms that hang are far from arms held out: at rest the whole is reflected, against a frame it is not."""
    skeleton = read_skeleton(RECORDED)
    at_rest, framed = skeleton.affine_keyframes(), skeleton.affine_keyframes(reference=0)
    assert at_rest.determinants.min() < 0 < framed.determinants.min()
    assert framed.deviations.max() < 0.5 * at_rest.deviations.max()


def test_a_plane_of_joints_fixes_a_rotation():
    flat = np.array([[0.0, 0, 0], [1, 0, 0], [0, 2, 0]])
    turns = Rotation.random(3, random_state=5).as_matrix()
    found = keyframes_from_copies(flat, flat @ turns.swapaxes(1, 2) + [1, 2, 3], times=[0, 1, 2], rigid=True)
    np.testing.assert_allclose(found.linear, turns, atol=1e-12)
    np.testing.assert_allclose(found.translation, np.tile([1.0, 2, 3], (3, 1)), atol=1e-12)
    plane = keyframes_from_copies(flat[:2, :2], [flat[:2, :2], 3 * flat[:2, [1, 0]]], times=[0, 1], rigid=True)
    np.testing.assert_allclose(plane.linear[1], [[0, -1], [1, 0]], atol=1e-12)


@pytest.mark.parametrize(
    ("shape", "copies", "message"),
    [
        (np.diag([1.0, 2, 0]) [:2], [np.eye(3)[:2]] * 2, "the shape's 2 points lie in a line: they"),
        (np.eye(3), [np.eye(3), np.arange(3.0)[:, None] * np.ones(3)], "copy 1 leaves the rotation open"),
        (np.ones((2, 2)), [np.eye(2)] * 2, "the shape's 2 points lie in one place"),
    ],
)  # fmt: skip
def test_what_fixes_no_rotation(shape, copies, message):
    with pytest.raises(InputError, match=message):
        keyframes_from_copies(shape, copies, rigid=True)


@pytest.mark.parametrize(
    ("content", "name", "message"),
    [
        (json.dumps({"asset": {"version": "2.0"}, "nodes": [{}]}), "a.gltf", "a.gltf: holds no animations"),
        ("#usda 1.0\n", "a.usda", "a.usda: holds no prim with time samples of its place, and so no skeleton"),
        ("0 0 0", "a.tum", "a.tum: format 'tum' is unknown; there are bvh, glb, gltf, usda"),
    ],
)
def test_files_without_a_skeleton(tmp_path, content, name, message):
    (tmp_path / name).write_text(content)
    with pytest.raises(InputError, match=message):
        read_skeleton(tmp_path / name)


def test_shapes_that_do_not_go_together(leg):
    with pytest.raises(InputError, match="they are not of 3 joints"):
        PosedSkeleton(leg.names, leg.parents, leg.times[:2], leg.linear, leg.translation, leg.rest)
    with pytest.raises(InputError, match="2 parents for 3 joints"):
        PosedSkeleton(leg.names, leg.parents[:2], leg.times, leg.linear, leg.translation, leg.rest)
    with pytest.raises(InputError, match="0 joints are called 'toe'; there are hip, knee, knee end"):
        leg.keyframes("toe")


def test_bodies_of_our_own_files(tmp_path):
    keys = sm.examples.random_keyframes(4, 50, seed=2)
    write_bvh({"left": keys, "right": keys}, tmp_path / "a.bvh")
    np.testing.assert_allclose(read_skeleton(tmp_path / "a.bvh").keyframes("right").linear, keys.linear, atol=1e-15)
