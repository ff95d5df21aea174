"""What all commands share, and `symmotion convert`: help, options and files follow from the table of formats."""

import inspect
import subprocess
import sys

import numpy as np
import pytest

import symmotion as sm
from symmotion.commands import convert, design, main
from symmotion.files.formats import endings
from symmotion.files.table import FILM, FORMATS
from symmotion.motions.nets import smooth_net
from symmotion.views import write_animation

KEYS = sm.examples.random_keyframes(4, 50, 1)
MOTION = sm.interpolants.component_cubic(KEYS)
NET = smooth_net(5)
COMMANDS = ["compare", "design", "convert", "fair"]


def text_of(arguments, capsys) -> str:
    with pytest.raises(SystemExit) as stopped:
        main(arguments)
    assert stopped.value.code == 0
    return capsys.readouterr().out


@pytest.mark.parametrize("command", [None, *COMMANDS])
def test_version(command, capsys):
    assert text_of([*filter(None, [command]), "--version"], capsys) == f"symmotion {sm.__version__}\n"


@pytest.mark.parametrize("command", COMMANDS)
def test_help_has_an_example_and_quiet(command, capsys):
    text = text_of([command, "--help"], capsys)
    assert "example:" in text
    assert "--quiet" in text


@pytest.mark.parametrize("command", [design, convert], ids=["design", "convert"])
def test_help_lists_the_formats_of_the_table(command, capsys):
    text = text_of([command.__name__.rpartition(".")[2], "--help"], capsys)
    for row in (*command.READ, *command.WRITTEN):
        assert row.help in text
        assert all(f".{ending}" in text for ending in row.endings)


def test_convert_knows_every_ending_that_is_read_or_written_of_its_kinds():
    kinds = [row for row in FORMATS if row.holds != "mesh"]
    assert {*endings(convert.READ), *endings(convert.WRITTEN)} == {*endings(kinds)}


def test_films_have_the_defaults_of_their_writer():
    parameters = inspect.signature(write_animation).parameters
    defaults = {o.name: o.default for o in FILM}
    # A command has the axis that its file says; the writer's own is for files that do not.
    assert defaults.pop("up") is None and parameters["up"].default == "z"
    assert defaults == {name: parameters[name].default for name in defaults}


def test_quiet_says_nothing(tmp_path, capsys):
    path, out = tmp_path / "keys.tum", tmp_path / "m.json"
    sm.write_keyframes(KEYS, path)
    for arguments in (["design", "-o", str(out)], ["convert", "-o", str(tmp_path / "keys.csv")]):
        assert main([arguments[0], str(path), *arguments[1:], "--quiet"]) == 0
    assert capsys.readouterr() == ("", "")
    assert out.exists()


def test_an_interrupt_is_one_line_and_status_130(tmp_path, monkeypatch, capsys):
    def interrupted(*_, **__):
        raise KeyboardInterrupt

    path = tmp_path / "keys.tum"
    sm.write_keyframes(KEYS, path)
    monkeypatch.setattr(design, "affine_program", interrupted)
    assert main(["design", str(path), "-o", str(tmp_path / "m.json")]) == 130
    assert capsys.readouterr().err == "symmotion design: interrupted\n"
    assert [p.name for p in tmp_path.iterdir()] == ["keys.tum"]


def test_commands_load_neither_matplotlib_nor_the_page():
    code = "import sys, symmotion.commands; print({'matplotlib', 'jinja2', 'rich'} & set(sys.modules))"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout == "set()\n"


# convert


@pytest.mark.parametrize("ending", ["csv", "json", "tum"])
def test_keyframes_stay_keyframes(tmp_path, ending, capsys):
    source, out = tmp_path / "keys.json", tmp_path / f"out.{ending}"
    sm.write_keyframes(KEYS, source)
    assert main(["convert", str(source), "-o", str(out)]) == 0
    back = sm.read_keyframes(out)
    np.testing.assert_allclose(back.linear, KEYS.linear, atol=1e-14)
    np.testing.assert_array_equal(back.times, KEYS.times)
    assert capsys.readouterr().out == f"wrote {out}\n"


