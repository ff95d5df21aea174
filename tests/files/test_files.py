"""Keyframes and motions in and out of files: round trips, recorded data read two ways, and what bad input gets."""

import csv
import json
import os
from pathlib import Path

import numpy as np
import pytest
from movements import MOTIONS
from scipy.spatial.transform import Rotation

from symmotion.bodies.places import Turned
from symmotion.errors import InputError
from symmotion.files import read_keyframes, read_motion, write_keyframes, write_motion
from symmotion.loading import load
from symmotion.motions import AffineMotion, Keyframes
from symmotion.motions.examples import random_keyframes
from symmotion.motions.interpolants import slerp_curve
from symmotion.motions.quaternions import interpolate_quaternions
from symmotion.splines import BSplineBasis
from symmotion.whole import whole_file

RECORDED = Path(__file__).resolve().parents[3] / "shared" / "data"
POSE = "0 0 0 0 0 0 0 1\n"


def affine_keyframes(dimension: int, times=None) -> Keyframes:
    rng = np.random.default_rng(dimension)
    times = np.cumsum(rng.uniform(0.1, 1, 7)) if times is None else times
    m = len(times)
    return Keyframes(times, rng.normal(size=(m, dimension, dimension)), rng.normal(size=(m, dimension)))


def rigid_keyframes() -> Keyframes:
    rng = np.random.default_rng(5)
    rotations = Rotation.random(9, random_state=7)
    return Keyframes(1e9 + np.cumsum(rng.uniform(0.01, 1, 9)), rotations.as_matrix(), rng.normal(size=(9, 3)))


def turning_motion(dimension: int = 3) -> AffineMotion:
    """A cubic that is rigid at no inner time: controls are rotations about the last axis, or plane ones."""
    angles = np.linspace(0, 2, 6)
    linear = np.tile(np.eye(dimension), (6, 1, 1))
    linear[:, :2, :2] = np.stack([np.cos(angles), -np.sin(angles), np.sin(angles), np.cos(angles)], 1).reshape(-1, 2, 2)
    basis = BSplineBasis.clamped([0, 0.3, 1.1, 2], 3)
    return AffineMotion(basis, linear, np.random.default_rng(1).normal(size=(6, dimension)))


def sliding_motion(*linear) -> AffineMotion:
    """A linear Bézier motion over times 0 to 2 between two diagonal linear parts."""
    return AffineMotion(BSplineBasis.clamped([0, 2], 1), np.array([np.diag(entries) for entries in linear]))


def assert_same(read: Keyframes, written: Keyframes) -> None:
    np.testing.assert_array_equal(read.times, written.times)
    np.testing.assert_array_equal(read.linear, written.linear)
    np.testing.assert_array_equal(read.translation, written.translation)


@pytest.fixture
def file(tmp_path, monkeypatch):
    """Writes a file into an empty working directory, so that messages show its bare name."""
    monkeypatch.chdir(tmp_path)

    def write(name: str, content: str | bytes) -> str:
        Path(name).write_bytes(content if isinstance(content, bytes) else content.encode())
        return name

    return write


def recorded(name: str) -> Path:
    if not (RECORDED / name).exists():
        pytest.skip(f"recorded data {name} is not beside the checkout")
    return RECORDED / name


# Keyframes there and back


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("name", ["keys.csv", "keys.json", "KEYS.JSON"])
def test_affine_keyframes_come_back_exactly(tmp_path, name, dimension):
    keyframes = affine_keyframes(dimension)
    write_keyframes(keyframes, tmp_path / name)
    assert_same(read_keyframes(tmp_path / name), keyframes)


@pytest.mark.parametrize("name", ["keys.kitti", "keys.txt"])
def test_kitti_comes_back_exactly(tmp_path, name):
    keyframes = affine_keyframes(3, times=np.arange(5.0))
    write_keyframes(keyframes, tmp_path / name, format="kitti")
    assert_same(read_keyframes(tmp_path / name), keyframes)


