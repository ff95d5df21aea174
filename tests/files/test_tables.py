"""Tables of poses as programs write them, cameras, repairs: the right poses, or a message that says what was read."""

import gzip
import json
import tracemalloc
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

import symmotion as sm
from symmotion.errors import InputError
from symmotion.files import read_keyframes, read_recording

TURNS = Rotation.from_euler("ZX", [[0, 0], [50, 20], [120, 10]], degrees=True)
PLACES = np.array([[0.0, 0, 0], [2, 1, 0], [4, 0, 1]])
TIMES = np.array([0.0, 1.0, 2.5])
QUATERNIONS = TURNS.as_quat()  # scalar last
STAMPS = 1403715524907143168 + np.array([0, 5_000_000, 12_500_000])
TUM = ["timestamp", "tx", "ty", "tz", "qx", "qy", "qz", "qw"]


@pytest.fixture
def file(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)

    def write(name: str, content: str | bytes) -> str:
        Path(name).write_bytes(content.encode() if isinstance(content, str) else content)
        return name

    return write


def table(header, columns, mark=",", end="\n") -> str:
    """A text of columns under a header, without a newline at its end."""
    rows = [mark.join(str(x) for x in row) for row in zip(*columns, strict=True)]
    return end.join([*([header if isinstance(header, str) else mark.join(header)] if header else []), *rows])


def assert_poses(keys: sm.Keyframes, times: ArrayLike = TIMES):
    np.testing.assert_allclose(keys.times - keys.times[0], np.asarray(times), atol=3e-7)
    np.testing.assert_allclose(keys.translation, PLACES, atol=1e-12)
    np.testing.assert_allclose(keys.linear, TURNS.as_matrix(), atol=1e-12)


PLAIN = [TIMES, *PLACES.T, *QUATERNIONS.T]
FIRST = [TIMES, *PLACES.T, *QUATERNIONS[:, [3, 0, 1, 2]].T]  # scalar first
NUMBERED = [range(3), *PLAIN]
WHOLE = np.tile(np.eye(4), (3, 1, 1))
WHOLE[:, :3, :3], WHOLE[:, :3, 3] = TURNS.as_matrix(), PLACES
ROLLS = TURNS.as_euler("ZYX")[:, ::-1].T
EUROC = "#timestamp, p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_w [], q_RS_x [], q_RS_y [], q_RS_z [], v_x [m s^-1]"
BAG = [f"field.pose.position.{a}" for a in "xyz"] + [f"field.pose.orientation.{a}" for a in "xyzw"]


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("a.tum", table(TUM, PLAIN, " ")),
        ("a.tum", table("", PLAIN, ",")),
        ("a.tum", table("", PLAIN, ", ")),
        ("a.tum", table("", PLAIN, ";").replace(".", ",")),
        ("a.tum", table("", PLAIN, "\t")),
        ("a.tum", table("", NUMBERED, " ")),
        ("a.tum", table("# timestamp tx ty tz qw qx qy qz", FIRST, " ")),
        ("a.txt", table("", PLAIN, " ").replace(".", ",")),
        ("a.csv", table("", PLAIN)),
        ("a.csv", table("t,x,y,z,qx,qy,qz,qw", PLAIN)),
        ("a.csv", "# by a tool\n" + table("t,x,y,z,qx,qy,qz,qw", PLAIN)),
        ("a.csv", table("t;x;y;z;qx;qy;qz;qw", PLAIN, ";").replace(".", ",")),
        ("a.csv", table(TUM, PLAIN, " ")),
        ("a.csv", table("timestamp,p_x,p_y,p_z,q_w,q_x,q_y,q_z", FIRST)),
        ("a.csv", table("index,time[s],px [m],py [m],pz [m],qx,qy,qz,qw", NUMBERED)),
        ("a.csv", table("time [ms],x [mm],y [cm],z [km],qx,qy,qz,qw",
                        [1e3 * TIMES, *(PLACES * [1e3, 1e2, 1e-3]).T, *QUATERNIONS.T])),
        ("a.csv", table(["Time", "header.seq", *(b[6:] for b in BAG)], [TIMES, range(3), *PLAIN[1:]])),
        ("a.csv", table(["time", *("/" + b[6:].replace(".", "/") for b in BAG)], PLAIN)),
        ("a.csv", table(["sec", "nanosec", *BAG], [[7, 8, 9], [0, 0, 500_000_000], *PLAIN[1:]])),
        ("a.csv", table("t,x,y,z,rotvec_x,rotvec_y,rotvec_z", [TIMES, *PLACES.T, *TURNS.as_rotvec().T])),
        ("a.csv", table("t,x,y,z,roll,pitch,yaw", [TIMES, *PLACES.T, *ROLLS])),
        ("a.csv", table("t,x,y,z,roll [deg],pitch [deg],yaw [deg]", [TIMES, *PLACES.T, *np.rad2deg(ROLLS)])),
        ("a.csv", table(["t", *(f"T_{i}{j}" for i in range(4) for j in range(4))], [TIMES, *WHOLE.reshape(3, 16).T])),
        ("a.csv", table(["t", *(f"r{i}{j}" for i in "123" for j in "123"), "x", "y", "z"],
                        [TIMES, *TURNS.as_matrix().reshape(3, 9).T, *PLACES.T])),
        ("a.kitti", table("", [TIMES, *WHOLE.reshape(3, 16).T], " ")),
        ("a.txt", table("", [TIMES, *WHOLE.reshape(3, 16)[:, :12].T], " ")),
    ],
)  # fmt: skip
def test_columns_by_the_names_that_programs_give_them(file, name, content):
    assert_poses(read_keyframes(file(name, content)))
    packed = file(f"{name}.gz", gzip.compress(content.encode()))
    assert_poses(read_keyframes(packed))


