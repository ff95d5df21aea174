"""What is said of strange input is one line that a terminal shows, and not a long one."""

import json
import pickle

import pytest

import symmotion as sm
from symmotion.commands import main
from symmotion.errors import LONGEST, plain

BELL = "\x1b]0;owned\x07\x9b2J\u202egpj\n\u2028"


def test_control_characters_are_escaped_and_ends_of_long_texts_kept():
    assert plain("a\x1b[2J\x9bb\u202ec\nd\te\udc80") == "a\\x1b[2J\\x9bb\\u202ec d e\\udc80"
    assert plain("Δ ≥ ½ ‖g‖∞ – “ok” 漢字") == "Δ ≥ ½ ‖g‖∞ – “ok” 漢字"
    long = plain("begin" + "\x1b" * 10**6 + "end")
    assert len(long) == LONGEST and long.startswith("begin\\x1b") and long.endswith("\\x1bend")
    for kind in (sm.InputError, sm.SolveError):
        error = kind("x\x1b" * 3000)
        assert str(error).isprintable() and len(str(error)) <= LONGEST
        assert str(pickle.loads(pickle.dumps(error))) == str(error)


FILES = {
    "header.csv": f"t,{'x' * 5000}{BELL.replace(chr(10), '')},x\n0,1,2\n",
    "entry.json": json.dumps({"linear": [1.0], **{f"{BELL}{k}": 1 for k in range(500)}}),
    "class.json": json.dumps({"symmotion": "value", "version": 1, "class": BELL}),
    "marked.json": json.dumps({"symmotion": BELL, "version": BELL}),
    "word.tum": f"{BELL} 1 2 3 4 5 6 7\n",
    "joint.bvh": f"HIERARCHY\nROOT {BELL}\n",
    "keyword.bvh": f"{BELL}\n",
    "nodes.gltf": json.dumps(
        {"asset": {"version": "2.0"}, "nodes": [{"name": BELL}], "animations": [{"name": BELL, "channels": []}]}
    ),
    "version.gltf": json.dumps({"asset": {"version": BELL}}),
    "beside.gltf": json.dumps(
        {
            "asset": {"version": "2.0"},
            "nodes": [{}],
            "buffers": [{"byteLength": 4, "uri": BELL}],
            "bufferViews": [{"buffer": 0, "byteLength": 4}],
            "accessors": [{"bufferView": 0, "count": 1, "componentType": 5126, "type": "SCALAR"}],
            "animations": [
                {
                    "samplers": [{"input": 0, "output": 0}],
                    "channels": [{"sampler": 0, "target": {"node": 0, "path": "translation"}}],
                }
            ],
        }
    ),
}


@pytest.mark.parametrize("name", FILES)
def test_contents_and_names_of_files_do_not_reach_the_terminal_as_they_are(name, tmp_path, capsys):
    stem, _, ending = name.rpartition(".")
    path = tmp_path / f"{stem}\x1b[31m\x07\n.{ending}"
    path.write_text(FILES[name], encoding="utf-8")
    assert main([*("convert", str(path)), "-o", str(tmp_path / "out.csv")]) == 2
    out, err = capsys.readouterr()
    assert out == "" and err.endswith("\n") and err[:-1].isprintable() and len(err) <= LONGEST + 40


def test_names_that_are_said_where_all_is_well_are_escaped_too(tmp_path, capsys):
    path = tmp_path / "poses\x1b[31m.csv"
    sm.write_keyframes(sm.examples.planar_keyframes(), path)
    assert main(["convert", str(path), "-o", str(tmp_path / "out\x1b[0m.json")]) == 0
    out, err = capsys.readouterr()
    assert all(line.isprintable() for line in (out + err).splitlines()) and "\\x1b" in out
    with pytest.raises(SystemExit):
        main(["convert", "a.csv", "-o", "b.csv", "--nothing\x1b[31m"])
    assert all(line.isprintable() for line in capsys.readouterr().err.splitlines())
