"""Keyframes out of glTF: hand-made files with every sampler, files of pygltflib's making, and what broken files get."""

import base64
import json
import struct
import time
import tracemalloc

import numpy as np
import pygltflib
import pytest
from scipy.interpolate import CubicHermiteSpline
from scipy.spatial.transform import Rotation, Slerp

import symmotion as sm
from symmotion.errors import InputError
from symmotion.files import gltf_keyframes, read_keyframes
from symmotion.files.gltf_keyframes import read_gltf_keyframes
from symmotion.files.gltf_writing import write_gltf

TURNS = Rotation.from_euler("ZYX", [[10, 20, 30], [100, -20, 5], [170, 40, 80]], degrees=True)
CODES = {np.dtype("f4"): 5126, np.dtype("i2"): 5122, np.dtype("u1"): 5121, np.dtype("i1"): 5120}
TYPES = {1: "SCALAR", 3: "VEC3", 4: "VEC4"}


class Maker:
    """A glTF document with one embedded buffer."""

    def __init__(self, *nodes):
        self.binary = b""
        self.document = {
            "asset": {"version": "2.0"},
            "nodes": list(nodes),
            "accessors": [],
            "bufferViews": [],
            "animations": [{"name": "walk", "samplers": [], "channels": []}],
        }

    def accessor(self, values, dtype="f4", **more):
        values = np.asarray(values, dtype=dtype).reshape(len(values), -1)
        self.document["bufferViews"].append({"buffer": 0, "byteOffset": len(self.binary), "byteLength": values.nbytes})
        self.binary += values.tobytes()
        self.document["accessors"].append(
            {
                "bufferView": len(self.document["bufferViews"]) - 1,
                "componentType": CODES[values.dtype],
                "count": len(values),
                "type": TYPES[values.shape[1]],
                **more,
            }
        )
        return len(self.document["accessors"]) - 1

    def animate(self, node, path, times, values, interpolation=None, **more):
        animation = self.document["animations"][0]
        sampler = {"input": self.accessor(times), "output": self.accessor(values, **more)}
        animation["samplers"].append(sampler if interpolation is None else sampler | {"interpolation": interpolation})
        channel = {"sampler": len(animation["samplers"]) - 1, "target": {"node": node, "path": path}}
        animation["channels"].append(channel)
        return self

    def save(self, path, uri=None):
        data = "data:application/octet-stream;base64," + base64.b64encode(self.binary).decode()
        buffer = {"byteLength": len(self.binary), "uri": data if uri is None else uri}
        path.write_text(json.dumps(self.document | {"buffers": [buffer]}))
        return path


def moving(node=0) -> Maker:
    """Two nodes, of which one is moved."""
    return Maker({"name": "a"}, {"name": "b"}).animate(node, "translation", [0, 1, 3], np.eye(3))


def test_every_sampler_at_the_keys_of_all(tmp_path):
    rng = np.random.default_rng(0)
    scales, slopes = rng.uniform(0.5, 2, (2, 3)), rng.normal(size=(3, 3, 3))
    maker = Maker({"name": "body"})
    maker.animate(0, "rotation", [0, 1, 3], TURNS.as_quat() * [[1], [-1], [1]])  # signs are no matter
    maker.animate(0, "scale", [0.5, 2], scales, "STEP")
    maker.animate(0, "translation", [0, 2, 4], slopes.reshape(9, 3), "CUBICSPLINE")
    keys = read_keyframes(maker.save(tmp_path / "a.gltf"), steps="keys")
    t = np.array([0, 0.5, 1, 2, 3, 4])
    np.testing.assert_array_equal(keys.times, t)
    held = scales[[0, 0, 0, 1, 1, 1]]
    turned = Slerp([0, 1, 3], TURNS)(np.minimum(t, 3)).as_matrix()
    np.testing.assert_allclose(keys.linear, turned * held[:, None], atol=1e-6)
    parts = [
        CubicHermiteSpline([2 * k, 2 * k + 2], slopes[k : k + 2, 1], [slopes[k, 2], slopes[k + 1, 0]]) for k in (0, 1)
    ]
    np.testing.assert_allclose(keys.translation, [parts[int(x > 2)](x) for x in t], atol=1e-6)