@pytest.mark.parametrize("name", ["keys.tum", "keys.txt"])
def test_tum_comes_back_up_to_rounding_of_the_rotations(tmp_path, name):
    keyframes = rigid_keyframes()
    write_keyframes(keyframes, tmp_path / name, format="tum")
    read = read_keyframes(tmp_path / name)
    np.testing.assert_array_equal(read.times, keyframes.times)
    np.testing.assert_array_equal(read.translation, keyframes.translation)
    np.testing.assert_allclose(read.linear, keyframes.linear, rtol=0, atol=2e-15)


def test_kitti_is_the_matrix_row_by_row_and_tum_is_scalar_last(file):
    kitti = read_keyframes(file("a.kitti", "1 2 3 4 5 6 7 8 9 10 11 12\n" * 2))
    np.testing.assert_array_equal(kitti.linear[0], [[1, 2, 3], [5, 6, 7], [9, 10, 11]])
    np.testing.assert_array_equal(kitti.translation[0], [4, 8, 12])
    np.testing.assert_array_equal(kitti.times, [0, 1])
    tum = read_keyframes(file("a.tum", "0.5 1 2 3 1 0 0 0\n" + "2.5 1 2 3 0 0 0 1\n"))
    np.testing.assert_allclose(tum.linear, [np.diag([1, -1, -1]), np.eye(3)], atol=1e-16)
    np.testing.assert_array_equal(tum.times, [0.5, 2.5])
    np.testing.assert_array_equal(tum.translation[1], [1, 2, 3])


@pytest.mark.parametrize(
    "header, row, linear, translation",
    [
        ("x,y,theta", "1,2,0.5", [[np.cos(0.5), -np.sin(0.5)], [np.sin(0.5), np.cos(0.5)]], [1, 2]),
        (" Theta , Note", "0, left alone", np.eye(2), [0, 0]),
        ("qw,qx,qy,qz", "0,0,0,1", np.diag([-1, -1, 1]), [0, 0, 0]),
        ("qx,qy,qz,qw,tx,ty,tz", "0,1,0,0,7,8,9", np.diag([-1, 1, -1]), [7, 8, 9]),
        ("a22;a12;a21;a11;v1;v2", "4;2;3;1;5;6", [[1, 2], [3, 4]], [5, 6]),
        (
            "a11,a12,a13,a21,a22,a23,a31,a32,a33,x,y,z",
            "1,2,3,4,5,6,7,8,9,0,1,2",
            np.arange(1, 10).reshape(3, 3),
            range(3),
        ),
        ('"x"\t"y"\t"theta"', '"1"\t"2"\t0', np.eye(2), [1, 2]),
        ("\ufeffx,y,theta", "1,2,0", np.eye(2), [1, 2]),
    ],
)
@pytest.mark.parametrize("newline", ["\n", "\r\n", "\n\n"])
def test_csv_columns(file, header, row, linear, translation, newline):
    keyframes = read_keyframes(file("a.csv", newline.join([header, row, row, row])))
    np.testing.assert_array_equal(keyframes.times, [0, 1, 2])
    np.testing.assert_allclose(keyframes.linear[2], linear, atol=1e-16)
    np.testing.assert_array_equal(keyframes.translation[2], translation)


@pytest.mark.parametrize("name", ["t", "TIME", " timestamp"])
def test_csv_times(file, name):
    assert read_keyframes(file("a.csv", f"{name},theta\n-1,0\n2.5,1\n")).times.tolist() == [-1, 2.5]


def test_json_leaves_out_times_and_translation(file):
    keyframes = read_keyframes(file("a.json", json.dumps({"linear": [[[1, 2], [3, 4]], [[5, 6], [7, 8]]]})))
    assert_same(keyframes, Keyframes(np.arange(2), np.arange(1.0, 9).reshape(2, 2, 2)))


