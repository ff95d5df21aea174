"""Animated glTF: files opened by pygltflib and trimesh and evaluated between the keys, and what bad requests get."""

import numpy as np
import pytest
import trimesh
from gltf_evaluation import Scene

import symmotion as sm
from symmotion.errors import InputError
from symmotion.files import keys, write_motion
from symmotion.files.gltf_writing import write_gltf
from symmotion.files.keys import spline_keys
from symmotion.motions.nets import noisy_net, smooth_net

SPATIAL = sm.examples.spatial_keyframes()
RNG = np.random.default_rng(4)


def spline_motion(basis: sm.splines.BSplineBasis, dimension: int = 3, place=0.0) -> sm.AffineMotion:
    rng = np.random.default_rng(basis.degree)
    return sm.AffineMotion(
        basis, rng.normal(size=(basis.n, dimension, dimension)), place + rng.normal(size=(basis.n, dimension))
    )


def pose_motion(degree: int = 3) -> sm.motions.PoseMotion:
    poses = sm.examples.random_keyframes(5, 80, 2)
    path = sm.splines.cubic_interpolant(poses.times, poses.translation)
    return sm.motions.PoseMotion(
        sm.quaternions.interpolate_quaternions(poses.times, poses.rotations()), path.elevated(degree - 3)
    )


def worst_distance(motion, path, times, seconds_per_unit=1.0) -> float:
    """The largest distance of a vertex in the file from where the motion has it."""
    scene = Scene(path)
    start, worst = motion.domain[0], 0.0
    d = motion.dimension
    for t in times:
        wanted = scene.vertices.copy()
        wanted[:, :d] = motion.trajectory(scene.vertices[:, :d], t)
        worst = max(worst, np.abs(scene.body((t - start) * seconds_per_unit) - wanted).max())
    return worst


EXACT = {
    "least distorting, C¹": lambda: sm.ExactNewton().solve(sm.affine_program(SPATIAL)).require().motion,
    "planar, C²": lambda: sm.interpolants.component_cubic(sm.examples.planar_keyframes()),
    "degree 1": lambda: spline_motion(sm.splines.BSplineBasis.clamped([0, 1, 3], 1)),
    "degree 2, closed": lambda: spline_motion(sm.splines.BSplineBasis.closed([0, 1, 2.5, 3, 4, 5], 2), 2),
    "cubic, only continuous": lambda: spline_motion(sm.splines.BSplineBasis([0, 0, 0, 0, 1, 1, 1, 3, 3, 3, 3], 3)),
    "uniform knots": lambda: spline_motion(sm.splines.BSplineBasis(np.arange(10.0), 3)),
    "far away, at 1.3e9 s": lambda: spline_motion(
        sm.splines.BSplineBasis.clamped(1.3e9 + np.array([0, 2, 3]), 3), 3, 1e5
    ),
}


@pytest.mark.parametrize("case", EXACT)
@pytest.mark.parametrize("seconds", [None, 7.3])
def test_cubic_affine_motions_are_in_the_file_exactly(tmp_path, case, seconds):
    motion, path = EXACT[case](), tmp_path / "m.glb"
    written = write_gltf(motion, path, seconds=seconds)
    a, b = motion.domain
    worst = worst_distance(motion, path, RNG.uniform(a, b, 40), 1.0 if seconds is None else seconds / (b - a))
    assert written.exact
    assert worst <= 1e-6 * written.size
    assert worst <= 2 * written.error
    assert written.relative <= 1e-6
    assert written.keys == len(motion.basis.breakpoints)
    notes = Scene(path).gltf.asset.extras
    assert (notes["exact"], notes["error"], notes["start"]) == (True, written.error, a)


def test_the_clock_of_the_file(tmp_path):
    motion = sm.interpolants.component_cubic(sm.examples.planar_keyframes())
    write_gltf(motion, tmp_path / "m.glb", seconds=6)
    scene = Scene(tmp_path / "m.glb")
    times = scene.array(scene.gltf.animations[0].samplers[0].input)[:, 0]
    np.testing.assert_allclose(times, 6 * sm.examples.planar_keyframes().times, rtol=1e-7)


