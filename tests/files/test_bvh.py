"""Skeletons out of BVH: worked examples, recorded data walked through a second way, and what broken files get."""

import tracemalloc
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from symmotion.errors import InputError
from symmotion.files import bvh, read_keyframes, read_recording
from symmotion.files.bvh import read_bvh
from symmotion.files.skeleton import Joint, Skeleton, joint_positions, joint_trajectories

RECORDED = Path(__file__).resolve().parents[3] / "shared" / "data" / "test_freebvh.bvh"
ARM = """\
HIERARCHY
ROOT Hip
{
  OFFSET 1 2 3
  CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation
  JOINT Upper arm {
    OFFSET 0 10 0
    CHANNELS 3 Xrotation Yrotation Zrotation
    End Site
    {
      OFFSET 5 0 0
    }
  }
  JOINT Tail
  {
    OFFSET 0 0 -4
    CHANNELS 1 Yrotation
    End Site
    {
      OFFSET 0 -1 0
    }
  }
}
MOTION
Frames: 3
Frame Time: 0.04
0 0 0 0 0 0 0 0 0 0
10 20 30 90 0 0 0 0 90 0
1 2 3 10 20 30 40 50 60 70
"""


@pytest.fixture
def file(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)

    def write(content: str | bytes, name: str = "a.bvh") -> str:
        Path(name).write_bytes(content if isinstance(content, bytes) else content.encode())
        return name

    return write


def test_a_worked_example(file):
    skeleton = read_bvh(file(ARM), offsets="add")
    assert skeleton.names == ("Hip", "Upper arm", "Upper arm end", "Tail", "Tail end")
    assert [j.parent for j in skeleton.joints] == [-1, 0, 1, 0, 3]
    np.testing.assert_allclose(skeleton.times, [0, 0.04, 0.08])
    places = joint_trajectories(skeleton)
    rest = [[1, 2, 3], [1, 12, 3], [6, 12, 3], [1, 2, -1], [1, 1, -1]]
    np.testing.assert_allclose(skeleton.rest, rest)
    np.testing.assert_allclose(places[0], rest, atol=1e-14)
    # Moved by (10, 20, 30), a quarter turn about z, and another one in the shoulder: up is left, the arm looks back.
    hip = np.array([11, 22, 33])
    np.testing.assert_allclose(
        places[1] - hip, [[0, 0, 0], [-10, 0, 0], [-15, 0, 0], [0, 0, -4], [1, 0, -4]], atol=1e-13
    )


def test_rotations_are_about_axes_that_turn_along(file):
    skeleton = read_bvh(file(ARM), offsets="add")
    rotations, places = joint_positions(skeleton, [1, 3])
    hip = Rotation.from_euler("ZXY", [10, 20, 30], degrees=True)
    arm = hip * Rotation.from_euler("XYZ", [40, 50, 60], degrees=True)
    tail = hip * Rotation.from_euler("Y", 70, degrees=True)
    np.testing.assert_allclose(rotations[2], [arm.as_matrix(), tail.as_matrix()], atol=1e-14)
    np.testing.assert_allclose(places[2, 0] - [2, 4, 6], hip.apply([0, 10, 0]), atol=1e-13)


def test_keyframes_of_a_joint(file):
    name = file(ARM)
    keys = read_keyframes(name, node="Tail")
    rotations, places = joint_positions(read_bvh(name), [3])
    np.testing.assert_array_equal(keys.linear, rotations[:, 0])
    np.testing.assert_array_equal(keys.translation, places[:, 0])
    np.testing.assert_allclose(read_keyframes(name).translation[1], [10, 20, 30])
    np.testing.assert_allclose(read_keyframes(name, offsets="add").translation[1], [11, 22, 33])
    np.testing.assert_allclose(read_keyframes(name, node=0, times=[0, 1, 5]).times, [0, 1, 5])
    assert len(read_keyframes(file(ARM, "b.txt"), format="bvh")) == 3