def test_given_times_format_and_delimiter_replace_what_the_file_shows(file):
    name = file("poses.log", (POSE * 3).replace(" ", "|"))  # its own times repeat
    assert read_keyframes(name, "tum", [1, 2, 4], "|").times.tolist() == [1, 2, 4]


def test_comments_blank_lines_and_nearly_unit_quaternions_are_read(file):
    name = file("a.tum", "# t x\n\n0 0 0 0 0 0 0 1.0009\n  \t\n1 0 0 0 0 0 0 1 # the end\n")
    np.testing.assert_allclose(read_keyframes(name).linear, [np.eye(3)] * 2, atol=1e-16)


# Recorded data, read a second way


@pytest.mark.parametrize("name, poses", [("freiburg1_xyz-groundtruth.txt", 3000), ("freiburg1_xyz-rgbdslam.txt", 788)])
def test_recorded_tum(tmp_path, name, poses):
    keyframes = read_keyframes(recorded(name))
    columns = np.loadtxt(recorded(name))
    assert len(keyframes) == len(columns) == poses
    np.testing.assert_array_equal(keyframes.times, columns[:, 0])
    np.testing.assert_array_equal(keyframes.translation, columns[:, 1:4])
    np.testing.assert_allclose(keyframes.linear, Rotation.from_quat(columns[:, 4:]).as_matrix(), atol=1e-15)
    write_keyframes(keyframes, tmp_path / "again.tum")
    np.testing.assert_allclose(read_keyframes(tmp_path / "again.tum").linear, keyframes.linear, atol=2e-15)


def test_recorded_csv():
    name = recorded("reconstruction_odometry.csv")
    with open(name) as handle:
        columns = np.array(list(csv.reader(handle))[1:], dtype=float)
    keyframes = read_keyframes(name)
    np.testing.assert_array_equal(keyframes.times, np.arange(717))
    np.testing.assert_array_equal(keyframes.translation, columns[:, :3])
    np.testing.assert_allclose(keyframes.linear, Rotation.from_quat(columns[:, 3:]).as_matrix(), atol=1e-15)


# What bad keyframe files get

MATRIX = "[[1, 0], [0, 1]]"


