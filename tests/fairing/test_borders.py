from typing import Any

import numpy as np
import pytest

import symmotion as sm
from symmotion.fairing import Continued, fair, fairing_program
from symmotion.motions import TwoParameterMotion, noisy_net, smooth_net

SPHERICAL = noisy_net(smooth_net(12, 9), 0.018, seed=0, ring=True)
SPATIAL = noisy_net(smooth_net(10, 9, spatial=True), 0.02, translation=0.05, seed=1, ring=True)
CLAMPED = noisy_net(smooth_net(9, 11, knots="clamped"), 0.02, seed=2, ring=True)
NETS = {"spherical": SPHERICAL, "spatial": SPATIAL, "clamped": CLAMPED}
ORDERS: Any = ("G0", "G1", "G2")
METHODS = {"greedy": {"max_steps": 40}, "orthogonal": {"max_steps": 40}, "least-squares": {}}
loose: Any = fair


def across(motion: Any, side, order):
    """The derivative of the dual quaternions across a border, along it."""
    k = "uv".index(side[0])
    a, b = motion.domain[1 - k]
    along = np.linspace(a, b, 9)
    end = motion.domain[k][int(side[1])]
    at, nu = ((end, along), (order, 0)) if k == 0 else ((along, end), (0, order))
    return np.concatenate(motion.pair(*at, nu), axis=-1)


@pytest.mark.parametrize("order", [0, 1, 2])
@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("net", NETS.values(), ids=NETS)
def test_a_border_is_held_with_its_derivatives_and_no_more(net, method, order):
    r = loose(net, method, borders=f"G{order}", **METHODS[method])
    for side in ("u0", "u1", "v0", "v1"):
        for k in range(order + 1):
            np.testing.assert_allclose(across(r.motion, side, k), across(net, side, k), atol=1e-12)
    if method == "least-squares":
        assert np.abs(across(r.motion, "u0", order + 1) - across(net, "u0", order + 1)).max() > 1e-4
    assert r.final < r.initial


def test_more_freedom_at_the_border_is_a_smaller_objective():
    def cost(borders):
        r = fair(SPHERICAL, "least-squares", weight=0.1, borders=borders)
        return r.final + 0.1 * np.sum(r.displacement**2)

    costs = [cost(b) for b in ("free", "G0", "G1", "G2")]
    assert costs == sorted(costs)
    assert costs[0] < cost("ring")
    assert cost("ring") == cost({"u0": "ring"})


@pytest.mark.parametrize("borders", ["free", "G0", "G1", {"u0": "G1", "v1": "free"}])
@pytest.mark.parametrize("net", [SPHERICAL, CLAMPED], ids=["uniform", "clamped"])
def test_borders_in_the_program(net, borders):
    closed = fair(net, "least-squares", weight=0.3, borders=borders)
    solution: Any = sm.ExactNewton().solve(fairing_program(net, weight=0.3, borders=borders)).require(1e-8)
    np.testing.assert_allclose(solution.motion.real, closed.motion.real, atol=1e-10)


@pytest.mark.parametrize("knots", ["uniform", "clamped"])
@pytest.mark.parametrize("order", [0, 1, 2])
def test_a_neighbouring_net_is_continued(order, knots):
    """The neighbour's end and this net's start agree up to the order, and up to the neighbour's factor."""
    whole = noisy_net(smooth_net(14, 9, knots=knots, spatial=True), 0.01, translation=0.02, seed=3, ring=True)
    left = TwoParameterMotion.from_displacements(_rows(whole, slice(0, 8)), knots, knots)
    right = TwoParameterMotion.from_displacements(_rows(whole, slice(7, 14)), knots, knots)
    other = left.with_controls(-2.0 * left.real, -2.0 * left.control_displacements.dual)
    for method in METHODS:
        borders = {"u0": Continued(other, ORDERS[order])}
        r = loose(right, method, borders=borders, **METHODS[method])
        one, two = left(left.domain[0][1], np.linspace(*left.domain[1], 7)), None
        two = r.motion(r.motion.domain[0][0], np.linspace(*left.domain[1], 7))
        np.testing.assert_allclose(two.linear, one.linear, atol=1e-11)
        np.testing.assert_allclose(two.translation, one.translation, atol=1e-11)
        factor = np.sum(across(r.motion, "u0", 0) * across(left, "u1", 0)) / np.sum(across(left, "u1", 0) ** 2)
        for k in range(3):
            error = np.abs(across(r.motion, "u0", k) - factor * across(left, "u1", k)).max()
            assert (error < 1e-11) == (k <= order)
    steep = fair(right, "least-squares", borders={"u0": Continued(left, "G1", ratio=2.0)})
    np.testing.assert_allclose(
        across(steep.motion, "u0", 1) @ np.eye(8) / across(left, "u1", 1),
        2 * across(steep.motion, "u0", 0) / across(left, "u1", 0),
        rtol=1e-6,
    )


def _rows(motion, rows):
    pair = motion.control_displacements
    return sm.motions.DualQuaternions(pair.real[rows], pair.dual[rows])


def test_curves_have_two_ends():
    curve = SPHERICAL.isoparametric(v=4.5)
    r = fair(curve, "least-squares", borders={"u0": "G1", "u1": "free"})
    a = curve.domain[0]
    for k in (0, 1):
        np.testing.assert_allclose(r.motion.pair(a, k)[0], curve.pair(a, k)[0], atol=1e-13)
    assert r.displacement[-1] > 1e-4


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: loose(CLAMPED, borders="G3"), "border u0 'G3' is unknown; there are ring, free, G0, G1, G2"),
        (lambda: loose(CLAMPED, borders={"w0": "G1"}), "border 'w0' is unknown"),
        (lambda: loose(CLAMPED, borders="free", region=((2.0, 4.0), (2.0, 4.0))), "borders go with a whole net"),
        (
            lambda: loose(CLAMPED, borders={"u0": Continued(SPHERICAL)}),
            "border u0: the neighbour has other knots in v",
        ),
        (
            lambda: loose(CLAMPED, borders={"u0": Continued(CLAMPED, "G0"), "v0": Continued(CLAMPED, "G0")}),
            "borders u0 and v0 contradict each other near control 0 along u0",
        ),
        (lambda: loose(CLAMPED, borders={"u0": Continued(CLAMPED, "G0", ratio=0.0)}), "border u0: ratio 0.0"),
        (lambda: loose(CLAMPED, borders={"u0": Continued(SPATIAL)}), "border u0"),
        (lambda: loose(SPATIAL, borders={"u0": Continued(SPATIAL)}, parts="translation"), "not in parts 'translation'"),
        (
            lambda: loose(smooth_net(5, 9), borders={"u0": Continued(smooth_net(5, 9), "G2"), "u1": "G2"}),
            "borders u0 and u1 share controls",
        ),
        (lambda: loose(smooth_net(6, 9), borders="G2"), "borders u0 and u1 leave none of the 6 controls in u free"),
    ],
)
def test_bad_borders_are_named(make, message):
    with pytest.raises(sm.InputError, match=message):
        make()