def test_keys_of_samplers_that_agree_up_to_rounding_are_one(tmp_path):
    scales = np.array([[1.0, 1, 1], [2, 2, 2]])
    maker = Maker({"name": "body"}).animate(0, "translation", [0, 1e6, 3e6], np.eye(3))
    # The least float32 is far below the rounding of times of the animation.
    maker.animate(0, "scale", [1e-30, 1e6], scales, "STEP")
    keys = read_keyframes(maker.save(tmp_path / "a.gltf"), steps="keys")
    assert keys.times.tolist() == [0, 1e6, 3e6]
    np.testing.assert_array_equal(keys.linear, np.eye(3) * np.array([1, 2, 2])[:, None, None])


def test_step_keys_hold(tmp_path):
    """Held from 0 to 1.9 and from 2 to 3.8, nothing to hold before 5, whose value is that of 4."""
    places = np.array([[0.0, 0, 0], [1, 0, 0], [2, 0, 0], [2, 0, 0]])
    maker = Maker({"name": "body"}).animate(0, "translation", [0, 2, 4, 5], places, "STEP")
    recording = sm.files.read_recording(maker.save(tmp_path / "a.gltf"))
    keys = recording.keyframes
    np.testing.assert_allclose(keys.times, [0, 1.8, 2, 3.8, 4, 5], rtol=1e-15)
    np.testing.assert_array_equal(keys.translation[:, 0], [0, 0, 1, 1, 2, 2])
    assert (
        recording.notes
        == (
            "STEP keys are held until a tenth of their step is left; steps='keys' reads the keys alone",
            "1 gap longer",
        )[: len(recording.notes)]
    )
    alone = sm.files.read_recording(tmp_path / "a.gltf", steps="keys")
    assert (alone.keyframes.times.tolist(), alone.notes) == ([0, 2, 4, 5], ())
    with pytest.raises(InputError, match="steps 'jump' is unknown; there are hold, keys"):
        read_keyframes(tmp_path / "a.gltf", steps="jump")


def test_the_nodes_above_take_part(tmp_path):
    matrix = np.eye(4)
    matrix[:3] = [[0, -2, 0, 1], [2, 0, 0, 2], [0, 0, 2, 3]]
    maker = Maker(
        {"name": "tip", "translation": [1, 0, 0], "scale": [1, 2, 3]},
        {"name": "arm", "children": [0], "rotation": TURNS[0].as_quat().tolist()},
        {"name": "world", "children": [1], "matrix": matrix.T.ravel().tolist()},
    )
    maker.animate(1, "translation", [0, 2], [[0, 0, 0], [0, 0, 4]])
    maker.animate(0, "rotation", [0, 1], TURNS[1:].as_quat())
    keys = read_gltf_keyframes(maker.save(tmp_path / "a.gltf"), node="tip")
    np.testing.assert_array_equal(keys.times, [0, 1, 2])
    for i, (place, turn) in enumerate(((0, 1), (2, 2), (4, 2))):
        above = matrix.copy()
        arm, tip = np.eye(4), np.eye(4)
        arm[:3, :3], arm[:3, 3] = TURNS[0].as_matrix(), [0, 0, place]
        tip[:3, :3], tip[:3, 3] = TURNS[turn].as_matrix() @ np.diag([1, 2, 3]), [1, 0, 0]
        wanted = above @ arm @ tip
        np.testing.assert_allclose(keys.linear[i], wanted[:3, :3], atol=1e-6)
        np.testing.assert_allclose(keys.translation[i], wanted[:3, 3], atol=1e-6)
    # Left out, the node that the other one hangs from.
    np.testing.assert_array_equal(read_keyframes(tmp_path / "a.gltf").times, [0, 2])
    np.testing.assert_allclose(
        read_keyframes(tmp_path / "a.gltf", node=1).translation, [[1, 2, 3], [1, 2, 11]], atol=1e-6
    )


