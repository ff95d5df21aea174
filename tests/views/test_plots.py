"""Pictures by one call show what the objects hold, at every scale, on any axes, and refuse what cannot be drawn."""

import re
import xml.etree.ElementTree as ET
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any, cast

import matplotlib
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import symmotion as sm
from studies.guide import pictures
from symmotion.motions.nets import noisy_net, smooth_net
from symmotion.report import StudyOptions
from symmotion.splines import BSplineBasis, Spline
from symmotion.views.motion_plots import plot_curve

matplotlib.use("Agg")
import matplotlib.pyplot as plt

TIMES = np.arange(4.0)
TURNS = Rotation.from_euler("ZYX", [[0, 0, 0], [60, 30, 10], [110, -20, 70], [190, 25, 95]], degrees=True)
PLANAR, SPATIAL = sm.examples.planar_keyframes(), sm.examples.spatial_keyframes()
BOX = np.array([[0.0, 0.0], [0.5, 0.0], [0.5, 0.25], [0.0, 0.25]])


@pytest.fixture(autouse=True)
def closed():
    plt.close("all")
    yield
    plt.close("all")


@pytest.fixture(scope="module")
def comparison():
    objective = sm.Rigidity() + 1e-3 * sm.TrajectoryEnergy(np.eye(3))
    return sm.compare(sm.affine_program(SPATIAL, objective=objective))


@pytest.fixture(scope="module")
def unsupported():
    return sm.compare(sm.free_times_program(PLANAR, objective=sm.Rigidity(2)), [sm.Elimination()])


@pytest.fixture(scope="module")
def net():
    return noisy_net(smooth_net(9), 0.018, seed=1)


@pytest.fixture(scope="module")
def spatial_net():
    return smooth_net(8, spatial=True)


@pytest.fixture(scope="module")
def faired(net):
    return sm.fair(net, target=0.05)


def orientation() -> sm.quaternions.QuaternionMotion:
    return sm.quaternions.interpolate_quaternions(TIMES, TURNS)


def pose() -> sm.motions.PoseMotion:
    curve = orientation()
    path = np.random.default_rng(3).normal(size=(curve.basis.n, 3))
    return sm.motions.PoseMotion(curve, Spline(curve.basis, path))


def along(surface):
    (a, b), (c, d) = surface.domain
    return surface.along(Spline(BSplineBasis.clamped([0.0, 1.0], 1), np.array([[a, c], [b, d]])))


DRAWN = {
    "affine, plane": lambda: sm.interpolants.component_cubic(PLANAR),
    "affine, space": lambda: sm.interpolants.component_cubic(SPATIAL),
    "interpolant": lambda: sm.interpolants.steady_morph(PLANAR),
    "interpolant, space": lambda: sm.interpolants.polar_blend(SPATIAL),
    "pose": pose,
    "orientation": orientation,
    "product of turns": lambda: sm.interpolants.monotone_curve(TIMES, TURNS),
    "slerps": lambda: sm.interpolants.slerp_curve(TIMES, TURNS),
    "spherical": lambda: smooth_net(6).isoparametric(u=4.0),
    "rational": lambda: smooth_net(6, spatial=True).isoparametric(v=4.0),
    "curve in a surface": lambda: along(smooth_net(6, spatial=True)),
    "two parameters": lambda: smooth_net(6),
    "two parameters, space": lambda: smooth_net(6, spatial=True),
    "rigid": lambda: sm.motions.orthonormalise(sm.interpolants.component_cubic(PLANAR), np.linspace(0, 1, 5)),
    "keyframes": lambda: SPATIAL,
    "faired curve": lambda: sm.fair(noisy_net(smooth_net(9), 0.02).isoparametric(u=5.0), max_steps=5),
}


@pytest.mark.parametrize("make", DRAWN.values(), ids=DRAWN)
def test_draws_on_axes_of_its_own_and_on_those_given(make, tmp_path):
    before = dict(matplotlib.rcParams)
    drawn = make()
    own = drawn.plot()
    assert plt.get_fignums() == [own.figure.number]
    assert own.has_data() and own.figure.axes == [own]
    own.figure.savefig(tmp_path / "picture.pdf")
    assert (tmp_path / "picture.pdf").stat().st_size > 1000
    _, mine = plt.subplots()
    assert drawn.plot(mine) is mine and mine.has_data()
    assert dict(matplotlib.rcParams) == before


