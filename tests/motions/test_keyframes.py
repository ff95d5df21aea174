"""Keyframes and positions at the prompt: what they are made of, what they say, what they refuse."""

from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import symmotion as sm
from symmotion.motions import Affine, Keyframe, as_keyframes
from symmotion.motions.quaternions import OrientationKeys
from symmotion.motions.rotations import as_quaternions

KEYS = sm.examples.spatial_keyframes()
TURNS = Rotation.random(4, random_state=3)
PLACES = np.random.default_rng(2).normal(size=(4, 3))
TIMES = [0.0, 1.0, 2.5, 3.0]


def test_an_index_gives_one_keyframe_and_a_slice_several():
    first, last = KEYS[0], KEYS[-1]
    assert isinstance(first, Keyframe)
    assert first.time == KEYS.times[0] and last == KEYS[3] and last == KEYS[np.int64(3)] and first != last
    time, linear, translation = last
    assert time == KEYS.times[3]
    np.testing.assert_array_equal(linear, KEYS.linear[3])
    np.testing.assert_array_equal(translation, KEYS.translation[3])
    assert list(KEYS) == [KEYS[i] for i in range(4)]
    assert len(set(KEYS)) == 4
    assert KEYS[1:] == sm.Keyframes(KEYS.times[1:], KEYS.linear[1:], KEYS.translation[1:])
    assert KEYS[[0, 3]] == KEYS[::3] == KEYS[np.array([True, False, False, True])]
    with pytest.raises(IndexError):
        KEYS[4]
    with pytest.raises(sm.InputError, match="1 keyframe: a motion needs at least 2"):
        KEYS[1:2]
    assert repr(sm.examples.quarter_turn()[1]) == "Keyframe(time 1, linear [[ 0. -1.] [ 1. 0.]], translation [3. 0.])"


def test_a_position_moves_points_follows_another_and_goes_back():
    a, b, points = KEYS[1].position, KEYS[2].position, np.random.default_rng(0).normal(size=(5, 3))
    np.testing.assert_allclose(a(points), points @ a.linear.T + a.translation)
    np.testing.assert_allclose(a(points[0]), a(points)[0])
    np.testing.assert_allclose((a @ b)(points), a(b(points)))
    np.testing.assert_allclose((a @ b).matrix, a.matrix @ b.matrix)
    np.testing.assert_allclose(a.inverse()(a(points)), points, atol=1e-14)
    many = Affine(KEYS.linear, KEYS.translation)
    assert many.matrix.shape == (4, 4, 4) and many(points).shape == (4, 5, 3) and many(points[0]).shape == (4, 3)
    np.testing.assert_allclose((many @ many.inverse()).matrix, np.broadcast_to(np.eye(4), (4, 4, 4)), atol=1e-13)
    assert Affine.of(many.matrix) == many and hash(Affine.of(many.matrix)) == hash(many)
    assert Affine.of(a) is a and a != b and a != 3
    linear, translation = a
    assert linear is a.linear and translation is a.translation
    assert repr(many) == "Affine(linear (4, 3, 3), translation (4, 3))"
    turn = Affine([[0, -1], [1, 0]], [3, 0])  # type: ignore
    np.testing.assert_array_equal(turn([1, 0]), [3, 1])
    assert repr(turn) == "Affine(linear [[ 0. -1.] [ 1. 0.]], translation [3. 0.])"


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Affine.of(np.eye(5)), r"homogeneous matrices of shape \(5, 5\): \(…, 3, 3\) or \(…, 4, 4\)"),
        (lambda: Affine.of(2 * np.eye(4)), "the last row must be 0, 0, 0, 1"),
        (lambda: KEYS[0].position([1.0, 2.0]), r"body points of shape \(2,\): \(3,\) or \(P, 3\)"),
        (lambda: KEYS[0].position @ np.eye(3), "call the position with them"),  # type: ignore
        (lambda: Affine(np.zeros((2, 2)), np.zeros(2)).inverse(), "singular linear part"),
    ],
)
def test_positions_refuse_what_they_cannot_do(make, message):
    with pytest.raises(sm.InputError, match=message):
        make()