@pytest.mark.parametrize(("dtype", "most"), [("i2", 32767), ("u1", 255), ("i1", 127)])
def test_normalised_integers_and_strides(tmp_path, dtype, most):
    quaternions = np.abs(TURNS.as_quat())
    rounded = np.round(quaternions * most)
    maker = Maker({"name": "a"}).animate(0, "rotation", [0, 1, 2], rounded, dtype=dtype, normalized=True)
    # Interleaved: every quaternion is followed by as many bytes of something else.
    view = maker.document["bufferViews"][1]
    item = 4 * np.dtype(dtype).itemsize
    data = maker.binary[view["byteOffset"] :]
    maker.binary = maker.binary[: view["byteOffset"]] + b"".join(
        data[k : k + item] + b"\xff" * item for k in range(0, len(data), item)
    )
    view |= {"byteStride": 2 * item, "byteLength": 6 * item}
    keys = read_keyframes(maker.save(tmp_path / "a.gltf"))
    wanted = Rotation.from_quat(rounded).as_matrix()
    np.testing.assert_allclose(keys.linear, wanted, atol=1e-7)


def test_buffers_beside_the_file(tmp_path):
    maker = moving()
    (tmp_path / "data file.bin").write_bytes(maker.binary)
    keys = read_keyframes(maker.save(tmp_path / "a.gltf", uri="data%20file.bin"))
    np.testing.assert_array_equal(keys.translation, np.eye(3))


def test_a_file_of_pygltflib_s_making(tmp_path):
    times, places = np.array([0, 0.25, 1], dtype="f4"), np.arange(9, dtype="f4").reshape(3, 3)
    gltf = pygltflib.GLTF2(
        nodes=[pygltflib.Node(name="n")],
        accessors=[
            pygltflib.Accessor(bufferView=0, componentType=pygltflib.FLOAT, count=3, type="SCALAR"),
            pygltflib.Accessor(bufferView=1, componentType=pygltflib.FLOAT, count=3, type="VEC3"),
        ],
        bufferViews=[
            pygltflib.BufferView(buffer=0, byteOffset=0, byteLength=12),
            pygltflib.BufferView(buffer=0, byteOffset=12, byteLength=36),
        ],
        buffers=[pygltflib.Buffer(byteLength=48)],
        animations=[
            pygltflib.Animation(
                samplers=[pygltflib.AnimationSampler(input=0, output=1)],
                channels=[
                    pygltflib.AnimationChannel(
                        sampler=0, target=pygltflib.AnimationChannelTarget(node=0, path="translation")
                    )
                ],
            )
        ],
    )
    gltf.set_binary_blob(times.tobytes() + places.tobytes())
    gltf.save_binary(str(tmp_path / "a.glb"))
    keys = read_keyframes(tmp_path / "a.glb")
    np.testing.assert_array_equal(keys.times, times)
    np.testing.assert_array_equal(keys.translation, places)
    assert read_keyframes(tmp_path / "a.glb", times=[5, 6, 7]).times.tolist() == [5, 6, 7]


def pose() -> sm.motions.PoseMotion:
    keys = sm.examples.random_keyframes(4, 70, 3)
    return sm.motions.PoseMotion(
        sm.quaternions.interpolate_quaternions(keys.times, keys.rotations()),
        sm.splines.cubic_interpolant(keys.times, keys.translation),
    )


def test_what_was_written_is_read(tmp_path):
    motion = pose()
    write_gltf(motion, tmp_path / "a.glb")
    keys = read_keyframes(tmp_path / "a.glb")
    wanted = motion(np.minimum(keys.times, motion.domain[1]))
    np.testing.assert_allclose(keys.linear, wanted.linear, atol=1e-3)
    np.testing.assert_allclose(keys.translation, wanted.translation, atol=1e-5)


def changed(way, value):
    """A document with one entry replaced, or removed by None."""

    def change(document):
        *above, last = way
        for name in above:
            document = document[name]
        if value is None:
            del document[last]
        else:
            document[last] = value

    return change


