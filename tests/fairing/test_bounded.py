"""Bounded fairing where few bounds press or none, and along nets of unequal sides."""

import numpy as np
import pytest

from symmotion.fairing import FairingStatus, fair, fairing_program
from symmotion.motions import TwoParameterMotion
from symmotion.motions.nets import noisy_net, smooth_net
from symmotion.program import Evaluator
from symmotion.systems import Condensed, system_of


@pytest.mark.parametrize(
    ("n", "ring", "seed", "sigmas"), [(9, True, 3, 2.5), (12, True, 1, 3.0), (9, False, 0, 3.5), (15, False, 3, 4.0)]
)
def test_bounds_that_do_not_press_leave_the_least_squares(n, ring, seed, sigmas):
    """Some moves of a net change no jump: without bounds that press the nearest of the fairest nets is the minimum."""
    net = noisy_net(smooth_net(n), 0.01, seed=seed, ring=ring)
    r = fair(net, "bounded", tolerance=0.01 * sigmas)
    assert r.status == FairingStatus.SOLVED
    assert r.certificate is not None
    assert r.certificate.inertia == "positive"
    light = fair(net, "least-squares", weight=1e-9)
    pressing = r.displacement.max() > 0.01 * sigmas * (1 - 1e-9)
    assert pressing == (light.displacement.max() > 0.01 * sigmas)
    assert r.final == pytest.approx(light.final, rel=0.02) or pressing
    assert r.final >= light.final * (1 - 1e-3)


def test_a_net_and_its_transpose_have_the_same_minimum_and_band():
    net = noisy_net(smooth_net(26, 6), 0.01, seed=1)
    other = TwoParameterMotion(net.v, net.u, np.swapaxes(net.real, 0, 1))
    found, bands = [], []
    for motion in (net, other):
        found.append(fair(motion, "bounded", tolerance=0.01))
        program = fairing_program(motion, tolerance=0.01)
        system = system_of(fairing_program(motion), Evaluator(program), program.x0)
        assert isinstance(system, Condensed)
        bands.append(system.band)
    assert found[1].final == pytest.approx(found[0].final, rel=1e-9)
    np.testing.assert_allclose(np.swapaxes(found[1].motion.real, 0, 1), found[0].motion.real, atol=1e-9)
    assert bands[0] == bands[1]


def test_a_constant_hessian_that_is_kept_has_the_bits_of_the_first():
    program = fairing_program(noisy_net(smooth_net(7), 0.01, seed=1), weight=1.0)
    evaluator = Evaluator(program, "interpreted")
    system = system_of(program, evaluator, program.x0)
    first = evaluator.second_order(program.x0, system.pattern)
    again = evaluator.second_order(program.x0, system.pattern)
    elsewhere = evaluator.second_order(2 * program.x0, system.pattern)
    fresh = Evaluator(program, "interpreted").second_order(2 * program.x0, system.pattern)
    for one, two in zip((*first, *elsewhere), (*again, *fresh), strict=True):
        np.testing.assert_array_equal(one, two)
    np.testing.assert_array_equal(first[1], elsewhere[1])