@pytest.mark.parametrize(
    "name, content, message",
    [
        ("a.tum", "", "a.tum: is empty"),
        ("a.tum", "# nothing\n\n", "a.tum: holds no keyframes"),
        ("a.csv", "theta\n", "a.csv: holds no keyframes"),
        ("a.tum", POSE, "a.tum: 1 keyframe: a motion needs at least 2"),
        ("a.tum", POSE + "\n1 0 0 0 0 0 1\n", "a.tum, line 3: 7 columns, not 8"),
        ("a.kitti", POSE, "a.kitti, line 1: 8 columns, not 12"),
        ("a.tum", POSE + "1 0 0 o 0 0 0 1\n", "a.tum, line 2: 'o' is not a number"),
        ("a.tum", POSE + "1 1_0 0 0 0 0 0 1\n", "a.tum, line 2: '1_0' is not a number"),
        ("a.tum", "#\n" + POSE + "1 0 0 0 nan 0 0 1\n", "a.tum, line 3: 'nan' is not finite"),
        ("a.kitti", "1 " * 11 + "inf\n", "a.kitti, line 1: 'inf' is not finite"),
        ("a.tum", POSE + "1 0 0 0 0 0 0 0\n", "a.tum, line 2: a quaternion of norm 0: unit quaternions"),
        ("a.tum", POSE + "1 0 0 0 0 0 0 1.002\n", "a.tum, line 2: a quaternion of norm 1.002"),
        ("a.tum", "#\n3.2" + POSE[1:] + "\n3.2" + POSE[1:],
         "a.tum, line 4: time 3.2 repeats that of line 2: times must increase; leave one of them out"),
        ("a.tum", POSE + "-1" + POSE[1:], "a.tum, line 2: time -1.0 comes before that of line 1"),
        ("a.tum", b"0 0 \xff", "a.tum: is not UTF-8 text .* save it as UTF-8"),
        ("a.txt", "#\n1 2 3\n", "a.txt, line 2: 3 columns; 8 make it tum and 12 kitti"),
        ("a.txt", "# only\n", "a.txt, line 1: 0 columns"),
        ("a.obj", POSE, "a.obj: format 'obj' is unknown; there are tum, kitti, csv, json"),
        ("a", POSE, "a: format '' is unknown"),
        ("a.csv", "\n\n", r"a.csv: of the columns \(\) none would be the linear part: it takes exactly qx qy qz qw, "),
        ("a.csv", "t,x,y,z\n", r"a.csv: of the columns \(t, x, y, z\) none would be the linear part"),
        ("a.csv", "qx,qy,qz\n", "a.csv: .* qx, qy, qz would be the linear part"),
        ("a.csv", "qx,qy,qz,qw,theta\n", "a.csv: .* qx, qy, qz, qw, theta would be the linear part"),
        ("a.csv", "a11,a12,a21,a22,a33\n", "a.csv: .* a11, a12, a21, a22, a33 would be the linear part"),
        ("a.csv", "theta,theta\n", "a.csv: .* theta, theta would be the linear part"),
        ("a.csv", "t,time,theta\n", "a.csv: .* t, time would be the time: it takes exactly t, or time, or timestamp"),
        ("a.csv", "x,y,tx,ty,theta\n", "a.csv: .* x, y, tx, ty would be the translation"),
        ("a.csv", "x,y,z,theta\n", "a.csv: .* x, y, z would be the translation: it takes exactly x y, or tx ty"),
        ("a.csv", "x,y,qx,qy,qz,qw\n", "a.csv: .* x, y would be the translation: it takes exactly x y z, or"),
        ("a.csv", "theta,note\n0,a\n1\n", "a.csv, line 3: 1 columns, not 2"),
        ("a.csv", "theta;x;y\n0;0;0\n\n0,5,1;0;0\n", "a.csv, line 4: '0,5,1' is not a number"),
        ("a.csv", "t,theta\n0,0\n\n0,1\n", "a.csv, line 4: time 0.0 repeats that of line 2"),
        ("a.csv", 'theta,note\n0,"' + "x" * 200_000, "a.csv, line 2: field larger than field limit"),
        ("a.json", '{"linear": [\n1,, 2]}', "a.json, line 2, column 3: "),
        ("a.json", "[" * 100_000, "a.json: its lists are nested too deeply"),
        ("a.json", "[1]", "a.json: a JSON object"),
        ("a.json", '{"times": [0, 1]}', r"a.json: missing linear \(the entries are linear, times, translation\)"),
        ("a.json", f'{{"linear": [{MATRIX}], "translations": []}}', "a.json: unknown translations"),
        ("a.json", '{"linear": []}', "a.json, linear: a list is needed"),
        ("a.json", '{"linear": [1, 2]}', r"a.json: linear parts of shape \(2,\)"),
        ("a.json", f'{{"linear": [{MATRIX}, [[1, 0], [0]]]}}', r"a.json, linear\[1\]: numbers are needed"),
        ("a.json", f'{{"linear": [{MATRIX}, [["1", 0], [0, 1]]]}}', r"a.json, linear\[1\]: numbers are needed"),
        ("a.json", f'{{"linear": [{MATRIX}, [[null, 0], [0, 1]]]}}', r"a.json, linear\[1\]: numbers are needed"),
        ("a.json", f'{{"linear": [{MATRIX}, [[1, 0]]]}}', r"a.json, linear\[1\]: shape \(1, 2\) where \(2, 2\)"),
        ("a.json", f'{{"linear": [{MATRIX}, [[1, 0], [0, NaN]]]}}', r"a.json, linear\[1\]: a number is not finite"),
        ("a.json", f'{{"linear": [{MATRIX}, {MATRIX}], "times": [2, 1]}}',
         r"a.json, times\[1\]: time 1.0 comes before that of times\[0\]"),
        ("a.json", f'{{"linear": [{MATRIX}, {MATRIX}], "times": [0, 1, 2]}}', "a.json: 3 times for 2 linear parts"),
        ("a.json", f'{{"linear": [{MATRIX}, {MATRIX}], "times": [[1, 2], [1, 1]]}}', "a.json: times of shape"),
        ("a.json", f'{{"linear": [{MATRIX}]}}', "a.json: 1 keyframe: a motion needs at least 2"),
    ],
)  # fmt: skip
def test_bad_keyframe_files_name_the_file_and_the_place(file, name, content, message):
    with pytest.raises(InputError, match=f"^{message}") as caught:
        read_keyframes(file(name, content))
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    "options, message",
    [
        ({"format": "obj"}, "a.tum: format 'obj' is unknown; there are tum, kitti, csv, json"),
        ({"node": "hip"}, "a.tum: tum has no node: it goes with csv, bvh, glb, gltf"),
        ({"delimiter": "::"}, "delimiter '::': one character is needed"),
        ({"delimiter": ""}, "delimiter '': one character is needed"),
        ({"times": [0, 1, 2]}, "a.tum: 3 times for 2 linear parts"),
        ({"times": [1, 1]}, "a.tum: the time of keyframe 1, 1, repeats that of keyframe 0"),
    ],
)
def test_bad_reading_options(file, options, message):
    with pytest.raises(InputError, match=message):
        read_keyframes(file("a.tum", POSE + "1" + POSE[1:]), **options)