SAMPLER = ("animations", 0, "samplers", 0)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (changed(("asset", "version"), "1.0"), r"a.gltf, asset.version: '1.0': version 2.0 is read"),
        (changed(("asset",), None), "a.gltf: asset is missing"),
        (changed(("nodes",), {}), "a.gltf, nodes: a list is needed"),
        (changed(("nodes", 0), 3), r"a.gltf, nodes\[0\]: an object is needed"),
        (changed(("nodes", 0, "children"), [7]), r"a.gltf, nodes\[0\].children\[0\]: 7.0: a whole number from 0 to 1"),
        (changed(("nodes", 0, "children"), [0]), r"a.gltf, nodes\[0\]: is its own ancestor"),
        (changed(("nodes", 0, "children"), [1, 1]), r"nodes\[0\].children\[1\]: node 1 has two parents"),
        (changed(("nodes", 0, "matrix"), [1] * 16), r"nodes\[0\].matrix: a node that is animated has"),
        (changed(("nodes", 0, "rotation"), [0] * 4), r"nodes\[0\]: rotation 0 has norm 0"),
        (changed(("nodes", 0, "rotation"), [0] * 3), r"nodes\[0\].rotation: 4 numbers are needed"),
        (changed(("nodes", 0, "scale"), [1, 1, "1"]), r"nodes\[0\].scale: 3 numbers are needed"),
        (changed(("nodes", 0, "scale"), [1, 1, float("nan")]), r"nodes\[0\].scale: a number is not finite"),
        (changed(("animations",), []), "a.gltf: holds no animations"),
        (changed(("animations", 0, "channels"), []), "a.gltf: the animation moves no node"),
        (changed(("animations", 0, "channels", 0, "sampler"), 1), r"channels\[0\].sampler: 1.0: a whole number"),
        (changed(("animations", 0, "channels", 0, "sampler"), -1), r"channels\[0\].sampler: -1.0: a whole number"),
        (changed(("animations", 0, "channels", 0, "target", "node"), 2), r"channels\[0\].target.node: 2.0: a whole"),
        (changed((*SAMPLER, "interpolation"), "BEZIER"), r"samplers\[0\].interpolation: 'BEZIER': LINEAR, STEP or"),
        (changed((*SAMPLER, "interpolation"), "CUBICSPLINE"), r"samplers\[0\].output: 3 values for 3 keys: 9"),
        (changed((*SAMPLER, "output"), 0), r"accessors\[0\].type: 'SCALAR': VEC3 is needed"),
        (changed((*SAMPLER, "input"), True), r"samplers\[0\].input: True: a whole number"),
        (changed(("accessors", 0, "count"), 4), r"accessors\[0\]: claims 16 bytes where its buffer view has 12"),
        (changed(("accessors", 0, "count"), 2), r"samplers\[0\].output: 3 values for 2 keys"),
        (changed(("accessors", 0, "count"), 1e15), r"accessors\[0\]: claims 4000000000000000 bytes where"),
        (changed(("accessors", 0, "count"), 1.5), r"accessors\[0\].count: 1.5: a whole number from 1 to any"),
        (changed(("accessors", 0, "componentType"), 5124), r"accessors\[0\].componentType: 5124: one of 5120"),
        (changed(("accessors", 0, "byteOffset"), 4), r"accessors\[0\]: claims 16 bytes"),
        (changed(("accessors", 0, "sparse"), {}), r"accessors\[0\].sparse: count is missing"),
        (changed(("accessors", 0, "bufferView"), None), r"samplers\[0\].input: key 1: times must increase"),
        (changed(("bufferViews", 0, "byteLength"), 1e12), r"bufferViews\[0\]: claims bytes up to 1000000000000 where"),
        (changed(("bufferViews", 0, "byteStride"), 2), r"bufferViews\[0\].byteStride: 2.0: .* from 4 to 252"),
        (changed(("buffers", 0, "byteLength"), 1e12), r"buffers\[0\].byteLength: claims 1000000000000 bytes"),
        (changed(("buffers", 0, "uri"), None), r"buffers\[0\]: uri is missing, and there is no binary chunk"),
        (changed(("buffers", 0, "uri"), "data:,x"), r"buffers\[0\].uri: embedded data in base64 is needed"),
        (changed(("buffers", 0, "uri"), "data:;base64,?"), r"buffers\[0\].uri: is no base64"),
        (changed(("buffers", 0, "uri"), "../a.bin"), r"buffers\[0\].uri: '../a.bin': the name of a file in the same"),
        (changed(("buffers", 0, "uri"), "%2e%2e%2fa.bin"), r"buffers\[0\].uri: '../a.bin': the name of a file"),
        (changed(("buffers", 0, "uri"), "/etc/passwd"), r"buffers\[0\].uri: '/etc/passwd': the name of a file"),
        (changed(("buffers", 0, "uri"), "none.bin"), "uri: none.bin: cannot be read: No such file"),
        (changed(("buffers",), []), r"bufferViews\[0\].buffer: refers to a list that is empty"),
        (changed(("bufferViews", 0, "extensions"), {"EXT_meshopt_compression": {}}), "compression is not re"),
    ],
)  # fmt: skip
def test_bad_documents_name_the_entry(tmp_path, monkeypatch, change, message):
    monkeypatch.chdir(tmp_path)
    path = moving().save(tmp_path / "a.gltf")
    document = json.loads(path.read_text())
    change(document)
    path.write_text(json.dumps(document))
    with pytest.raises(InputError, match=message) as caught:
        read_keyframes("a.gltf")
    assert str(caught.value).startswith("a.gltf")