def test_stamps_in_nanoseconds(file):
    rates = [np.zeros(3)]
    euroc = read_recording(file("euroc.csv", table(EUROC, [STAMPS, *FIRST[1:], *rates])))
    assert_poses(euroc.keyframes, [0, 0.005, 0.0125])
    assert euroc.keyframes.times[0] == 1403715524907143168 / 10**9
    assert "left out: v_x [m s^-1]" in euroc.notes[0] and "are taken as ns" in euroc.notes[1]
    header = ["%time", "field.header.seq", "field.header.stamp", "field.header.frame_id", *BAG]
    bag = read_recording(file("bag.csv", table(header, [STAMPS, range(3), [STAMPS[0]] * 3, ["map"] * 3, *PLAIN[1:]])))
    assert_poses(bag.keyframes, [0, 0.005, 0.0125])
    assert "of several times %time is taken" in bag.notes


def test_our_own_large_times_stay_what_they_are(file):
    keys = sm.Keyframes([1e12, 2e12, 1e18], TURNS.as_matrix(), PLACES)
    sm.write_keyframes(keys, "a.csv")
    assert read_keyframes("a.csv").times.tolist() == [1e12, 2e12, 1e18]


def test_what_columns_are_can_be_told(file):
    name = file("a.csv", table("when,a,b,c,i,j,k,r", PLAIN))
    with pytest.raises(InputError) as caught:
        read_keyframes(name)
    assert "understood were none; not understood when, a, b, c, i, j, k, r" in str(caught.value)
    told = {"time": "when", "translation": ["a", "b", "c"], "quaternion": ["i", "j", "k", "r"]}
    assert_poses(read_keyframes(name, columns=told))
    assert_poses(read_keyframes(name, columns="time=when; translation=a,b,c; quaternion=4,5,6,7"))
    angles = file("b.csv", table("t,x,y,z,e1,e2,e3", [TIMES, *PLACES.T, *np.rad2deg(TURNS.as_euler("xyz")).T]))
    assert_poses(read_keyframes(angles, columns={"xyz": ["e1", "e2", "e3"]}, angles="deg"))


