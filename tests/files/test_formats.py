"""The table of formats: a format of one's own in one row, one dispatch, and what its doors refuse."""

import inspect
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import symmotion as sm
from symmotion.files import FORMATS, Format, Option
from symmotion.files.formats import endings, rows
from symmotion.motions.nets import smooth_net

KEYS = sm.examples.random_keyframes(4, 50, 1)
MOTION = sm.interpolants.component_cubic(KEYS)
NET = smooth_net(5)
MESH = sm.bodies.Mesh(np.eye(3), np.array([[0, 1, 2]]))
GIVEN = {"keyframes": KEYS, "motion": MOTION, "net": NET, "mesh": MESH}


# The recipe: a function for each way, and a row.


def read_points(path) -> sm.Keyframes:
    places = np.loadtxt(path, ndmin=2)
    return sm.Keyframes(np.arange(len(places)), np.tile(np.eye(3), (len(places), 1, 1)), places)


def write_points(keys, path) -> None:
    np.savetxt(path, keys.translation)


POINTS = Format("points", ("pts",), "keyframes", "where the origin is, a line each", read_points, write_points)


def test_a_format_of_ones_own_is_a_row(tmp_path):
    table = (*FORMATS, POINTS)
    sm.write_keyframes(KEYS, tmp_path / "a.pts", formats=table)
    np.testing.assert_allclose(sm.read_keyframes(tmp_path / "a.pts", formats=table).translation, KEYS.translation)
    (tmp_path / "a.dat").write_text("0 0 0\n1 2 3\n")
    assert len(sm.read_keyframes(tmp_path / "a.dat", "pts", formats=table)) == 2
    with pytest.raises(sm.InputError, match=r"a.pts: format 'pts' is unknown; there are tum, kitti"):
        sm.read_keyframes(tmp_path / "a.pts")
    with pytest.raises(sm.InputError, match=r"a.pts: points has no node: it goes with csv, bvh, glb, gltf"):
        sm.read_keyframes(tmp_path / "a.pts", node="hip", formats=table)


def own(read: Any = None, write: Any = None, holds: Any = "keyframes") -> Any:  # Any: what is wrong too
    return [Format("own", ("own",), holds, "one's own", read, write)]


@pytest.mark.parametrize("answer", [None, 3, MOTION, {"a": 1}], ids=lambda x: type(x).__name__)
def test_a_reader_that_reads_something_else(tmp_path, answer):
    with pytest.raises(sm.InputError, match=f"a.own: own reads a {type(answer).__name__}: Keyframes is needed"):
        sm.read_keyframes(tmp_path / "a.own", formats=own(lambda path: answer))


def test_readers_and_writers_that_fail_name_the_file(tmp_path):
    def fail(*_):
        raise KeyError("time")

    def fail_midway(keys, path):
        Path(path).write_text("half")
        fail()

    with pytest.raises(sm.InputError, match=r"a.own: cannot be read as own: KeyError: 'time'"):
        sm.read_keyframes(tmp_path / "a.own", formats=own(fail))
    with pytest.raises(sm.InputError, match=r"a.own: cannot be read as own: FileNotFoundError: .*a.own"):
        sm.read_keyframes(tmp_path / "a.own", formats=own(read_points))
    for before in (False, True):
        if before:
            (tmp_path / "a.own").write_text("as it was")
        with pytest.raises(sm.InputError, match=r"a.own: cannot be written as own: KeyError: 'time'"):
            sm.write_keyframes(KEYS, tmp_path / "a.own", formats=own(None, fail_midway))
        assert [(path.name, path.read_text()) for path in tmp_path.iterdir()] == [("a.own", "as it was")] * before


def test_what_is_written_beside_the_file_comes_with_it(tmp_path):
    def write(keys, path):
        Path(path).write_text("main")
        Path(path).with_suffix(".bin").write_text("beside")

    sm.write_keyframes(KEYS, tmp_path / "a.own", formats=own(None, write))
    assert {path.name: path.read_text() for path in tmp_path.iterdir()} == {"a.own": "main", "a.bin": "beside"}
    with pytest.raises(sm.InputError, match="there is no directory"):
        sm.write_keyframes(KEYS, tmp_path / "b" / "a.own", formats=own(None, write))


