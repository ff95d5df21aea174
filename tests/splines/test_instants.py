"""Which times are the same."""

import numpy as np
import pytest

import symmotion as sm
from symmotion.splines import same_times, unified
from symmotion.splines.instants import distinct, rounding

EPS = np.finfo(float).eps


@pytest.mark.parametrize("origin", [0.0, -3.0, 1e3, 1e9])
@pytest.mark.parametrize("scale", [1e-9, 1.0, 1e9])
def test_sums_of_steps_are_the_times_that_they_mean(origin, scale):
    step = scale / 3
    summed = origin * scale + np.cumsum(np.full(1000, step))
    meant = origin * scale + step * np.arange(1, 1001)
    assert origin or (summed != meant).any()
    assert same_times(summed, meant)
    np.testing.assert_array_equal(unified(summed, meant), meant)
    assert len(distinct([*summed, *meant])) == 1000


def test_times_that_can_be_told_apart_are_not_the_same():
    assert not same_times([0.0, 1.0], [0.0, 1.0 + 1e-11])
    assert not same_times([1.7e9, 1.7e9 + 1], [1.7e9, 1.7e9 + 1 + 1e-5])
    assert not same_times([0.0], [0.0, 1.0]) and same_times([], [])
    assert rounding([0.0, 2.0]) == 2e-12 and rounding([1e9, 1e9 + 1]) == pytest.approx(4 * EPS * 1e9)


def test_the_first_that_is_given_stands_for_those_that_are_the_same():
    times = np.array([[2 - 2e-16, 0.3], [5.0, 0.1 + 0.2]])
    np.testing.assert_array_equal(unified(times, [2.0]), [[2.0, 0.3], [5.0, 0.3]])
    np.testing.assert_array_equal(unified(times)[:, 1], [0.3, 0.3])
    assert unified(2 - 2e-16, [2.0, 4.0]).shape == () and unified([], [1.0]).size == 0
    assert times[0, 0] == 2 - 2e-16


def test_knots_that_agree_up_to_rounding_are_copies_of_one():
    knots = [0.0, 0, 0, 0, 0.3, 0.1 + 0.2, 1 - 1e-16, 1, 1, 1]
    basis = sm.splines.BSplineBasis(knots, 3)
    np.testing.assert_array_equal(basis.breakpoints, [0, 0.3, 1])
    assert basis == sm.splines.BSplineBasis([0.0, 0, 0, 0, 0.3, 0.3, 1, 1, 1, 1], 3)
    spline = sm.splines.Spline(basis, np.arange(6.0))
    again = spline.refined([0.3 + 1e-16])
    assert (again.basis.knots == 0.3).sum() == 3
    np.testing.assert_allclose(again(np.linspace(0, 1, 50)), spline(np.linspace(0, 1, 50)), atol=1e-14)
    with pytest.raises(sm.InputError, match=r"0\.3 has more than degree"):
        again.refined([0.3, 0.1 + 0.2])


@pytest.mark.parametrize("step", [1e-160, 1e-320, 1e160, 1e308 / 3])
def test_steps_whose_powers_are_no_numbers_are_refused(step):
    keys, times = sm.examples.random_keyframes(3, 40, seed=1), step * np.arange(3)
    turns = keys.rotations()
    for call in (
        lambda: keys.with_times(times),
        lambda: sm.splines.BSplineBasis.clamped(times, 2),
        lambda: sm.splines.cubic_interpolant(times, keys.translation),
        lambda: sm.curves.catmull_rom(times, keys.translation),
        lambda: sm.curves.bezier(keys.translation, (0.0, step)),
        lambda: sm.interpolants.squad(times, turns),
        lambda: sm.orientation_program(times, turns),
        lambda: sm.curve_program([sm.constraints.CurveCondition.at(times, keys.translation)]),
    ):
        with pytest.raises(sm.InputError, match=r"apart: between 1e-30 and 1e\+30 is needed"):
            call()
