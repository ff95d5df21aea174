"""Where knots lie: equally spaced in even intervals, closer towards short neighbours."""

import numpy as np
import pytest

import symmotion as sm
from symmotion.design.spans import graded_times, refined_times


@pytest.mark.parametrize("refine", [0, 1, 3])
def test_even_intervals_are_divided_equally(refine):
    times = np.array([0.0, 1.0, 4.9, 6.0])
    np.testing.assert_array_equal(graded_times(times, refine), refined_times(times, refine))
    np.testing.assert_allclose(np.diff(graded_times(np.arange(4.0), refine)), 1 / (refine + 1))


@pytest.mark.parametrize("refine", [0, 1, 2])
@pytest.mark.parametrize("ratio", [5.0, 100.0, 1e6])
def test_spans_grow_no_faster_than_they_are_away_from_a_short_interval(refine, ratio):
    times = np.array([0.0, ratio, ratio + 1, 2 * ratio + 1])
    breaks = graded_times(times, refine)
    assert np.isin(times, breaks).all()
    spans, least = np.diff(breaks), 1 / (refine + 1)
    assert (spans > 0).all() and spans.max() <= ratio / (refine + 1) * (1 + 1e-12)
    # A distance grows by at most e over its own length, whatever the ratio, so that their number is its logarithm's.
    assert np.exp(np.abs(np.diff(np.log(spans)))).max() <= np.e * (1 + 1e-6)
    assert len(spans) <= 4 * (refine + 2) + 4 * np.log(ratio)
    np.testing.assert_allclose(breaks, (2 * ratio + 1 - breaks)[::-1], atol=1e-9 * ratio)
    at = np.searchsorted(breaks, ratio)
    assert breaks[at] - breaks[at - 1] <= np.e * least


def test_a_closed_motion_has_its_first_interval_beside_the_last():
    times = np.array([0.0, 50.0, 100.0, 101.0])
    assert len(graded_times(times, 1, closed=True)) > len(graded_times(times, 1))


def test_orientation_and_pose_programs_have_graded_knots():
    q = np.array([[1.0, 0, 0, 0], [0.6, 0.8, 0, 0], [0.6, 0, 0.8, 0], [0.6, 0, 0, 0.8]])
    times = np.array([0.0, 20.0, 21.0, 22.0])
    breaks = graded_times(times, 1)
    assert len(breaks) > 7
    turning, moving = sm.orientation_program(times, q), sm.pose_program(times, q, np.eye(4)[:, :3])
    for design in (turning.design, moving.design.turning):
        np.testing.assert_allclose(design.space.basis.breakpoints, breaks)
    given = sm.orientation_program(times, q, knots=[10.0, 20.0, 20.5, 21.0, 21.5])
    np.testing.assert_allclose(given.design.space.basis.breakpoints, [0, 10, 20, 20.5, 21, 21.5, 22])
