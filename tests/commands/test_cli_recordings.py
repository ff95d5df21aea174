"""Recordings on the command line: smooth, formats and repairs as options, pipes, one line where something is wrong."""

import ast
import io
import re
import shlex
import sys

import numpy as np
import pytest

import symmotion as sm
from symmotion.commands import main
from symmotion.commands.main import parser
from symmotion.commands.wording import worded


@pytest.fixture
def poses(tmp_path):
    t = np.linspace(0.0, 3.0, 40)
    rng = np.random.default_rng(0)
    angles = t / 2
    rows = [
        (x, np.cos(x) + e, np.sin(x), 0.0, 0.0, 0.0, np.sin(a), np.cos(a))
        for x, a, e in zip(t, angles, 0.01 * rng.normal(size=40), strict=True)
    ]
    path = tmp_path / "poses.log"
    path.write_text("\n".join(",".join(map(str, row)) for row in rows))
    return path


class Binary:
    """A standard stream of bytes."""

    def __init__(self, data: bytes = b""):
        self.buffer = io.BytesIO(data)

    def write(self, text: str) -> int:
        return self.buffer.write(text.encode())

    def flush(self) -> None:
        pass


def test_smooth_says_what_it_chose(poses, tmp_path, capsys):
    out = [tmp_path / "m.json", tmp_path / "m.tum"]
    assert main(["smooth", str(poses), "--format", "tum", "-o", *map(str, out)]) == 0
    shown = capsys.readouterr()
    assert "controls follows 40 keyframes, smoothed by generalised cross-validation" in shown.err
    assert "degrees of freedom, σ = 0.0" in shown.err and "solved" in shown.out
    assert len(sm.read_keyframes(out[1])) == 200
    assert main(["smooth", str(poses), "--format", "tum", "--quiet", "--noise", "0", "-o", str(out[0])]) == 0
    assert capsys.readouterr() == ("", "")
    keys = sm.read_keyframes(poses, format="tum")
    np.testing.assert_allclose(sm.files.read_motion(out[0])(keys.times).translation, keys.translation, atol=1e-9)


def test_convert_thins_and_says_what_was_repaired(poses, tmp_path, capsys):
    out = tmp_path / "a.csv"
    text = poses.read_text().splitlines()
    poses.write_text("\n".join([*text[:3], text[2], "9,nan,0,0,0,0,0,1", *text[3:]]))
    more = ["--lost", "drop", "--repeated", "merge", "--every", "2"]
    assert main(["convert", str(poses), "--format", "tum", *more, "-o", str(out)]) == 0
    error = capsys.readouterr().err
    assert "1 rows of lost tracking are dropped, the first in line 5" in error and "1 rows whose times repeat" in error
    assert "21 of 40 keyframes are kept" in error
    assert len(sm.read_keyframes(out)) == 21
    assert main(["convert", str(out), "-o", str(tmp_path / "b.csv"), "--rate", "2"]) == 0
    assert 6 <= len(sm.read_keyframes(tmp_path / "b.csv")) <= 8


def test_pipes(poses, monkeypatch, capsys):
    monkeypatch.setattr(sys, "stdin", Binary(poses.read_bytes()))
    out = Binary()
    monkeypatch.setattr(sys, "stdout", out)
    assert main(["convert", "-", "--format", "tum", "-o", "-", "--to", "csv"]) == 0
    lines = out.buffer.getvalue().decode().splitlines()
    assert lines[0].startswith("t,a11,a12") and len(lines) == 41