@pytest.mark.parametrize(
    ("maker", "options", "message"),
    [
        (moving().animate(1, "scale", [0, 1], np.ones((2, 3))), {}, "several nodes are animated, choose one: 'a', 'b'"),
        (moving(), {"node": "c"}, "0 nodes are called 'c'"),
        (moving(), {"node": 2}, "node 2 does not exist: there are 2"),
        (moving(), {"node": "b"}, "node 'b' does not move in any of the animations 'walk'; animated are 'a'"),
        (moving().animate(0, "translation", [0, 1], np.ones((2, 3))), {}, "translation of node 0 is animated twice"),
        (Maker({}).animate(0, "translation", [1], np.ones((1, 3))), {}, r"nodes\[0\]: 1 keyframe: a motion needs"),
        (Maker({}).animate(0, "translation", [1, 1], np.ones((2, 3))), {}, r"samplers\[0\].input: key 1: times must"),
        (Maker({}).animate(0, "translation", [0, 1], np.full((2, 3), np.nan)), {}, r"accessors\[1\]: item 0 is not"),
        (Maker({}).animate(0, "rotation", [0, 1], np.zeros((2, 4))), {}, r"\[0\].output: rotation 0 has norm 0"),
        (moving(), {"animation": "run"}, "0 animations are called 'run'"),
        (moving(), {"animation": 1}, "animation 1 does not exist"),
    ],
)  # fmt: skip
def test_bad_choices_and_values(tmp_path, maker, options, message):
    with pytest.raises(InputError, match=message):
        read_gltf_keyframes(maker.save(tmp_path / "a.gltf"), **options)


def glb(json_chunk=b"{}  ", magic=b"glTF", version=2, length=None, size=None, name=b"JSON"):
    body = struct.pack("<I4s", len(json_chunk) if size is None else size, name) + json_chunk
    return struct.pack("<4sII", magic, version, 12 + len(body) if length is None else length) + body


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (b"glTF", "a.glb: 4 bytes are too few"),
        (glb(magic=b"PK\3\4"), r"a.glb, byte 0: b'PK\\x03\\x04': b'glTF' begins"),
        (glb(version=1), "a.glb, byte 4: version 1: version 2 is read"),
        (glb(length=2**31), "a.glb, byte 8: claims 2147483648 bytes where the file has 24: is it cut off"),
        (glb(size=2**32 - 1), "a.glb, byte 12: a chunk claims 4294967295 bytes, beyond the end"),
        (glb(name=b"BIN\0"), r"a.glb, byte 12: the first chunk is b'BIN\\x00'"),
        (glb(b"{}  " + b"\0" * 4, size=4), "a.glb, byte 24: a chunk begins and is cut off"),
        (glb(b"{,  "), "a.glb, line 1, column 2"),
        (glb(b"\xff\xfe  "), "a.glb: is not UTF-8"),
        (glb(b"[]  "), "a.glb: a JSON object"),
        (glb(b"[" * 100_000), "a.glb: its lists are nested too deeply"),
        (b"", "a.glb: is empty"),
        (glb(b"[" + b"0," * 2_000_000), "a.glb: its document has more than 2000000 entries"),
    ],
)
def test_bad_containers_name_the_byte(tmp_path, monkeypatch, data, message):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "a.glb").write_bytes(data)
    with pytest.raises(InputError, match=f"^{message}"):
        read_keyframes("a.glb")


