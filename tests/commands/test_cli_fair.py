import json

import numpy as np
import pytest

from symmotion.commands import main
from symmotion.fairing import fair
from symmotion.files import read_two_parameter, write_two_parameter
from symmotion.motions.nets import noisy_net, smooth_net

MOTION = noisy_net(smooth_net(9, spatial=True), 0.02, translation=0.05, seed=3)


@pytest.fixture
def net(tmp_path):
    path = tmp_path / "net.json"
    write_two_parameter(MOTION, path)
    return path


def test_fair_writes_the_faired_motion_in_the_formats_asked_for(net, tmp_path, capsys):
    out, archive = tmp_path / "out.json", tmp_path / "out.npz"
    assert main(["fair", str(net), "-o", str(out), str(archive), "--target", "0.1"]) == 0
    expected = fair(MOTION, target=0.1)
    for path in (out, archive):
        faired = read_two_parameter(path)
        np.testing.assert_array_equal(faired.real, expected.motion.real)
        np.testing.assert_array_equal(faired.dual, expected.motion.dual)
    printed = capsys.readouterr().out
    assert f"wrote {out}" in printed
    assert "FairingResult(greedy: target, G " in printed


@pytest.mark.parametrize(
    ("arguments", "keywords"),
    [
        (["--method", "orthogonal", "--max-steps", "40"], {"method": "orthogonal", "max_steps": 40}),
        (["--method", "least-squares", "--weight", "2"], {"method": "least-squares", "weight": 2.0}),
        (
            ["--parts", "translation", "--length", "3", "--tolerance", "0.02", "--max-steps", "20"],
            {"parts": "translation", "length": 3.0, "tolerance": 0.02, "max_steps": 20},
        ),
        (
            ["--region", "4", "6", "5", "8", "--max-steps", "9"],
            {"region": ((4, 6), (5, 8)), "max_steps": 9},
        ),
    ],
)
def test_options_are_those_of_fair(arguments, keywords, net, tmp_path):
    out = tmp_path / "out.npz"
    assert main(["fair", str(net), "-o", str(out), *arguments]) == 0
    np.testing.assert_array_equal(read_two_parameter(out).real, fair(MOTION, **keywords).motion.real)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["{tmp}/none.json", "-o", "{tmp}/m.json"], "none.json: "),
        (["{net}", "-o", "{tmp}/m.tum"], "format 'tum' is unknown; there are json, npz"),
        (["{net}", "-o", "{tmp}/no/m.json"], "no/m.json"),
        (["{net}", "-o", "{tmp}/m.json", "--method", "magic"], "--method 'magic' is unknown; there are greedy, orth"),
        (["{net}", "-o", "{tmp}/m.json", "--target", "-1"], "--target -1.0: a positive number"),
        (["{net}", "-o", "{tmp}/m.json", "--target", "low"], "invalid float value: 'low'"),
        (["{net}", "-o", "{tmp}/m.json", "--method", "bounded"], "needs a tolerance"),
        (["{net}", "-o", "{tmp}/m.json", "--region", "0", "1", "2"], "expected 4 arguments"),
        (["{net}", "-o", "{tmp}/m.json", "--region", "0", "1", "2", "3"], "net.json: region u from 0 to 1"),
        (["{small}", "-o", "{tmp}/m.json"], "small.json: 4 controls in u have no interior knot"),
        (["-o", "{tmp}/m.json"], "required: FILE"),
    ],
)
def test_bad_input_is_one_line_and_status_2(arguments, message, net, tmp_path, capsys):
    write_two_parameter(smooth_net(4, 6), tmp_path / "small.json")
    given = [a.format(tmp=tmp_path, net=net, small=tmp_path / "small.json") for a in arguments]
    try:
        status = main(["fair", *given])
    except SystemExit as stopped:
        status = stopped.code
    error = capsys.readouterr().err
    assert status == 2
    assert message in error
    assert error.count("\n") == 1
    assert not (tmp_path / "m.json").exists()


def test_a_target_that_is_not_reached_is_status_1_and_writes_nothing(net, tmp_path, capsys):
    out = tmp_path / "m.json"
    assert main(["fair", str(net), "-o", str(out), "--target", "0.001", "--max-steps", "5"]) == 1
    error = capsys.readouterr().err
    assert error.startswith(f"symmotion fair: {net}: ")
    assert "above the target 0.001" in error
    assert not out.exists()


def test_a_net_of_axes_and_angles_as_in_the_paper(tmp_path):
    n = 7
    rng = np.random.default_rng(1)
    document = {"axis": rng.normal(size=(n, n, 3)) * 0.1 + [0, 0, 1.0], "angle": rng.uniform(0.4, 0.6, size=(n, n))}
    path = tmp_path / "net.json"
    path.write_text(json.dumps({k: v.tolist() for k, v in document.items()}))
    assert main(["fair", str(path), "-o", str(tmp_path / "fair.json"), "--max-steps", "50"]) == 0
    assert read_two_parameter(tmp_path / "fair.json").spherical


def test_help_shows_an_example(capsys):
    with pytest.raises(SystemExit) as stopped:
        main(["fair", "--help"])
    assert stopped.value.code == 0
    assert "example:" in capsys.readouterr().out
