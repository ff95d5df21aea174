import json

import numpy as np
import pytest

import symmotion as sm
from symmotion.commands import main
from symmotion.commands.objectives import objective_by_name
from symmotion.smoothing import rigid_objective

KEYS = sm.examples.random_keyframes(5, 50, 1)


@pytest.fixture
def poses(tmp_path):
    path = tmp_path / "poses.tum"
    sm.write_keyframes(KEYS, path)
    return path


def test_compare_writes_one_report_for_all_files_and_objectives(poses, tmp_path, capsys):
    planar = tmp_path / "plane <b>.csv"
    sm.write_keyframes(sm.examples.planar_keyframes(), planar)
    out = tmp_path / "out"
    objectives = ["R", "rigidity2", "rigidity+1e-3*energy"]
    assert main(["compare", str(poses), str(planar), "-o", str(out), "--objective", *objectives]) == 0
    report = json.loads((out / "report.json").read_text())
    assert len(report["studies"]) == 2
    runs = report["studies"][0]["runs"]
    assert [(r["case"], r["method"]) for r in runs[:4]] == [
        ("R", "newton"),
        ("R", "ipopt"),
        ("R", "elimination"),
        ("R*", "newton"),
    ]
    optimum = sm.ExactNewton().solve(sm.affine_program(KEYS)).objective
    assert runs[0]["objective"] == pytest.approx(optimum, rel=1e-12)
    page = (out / "index.html").read_text()
    assert "plane &lt;b&gt;.csv" in page
    assert "plane <b>" not in page
    assert "report:" in capsys.readouterr().out


def test_what_there_is_to_say_of_keyframes_is_said_on_standard_error(tmp_path, capsys):
    crowded, mirrored, out = tmp_path / "crowded.csv", tmp_path / "mirrored.csv", str(tmp_path / "m.json")
    still = KEYS.moved(2, KEYS.linear[1], KEYS.translation[1])
    sm.write_keyframes(still.with_times([0, 1, 1 + 1e-4, 2, 3]), crowded)
    sm.write_keyframes(KEYS.moved(1, KEYS.linear[1] @ np.diag([1, 1, -1])), mirrored)
    assert main(["design", str(crowded), "-o", out, "--refine", "0"]) == 0
    told = capsys.readouterr()
    assert f"symmotion design: {crowded}: note: keyframes 1 and 2 (times 1.0 and 1.0001) are 1.0e-04 of" in told.err
    assert "note" not in told.out
    assert main(["compare", str(mirrored), "-o", str(tmp_path / "r"), "--solvers", "newton"]) in (0, 1)
    assert "mirrored.csv: note: keyframes 0 and 1 have determinants 1 and -1" in capsys.readouterr().err
    main(["design", str(crowded), "-o", out, "--refine", "0", "--quiet"])
    assert capsys.readouterr().err == ""
    sm.write_keyframes(still.with_times([0, 1, 1 + 1e-9, 2, 3]), crowded)
    assert main(["design", str(crowded), "-o", out]) == 2
    message = "crowded.csv: keyframes 1 and 2 (times 1.0 and 1.000000001) are 1.0e-09 of the median step apart, hardly"
    assert message in capsys.readouterr().err