@pytest.mark.parametrize("make", DRAWN.values(), ids=DRAWN)
@pytest.mark.parametrize("axes", [{"projection": "3d"}, {"projection": "polar"}, "name", "array"])
def test_refuses_what_are_no_ordinary_axes(make, axes):
    if isinstance(axes, dict):
        axes = plt.figure().add_subplot(**axes)
    elif axes == "array":
        axes = plt.subplots(1, 2)[1]
    with pytest.raises(sm.InputError, match="ordinary matplotlib Axes are needed"):
        make().plot(axes)


def polygons(axes) -> list[np.ndarray]:
    return [path.vertices[:-1] for collection in axes.collections for path in collection.get_paths()]


def test_a_planar_body_is_where_the_motion_takes_it():
    motion = sm.interpolants.component_cubic(PLANAR)
    axes = motion.plot(body=BOX, times=5)
    for t, drawn in zip(np.linspace(*motion.domain, num=5), polygons(axes), strict=True):
        np.testing.assert_allclose(drawn, motion.trajectory(BOX, t), atol=1e-12)
    path = np.asarray(axes.lines[0].get_xydata())
    np.testing.assert_allclose(path[[0, -1]], PLANAR.translation[[0, -1]], atol=1e-12)
    assert (axes.get_xlabel(), axes.get_ylabel(), axes.get_aspect()) == ("x", "y", 1.0)


def test_several_outlines_and_chosen_times():
    motion = sm.interpolants.component_cubic(PLANAR)
    triangle = BOX[:3] + 1.0
    drawn = polygons(motion.plot(body=[BOX, triangle], times=[0.7, 0.2]))
    expected = [motion.trajectory(outline, t) for t in (0.2, 0.7) for outline in (BOX, triangle)]
    for p, q in zip(drawn, expected, strict=True):
        np.testing.assert_allclose(p, q, atol=1e-12)


def test_space_is_seen_in_parallel_with_upright_z():
    motion = sm.interpolants.component_cubic(SPATIAL)
    path = np.asarray(motion.plot(body=np.eye(3)).lines[0].get_xydata())
    places = motion(np.linspace(0, 1, len(path))).translation
    view, *_ = np.linalg.lstsq(places, path, rcond=None)
    np.testing.assert_allclose(places @ view, path, atol=1e-10)
    # Orthonormal rows to look at, z upwards, nothing of the direction (2, −3, 1.6) that it is seen from.
    np.testing.assert_allclose(view.T @ view, np.eye(2), atol=1e-10)
    np.testing.assert_allclose(view.T @ [2.0, -3.0, 1.6], 0, atol=1e-10)
    assert abs(view[2, 0]) < 1e-10 and view[2, 1] > 0


@pytest.mark.parametrize("keyframes", [PLANAR, SPATIAL], ids=["plane", "space"])
@pytest.mark.parametrize("scale", [1e-6, 1e-3, 1e6])
def test_the_default_body_suits_every_scale(keyframes, scale):
    def drawn(size):
        keys = sm.Keyframes(keyframes.times, keyframes.linear, size * keyframes.translation)
        axes = sm.interpolants.component_cubic(keys).plot(keyframes=keys)
        axes.figure.canvas.draw()
        return np.concatenate(polygons(axes)), axes

    (one, plain), (other, scaled) = drawn(1.0), drawn(scale)
    np.testing.assert_allclose(other, scale * one, rtol=1e-9, atol=1e-9 * scale)
    np.testing.assert_allclose(scaled.get_xlim(), scale * np.array(plain.get_xlim()), rtol=1e-6)
    # Large enough to see, small enough to tell the copies apart.
    size = max(np.ptp(p, axis=0).max() for p in polygons(plain))
    assert 0.05 < size / np.ptp(keyframes.translation, axis=0).max() < 0.4


def test_the_default_body_does_not_depend_on_the_unit_of_the_body():
    motion = sm.interpolants.component_cubic(PLANAR)
    coarse = sm.AffineMotion(motion.basis, 1e3 * motion.linear, motion.translation)
    np.testing.assert_allclose(np.concatenate(polygons(coarse.plot())), np.concatenate(polygons(motion.plot())))


