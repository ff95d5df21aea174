"""USD scenes read: worked examples, Pixar's own library on the same files, and what broken ones get."""

import sys
from pathlib import Path

import numpy as np
import pytest

import symmotion as sm
from symmotion.errors import InputError
from symmotion.files import read_recording, read_usd_keyframes
from symmotion.files.usd_reading import read_scene

HEAD = "#usda 1.0\n"
TURN = """\
def Xform "A"
{
    float xformOp:rotateZ.timeSamples = {
        0: 0,
        12: 90,
        24: 90,
    }
    double3 xformOp:translate.timeSamples = { 6: (1, 2, 3) }
    uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:rotateZ"]
}
"""
RICH = '''\
(
    doc = """a "scene" with { brackets"""
    timeCodesPerSecond = 25
    upAxis = "Z"
    metersPerUnit = 1
    customLayerData = {
        string references = "no (arc"
    }
)
# a comment { with brackets
def Xform "World" (
    kind = "group"
)
{
    double3 xformOp:translate = (1, 2, 3)
    float3 xformOp:rotateXYZ.timeSamples = {
        0: (10, 20, 30),
        25: (40, -50, 60),  # a comment
    }
    uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:rotateXYZ"]

    def Xform "Arm" (
        active = true
    )
    {
        custom string note = "hello } world"
        rel material:binding = </World/Mat>
        double3 xformOp:translate:pivot = (0.5, 0, 0)
        quatd xformOp:orient.timeSamples = {
            5: (1, 0, 0, 0),
            50: (-0.6, 0, -0.8, 0)
        }
        float3 xformOp:scale.timeSamples = {
            0: (1, 2, 1), 10: (1.5, 1, .5)
        }
        double xformOp:rotateY = 33
        matrix4d xformOp:transform = ( (1, 0, 0, 0), (0, 1, 0.1, 0), (0, 0, 1, 0), (0, 7, 0, 1) )
        uniform token[] xformOpOrder = [
            "xformOp:translate:pivot", "xformOp:orient", "xformOp:scale", "xformOp:rotateY",
            "xformOp:transform", "!invert!xformOp:translate:pivot",
        ]

        def Mesh "Body"
        {
            reorder nameChildren = ["a"]
            point3f[] points = [(0, 0, 0), (1, 0, 0)] (
                interpolation = "vertex"
            )
            float3 xformOp:rotateZXY.timeSamples = {
                1: (1, 2, 3),
                7: (50, -20, 30)
            }
            uniform token[] xformOpOrder = ["!resetXformStack!", "xformOp:rotateZXY"]
        }
    }

    over "Nothing"
    {
        double3 xformOp:translate.timeSamples = {
            0: (1, 2, 3)
        }
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }
}
'''


@pytest.fixture
def scene(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)

    def write(content: str, name: str = "a.usda") -> str:
        Path(name).write_text(HEAD + content)
        return name

    return write


def test_a_worked_example(scene):
    """Turned by hand: 45° after 6 of 24 codes a second; the translation, of one sample, is held."""
    keys = sm.read_keyframes(scene(TURN))
    np.testing.assert_allclose(keys.times, [0, 0.25, 0.5, 1])
    np.testing.assert_allclose(keys.translation, np.tile([1.0, 2, 3], (4, 1)))
    half = np.sqrt(0.5)
    np.testing.assert_allclose(keys.linear[1], [[half, -half, 0], [half, half, 0], [0, 0, 1]], atol=1e-15)
    np.testing.assert_allclose(keys.linear[3], [[0, -1, 0], [1, 0, 0], [0, 0, 1]], atol=1e-15)


def test_the_last_operation_is_applied_first_and_parents_carry_it(scene):
    still = (
        'def Xform "P"\n{\n float3 xformOp:scale = (2, 2, 2)\n'
        f' uniform token[] xformOpOrder = ["xformOp:scale"]\n{TURN}}}\n'
    )
    keys = sm.read_keyframes(scene(still), node="/P/A")
    np.testing.assert_allclose(keys.translation[0], [2, 4, 6])
    np.testing.assert_allclose(keys.linear[0], 2 * np.eye(3))
    np.testing.assert_array_equal(keys.linear, sm.read_keyframes("a.usda").linear)


@pytest.mark.parametrize("node", ["World", "/World/Arm", "Body"])
def test_pixars_library_places_the_prims_alike(scene, node):
    Usd = pytest.importorskip("pxr.Usd", reason="usd-core is not installed")
    UsdGeom = pytest.importorskip("pxr.UsdGeom", reason="usd-core is not installed")
    path = scene(RICH)
    keys = read_usd_keyframes(path, node)
    stage = Usd.Stage.Open(path)
    prim = next(p for p in stage.Traverse() if node in (str(p.GetPath()), p.GetName()))
    for key in keys:
        matrix = np.array(UsdGeom.XformCache(Usd.TimeCode(25 * key.time)).GetLocalToWorldTransform(prim))
        np.testing.assert_allclose(key.linear, matrix[:3, :3].T, atol=2e-15)
        np.testing.assert_allclose(key.translation, matrix[3, :3], atol=1e-14)
    stage.GetRootLayer().Export("b.usdc")
    binary = read_usd_keyframes("b.usdc", node)
    np.testing.assert_array_equal(binary.times, keys.times)
    np.testing.assert_allclose(binary.coordinates, keys.coordinates, atol=1e-14)


