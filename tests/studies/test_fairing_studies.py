"""The fairing studies in their quick form, with figures pinned, and the pictures that they share."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.figure import Figure as Canvas
from studied import table

import symmotion as sm
from studies.fairing import (
    fairing_conditions,
    fairing_methods,
    fairing_nets,
    fairing_seeds,
    fairing_spatial,
    fairing_spherical,
    recorded_turns,
    tool_path,
)
from studies.recorded import recorded_poses
from symmotion.bodies import grid_mesh, joined, jug, read_teapot
from symmotion.fairing import fair
from symmotion.motions import noisy_net, smooth_net
from symmotion.report import StudyOptions
from symmotion.views.fairing_figures import (
    draw_bodies,
    draw_body_along,
    draw_fairness,
    draw_isophotes,
    draw_net,
    draw_zebra,
    sample_patch,
    view_from,
)

NET = noisy_net(smooth_net(9, 8, spatial=True), 0.02, translation=0.05)


def test_spherical_reaches_the_papers_fairness_in_about_its_steps():
    result = fairing_spherical.STUDY.run(StudyOptions())
    rows = table(result, "iterations")
    exact = [r for r in rows if r["net"].startswith("exact")]
    assert all(r["G before"] == pytest.approx(7.84, rel=1e-3) and r["G after"] <= 0.002 for r in exact)
    assert all(1500 < r["steps"] < 3500 for r in exact)
    assert all(r["error after, RMS"] < 0.6 * r["error before, RMS"] for r in exact)
    noisy = [r for r in rows if r["net"].startswith("noisy")]
    assert min(r["steps"] for r in noisy) > max(r["steps"] for r in exact)
    before, after = table(result, "third-order continuity")
    assert after["largest jump at the knots"] < 0.05 * before["largest jump at the knots"]
    assert after["largest jump on the knot lines"] > 5 * after["largest jump at the knots"]
    assert "G is not monotone" in result.conclusion
    assert all(r.certified for r in result.runs)
    assert len(result.figures) == 7


def test_the_stop_rule_fires_where_its_definition_says():
    history = np.array([8.0, 5.0, 4.999, 3.0, 2.9999999, 1.0])
    assert fairing_nets.first_below(history, 1e-2) == 2
    assert fairing_nets.first_below(history, 1e-5) == 4
    assert fairing_nets.first_below(history, 1e-12) == 5


def test_spatial_measures_depend_on_the_origin_as_found():
    result = fairing_spatial.STUDY.run(StudyOptions())
    near, _, far = table(result, "origin")
    assert far["G of the dual part"] > 50 * near["G of the dual part"]
    assert far["G of the translation"] == pytest.approx(near["G of the translation"], rel=1e-9)
    rows = table(result, "what is faired")
    dual = [r for r in rows if r["faired"] == "dual"]
    assert all(r["G before"] == pytest.approx(10.195, rel=1e-9) for r in dual)
    assert all(r["G after"] < 0.01 for r in dual)
    assert all(r.certified for r in result.runs)
    ways = {r["method"]: r for r in table(result, "every method")}
    assert ways["least-squares"]["displacement, RMS"] <= min(r["displacement, RMS"] for r in ways.values())
    assert ways["bounded as greedy"]["G, median"] < 1e-3 * ways["greedy"]["G, median"]


def test_steps_over_seeds_are_told_as_distributions():
    assert fairing_nets.quartiles(np.array([1, 5, 2, 4, 3])) == (1.0, 2.0, 3.0, 4.0, 5.0)
    assert fairing_nets.quartiles(np.array([])) == (None,) * 5


def test_what_conditions_cost():
    result = fairing_conditions.STUDY.run(StudyOptions())
    for row in table(result, "fairness against displacement"):
        if row["method"] in ("greedy", "orthogonal", "Gaussian"):
            assert row["least"] > 1.5  # never as fair as the least squares at their displacement
    keys = {r["keyframes"]: r for r in table(result, "keyframes")}
    assert (
        1 <= keys["4 of the truth"]["over that without, median"] < keys["4 turned by 2°"]["over that without, median"]
    )
    borders = [r["G, median"] for r in table(result, "borders")][:4]
    assert borders == sorted(borders)
    amounts = {r["weight by"]: r["error, RMS, median"] for r in table(result, "how much")}
    assert amounts["best weight"] <= amounts["discrepancy"] < amounts["as measured"]
    c1, c2, c3 = table(result, "isophotes at knots")
    assert c2["break of direction, RMS"] < 1e-3 < 1 < c1["break of direction, RMS"]
    assert c3["break of curvature, relative"] < 0.25 * c2["break of curvature, relative"]
    assert all(r.certified for r in result.runs)
    for row in table(result, "one form beside the other"):
        assert row["nets apart by"] < 1e-13 and row["multipliers apart by, relative"] < 1e-11
    alike = {r["what"]: r for r in table(result, "multipliers")}
    # 2 × 2 with 34 and 64/9 in it: (34 + 64/9)/(34 − 64/9).
    assert alike["condition of the closed step's system, 2 × 2"]["median"] == pytest.approx(370 / 242)
    for row in table(result, "recorded orientation"):
        assert row["largest ratio"] < 0.5


def test_a_recorded_orientation_is_faired_without_a_recording_too(monkeypatch):
    monkeypatch.setattr(recorded_poses, "RECORDING", Path("nowhere"))
    curves, (note,) = recorded_turns.stretches(None)
    assert "made by the project" in note
    moved, angle, fairer, *_ = recorded_turns.faired_turns(curves[:1])[1]
    assert moved == 0.1 and angle == pytest.approx(0.1, rel=0.02) and fairer < 0.1


@pytest.fixture(scope="module")
def methods():
    return fairing_methods.STUDY.run(StudyOptions())


def test_methods_on_the_same_nets(methods):
    rows = {(r["net"], r["method"]): r for r in table(methods, "methods")}
    for n in (15,):
        net = f"{n} × {n}"
        greedy, orthogonal, least = (rows[net, m] for m in ("greedy", "orthogonal", "least squares"))
        target = 0.002 * (n - 4) ** 2 / 121
        assert all(r["G after"] <= target * (1 + 1e-9) for r in (greedy, orthogonal, least))
        assert least["displacement, RMS"] < min(greedy["displacement, RMS"], orthogonal["displacement, RMS"])
        assert all(r["error after, RMS"] < r["error before, RMS"] for r in rows.values())
    assert rows["15 × 15", "bounded, displacement ≤ 3σ"]["G after"] < 1e-6
    bounded = [r for r in methods.runs if "≤ 3σ" in r.case]
    assert all(r.status == "solved" for r in methods.runs if r not in bounded)
    # Where the bounds allow next to no jump at all, IPOPT has six digits of the point, which the certificate says.
    assert all(r.inertia == "positive" and r.decrement < 1e-12 * r.objective for r in bounded)


def test_steps_to_the_papers_target_and_fairness_at_equal_displacement_over_seeds(methods):
    steps = {r["nets"]: r for r in table(methods, "steps over seeds")}
    assert len(steps) == 6 and all(r["of"] == 8 for r in steps.values())
    uniform = steps["uniform knots, greedy"]
    assert uniform["reached"] == 8 and uniform["steps, least"] == 1918 and uniform["steps, largest"] == 2516
    assert all(r["nets apart by"] < 1e-12 for r in table(methods, "forms of the step"))
    equal = table(methods, "equal displacement")
    assert {r["knots"] for r in equal} == set(fairing_seeds.SPACINGS)
    for row in equal:
        if row["method"] != "least squares":
            assert row["fairer"] == 0 and row["less fair"] == row["nets"]
            assert row["from"] > 2  # local steps are never as fair as what is displaced as far


def test_past_the_minimum_the_oblique_steps_get_worse_and_the_orthogonal_do_not(methods):
    greedy, orthogonal = table(methods, "past the minimum")
    assert greedy["G at the end"] > 2 * greedy["least G"]
    assert orthogonal["G at the end"] < 1.5 * orthogonal["least G"]
    assert orthogonal["least G"] < greedy["least G"]


def test_over_fairing_moves_away_from_a_true_net_that_is_not_all_smooth(methods):
    errors = [r["error, RMS"] for r in table(methods, "over-fairing") if r["method"] == "least-squares"]
    assert min(errors) < errors[0]
    assert errors[-1] > 1.02 * min(errors)


def test_tool_path_is_smoother(monkeypatch):
    result = tool_path.STUDY.run(StudyOptions())
    before, *_, after = table(result, "passes")
    assert after["G"] == pytest.approx(before["G"] / 100, rel=0.02)
    for quantity in ("turning acceleration, RMS", "vertical acceleration, RMS"):
        assert after[quantity] < 0.8 * before[quantity]
    within = {r["tool motion"].split(",")[0]: r["G"] for r in table(result, "passes") if "≤" in r["tool motion"]}
    assert within["bounded"] < 0.5 * min(within["greedy"], within["orthogonal"])
    assert all(r.certified for r in result.runs)


def test_studies_run_on_shapes_made_by_the_project(monkeypatch):
    def missing(name):
        raise FileNotFoundError(name)

    monkeypatch.setattr(tool_path, "get_sample_data", missing)
    monkeypatch.setattr(fairing_nets, "TEAPOT", Path("nowhere"))
    points, note = tool_path.height_field(9, 9)
    assert points.shape == (9, 9, 3)
    assert "made by the project" in note
    mesh, name, note = fairing_nets.body()
    assert name == "jug"
    assert "made by the project" in note
    assert max(max(face) for face in mesh.faces) < len(mesh.vertices)


@pytest.mark.skipif(not fairing_nets.TEAPOT.is_file(), reason=f"{fairing_nets.TEAPOT} is not there")
def test_the_teapot_is_whole_and_symmetric():
    mesh = read_teapot(fairing_nets.TEAPOT)
    assert len(mesh.faces) == 9 * (6 * 4 + 4 * 2)
    mirrored = {tuple(p) for p in np.round(mesh.vertices * [1, -1, 1], 6) + 0.0}
    assert mirrored == {tuple(p) for p in np.round(mesh.vertices, 6) + 0.0}
    small = mesh.scaled(2.0)
    assert np.ptp(small.vertices, axis=0).max() == pytest.approx(2.0)


def test_a_body_of_patches_that_is_none(tmp_path):
    path = tmp_path / "pot.json"
    path.write_text('{"points": [[0, 0, 0]], "patches": [[7]]}')
    with pytest.raises(sm.InputError, match=r"pot.json: is no file of Bézier patches"):
        read_teapot(path)


@pytest.mark.parametrize("image", ["rotation", "dual", "trajectory"])
def test_normals_are_those_of_the_surface(image):
    """Unit, and at right angles to its differences; the isophotes of a plane's light then lie where they should."""
    patch = sample_patch(NET, image, (0.3, 0.1, 1.0), samples=200)
    np.testing.assert_allclose(np.linalg.norm(patch.normals, axis=-1), 1.0, atol=1e-12)
    for axis in (0, 1):
        chords = np.diff(patch.points, n=1, axis=axis)
        chords = chords / np.linalg.norm(chords, axis=-1, keepdims=True)
        middle = (patch.normals.take(range(1, 200), axis) + patch.normals.take(range(199), axis)) / 2
        assert np.abs(np.sum(chords * middle, axis=-1)).max() < 2e-3