@pytest.mark.parametrize("keyframes", [PLANAR, SPATIAL], ids=["plane", "space"])
def test_a_motion_on_the_spot_is_spread_over_time(keyframes):
    still = sm.Keyframes(keyframes.times, keyframes.linear)
    motion = sm.interpolants.component_cubic(still)
    axes = motion.plot(times=[0.0, 0.25, 0.5, 1.0])
    assert [t.get_text() for t in axes.get_xticklabels()] == ["0", "0.25", "0.5", "1"]
    assert axes.get_xlabel() == "time"
    per = len(polygons(axes)) // 4
    if keyframes.dimension == 2:
        copies = [np.concatenate(polygons(axes)[k * per : (k + 1) * per]) for k in range(4)]
        assert all(a[:, 0].max() < b[:, 0].min() for a, b in pairwise(copies))
    keyed = motion.plot(times=3, keyframes=still)
    # 0, 0.5, 1 and the two inner keyframes.
    assert len(keyed.get_xticks()) == 5


def test_keyframes_are_drawn_numbered_or_left_out_where_they_are_many():
    axes = sm.interpolants.component_cubic(PLANAR).plot(keyframes=PLANAR, body=BOX)
    assert [t.get_text() for t in axes.texts] == ["0 (t = 0)", "1", "2", "3 (t = 1)"]
    last = polygons(axes)[-1]
    np.testing.assert_allclose(last, BOX @ PLANAR.linear[3].T + PLANAR.translation[3])
    many = sm.examples.random_keyframes(13, 40, 1)
    axes = sm.interpolants.component_cubic(many).plot(keyframes=many, body=np.eye(3), times=4)
    assert len(polygons(axes)) == 4
    assert len(polygons(sm.examples.random_keyframes(500, 40, 1).plot(body=np.eye(3)))) == 24


def test_bodies_between_the_keyframes_are_drawn_at_times_since_1970_too():
    late = sm.Keyframes(1.7e9 + PLANAR.times, PLANAR.linear, PLANAR.translation)
    counts = [len(polygons(sm.interpolants.component_cubic(k).plot(keyframes=k, body=BOX))) for k in (PLANAR, late)]
    assert counts == [9 + len(PLANAR) - 2] * 2


def test_two_motions_share_axes_with_one_set_of_marks():
    axes = sm.interpolants.component_cubic(SPATIAL).plot(label="cubic")
    texts = [t.get_text() for t in axes.texts]
    sm.interpolants.polar_blend(SPATIAL).plot(axes, label="polar", colour="black")
    assert [t.get_text() for t in axes.texts] == texts == ["t = 0", "t = 1", "x", "y", "z", "each 1"]
    assert axes.get_legend_handles_labels()[1] == ["cubic", "polar"]


def test_a_closed_motion_has_one_text_for_both_ends():
    square = [[0, 0], [1, 0], [1, 1], [0, 1], [0, 0]]
    keys = sm.Keyframes(np.arange(5.0), np.stack([np.eye(2)] * 5), square)
    assert [t.get_text() for t in sm.interpolants.component_cubic(keys).plot().texts] == ["t = 0, t = 4"]


def test_times_that_differ_in_late_digits_are_told_apart():
    keys = sm.Keyframes(1305031098.0 + PLANAR.times, PLANAR.linear, PLANAR.translation)
    texts = [t.get_text() for t in sm.interpolants.component_cubic(keys).plot().texts]
    assert texts == ["t = 1305031098", "t = 1305031099"]


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"body": np.eye(3)}, r"outline 0: shape \(3, 3\); \(P, 2\)"),
        ({"body": [BOX, np.eye(3)]}, "outline 1: shape"),
        ({"body": [BOX, BOX[:3], [[0.0, np.nan], [1, 1]]]}, "outline 2: a point is not finite"),
        ({"body": []}, "outline"),
        ({"body": "K"}, "outlines are arrays of numbers"),
        ({"body": 5}, "is no outline"),
        ({"body": {}}, "a dict is no outline"),
        ({"times": 0}, "times 0: a whole number of bodies, 1 or more"),
        ({"times": [0.5, np.nan]}, "times: finite numbers"),
        ({"times": "now"}, "times: finite numbers"),
        ({"times": []}, r"times of shape \(0,\)"),
        ({"times": [2.0]}, "outside"),
        ({"colour": "bluish"}, "colour 'bluish'"),
        ({"keyframes": SPATIAL}, "Keyframes in 2D"),
        ({"keyframes": 3}, "Keyframes in 2D"),
    ],
)
def test_bad_options_of_a_motion(options, message):
    with pytest.raises(sm.InputError, match=message):
        sm.interpolants.component_cubic(PLANAR).plot(**options)
    assert not plt.get_fignums()