def test_files_that_are_none_or_too_large(file, tmp_path):
    with open("large.tum", "wb") as handle:
        handle.truncate(512 * 2**20 + 1)
    for name, message in (
        ("missing.tum", "missing.tum: cannot be read: No such file"),
        (".", r"\.: is a directory or a device; name a file"),
        ("large.tum", "large.tum: has 512 MB; split it"),
    ):
        with pytest.raises(InputError, match=f"^{message}"):
            read_keyframes(name, "tum")


# What keyframes that a format cannot hold get


@pytest.mark.parametrize(
    "name, keyframes, message",
    [
        ("a.tum", affine_keyframes(2), "a.tum: tum holds rigid 3D keyframes: .* write csv or json"),
        (
            "a.tum",
            rigid_keyframes().moved(4, linear=2 * np.eye(3)),
            "a.tum: .* position 4 is not rigid.* write csv or json",
        ),
        ("a.tum", rigid_keyframes().moved(3, linear=-np.eye(3)), "a.tum: .* position 3 is reflected"),
        ("a.kitti", affine_keyframes(2), "a.kitti: kitti holds 3D keyframes; write csv or json"),
        ("a.kitti", affine_keyframes(3), "a.kitti: kitti has no times, .* write csv or json"),
        ("a.txt", affine_keyframes(3), "a.txt: format 'txt' is unknown; there are tum, kitti, csv, json"),
    ],
)
def test_formats_refuse_what_they_cannot_hold(tmp_path, monkeypatch, name, keyframes, message):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(InputError, match=f"^{message}"):
        write_keyframes(keyframes, name)
    assert not list(tmp_path.iterdir())


# Motions


def periodic_motion() -> AffineMotion:
    rng = np.random.default_rng(3)
    return AffineMotion(
        BSplineBasis.closed([0, 1, 2.5, 3, 4, 5], 2), rng.normal(size=(5, 2, 2)), rng.normal(size=(5, 2))
    )


