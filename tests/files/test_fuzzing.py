"""Readers on files that nobody wrote: an answer that is finite, or an InputError of one line."""

import gzip
import json
import warnings
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from movements import MOTIONS, NET

import symmotion as sm
from symmotion.files import read_gltf_keyframes, read_two_parameter, write_motion, write_two_parameter

QUICK = settings(
    derandomize=True,
    max_examples=60,
    deadline=None,
    database=None,
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow],
)
BVH = (
    "HIERARCHY\nROOT hip\n{\nOFFSET 0 1 2\nCHANNELS 3 Zrotation Xposition Yposition\nEnd Site\n{\nOFFSET 0 0 1\n}\n}\n"
)
BVH += "MOTION\nFrames: 2\nFrame Time: 0.1\n1 2 3\n4 5 6\n"
KEYS = sm.examples.random_keyframes(3, 50, seed=1)
READ = {
    **dict.fromkeys(["tum", "kitti", "csv", "json", "bvh", "txt", "log", "usda", "rot"], sm.read_keyframes),
    **dict.fromkeys(["images.txt", "transforms.json", "motive.csv", "euroc.csv", "tum.gz"], sm.read_keyframes),
    "skin.glb": read_gltf_keyframes,
    **dict.fromkeys(["glb", "gltf"], read_gltf_keyframes),
    **dict.fromkeys(["npz", "net.json"], read_two_parameter),
    **dict.fromkeys(["saved.json"], sm.load),
}
EYE = "1 0 0 2\n0 1 0 0\n0 0 1 0\n0 0 0 1\n"
TEXTS = {
    "usda": '#usda 1.0\n(\n    upAxis = "Z"\n)\ndef Xform "A" (\n    kind = "b"\n)\n{\n'
    "    float xformOp:rotateZ.timeSamples = { 0: 1, 5: 2 }\n    double3 xformOp:translate = (1, 2, 3) # c\n"
    '    uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:rotateZ"]\n}\n',
    "rot": "701 0.0 0.0 0.0 0.0 000 !a\n701 10.5 80.12 50.8 -2.5 000\n",
    "log": f"0 0 1\n{EYE}1 1 2\n{EYE}",
    "images.txt": "# IMAGE_ID, QW, QX, QY, QZ, TX\n1 1 0 0 0 0 0 0 1 a.png\n1 2 3\n2 1 0 0 0 1 2 3 1 b.png\n\n",
    "transforms.json": json.dumps({"frames": [{"time": t, "transform_matrix": np.eye(4).tolist()} for t in (0, 1)]}),
    "motive.csv": "Format Version,1.2,Length Units,Meters\n\n,,Rigid Body,Rigid Body\n"
    "Frame,Time (Seconds),X,Y,Z,W,X,Y,Z\n0,0,0,0,0,1,0,0,0\n1,0.5,0,0,0,1,1,2,3\n",
    "euroc.csv": "#timestamp [ns], p_x [m], p_y [m], p_z [m], q_w [], q_x [], q_y [], q_z []\n"
    "1403715524907143168,0,0,0,1,0,0,0\n1403715524912143168,0,0,0,1,0,0,0\n",
}
# What stands for much in files: signs, brackets, words for what is no number, sizes that nothing has.
PIECES = [
    b"nan",
    b"-inf",
    b"1e999",
    b"9" * 30,
    b"-1",
    b"0",
    b"[",
    b"]",
    b"{}",
    b'"',
    b",",
    b"\x00",
    b"\xff\xfe",
    b"\n",
    b"null",
]


def sample(directory: Path, kind: str) -> bytes:
    """A good file of a kind."""
    path = directory / f"good.{kind}"
    if kind == "bvh":
        return BVH.encode()
    if kind == "txt":
        return b"0 0 0 0 0 0 0 1\n1 1 0 0 0 0 0 1\n"
    if kind in TEXTS:
        return TEXTS[kind].encode()
    if kind == "tum.gz":
        return gzip.compress(sample(directory, "tum"))
    if kind == "skin.glb":
        write_motion(MOTIONS["affine"], path)
        return path.read_bytes()
    if kind in ("npz", "net.json"):
        write_two_parameter(NET, path)
    elif kind == "glb":
        write_motion(MOTIONS["pose"], path)
    elif kind == "gltf":
        whole = sample(directory, "glb")
        return whole[20 : 20 + int.from_bytes(whole[12:16], "little")]
    elif kind == "saved.json":
        MOTIONS["pose"].save(path)
    else:
        sm.write_keyframes(sm.Keyframes(np.arange(3.0), KEYS.linear, KEYS.translation), path)
    return path.read_bytes()


@pytest.fixture(scope="module")
def samples(tmp_path_factory):
    return {kind: sample(tmp_path_factory.mktemp("good"), kind) for kind in READ}


def changed(data: st.DataObject, whole: bytes) -> bytes:
    """The file cut off, with pieces put in, or with bytes that are others."""
    text = bytearray(whole)
    for _ in range(data.draw(st.integers(1, 4))):
        place = data.draw(st.integers(0, len(text)))
        length = data.draw(st.sampled_from([0, 0, 1, 1, 4, 20, len(text)]))
        piece = data.draw(st.sampled_from(PIECES) | st.binary(max_size=6))
        text[place : place + length] = piece
    return bytes(text)


@pytest.mark.parametrize("kind", READ)
@QUICK
@given(data=st.data())
def test_whatever_is_in_a_file(kind, samples, tmp_path, data):
    path = tmp_path / f"file.{kind}"
    path.write_bytes(changed(data, samples[kind]))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        try:
            found = READ[kind](path)
        except sm.InputError as error:
            message = str(error)
            assert message.isprintable() and len(message) <= 2000 and path.name in message
            assert "cannot be read as" not in message  # which is said of what a reader has not thought of
        else:
            if isinstance(found, sm.Keyframes):
                assert all(np.isfinite(a).all() for a in (found.times, found.linear, found.translation))


JSON = st.recursive(
    st.none() | st.booleans() | st.floats() | st.integers() | st.text(max_size=3),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=3), inner, max_size=3),
    max_leaves=6,
)


@pytest.mark.parametrize("kind", ["json", "transforms.json", "gltf", "net.json", "saved.json"])
@QUICK
@given(data=st.data())
def test_whatever_an_entry_of_a_document_is(kind, samples, tmp_path, data):
    document = json.loads(samples[kind])
    inside = document
    while True:
        keys = list(inside) if isinstance(inside, dict) else range(len(inside))
        if not keys:
            break
        key = data.draw(st.sampled_from(keys))
        if not isinstance(inside[key], dict | list) or data.draw(st.integers(0, 2)) == 0:
            inside[key] = data.draw(JSON)
            break
        inside = inside[key]
    path = tmp_path / f"file.{kind}"
    path.write_text(json.dumps(document))
    try:
        READ[kind](path)
    except sm.InputError as error:
        assert str(error).isprintable() and path.name in str(error)