def test_what_is_no_motion_or_no_table(tmp_path):
    with pytest.raises(sm.InputError, match="a Keyframes is no motion"):
        sm.write_motion(KEYS, tmp_path / "m.own", formats=own(None, write_points, "motion"))  # pyright: ignore[reportArgumentType]
    for formats in (POINTS, [3], 3, None):
        with pytest.raises(sm.InputError, match=r"formats .*: a table is needed"):
            sm.read_keyframes(tmp_path / "a.pts", formats=formats)  # pyright: ignore[reportArgumentType]
    with pytest.raises(sm.InputError, match="format a: a function that reads it"):
        Format("a", ("a",), "keyframes", "", 3)  # pyright: ignore[reportArgumentType]
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("holds", ["motion", "scene"])
def test_every_scene_goes_to_its_own_writer(tmp_path, holds):
    told = []

    def write_dae(motion, path, *, seconds=None):
        told.append((motion, Path(path).name, seconds))

    mine = Format("dae", ("dae",), holds, "a scene", write=write_dae, writing=(Option("seconds", "length", float),))
    sm.write_motion(MOTION, tmp_path / "m.dae", seconds=2.0, formats=(*FORMATS, mine))
    assert told == [(MOTION, "m.dae", 2.0)]
    assert not list(tmp_path.iterdir())
    with pytest.raises(sm.InputError, match=r"m.dae: dae has no rate: it goes with csv, tum"):
        sm.write_motion(MOTION, tmp_path / "m.dae", rate=2.0, formats=(*FORMATS, mine))


@pytest.mark.parametrize("row", rows(FORMATS, "write", "motion", "scene"), ids=lambda row: row.name)
def test_no_writer_stands_in_for_another(tmp_path, row):
    left = [other for other in FORMATS if other is not row]
    with pytest.raises(sm.InputError, match=f"format '{row.endings[0]}' is unknown"):
        sm.write_motion(MOTION, tmp_path / f"m.{row.endings[0]}", formats=left)
    assert not list(tmp_path.iterdir())


def test_two_formats_of_one_ending_are_refused(tmp_path):
    mine = Format("mine", ("csv",), "keyframes", "other columns", read_points)
    (tmp_path / "a.csv").write_text("0 0 0\n1 2 3\n")
    with pytest.raises(sm.InputError, match=r"a.csv: the formats csv and mine have the same ending: leave all but"):
        sm.read_keyframes(tmp_path / "a.csv", formats=(*FORMATS, mine))
    assert len(sm.read_keyframes(tmp_path / "a.csv", formats=[mine])) == 2


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("a", ("a",), "sound", "", read_points), "format a: holds 'sound' is unknown; there are keyframes, motion"),
        (("a", (".a",), "keyframes", "", read_points), r"format a: endings \('.a',\): a tuple as"),
        (("a", ("A",), "keyframes", "", read_points), r"format a: endings \('A',\): a tuple as"),
        (("a", "a", "keyframes", "", read_points), "format a: endings 'a': a tuple as"),
        (("a", (), "keyframes", "", read_points), r"format a: endings \(\): a tuple as"),
        (("a", ("a",), "keyframes", ""), "format a: a function that reads it, or one that writes it, is needed"),
    ],
)
def test_rows_that_are_none(arguments, message):
    with pytest.raises(sm.InputError, match=f"^{message}"):
        Format(*arguments)


@pytest.mark.parametrize("row", FORMATS, ids=lambda row: f"{row.holds} {row.name}")
@pytest.mark.parametrize("way", ["read", "write"])
def test_rows_say_what_their_functions_take(row, way):
    """Every option is a keyword of the function, and none of its keywords is missing."""
    function = getattr(row, way)
    if function is None:
        assert not row.options(way)
        return
    beside = 1 if way == "read" else 2  # the path, and what is written
    keywords = dict(list(inspect.signature(function).parameters.items())[beside:])
    assert set(keywords) == {option.name for option in row.options(way)}
    assert all(option.default in (None, keywords[option.name].default) for option in row.options(way))
    assert all(option.meaning for option in row.options(way))
    assert row.help


DOORS: dict[Any, tuple[Any, ...]] = {  # Any: functions of different arguments
    sm.read_keyframes: ("read", "keyframes"),
    sm.write_keyframes: ("write", "keyframes"),
    sm.files.read_motion: ("read", "motion"),
    sm.write_motion: ("write", "motion", "scene", "film"),
    sm.files.read_two_parameter: ("read", "net"),
    sm.files.write_two_parameter: ("write", "net"),
    sm.files.write_mesh: ("write", "mesh"),
}
every_door = pytest.mark.parametrize("door", DOORS, ids=lambda door: door.__name__)


def called_with(door, path):
    way, holds, *_ = DOORS[door]
    return door(path) if way == "read" else door(GIVEN[holds], path)