def test_words_may_be_spread_and_written_in_any_case(file):
    loose = ARM.replace("OFFSET 0 10 0", "offset 0\n\n10\t0").replace("\n", "\r\n").replace("Frames:", "FRAMES:")
    np.testing.assert_array_equal(joint_trajectories(read_bvh(file(loose))), joint_trajectories(read_bvh(file(ARM))))


def affinely_moved():
    """A file of joints that move freely, along an affine motion of the whole, and the motion."""
    lines = ["HIERARCHY"]
    rng = np.random.default_rng(2)
    rest = rng.normal(size=(6, 3))
    linear, translation = np.eye(3) + 0.3 * rng.normal(size=(5, 3, 3)), rng.normal(size=(5, 3))
    for k, place in enumerate(rest):
        offset = " ".join(map(repr, place.tolist()))
        lines.append(f"ROOT j{k} {{ OFFSET {offset} CHANNELS 3 Xposition Yposition Zposition }}")
    moved = translation[:, None] + rest @ linear.swapaxes(1, 2) - rest
    rows = [" ".join(map(repr, row)) for row in moved.reshape(5, -1).tolist()]
    return "\n".join([*lines, "MOTION", "Frames: 5", "Frame Time: 0.1", *rows]), linear, translation


def test_affine_keyframes_of_joints(file):
    text, linear, translation = affinely_moved()
    skeleton = read_bvh(file(text), offsets="add")
    for joints in (None, ["j0", "j3", "j4", "j5"]):
        fit = skeleton.affine_keyframes(joints)
        np.testing.assert_allclose(fit.keyframes.linear, linear, atol=1e-12)
        np.testing.assert_allclose(fit.keyframes.translation, translation, atol=1e-12)
        np.testing.assert_allclose(fit.deviations, 0, atol=1e-13)
    with pytest.raises(InputError, match="lie in a line or plane"):
        skeleton.affine_keyframes([0, 1, 2])


def recorded() -> Skeleton:
    if not RECORDED.exists():
        pytest.skip("recorded data is not beside the checkout")
    return read_bvh(RECORDED)


def test_recorded_skeleton():
    skeleton = recorded()
    assert (len(skeleton.motion), skeleton.motion.shape[1], skeleton.frame_time) == (69, 168, 0.0333333)
    text = RECORDED.read_text().split()
    assert len(skeleton.joints) == text.count("JOINT") + text.count("Site") + 1
    places = joint_trajectories(skeleton)
    # Bones keep their lengths.
    for i, joint in enumerate(skeleton.joints):
        if joint.parent >= 0:
            lengths = np.linalg.norm(places[:, i] - places[:, joint.parent], axis=1)
            np.testing.assert_allclose(lengths, np.linalg.norm(joint.offset), atol=1e-10)
    # From the leaf upwards with homogeneous matrices, instead of from the root downwards.
    first = np.cumsum([0, *(len(j.channels) for j in skeleton.joints)])
    for i in range(0, len(skeleton.joints), 7):
        point, k = np.array([0, 0, 0, 1.0]), i
        while k >= 0:
            joint, values = skeleton.joints[k], skeleton.motion[41, first[k] : first[k + 1]]
            matrix = np.eye(4)
            matrix[:3, 3] = joint.offset
            for name, value in zip(joint.channels, values, strict=True):
                step = np.eye(4)
                if "position" in name:
                    step["XYZ".index(name[0]), 3] = value
                else:
                    step[:3, :3] = Rotation.from_euler(name[0], value, degrees=True).as_matrix()
                matrix = matrix @ step
            point, k = matrix @ point, joint.parent
        np.testing.assert_allclose(places[41, i], point[:3], atol=1e-10)