def test_the_skin_is_one_that_viewers_take(tmp_path):
    write_gltf(EXACT["least distorting, C¹"](), tmp_path / "m.glb")
    scene = Scene(tmp_path / "m.glb")
    weights = scene.array(scene.attributes.WEIGHTS_0)
    assert weights.min() >= 0
    np.testing.assert_allclose(weights.sum(axis=1), 1, atol=2e-7)
    assert {s.interpolation for s in scene.gltf.animations[0].samplers} == {"CUBICSPLINE"}
    assert len(scene.gltf.skins[0].joints) == 4
    # What is shown before the animation runs is its beginning.
    rest = np.array([scene.gltf.nodes[j].translation for j in scene.gltf.skins[0].joints])
    first = [scene.channel(j, "translation", 0.0) for j in scene.gltf.skins[0].joints]
    np.testing.assert_allclose(rest, first, atol=1e-6)


@pytest.mark.parametrize("degree", [4, 6])
def test_higher_degrees_are_sampled_to_the_tolerance(tmp_path, degree):
    motion = spline_motion(sm.splines.BSplineBasis.clamped([0, 1, 3], degree))
    path = tmp_path / "m.glb"
    coarse, fine = (write_gltf(motion, path, tolerance=tolerance) for tolerance in (1e-2, 1e-5))
    worst = worst_distance(motion, path, RNG.uniform(0, 3, 60))
    assert not fine.exact
    assert worst <= 1.01 * fine.error
    assert fine.relative <= 1.01e-5 < coarse.relative <= 1e-2
    assert coarse.keys < fine.keys


def along_a_net():
    return noisy_net(smooth_net(8), 0.01, seed=1).isoparametric(u=4.3)


@pytest.mark.parametrize(
    "motion",
    [
        sm.interpolants.polar_blend(SPATIAL),
        sm.interpolants.steady_morph(SPATIAL),
        sm.interpolants.log_blend(sm.examples.sheared_turn()),
        along_a_net(),
    ],
    ids=lambda motion: repr(motion)[:40],
)
def test_motions_that_are_no_splines_are_sampled_to_the_tolerance(tmp_path, motion):
    written = write_gltf(motion, tmp_path / "m.glb", tolerance=1e-3)
    worst = worst_distance(motion, tmp_path / "m.glb", RNG.uniform(*motion.domain, size=60))
    assert worst <= 1.05 * written.error
    assert 1e-7 < written.relative <= 1.001e-3


@pytest.mark.parametrize("degree", [3, 4])
def test_rigid_motions_turn_a_node(tmp_path, degree):
    motion, path = pose_motion(degree), tmp_path / "m.glb"
    written = write_gltf(motion, path, tolerance=1e-4)
    scene = Scene(path)
    assert not scene.gltf.skins
    assert [n.name for n in scene.gltf.nodes] == ["motion", "body"]
    worst = worst_distance(motion, path, RNG.uniform(*motion.domain, size=60))
    assert worst <= 1.05 * written.error <= 1.1e-4 * written.size
    quaternions = scene.array(scene.gltf.animations[0].samplers[0].output)
    np.testing.assert_allclose(np.linalg.norm(quaternions, axis=1), 1, atol=1e-6)
    assert (np.sum(quaternions[1:] * quaternions[:-1], axis=1) > 0).all()
    if degree == 3:
        # The translation alone is exact.
        for t in RNG.uniform(*motion.domain, 20):
            np.testing.assert_allclose(scene.world(1, t)[:3, 3], motion.translation(t), atol=1e-6)


def test_fewer_keys_for_a_larger_tolerance_and_the_error_is_what_is_stated(tmp_path):
    motion = pose_motion()
    results = [write_gltf(motion, tmp_path / "m.glb", tolerance=tolerance) for tolerance in (1e-2, 1e-3, 1e-4)]
    assert results[0].keys < results[1].keys < results[2].keys
    for written, tolerance in zip(results, (1e-2, 1e-3, 1e-4), strict=True):
        assert written.relative <= 1.001 * tolerance
        assert f"{written.keys} keys of a node" in str(written)


def test_an_orientation_alone_turns_about_the_origin(tmp_path):
    motion = pose_motion()
    written = write_gltf(motion.orientation, tmp_path / "m.glb")
    turning = sm.motions.PoseMotion(
        motion.orientation, sm.splines.Spline(motion.orientation.basis, np.zeros((motion.orientation.basis.n, 3)))
    )
    assert worst_distance(turning, tmp_path / "m.glb", RNG.uniform(*motion.domain, 30)) <= 1.05 * written.error


def test_a_product_of_turns_turns_about_the_origin(tmp_path):
    curve = sm.interpolants.monotone_curve(sm.examples.random_keyframes(4, 120, seed=2), turns=[0, 1, 0])
    written = write_gltf(curve, tmp_path / "m.glb")
    assert worst_distance(curve, tmp_path / "m.glb", RNG.uniform(*curve.domain, 30)) <= 1.05 * written.error