def test_design_writes_the_optimal_motion_in_the_formats_asked_for(poses, tmp_path, capsys):
    exact, samples, rigid = (tmp_path / name for name in ("m.json", "m.csv", "m.tum"))
    assert main(["design", str(poses), "-o", str(exact), str(samples), str(rigid), "--orthonormalise"]) == 0
    motion = sm.files.read_motion(exact)
    t = np.linspace(*motion.domain, 30)
    # What suits rigid keyframes: with R alone the turn between them differs by more than a hundredth.
    best = sm.ExactNewton().solve(sm.affine_program(KEYS, objective=rigid_objective(KEYS))).motion
    np.testing.assert_allclose(motion(t).linear, best(t).linear, atol=1e-9)
    plain = sm.ExactNewton().solve(sm.affine_program(KEYS)).motion
    assert np.abs(motion(t).linear - plain(t).linear).max() > 0.01
    sampled = sm.read_keyframes(samples)
    np.testing.assert_allclose(sampled.linear, motion(sampled.times).linear, atol=1e-14)
    assert len(sm.read_keyframes(rigid)) == 200
    assert "inertia positive" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["design", "{tmp}/none.tum", "-o", "{tmp}/m.json"], "none.tum: "),
        (["design", "{poses}", "-o", "{tmp}/m.obj"], "format 'obj' is unknown; there are json, csv, tum"),
        (["design", "{poses}", "-o", "{tmp}/no/m.json"], "no/m.json"),
        (["design", "{poses}", "-o", "{tmp}/no/m.glb"], "no/m.glb"),
        (
            ["design", "{poses}", "-o", "{tmp}/m.json", "--node", "hip"],
            "--node goes with .csv, .bvh, .glb, .gltf, .usda",
        ),
        (["design", "{poses}", "-o", "{tmp}/m.json", "--seconds", "3"], "--seconds goes with .glb, .usda, .usd, "),
        (["design", "{poses}", "-o", "{tmp}/m.glb", "--seconds", "-3"], "--seconds -3.0: a positive number"),
        (["design", "{poses}", "-o", "{tmp}/m.json", "{tmp}/m.glb", "--rate", "9"], "--rate goes with .csv, .tum"),
        (["design", "{poses}", "-o", "{tmp}/m.csv", "--rate", "nan"], "--rate nan: a positive number"),
        (["design", "{poses}", "-o", "{tmp}/m.glb", "--orthonormalise"], "--orthonormalise goes with .tum"),
        (["design", "{poses}", "-o", "{tmp}/m.json", "{poses}"], "poses.tum: is the file that is read"),
        (["design", "{poses}", "-o", "{tmp}/m.json", "{tmp}/m.gif", "--seconds", "1e6"], "m.gif: 1e+06 seconds of 20"),
        (["design", "{poses}", "-o", "{tmp}/m.json", "{tmp}/no/m.gif"], "no/m.gif: cannot be written"),
        (["design", "{poses}", "-o", "{tmp}/m.json", "--objective", "torque"], "objective 'torque' is unknown"),
        (["design", "{poses}", "-o", "{tmp}/m.json", "--objective", "1.2.3*rigidity"], "'1.2.3' is no number"),
        (["design", "{poses}", "-o", "{tmp}/m.json", "--objective=-1*rigidity"], "weight -1 of R"),
        (["design", "{poses}", "-o", "{tmp}/m.json", "--solver", "snopt"], "solver 'snopt' is unknown; there are"),
        (["design", "{poses}", "-o", "{tmp}/m.json", "--degree", "0"], "--degree 0: a whole number, 1 or more"),
        (["design", "{poses}", "-o", "{tmp}/m.json", "--degree", "three"], "invalid int value: 'three'"),
        (["design", "{poses}", "-o", "{tmp}/m.json", "--ends", "periodic"], "last keyframe equal to the first"),
        (["design", "{poses}", "-o", "{tmp}/m.json", "--solver", "elimination", "--degree", "5"], "insert more knots"),
        (["design", "{poses}", "-o", "{tmp}/m.json", "--periodic"], "first and the last keyframe differ"),
        (["design", "{poses}", "-o", "{tmp}/m.json", "--tolerance", "-1"], "--tolerance -1.0: a positive number"),
        (
            ["design", "{poses}", "-o", "{tmp}/m.json", "--tolerance", "1", "--solver", "elimination"],
            "inequality; --solver newton and",
        ),
        (["design", "{poses}", "-o", "{tmp}/m.json", "--tolerance", "1", "--auto-knots", "3"], "leave one out"),
        (
            ["design", "{poses}", "-o", "{tmp}/m.json", "--auto-knots", "-3"],
            "--auto-knots -3: a whole number of knots",
        ),
        (["design", "{poses}", "-o", "{tmp}/m.json", "--auto-knots", "3", "--free-times"], "leave one out"),
        (["design", "{poses}", "-o", "{tmp}/m.json", "--auto-knots", "3", "--explore", "5"], "leave one out"),
        (["design", "{poses}", "-o", "{tmp}/m.json", "--explore", "0"], "--explore 0: a whole number of starts, 1"),
        (["design", "{poses}", "-o", "{tmp}/m.json", "--tolerance", "1", "--free-times"], "leave one out"),
        (["compare", "{poses}", "-o", "{poses}"], "poses.tum"),
        (["compare", "{poses}", "--solvers", "newton", "magic", "-o", "{tmp}/r"], "solver 'magic' is unknown"),
        (["compare", "-o", "{tmp}/r"], "required: FILE"),
        (["dance"], "invalid choice: 'dance'"),
        ([], "required"),
    ],
)
def test_bad_input_is_one_line_and_status_2(arguments, message, poses, tmp_path, capsys):
    keys = sm.examples.random_keyframes(60, 40, 0)
    if "elimination" in arguments:
        sm.write_keyframes(keys, poses)
    given = [a.format(tmp=tmp_path, poses=poses) for a in arguments]
    try:
        status = main(given)
    except SystemExit as stopped:
        status = stopped.code
    error = capsys.readouterr().err
    assert status == 2
    assert message in error
    assert error.count("\n") == 1
    assert not (tmp_path / "m.json").exists()
    assert not (tmp_path / "r").exists()