@pytest.mark.parametrize("motion", [turning_motion(2), turning_motion(3), periodic_motion()], ids=repr)
def test_a_motion_comes_back_exactly(tmp_path, motion):
    write_motion(motion, tmp_path / "m.json")
    read = read_motion(tmp_path / "m.json")
    assert isinstance(read, AffineMotion)
    assert (read.degree, read.basis.periodic) == (motion.degree, motion.basis.periodic)
    np.testing.assert_array_equal(read.basis.knots, motion.basis.knots)
    np.testing.assert_array_equal(read.linear, motion.linear)
    np.testing.assert_array_equal(read.translation, motion.translation)


@pytest.mark.parametrize(
    "options, times",
    [
        ({}, np.linspace(0, 2, 200)),
        ({"times": [0.5, 1.25, 2]}, [0.5, 1.25, 2]),
        ({"rate": 10}, np.arange(21) / 10),
        ({"rate": 0.75}, [0, 4 / 3]),
    ],
)
@pytest.mark.parametrize("dimension", [2, 3])
def test_csv_holds_samples_of_the_motion(tmp_path, options, times, dimension):
    motion = turning_motion(dimension)
    write_motion(motion, tmp_path / "m.csv", **options)
    read = read_keyframes(tmp_path / "m.csv")
    np.testing.assert_allclose(read.times, times, rtol=1e-15)
    np.testing.assert_array_equal(read.linear, motion(read.times).linear)
    np.testing.assert_array_equal(read.translation, motion(read.times).translation)


def test_tum_holds_a_rigid_motion_or_the_closest_rotations(tmp_path):
    rigid = sliding_motion([1, 1, 1], [1 + 1e-7, 1, 1])
    write_motion(rigid, tmp_path / "rigid.tum", rate=1)
    np.testing.assert_allclose(read_keyframes(tmp_path / "rigid.tum").linear, [np.eye(3)] * 3, atol=1e-15)
    motion, times = turning_motion(), np.array([0.1, 0.9, 1.7])
    write_motion(motion, tmp_path / "m.tum", times=times, orthonormalise=True)
    read = read_keyframes(tmp_path / "m.tum")
    # The orthogonal polar factor R of A is the one with RᵀA symmetric and positive definite.
    stretch = read.linear.transpose(0, 2, 1) @ motion(times).linear
    np.testing.assert_allclose(stretch, stretch.transpose(0, 2, 1), atol=1e-14)
    assert (np.linalg.eigvalsh(stretch) > 0).all()
    np.testing.assert_array_equal(read.translation, motion(times).translation)


FLIP = sliding_motion([1, 1, 1], [-1, 1, 1])


@pytest.mark.parametrize(
    "motion, name, options, message",
    [
        (turning_motion(), "m.tum", {"times": [0, 0.75]}, "m.tum: the motion is not rigid at time 0.75: ortho"),
        (FLIP, "m.tum", {"times": [0, 1], "orthonormalise": True}, "m.tum: the motion is singular at time 1.0"),
        (FLIP, "m.tum", {"times": [0, 1.5]}, "m.tum: the motion is reflected at time 1.5"),
        (turning_motion(2), "m.tum", {"orthonormalise": True}, "m.tum: .*three dimensions; write csv or json"),
        (turning_motion(), "m.json", {"rate": 3}, "m.json: json has no rate: it goes with csv, tum"),
        (turning_motion(), "m.csv", {"orthonormalise": True}, "m.csv: csv has no orthonormalise: it goes with tum"),
        (turning_motion(), "m.csv", {"rate": 3, "times": [0, 1]}, "times and rate .* give one"),
        (turning_motion(), "m.csv", {"rate": -1}, "rate -1: a positive number"),
        (turning_motion(), "m.csv", {"rate": 1e9}, "rate 1e[+]09 makes 2e[+]09 steps"),
        (turning_motion(), "m.csv", {"rate": np.nan}, "rate nan: a positive number"),
        (turning_motion(), "m.csv", {"times": [0, 3]}, "parameter 3 is outside the domain"),
        (turning_motion(), "m.csv", {"times": [1, 0]}, "the time of sample 1, 0, comes before that of sample 0"),
        (turning_motion(), "m.kitti", {}, "m.kitti: format 'kitti' is unknown; there are json, csv, tum"),
        (Turned(slerp_curve(rigid_keyframes())), "m.json", {},
         "m.json: json holds motions of AffineMotion, .*: a Turned does not go into it; write csv"),
        (sliding_motion([1, 1], [np.nan, 1]), "m.json", {}, "m.json: control 1 of the motion is not finite"),
    ],
)  # fmt: skip
def test_motions_that_cannot_be_written(tmp_path, monkeypatch, motion, name, options, message):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(InputError, match=f"^{message}"):
        write_motion(motion, name, **options)
    assert not list(tmp_path.iterdir())