@pytest.mark.parametrize("motion", [EXACT["planar, C²"](), pose_motion()], ids=repr)
def test_trimesh_opens_the_file_and_finds_the_body(tmp_path, motion):
    box = trimesh.creation.icosphere(subdivisions=1)
    for body in (box, (box.vertices, box.faces)):
        write_gltf(motion, tmp_path / "m.glb", body)
        (mesh,) = trimesh.load_scene(tmp_path / "m.glb", process=False).geometry.values()
        np.testing.assert_allclose(mesh.vertices, box.vertices, atol=1e-7)
        np.testing.assert_array_equal(mesh.faces, box.faces)


def test_quadrilaterals_are_split_and_planar_bodies_lie_in_the_plane(tmp_path):
    square = (np.array([[0, 0], [1, 0], [1, 1], [0, 1]]), np.array([[0, 1, 2, 3]]))
    write_gltf(EXACT["planar, C²"](), tmp_path / "m.glb", square)
    (mesh,) = trimesh.load_scene(tmp_path / "m.glb", process=False).geometry.values()
    assert mesh.area == pytest.approx(1)
    assert not mesh.vertices[:, 2].any()


def test_the_letter_is_closed_and_not_reflected(tmp_path):
    write_gltf(EXACT["least distorting, C¹"](), tmp_path / "m.glb")
    (mesh,) = trimesh.load_scene(tmp_path / "m.glb").geometry.values()
    cells = (25 * 100 + 45 * 25 + 30 * 20) * 20  # of its three bars
    sizes = np.ptp(mesh.vertices, axis=0)
    assert mesh.volume == pytest.approx(cells * (sizes[1] / 100) ** 3)


def test_one_sided_slopes_and_jumps():
    basis = sm.splines.BSplineBasis([0, 0, 0, 1, 1, 2, 2, 2], 2)
    hat = sm.splines.Spline(basis, np.array([0.0, 1, 2, 1, 0]))
    held = spline_keys(hat, basis.breakpoints)
    np.testing.assert_allclose([held.arriving[1], held.leaving[1]], [2, -2], atol=1e-14)
    broken = sm.splines.Spline(sm.splines.BSplineBasis([0, 0, 1, 1, 2, 2], 1), np.array([0.0, 1, 3, 2]))
    with pytest.raises(InputError, match="the motion jumps at time 1"):
        spline_keys(broken, np.array([0.0, 1, 2]))
    with pytest.raises(InputError, match="the motion jumps at time 1"):
        spline_keys(sm.splines.Spline(broken.basis, 1e6 + 1e-4 * broken.control_points), np.array([0.0, 1, 2]))
    whole = sm.splines.Spline(broken.basis, np.array([0.0, 1, 1, 2]))  # a knot that could jump and does not
    np.testing.assert_allclose(spline_keys(whole, np.array([0.0, 1, 2])).values, [0, 1, 2])


@pytest.mark.parametrize("turns", [1, 15, 16, 32])
@pytest.mark.parametrize("write", [write_gltf, sm.files.write_usd], ids=["glb", "usda"])
def test_whole_turns_between_looks_are_seen(tmp_path, write, turns):
    # Sixteen turns in one span look like rest at every sixteenth of it.
    ends = np.array([[1.0, 0, 0, 0], [1, 0, 0, 0]])
    spin = sm.quaternions.QuaternionMotion(
        sm.splines.BSplineBasis.clamped([0, 1], 1), ends, np.array([[0, 0, turns * np.pi]])
    )
    assert write(spin, tmp_path / f"m.{'glb' if write is write_gltf else 'usda'}").keys > 2 * turns


@pytest.mark.parametrize("turns", [16, 3])
def test_a_spinning_node_is_where_the_motion_has_it(tmp_path, turns):
    ends = np.array([[1.0, 0, 0, 0], [1, 0, 0, 0]])
    spin = sm.quaternions.QuaternionMotion(
        sm.splines.BSplineBasis.clamped([0, 1], 1), ends, np.array([[0, 0, turns * np.pi]])
    )
    still_ = sm.splines.Spline(sm.splines.BSplineBasis.clamped([0, 1], 1), np.zeros((2, 3)))
    written = write_gltf(spin, tmp_path / "m.glb")
    worst = worst_distance(sm.motions.PoseMotion(spin, still_), tmp_path / "m.glb", RNG.uniform(0, 1, 40))
    assert worst <= 1e-4 * written.size