def test_a_surface_without_normals_is_refused():
    spherical = smooth_net(6)
    with pytest.raises(sm.InputError, match="has no normal everywhere"):
        sample_patch(spherical, "trajectory", (0.0, 0.0, 0.0), samples=5)


def test_views_are_rotations():
    for direction in ((1, 2, 3), (0, 0, 1), (0, 0, -1)):
        view = view_from(direction)
        np.testing.assert_allclose(view.T @ view, np.eye(3), atol=1e-14)
        np.testing.assert_allclose(view[:, 2] * np.linalg.norm(direction), direction, atol=1e-14)


def test_pictures_take_axes_and_draw_on_them():
    axes = Canvas().subplots()
    patch = sample_patch(NET, samples=20)
    draw_isophotes(axes, patch, levels=5)
    count = len(axes.collections)
    assert count >= 1
    assert not axes.texts
    sideways = Canvas().subplots()
    draw_isophotes(sideways, patch, levels=5, direction=np.cross(patch.normals[10, 10], [0.3, 0.5, 0.8]))
    assert [text.get_text() for text in sideways.texts] == ["folds along the dashed line"]
    draw_zebra(axes, patch, stripes=3)
    draw_net(axes, NET.control_displacements.translation)
    assert len(axes.collections) > count
    result = fair(NET, max_steps=20)
    heat: Any = draw_fairness(axes, NET, result.before)
    assert heat.get_array().size == result.before.size
    mesh = joined([jug(), grid_mesh(np.random.default_rng(0).normal(size=(3, 3, 3)))])
    canvas = Canvas().subplots()
    draw_body_along(canvas, NET, mesh, np.array([4.0, 5.0]), 4.0)
    assert len(canvas.collections[0].get_paths()) == 2 * len(mesh.faces)
    draw_body_along(canvas, NET.boundary("u0"), mesh, np.linspace(*NET.v.domain, 3))
    draw_bodies(canvas, np.eye(3), np.zeros(3), mesh)
    assert len(canvas.collections) == 3