def test_recorded_bodies_as_affine_keyframes():
    skeleton = recorded()
    fit = skeleton.affine_keyframes()
    linear, rest = fit.keyframes.linear, skeleton.rest
    residual = joint_trajectories(skeleton) - (fit.keyframes.translation[:, None] + rest @ linear.swapaxes(1, 2))
    # Least squares: the residual is orthogonal to the columns 1, x, y, z.
    np.testing.assert_allclose(residual.sum(axis=1), 0, atol=1e-9)
    np.testing.assert_allclose(residual.swapaxes(1, 2) @ rest, 0, atol=1e-7)
    np.testing.assert_allclose(fit.deviations, np.sqrt((residual**2).sum(axis=2).mean(axis=1)))
    assert fit.deviations.max() < 60 < np.ptp(rest, axis=0).max()  # arms that hang are far from arms held out


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("", "a.bvh: is empty"),
        ("MOTION", "a.bvh, line 1: 'MOTION' where HIERARCHY is needed"),
        ("HIERARCHY\nMOTION", "a.bvh, line 2: MOTION where ROOT is needed"),
        ("HIERARCHY\nROOT\n{", "a.bvh, line 2: a name is missing"),
        ("HIERARCHY\nJOINT a {", "a.bvh, line 2: 'JOINT' where ROOT or MOTION is needed"),
        ("HIERARCHY\nROOT a\n{\nOFFSET 1 2", "a.bvh, line 4: the file ends where an offset is needed"),
        (ARM.replace("0 10 0", "0 ten 0"), r"a.bvh, line 7: 'ten' is not a number \(an offset\)"),
        (ARM.replace("0 10 0", "0 1e999 0"), "a.bvh, line 7: '1e999' is not finite"),
        (ARM.replace("CHANNELS 1", "CHANNELS 1e9"), r"a.bvh, line 17: 1e\+09 channels: 0 to 6"),
        (ARM.replace("CHANNELS 1", "CHANNELS nan"), "a.bvh, line 17: 'nan' is not finite"),
        (ARM.replace("CHANNELS 1 Y", "CHANNELS 1 W"), "a.bvh, line 17: 'Wrotation' is no channel; there are Xposition"),
        (ARM.replace("CHANNELS 1 Y", "CHANNELS 2 Yrotation Y"), "a.bvh, line 17: a channel occurs twice"),
        (ARM.replace("CHANNELS 1 Y", "CHANNELS 2 Y"), "a.bvh, line 18: 'End' is no channel"),
        (ARM.replace("End Site", "End Effector"), "a.bvh, line 9: 'Effector' where Site is needed"),
        (ARM.replace("OFFSET 5 0 0", "OFFSET 5 0 0 0"), "a.bvh, line 11: '0' where JOINT, End Site or } is needed"),
        (ARM.replace("}\nMOTION", "MOTION"), "a.bvh, line 23: 'MOTION' where JOINT, End Site or } is needed"),
        (ARM.replace("}\nMOTION", "}\n}\nMOTION"), "a.bvh, line 24: '}' where ROOT or MOTION is needed"),
        (ARM.replace("Frames: 3", "Frames: 1000000000"), "a.bvh, line 29: the file ends after 3 of the 1e\\+09 frames"),
        (ARM.replace("Frames: 3", "Frames: 2"), "a.bvh, line 29: more than the 2 frames that the file claims"),
        (ARM.replace("Frames: 3", "Frames: 2.5"), "a.bvh, line 25: 2.5 frames: a whole number"),
        (ARM.replace("Frames: 3", "Frames: -3"), "a.bvh, line 25: -3 frames: a whole number"),
        (ARM.replace("Time: 0.04", "Time: 0"), "a.bvh, line 26: a frame time of 0: a positive"),
        (ARM.replace("Time: 0.04", "Time: 0.04 s"), "a.bvh, line 26: more than the frame time"),
        (ARM.replace("40 50", "40"), "a.bvh, line 29: 9 numbers for 10 channels"),
        (ARM.replace("40 50", "40 x50"), "a.bvh, line 29: 'x50' is not a number"),
        (ARM.replace("40 50", "40 5_0"), "a.bvh, line 29: '5_0' is not a number"),
        (ARM.replace("40 50", "40 NaN"), "a.bvh, line 29: 'NaN' is not finite"),
        (ARM.replace("10 20 30 90", "10 20 30 " + "9" * 2_000_000), "a.bvh, line 28: is longer than 1000000"),
        ("HIERARCHY ROOT a { OFFSET 0 0 0 CHANNELS 0 }\nMOTION", "a.bvh, line 2: the joints have no channels"),
        (b"HIERARCHY\n\xff", "a.bvh: is not UTF-8 text"),
    ],
)  # fmt: skip
def test_bad_files_name_the_line(file, content, message):
    with pytest.raises(InputError, match=f"^{message}"):
        read_bvh(file(content))