@pytest.mark.parametrize(
    "way",
    [
        ("accessors", 0, "count"),
        ("accessors", 1, "byteOffset"),
        ("bufferViews", 1, "byteLength"),
        ("buffers", 0, "byteLength"),
    ],
)
def test_claims_cost_no_memory(tmp_path, way):
    path = moving().save(tmp_path / "a.gltf")
    document = json.loads(path.read_text())
    changed(way, 10**14)(document)
    path.write_text(json.dumps(document))
    tracemalloc.start()
    try:
        with pytest.raises(InputError, match="claims"):
            read_keyframes(path)
        assert tracemalloc.get_traced_memory()[1] < 10**6
    finally:
        tracemalloc.stop()


def test_small_files_cannot_ask_for_much(tmp_path):
    maker = Maker(*({"children": [k + 1]} for k in range(30)), {})
    maker.animate(0, "translation", np.arange(200_000), np.zeros((200_000, 3)))
    animation = maker.document["animations"][0]
    animation["channels"] = [{"sampler": 0, "target": {"node": k, "path": "translation"}} for k in range(31)]
    with pytest.raises(InputError, match=r"more than 5e\+06 keys in all move node nodes\[30\]"):
        read_gltf_keyframes(maker.save(tmp_path / "a.gltf"), node=30)


def test_bytes_that_would_become_too_many_doubles(tmp_path, monkeypatch):
    monkeypatch.setattr("symmotion.files.gltf_reading.MOST_ITEMS", 2)
    with pytest.raises(InputError, match=r"accessors\[0\].count: \d+ items: 2 at most are read"):
        read_keyframes(moving().save(tmp_path / "a.gltf"))


def test_damaged_files_are_input_errors_or_read(tmp_path):
    write_gltf(pose(), tmp_path / "a.glb", tolerance=1e-2)
    whole, path = (tmp_path / "a.glb").read_bytes(), tmp_path / "b.glb"
    rng = np.random.default_rng(11)
    cut = [whole[:k] for k in range(1, len(whole), 37)]
    flipped = []
    for _ in range(400):
        data = bytearray(whole)
        for k in rng.integers(len(data), size=rng.integers(1, 4)):
            data[k] = rng.integers(256)
        flipped.append(bytes(data))
    outcomes = []
    for data in (*cut, *flipped):
        path.write_bytes(data)
        try:
            outcomes.append(len(read_keyframes(path)) >= 2)
        except InputError as error:
            assert str(error).startswith(str(path))
            outcomes.append(False)
    assert not any(outcomes[: len(cut)])
    assert 0 < sum(outcomes) < len(flipped)


def chained(count: int, moving: int, samples: int = 2) -> bytes:
    """A chain of nodes, each a tenth above and turned against the one before, of which one moves."""
    turn = [0.0, 0.0, float(np.sin(0.1)), float(np.cos(0.1))]
    nodes: list[dict] = [{"translation": [0.0, 0.0, 0.1], "rotation": turn, "children": [k + 1]} for k in range(count)]
    nodes[moving].pop("translation")
    del nodes[-1]["children"]
    places = np.arange(3.0 * samples, dtype="<f4").reshape(samples, 3)
    data = np.arange(samples, dtype="<f4").tobytes() + places.tobytes()
    return json.dumps(
        {
            "asset": {"version": "2.0"},
            "nodes": nodes,
            "buffers": [
                {"byteLength": len(data), "uri": "data:;base64," + base64.b64encode(data).decode()},
            ],
            "bufferViews": [
                {"buffer": 0, "byteLength": 4 * samples},
                {"buffer": 0, "byteOffset": 4 * samples, "byteLength": 12 * samples},
            ],
            "accessors": [
                {"bufferView": 0, "componentType": 5126, "count": samples, "type": "SCALAR"},
                {"bufferView": 1, "componentType": 5126, "count": samples, "type": "VEC3"},
            ],
            "animations": [
                {
                    "samplers": [{"input": 0, "output": 1}],
                    "channels": [{"sampler": 0, "target": {"node": moving, "path": "translation"}}],
                }
            ],
        }
    ).encode()