@pytest.mark.parametrize(
    ("header", "options", "message"),
    [
        (
            "ttime,x,y,z,qx,qy,qz,qw",
            {},
            r"none would be the time: .* not understood ttime; likely ttime \(time\?\): say",
        ),
        ("t,east,north,up,qx,qy,qz,qw", {}, r"none would be the translation: .* not understood east, north, up"),
        (
            "t,x,y,z,rx,ry,rz,foo",
            {},
            r"none would be the linear part: .* understood were t, x, y, z; not under.* rx, ry",
        ),
        ("t,x,y,z,qx,qy,qz,qw", {"columns": {"time": "when"}}, "0 columns are called 'when'; there are t, x, y, z"),
        ("t,x,y,z,qx,qy,qz,qw", {"columns": {"turn": "qx"}}, "'turn' is no role; there are time, translation, quat"),
        ("t,x,y,z,qx,qy,qz,qw", {"columns": {"quaternion": "qx"}}, "quaternion of 1 columns: 4 are needed"),
        ("t,x,y,z,qx,qy,qz,qw", {"columns": "time"}, r"columns 'time': ROLE=NAME,NAME,… is needed"),
        ("t [h],x,y,z,qx,qy,qz,qw", {}, "times in 'h': one of s, sec"),
        ("t,x [inch],y,z,qx,qy,qz,qw", {}, r"'x \[inch\]': one of the units m, "),
        ("t,x,y,z,qx,qy,qz,qw", {"lost": "skip"}, "lost 'skip' is unknown; there are error, drop"),
    ],
)
def test_a_column_that_is_not_understood_is_not_guessed(file, header, options, message):
    with pytest.raises(InputError, match=message):
        read_keyframes(file("a.csv", table(header, PLAIN)), **options)


def test_a_role_that_no_column_has(file):
    name = file("a.csv", table("tool,x,y,z,qx,qy,qz,qw", [[5, 5, 5], *PLAIN[1:]]))
    with pytest.raises(InputError, match="not understood tool"):
        read_keyframes(name)
    assert_poses(read_keyframes(name, columns={"time": None}), [0, 1, 2])


def test_degrees_are_not_taken_for_radians(file):
    name = file("a.csv", table("t,x,y,z,roll,pitch,yaw", [TIMES, *PLACES.T, *np.rad2deg(ROLLS)]))
    with pytest.raises(InputError, match=r"line 3: an angle of 50: degrees\? say angles='deg'"):
        read_keyframes(name)
    assert_poses(read_keyframes(name, angles="deg"))


def test_matrices_have_the_last_row(file):
    with pytest.raises(InputError, match="line 1: the last row of the matrix is not 0 … 0 1"):
        read_keyframes(file("a.kitti", table("", [*WHOLE.reshape(3, 16).T[:15], [2, 1, 1]], " ")))


# Repairs, which are asked for


def test_rows_of_lost_tracking(file):
    rows = [list(row) for row in zip(*PLAIN, strict=True)]
    lost = [[0.5, *[0.0] * 7], [0.7, "nan", *rows[0][2:]], [0.8, "", *rows[0][2:]]]
    name = file("a.csv", table("t,x,y,z,qx,qy,qz,qw", list(zip(rows[0], *lost, *rows[1:], strict=True))))
    with pytest.raises(InputError, match=r"line 3: a quaternion of norm 0|line 4: 'nan' is not finite"):
        read_keyframes(name)
    read = read_recording(name, lost="drop")
    assert_poses(read.keyframes)
    assert "3 rows of lost tracking are dropped, the first in line 3" in read.notes


def test_repeated_and_crowded_stamps(file):
    times = np.array([0, 0, 1, 1 + 1e-5, 2.5])
    which = [0, 0, 1, 1, 2]
    columns = [times, *PLACES[which].T, *QUATERNIONS[which].T]
    name = file("a.tum", table("", columns, " "))
    with pytest.raises(InputError, match=r"line 2: time 0.0 repeats that of line 1: .* repeated='drop' and"):
        read_keyframes(name)
    for repeated, middle in (("drop", 1.0), ("merge", 1 + 5e-6)):
        read = read_recording(name, repeated=repeated)
        np.testing.assert_allclose(read.keyframes.times, [0, middle, 2.5], rtol=1e-12)
        np.testing.assert_allclose(read.keyframes.linear, TURNS.as_matrix(), atol=1e-12)
        assert read.notes[0].startswith("2 rows whose times repeat or crowd are")
    apart = file("b.tum", table("", [[0, 1, 1], *PLACES.T, *QUATERNIONS.T], " "))
    merged = read_keyframes(apart, repeated="merge")
    np.testing.assert_allclose(merged.translation[1], (PLACES[1] + PLACES[2]) / 2)
    half = Rotation.concatenate([TURNS[1], TURNS[2]]).mean()
    np.testing.assert_allclose(merged.linear[1], half.as_matrix(), atol=1e-12)


def test_norms_within_a_stated_tolerance(file):
    name = file("a.tum", table("", [*PLAIN[:4], *(1.02 * QUATERNIONS).T], " "))
    with pytest.raises(InputError, match=r"norm 1.02: unit quaternions are needed; norms=0.02"):
        read_keyframes(name)
    read = read_recording(name, norms=0.05)
    assert_poses(read.keyframes)
    assert read.notes == ("3 quaternions are normalised, norms up to 0.02 from 1",)


