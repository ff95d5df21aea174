"""USD scenes: opened by Pixar's own library and evaluated between the samples, and what bad requests get."""

import numpy as np
import pytest

import symmotion as sm
from symmotion.errors import InputError
from symmotion.files import keys, write_motion
from symmotion.files.usd import write_usd

Usd = pytest.importorskip("pxr.Usd", reason="usd-core is not installed")
UsdGeom = pytest.importorskip("pxr.UsdGeom", reason="usd-core is not installed")
RNG = np.random.default_rng(8)


def linear_motion(dimension: int = 3) -> sm.AffineMotion:
    rng = np.random.default_rng(dimension)
    basis = sm.splines.BSplineBasis.clamped([2, 3, 3.5, 6], 1)
    return sm.AffineMotion(basis, rng.normal(size=(4, dimension, dimension)), rng.normal(size=(4, dimension)))


def pose_motion() -> sm.motions.PoseMotion:
    poses = sm.examples.random_keyframes(5, 80, 2)
    path = sm.splines.cubic_interpolant(poses.times, poses.translation)
    return sm.motions.PoseMotion(sm.quaternions.interpolate_quaternions(poses.times, poses.rotations()), path)


def broken_path(domain) -> sm.splines.Spline:
    """A polygon that jumps in the middle."""
    a, b = domain
    return sm.splines.Spline(
        sm.splines.BSplineBasis([a, a, (a + b) / 2, (a + b) / 2, b, b], 1), np.arange(12.0).reshape(4, 3)
    )


def worst_distance(motion, path, seconds_per_unit=1.0) -> float:
    """The largest distance of a vertex in the scene from where the motion has it, at times between the samples."""
    stage = Usd.Stage.Open(str(path))
    mesh = UsdGeom.Mesh(stage.GetPrimAtPath("/Motion/Body"))
    points = np.array(mesh.GetPointsAttr().Get(), dtype=float)
    a, b = motion.domain
    worst = 0.0
    for t in RNG.uniform(a, b, 60):
        code = (t - a) * seconds_per_unit * stage.GetTimeCodesPerSecond()
        matrix = np.array(UsdGeom.XformCache(Usd.TimeCode(code)).GetLocalToWorldTransform(mesh.GetPrim()))
        wanted = points.copy()
        d = motion(t).translation.shape[-1]
        wanted[:, :d] = motion.trajectory(points[:, :d], t)
        worst = max(worst, np.abs(points @ matrix[:3, :3] + matrix[3, :3] - wanted).max())
    return worst


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("seconds", [None, 2.5])
def test_motions_of_degree_1_are_in_the_file_exactly(tmp_path, dimension, seconds):
    motion = linear_motion(dimension)
    written = write_usd(motion, tmp_path / "m.usda", seconds=seconds)
    assert written.exact
    assert written.keys == 4
    assert written.relative < 1e-15
    scale = 1.0 if seconds is None else seconds / 4
    assert worst_distance(motion, tmp_path / "m.usda", scale) < 1e-12 * written.size


MOTIONS = {
    "planar": lambda: sm.interpolants.component_cubic(sm.examples.planar_keyframes()),
    "spatial": lambda: sm.interpolants.component_cubic(sm.examples.spatial_keyframes()),
    "rigid": pose_motion,
    "no spline": lambda: sm.interpolants.steady_morph(sm.examples.spatial_keyframes()),
    "orientation": lambda: pose_motion().orientation,
}


@pytest.mark.parametrize("name", MOTIONS)
def test_others_are_sampled_to_the_tolerance(tmp_path, name):
    motion = MOTIONS[name]()
    coarse, fine = (write_usd(motion, tmp_path / "m.usda", tolerance=tolerance) for tolerance in (1e-3, 1e-4))
    assert not fine.exact
    assert fine.relative <= 1e-4 < coarse.relative <= 1e-3
    # Halving an interval takes the error to a quarter.
    assert 2 * coarse.keys < fine.keys < 6 * coarse.keys
    if name == "orientation":
        motion = sm.motions.PoseMotion(motion, sm.splines.Spline(motion.basis, np.zeros((motion.basis.n, 3))))
    worst = worst_distance(motion, tmp_path / "m.usda")
    assert 0.2 * fine.error < worst <= 1.05 * fine.error


def test_what_the_stage_says_of_itself(tmp_path):
    motion = linear_motion()
    written = write_usd(motion, tmp_path / "m.usda", body=(np.eye(3), np.array([[0, 1, 2]])))
    stage = Usd.Stage.Open(str(tmp_path / "m.usda"))
    assert stage.GetDefaultPrim().GetPath() == "/Motion"
    assert (stage.GetStartTimeCode(), stage.GetEndTimeCode(), stage.GetTimeCodesPerSecond()) == (0, 96, 24)
    assert (UsdGeom.GetStageUpAxis(stage), UsdGeom.GetStageMetersPerUnit(stage)) == ("Y", 1)
    notes = stage.GetRootLayer().customLayerData
    assert (notes["exact"], notes["error"], notes["start"], notes["keys"]) == (True, written.error, 2, 4)
    mesh = UsdGeom.Mesh(stage.GetPrimAtPath("/Motion/Body"))
    np.testing.assert_array_equal(mesh.GetPointsAttr().Get(), np.eye(3))
    assert UsdGeom.Mesh.ValidateTopology(mesh.GetFaceVertexIndicesAttr().Get(), mesh.GetFaceVertexCountsAttr().Get(), 3)
    samples = UsdGeom.Xformable(stage.GetDefaultPrim()).GetTimeSamples()
    np.testing.assert_allclose(samples, 24 * np.array([0, 1, 1.5, 4]))


def test_write_motion_chooses_by_the_ending(tmp_path):
    written = write_motion(linear_motion(), tmp_path / "m.usda")
    assert written is not None
    assert "4 matrix samples, exact up to rounding" in str(written)


@pytest.mark.parametrize(
    ("motion", "name", "options", "message"),
    [
        (sm.AffineMotion(sm.splines.BSplineBasis([0, 0, 1, 1, 3, 3], 1), np.arange(16.0).reshape(4, 2, 2)), "m.usda",
         {}, "the motion jumps at time 1"),
        (sm.motions.PoseMotion(pose_motion().orientation, broken_path(pose_motion().domain)), "m.usda", {},
         "the motion jumps at time 2: keys"),
        (pose_motion(), "m.usdx", {}, "m.usdx: format 'usdx' is unknown; there are usda, usd, usdc, usdz"),
        (pose_motion(), "no/m.usda", {}, "no/m.usda: cannot be written"),
        (pose_motion(), "m.usda", {"tolerance": 0}, "tolerance 0: a positive number"),
        (pose_motion(), "m.usda", {"tolerance": 1e-8}, "more than 500 keys would be needed"),
        (pose_motion(), "m.usda", {"seconds": -1}, "seconds -1: a positive number"),
        (pose_motion(), "m.usda", {"body": 3}, "body: a int is no outline"),
    ],
)  # fmt: skip
def test_bad_requests(tmp_path, monkeypatch, motion, name, options, message):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(keys, "MOST_KEYS", 500)
    with pytest.raises(InputError, match=message):
        write_usd(motion, name, **options)
    assert not list(tmp_path.iterdir())