def first_form(motion):
    """The JSON object that `write_motion` of 0.1.0 wrote."""
    basis = {"degree": motion.degree, "periodic": motion.basis.periodic, "knots": motion.basis.knots.tolist()}
    controls = {"linear": motion.linear.tolist(), "translation": motion.translation.tolist()}
    return {"symmotion": "affine-motion", "version": 1, **basis, **controls}


def test_a_motion_has_one_written_form_and_its_first_one_is_read(tmp_path):
    motion = turning_motion()
    write_motion(motion, tmp_path / "written.json")
    motion.save(tmp_path / "saved.json")
    assert (tmp_path / "written.json").read_bytes() == (tmp_path / "saved.json").read_bytes()
    (tmp_path / "first.json").write_text(json.dumps(first_form(motion)))
    for name in ("written.json", "first.json"):
        assert read_motion(tmp_path / name) == motion
        assert load(tmp_path / name) == motion


@pytest.mark.parametrize(
    "changes, message",
    [
        ({"symmotion": "keyframes"}, "m.json: symmotion is 'keyframes': 'value', as `save` writes it, is needed"),
        ({"version": 2}, "m.json: version is 2.0: 1 is needed"),
        ({"degree": None}, "m.json, degree: a whole number is needed"),
        ({"degree": 2.5}, "m.json, degree: a whole number is needed"),
        ({"degree": 9}, "m.json: 10 knots are too few for degree 9"),
        ({"periodic": 0}, "m.json, periodic: true or false is needed"),
        ({"knots": [0, 0, 0, 0, 2, 1, 3, 3, 3, 3]}, "m.json: knots decrease"),
        ({"knots": [0, "1"]}, r"m.json, knots\[1\]: numbers are needed"),
        ({"linear": [[[1, 0], [0, 1]]]}, r"m.json: control matrices of shape \(1, 2, 2\)"),
        ({"translation": [[0, 0]]}, r"m.json: control points of shape \(1, 2\)"),
        ({"extra": 1}, "m.json: unknown extra"),
    ],
)
def test_bad_motion_files_name_the_file_and_the_entry(tmp_path, monkeypatch, changes, message):
    monkeypatch.chdir(tmp_path)
    Path("m.json").write_text(json.dumps(first_form(turning_motion(2)) | changes))
    with pytest.raises(InputError, match=f"^{message}"):
        read_motion("m.json")


def test_keyframes_and_motions_are_not_mistaken_for_each_other(tmp_path):
    write_keyframes(affine_keyframes(2), tmp_path / "k.json")
    with pytest.raises(InputError, match="symmotion is None: 'value', as `save` writes it, is needed"):
        read_motion(tmp_path / "k.json")
    write_motion(turning_motion(2), tmp_path / "m.json")
    with pytest.raises(InputError, match="unknown symmotion, version, class, basis"):
        read_keyframes(tmp_path / "m.json")


# Whole or not at all


