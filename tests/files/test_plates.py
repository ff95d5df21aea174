"""Finite rotations of plates: poles turned by hand, and what broken files get."""

import numpy as np
import pytest

import symmotion as sm
from symmotion.errors import InputError
from symmotion.files import read_recording

LINES = """\
001 0.0 0.0 0.0 0.0 000 !! a frame
701 20.0 0.0 0.0 90.0 000 ! about x
701 0.0 0.0 0.0 0.0 000
701 10.0 90.0 0.0 30.0 000 ! about z, the pole
701 5.0 0.0 90.0 -40.0 201 ! about y
"""


@pytest.fixture
def plates(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)

    def write(content: str) -> str:
        (tmp_path / "a.rot").write_text(content)
        return "a.rot"

    return write


def test_a_plate_in_order_of_age(plates):
    recording = read_recording(plates(LINES), node="701/000")
    keys = recording.keyframes
    np.testing.assert_array_equal(keys.times, [0, 10, 20])
    turns = [[1, 0, 0], [0, 1, 0], [0, 0, 1]], [[np.sqrt(3) / 2, -0.5, 0], [0.5, np.sqrt(3) / 2, 0], [0, 0, 1]]
    np.testing.assert_allclose(keys.linear, [*turns, [[1, 0, 0], [0, 0, -1], [0, 1, 0]]], atol=1e-15)
    assert recording.notes == ("plate 701 against 000, ages in Ma",)
    assert not keys.translation.any()


@pytest.mark.parametrize(
    ("content", "node", "message"),
    [
        (LINES, None, "a.rot: 3 series of rotations fit plate; there are 001/000, 701/000, 701/201"),
        (LINES, 701, "a.rot: 2 series of rotations fit plate 701; there are 701/000, 701/201"),
        (LINES, "5", "a.rot: 0 series of rotations fit plate 5; there are 001/000"),
        (LINES, "Africa", "a.rot: node 'Africa': a plate as 801"),
        (LINES, "701/201", "a.rot: 1 keyframe"),
        ("! nothing\n", None, "a.rot: holds no rotations"),
        ("701 0 0 0 0\n", None, "a.rot, line 1: plate, age, latitude"),
        ("701 0 x 0 0 000\n", None, "a.rot, line 1: 'x' is not a number: plate, age"),
        (LINES + "701 10.0 90 0 30 000\n", "701/000", "a.rot.*line 6"),
    ],
)  # fmt: skip
def test_what_there_is_not(plates, content, node, message):
    with pytest.raises(InputError, match=message):
        sm.read_keyframes(plates(content), node=node)


def test_ages_that_repeat_are_dropped_by_name(plates):
    keys = sm.read_keyframes(plates(LINES + "701 10.0 90 0 31 000\n"), node="701/000", repeated="drop")
    np.testing.assert_array_equal(keys.times, [0, 10, 20])