def test_refuses_motions_without_a_picture():
    basis = BSplineBasis.clamped([0.0, 1.0], 1)
    with pytest.raises(sm.InputError, match="4D"):
        sm.AffineMotion(basis, np.stack([np.eye(4)] * 2)).plot()
    with pytest.raises(sm.InputError, match="not finite"):
        sm.AffineMotion(basis, np.full((2, 2, 2), np.nan)).plot()


@pytest.mark.parametrize("dimension", [2, 3])
def test_a_motion_that_shrinks_the_body_to_a_point_has_a_picture(dimension, recwarn):
    basis = BSplineBasis.clamped([0.0, 1.0], 1)
    still = sm.AffineMotion(basis, np.zeros((2, dimension, dimension)))
    still.plot().figure.canvas.draw()
    assert not [w for w in recwarn if issubclass(w.category, RuntimeWarning)]


def test_body_rates_over_time():
    motion = orientation()
    axes = motion.plot()
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("time [s]", "body rate [rad/s]")
    t = axes.lines[0].get_xdata()
    rates = np.stack([line.get_ydata() for line in axes.lines], axis=1)
    np.testing.assert_allclose(rates[:, :3], motion.rate(t), atol=1e-12)
    np.testing.assert_allclose(rates[:, 3], np.linalg.norm(motion.rate(t), axis=1), atol=1e-12)
    # Told apart without colours.
    assert len({line.get_linestyle() for line in axes.lines}) == 4


def test_rates_of_slerps_jump_upright_and_are_constant_between():
    axes = sm.interpolants.slerp_curve(TIMES, TURNS).plot()
    t, size = map(np.asarray, axes.lines[3].get_data())
    steps = (TURNS[:-1].inv() * TURNS[1:]).magnitude()
    for k, step in enumerate(steps):
        np.testing.assert_allclose(size[(t >= k) & (t < k + 1)], step, rtol=1e-6)


def test_unit_vectors_stay_on_the_sphere():
    axes = orientation().plot(kind="sphere")
    outline, *rest = (np.asarray(line.get_xydata()) for line in axes.lines)
    np.testing.assert_allclose(np.linalg.norm(outline, axis=1), 1.0)
    reached = np.concatenate([r for r in rest if len(r)])
    assert np.nanmax(np.linalg.norm(reached, axis=1)) <= 1 + 1e-12
    with pytest.raises(sm.InputError, match="kind 'globe' is unknown; there are rate, sphere"):
        orientation().plot(kind=cast(Any, "globe"))


def test_a_surface_is_seen_by_its_parameter_lines(spatial_net):
    point = np.array([0.3, -0.2, 0.1])
    axes = spatial_net.plot(point=point)
    along_u = np.array([path.vertices for path in axes.collections[0].get_paths()])
    u = np.linspace(*spatial_net.domain[0], num=along_u.shape[1])
    edge = spatial_net.boundary("v0").trajectory(point, u)[:, 0]
    far = spatial_net.boundary("v1").trajectory(point, u)[:, 0]
    places, drawn = np.concatenate([edge, far]), np.concatenate([along_u[0], along_u[-1]])
    view, *_ = np.linalg.lstsq(places, drawn, rcond=None)
    np.testing.assert_allclose(places @ view, drawn, atol=1e-9)
    np.testing.assert_allclose(view.T @ view, np.eye(2), atol=1e-9)


@pytest.mark.parametrize(("point", "message"), [([0, 0], r"shape \(2,\)"), ([0, 0, np.inf], "finite"), ("x", "finite")])
def test_bad_body_points_of_a_surface(net, point, message):
    with pytest.raises(sm.InputError, match=message):
        net.plot(point=point)