@every_door
def test_doors_explain_every_format_of_the_table(door):
    way, *holds = DOORS[door]
    assert [e for e in endings(rows(FORMATS, way, *holds)) if e not in door.__doc__] == []


@pytest.mark.parametrize(
    ("holds", "write"),
    [
        ("keyframes", lambda path: sm.write_keyframes(KEYS, path)),
        ("motion", lambda path: sm.write_motion(MOTION, path)),
        ("motion", MOTION.save),
        ("net", lambda path: sm.files.write_two_parameter(NET, path)),
        ("net", NET.save),
    ],
)
def test_formats_that_share_an_ending_tell_files_apart(tmp_path, holds, write):
    path = tmp_path / "a.json"
    write(path)
    assert [row.holds for row in FORMATS if row.claims is not None and row.claims(path)] == [holds]
    read = {"keyframes": sm.read_keyframes, "motion": sm.files.read_motion, "net": sm.files.read_two_parameter}[holds]
    assert read(path) == GIVEN[holds]


def test_what_was_saved_of_another_class_is_refused_by_name(tmp_path):
    path = tmp_path / "a.json"
    NET.save(path)
    with pytest.raises(sm.InputError, match=r"a.json: holds a TwoParameterMotion: a motion is needed; `load` reads an"):
        sm.files.read_motion(path)


# What belongs to no door


@pytest.mark.parametrize("value", [b"keys.tum", None, 3, np.eye(3)], ids=lambda value: type(value).__name__)
@every_door
def test_what_is_no_path(door, value):
    message = f"the path given to {door.__name__}, of type {type(value).__name__}: a str or a pathlib.Path is needed"
    with pytest.raises(sm.InputError, match=f"^{message}"):
        called_with(door, value)


@pytest.mark.parametrize("read", [sm.files.read_bvh, sm.files.read_gltf_keyframes])
@pytest.mark.parametrize("value", [None, b"a.bvh", 0])
def test_readers_take_paths_only(read, value):
    with pytest.raises(sm.InputError, match=f"^path of type {type(value).__name__}: a str or a pathlib.Path"):
        read(value)


@every_door
def test_directories(door, tmp_path):
    with pytest.raises(sm.InputError, match=f"^{tmp_path}: is a directory; name a file in it"):
        called_with(door, tmp_path)


@pytest.mark.parametrize(
    ("door", "value", "already"),
    [
        (sm.read_keyframes, KEYS, "these are keyframes"),
        (sm.files.read_motion, MOTION, "this is a motion"),
        (sm.files.read_two_parameter, NET, "this is a two-parameter motion"),
    ],
)
def test_what_has_been_read_already(door, value, already):
    with pytest.raises(sm.InputError, match=f"^{door.__name__} takes a path; {already} already"):
        door(value)


@pytest.mark.parametrize(
    ("door", "what", "given"),
    [
        (sm.write_keyframes, "keyframes", KEYS),
        (sm.write_motion, "a motion", MOTION),
        (sm.files.write_two_parameter, "a two-parameter motion", NET),
        (sm.files.write_mesh, "a mesh", MESH),
        (sm.files.write_gltf, "a motion", MOTION),
        (sm.files.write_usd, "a motion", MOTION),
    ],
)
@pytest.mark.parametrize("path", ["a.json", Path("a.json"), b"a.json"])
def test_swapped_arguments(door, what, given, path):
    with pytest.raises(sm.InputError, match=f"^{door.__name__} takes {what} first and the path second: they are swap"):
        door(path, given)


@pytest.mark.parametrize(
    ("door", "given", "name", "message"),
    [
        (sm.write_keyframes, MOTION, "a.csv", r"write_keyframes takes keyframes \(Keyframes\): a AffineMotion is none"),
        (sm.files.write_mesh, KEYS, "a.obj", r"write_mesh takes a mesh \(Mesh\): a Keyframes is none"),
        (sm.files.write_two_parameter, KEYS, "a.npz", r"write_two_parameter takes .* \(TwoParameterMotion\): a Keyfr"),
        (sm.write_motion, KEYS, "a.csv", "a Keyframes is no motion over one time"),
    ],
)
def test_other_things_than_a_door_takes(door, given, name, message, tmp_path):
    with pytest.raises(sm.InputError, match=f"^{message}"):
        door(given, tmp_path / name)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("name", ["none.csv", "none.json", "none.txt", "none.tum"])
def test_a_file_that_is_not_there_is_told_as_such_where_formats_share_its_ending(tmp_path, name):
    with pytest.raises(sm.InputError, match=f"{name}: cannot be read: No such file"):
        sm.read_keyframes(tmp_path / name)