@pytest.mark.parametrize(
    "flags",
    [
        ["--periodic"],
        ["--tolerance", "0.02"],
        ["--auto-knots", "6", "--objective", "rigidity"],
        ["--periodic", "--tolerance", "0.02"],
    ],
    ids=lambda flags: " ".join(flags),
)
def test_design_takes_conditions_and_automatic_knots(flags, tmp_path):
    closed = KEYS.moved(-1, KEYS.linear[0], KEYS.translation[0])
    path, out = tmp_path / "closed.json", tmp_path / "m.json"
    sm.write_keyframes(closed, path)
    assert main(["design", str(path), "-o", str(out), *flags]) == 0
    motion = sm.files.read_motion(out)
    off = np.abs(motion(closed.times).linear - closed.linear).max()
    assert off == pytest.approx(0.02, abs=1e-5) if "--tolerance" in flags else off < 1e-9
    if "--periodic" in flags:
        a, b = motion.domain
        np.testing.assert_allclose(motion(a, 2).linear, motion(b, 2).linear, atol=1e-6)
    if "--auto-knots" in flags:
        assert len(motion.breakpoints) == len(closed) + 6


def test_design_writes_scenes_and_films(poses, tmp_path, capsys):
    names = ["m.glb", "m.usda", "m.gif"]
    assert main(["design", str(poses), "-o", *(str(tmp_path / n) for n in names), "--seconds", "0.4"]) == 0
    assert sorted(p.name for p in tmp_path.iterdir()) == sorted(["poses.tum", *names])
    said = capsys.readouterr().out.splitlines()
    assert said[0].startswith(f"wrote {tmp_path / 'm.glb'}: 9 cubic Hermite keys of four joints, exact up to rounding")
    assert "matrix samples, sampled, error" in said[1]
    assert said[2] == f"wrote {tmp_path / 'm.gif'}"


@pytest.mark.parametrize("node", ["arm", "1"])
def test_design_takes_a_joint_of_a_skeleton(tmp_path, node):
    walk, out = tmp_path / "walk.bvh", tmp_path / "m.json"
    walk.write_text(
        "HIERARCHY\nROOT hip { OFFSET 0 0 0 CHANNELS 3 Xposition Yposition Zposition\n"
        "JOINT arm { OFFSET 0 1 0 CHANNELS 1 Zrotation } }\nMOTION\nFrames: 3\nFrame Time: 0.5\n"
        "0 0 0 0\n1 0 0 30\n2 1 0 50\n"
    )
    assert main(["design", str(walk), "--node", node, "-o", str(out)]) == 0
    keys = sm.read_keyframes(walk, node="arm")
    motion = sm.files.read_motion(out)
    np.testing.assert_allclose(motion(keys.times).linear, keys.linear, atol=1e-9)
    assert motion.domain == (0, 1)


def test_design_frees_the_times(poses, tmp_path):
    out = tmp_path / "m.json"
    assert main(["design", str(poses), "-o", str(out), "--free-times"]) == 0
    given = sm.ExactNewton().solve(sm.affine_program(KEYS)).require()
    free = sm.files.read_motion(out)
    assert free.domain == pytest.approx(given.motion.domain)
    assert sm.measure(free, sm.Rigidity()) < given.objective


def test_a_failed_solve_is_status_1_and_writes_no_motion(poses, tmp_path, capsys):
    sm.write_keyframes(sm.examples.random_keyframes(20, 140, 0), poses)
    out = tmp_path / "m.json"
    options = ["--objective", "rigidity", "--solver", "elimination"]
    assert main(["design", str(poses), "-o", str(out), *options]) == 1
    assert capsys.readouterr().err.startswith("symmotion design: ")
    assert not out.exists()
    assert main(["compare", str(poses), "-o", str(tmp_path / "r"), "--solvers", "elimination"]) == 1
    assert (tmp_path / "r" / "index.html").exists()


@pytest.mark.parametrize("command", [[], ["compare"], ["design"]])
def test_help_shows_an_example(command, capsys):
    with pytest.raises(SystemExit) as stopped:
        main([*command, "--help"])
    assert stopped.value.code == 0
    text = capsys.readouterr().out
    assert "example:" in text or not command


def test_objectives_by_name():
    assert objective_by_name("rigidity", 3).name == "R"
    assert objective_by_name("R* + 1e-3*E", 2).name == "R* + 0.001 E"
    assert objective_by_name("2.5e+1*rigidity+energy", 3).name == "25 R + E"


def test_design_explores_minima(tmp_path, capsys):
    linear = np.stack([sm.examples.rotation_2d(a) for a in (0, 150, 320)])
    keys = sm.Keyframes([0.0, 1.0, 2.0], linear, np.zeros((3, 2)))
    sm.write_keyframes(keys, tmp_path / "far.csv")
    out = tmp_path / "m.json"
    assert main(["design", str(tmp_path / "far.csv"), "-o", str(out), "--refine", "0", "--explore", "8"]) == 0
    said = capsys.readouterr().out
    objective = rigid_objective(keys)
    lowest = sm.explore(sm.affine_program(keys, refine=0, objective=objective), budget=8).best
    assert "minima from 8 starts" in said
    motion = sm.load(out)
    assert isinstance(motion, sm.AffineMotion)
    assert sm.measure(motion, objective) == pytest.approx(lowest.objective, rel=1e-9)
