import json

import numpy as np
import pytest

from symmotion.commands import main
from symmotion.fairing import Continued, fair
from symmotion.files import read_tool_path, read_two_parameter, write_tool_path, write_two_parameter
from symmotion.motions import DualQuaternions
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


def test_conditions_are_read_from_tables_and_nets(net, tmp_path):
    u, v = np.array([5.0, 7.0]), np.array([6.0, 5.0])
    write_tool_path(MOTION, tmp_path / "kept.csv", u, v)
    weights = np.linspace(1, 2, 81).reshape(9, 9)
    np.savetxt(tmp_path / "weights.txt", weights)
    neighbour = MOTION.seen_from(DualQuaternions.from_parts([1.0, 0, 0, 0], [1e-3, 0, 0]))
    write_two_parameter(neighbour, tmp_path / "next.json")
    out = tmp_path / "out.npz"
    given = ["--keyframes", str(tmp_path / "kept.csv"), "--weights", str(tmp_path / "weights.txt")]
    borders = ["--borders", "u0=G1", "v1=free", f"u1=G0:{tmp_path / 'next.json'}"]
    assert main(["fair", str(net), "-o", str(out), "--method", "least-squares", *given, *borders]) == 0
    faired = read_two_parameter(out)
    there, asked = faired(u, v), MOTION(u, v)
    np.testing.assert_allclose(there.linear, asked.linear, atol=1e-12)
    np.testing.assert_allclose(there.translation, asked.translation, atol=1e-12)
    sides = {"u0": "G1", "v1": "free", "u1": Continued(neighbour, "G0")}
    keys = read_tool_path(tmp_path / "kept.csv").keyframes()
    expected = fair(MOTION, "least-squares", keyframes=keys, weights=weights, borders=sides)
    np.testing.assert_array_equal(faired.real, expected.motion.real)


def test_noise_chooses_least_squares_and_a_table_of_turns_holds_a_spherical_net(tmp_path):
    spherical = noisy_net(smooth_net(9), 0.01, seed=1)
    write_two_parameter(spherical, tmp_path / "net.json")
    q = DualQuaternions.from_matrices(spherical(5.0, 6.0).linear).real
    (tmp_path / "turns.csv").write_text("u,v,qw,qx,qy,qz\n5,6," + ",".join(f"{x:.17g}" for x in q) + "\n")
    out = tmp_path / "out.npz"
    options = ["--noise", "0.01", "--keyframes", str(tmp_path / "turns.csv"), "--borders", "G0"]
    assert main(["fair", str(tmp_path / "net.json"), "-o", str(out), *options]) == 0
    faired = read_two_parameter(out)
    np.testing.assert_allclose(faired(5.0, 6.0).linear, spherical(5.0, 6.0).linear, atol=1e-12)
    assert fair(faired, max_steps=0).initial < 0.01 * fair(spherical, max_steps=0).initial


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
        (["{net}", "-o", "{tmp}/m.json", "--borders", "u0=G1", "u0=G2"], "--borders u0=G2: u0 is twice"),
        (["{net}", "-o", "{tmp}/m.json", "--borders", "u7=G1"], "--borders 'u7' is unknown; there are u0, u1, v0, v1"),
        (["{net}", "-o", "{tmp}/m.json", "--borders", "G7"], "--borders 'G7' is unknown; there are ring, free, G0"),
        (
            ["{net}", "-o", "{tmp}/m.json", "--noise", "1", "2", "3"],
            "--noise: noise [1.0, 2.0, 3.0]: a positive number",
        ),
        (["{net}", "-o", "{tmp}/m.json", "--keyframes", "{tmp}/out.csv"], "out.csv: keyframe 0 at u = 50 is outside"),
        (["{net}", "-o", "{tmp}/m.json", "--keyframes", "{tmp}/half.csv"], "half.csv: of the columns (u, v, x, qw,"),
        (
            ["{net}", "-o", "{tmp}/m.json", "--weights", "{tmp}/w.txt"],
            "w.txt: weights of shape (2, 2): positive numbers",
        ),
    ],
)
def test_bad_input_is_one_line_and_status_2(arguments, message, net, tmp_path, capsys):
    write_two_parameter(smooth_net(4, 6), tmp_path / "small.json")
    (tmp_path / "out.csv").write_text("u,v,qw,qx,qy,qz\n50,5,1,0,0,0\n")
    (tmp_path / "half.csv").write_text("u,v,x,qw,qx,qy,qz\n5,5,0,1,0,0,0\n")
    (tmp_path / "w.txt").write_text("1 1\n1 1\n")
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