def test_positions_come_in_every_form():
    plain = sm.Keyframes(np.array(TIMES), TURNS.as_matrix(), PLACES)
    q = np.roll(TURNS.as_quat(), 1, axis=1)
    matrices = Affine(TURNS.as_matrix(), PLACES)
    for given in (
        sm.Keyframes.of(TIMES, TURNS, PLACES),
        sm.Keyframes.of(TIMES, q, PLACES),
        sm.Keyframes.of(TIMES, TURNS.as_quat(), PLACES, scalar_first=False),
        sm.Keyframes.of(TIMES, matrices),
        sm.Keyframes.of(TIMES, matrices.matrix),
        as_keyframes(TIMES, TURNS.as_matrix(), PLACES),
        as_keyframes(plain),
    ):
        np.testing.assert_allclose(given.coordinates, plain.coordinates, atol=1e-14)
    planar = sm.examples.planar_keyframes()
    assert as_keyframes(planar.times, planar.linear, planar.translation) == planar
    assert as_keyframes(planar) is planar
    expected = OrientationKeys.of(TIMES, TURNS)
    for same in (q, TURNS.as_matrix()):
        np.testing.assert_allclose(OrientationKeys.of(TIMES, same).ways, expected.ways, atol=1e-14)
    again = OrientationKeys.of(TIMES, TURNS.as_quat(), scalar_first=False)
    np.testing.assert_allclose(again.quaternions, expected.quaternions, atol=1e-15)


def test_rigid_transforms_of_scipy_are_positions():
    spatial = pytest.importorskip("scipy.spatial.transform")
    if not hasattr(spatial, "RigidTransform"):
        pytest.skip("SciPy before 1.16")
    rigid = spatial.RigidTransform.from_components(PLACES, TURNS)
    keys = sm.Keyframes.of(TIMES, rigid)
    np.testing.assert_allclose(keys.linear, TURNS.as_matrix(), atol=1e-15)
    np.testing.assert_array_equal(keys.translation, PLACES)
    np.testing.assert_allclose(Affine.of(rigid[1])([1.0, 2, 3]), rigid[1].apply([1.0, 2, 3]), atol=1e-14)
    off = Rotation.from_quat(np.roll(as_quaternions(rigid), -1, axis=1)) * TURNS.inv()
    assert off.magnitude().max() < 1e-14
    with pytest.raises(sm.InputError, match="the positions have translations of their own: leave translation out"):
        sm.Keyframes.of(TIMES, rigid, PLACES)


class Index:
    """An index of times as pandas has it: no array, but made into one."""

    def __init__(self, entries):
        self.entries = entries

    def __array__(self, dtype=None, copy=None):
        return np.array(self.entries, dtype=dtype)


STEPS = [0, 250, 1750, 3000]  # ms


@pytest.mark.parametrize(
    "times",
    [
        np.datetime64("2026-03-01T12:00:00", "ns") + np.array(STEPS, dtype="timedelta64[ms]"),
        np.array(STEPS, dtype="timedelta64[ms]") + np.timedelta64(5, "s"),
        [datetime(2026, 3, 1) + timedelta(milliseconds=s) for s in STEPS],
        [datetime(2026, 3, 1, tzinfo=UTC) + timedelta(milliseconds=s) for s in STEPS],
        [timedelta(milliseconds=s + 100) for s in STEPS],
        Index(np.datetime64("2026-03-01", "ns") + np.array(STEPS, dtype="timedelta64[ms]")),
        Index([datetime(2026, 3, 1, tzinfo=UTC) + timedelta(milliseconds=s) for s in STEPS]),
    ],
    ids=["datetime64", "timedelta64", "datetimes", "zone", "timedeltas", "index", "index with a zone"],
)
def test_dates_and_durations_are_seconds_since_the_first(times):
    np.testing.assert_allclose(sm.Keyframes.of(times, TURNS).times, np.array(STEPS) / 1000, rtol=1e-15)
    np.testing.assert_allclose(as_keyframes(times, TURNS).times, np.array(STEPS) / 1000, rtol=1e-15)


def test_an_index_of_pandas_is_taken():
    pandas = pytest.importorskip("pandas")
    for zone in (None, "Europe/Vienna"):
        index = pandas.to_datetime(STEPS, unit="ms", utc=zone is not None)
        index = index if zone is None else index.tz_convert(zone)
        np.testing.assert_allclose(sm.Keyframes.of(index, TURNS).times, np.array(STEPS) / 1000, rtol=1e-15)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: as_keyframes("tour.csv"), r"keys 'tour.csv' is a path: read_keyframes\('tour.csv'\) gives"),
        (lambda: as_keyframes(Path("tour.csv"), what="recording"), r"recording 'tour.csv' is a path: read_keyframes"),
        (lambda: OrientationKeys.of("tour.csv"), "keys 'tour.csv' is a path"),
        (lambda: as_keyframes(3.0), "keys of type float: Keyframes, or times beside positions, are needed"),
        (lambda: as_keyframes(KEYS, TURNS), "keys are Keyframes, which have positions of their own"),
        (lambda: sm.Keyframes.of(TIMES, np.zeros((4, 5))), r"positions of shape \(4, 5\): \(M, d, d\)"),
        (lambda: sm.Keyframes.of(TIMES, 2 * np.eye(4)), "quaternion 0 has length 2, not 1"),
        (lambda: sm.Keyframes.of(TIMES[:3], TURNS), "3 times for 4 linear parts"),
        (lambda: sm.Keyframes.of(np.array(["2026", "NaT"], dtype="datetime64[D]"), TURNS[:2]), "keyframe 1 is NaT"),
        (lambda: sm.Keyframes.of(["noon", "night"], TURNS[:2]), "times: a list is no array of numbers"),
        (lambda: sm.Keyframes.of(np.ma.array([0.0, 1], mask=[False, True]), TURNS[:2]), "times: entries are masked"),
        (lambda: sm.Keyframes([0, 1], np.eye(3)[None] * [[[1j]], [[1]]]), "linear parts: complex numbers"),
    ],
)
def test_doors_refuse_what_is_no_keyframes_and_say_what_is(make, message):
    with pytest.raises(sm.InputError, match=message):
        make()