def test_deep_nesting_is_no_trouble(file):
    depth = 5000
    text = "HIERARCHY\nROOT a { OFFSET 0 0 0 CHANNELS 3 Xposition Yposition Zposition\n"
    text += "JOINT b { OFFSET 0 0 1 CHANNELS 0\n" * depth + "} " * (depth + 1)
    skeleton = read_bvh(file(text + "\nMOTION\nFrames: 2\nFrame Time: 1\n1 2 3\n4 5 6\n"))
    np.testing.assert_allclose(joint_trajectories(skeleton)[:, -1], [[1, 2, 3 + depth], [4, 5, 6 + depth]])


def test_claims_cost_no_memory(file):
    name = file(ARM.replace("Frames: 3", "Frames: 1000000000000"))
    tracemalloc.start()
    try:
        with pytest.raises(InputError, match="the file ends after 3"):
            read_bvh(name)
        assert tracemalloc.get_traced_memory()[1] < 10**6
    finally:
        tracemalloc.stop()


def test_small_files_cannot_ask_for_much(file):
    text = "HIERARCHY\nROOT a { OFFSET 0 0 0 CHANNELS 1 Xposition\n" + "End Site { OFFSET 0 0 0 }\n" * 20_000
    text += "}\nMOTION\nFrames: 1000\nFrame Time: 1\n" + "0\n" * 1000
    with pytest.raises(InputError, match=r"more than 1e\+07 positions of joints"):
        read_bvh(file(text))


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"motion": np.zeros((2, 3))}, r"frames of shape \(2, 3\): finite, shape \(F, 1\)"),
        ({"motion": np.full((2, 1), np.inf)}, "frames of shape .* finite"),
        ({"frame_time": 0.0}, "frame_time 0.0: a positive"),
        ({"joints": (Joint("a", 0, np.zeros(3), ("Xposition",)),)}, "joint 0, a: its parent 0 does not come before"),
        ({"joints": (Joint("a", -1, np.zeros(3), ("Wposition",)),)}, "joint 0, a: an offset .* and channels"),
    ],
)
def test_bad_skeletons(changes, message):
    good = {"joints": (Joint("a", -1, np.zeros(3), ("Xposition",)),), "motion": np.zeros((2, 1)), "frame_time": 1.0}
    assert repr(Skeleton(**good)) == "Skeleton(1 joints, 2 frames of 1 s)"
    with pytest.raises(InputError, match=message):
        Skeleton(**{**good, **changes})


def test_as_many_joints_as_a_file_may_have(file, monkeypatch):
    monkeypatch.setattr(bvh, "MOST_JOINTS", 4)
    with pytest.raises(InputError, match=r"a\.bvh, line 21: more than 4 joints"):
        read_bvh(file(ARM))


@pytest.mark.parametrize(
    ("node", "message"),
    [("Hand", "a.bvh: 0 joints are called 'Hand'; there are Hip, Upper arm"), (5, "a.bvh: joint 5 does not exist")],
)
def test_bad_joints(file, node, message):
    with pytest.raises(InputError, match=message):
        read_keyframes(file(ARM), node=node)


def test_joints_of_one_name_are_told_apart_by_index(file):
    name = file(ARM.replace("JOINT Tail", "JOINT Upper arm"))
    with pytest.raises(InputError, match=r"a\.bvh: 2 joints are called 'Upper arm'; give an index: 1, 3"):
        read_keyframes(name, node="Upper arm")
    assert len(read_keyframes(name, node=3)) == 3


def test_damaged_files_are_input_errors_or_read(file):
    rng = np.random.default_rng(5)
    data = ARM.encode()
    damaged = [data[:k] for k in range(1, len(data), 7)]
    for _ in range(300):
        changed = bytearray(data)
        for k in rng.integers(len(data), size=rng.integers(1, 4)):
            changed[k] = rng.integers(256)
        damaged.append(bytes(changed))
    read = 0
    for content in damaged:
        try:
            read += len(read_keyframes(file(content), node=0)) == 3
        except InputError as error:
            assert str(error).startswith("a.bvh")
    assert 0 < read < len(damaged)


