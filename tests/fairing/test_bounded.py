"""Bounded fairing: where few bounds press or none, many or all, along unequal sides, and what cannot hold."""

from typing import Any

import numpy as np
import pytest

from symmotion import InputError
from symmotion.fairing import Continued, Coordinates, FairingStatus, Jumps, NetKeyframe, fair, fairing_program
from symmotion.fairing.borders import Freedom
from symmotion.fairing.least_squares import LeastSquares
from symmotion.fairing.pressing import pressed
from symmotion.motions import DualQuaternions, TwoParameterMotion
from symmotion.motions.nets import noisy_net, smooth_net
from symmotion.program import Evaluator
from symmotion.systems import Condensed, system_of

loose: Any = fair  # for options by name
SMALL = noisy_net(smooth_net(9), 0.01, seed=1)


@pytest.mark.parametrize(("n", "ring", "seed", "sigmas"), [(9, True, 3, 2.5), (12, True, 1, 3.0), (9, False, 0, 3.5)])
@pytest.mark.parametrize("keyframes", [0, 1])
def test_bounds_that_hardly_press_leave_a_certified_minimum(n, ring, seed, sigmas, keyframes):
    """Some moves of a net change no jump: the nearest of the fairest nets is the one minimum all the same."""
    net = noisy_net(smooth_net(n), 0.01, seed=seed, ring=ring)
    u, v = (0.4 * a + 0.6 * b for a, b in net.domain)
    kept = [((u, v), net(u, v))] * keyframes
    r = fair(net, "bounded", tolerance=0.01 * sigmas, keyframes=kept)
    assert r.status == FairingStatus.SOLVED
    assert r.certificate is not None
    assert r.certificate.inertia == "positive"
    assert r.displacement.max() <= 0.01 * sigmas * (1 + 1e-9)
    # The least squares of the lightest weight are the fairest there are, and the minimum where no bound presses.
    light = fair(net, "least-squares", weight=1e-9, keyframes=kept)
    assert r.final >= light.final * (1 - 1e-3)
    if light.displacement.max() < 0.01 * sigmas:
        assert r.final == pytest.approx(light.final, rel=1e-3)


@pytest.mark.parametrize("tolerance", [0.005, 0.01, 0.02])
def test_weights_of_the_least_squares_are_the_multipliers(tolerance):
    """(K + Λ) δ = −b with μ = λ δ²: both by the fixed point and by Newton's method."""
    coordinates = Coordinates.of(SMALL)
    jumps = Jumps.of(coordinates.bases)
    problem = LeastSquares(jumps, coordinates.net, Freedom.of(coordinates, jumps))
    guess = pressed(problem, np.full((9, 9), tolerance))
    assert guess is not None
    r = fair(SMALL, "bounded", tolerance=tolerance)
    prices = np.zeros((9, 9))
    prices[1:-1, 1:-1] = r.multipliers["bounds"].reshape(7, 7)
    np.testing.assert_allclose(guess.multipliers, prices, atol=0.05 * prices.max())
    np.testing.assert_allclose(guess.net, r.motion.real, atol=0.05 * tolerance)


def test_a_net_and_its_transpose_have_the_same_minimum_and_band():
    net = noisy_net(smooth_net(26, 6), 0.01, seed=1)
    other = TwoParameterMotion(net.v, net.u, np.swapaxes(net.real, 0, 1))
    found, bands = [], []
    for motion in (net, other):
        found.append(fair(motion, "bounded", tolerance=0.01))
        program = fairing_program(motion)
        system = system_of(program, Evaluator(program), program.x0)
        assert isinstance(system, Condensed)
        bands.append(system.band)
    assert found[1].final == pytest.approx(found[0].final, rel=1e-9)
    np.testing.assert_allclose(np.swapaxes(found[1].motion.real, 0, 1), found[0].motion.real, atol=1e-9)
    assert bands[0] == bands[1]


@pytest.mark.parametrize("size", [1e-8, 1e8])
def test_the_unit_of_a_metric_does_not_matter(size):
    metric = size * np.eye(4)
    for method, mine, own in (
        ("bounded", {"tolerance": 0.02 * size**0.5}, {"tolerance": 0.02}),
        ("least-squares", {"target": 1e-6}, {"target": 1e-6}),
    ):
        one = loose(SMALL, method, metric=metric, **mine)
        other = loose(SMALL, method, **own)
        assert one.final == pytest.approx(other.final, rel=1e-4)


def test_controls_that_borders_alone_move_further_are_named():
    beside = noisy_net(smooth_net(9), 0.01, seed=2, ring=True)
    with pytest.raises(InputError, match=r"borders alone move control \(0, 0\) further, by 0"):
        fair(SMALL, "bounded", tolerance=0.02, borders={"u0": Continued(beside, "G0")})


def test_bounds_that_a_keyframe_breaks_are_named_beside_it():
    u, v = (0.5 * (a + b) for a, b in SMALL.domain)
    turned = DualQuaternions.from_axis_angle([1.0, 0, 0], 1.5) @ DualQuaternions.from_matrices(SMALL(u, v).linear)
    r = fair(SMALL, "bounded", tolerance=0.02, keyframes=[NetKeyframe((u, v), turned)])
    assert r.status == FairingStatus.FAILED
    assert "'keyframes' and 'bounds' cannot hold together" in r.message


def test_a_constant_hessian_that_is_kept_has_the_bits_of_the_first():
    program = fairing_program(SMALL, weight=1.0)
    evaluator = Evaluator(program, "interpreted")
    system = system_of(program, evaluator, program.x0)
    first = evaluator.second_order(program.x0, system.pattern)
    again = evaluator.second_order(program.x0, system.pattern)
    elsewhere = evaluator.second_order(2 * program.x0, system.pattern)
    fresh = Evaluator(program, "interpreted").second_order(2 * program.x0, system.pattern)
    for one, two in zip((*first, *elsewhere), (*again, *fresh), strict=True):
        np.testing.assert_array_equal(one, two)
    np.testing.assert_array_equal(first[1], elsewhere[1])