@pytest.mark.parametrize("binary, content", [(False, "Wörter\n"), (True, b"\x00\xff\r\n")])
def test_a_whole_file_appears_at_the_end_of_the_block(tmp_path, binary, content):
    path = tmp_path / "out"
    with whole_file(path, binary=binary) as handle:
        handle.write(content)
        assert not path.exists()
    assert path.read_bytes() == (content if binary else content.encode())
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize("before", [None, "kept"])
def test_a_failure_midway_leaves_everything_as_it_was(tmp_path, before):
    path = tmp_path / "out.csv"
    if before:
        path.write_text(before)
    with pytest.raises(ZeroDivisionError), whole_file(path) as handle:
        handle.write("half")
        handle.flush()
        raise ZeroDivisionError
    assert [p.read_text() for p in tmp_path.iterdir()] == ([before] if before else [])


def test_a_new_file_has_the_users_permissions_and_a_link_stays_one(tmp_path):
    (tmp_path / "plain").write_text("")
    os.symlink(tmp_path / "real", tmp_path / "link")
    with whole_file(tmp_path / "link") as handle:
        handle.write("through")
    assert (tmp_path / "link").is_symlink()
    assert (tmp_path / "real").read_text() == "through"
    assert (tmp_path / "real").stat().st_mode == (tmp_path / "plain").stat().st_mode


@pytest.mark.parametrize(
    "path, reason",
    [
        ("missing/out.json", "there is no directory .*missing; create it first"),
        ("folder", "it is a directory; name a file in it"),
        ("file/out.json", "there is no directory"),
        ("pipe", "it is a device or a pipe; name a file"),
        ("x" * 300, "File name too long"),
    ],
)
def test_places_that_cannot_be_written(tmp_path, monkeypatch, path, reason):
    monkeypatch.chdir(tmp_path)
    Path("folder").mkdir()
    Path("file").touch()
    os.mkfifo("pipe")
    with pytest.raises(InputError, match=f"^{path}: cannot be written: .*{reason}") as caught:
        write_keyframes(affine_keyframes(2), path, "json")
    assert "\n" not in str(caught.value)
    assert sorted(p.name for p in tmp_path.iterdir()) == ["file", "folder", "pipe"]


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write anywhere")
def test_read_only_places(tmp_path):
    (tmp_path / "fixed.csv").touch(mode=0o444)
    with pytest.raises(InputError, match=r"fixed.csv: cannot be written: the file there is read-only"):
        write_keyframes(affine_keyframes(2), tmp_path / "fixed.csv")
    tmp_path.chmod(0o555)
    with pytest.raises(InputError, match=r"new.csv: cannot be written: .*Permission denied"):
        write_keyframes(affine_keyframes(2), tmp_path / "new.csv")


def test_a_full_disk_is_an_input_error(tmp_path):
    with pytest.raises(InputError, match=r"out: cannot be written: .*No space left"), whole_file(tmp_path / "out"):
        raise OSError(28, "No space left on device")
    assert not list(tmp_path.iterdir())


def test_an_orientation_alone_is_sampled_about_the_origin(tmp_path):
    keys = random_keyframes(4, 60, seed=2)
    curve = interpolate_quaternions(keys.times, keys.rotations())
    for name in ("m.csv", "m.tum"):
        assert write_motion(curve, tmp_path / name) is None
        back = read_keyframes(tmp_path / name)
        np.testing.assert_allclose(back.linear, curve.rotation(back.times).as_matrix(), atol=1e-13)
        np.testing.assert_array_equal(back.translation, 0)


@pytest.mark.parametrize("name", MOTIONS)
def test_motions_of_every_class_come_back(tmp_path, name):
    motion = MOTIONS[name]
    write_motion(motion, tmp_path / "m.json")
    assert read_motion(tmp_path / "m.json") == motion
    write_motion(motion, tmp_path / "m.csv", rate=7)
    back = read_keyframes(tmp_path / "m.csv")
    np.testing.assert_allclose(back.linear, motion.matrix(back.times)[:, :-1, :-1], atol=1e-13)
