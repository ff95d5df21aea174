"""BVH out: our own reader has every number back, SciPy's Euler angles agree, and what cannot be written."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import symmotion as sm
from symmotion.errors import InputError
from symmotion.files import Skeleton, joint_trajectories, read_bvh, write_bvh
from symmotion.files.skeleton import Joint

RECORDED = Path(__file__).resolve().parents[3] / "shared" / "data" / "test_freebvh.bvh"
KEYS = sm.examples.random_keyframes(7, 150, seed=3)
MOVES = ("Xposition", "Yposition", "Zposition")


def same(one: Skeleton, other: Skeleton) -> bool:
    return (
        one.names == other.names
        and all(np.array_equal(a.offset, b.offset) for a, b in zip(one.joints, other.joints, strict=True))
        and [(j.parent, j.channels) for j in one.joints] == [(j.parent, j.channels) for j in other.joints]
        and np.array_equal(one.motion, other.motion)
        and one.frame_time == other.frame_time
    )


@pytest.mark.skipif(not RECORDED.is_file(), reason="recorded data are not there")
def test_a_recorded_skeleton_comes_back_bit_for_bit(tmp_path):
    skeleton = read_bvh(RECORDED)
    write_bvh(skeleton, tmp_path / "a.bvh")
    assert same(read_bvh(tmp_path / "a.bvh"), skeleton)


def test_joints_come_in_the_order_of_the_tree(tmp_path):
    """Breadth first here, depth first in the file: each joint keeps its channels."""
    rng = np.random.default_rng(2)
    joints = (
        Joint("hip", -1, np.array([0.1, 0.2, 0.3]), (*MOVES, "Yrotation")),
        Joint("left leg", 0, np.array([1.0, 0, 0]), ("Xrotation",)),
        Joint("right leg", 0, np.array([-1.0, 0, 0]), ("Zrotation", "Xrotation")),
        Joint("left leg end", 1, np.array([0, -1.0, 0]), ()),
        Joint("right foot", 2, np.array([0, -1.5, 0]), ()),
    )
    skeleton = Skeleton(joints, rng.uniform(-90, 90, (4, 7)), 0.1)
    write_bvh(skeleton, tmp_path / "a.bvh")
    back = read_bvh(tmp_path / "a.bvh")
    assert back.names == ("hip", "left leg", "left leg end", "right leg", "right foot")
    order = [back.index(name) for name in skeleton.names]
    np.testing.assert_array_equal(joint_trajectories(back)[:, order], joint_trajectories(skeleton))


def test_added_offsets_are_written_as_most_programs_read_them(tmp_path):
    joints = (
        Joint("hip", -1, np.array([1.0, 2, 3]), (*MOVES, "Yrotation")),
        Joint("head", 0, np.array([0, 5.0, 0]), (*MOVES, "Xrotation")),
    )
    motion = np.array([[0, 0, 0, 10, 0, 0.1, 0, 20], [1, 2, 3, 40, 0.5, 1, 0, 70.0]])
    added = Skeleton(joints, motion, 0.5, "add")
    write_bvh(added, tmp_path / "a.bvh")
    back = read_bvh(tmp_path / "a.bvh")
    assert back.offsets == "replace"
    np.testing.assert_allclose(joint_trajectories(back), joint_trajectories(added), atol=1e-14)


def test_keyframes_come_back(tmp_path):
    path = tmp_path / "a.bvh"
    sm.write_keyframes(KEYS, path)
    back = sm.read_keyframes(path)
    np.testing.assert_array_equal(back.translation, KEYS.translation)
    np.testing.assert_array_equal(back.times, KEYS.times - KEYS.times[0])
    np.testing.assert_allclose(back.linear, KEYS.linear, atol=1e-15)
    printed = read_bvh(path)
    turns = Rotation.from_euler("ZXY", printed.motion[:, 3:], degrees=True)
    np.testing.assert_allclose((turns.inv() * KEYS.rotations()).magnitude(), 0, atol=1e-7)
    assert np.abs(np.diff(printed.motion[:, 3:], axis=0)).max() <= 180
    write_bvh(printed, tmp_path / "b.bvh")
    assert (tmp_path / "b.bvh").read_bytes() == path.read_bytes()


def test_a_turn_where_euler_angles_are_not_one(tmp_path):
    turns = Rotation.from_euler("ZXY", [[10, 90, 20], [30, -90, 50], [5, 89.9999, 7]], degrees=True)
    keys = sm.Keyframes([0.0, 1.0, 2.0], turns.as_matrix())
    write_bvh(keys, tmp_path / "a.bvh")
    np.testing.assert_allclose(sm.read_keyframes(tmp_path / "a.bvh").linear, keys.linear, atol=1e-12)


@pytest.mark.parametrize("rate", [None, 25])
def test_motions_are_sampled(tmp_path, rate):
    turning = sm.quaternions.interpolate_quaternions(KEYS)
    motion = sm.motions.PoseMotion(turning, sm.splines.cubic_interpolant(KEYS.times, KEYS.translation))
    sm.write_motion(motion, tmp_path / "a.bvh", rate=rate)
    back = sm.read_keyframes(tmp_path / "a.bvh")
    assert len(back) == (200 if rate is None else 151)
    np.testing.assert_allclose(back.linear, motion(back.times).linear, atol=1e-13)
    np.testing.assert_allclose(back.translation, motion(back.times).translation, atol=1e-13)


def test_several_bodies_hang_from_one_root(tmp_path):
    other = sm.examples.random_keyframes(7, 40, seed=5)
    write_bvh({"left": KEYS, "right": other}, tmp_path / "a.bvh")
    for name, keys in (("left", KEYS), ("right", other)):
        back = sm.read_keyframes(tmp_path / "a.bvh", node=name)
        np.testing.assert_allclose(back.linear, keys.linear, atol=1e-15)
        np.testing.assert_array_equal(back.translation, keys.translation)


UNEVEN = sm.Keyframes([0.0, 1.0, 3.0], KEYS.linear[:3])


@pytest.mark.parametrize(
    ("motion", "options", "message"),
    [
        (UNEVEN, {}, "a.bvh: bvh has frames at equal steps of time, and these are not: `symmotion smooth`"),
        (sm.Keyframes([0.0, 1.0], 2 * KEYS.linear[:2]), {}, "a.bvh: bvh holds rigid 3D keyframes: position . is"),
        (sm.Keyframes([0.0, 1.0], np.tile(np.eye(2), (2, 1, 1))), {}, "a.bvh: bvh holds rigid 3D keyframes: a"),
        (KEYS, {"rate": 3}, "a.bvh: rate and orthonormalise are of motions"),
        ({"a": KEYS, "b": KEYS[:4]}, {}, "a.bvh, b: bodies of one file have the same times"),
        ({}, {}, "a.bvh: keyframes, or keyframes by the names of bodies"),
        ({"a {": KEYS}, {}, r"a.bvh: joint 1 is called 'a \{': a name in one line"),
        (sm.interpolants.component_cubic(KEYS), {}, "a.bvh: the motion is not rigid at time"),
        (3, {}, "a int is no motion"),
    ],
)  # fmt: skip
def test_what_cannot_be_written(tmp_path, monkeypatch, motion, options, message):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(InputError, match=message):
        write_bvh(motion, "a.bvh", **options)
    assert not list(tmp_path.iterdir())


def test_names_of_joints_stand_in_one_line(tmp_path):
    skeleton = Skeleton((Joint("hip", -1, np.zeros(3), ("Xrotation",)),), np.zeros((2, 1)), 0.1)
    broken = replace(skeleton, joints=(replace(skeleton.joints[0], name="a\nb"),))
    with pytest.raises(InputError, match="joint 0 is called"):
        write_bvh(broken, tmp_path / "a.bvh")