def test_a_spherical_motion_whose_body_point_stays_still_has_a_picture(net):
    # The origin's trajectory surface is a point.
    assert net.plot(point=[0, 0, 0]).has_data()


def test_a_solution_shows_its_motion_with_the_keyframes(comparison):
    axes = comparison.solutions[0].plot()
    texts = [t.get_text() for t in axes.texts]
    assert texts[:4] == ["0 (t = 0)", "1", "2", "3 (t = 1)"]
    # A slab in the shape of an F has 12 faces; the copies at the ends are those of the keyframes.
    assert len(polygons(axes)) == 12 * (9 - 2 + 4)


PROGRAMS = {
    "orientation": (lambda: sm.orientation_program(TIMES, TURNS), "time [s]", {"turn"}),
    "pose": (
        lambda: sm.pose_program(sm.Keyframes.from_rotations(TIMES, TURNS, np.eye(4)[:, :3])),
        "",
        {"turn", "translation"},
    ),
    "free times": (
        lambda: sm.free_times_program(PLANAR, objective=sm.Rigidity(2)),
        "x",
        {"linear part"},
    ),
    "curve": (
        lambda: sm.curve_program([sm.constraints.CurveCondition.at(TIMES, [[0, 0], [1, 2], [3, 2], [4, 0]])]),
        "x",
        {"values"},
    ),
    "curve in space": (
        lambda: sm.curve_program([sm.constraints.CurveCondition.at(TIMES, np.eye(4)[:, :3])]),
        "time",
        {"values"},
    ),
}


@pytest.mark.parametrize(("make", "label", "parts"), PROGRAMS.values(), ids=PROGRAMS)
def test_every_kind_of_program_has_pictures(make, label, parts):
    solution = sm.Ipopt().solve(make()).require(1e-6)
    assert solution.plot().get_xlabel() == label
    assert set(solution.plot(kind="multipliers").get_legend_handles_labels()[1]) == parts
    assert solution.plot(kind="convergence").get_ylabel() == "stationarity"


def test_keyframes_of_free_times_stand_where_the_solution_puts_them():
    solution = sm.Ipopt().solve(sm.free_times_program(PLANAR, objective=sm.Rigidity(2))).require(1e-6)
    axes = solution.plot()
    assert [t.get_text() for t in axes.texts] == ["0 (t = 0)", "1", "2", "3 (t = 1)"]


def test_multipliers_are_as_high_as_the_prices(comparison):
    solution = comparison.solutions[0]
    axes = solution.plot(kind="multipliers")
    parts = np.array([line.get_ydata() for line in axes.lines])
    np.testing.assert_allclose(np.linalg.norm(parts, axis=0), sm.answers.keyframe_prices(solution).size)
    assert axes.get_legend_handles_labels()[1] == ["linear part", "translation"]
    assert axes.get_xlabel() == "keyframe" and axes.get_ylim()[0] == 0


def test_convergence_is_as_logged(comparison):
    axes = comparison.plot()
    lines = axes.lines
    for line, solution in zip(lines, comparison.solutions, strict=True):
        logged = np.array([i.stationarity for i in solution.log])
        np.testing.assert_array_equal(line.get_ydata(), np.where(logged > 0, logged, np.nan))
    assert axes.get_yscale() == "log"
    assert axes.get_legend_handles_labels()[1] == ["newton", "ipopt", "elimination"]
    assert len({line.get_marker() for line in lines}) == 3


def test_solvers_of_one_method_are_told_apart():
    program = sm.affine_program(PLANAR)
    axes = sm.compare(program, [sm.ExactNewton(), sm.ExactNewton(tolerance=1e-6)]).plot()
    assert axes.get_legend_handles_labels()[1][:2] == ["newton (1)", "newton (2)"]
    assert len({line.get_linestyle() for line in axes.lines[:2]}) == 2


