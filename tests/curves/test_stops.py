"""Lengths and constant speed of curves that stop, far away and at large times; right values are closed forms."""

import numpy as np
import pytest

import symmotion as sm
from symmotion.curves import arc_length, bezier, constant_speed, hermite_spline


@pytest.mark.parametrize(("begin", "second"), [(0.0, 1.0), (1.7e9, 1.0), (1.7e18, 1e9)])
@pytest.mark.parametrize("far", [0.0, 5e6])
def test_a_line_that_stops_is_passed_at_constant_speed(begin, second, far):
    times = begin + second * np.arange(3)
    line = hermite_spline(times, np.array([[0.0, 0.0], [2.0, 0.0], [3.0, 0.0]]) + far, np.zeros((3, 2)))
    assert arc_length(line) == pytest.approx(3.0, rel=1e-9)
    even = constant_speed(line, (0.0, 3.0))
    np.testing.assert_allclose(even([0.0, 1.0, 2.0, 3.0], 1), np.tile([1.0, 0.0], (4, 1)), atol=1e-7)
    np.testing.assert_allclose(even([0.0, 2.0, 3.0], 2), 0.0, atol=1e-7)


def test_where_a_curve_turns_or_bends_at_a_stop_is_said():
    corner = constant_speed(hermite_spline([0, 1, 2], [[0, 0], [2, 0], [2, 1]], np.zeros((3, 2))))
    with pytest.raises(sm.InputError, match="stops at time 1 and turns there"):
        corner(2.0, 1)
    bent = constant_speed(bezier([[0, 0], [0, 0], [1, 1], [2, 0]]))
    np.testing.assert_allclose(bent(0.0, 1), np.array([1, 1]) / np.sqrt(2), rtol=1e-12)
    with pytest.raises(sm.InputError, match="order 2 at constant speed is infinite"):
        bent(0.0, 2)
    with pytest.raises(sm.InputError, match="stops at time 0: the derivatives of its parameter"):
        bent.warp(0.0, 1)


def test_the_bend_of_a_parabola_passed_from_rest():
    """(τ, τ²/2) with τ = t³: its curvature at 0 is 1."""
    controls = np.zeros((7, 2))
    controls[:, 0] = [0, 0, 0, 1 / 20, 4 / 20, 10 / 20, 1]  # t³ in Bernstein form: C(j, 3)/C(6, 3)
    controls[6, 1] = 0.5  # t⁶/2
    even = constant_speed(bezier(controls))
    np.testing.assert_allclose(even(0.0, 1), [1, 0], atol=1e-12)
    np.testing.assert_allclose(even(0.0, 2), [0, 1], atol=1e-9)


def test_a_body_that_rests_has_no_length():
    assert arc_length(bezier(np.full((4, 2), 5e6))) == 0
    with pytest.raises(sm.InputError, match="no length"):
        constant_speed(bezier(np.full((4, 2), 5e6)))