def test_times_are_given_by_a_method_or_as_they_are():
    timed = KEYS.with_times([1.0, 2.0, 5.0, 6.0])
    assert timed == sm.Keyframes([1.0, 2.0, 5.0, 6.0], KEYS.linear, KEYS.translation)
    assert KEYS.with_times(np.array(timed.times)) == KEYS.with_times(tuple(timed.times.tolist())) == timed
    assert KEYS.with_times("uniform").times.tolist() == np.linspace(KEYS.times[0], KEYS.times[-1], 4).tolist()
    dated = KEYS.with_times(np.array(["2025-01-01", "2025-01-02", "2025-01-04", "2025-01-05"], dtype="M8[s]"))
    assert dated.times.tolist() == [0.0, 86400.0, 3 * 86400.0, 4 * 86400.0]
    for times, message in (
        ([0.0, 1.0, 1.0, 2.0], "the time of keyframe 2, 1, repeats that of keyframe 1, 1: times must increase; leave"),
        ([0.0, 1.0], "2 times for 4 linear parts"),
        (1.0, r"times of shape \(\)"),
        ("evenly", "parametrisation 'evenly' is unknown"),
        (np.ma.array(TIMES, mask=[False, False, True, False]), "times: entries are masked"),
        ([0j, 1, 2, 3], "times: complex"),
    ):
        with pytest.raises(sm.InputError, match=message):
            KEYS.with_times(times)
    with pytest.raises(sm.InputError, match="points go with a method"):
        KEYS.with_times(TIMES, np.eye(3))


def test_crowded_keyframes_are_merged():
    many = sm.examples.random_keyframes(9, 20, seed=1)
    times = [0.0, 1e-9, 1.0, 2.0, 2 + 1e-8, 2 + 2e-8, 3.0, 4 - 1e-9, 4.0]
    merged = many.with_times(times).merged()
    assert merged.times.tolist() == [0.0, 1.0, 2.0, 3.0, 4.0]
    assert merged == many.with_times(times)[[0, 2, 3, 6, 8]]
    assert KEYS.merged() == KEYS
    assert KEYS.with_times(TIMES).merged(within=0.6).times.tolist() == [0.0, 1.0, 3.0]
    assert KEYS.with_times(TIMES).merged(within=1.0).times.tolist() == [0.0, 3.0]
    assert KEYS.merged(within=1e9).times.tolist() == KEYS.times[[0, -1]].tolist()
    with pytest.raises(sm.InputError, match="within -1: a positive number"):
        KEYS.merged(-1)


def test_lengths_of_quaternions_within_a_stated_tolerance():
    q = Rotation.from_rotvec([[0, 0, 0], [0.1, 0.2, 0.3], [1, 0, 0]]).as_quat(scalar_first=True)
    off, times = q * [[1.02], [0.97], [1.0]], [0.0, 1.0, 2.0]
    with pytest.raises(sm.InputError, match=r"quaternion 0 has length 1.02, not 1 .*norms="):
        sm.Keyframes.of(times, off)
    keys = sm.Keyframes.of(times, off, norms=0.05)
    np.testing.assert_allclose(keys.linear, sm.Keyframes.of(times, q).linear, atol=1e-15)
    curve = sm.quaternions.interpolate_quaternions(times, off, norms=0.05)
    np.testing.assert_allclose(np.abs(np.sum(curve(times) * q, axis=1)), 1, rtol=1e-12)
    for program in (sm.orientation_program(times, off, norms=0.05), sm.pose_program(times, off, np.eye(3), norms=0.05)):
        assert program.unknowns
    with pytest.raises(sm.InputError, match="quaternion 1 has length"):
        sm.Keyframes.of(times, off, norms=0.025)
    with pytest.raises(sm.InputError, match="quaternion 2 is zero"):
        sm.Keyframes.of(times, off * [[1], [1], [0]], norms=2.0)
    with pytest.raises(sm.InputError, match="norms -1: a positive number"):
        sm.Keyframes.of(times, off, norms=-1)