def test_a_failed_solve_shows_what_happened(unsupported):
    (solution,) = unsupported.solutions
    for axes in (solution.plot(), unsupported.plot()):
        assert axes.get_legend_handles_labels()[1] == ["elimination: unsupported"]
        assert [t.get_text() for t in axes.texts] == ["no iterations"]
    with pytest.raises(sm.InputError, match=r"\(unsupported\) has no motion with a picture"):
        solution.plot(kind="motion")
    with pytest.raises(sm.InputError, match=r"multipliers are not finite \(unsupported\)"):
        solution.plot(kind="multipliers")
    with pytest.raises(sm.InputError, match="kind 'speed' is unknown; there are motion, convergence, multipliers"):
        solution.plot(kind="speed")
    limited = sm.ExactNewton(max_iterations=1).solve(sm.affine_program(PLANAR, objective=sm.Rigidity(2)))
    assert limited.plot(kind="convergence").get_legend_handles_labels()[1][0] == "newton: iteration-limit"
    assert limited.plot().get_xlabel() == "x"


def test_names_with_dollar_signs_are_no_formulas():
    condition = sm.constraints.CurveCondition.at(TIMES, [[0, 0], [1, 2], [3, 2], [4, 0]], name="cost in $ and $^$")
    solution = sm.ExactNewton().solve(sm.curve_program([condition]))
    axes = solution.plot(kind="multipliers")
    axes.figure.canvas.draw()
    legend = axes.get_legend()
    assert legend is not None
    assert legend.get_texts()[0].get_text() == "cost in $ and $^$"


def test_fairing_over_the_steps_and_at_the_knots(faired):
    axes = faired.plot()
    np.testing.assert_array_equal(axes.lines[0].get_ydata(), faired.history)
    assert axes.lines[1].get_data()[0] == faired.best_step and axes.get_yscale() == "log"
    heat = faired.plot(kind="knots")
    assert heat.collections[0].get_array().size == faired.after.size
    with pytest.raises(sm.InputError, match="kind 'net' is unknown; there are history, knots"):
        faired.plot(kind="net")


@pytest.mark.parametrize("options", [{"method": "least-squares"}, {"method": "bounded", "tolerance": 0.05}])
def test_fairing_methods_that_solve_at_once_have_a_picture_too(net, options):
    result = sm.fair(net, **options)
    assert len(np.asarray(result.plot().lines[0].get_ydata())) == len(result.history)


def test_fairing_of_a_curve_at_its_knots(net):
    result = sm.fair(net.isoparametric(u=5.0), max_steps=5)
    before, after = result.plot(kind="knots").lines
    np.testing.assert_array_equal(before.get_ydata(), result.before)
    assert before.get_linestyle() != after.get_linestyle() and before.get_marker() != after.get_marker()


def test_a_figure_of_its_own_goes_where_drawing_fails(comparison, monkeypatch):
    def fail(*arguments):
        raise ZeroDivisionError

    monkeypatch.setattr("symmotion.views.plots.draw_convergence", fail)
    with pytest.raises(ZeroDivisionError):
        comparison.plot()
    assert not plt.get_fignums()


STORED = Path(__file__).parents[2] / "studies" / "guide" / "readme"


def outline(svg: str) -> list[tuple[str, str]]:
    """The elements that have a name of matplotlib's, in order: the same for pictures that show the same things."""
    found = ((e.tag.rpartition("}")[2], e.get("id", "")) for e in ET.fromstring(svg).iter())
    return [(tag, name) for tag, name in found if re.fullmatch(r"[A-Za-z0-9]+_\d+", name)]


def test_the_pictures_in_the_readme_are_those_of_the_command():
    result = pictures.STUDY.run(StudyOptions())
    made = {f"pictures-{figure.name}.svg": figure.svg for figure in result.figures}
    names = [path.name for path in STORED.iterdir()]
    assert names == ["pictures-moving.svg"]
    for name in names:
        stored, svg = (STORED / name).read_text(encoding="utf-8"), made[name]
        # Texts and ticks may move by a release of matplotlib; what is drawn may not change.
        assert outline(stored) == outline(svg)
        assert "currentColor" not in svg  # which is black in a picture of a page, whatever the page's colours
        box = [ET.fromstring(text).attrib["viewBox"].split() for text in (stored, svg)]
        np.testing.assert_allclose(np.array(box[0], dtype=float), np.array(box[1], dtype=float), atol=15)
    assert all(run.certified for run in result.runs)
    assert "number 1 is the most expensive, ‖λ‖ = 32.3" in result.conclusion


def test_the_long_form_draws_the_other_kinds():
    result = pictures.STUDY.run(replace(StudyOptions(), full=True))
    assert len(result.figures) == 15