def test_thinning_and_gaps(file):
    times = np.concatenate([np.arange(20) / 10, 5 + np.arange(20) / 10])
    keys = sm.Keyframes(times, np.tile(np.eye(2), (40, 1, 1)))
    sm.write_keyframes(keys, "a.csv")
    every = read_recording("a.csv", every=5)
    np.testing.assert_allclose(every.keyframes.times, times[[0, 5, 10, 15, 20, 25, 30, 35, 39]])
    assert every.notes[0] == "9 of 40 keyframes are kept"
    rate = read_recording("a.csv", rate=2.0)
    assert set(np.diff(rate.keyframes.times)[:3].round(9)) == {0.5} and rate.keyframes.times[-1] == times[-1]
    assert "1 gap longer than 5 median steps: 3.1 after time 1.9" in read_recording("a.csv").notes
    with pytest.raises(InputError, match="every and rate are two ways"):
        read_recording("a.csv", every=2, rate=2.0)


# Cameras and bodies


def test_cameras_of_colmap(file):
    inverse = TURNS.inv()
    moved = -inverse.apply(PLACES)
    lines = [
        "# Image list with two lines of data per image:",
        "#   IMAGE_ID, QW, QX, QY, QZ, TX, TY, TZ, CAMERA_ID, NAME",
    ]
    for k in (2, 0, 1):
        q = np.roll(inverse[k].as_quat(), 1)
        lines += [f"{7 - k} {' '.join(map(str, [*q, *moved[k]]))} 1 {'abc'[k]}.png", "10.5 20.5 -1"]
    name = file("images.txt", "\n".join(lines))
    assert_poses(read_keyframes(name), [0, 1, 2])
    assert_poses(read_keyframes(name, format="colmap"), [0, 1, 2])
    with pytest.raises(InputError, match=r"images.txt, line 2: 3 columns, not 10: IMAGE_ID, QW"):
        read_keyframes(file("images.txt", "# IMAGE_ID, QW, QX, QY, QZ\n1 2 3\n"))


def test_cameras_of_nerfstudio(file):
    frames = [{"file_path": str(k), "transform_matrix": WHOLE[k].tolist()} for k in range(3)]
    assert_poses(read_keyframes(file("transforms.json", json.dumps({"frames": frames}))), [0, 1, 2])
    stamped = [frame | {"time": t} for frame, t in zip(frames, TIMES, strict=True)]
    assert_poses(read_keyframes(file("transforms.json", json.dumps({"frames": stamped}))))
    frames[1]["transform_matrix"] = [[1, 2], [3, 4]]
    with pytest.raises(InputError, match=r"frames\[1\].transform_matrix: shape \(2, 2\) where \(4, 4\)"):
        read_keyframes(file("transforms.json", json.dumps({"frames": frames})))


def test_cameras_of_open3d(file):
    blocks = [f"{k} {k} 3\n" + "\n".join(" ".join(map(str, row)) for row in WHOLE[k]) for k in range(3)]
    assert_poses(read_keyframes(file("a.log", "\n".join(blocks))), [0, 1, 2])
    with pytest.raises(InputError, match=r"a.log, line 11: the file ends within the matrix"):
        read_keyframes(file("a.log", "\n".join(blocks).rpartition("\n")[0]))


@pytest.mark.parametrize("kinds", [False, True])
def test_bodies_of_motive(file, kinds):
    columns = [range(3), TIMES, *QUATERNIONS.T, *(1000 * PLACES).T]
    rows = [["", "", *["Rigid Body"] * 7], ["", "", *["drone"] * 7]]
    rows += [["", "", *["Rotation"] * 4, *["Position"] * 3]] if kinds else []
    head = "Format Version,1.23,Rotation Type,Quaternion,Length Units,Millimeters\n\n"
    head += "\n".join(",".join(row) for row in rows) + "\n"
    name = file("a.csv", head + table("Frame,Time (Seconds),X,Y,Z,W,X,Y,Z", columns))
    assert_poses(read_keyframes(name))
    assert_poses(read_keyframes(name, node="drone"))
    with pytest.raises(InputError, match="no body is called 'car'; there are drone"):
        read_keyframes(name, node="car")


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (gzip.compress(b"0 0 0 0 0 0 0 1\n" * 99, mtime=0)[:40], "is no whole gzip file"),
        (b"\x1f\x8b" + bytes(40), "is no whole gzip file"),
    ],
)
def test_broken_archives(file, content, message):
    with pytest.raises(InputError, match=message):
        read_keyframes(file("a.tum.gz", content))