def test_compare_reads_standard_input_beside_files(poses, tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(sys, "stdin", Binary(poses.read_bytes()))
    more = ["--format", "tum", "--every", "13", "--solvers", "newton", "-o", str(tmp_path / "report")]
    assert main(["compare", "-", str(poses), *more]) == 0
    shown = capsys.readouterr()
    assert "-: 4 keyframes in space" in shown.out and f"{poses}: 4 keyframes in space" in shown.out
    assert "symmotion compare: -: note: 4 of 40 keyframes are kept" in shown.err
    assert "input.tum" not in (tmp_path / "report" / "index.html").read_text()


def test_fair_reads_and_writes_pipes(tmp_path, monkeypatch):
    net = sm.motions.smooth_net(5)
    net.save(tmp_path / "net.json")
    monkeypatch.setattr(sys, "stdin", Binary((tmp_path / "net.json").read_bytes()))
    out = Binary()
    monkeypatch.setattr(sys, "stdout", out)
    assert main(["fair", "-", "--format", "json", "-o", "-", "--to", "json", "--max-steps", "0"]) == 0
    (tmp_path / "fair.json").write_bytes(out.buffer.getvalue())
    assert sm.files.read_two_parameter(tmp_path / "fair.json") == net


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["fair", "-", "-o", "m.json"], "-: standard input has no ending: name its format with --format"),
        (["compare", "-"], "-: standard input has no ending: name its format with --format"),
        (["smooth", "-", "-o", "m.json"], "-: standard input has no ending: name its format with --format"),
        (["smooth", "{poses}", "--format", "tum", "-o", "-"], "-: standard output has no ending: name its format"),
        (["smooth", "{poses}", "--format", "tum", "-o", "m.json", "--noise", "1", "2", "3"], "--noise: two numbers"),
        (["smooth", "{poses}", "--format", "tum", "-o", "m.json", "--noise", "-1", "2"], "--noise: noise -1.0"),
        (["smooth", "{poses}", "--format", "xyz", "-o", "m.json"], "format 'xyz' is unknown; there are"),
        (["smooth", "{poses}", "--format", "tum", "-o", "m.json", "--every", "0"], "--every 0: a whole number"),
        (["smooth", "{poses}", "--format", "tum", "-o", "m.json", "--lost", "x"], "--lost 'x' is unknown; there are"),
        (["smooth", "{poses}", "--format", "tum", "-o", "m.json", "--node", "hip"], "--node goes with .csv, .bvh"),
        (["convert", "{poses}", "--format", "tum", "-o", "m.json", "--columns", "x"], "--columns 'x': ROLE=NAME"),
    ],
)
def test_bad_input_is_one_line_and_status_2(arguments, message, poses, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main([a.format(poses=poses) for a in arguments]) == 2
    error = capsys.readouterr().err
    assert message in error and error.count("\n") == 1
    assert not (tmp_path / "m.json").exists()


def test_progress_is_told(poses, tmp_path, capsys, monkeypatch):
    monkeypatch.setattr("symmotion.commands.inputs.LONG", 0.001)
    assert main(["smooth", str(poses), "--format", "tum", "-o", str(tmp_path / "m.json")]) == 0
    assert "unknowns: 0 s" in capsys.readouterr().err


def test_an_interrupt_is_one_line(poses, tmp_path, capsys, monkeypatch):
    def interrupted(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("symmotion.commands.smooth.plan", interrupted)
    assert main(["smooth", str(poses), "--format", "tum", "-o", str(tmp_path / "m.json")]) == 130
    error = capsys.readouterr().err
    assert error == "symmotion smooth: interrupted\n"


def test_films_and_players_of_files_whose_y_is_upright_are_upright(tmp_path):
    keys = sm.examples.random_keyframes(4, 40, seed=1)
    sm.write_keyframes(keys, tmp_path / "walk.bvh")
    sm.write_keyframes(keys, tmp_path / "walk.tum")
    for name, flags in [("walk.bvh", []), ("walk.tum", ["--up", "y"]), ("walk.bvh", ["--up", "z"]), ("walk.tum", [])]:
        out = tmp_path / f"{name}{len(flags)}.gif"
        arguments = [str(tmp_path / name), "-o", str(out), "--seconds", "0.2", *flags]
        assert main(["design", *arguments, "--quiet"]) == 0
    films = {path.stem: path.read_bytes() for path in tmp_path.glob("*.gif")}
    assert films["walk.bvh0"] == films["walk.tum2"]
    assert films["walk.bvh2"] == films["walk.tum0"]
    assert films["walk.bvh0"] != films["walk.bvh2"]
    stills = []
    for k, flags in enumerate([[], ["--up", "y"], ["--up", "z"]]):
        out = tmp_path / f"report{k}"
        arguments = [str(tmp_path / "walk.bvh"), "-o", str(out), "--solvers", "newton", *flags]
        assert main(["compare", *arguments, "--quiet"]) == 0
        (still,) = (out / "figures").glob("*-still.svg")
        stills.append(still.read_text())
    assert stills[0] == stills[1]
    assert stills[0] != stills[2]


def test_files_say_what_is_upright(tmp_path):
    keys = sm.examples.random_keyframes(4, 40, seed=1)
    for name in ("a.bvh", "a.tum"):
        sm.write_keyframes(keys, tmp_path / name)
    motion = sm.interpolants.component_cubic(keys)
    for name in ("a.glb", "a.usda"):
        sm.write_motion(motion, tmp_path / name)
    (tmp_path / "z.usda").write_text((tmp_path / "a.usda").read_text().replace('upAxis = "Y"', 'upAxis = "Z"'))
    said = {p.name: sm.files.read_recording(p, every=2).up for p in tmp_path.iterdir()}
    assert said == {"a.bvh": "y", "a.tum": None, "a.glb": "y", "a.usda": "y", "z.usda": "z"}


QUATERNIONS = "t,x,y,z,qx,qy,qz,qw\n0,0,0,0,0,0,0,1\n1,1,0,0,0,0,0,1\n2,1,0,1,0,0,0,1\n"
TABLES = {
    "angles.csv": "t,x,y,z,roll,pitch,yaw\n0,0,0,0,0,0,50\n1,1,0,0,0,0,60\n2,1,0,0,0,0,70\n",
    "norms.tum": "0 0 0 0 0 0 0 1.02\n1 1 0 0 0 0 0 0.97\n2 1 0 1 0 0 0 1\n",
    "lost.tum": "0 0 0 0 0 0 0 1\n1 1 0 0 0 0 0 0\n2 1 0 1 0 0 0 1\n",
    "again.tum": "0 0 0 0 0 0 0 1\n1 1 0 0 0 0 0 1\n1 1 0 1 0 0 0 1\n2 1 0 1 0 0 0 1\n",
    "more.bvh": "HIERARCHY\nROOT Hips\n{\nOFFSET 0 0 0\nCHANNELS 3 Zrotation Xrotation Yrotation\nEnd Site\n{\n"
    "OFFSET 0 1 0\n}\n}\nMOTION\nFrames: 2\nFrame Time: 0.5\n0 0 0\n9 0 0\n0 9 0\n",
    "few.bvh": "HIERARCHY\nROOT Hips\n{\nOFFSET 0 0 0\nCHANNELS 3 Zrotation Xrotation Yrotation\nEnd Site\n{\n"
    "OFFSET 0 1 0\n}\n}\nMOTION\nFrames: 5\nFrame Time: 0.5\n0 0 0\n9 0 0\n0 9 0\n",
    "bars.tum": "0|0|0|0|0|0|0|1\n1|1|0|0|0|0|0|1\n2|1|0|1|0|0|0|1\n",
    "colons.csv": "t:x:y:z:qx:qy:qz:qw\n0:0:0:0:0:0:0:1\n1:1:0:0:0:0:0:1\n2:1:0:1:0:0:0:1\n",
    "crowd.tum": "0 0 0 0 0 0 0 1\n1 1 0 0 0 0 0 1\n1.0000001 1 0 1 0 0 0 1\n2 1 2 1 0 0 0 1\n3 1 2 4 0 0 0 1\n",
}


@pytest.mark.parametrize(
    ("name", "remedies"),
    [
        ("angles.csv", ["--angles deg", "--angles rad"]),
        ("norms.tum", ["--norms 0.032"]),
        ("lost.tum", ["--lost drop"]),
        ("again.tum", ["--repeated drop", "--repeated merge"]),
        ("more.bvh", ["--frames found", "--frames claimed"]),
        ("crowd.tum", ["--repeated merge"]),
        ("few.bvh", ["--frames found"]),
        ("bars.tum", ["--delimiter '|'"]),
        ("colons.csv", ["--delimiter :"]),
    ],
)
def test_remedies_are_flags_that_work_as_printed(name, remedies, tmp_path, capsys):
    (tmp_path / name).write_text(TABLES[name])
    arguments = ["design", str(tmp_path / name), "-o", str(tmp_path / "m.json"), "--objective", "rigidity+energy"]
    assert main(arguments) == 2
    said = capsys.readouterr().err
    for remedy in remedies:
        assert remedy in said
        assert main([*arguments, *shlex.split(remedy)]) == 0
    assert re.search(r"[a-z]=[^N]", said) is None


@pytest.mark.parametrize("name", sorted(set(TABLES) - {"crowd.tum"}))
def test_remedies_are_arguments_that_work_as_printed(name, tmp_path):
    (tmp_path / name).write_text(TABLES[name])
    with pytest.raises(sm.InputError) as error:
        sm.read_keyframes(tmp_path / name)
    given = re.findall(r"([a-z]+)=('[^']*'|[0-9.]+)", str(error.value))
    assert given
    for argument, value in given:
        assert len(sm.read_keyframes(tmp_path / name, **{argument: ast.literal_eval(value)})) >= 2


def test_remedies_that_name_columns_and_encodings(tmp_path, capsys):
    text = TABLES["more.bvh"].replace("Frames: 2", "Frames: 3").replace("Hips", "腰")
    (tmp_path / "sjis.bvh").write_bytes(text.encode("shift_jis"))
    rows = [line.replace("t,", "when,").replace("x,y,z,", "a,b,c,") for line in QUATERNIONS.splitlines()]
    (tmp_path / "unnamed.csv").write_text("\n".join(rows))
    out = ["-o", str(tmp_path / "m.json")]
    assert main(["convert", str(tmp_path / "sjis.bvh"), *out]) == 2
    assert "name its encoding, as --encoding shift_jis" in capsys.readouterr().err
    assert main(["convert", str(tmp_path / "sjis.bvh"), *out, "--encoding", "shift_jis"]) == 0
    assert main(["convert", str(tmp_path / "unnamed.csv"), *out]) == 2
    said = capsys.readouterr().err
    assert "say which with --columns time=NAME,…, without a NAME for none" in said
    assert "not understood when, a, b, c" in said
    columns = "time=when;translation=a,b,c"
    assert main(["convert", str(tmp_path / "unnamed.csv"), *out, "--columns", columns]) == 0
    assert main(["convert", str(tmp_path / "unnamed.csv"), *out, "--columns", "time=;translation="]) == 0


def test_motions_that_are_not_rigid_are_told_how_to_be_written(tmp_path, capsys):
    keys, out = sm.examples.random_keyframes(9, 40, seed=2), tmp_path / "m.tum"
    sm.write_keyframes(keys, tmp_path / "keys.csv")
    arguments = ["design", str(tmp_path / "keys.csv"), "-o", str(out), "--refine", "0"]
    assert main(arguments) == 2
    assert "--orthonormalise writes the closest rotations" in capsys.readouterr().err
    assert main([*arguments, "--orthonormalise"]) == 0
    assert main([*arguments, "--orthonormalise", "--rate", "1e9"]) == 2
    assert "symmotion design: --rate 1e+09 makes 8e+09 steps over the motion" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("flag", "value", "message"),
    [
        ("--refine", "100000", "a whole number of knots per segment, at most 1000, is needed"),
        ("--degree", "31", "a whole number, at most 30, is needed"),
        ("--explore", "100001", "a whole number of starts, at most 100000, is needed"),
        ("--auto-knots", "1000001", "a whole number of knots, at most 1000000, is needed"),
    ],
)
def test_work_without_end_is_refused_by_the_option(flag, value, message, poses, tmp_path, capsys):
    arguments = ["design", str(poses), "--format", "tum", "-o", str(tmp_path / "m.json")]
    assert main([*arguments, flag, value]) == 2
    assert capsys.readouterr().err == f"symmotion design: {flag} {value}: {message}\n"


def test_solvers_are_named_as_flags_and_their_settings_stay(poses, tmp_path, capsys):
    arguments = ["design", str(poses), "--format", "tum", "-o", str(tmp_path / "m.json"), "--every", "13"]
    assert main([*arguments, "--tolerance", "0.01", "--solver", "elimination"]) == 2
    assert "--solver newton and --solver ipopt take it" in capsys.readouterr().err
    given = "(tolerance=1e-08, steps='twice'): delimiter='\\t', columns={'time': …}, None for none"
    options = parser().parse_args(arguments)
    flags = "--delimiter '\\t', --columns time=NAME,…, without a NAME for none"
    assert worded(given, options) == f"(tolerance=1e-08, steps='twice'): {flags}"
    assert main([*arguments, "--keep-rate", "2"]) == 2
    assert "--every and --keep-rate both thin a recording: give one" in capsys.readouterr().err