# What animators' files have upright turned so that it is what pictures have: (x, y, z) to (x, −z, y).
STOOD = Rotation.from_euler("x", 90, degrees=True).as_matrix()


def stood(keyframes: sm.Keyframes) -> sm.Keyframes:
    return sm.Keyframes(keyframes.times, STOOD @ keyframes.linear, keyframes.translation @ STOOD.T)


@pytest.mark.parametrize("pinned", [False, True], ids=["along a path", "on the spot"])
def test_the_axis_that_is_upright_in_a_file_is_upright_in_the_picture(pinned):
    keys = replace(SPATIAL, translation=np.zeros((4, 3))) if pinned else SPATIAL
    motion = sm.interpolants.component_cubic(keys)
    turned = sm.interpolants.component_cubic(stood(keys))
    shape = sm.bodies.wedge()
    for shown, expected in [
        (motion.plot(body=shape, keyframes=keys, up="y"), turned.plot(body=shape, keyframes=stood(keys))),
        (keys.plot(body=shape, up="y"), stood(keys).plot(body=shape)),
    ]:
        for drawn, wanted in zip(shown.collections, expected.collections, strict=True):
            for polygon, other in zip(drawn.get_paths(), wanted.get_paths(), strict=True):
                np.testing.assert_allclose(np.asarray(polygon.vertices), np.asarray(other.vertices), atol=1e-9)
        names = {text.get_text(): text.get_position() for text in shown.texts if text.get_text() in ("x", "y", "z")}
        origin = np.array(shown.lines[-1].get_xydata())[0]
        upright = {name for name, place in names.items() if abs(place[0] - origin[0]) < 1e-9 and place[1] > origin[1]}
        assert upright == {"y"}


@pytest.mark.parametrize("program", [sm.affine_program, sm.pose_program])
def test_solutions_are_drawn_upright_as_their_motions_are(program):
    keys = sm.examples.random_keyframes(4, 40, seed=1)
    solution = sm.ExactNewton().solve(program(keys, refine=0))
    shown, expected = solution.plot(up="y"), solution.motion.plot(keyframes=keys, up="y")
    other = solution.plot()
    outlines = [[p.vertices for c in axes.collections for p in c.get_paths()] for axes in (shown, expected, other)]
    assert all(np.allclose(a, b) for a, b in zip(*outlines[:2], strict=True))
    assert not all(a.shape == b.shape and np.allclose(a, b) for a, b in zip(*outlines[::2], strict=False))
    with pytest.raises(sm.InputError, match="up 'x' is unknown; there are y, z"):
        solution.plot(up=cast(Any, "x"))


def test_the_letter_stands_upright():
    still = sm.Keyframes([0.0, 1.0], np.tile(np.eye(3), (2, 1, 1)), [[0.0, 0, 0], [9, 0, 0]])
    shown, expected = still.plot(up="y"), still.plot()
    for drawn, wanted in zip(shown.collections, expected.collections, strict=True):
        heights = [np.ptp(np.concatenate([p.vertices for p in c.get_paths()])[:, 1]) for c in (drawn, wanted)]
        assert heights[0] == pytest.approx(heights[1])


def test_another_axis_is_refused():
    with pytest.raises(sm.InputError, match="up 'x' is unknown; there are y, z"):
        SPATIAL.plot(up=cast(Any, "x"))


@pytest.mark.parametrize("size", [1e-4, 1e4])
def test_ticks_of_tiny_and_huge_scenes_do_not_run_together(size):
    for axes in (
        replace(PLANAR, translation=size * PLANAR.translation).plot(),
        sm.interpolants.component_cubic(replace(PLANAR, translation=size * PLANAR.translation)).plot(),
        plot_curve(sm.curves.bezier(size * np.array([[0.0, 0.0], [3.0, 1.0]]))),
    ):
        cast(Any, axes.figure).canvas.draw()
        inside = axes.get_window_extent()
        boxes = [text.get_window_extent() for text in axes.get_xticklabels()]
        shown = [box for box in boxes if inside.x0 <= (box.x0 + box.x1) / 2 <= inside.x1]
        assert len(shown) > 3
        assert all(a.x1 < b.x0 for a, b in pairwise(shown))
        assert all("10^" in axis.get_offset_text().get_text() for axis in (axes.xaxis, axes.yaxis))