@pytest.mark.parametrize("saved", [False, True])
def test_a_motion_is_sampled_or_becomes_a_scene(tmp_path, saved, capsys):
    source, exact = tmp_path / "m.json", tmp_path / "again.json"
    MOTION.save(source) if saved else sm.write_motion(MOTION, source)
    samples, scene = tmp_path / "m.csv", tmp_path / "m.glb"
    options = ["--rate", "3", "--seconds", "2", "--tolerance", "1e-3"]
    assert main(["convert", str(source), "-o", str(samples), str(scene), str(exact), *options]) == 0
    assert sm.files.read_motion(exact) == MOTION
    read = sm.read_keyframes(samples)
    np.testing.assert_allclose(np.diff(read.times), 1 / 3)
    np.testing.assert_array_equal(read.linear, MOTION(read.times).linear)
    assert f"wrote {scene}: " in capsys.readouterr().out


def test_a_joint_becomes_keyframes(tmp_path):
    walk, out = tmp_path / "walk.bvh", tmp_path / "arm.csv"
    walk.write_text(
        "HIERARCHY\nROOT hip { OFFSET 0 0 0 CHANNELS 1 Xposition\n"
        "JOINT arm { OFFSET 0 1 0 CHANNELS 1 Zrotation } }\nMOTION\nFrames: 2\nFrame Time: 0.5\n0 0\n1 30\n"
    )
    assert main(["convert", str(walk), "--node", "arm", "-o", str(out)]) == 0
    np.testing.assert_array_equal(sm.read_keyframes(out).linear, sm.read_keyframes(walk, node="arm").linear)


@pytest.mark.parametrize("ending", ["json", "npz"])
def test_two_parameter_motions(tmp_path, ending):
    source, out = tmp_path / "net.json", tmp_path / f"out.{ending}"
    sm.files.write_two_parameter(NET, source)
    assert main(["convert", str(source), "-o", str(out)]) == 0
    assert sm.files.read_two_parameter(out) == NET


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["{keys}", "-o", "{tmp}/m.glb"], "keys.json: holds keyframes, which go into .tum, .kitti, .csv, .json, .bvh;"),
        (["{motion}", "-o", "{tmp}/m.kitti"], "motion.json: holds a motion, which goes into .json, .csv, .tum, .bvh,"),
        (["{motion}", "-o", "{tmp}/m.obj"], "m.obj: format 'obj' is unknown; there are json, csv, tum"),
        (["{motion}", "-o", "{motion}"], "motion.json: is the file that is read, which would be lost"),
        (["{motion}", "-o", "{tmp}/m.csv", "--seconds", "2"], "--seconds goes with .glb, .usda, .usd, "),
        (["{motion}", "-o", "{tmp}/m.csv", "--node", "hip"], "--node goes with .csv, .bvh, .glb, .gltf, .usda, .usd, "),
        (["{motion}", "-o", "{tmp}/m.csv", "--rate", "0"], "--rate 0.0: a positive number is needed"),
        (["{motion}", "-o", "{tmp}/m.tum"], "m.tum: the motion is not rigid at time"),
        (["{other}", "-o", "{tmp}/m.csv"], "other.json: holds none of keyframes, motion, net"),
        (["{tmp}", "-o", "{tmp}/m.csv"], "is a directory; name a file in it"),
        (["{tmp}/none.json", "-o", "{tmp}/m.csv"], "none.json: cannot be read"),
    ],
)  # fmt: skip
def test_bad_input_is_one_line_and_status_2(arguments, message, tmp_path, capsys):
    files = {name: tmp_path / f"{name}.json" for name in ("keys", "motion", "other")}
    sm.write_keyframes(KEYS, files["keys"])
    sm.write_motion(MOTION, files["motion"])
    files["other"].write_text('{"symmotion": "other"}')
    assert main(["convert", *(a.format(tmp=tmp_path, **files) for a in arguments)]) == 2
    error = capsys.readouterr().err
    assert message in error
    assert error.count("\n") == 1
    assert sorted(tmp_path.iterdir()) == sorted(files.values())


@pytest.mark.parametrize("command", ["design", "fair"])
def test_no_command_replaces_its_input(tmp_path, command, capsys):
    path = tmp_path / "a.json"
    sm.write_keyframes(KEYS, path) if command == "design" else sm.files.write_two_parameter(NET, path)
    before = path.read_bytes()
    assert main([command, str(path), "-o", str(path)]) == 2
    assert "a.json: is the file that is read, which would be lost" in capsys.readouterr().err
    assert path.read_bytes() == before