# What exporters write otherwise

CHAIN = """\
HIERARCHY
ROOT Hips
{
  OFFSET 0 0 0
  CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation
  JOINT Knee
  {
    OFFSET 0 -10 0
    CHANNELS 3 Zrotation Xrotation Yrotation
    End Site
    {
      OFFSET 0 -8 0
    }
  }
}
MOTION
Frames: 3
Frame Time: 0.0333333
0 90 0 0 0 0 10 0 0
1 90 0 0 0 0 20 0 0
2 90 0 0 0 0 30 0 0
"""
FEW = CHAIN.replace("    CHANNELS 3 Zrotation Xrotation Yrotation\n", "")


@pytest.mark.parametrize(
    "text",
    [
        CHAIN.replace("Frames: 3", "Frames:3").replace("Frame Time: ", "Frame Time:"),
        CHAIN.replace("Frames: 3", "Frames : 3"),
        CHAIN.replace("OFFSET 0 -8 0", "OFFSET 0 -8 0\n      CHANNELS 0"),
        CHAIN.replace("End Site", "End Site toe_tip"),
        CHAIN.replace("0 0 0 0 10", "0 0 0 0\n10").replace("0 0 0 0 20", "0 0 0 0\n 20"),
        CHAIN + "# exported by X\n",
        FEW.replace(" 10 0 0\n", "\n").replace(" 20 0 0\n", "\n").replace(" 30 0 0\n", "\n"),
    ],
)
def test_spellings_of_headers_and_frames(file, text):
    keys = read_keyframes(file(text))
    np.testing.assert_array_equal(keys.translation, [[0, 90, 0], [1, 90, 0], [2, 90, 0]])


def test_another_number_of_frames_than_claimed(file):
    more, fewer = CHAIN.replace("Frames: 3", "Frames: 2"), CHAIN.replace("Frames: 3", "Frames: 4")
    for text, message in (
        (more, "more than the 2 frames .* frames='found' reads them"),
        (fewer, "ends after 3 of the 4"),
    ):
        with pytest.raises(InputError, match=message):
            read_keyframes(file(text))
        assert len(read_keyframes(file(text), frames="found")) == 3
    assert len(read_keyframes(file(more), frames="claimed")) == 2
    read = read_recording(file(fewer), frames="found")
    assert read.notes == ("3 frames are read where the file claims 4",)


def test_names_in_another_encoding(file):
    name = file(CHAIN.replace("Hips", "センター").encode("shift_jis"))
    with pytest.raises(InputError, match=r"is not UTF-8 text .* save it as UTF-8, or name its encoding"):
        read_bvh(name)
    assert read_bvh(name, encoding="shift_jis").names[0] == "センター"
    for encoding in ("no such", "base64", ""):
        with pytest.raises(InputError, match=r"encoding .* is unknown"):
            read_bvh(name, encoding=encoding)


@pytest.mark.parametrize(("first", "chosen", "place"), [("0 -10 0", "replace", -10), ("0 0 0", "add", -10)])
def test_what_position_channels_mean_is_told_by_the_first_frame(file, first, chosen, place):
    text = CHAIN.replace("CHANNELS 3 Zrotation", "CHANNELS 6 Xposition Yposition Zposition Zrotation")
    for k, angle in enumerate((10, 20, 30)):
        text = text.replace(f"{k} 90 0 0 0 0 {angle}", f"{k} 90 0 0 0 0 {first} {angle}")
    skeleton = read_bvh(file(text))
    assert skeleton.offsets == chosen
    np.testing.assert_allclose(joint_trajectories(skeleton)[0, 1], [0, 90 + place, 0])
    assert "in the first frame tell" in read_recording(file(text)).notes[0]
    other = {"replace": "add", "add": "replace"}[chosen]
    assert joint_trajectories(read_bvh(file(text), offsets=other))[0, 1, 1] == {"add": 70, "replace": 90}[other]