@pytest.mark.parametrize("part", [1, 2, 100])
@pytest.mark.parametrize("moving", [0, 3, 6])
def test_chains_of_nodes_that_stand_still_are_carried_as_one(moving, part, tmp_path, monkeypatch):
    monkeypatch.setattr(gltf_keyframes, "PART", part)
    path = tmp_path / "chain.gltf"
    path.write_bytes(chained(7, moving))
    found = read_gltf_keyframes(path, node=6)
    for k, place in enumerate(np.arange(6.0).reshape(2, 3)):
        whole = np.eye(4)
        for node in range(7):
            here = np.eye(4)
            c, s = np.cos(0.2), np.sin(0.2)
            here[:2, :2] = [[c, -s], [s, c]]
            here[:3, 3] = place if node == moving else [0, 0, 0.1]
            whole = whole @ here
        np.testing.assert_allclose(found.linear[k], whole[:3, :3], atol=1e-14)
        np.testing.assert_allclose(found.translation[k], whole[:3, 3], atol=1e-14)


def test_a_chain_ten_times_as_long_takes_about_ten_times_as_long(tmp_path):
    def seconds(count: int) -> float:
        path = tmp_path / f"{count}.gltf"
        path.write_bytes(chained(count, count // 2))
        taken = []
        for _ in range(3):
            began = time.process_time()
            read_gltf_keyframes(path, node=count - 1)
            taken.append(time.process_time() - began)
        return min(taken)

    assert seconds(20_000) < 20 * seconds(2_000)


def test_a_cubic_rotation_of_either_sign(tmp_path):
    """q and −q are one rotation: keys are what they are with all signs alike, and a third of the way lies between."""
    angles = np.deg2rad([0, 60, 120])
    q = Rotation.from_euler("z", angles[:, None]).as_quat()
    found = []
    for signs in ([1, 1, 1], [1, -1, 1]):
        values = np.zeros((3, 3, 4))
        values[:, 1] = np.array(signs)[:, None] * q
        maker = Maker({}).animate(0, "rotation", [0, 1, 2], values.reshape(9, 4), "CUBICSPLINE")
        maker.animate(0, "translation", [0, 0.5, 1, 1.5, 2], np.zeros((5, 3)))
        found.append(
            read_gltf_keyframes(maker.save(tmp_path / "a.gltf")).rotations().as_euler("zyx", degrees=True)[:, 0]
        )
    np.testing.assert_allclose(found[1], found[0], atol=1e-5)
    np.testing.assert_allclose(found[1], [0, 30, 60, 90, 120], atol=1e-4)


def test_a_skin_of_our_own_gives_the_motion_back(tmp_path):
    keys = sm.examples.spatial_keyframes()
    motion = sm.ExactNewton().solve(sm.affine_program(keys, objective=sm.Rigidity(2))).motion
    sm.write_motion(motion, tmp_path / "own.glb", seconds=motion.domain[1] - motion.domain[0])
    for node in (None, "body"):
        read = sm.read_keyframes(tmp_path / "own.glb", node=node)
        linear, translation = motion(motion.domain[0] + read.times)
        np.testing.assert_allclose(read.linear, linear, atol=2e-6)
        np.testing.assert_allclose(read.translation, translation, atol=2e-6 * np.abs(translation).max())


def test_sparse_accessors_and_zeros(tmp_path):
    path = moving().save(tmp_path / "a.gltf")
    document = json.loads(path.read_text())
    before = read_keyframes(path)
    accessor = document["accessors"][1]
    values = np.array([[7.0, 8.0, 9.0]], "<f4").tobytes()
    data = b"\x01\0\0\0" + values
    document["buffers"].append({"byteLength": len(data), "uri": "data:;base64," + base64.b64encode(data).decode()})
    k = len(document["buffers"]) - 1
    views = document["bufferViews"]
    views += [
        {"buffer": k, "byteOffset": 0, "byteLength": 1},
        {"buffer": k, "byteOffset": 4, "byteLength": len(values)},
    ]
    accessor["sparse"] = {
        "count": 1,
        "indices": {"bufferView": len(views) - 2, "componentType": 5121},
        "values": {"bufferView": len(views) - 1},
    }
    path.write_text(json.dumps(document))
    after = read_keyframes(path)
    np.testing.assert_array_equal(after.translation[1], [7, 8, 9])
    np.testing.assert_array_equal(after.translation[[0, 2]], before.translation[[0, 2]])
    del accessor["bufferView"]
    path.write_text(json.dumps(document))
    np.testing.assert_array_equal(read_keyframes(path).translation, [[0, 0, 0], [7, 8, 9], [0, 0, 0]])


def test_data_in_folders_below(tmp_path):
    path = moving().save(tmp_path / "a.gltf")
    document = json.loads(path.read_text())
    before = read_keyframes(path)
    data = base64.b64decode(document["buffers"][0]["uri"].partition(",")[2])
    (tmp_path / "data" / "of").mkdir(parents=True)
    (tmp_path / "data" / "of" / "a.bin").write_bytes(data)
    for uri in ("data/of/a.bin", "./data/./of/a.bin"):
        document["buffers"][0]["uri"] = uri
        path.write_text(json.dumps(document))
        np.testing.assert_array_equal(read_keyframes(path).translation, before.translation)
    (tmp_path / "data" / "out").symlink_to(tmp_path.parent)
    for uri in ("data/../a.bin", "data/out/a.bin", "data//a.bin"):
        document["buffers"][0]["uri"] = uri
        path.write_text(json.dumps(document))
        with pytest.raises(InputError, match=r"buffers\[0\].uri"):
            read_keyframes(path)


def test_the_first_animation_that_moves_the_node(tmp_path):
    path = moving().save(tmp_path / "a.gltf")
    document = json.loads(path.read_text())
    other = json.loads(json.dumps(document["animations"][0])) | {"name": "other"}
    other["channels"][0]["target"]["node"] = 1
    document["animations"].append(other)
    path.write_text(json.dumps(document))
    read = sm.files.read_recording(path, node=1)
    assert read.notes[0] == "animation 'other' is read, of 'walk', 'other'"
    assert sm.files.read_recording(path).notes[0] == "animation 'walk' is read, of 'walk', 'other'"
    with pytest.raises(InputError, match=r"0 animations are called 'run': .* there are 'walk', 'other'"):
        read_keyframes(path, animation="run")


@pytest.mark.parametrize("packed", ["EXT_meshopt_compression", "KHR_draco_mesh_compression"])
def test_the_mesh_may_be_compressed_where_the_animation_is_plain(tmp_path, packed):
    """Meshes as exporters pack them: buffers without data to fall back on, accessors without a view."""
    expected = read_keyframes(moving().save(tmp_path / "plain.gltf"))
    path = moving().save(tmp_path / "packed.gltf")
    document = json.loads(path.read_text())
    document["extensionsUsed"] = document["extensionsRequired"] = [packed]
    corners = {"componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0]}
    view = {"buffer": 0, "byteOffset": 0, "byteLength": 4}
    primitive: dict[str, object] = {"attributes": {"POSITION": len(document["accessors"])}}
    if packed == "EXT_meshopt_compression":
        document["buffers"].append({"byteLength": 36, "extensions": {packed: {"fallback": True}}})
        corners["bufferView"] = len(document["bufferViews"])
        code = {**view, "byteStride": 12, "count": 3, "mode": "ATTRIBUTES"}
        document["bufferViews"].append({"buffer": 1, "byteLength": 36, "byteStride": 12, "extensions": {packed: code}})
    else:
        code = {"bufferView": len(document["bufferViews"]), "attributes": {"POSITION": 0}}
        document["bufferViews"].append(view)
        primitive["extensions"] = {packed: code}
    document["accessors"].append(corners)
    document["meshes"] = [{"primitives": [primitive]}]
    document["nodes"][0]["mesh"] = 0
    path.write_text(json.dumps(document))
    read = read_keyframes(path)
    assert read == expected
    assert sm.files.read_skeleton(path).names == sm.files.read_skeleton(tmp_path / "plain.gltf").names
