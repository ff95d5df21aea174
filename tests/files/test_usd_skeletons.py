"""Skeletons of USD: a worked example, Pixar's own library on the same files, and what broken ones get."""

import numpy as np
import pytest

import symmotion as sm
from symmotion.errors import InputError
from symmotion.files import read_recording, read_skeleton, read_usd_keyframes

# A hip that goes along x and turns about z, a knee twice as long below, a foot that the animation does not know.
SKELETON = """\
#usda 1.0
(
    timeCodesPerSecond = 24
)
def SkelRoot "Man" (
    prepend apiSchemas = ["SkelBindingAPI"]
)
{
    rel skel:animationSource = </Man/Walk>
    double3 xformOp:translate.timeSamples = { 0: (5, 0, 0), 48: (5, 0, 4) }
    uniform token[] xformOpOrder = ["xformOp:translate"]
    def Skeleton "Bones"
    {
        uniform token[] joints = ["hip", "hip/knee", "hip/knee/foot"]
        uniform matrix4d[] bindTransforms = []
        uniform matrix4d[] restTransforms = [
            ((1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, 0), (0, 1, 0, 1)),
            ((1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, 0), (0, -1, 0, 1)),
            ((0, 0, 1, 0), (0, 1, 0, 0), (-1, 0, 0, 0), (0, -1, 0, 1)), # ends ]
        ]
    }
    def SkelAnimation "Walk"
    {
        uniform token[] joints = ["hip/knee", "hip"]
        quatf[] rotations.timeSamples = {
            0: [(1, 0, 0, 0), (1, 0, 0, 0)], # standing
            24: [(0.6, 0, 0.8, 0), (0.5, 0.5, 0.5, 0.5)],
            48: [(1, 0, 0, 0), (0.70710678, 0, 0, 0.70710678)],
        }
        half3[] scales = [(1, 2, 1), (1, 1, 1)]
        float3[] translations.timeSamples = {
            0: [(0, -1, 0), (0, 1, 0)], 48: [(0, -1, 0), (2, 1, 0)] }
    }
}
"""
NAMES = ["/Man/Bones/hip", "/Man/Bones/hip/knee", "/Man/Bones/hip/knee/foot"]


@pytest.fixture
def scene(tmp_path):
    def written(text: str = SKELETON):
        path = tmp_path / "skeleton.usda"
        path.write_text(text)
        return path

    return written


def test_a_worked_example(scene):
    recording = read_recording(scene())
    assert "prim /Man is read, from which the others hang" in recording.notes
    hip, foot = (read_usd_keyframes(scene(), node) for node in ("hip", "foot"))
    np.testing.assert_array_equal(hip.times, [0.0, 1.0, 2.0])
    np.testing.assert_allclose(hip.translation, [[5, 1, 0], [6, 1, 2], [7, 1, 4]], atol=1e-7)
    np.testing.assert_allclose(hip.linear[2], [[0, -1, 0], [1, 0, 0], [0, 0, 1]], atol=1e-7)
    # Straight down by 1 and 2 at first, along +x at the end, where down is turned by 90° about z.
    np.testing.assert_allclose(foot.translation[[0, 2]], [[5, -2, 0], [10, 1, 4]], atol=1e-6)
    # At rest it is turned by −90° about y, y stretched by the knee.
    np.testing.assert_allclose(foot.linear[0], [[0, 0, -1], [0, 2, 0], [1, 0, 0]], atol=1e-12)


@pytest.mark.parametrize("ending", ["usda", "usdc"])
def test_pixars_library_places_the_joints_alike(scene, ending, tmp_path):
    pxr = pytest.importorskip("pxr", reason="usd-core is not installed")
    from pxr import Usd, UsdGeom, UsdSkel

    path = scene()
    stage = Usd.Stage.Open(str(path))
    if ending != "usda":
        path = tmp_path / f"skeleton.{ending}"
        stage.Export(str(path))
    skeleton = UsdSkel.Skeleton(stage.GetPrimAtPath("/Man/Bones"))
    cache = UsdSkel.Cache()
    cache.Populate(UsdSkel.Root(stage.GetPrimAtPath("/Man")), pxr.Usd.PrimDefaultPredicate)
    query = cache.GetSkelQuery(skeleton)
    whole = read_skeleton(path)
    assert list(whole.names[-3:]) == NAMES
    assert list(whole.parents[-3:]) == [whole.names.index("/Man/Bones"), len(whole) - 3, len(whole) - 2]
    for t, linear, translation in zip(whole.times, whole.linear, whole.translation, strict=True):
        carried = UsdGeom.Xformable(skeleton).ComputeLocalToWorldTransform(24 * t)
        expected = np.array([np.array(m * carried) for m in query.ComputeJointSkelTransforms(24 * t)])
        np.testing.assert_allclose(linear[-3:], np.swapaxes(expected[:, :3, :3], 1, 2), atol=1e-6)
        np.testing.assert_allclose(translation[-3:], expected[:, 3, :3], atol=1e-6)


def test_what_an_animation_does_not_have_is_as_at_rest(scene):
    still = SKELETON.replace("        half3[] scales = [(1, 2, 1), (1, 1, 1)]\n", "")
    np.testing.assert_allclose(read_usd_keyframes(scene(still), "foot").translation[0], [5, -1, 0], atol=1e-12)
    without = SKELETON.replace("rotations.timeSamples", "custom.timeSamples")
    np.testing.assert_allclose(read_usd_keyframes(scene(without), "knee").linear[1], np.diag([1, 2, 1]), atol=1e-12)
    unbound = SKELETON.replace("</Man/Walk>", "</Man/Run>")
    with pytest.raises(InputError, match=r"0 prims are called 'hip'; there are /Man, /Man/Bones, /Man/Walk$"):
        read_usd_keyframes(scene(unbound), "hip")


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (
            "48: [(1, 0, 0, 0), (0.7",
            "9: [(1, 0, 0, 0), (0.7",
            "/Man/Walk: the time codes of rotations must increa",
        ),
        ("(1, 1, 1)]", "]", "/Man/Bones: its animation has scales of 3 numbers for 2 joints"),
        ("48: [(0, -1, 0), (2, 1, 0)]", "48: [(0, -1, 0)]", "must increase, its arrays be of one size"),
        ('"hip", "hip/knee", ', '"hip", ', "/Man/Bones: 3 restTransforms for 2 joints"),
        ("(0.6, 0, 0.8, 0)", "(0.6, 0, 0.8, e)", "line 27: .* where numbers are needed"),
        ("(0.6, 0, 0.8, 0)", "(0.6, 0, 0.8, x)", "line 27: .* where a time sample is needed"),
        (
            "half3[] scales = [(1, 2, 1), (1, 1, 1)]",
            "half3[] scales = 3",
            "scales of /Man/Walk is '3': numbers in brac",
        ),
    ],
)
def test_broken_skeletons(scene, old, new, message):
    assert old in SKELETON
    with pytest.raises(InputError, match=message):
        read_usd_keyframes(scene(SKELETON.replace(old, new)), "hip")


def test_a_joint_becomes_a_motion(scene):
    keys = sm.read_keyframes(scene(), node="hip")
    assert sm.ExactNewton().solve(sm.affine_program(keys)).status == "solved"