def test_axes_units_and_the_prim_are_said(scene):
    told = read_recording(scene(RICH.replace('"!resetXformStack!", ', ""))).notes
    assert told[0] == "prim /World is read, from which the others hang"
    assert told[1] == "z is up in this scene, a unit of length is 1 m"
    assert "y is up in this scene, a unit of length is 0.01 m" in read_recording(scene(TURN)).notes


def test_prims_that_are_not_in_the_scene_are_not_found(scene):
    assert [prim.path for prim in read_scene(scene(RICH)).prims] == ["/World", "/World/Arm", "/World/Arm/Body"]
    assert not read_scene(scene(TURN.replace('"A"', '"A" (\n active = false\n)'))).prims


@pytest.mark.parametrize("ending", ["usda", "usd", "usdc", "usdz"])
def test_what_is_written_is_read_back(tmp_path, ending):
    if ending != "usda":
        pytest.importorskip("pxr.Usd", reason="usd-core is not installed")
    motion = sm.interpolants.component_cubic(sm.examples.spatial_keyframes())
    path = tmp_path / f"m.{ending}"
    written = sm.write_motion(motion, path, tolerance=1e-3)
    assert written is not None
    keys = sm.read_keyframes(path)
    assert len(keys) == written.keys
    np.testing.assert_allclose(keys.linear, motion(keys.times).linear, atol=1e-14)
    np.testing.assert_allclose(keys.translation, motion(keys.times).translation, atol=1e-13)
    assert [p.name for p in tmp_path.iterdir()] == [path.name]


def test_layers_and_references_take_the_library(scene, monkeypatch):
    pytest.importorskip("pxr.Usd", reason="usd-core is not installed")
    scene(TURN, "part.usda")
    path = scene('def Xform "B" (\n references = @part.usda@</A>\n)\n{\n}\n')
    np.testing.assert_array_equal(sm.read_keyframes(path).linear, sm.read_keyframes("part.usda").linear)
    monkeypatch.setitem(sys.modules, "pxr.Usd", None)
    with pytest.raises(InputError, match=r"a\.usda: has references, which takes Pixar's library: .*symmotion\[usd\]"):
        sm.read_keyframes(path)
    Path("c.usdc").write_bytes(b"PXR-USDC")
    with pytest.raises(InputError, match=r"c\.usdc: binary USD takes Pixar's library.*or use \.usda"):
        sm.read_keyframes("c.usdc")
    with pytest.raises(InputError, match=r"d\.usdz: binary USD takes Pixar's library"):
        sm.write_motion(sm.interpolants.component_cubic(sm.examples.spatial_keyframes()), "d.usdz")
    assert not Path("d.usdz").exists()


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("", "a.usda: holds no prim with time samples"),
        ('def Xform "A"\n{\n', "a.usda, line .: prim /A is never closed"),
        ('def Xform "A"\n', r"a.usda, line 3: \{ is needed"),
        ("nonsense", "a.usda, line 2: 'nonsense' where a prim"),
        (TURN.replace("12: 90", "12: (90, 1)"), r"a.usda, line 6: '12: \(90, 1\),.*where a time sample is needed"),
        (TURN.replace("12: 90", "0: 90"), "a.usda, prim /A: the time codes of xformOp:rotateZ must increase"),
        (TURN.replace("xformOp:rotateZ", "xformOp:rotateQ"), "prim /A: the operation 'xformOp:rotateQ' is unknown"),
        (TURN.replace("rotateZ.time", "rotateX.time"), "xformOp:rotateZ of /A is '': 1 numbers are needed"),
        (TURN.replace("(1, 2, 3)", "(1, 2, 3]"), "line 9: a ] closes another bracket"),
        (TURN + TURN.replace('"A"', '"B"'), "several prims move, choose one as the node: /A, /B"),
        ("(\n timeCodesPerSecond = -1\n)\n" + TURN, "timeCodesPerSecond and metersPerUnit: positive numbers"),
        (
            TURN.replace("rotateZ", "scale").replace(": 0,", ": (1, 1, 1),").replace(": 90,", ": (0, 1, 1),")
            .replace('er = ["xf', 'er = ["!invert!xf').replace('"xformOp:scale"', '"!invert!xformOp:scale"'),
            "prim /A: a position with a singular linear part has no inverse",
        ),
    ],
)  # fmt: skip
def test_broken_files(scene, content, message):
    with pytest.raises(InputError, match=message):
        sm.read_keyframes(scene(content))


@pytest.mark.parametrize(
    ("node", "message"),
    [
        ("C", "0 prims are called 'C'; there are /World, /World/Arm"),
        (9, "prim 9 does not exist: there are 3"),
    ],
)
def test_prims_that_there_are_not(scene, node, message):
    with pytest.raises(InputError, match=message):
        sm.read_keyframes(scene(RICH), node=node)


def test_no_file_of_usd(tmp_path):
    (tmp_path / "a.usda").write_text("x")
    with pytest.raises(InputError, match=r"a\.usda, line 1: '#usda 1\.0' is needed|is no USD file"):
        sm.read_keyframes(tmp_path / "a.usda")