class Stepping:
    """A motion of no known kind that jumps."""

    domain, dimension = (0.0, 1.0), 3

    def __call__(self, t, nu=0):
        t = np.asarray(t, dtype=float)
        place = np.stack([np.where(t > 0.37, 1.0, 0.0) * (nu == 0), 0 * t, 0 * t], axis=-1)
        return sm.Affine(np.broadcast_to(np.eye(3) * (nu == 0), (*t.shape, 3, 3)), place)


def jumping() -> sm.AffineMotion:
    return spline_motion(sm.splines.BSplineBasis([0, 0, 0.5, 0.5, 2, 2], 1))


def still() -> sm.AffineMotion:
    return sm.AffineMotion(sm.splines.BSplineBasis.clamped([0, 1], 1), np.zeros((2, 3, 3)))


def infinite() -> sm.AffineMotion:
    return sm.AffineMotion(sm.splines.BSplineBasis.clamped([0, 1], 1), np.full((2, 3, 3), np.inf))


MESH = (np.eye(3), np.array([[0, 1, 2]]))


@pytest.mark.parametrize(
    ("motion", "name", "options", "message"),
    [
        (jumping(), "m.glb", {}, "the motion jumps at time 0.5"),
        (Stepping(), "m.glb", {}, "the motion jumps at time 0.37"),
        (still(), "m.glb", {}, "stands still"),
        (infinite(), "m.glb", {}, "not finite at time 0"),
        (SPATIAL, "m.glb", {}, "a Keyframes is no motion over one time"),
        (smooth_net(5), "m.glb", {}, "a TwoParameterMotion is no motion over one time"),
        (pose_motion(), "m.gltf", {}, "m.gltf: format 'gltf' is unknown; there are glb"),
        (pose_motion(), "no/m.glb", {}, "no/m.glb: cannot be written: there is no directory"),
        (pose_motion(), "m.glb", {"seconds": 0}, "seconds 0: a positive number"),
        (pose_motion(), "m.glb", {"seconds": np.nan}, "seconds nan: a positive number"),
        (pose_motion(), "m.glb", {"tolerance": -1}, "tolerance -1: a positive number"),
        (pose_motion(), "m.glb", {"tolerance": 1e-12}, "more than 500 keys .* allow a larger tolerance"),
        (pose_motion(), "m.glb", {"body": "box"}, "body: a file is read first, .* outlines are arrays of numbers"),
        (pose_motion(), "m.glb", {"body": (np.eye(4), MESH[1])}, r"body vertices of shape \(4, 4\)"),
        (pose_motion(), "m.glb", {"body": (np.eye(3) * np.nan, MESH[1])}, "body vertices .* finite"),
        (pose_motion(), "m.glb", {"body": (MESH[0], [[0, 1]])}, r"body faces of shape \(1, 2\)"),
        (pose_motion(), "m.glb", {"body": (MESH[0], [[0.0, 1, 2]])}, r"body faces of shape \(1, 3\): whole numbers"),
        (pose_motion(), "m.glb", {"body": (MESH[0], [[0, 1, 2], [0, 1, 3]])}, "face 1 of the body has a corner"),
        (spline_motion(sm.splines.BSplineBasis.clamped([0, 1, 1 + 1e-9, 2], 3)), "m.glb", {}, "together in single"),
    ],
)  # fmt: skip
def test_bad_requests(tmp_path, monkeypatch, motion, name, options, message):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(keys, "MOST_KEYS", 500)
    with pytest.raises(InputError, match=message):
        write_gltf(motion, name, **options)
    assert not list(tmp_path.iterdir())


def test_numbers_beyond_single_precision(tmp_path):
    motion = spline_motion(sm.splines.BSplineBasis.clamped([0, 1], 1))
    large = sm.AffineMotion(motion.basis, motion.linear, 1e39 * motion.translation)
    with pytest.raises(InputError, match="beyond the range of single precision"):
        write_gltf(large, tmp_path / "m.glb")


def test_write_motion_chooses_by_the_ending(tmp_path):
    motion = EXACT["planar, C²"]()
    written = write_motion(motion, tmp_path / "m.glb")
    assert written is not None
    assert written.exact
    assert written.path == tmp_path / "m.glb"
    assert write_motion(motion, tmp_path / "m.csv") is None
    with pytest.raises(InputError, match=r"m\.glb: glb has no rate: it goes with csv, tum"):
        write_motion(motion, tmp_path / "m.glb", rate=3)
