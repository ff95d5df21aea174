from functools import partial
from typing import Any

import numpy as np
import pytest
from problems import body_points
from scipy.interpolate import CubicSpline
from scipy.linalg import expm, fractional_matrix_power, logm
from scipy.spatial.transform import Rotation, RotationSpline, Slerp

import symmotion as sm
from studies.affine import baselines
from symmotion.motions.examples import rotation_2d
from symmotion.motions.interpolants import component_cubic, log_blend, polar_blend, rational_spline, steady_morph
from symmotion.motions.quaternions import algebra as qa
from symmotion.motions.rigid import orthonormalise
from symmotion.report import StudyOptions

MAKERS = {
    "component": component_cubic,
    "polar spline": polar_blend,
    "polar slerp": partial(polar_blend, rotation="slerp"),
    "logarithm": log_blend,
    "logarithm cubic": partial(log_blend, degree=3),
    "steady": steady_morph,
}
SMOOTH = ("component", "polar spline", "logarithm cubic")
SETS = {
    "planar": sm.examples.planar_keyframes(),
    "spatial": sm.examples.spatial_keyframes(),
    "large turns": sm.examples.random_keyframes(5, 150, 4),
    "two": sm.examples.sheared_turn(),
}


def matrices(motion, t):
    linear, translation = motion(t)
    d = linear.shape[-1]
    full = np.zeros((*np.shape(t), d + 1, d + 1))
    full[..., :d, :d], full[..., :d, d], full[..., d, d] = linear, translation, 1
    return full


@pytest.mark.parametrize("name", MAKERS)
@pytest.mark.parametrize("keys", SETS.values(), ids=SETS)
def test_baselines_interpolate_and_their_derivatives_are_those_of_their_values(name, keys):
    motion = MAKERS[name](keys)
    linear, translation = motion(keys.times)
    np.testing.assert_allclose(linear, keys.linear, atol=1e-12)
    np.testing.assert_allclose(translation, keys.translation, atol=1e-11)
    assert motion.domain == (keys.times[0], keys.times[-1])
    assert motion.dimension == keys.dimension
    a, b = motion.domain
    t = np.linspace(a, b, 12)[1:-1].reshape(2, 5) + 1e-3
    step = 1e-6
    for nu in (1, 2):
        after, before, exact = motion(t + step, nu - 1), motion(t - step, nu - 1), motion(t, nu)
        for a, b, e in zip(after, before, exact, strict=True):
            assert e.shape == a.shape
            np.testing.assert_allclose((a - b) / (2 * step), e, atol=2e-7 * np.abs(e).max() + 1e-6)
    points = body_points(keys.dimension)
    paths = motion.trajectory(points, t, 1)
    expected = motion(t, 1).translation[..., None, :] + np.einsum("...ij,pj->...pi", motion(t, 1).linear, points)
    np.testing.assert_allclose(paths, expected, atol=1e-9)


@pytest.mark.parametrize("name", MAKERS)
def test_which_baselines_are_smooth(name):
    keys = sm.examples.spatial_keyframes()
    motion, inner = MAKERS[name](keys), keys.times[1:-1]
    before = np.nextafter(inner, -np.inf)
    gaps = [np.abs(motion(inner, nu).linear - motion(before, nu).linear).max() for nu in (0, 1, 2)]
    assert gaps[0] < 1e-12
    if name in SMOOTH:
        assert gaps[1] < 1e-8
        assert gaps[2] < 1e-5  # the rotation spline is C² to the tolerance of SciPy's iteration
    else:
        assert gaps[1] > 0.1


@pytest.mark.parametrize("rotation", ["spline", "slerp"])
def test_the_polar_baseline_of_rigid_keyframes_is_rigid_and_scipys_rotation(rotation):
    keys = sm.examples.random_keyframes(6, 80, 3)
    t = np.linspace(0, 5, 101)
    motion = polar_blend(keys, rotation)
    assert orthonormalise(motion, t).deviation < 1e-12
    assert sm.measure(motion, sm.Rigidity(), times=keys.times) < 1e-24
    oracle = (
        RotationSpline(keys.times, keys.rotations()) if rotation == "spline" else Slerp(keys.times, keys.rotations())
    )
    np.testing.assert_allclose(motion(t).linear, oracle(t).as_matrix(), atol=1e-12)


def test_the_planar_polar_baseline_turns_by_the_spline_of_the_angle():
    keys = sm.examples.planar_keyframes()
    t = np.linspace(0, 1, 33)
    angle = sm.splines.cubic_interpolant(keys.times, [0.0, 70.0, 150.0, 240.0])(t)
    turns = orthonormalise(polar_blend(keys), t).rotations
    np.testing.assert_allclose(turns, np.stack([rotation_2d(a) for a in angle]), atol=1e-12)