@pytest.mark.parametrize(
    ("name", "row"),
    [("a.kitti", "1 0 0 0 0 1 0 0 0 0 1 0\n"), ("a.tum", "{} 0 0 0 0 0 0 1\n"), ("a.csv", "{},0,0,0,0,0,0,1\n")],
)
def test_memory_stays_below_eight_times_the_file(file, name, row):
    path = file(name, "".join(row.format(10**8 + i) for i in range(12_000)))
    read_keyframes(path)  # what it imports is no part of it
    tracemalloc.start()
    try:
        keyframes = read_keyframes(path)
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert len(keyframes) == 12_000
    assert peak < 8 * Path(path).stat().st_size


def test_notes_on_rows_count_them_over_all_parts(file):
    rows = [[k, *(0, 0, 0, 0, 0, 0, 1.002 if k % 5000 == 3 else 1.0)] for k in range(10_000)]
    rows[17][4:] = rows[9_000][4:] = [0, 0, 0, 0]
    path = file("a.tum", "\n".join(" ".join(map(str, row)) for row in rows))
    found = read_recording(path, lost="drop", norms=0.01)
    assert len(found.keyframes) == 9_998
    assert "2 rows of lost tracking are dropped, the first in line 18" in found.notes
    assert "2 quaternions are normalised, norms up to 0.002 from 1" in found.notes


ROWS = "0,0,0,0,0,0,0,1\n0.5,1,0,0,0,0.6,0,0.8\n"


@pytest.mark.parametrize(
    "text",
    [
        "t,x,y,z,qi,qj,qk,qr\n" + ROWS,
        "t,x,y,z,quat_i,quat_j,quat_k,quat_r\n" + ROWS,
        "t,x,y,z,ori_x,ori_y,ori_z,ori_w\n" + ROWS,
        "// of a robot\n% made by a program\nt,x,y,z,qx,qy,qz,qw\n" + ROWS,
        "t,x,y,z,qx,qy,qz,qw\nms,cm,cm,cm,,,,\n" + ROWS.replace("0.5,1,", "500,100,"),
        "%time,x,y,z,qx,qy,qz,qw\n" + ROWS,
    ],
)
@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16"])
def test_names_comments_units_and_encodings(text, encoding, tmp_path):
    (tmp_path / "a.csv").write_text(text, encoding=encoding)
    keys = sm.read_keyframes(tmp_path / "a.csv")
    np.testing.assert_allclose(keys.times, [0, 0.5])
    np.testing.assert_allclose(keys.translation, [[0, 0, 0], [1, 0, 0]])
    np.testing.assert_allclose(keys.linear[1], [[0.28, 0, 0.96], [0, 1, 0], [-0.96, 0, 0.28]], atol=1e-15)


@pytest.mark.parametrize(
    "names",
    ["rodrigues_x,rodrigues_y,rodrigues_z", "rot_vec_x,rot_vec_y,rot_vec_z", "axisAngleX,axisAngleY,axisAngleZ"],
)
def test_rotation_vectors_by_their_names(names, tmp_path):
    (tmp_path / "a.csv").write_text(f"t,x,y,z,{names}\n0,0,0,0,0,0,0\n1,0,0,0,0,0,{np.pi / 2}\n")
    linear = sm.read_keyframes(tmp_path / "a.csv").linear
    np.testing.assert_allclose(linear[1], [[0, -1, 0], [1, 0, 0], [0, 0, 1]], atol=1e-15)


@pytest.mark.parametrize("void", ["nan", "", "None", "inf"])
def test_rows_of_lost_tracking_are_told_how_to_be_left_out(void, tmp_path):
    (tmp_path / "a.csv").write_text(f"t,x,y,z,qx,qy,qz,qw\n{ROWS}1,{void},0,0,0,0,0,1\n")
    with pytest.raises(sm.InputError, match=r"line 4: .*; lost='drop' leaves such rows out"):
        sm.read_keyframes(tmp_path / "a.csv")
    assert len(sm.read_keyframes(tmp_path / "a.csv", lost="drop")) == 2