@pytest.mark.parametrize("d", [2, 3])
def test_the_steady_morph_of_constant_ratios_is_a_power(d):
    rng = np.random.default_rng(d)
    ratio, first = np.eye(d + 1), np.eye(d + 1)
    ratio[:d] += 0.3 * rng.normal(size=(d, d + 1))
    first[:d] += 0.3 * rng.normal(size=(d, d + 1))
    full = np.stack([first @ np.linalg.matrix_power(ratio, i) for i in range(4)])
    motion = steady_morph(sm.Keyframes(np.arange(4.0), full[:, :d, :d], full[:, :d, d]))
    t = np.linspace(0, 3, 13)
    expected = np.stack([first @ fractional_matrix_power(ratio, s) for s in t])
    np.testing.assert_allclose(matrices(motion, t), expected, atol=1e-12)
    # One velocity in the body's frame throughout: H⁻¹ Ḣ = log X.
    rate = motion(t, 1)
    body = np.linalg.solve(motion(t).linear, rate.linear)
    np.testing.assert_allclose(body, np.stack([logm(ratio)[:d, :d]] * 13), atol=1e-11)


def test_logarithm_blending_is_exp_of_blended_logarithms_and_steady_where_matrices_commute():
    keys = sm.examples.spatial_keyframes()
    full = matrices(component_cubic(keys), keys.times)
    a, b = keys.times[1:3]
    expected = expm(0.75 * logm(full[1]) + 0.25 * logm(full[2]))
    np.testing.assert_allclose(matrices(log_blend(keys), a + 0.25 * (b - a)), expected, atol=1e-12)
    rng = np.random.default_rng(0)
    generator = 0.4 * rng.normal(size=(3, 3))
    linear = np.stack([expm(s * generator) for s in (0.0, 1.0, 2.5)])
    commuting = sm.Keyframes(np.array([0.0, 1.0, 3.0]), linear)
    t = np.linspace(0, 3, 31)
    np.testing.assert_allclose(log_blend(commuting)(t).linear, steady_morph(commuting)(t).linear, atol=1e-12)
    apart = sm.Keyframes(np.arange(2.0), keys.linear[1:3])
    assert np.abs(log_blend(apart)(0.5).linear - steady_morph(apart)(0.5).linear).max() > 1e-2


@pytest.mark.parametrize("keys", [SETS["planar"], SETS["spatial"], SETS["large turns"]])
def test_the_optimum_is_no_worse_than_the_spline_baseline(keys):
    for energy in (sm.Rigidity(), sm.Rigidity(2)):
        best = sm.ExactNewton().solve(sm.affine_program(keys, objective=energy)).require()
        assert best.objective < sm.measure(component_cubic(keys), energy)


def test_sampled_measures_are_the_exact_ones_for_splines():
    keys = sm.examples.spatial_keyframes()
    motion = component_cubic(keys)
    energy = sm.Rigidity() + 0.1 * sm.Rigidity(2) + 0.01 * sm.TrajectoryEnergy(body_points(3))
    sampled = Sampled(motion)
    assert sm.measure(sampled, energy, times=keys.times) == pytest.approx(sm.measure(motion, energy), rel=1e-13)
    polar = polar_blend(keys)
    finer = np.linspace(keys.times[:-1], keys.times[1:], 2, endpoint=False).T.ravel()
    finer = np.append(finer, keys.times[-1])
    value = sm.measure(polar, sm.Rigidity(2), times=keys.times)
    assert value == pytest.approx(sm.measure(polar, sm.Rigidity(2), times=finer), rel=1e-12)


class Sampled:
    """A motion that does not say that it is a spline."""

    def __init__(self, motion):
        self._motion, self.dimension = motion, motion.dimension

    def __call__(self, t, nu=0):
        return self._motion(t, nu)


def with_matrices(*linear):
    return sm.Keyframes(np.arange(len(linear), dtype=float), np.stack(linear))


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: log_blend(with_matrices(np.eye(2), rotation_2d(180))), "keyframe 1 has no real principal logarithm"),
        (lambda: log_blend(with_matrices(np.eye(2), np.diag([1, -1]))), "keyframe 1 has no real .* reflected"),
        (lambda: log_blend(with_matrices(np.diag([1, 0]), np.eye(2))), "keyframe 0 has no real"),
        (lambda: steady_morph(with_matrices(rotation_2d(30), rotation_2d(210))), "keyframe 1 against keyframe 0"),
        (lambda: steady_morph(with_matrices(np.eye(2), np.diag([1, 0]))), "keyframe 1 is singular"),
        (lambda: polar_blend(with_matrices(np.eye(2), np.diag([1, -1]))), "keyframe 1 is reflected"),
        (lambda: rational_spline(SETS["planar"]), "the keyframes are in the plane"),
        (lambda: rational_spline(SETS["spatial"]), "position 1 is not rigid"),
        (lambda: rational_spline(SETS["large turns"], "clamped"), "there are natural, not-a-knot"),
        (lambda: polar_blend(SETS["two"], "squad"), "'squad' is unknown; there are spline, slerp"),  # pyright: ignore
        (lambda: log_blend(SETS["two"], 2), "degree 2 of the logarithm"),  # pyright: ignore
        (lambda: polar_blend(SETS["spatial"])(0.5, 3), "derivative order 3 .* 0 to 2"),
        (lambda: steady_morph(SETS["two"])(0.5, -1), "derivative order -1"),
        (lambda: steady_morph(SETS["two"])([0.5, 1.5]), "time 1.5 is outside the domain"),
        (lambda: steady_morph(SETS["two"])(np.nan), "outside the domain"),
    ],
)
def test_what_a_baseline_cannot_do_is_named(call, message):
    with pytest.raises(sm.InputError, match=message):
        call()


@pytest.mark.parametrize("degrees", [60, 170])
def test_the_rational_spline_is_scipys_cubic_of_dual_quaternions(degrees):
    keys = sm.examples.random_keyframes(6, degrees, 3)
    motion, t = rational_spline(keys), np.linspace(keys.times[0], keys.times[-1], 60)
    q = qa.aligned(np.roll(keys.rotations().as_quat(), 1, axis=1))
    moved = np.concatenate([np.zeros((6, 1)), keys.translation], axis=1)
    spline = CubicSpline(keys.times, np.concatenate([q, qa.product(moved, q) / 2], axis=1), bc_type="natural")
    real, dual = np.split(spline(t), 2, axis=1)
    np.testing.assert_allclose(motion(t).linear, Rotation.from_quat(np.roll(real, -1, axis=1)).as_matrix(), atol=1e-12)
    places = 2 * qa.product(dual, qa.conjugate(real)) / np.sum(real**2, axis=1, keepdims=True)
    np.testing.assert_allclose(motion(t).translation, places[:, 1:], atol=1e-11)
    np.testing.assert_allclose(motion(keys.times).linear, keys.linear, atol=1e-12)
    np.testing.assert_allclose(motion(keys.times).translation, keys.translation, atol=1e-12)
    for nu in (1, 2):
        before, behind = motion.matrix(np.nextafter(keys.times[1:-1], 0), nu), motion.matrix(keys.times[1:-1], nu)
        np.testing.assert_allclose(before, behind, atol=1e-9 * np.abs(behind).max())


def test_the_rational_spline_is_the_same_seen_from_elsewhere_and_the_cubic_of_what_does_not_turn():
    keys = sm.examples.random_keyframes(5, 100, 1)
    t = np.linspace(keys.times[0], keys.times[-1], 40)
    others = sm.examples.random_keyframes(2, 80, 9)
    outer, inner = component_cubic(others).matrix(others.times)
    seen = outer @ component_cubic(keys).matrix(keys.times) @ inner
    other = rational_spline(sm.Keyframes(keys.times, seen[:, :3, :3], seen[:, :3, 3]))
    np.testing.assert_allclose(other.matrix(t), outer @ rational_spline(keys).matrix(t) @ inner, atol=1e-11)
    still = rational_spline(sm.Keyframes(keys.times, np.tile(np.eye(3), (5, 1, 1)), keys.translation))
    expected = CubicSpline(keys.times, keys.translation, bc_type="natural")
    np.testing.assert_allclose(still(t).translation, expected(t), atol=1e-12)


def test_baselines_study():
    result = baselines.STUDY.run(StudyOptions())
    (table,) = result.tables
    names = [c.name for c in table.columns]
    rows: Any = {(r[0], r[1]): dict(zip(names, r, strict=True)) for r in table.rows}
    assert rows["affine, spatial", "component-wise cubic"]["R"] == pytest.approx(32.94001674, rel=1e-8)
    assert rows["affine, spatial", "least R: ExactNewton"]["R"] == pytest.approx(10.65881070, rel=1e-8)
    assert rows["rigid, 70°", "polar, C² rotation"]["R"] < 1e-24
    assert rows["rigid, 70°", "polar, C² rotation"]["velocity jump"] == 0
    assert rows["rigid, 70°", "polar, slerp"]["velocity jump"] > 1
    for name in baselines.RIGID:
        row = rows["rigid, 150°", name]
        assert row["from rigid"] < 1e-12 and row["R"] < 1e-24 and row["acceleration jump"] == 0
    assert "C² and rigid are: logarithm, cubic; polar, C² rotation; quaternions, cumulative; rational" in (
        result.conclusion or ""
    )
    assert all(run.certified for run in result.runs if run.method == "newton")
    assert len(result.figures) == 4
